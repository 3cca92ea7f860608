"""Attractors: the motions on which runs end, told apart by features of their windows.

A point of a sweep is one combination of the swept inputs; its cases differ in their
starts. At each point the sustained cases, and likewise the divergent ones, are grouped
by features: orbit radius, frequency of the strongest spectral line in the static frame,
sense of whirl, energy, loss, growth (like `GroupViaClustering` of Attractors.jl;
Datseris and Wagemakers, Chaos 32, 2022, doi:10.1063/5.0076568). Each group is an
attractor. Attractors of neighbouring points of the sweep with the same regime and
similar features share a number.

Cases are clustered in the space of their features. Single linkage
(`scipy.cluster.hierarchy`) joins cases that no gap separates, so that it follows
clusters of any shape; a few scattered cases around a cluster are joined to it instead
of forming their own. A partition counts only if its mean silhouette is "strong"
(Kaufman and Rousseeuw, Finding Groups in Data, 1990, Table 4: above 0.7) and if any two
clusters differ by more than a given tolerance; otherwise all cases are one cluster.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.analysis.regimes import Thresholds
from hpcwhirl.arrays import Floats
from hpcwhirl.scene.words import COUNTED
from hpcwhirl.store.reading.reader import words
from hpcwhirl.studies.shares import ends_of

if TYPE_CHECKING:
    import xarray

Ints = NDArray[np.int64]
Words = NDArray[np.str_]
FARTHEST = 10.0  # tolerances by which an attractor may change to the next point
LEAST = 1e-300  # smallest number whose logarithm is taken
STRONG = 0.7  # least mean silhouette of a partition that counts
FEWEST = 3  # least number of cases of a cluster
MOST = 2000  # largest number of cases clustered; others join the nearest one's cluster
WIDER = 2.5  # least ratio of the gap between two clusters to the widest gap in either
CUTS = 12  # largest number of partitions tried, beginning at the widest gap
NORMAL = 1.4826  # ratio of standard deviation to median absolute deviation, normal law


@dataclass(frozen=True)
class Feature:
    """A variable of the results by which attractors are told apart, and its scale.

    Attributes
    ----------
    name : variable of the results, such as "orbit_radius"
    tolerance : difference below which two values count as the same motion
    over : variable of the results by whose largest |value| it is divided; "" for none
    log : whether its logarithm is taken, so that the tolerance is relative
    """

    name: str
    tolerance: float
    over: str = ""
    log: bool = False

    def of(self, data: xarray.Dataset) -> Floats:
        """Return the variable of each case in units of its tolerance, (cases,).

        Values that are not finite become 0.

        data : results from `open_results`
        """
        value = np.asarray(data[self.name].to_numpy(), dtype=float)
        if self.over:
            value = value / max(np.abs(data[self.over].to_numpy()).max(), LEAST)
        if self.log:
            value = np.log(np.maximum(np.abs(value), LEAST))
        return np.nan_to_num(value / self.tolerance, posinf=0.0, neginf=0.0)


WHIRLS = (Feature("line_frequency", 0.05, "speed"), Feature("whirl_ratio", 0.2))
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
    """Attractors found so far along a sweep; the i-th has the number i, from 0.

    Attributes
    ----------
    regime : regime of each attractor
    at : (features,) of each attractor, in tolerances, where it was last found
    """

    regime: list[str] = field(default_factory=list)
    at: list[Floats] = field(default_factory=list)

    def numbered(self, regime: str, found: Sequence[Floats]) -> list[int]:
        """Return the numbers of the attractors found at one point of the sweep.

        One that is closest to a known attractor of its regime, within `FARTHEST`, gets
        the number of that one; the others are added to the known ones.

        regime : regime of all attractors in `found`
        found : (features,) of each attractor, by decreasing number of starts
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
    """Return the name of the attractor on which each case ends, (cases,).

    Names are ``A1 sustained``, ``A2 divergent``, ...; a damped, undecided or overloaded
    case has this word as name, a case without a result "". Groups of fewer than three
    starts are added to the nearest attractor.

    Parameters
    ----------
    data : results from `open_results`
    point : (cases,), number of the case's point of the sweep; attractors are followed
        from point to point in the order of these numbers
    """
    word = ends_of(data)
    name = np.where(np.isin(word, [*COUNTED]), word, "").astype("<U24")
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
    """Yield the cases to be clustered: those of one regime at one point of the sweep.

    Yields the indices of the m cases, (m,); their regime; and the features by which
    they are compared, (m, features), each divided by its tolerance

    word, point : (cases,), regime of each case, and number of its point of the sweep
    """
    features = {regime: _features(data, own) for regime, own in FEATURES.items()}
    order = np.argsort(point, kind="stable")
    ends = np.flatnonzero(np.diff(point[order])) + 1
    for rows in np.split(order, ends):
        for regime, values in features.items():
            own = rows[word[rows] == regime]
            if len(own):
                yield own, regime, values[own]


