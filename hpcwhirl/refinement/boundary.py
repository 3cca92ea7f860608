"""Points and lines of a refined map at which the words of neighbouring cases change."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.arrays import Floats
from hpcwhirl.refinement.words import Word, any_differ

Ints = NDArray[np.int64]
Point = tuple[Floats, int, float, float, int, int, int]  # see `Boundaries`
NONE = -1  # row of a missing case
STATES = ("even", "mixed", "speckle")  # states of a cell


@dataclass(frozen=True)
class Cells:
    """The m cells of a refined map that are not split, as arrays.

    A cell is an interval, rectangle or box of the d refined inputs, with a case at each
    corner.

    Attributes
    ----------
    corner : (m, 2^d), rows of the cases at the corners, the last of d inputs varying
        fastest; `NONE` where there is no case
    panel : (m,), number of the panel (combination of the inputs not refined)
    level : (m,), number of bisections by which the cell has been made
    state : (m,), index in `STATES`: all corners have one word, several words, or the
        cell lies in speckle
    confirmed : (m,), 1 if the cases at all corners have a word by the repetition with
        the preset `confirm`, or are sure without that, else 0
    """

    corner: Ints
    panel: Ints
    level: Ints
    state: Ints
    confirmed: Ints


@dataclass(frozen=True)
class Cases:
    """The n cases of a refined map, as arrays: d refined inputs, and words.

    Attributes
    ----------
    inputs : (d, n), values of the refined inputs
    scales : "linear" or "log" for each input
    word : (n,), words by which cells were split; "": the case has none
    fidelity : (n,), 1 if the word is that of the repetition with the preset `confirm`,
        or sure without that, else 0
    """

    inputs: Floats
    scales: Sequence[str]
    word: Sequence[Word]
    fidelity: Ints


@dataclass(frozen=True)
class Boundaries:
    """Points of a map's boundaries and, if two inputs are refined, lines through them.

    A point is the middle, on the input's scale, of an edge of a cell, between two cases
    with different words at `low` and `high` of one input; the word changes somewhere
    between them. No stored number locates the change better: the growth rate jumps
    where a small motion decays and a large one grows, and linear interpolation is less
    accurate than the middle on two of three engines (scripts/evidence/boundaries.md).
    If a cell has more than two points, their lines meet in a further point inside it.

    Attributes
    ----------
    at : (p, d), coordinates of each of p points: values of the d refined inputs
    along : (p,), index of the input along which its edge lies; -1 where lines meet
    low, high : (p,), this input at the ends of the edge; NaN where lines meet
    before, behind : (p,), rows of the cases at `low` and at `high`; -1 where lines meet
    panel : (p,), number of the panel (combination of inputs not refined) of each point
    lines : (s, 2), indices of the two points that each of s lines joins
    """

    at: Floats
    along: Ints
    low: Floats
    high: Floats
    before: Ints
    behind: Ints
    panel: Ints
    lines: Ints


def boundaries_of(cells: Cells, cases: Cases) -> Boundaries:
    """Return the points and lines of a map at which the words of cases change.

    Parameters
    ----------
    cells : cells that are not split; only those with several words have such points
    cases : cases at their corners
    """
    points, known = list[Point](), dict[tuple[int, int], int]()
    lines = list[tuple[int, int]]()
    for number in np.flatnonzero(cells.state == STATES.index("mixed")):
        corner, panel = cells.corner[number], int(cells.panel[number])
        own = []
        for along, pair in edges(len(cases.inputs), corner):
            if not differ(cases, *pair):
                continue
            if pair not in known:
                known[pair] = len(points)
                points.append((*_crossing(cases, along, pair), panel))
            own.append(known[pair])
        if len(cases.inputs) == 2 and len(own) == 2:
            lines.append((own[0], own[1]))
        elif len(cases.inputs) == 2 and own:
            lines += [(i, len(points)) for i in own]
            middle = _middle([points[i][0] for i in own], cases.scales)
            points.append((middle, NONE, math.nan, math.nan, NONE, NONE, panel))
    columns = [*zip(*points, strict=True)] or [()] * 7
    at, low, high = (np.array(columns[i], dtype=float) for i in (0, 2, 3))
    along_at, before, behind, panels = (
        np.array(columns[i], dtype=np.int64) for i in (1, 4, 5, 6)
    )
    at, ends = at.reshape(-1, len(cases.inputs)), np.array(lines, dtype=np.int64)
    return Boundaries(
        at, along_at, low, high, before, behind, panels, ends.reshape(-1, 2)
    )


def edges(count: int, corner: Ints) -> list[tuple[int, tuple[int, int]]]:
    """Return the edges of a cell, each between two cases that differ in one input.

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
    """Return whether two cases have different words, so that a boundary lies between.

    False if one of them has no word, or if their fidelities differ.

    Parameters
    ----------
    cases : all cases
    a, b : rows of the two
    """
    both = {cases.word[a], cases.word[b]}
    alike = bool(cases.fidelity[a] == cases.fidelity[b])
    return alike and "" not in both and any_differ(both)


def _middle(points: Sequence[Floats], scales: Sequence[str]) -> Floats:
    """Return the mean of some points of the map, (d,), each input on its own scale.

    Parameters
    ----------
    points : (d,) of each point, values of the refined inputs
    scales : "linear" or "log" of each of the d inputs
    """
    log = [scale == "log" for scale in scales]
    at = np.array(points)
    at[:, log] = np.log(at[:, log])
    middle = at.mean(axis=0)
    middle[log] = np.exp(middle[log])
    return np.asarray(middle)


def _crossing(
    cases: Cases, along: int, pair: tuple[int, int]
) -> tuple[Floats, int, float, float, int, int]:
    """Return the middle of an edge of a cell, at which a boundary crosses it.

    Parameters
    ----------
    cases : all cases
    along : index of the input along the edge
    pair : rows of the cases at its ends

    Returns
    -------
    `at`, `along`, `low`, `high`, `before` and `behind` of one point, see `Boundaries`
    """
    a, b = pair
    low, high = cases.inputs[along, [a, b]].tolist()
    at = cases.inputs[:, a].copy()
    log = cases.scales[along] == "log"
    at[along] = np.sqrt(low * high) if log else (low + high) / 2
    return at, along, low, high, a, b
