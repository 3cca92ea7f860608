"""Where words change within cells, by the evidence at their corners."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
NONE = -1
EVIDENCE = (
    "growth_rate", "growth_rotor", "growth_error", "window", "whirl_ratio",
)  # fmt: skip
STATES = ("even", "mixed", "speckle")


@dataclass(frozen=True)
class Cells:
    """The cells of a refined campaign that are not split.

    Attributes
    ----------
    corner : (m, 2^d), rows of the cases at their corners, the last input fastest
    panel, level : (m,)
    state : (m,), place in `STATES`: corners alike, of different words, or in speckle
    confirmed : (m,), 1 if all corners have a word by the second fidelity
    """

    corner: Ints
    panel: Ints
    level: Ints
    state: Ints
    confirmed: Ints


@dataclass(frozen=True)
class Cases:
    """What boundaries are found from, row by row.

    Attributes
    ----------
    inputs : (d, n), the refined inputs
    scales : of each, "linear" or "log"
    word : (n,), by which cells were split, "" for none
    evidence : {name of `EVIDENCE`: (n,)}
    limits : thresholds
    """

    inputs: Floats
    scales: Sequence[str]
    word: NDArray[np.str_]
    evidence: Mapping[str, Floats]
    limits: Mapping[str, float]


@dataclass
class Boundaries:
    """Points of boundaries, and the lines through them where two inputs are refined.

    A point lies on an edge of a cell, between two cases of different words, `low` and
    `high` along one input: that much is certain of cases and their words. It lies where
    the evidence that tells these words apart crosses its threshold, if that is on the
    way, on a straight line between both; `error` is the part of it that the standard
    errors of both growth rates make, and tells nothing of how straight the evidence
    is. Elsewhere it is the middle of the edge, `error` half of it. A point of no edge
    is where lines of a cell meet.

    Attributes
    ----------
    at : (p, d), of each point
    along : number of the input along which its edge lies, -1: lines meet here
    low, high, error : along it, in its unit; NaN where lines meet
    placed : 1 if evidence places it
    before, behind : rows of the cases at both ends, -1 where lines meet
    panel : of each point
    lines : (s, 2), points that a line joins
    """

    at: list[Floats] = field(default_factory=list)
    along: list[int] = field(default_factory=list)
    low: list[float] = field(default_factory=list)
    high: list[float] = field(default_factory=list)
    error: list[float] = field(default_factory=list)
    placed: list[int] = field(default_factory=list)
    before: list[int] = field(default_factory=list)
    behind: list[int] = field(default_factory=list)
    panel: list[int] = field(default_factory=list)
    lines: list[tuple[int, int]] = field(default_factory=list)

    def add(self, point: Mapping[str, object]) -> int:
        """Add a point; return its number."""
        for name, value in point.items():
            getattr(self, name).append(value)
        return len(self.at) - 1


def boundaries_of(cells: Cells, cases: Cases) -> Boundaries:
    """Return where words change along the edges of mixed cells, and the lines there."""
    found, known = Boundaries(), {}
    for number in np.flatnonzero(cells.state == STATES.index("mixed")):
        corner, panel = cells.corner[number], int(cells.panel[number])
        own = []
        for along, pair in edges(len(cases.inputs), corner):
            if not differ(cases.word, *pair):
                continue
            if pair not in known:
                known[pair] = found.add(
                    _crossing(cases, along, pair) | {"panel": panel}
                )
            own.append(known[pair])
        if len(cases.inputs) == 2:
            _join(found, own, panel, cases)
    return found


def edges(count: int, corner: Ints) -> list[tuple[int, tuple[int, int]]]:
    """Return (input, rows at both ends) of the edges of a cell that are there."""
    out = []
    for along in range(count):
        bit = 1 << (count - 1 - along)
        for i in range(len(corner)):
            a, b = int(corner[i]), int(corner[i | bit])
            if not i & bit and NONE not in (a, b):
                out.append((along, (a, b)))
    return out


def differ(word: NDArray[np.str_], a: int, b: int) -> bool:
    """Return whether two cases have words, and different ones."""
    return bool(word[a]) and bool(word[b]) and str(word[a]) != str(word[b])


def _join(found: Boundaries, own: Sequence[int], panel: int, cases: Cases) -> None:
    """Join the points on a cell's edges: two by a line, more where they meet."""
    if len(own) == 2:
        found.lines.append((own[0], own[1]))
        return
    if len(own) < 2:
        return
    log = [scale == "log" for scale in cases.scales]
    at = np.array([found.at[i] for i in own])
    at[:, log] = np.log(at[:, log])
    middle = at.mean(axis=0)
    middle[log] = np.exp(middle[log])
    nothing = dict.fromkeys(("low", "high", "error"), float("nan"))
    point = {"at": middle, "along": NONE, "placed": 0, "before": NONE, "behind": NONE}
    centre = found.add({**point, **nothing, "panel": panel})
    found.lines += [(i, centre) for i in own]


def _crossing(cases: Cases, along: int, pair: tuple[int, int]) -> dict[str, object]:
    """Return the point at which words change on an edge."""
    a, b = pair
    log = cases.scales[along] == "log"
    ends = cases.inputs[along, [a, b]]
    low, high = np.log(ends) if log else ends
    part, error = 0.5, 0.5
    margins = margins_of(cases, a, b)
    placed = margins is not None
    if margins is not None:
        (first, second), spread = margins
        part = first / (first - second)
        error = spread / abs(first - second)
    where = low + part * (high - low)
    at = cases.inputs[:, a].copy()
    at[along] = np.exp(where) if log else where
    width = error * (high - low)
    away = at[along] * np.expm1(width) if log else width
    return {
        "at": at, "along": along, "low": float(ends[0]), "high": float(ends[1]),
        "error": float(min(away, ends[1] - ends[0])), "placed": int(placed),
        "before": a, "behind": b,
    }  # fmt: skip


def margins_of(
    cases: Cases, a: int, b: int
) -> tuple[tuple[float, float], float] | None:
    """Return evidence less threshold at both ends, of different signs, and its error.

    None where no one number tells the two words apart, or it does not change its sign.
    """
    words = {str(cases.word[a]), str(cases.word[b])}
    parts = [set(column) for column in zip(*(w.split() for w in words), strict=False)]
    apart = [part for part in parts if len(part) > 1]
    if len(apart) != 1:  # regime and whirl change together: nobody knows which where
        return None
    for first, second in combinations(sorted(apart[0]), 2):
        found = _margin(cases, {first, second})
        if found is None:
            return None
        value, error = found
        ends = float(value[a]), float(value[b])
        if np.isfinite(ends).all() and min(ends) < 0.0 < max(ends):
            scatter = float(np.nan_to_num(max(error[a], error[b])))
            return ends, scatter
    return None


def _margin(cases: Cases, words: set[str]) -> tuple[Floats, Floats] | None:
    """Return (evidence less threshold, its standard error), (n,), that tells words."""
    of, limits = cases.evidence, cases.limits
    rise = of["growth_rate"] * of["window"]
    error = of["growth_error"] * of["window"]
    if "divergent" in words:
        both = np.minimum(of["growth_rate"], of["growth_rotor"]) * of["window"]
        return both - limits["rise"], error
    if words == {"damped", "sustained"}:
        return rise + limits["drift"], error
    turn = limits["direction"]
    if words <= {"forward", "backward", "mixed"}:
        sign = 1.0 if "forward" in words else -1.0
        return of["whirl_ratio"] - sign * turn, np.zeros_like(rise)
    return None