def _features(data: xarray.Dataset, features: Sequence[Feature]) -> Floats:
    """Return the features of all cases, in units of tolerances, (cases, features).

    Orbit radius, frequency and sense of whirl are 0 for a case whose centre is at rest,
    where they would be round-off; the period is 0 for a motion that is not periodic.
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


def clusters(features: Floats) -> Ints:
    """Return the cluster of each of n cases, (n,), numbered from 0 by falling size.

    Parameters
    ----------
    features : (n, d), d features of each case, in units of tolerances
    """
    count = len(features)
    if count < 2 * FEWEST:
        return np.zeros(count, dtype=np.intp)
    chosen = np.arange(count)
    if count > MOST:
        chosen = np.sort(np.random.default_rng(0).permutation(count)[:MOST])
    chosen = chosen[_crowded(features[chosen])]
    return _by_size(_joined(features, chosen, _parted(features[chosen])))


def _crowded(features: Floats) -> NDArray[np.intp]:
    """Return the indices of those of n cases that are not far from all others.

    Fewer than `FEWEST` cases are far if the gap between them and their neighbours is
    one that separates clusters (`WIDER`). With them inside, a cluster would have a gap
    as wide, which hides narrower gaps between other clusters.

    features : (n, d), d features of each case, in units of tolerances
    """
    from scipy.cluster.hierarchy import linkage

    kept = np.arange(len(features))
    while len(kept) >= 2 * FEWEST:
        tree = linkage(features[kept], "single")
        size, inside, parts = _branches(tree)
        small = size[parts] < FEWEST
        one = small[:, 0] != small[:, 1]
        neighbours = inside[parts[np.arange(len(tree)), small.argmin(axis=1)]]
        one &= tree[:, 2] > np.maximum(WIDER * neighbours, 1.0)
        if not one.any():
            break
        branches = parts[one, small[one].argmax(axis=1)].tolist()
        away = [case for branch in branches for case in _leaves(tree, branch)]
        kept = np.delete(kept, away)
    return kept


def _parted(features: Floats) -> Ints:
    """Return the cluster of each of n cases, (n,), in the partition of best silhouette.

    All are 0, one cluster, if no partition has a mean silhouette above `STRONG` and
    clusters that differ by more than a tolerance.

    features : (n, d), d features of each case, in units of tolerances
    """
    from scipy.cluster.hierarchy import fcluster, linkage
    from scipy.spatial.distance import pdist, squareform

    between = pdist(features)
    tree = linkage(between, "single")
    away = squareform(between)
    best, score = np.zeros(len(features), dtype=np.intp), STRONG
    for height in _gaps(tree):
        labels = fcluster(tree, np.nextafter(height, 0.0), criterion="distance")
        large = np.flatnonzero(np.bincount(labels) >= FEWEST)
        core = np.flatnonzero(np.isin(labels, large))
        labels = _joined(features, core, labels[core])
        if len(large) > 1 and _differ(features, labels):
            own = silhouette(away, labels)
            if own > score:
                best, score = labels, own
    return best


def _gaps(tree: Floats) -> Floats:
    """Return distances at which a linkage tree may be cut into clusters, largest first.

    Below such a distance the tree has two branches of at least `FEWEST` cases each, and
    the gap between them is more than `WIDER` times any gap inside either.

    tree : (n - 1, 4), result of `scipy.cluster.hierarchy.linkage` for n cases
    """
    size, inside, parts = _branches(tree)
    good = (size[parts] >= FEWEST).all(axis=1)
    good &= tree[:, 2] > np.maximum(WIDER * inside[parts].max(axis=1), 1.0)
    return np.unique(tree[good, 2])[::-1][:CUTS]


def _branches(tree: Floats) -> tuple[Floats, Floats, NDArray[np.intp]]:
    """Return the branches of a linkage tree for n cases.

    Returns
    -------
    size : (2 n - 1,), number of cases of each branch; single cases come first
    inside : (2 n - 1,), widest gap inside each branch
    parts : (n - 1, 2), numbers of the two branches that each row of the tree joins
    """
    count = len(tree) + 1
    size = np.concatenate([np.ones(count), tree[:, 3]])
    inside = np.concatenate([np.zeros(count), tree[:, 2]])
    return size, inside, tree[:, :2].astype(np.intp)


def _leaves(tree: Floats, branch: int) -> list[int]:
    """Return the indices of the cases of a branch of a linkage tree.

    tree, branch : (n - 1, 4); number of the branch, a single case below n
    """
    count = len(tree) + 1
    if branch < count:
        return [branch]
    parts = tree[branch - count, :2].astype(int).tolist()
    return [case for part in parts for case in _leaves(tree, part)]


def _joined(features: Floats, core: Ints, labels: Ints) -> Ints:
    """Return the clusters of n cases, (n,), after small clusters are dissolved.

    A case outside the large clusters joins the cluster of the nearest case in one.

    Parameters
    ----------
    features : (n, d), d features of each case
    core : (m,), indices of the m cases in large clusters
    labels : (m,), clusters of these m cases
    """
    from scipy.spatial import cKDTree

    found = np.empty(len(features), dtype=np.intp)
    found[core] = labels
    rest = np.setdiff1d(np.arange(len(features)), core)
    if len(rest):
        found[rest] = labels[cKDTree(features[core]).query(features[rest])[1]]
    return found


def _differ(features: Floats, labels: Ints) -> bool:
    """Return whether the medians of every two clusters are more than a tolerance apart.

    features, labels : (n, d), in units of tolerances; (n,), cluster of each case
    """
    middle = np.array([np.median(features[labels == k], axis=0)
                       for k in np.unique(labels)])  # fmt: skip
    apart = np.abs(middle[:, None] - middle[None]).max(axis=2)
    return bool((apart[np.triu_indices(len(middle), 1)] > 1.0).all())


def silhouette(away: Floats, labels: Ints) -> float:
    """Return the mean silhouette, -1 to 1, a measure of how well clusters separate.

    The silhouette of a point is (b - a) / max(a, b), with a its mean distance to the
    other points of its cluster and b the least of its mean distances to another
    cluster; 0 for the only point of a cluster (Rousseeuw, J. Comput. Appl. Math. 20,
    1987, 53-65).

    Parameters
    ----------
    away : (n, n), distances between n points
    labels : (n,), cluster of each point, of two clusters or more
    """
    known, own = np.unique(labels, return_inverse=True)
    member = own[:, None] == np.arange(len(known))
    size, rows = member.sum(axis=0), np.arange(len(labels))
    total = away @ member
    inner = total[rows, own] / np.maximum(size[own] - 1, 1)
    mean = total / size
    mean[rows, own] = np.inf
    outer = mean.min(axis=1)
    widest = np.maximum(inner, outer)
    each = np.divide(outer - inner, widest, out=np.zeros(len(rows)), where=widest > 0)
    return float(np.where(size[own] > 1, each, 0.0).mean())


def _by_size(labels: Ints) -> Ints:
    """Return the cluster of each point, renumbered from 0 by falling cluster size.

    Of clusters of equal size the one that occurs first gets the lower number.

    labels : (n,), cluster of each point, any numbers
    """
    _, first, own, size = np.unique(
        labels, return_index=True, return_inverse=True, return_counts=True
    )
    rank = np.empty(len(size), dtype=np.intp)
    rank[np.lexsort([first, -size])] = np.arange(len(size))
    return np.asarray(rank[own])
