"""Attractors: the motions on which runs end, distinguished by numbers of their windows.

At each point of a sweep the sustained and the divergent cases are grouped by features:
orbit radius, strongest line in the static frame, sense of whirl, energy, loss, growth
(like `GroupViaClustering` of Attractors.jl; Datseris and Wagemakers, Chaos 32, 2022,
doi:10.1063/5.0076568). Attractors of neighbouring points with the same regime and
similar features share a number.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.analysis.clusters import clusters
from hpcwhirl.analysis.regimes import Thresholds
from hpcwhirl.scene.words import REGIMES
from hpcwhirl.store.reading.reader import words

if TYPE_CHECKING:
    import xarray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Words = NDArray[np.str_]
FARTHEST = 10.0  # largest change of an attractor's features to the next point
LEAST = 1e-300  # smallest number whose logarithm is taken


@dataclass(frozen=True)
class Feature:
    """A number by which attractors are distinguished.

    Attributes
    ----------
    name : variable of the results
    tolerance : smallest significant difference, see `clusters`
    over : variable by whose largest |value| the number is divided, "" for none
    log : whether its logarithm is taken, so that the tolerance is relative
    """

    name: str
    tolerance: float
    over: str = ""
    log: bool = False

    def of(self, data: xarray.Dataset) -> Floats:
        """Return the feature of each case / its tolerance, (cases,), all finite."""
        value = np.asarray(data[self.name].to_numpy(), dtype=float)
        if self.over:
            value = value / max(np.abs(data[self.over].to_numpy()).max(), LEAST)
        if self.log:
            value = np.log(np.maximum(np.abs(value), LEAST))
        return np.nan_to_num(value / self.tolerance, posinf=0.0, neginf=0.0)


WHIRLS = (
    Feature("line_frequency", 0.05, "speed"),
    Feature("whirl_ratio", 0.2),
)
RADIUS = Feature("orbit_radius", 0.1, "gap_scale", log=True)
PERIOD = Feature("period", 0.5)  # only with `output.chaos`; 0 if not periodic
FEATURES = {  # {regime with several attractors: features}
    "sustained": (
        RADIUS,
        *WHIRLS,
        Feature("late_energy", 0.2, log=True),
        Feature("late_lost", 0.2, log=True),
        PERIOD,
    ),
    "divergent": (*WHIRLS, Feature("growth_rate", 0.3, log=True)),
}


@dataclass
class Known:
    """Attractors found so far: regime and features of each, by number."""

    regime: list[str] = field(default_factory=list)
    at: list[Floats] = field(default_factory=list)

    def numbered(self, regime: str, found: Sequence[Floats]) -> list[int]:
        """Return the number of each attractor found at one point; add new attractors.

        found : features of each attractor at the point, by decreasing number of starts
        """
        from scipy.optimize import linear_sum_assignment

        among = [i for i, own in enumerate(self.regime) if own == regime]
        number = dict.fromkeys(range(len(found)), -1)
        if among:
            away = np.array([[np.abs(a - self.at[i]).max() for i in among]
                             for a in found])  # fmt: skip
            for row, column in zip(*linear_sum_assignment(away), strict=True):
                if away[row, column] <= FARTHEST:
                    number[int(row)] = among[column]
                    self.at[among[column]] = found[row]
        for row, own in number.items():
            if own < 0:
                number[row] = len(self.regime)
                self.regime.append(regime)
                self.at.append(found[row])
        return list(number.values())


def attractors(data: xarray.Dataset, point: Ints) -> Words:
    """Return the name of the attractor of each case, (cases,).

    Names are ``A1 sustained``, ``A2 divergent``, ...; ``damped`` and ``undecided`` stay
    as they are, and "" is the name of a case without a regime. Groups of fewer than
    three starts are added to the nearest attractor.

    Parameters
    ----------
    data : results from `open_results`
    point : (cases,), number of the case's point of the sweep; attractors are followed
        from point to point in the order of these numbers
    """
    word = words(data["regime"])
    name = np.where(np.isin(word, [*REGIMES]), word, "").astype("<U24")
    known = Known()
    for rows, regime, features in _groups(data, word, point):
        label = clusters(features)
        middle = [np.median(features[label == k], axis=0)
                  for k in range(label.max() + 1)]  # fmt: skip
        numbers = known.numbered(regime, middle)
        name[rows] = [f"A{1 + numbers[k]} {regime}" for k in label]
    return name


def _groups(
    data: xarray.Dataset, word: Words, point: Ints
) -> Iterator[tuple[NDArray[np.intp], str, Floats]]:
    """Yield (cases, regime, features) of each point and regime with attractors."""
    features = {regime: _features(data, own) for regime, own in FEATURES.items()}
    order = np.argsort(point, kind="stable")
    ends = np.flatnonzero(np.diff(point[order])) + 1
    for rows in np.split(order, ends):
        for regime, values in features.items():
            own = rows[word[rows] == regime]
            if len(own):
                yield own, regime, values[own]


def _features(data: xarray.Dataset, features: Sequence[Feature]) -> Floats:
    """Return the features of all cases / their tolerances, (cases, features).

    Features of the centre are 0 where it does not whirl, since they are round-off then.
    """
    features = [feature for feature in features if feature.name in data]
    found = np.column_stack([feature.of(data) for feature in features])
    floor = Thresholds().whirl_floor * data["gap_scale"].to_numpy()
    still = data["orbit_radius"].to_numpy() < floor
    of_centre = np.array([feature in (RADIUS, *WHIRLS) for feature in features])
    found = np.where(still[:, None] & of_centre, 0.0, found)
    if PERIOD in features:
        periodic = words(data["motion"]) == "periodic"
        found[~periodic, features.index(PERIOD)] = 0.0
    return found
