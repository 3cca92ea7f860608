"""Boundaries: points and lines at which the words of neighbouring cases change."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.arrays import Floats
from hpcwhirl.refinement.words import Word, apart

Ints = NDArray[np.int64]
NONE = -1  # row of a missing case
STATES = ("even", "mixed", "speckle")  # states of a cell


@dataclass(frozen=True)
class Cells:
    """The cells of a refined campaign that are not split.

    Attributes
    ----------
    corner : (m, 2^d), rows of the cases at the corners, the last of d inputs varying
        fastest
    panel, level : (m,), number of the panel, see `rule.Family`; level of bisection
    state : (m,), index in `STATES`: all corners have one word, several words, or the
        cell lies in speckle
    confirmed : (m,), 1 if all corners have a word by the second fidelity, else 0
    """

    corner: Ints
    panel: Ints
    level: Ints
    state: Ints
    confirmed: Ints


@dataclass(frozen=True)
class Cases:
    """The cases of a refined campaign as columns: their inputs and words.

    Attributes
    ----------
    inputs : (d, n), values of the refined inputs
    scales : "linear" or "log" for each input
    word : (n,), words by which cells were split; "" for none
    fidelity : (n,), 0 or 1, fidelity of that word
    """

    inputs: Floats
    scales: Sequence[str]
    word: Sequence[Word]
    fidelity: Ints


@dataclass
class Boundaries:
    """Points of boundaries and, if two inputs are refined, the lines through them.

    A point is the middle, on the input's scale, of an edge of a cell, between two cases
    with different words at `low` and `high` of one input; the word changes somewhere
    between them. No stored number locates the change better: the growth rate jumps
    where a small motion decays and a large one grows, and linear interpolation is less
    accurate than the middle on two of three engines (scripts/evidence/boundaries.md).
    If a cell has more than two points, their lines meet in a further point inside it.

    Attributes
    ----------
    at : (p, d), coordinates of each point
    along : index of the input along which its edge lies; -1 where lines meet
    low, high : this input at the ends of the edge; NaN where lines meet
    before, behind : rows of the cases at `low` and at `high`; -1 where lines meet
    panel : number of the panel of each point
    lines : (s, 2), indices of the two points that a line joins
    """

    at: list[Floats] = field(default_factory=list)
    along: list[int] = field(default_factory=list)
    low: list[float] = field(default_factory=list)
    high: list[float] = field(default_factory=list)
    before: list[int] = field(default_factory=list)
    behind: list[int] = field(default_factory=list)
    panel: list[int] = field(default_factory=list)
    lines: list[tuple[int, int]] = field(default_factory=list)

    def add(self, point: Mapping[str, object]) -> int:
        """Add a point, {attribute: value}; return its index."""
        for name, value in point.items():
            getattr(self, name).append(value)
        return len(self.at) - 1


def boundaries_of(cells: Cells, cases: Cases) -> Boundaries:
    """Return the points and lines at which words change in mixed cells."""
    boundaries, known = Boundaries(), {}
    for number in np.flatnonzero(cells.state == STATES.index("mixed")):
        corner, panel = cells.corner[number], int(cells.panel[number])
        points = []
        for along, pair in edges(len(cases.inputs), corner):
            if not differ(cases, *pair):
                continue
            if pair not in known:
                known[pair] = boundaries.add(
                    _crossing(cases, along, pair) | {"panel": panel}
                )
            points.append(known[pair])
        if len(cases.inputs) == 2:
            _join(boundaries, points, panel, cases)
    return boundaries


def edges(count: int, corner: Ints) -> list[tuple[int, tuple[int, int]]]:
    """Return the edges of a cell with a case at both ends.

    Parameters
    ----------
    count : d, number of refined inputs
    corner : (2^d,), rows of the cases at the corners, the last input fastest; `NONE`
        where there is no case

    Returns
    -------
    [(input, (row, row))], for each edge the index of the input along it, and the rows
    of the cases at its low and at its high end
    """
    out = []
    for along in range(count):
        bit = 1 << (count - 1 - along)
        for i in range(len(corner)):
            a, b = int(corner[i]), int(corner[i | bit])
            if not i & bit and NONE not in (a, b):
                out.append((along, (a, b)))
    return out


def differ(cases: Cases, a: int, b: int) -> bool:
    """Return whether the cases in rows `a` and `b` have different words.

    False if one of them has no word, or if their fidelities differ.
    """
    both = {cases.word[a], cases.word[b]}
    alike = bool(cases.fidelity[a] == cases.fidelity[b])
    return alike and "" not in both and apart(both)


def _join(
    boundaries: Boundaries, points: Sequence[int], panel: int, cases: Cases
) -> None:
    """Join two boundary points of a cell by a line, more by lines to their mean.

    points : indices of the points in `boundaries`
    """
    if len(points) == 2:
        boundaries.lines.append((points[0], points[1]))
        return
    if len(points) < 2:
        return
    log = [scale == "log" for scale in cases.scales]
    at = np.array([boundaries.at[i] for i in points])
    at[:, log] = np.log(at[:, log])
    middle = at.mean(axis=0)
    middle[log] = np.exp(middle[log])
    nothing = dict.fromkeys(("low", "high"), float("nan"))
    point = {"at": middle, "along": NONE, "before": NONE, "behind": NONE}
    centre = boundaries.add({**point, **nothing, "panel": panel})
    boundaries.lines += [(i, centre) for i in points]


def _crossing(cases: Cases, along: int, pair: tuple[int, int]) -> dict[str, object]:
    """Return the `Boundaries` attributes of a point at the middle of an edge.

    pair : rows of the cases at its ends, which differ in the input `along` only
    """
    a, b = pair
    low, high = cases.inputs[along, [a, b]].tolist()
    at = cases.inputs[:, a].copy()
    log = cases.scales[along] == "log"
    at[along] = np.sqrt(low * high) if log else (low + high) / 2
    return {
        "at": at, "along": along, "low": low, "high": high, "before": a, "behind": b,
    }  # fmt: skip
