"""Which words of two cases refinement compares, and whether they differ.

The regime and the whirl are words: two cases differ if theirs are not the same. The
name of an attractor does not follow from a case alone: `hpcwhirl basins` numbers
attractors by clustering all cases. So whether two cases lie on different attractors is
decided by their regimes, and by whether numbers from the last 40 % of their runs differ
by more than `TOLERANCES`. Where a number changes steadily from case to case, its
differences shrink as cells are split, so that splitting ends; where it jumps, cells are
split to the end.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from typing import Any, NamedTuple

REGIME, WHIRL, BOTH, ATTRACTOR = "regime", "whirl", "both", "attractor"
BRANCH = "branch"  # the regime, compared between successive cases of a branch
# Along a branch an undecided case counts as sustained: which of both a case is depends
# on the run's duration, so that a change between them is no fold.
ALIKE = {"undecided": "sustained"}
COMPARED = (REGIME, WHIRL, BOTH, ATTRACTOR, BRANCH)  # kinds of words
NUMBERS = ("orbit_radius", "gap_scale", "whirl_ratio", "late_energy", "growth_rate")
FLOOR = 1e-6  # ratio of orbit radius to gap below which the motion is round-off
LEAST = 1e-300  # smallest number whose logarithm is taken
# Smallest differences of two attractors. Of motions of four engines whose forces differ
# by 1e-6, none of 117 sustained and none of 202 divergent pairs differed by more
# (scripts/evidence/neighbours.py).
TOLERANCES = {
    "radius": math.log(1.25),
    "whirl_ratio": 0.2,
    "energy": math.log(2.0),
    "growth": math.log(2.0),
}


class Attractor(NamedTuple):
    """The attractor on which a case has ended, as a word that refinement compares.

    Attributes
    ----------
    regime : regime of the case
    at : numbers that distinguish attractors of one regime, in units of `TOLERANCES`,
        see `features_of`
    """

    regime: str
    at: tuple[float, ...] = ()


Word = str | Attractor


def features_of(row: Mapping[str, Any]) -> tuple[float, ...]:
    """Return numbers by which attractors of one regime are distinguished.

    They are in units of `TOLERANCES`. For a sustained motion: logarithm of radius /
    gap, whirl ratio and logarithm of energy; for a divergent one: whirl ratio and
    logarithm of the growth rate; () for another regime. If the centre does not move,
    radius and whirl ratio count as 0.

    row : {variable: value} of the regime and of `NUMBERS`
    """
    regime, limit = row["regime"], TOLERANCES
    if regime not in {"sustained", "divergent"}:
        return ()
    radius = float(row["orbit_radius"]) / max(float(row["gap_scale"]), LEAST)
    moves = radius >= FLOOR
    whirl = float(row["whirl_ratio"]) / limit["whirl_ratio"] if moves else 0.0
    if regime == "divergent":
        return whirl, _log(row["growth_rate"]) / limit["growth"]
    size = _log(radius) / limit["radius"] if moves else 0.0
    return size, whirl, _log(row["late_energy"]) / limit["energy"]


def _log(value: Any) -> float:
    return math.log(max(abs(float(value)), LEAST))


def any_differ(words: Collection[Word]) -> bool:
    """Return whether any two of some words differ.

    Attractors differ if a number differs by more than its tolerance in `TOLERANCES`.
    """
    if len(words) < 2:
        return False
    motions = [word for word in words if isinstance(word, Attractor)]
    if len({word[0] if word in motions else word for word in words}) > 1:
        return True
    sides = zip(*(motion.at for motion in motions), strict=True)
    return any(max(side) - min(side) > 1.0 for side in sides)


def word_of(kind: str, row: Mapping[str, Any]) -> Word:
    """Return the word of a case that refinement compares with its neighbours' words.

    Parameters
    ----------
    kind : kind of word, one of `COMPARED`
    row : {"regime": word, "whirl": word}, for attractors also "features", see
        `features_of`
    """
    if kind == ATTRACTOR:
        return Attractor(str(row["regime"]), tuple(row["features"]))
    regime = row["regime"]
    along = ALIKE.get(regime, regime)
    both = {REGIME: regime, BRANCH: along, WHIRL: row["whirl"]}
    return str(both.get(kind, f"{row['regime']} {row['whirl']}"))
