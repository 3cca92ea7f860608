"""Check safe ranges: compute points drawn inside, between the damped cases.

A safe range is a sequence of damped cases of a sweep, see `studies.margins`; words
between them are not known. Points drawn uniformly inside measure the share of the range
that is damped, with a confidence interval. Where a point is not damped, the intervals
between it and its damped neighbours are bisected, so that the ranges that remain end
near it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from hpcwhirl.campaign.simulate import simulate
from hpcwhirl.errors import InputError
from hpcwhirl.scene import Scene, apply_settings
from hpcwhirl.scene.quantities import INPUTS, variable_name
from hpcwhirl.scene.words import word_of
from hpcwhirl.store.reading.results_file import Results
from hpcwhirl.store.reading.shares import interval
from hpcwhirl.studies.margins import SAFE, Line, with_points

SEED = 0  # of the draws, fixed so that a check can be repeated
BISECTIONS = 3  # of the interval between a point that is not damped and a damped one


class Point(NamedTuple):
    """A point computed inside a safe range: value of the input, SI, and word."""

    value: float
    word: str


@dataclass(frozen=True)
class Check:
    """Points drawn inside a safe range, and what became of them.

    Attributes
    ----------
    fixed : {other swept input: its value on the line of the range}
    low, high : ends of the range, SI
    drawn : the points drawn, ascending
    """

    fixed: dict[str, Any]
    low: float
    high: float
    drawn: tuple[Point, ...]

    @property
    def damped(self) -> int:
        """Number of drawn points that are damped."""
        return sum(point.word == SAFE for point in self.drawn)

    @property
    def share(self) -> tuple[float, float, float]:
        """Share of drawn points that are damped, and its 95 % interval (Wilson)."""
        return interval(self.damped, len(self.drawn))

    @property
    def unsafe(self) -> list[Point]:
        """The drawn points that are not damped, ascending."""
        return [point for point in self.drawn if point.word != SAFE]

    @property
    def holds(self) -> bool:
        """Whether points were drawn, and all of them are damped."""
        return 0 < self.damped == len(self.drawn)


def check_line(
    results: Results,
    over: str,
    line: Line,
    parts: Sequence[tuple[float, float]],
    count: int,
    tell: Callable[[str], object] = bool,
) -> tuple[Line, list[Check]]:
    """Compute points drawn inside parts of a line of cases.

    Parameters
    ----------
    results : results of the campaign
    over : variable of the input that differs along the line
    line : the line
    parts : ends, SI, of each part, between which all cases are damped
    count : number of points drawn in each part; a part of one case has none
    tell : called with a text for the user before each part

    Returns
    -------
    the line with all points that were computed, and the check of each part

    Raises
    ------
    InputError
        if the input is a whole number, or the cases continue those of a branch
    """
    checks = list[Check]()
    if not parts:
        return line, checks
    word_at = _words_along(results, over, line)
    for number, (low, high) in enumerate(parts, 1):
        tell(f"{number} of {len(parts)} ranges, {count} points")
        line, check = _checked(line, low, high, count if low < high else 0, word_at)
        checks.append(check)
    return line, checks


def computed_word(scene: Scene) -> str:
    """Integrate a scene; return its word, such as "damped"."""
    row = simulate(scene).row
    return word_of("ok", str(row["outcome"]), str(row["regime"]))


def _words_along(results: Results, over: str, line: Line) -> Callable[[float], str]:
    """Return a function from a value of the input to the word of that point.

    Parameters are those of `check_line`.
    """
    name = next(name for name in INPUTS if variable_name(name) == over)
    case = int(line.cases[line.cases >= 0][0])
    scene = results.scene(case)
    if results[over].dtype.kind in "iu":
        msg = f"--check draws points between values, but {over} is a whole number"
        raise InputError(msg)
    if results.plan.settings[case].get("history"):
        msg = "--check cannot draw points on a branch, whose cases continue the ones "
        raise InputError(msg + "before: check a campaign without [branch]")
    quiet = apply_settings(scene, {"traces": "summary"})
    return lambda value: computed_word(apply_settings(quiet, {name: value}))


def _checked(
    line: Line, low: float, high: float, count: int, word_at: Callable[[float], str]
) -> tuple[Line, Check]:
    """Draw and compute points between two values; bisect beside those not damped."""
    values = np.sort(np.random.default_rng(SEED).uniform(low, high, count)).tolist()
    drawn = tuple(Point(value, word_at(value)) for value in values)
    line = with_points(line, values, [point.word for point in drawn])
    for point in drawn:
        if point.word != SAFE:
            found = [*_bisected(line, point.value, word_at)]
            line = with_points(line, *zip(*found, strict=True)) if found else line
    return line, Check(line.fixed, low, high, drawn)


def _bisected(
    line: Line, value: float, word_at: Callable[[float], str]
) -> Iterator[Point]:
    """Yield points between a point that is not damped and its damped neighbours.

    line, value : the line, with the point; value of the input there
    """
    at = int(np.flatnonzero(line.values == value)[0])
    for beside in (at - 1, at + 1):
        if not 0 <= beside < len(line.values) or line.words[beside] != SAFE:
            continue
        safe, unsafe = float(line.values[beside]), value
        for _ in range(BISECTIONS):
            middle = 0.5 * (safe + unsafe)
            word = word_at(middle)
            yield Point(middle, word)
            safe, unsafe = (middle, unsafe) if word == SAFE else (safe, middle)
