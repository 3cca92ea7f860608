"""How near an engine is to the motions that Sec. 4 of the paper shows: one number.

Written down before the search. Every target has a weight in points; a score is the
points won over the points that the computed cases could win, 0 to 1. A regime counts
when the word is the paper's: `undecided`, `unstable` and a failed case are misses.
Directions are those of the static frame and weigh little, since the paper does not
say how it read them; they, radius and ratio count only where the regime is right.

| target | points | won when |
|---|---|---|
| `270` | 3 | divergent at one of 260, 270, 280 rad/s (of those computed) |
| `270 backward` | 0.5 | the word is backward; half of it where only line - Omega < 0, |
|                |     | backward in the rotor's frame |
| `410` | 3 | sustained |
| `410 forward` | 1 | forward |
| `410 radius` | 1 | rms radius of the orbit is half the gap to twice the gap |
| `420` | 3 | divergent |
| `420 forward` | 1 | forward |
| `420 ratio` | 1 | its radius is 2 to 8 times that of 270 (4 in the paper), neither |
|             |   | run having been cut short by the limit of amplitudes |
| `520` | 2 | damped |
| `520 forward` | 0.5 | forward |
| `others` | 4 | share that is damped of the other speeds, but for 250-290 and |
|          |   | 400-430 rad/s, where the paper lets critical speeds have neighbours |
| `clamped` | 2 | share that is damped with the centre clamped |
| `table 1, k=1` | 1.5 | share that is damped in Table 1 with k = 1 |
| `table 1, k=2` | 0.5 | share that is damped in Table 1 with k = 2 |
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

Row = dict[str, Any]
Parts = dict[str, tuple[float, float]]  # target: points won, points possible
ABOUT_270 = (260.0, 270.0, 280.0)
NEIGHBOURS = ((250.0, 290.0), (400.0, 430.0))  # rad/s, may do other than damp
RADIUS = (0.5, 2.0)  # of the gap
RATIO = (2.0, 8.0)


def pick(rows: Sequence[Row], kind: str) -> dict[float, Row]:
    """Return the rows of a kind of case by speed."""
    return {row["speed"]: row for row in rows if row["kind"] == kind}


def score_parts(rows: Sequence[Row]) -> Parts:
    """Return {target: (won, possible)} of the targets that the rows tell about.

    Parameters
    ----------
    rows : of one engine: kind (`table 2`, `clamped`, `table 1, k=1`, `table 1, k=2`),
        speed, regime, whirl, stop, orbit_radius, line_frequency, gap
    """
    sweep = pick(rows, "table 2")
    parts: Parts = {}
    low = divergent_near_270(sweep)
    if low is not None:
        parts |= _regime_and(low, "270", "divergent", 3, {"backward": (0.5, _backward)})
    if 410.0 in sweep:
        more = {"forward": (1, _forward), "radius": (1, _about_the_gap)}
        parts |= _regime_and(sweep[410.0], "410", "sustained", 3, more)
    if 420.0 in sweep:
        more = {"forward": (1, _forward), "ratio": (1, lambda row: _ratio(row, low))}
        parts |= _regime_and(sweep[420.0], "420", "divergent", 3, more)
    if 520.0 in sweep:
        more = {"forward": (0.5, _forward)}
        parts |= _regime_and(sweep[520.0], "520", "damped", 2, more)
    parts |= _share("others", 4, [r for s, r in sweep.items() if is_other(s)])
    for kind, points in (("clamped", 2), ("table 1, k=1", 1.5), ("table 1, k=2", 0.5)):
        parts |= _share(kind, points, list(pick(rows, kind).values()))
    return parts


def score(parts: Parts) -> float:
    """Return points won over points possible, 0 to 1."""
    possible = sum(most for _, most in parts.values())
    return sum(won for won, _ in parts.values()) / possible if possible else 0.0


def is_other(speed: float) -> bool:
    """Return whether the paper lets nothing but damped motion be expected."""
    inside = any(low <= speed <= high for low, high in NEIGHBOURS)
    return not inside and speed != 520.0


def divergent_near_270(sweep: dict[float, Row]) -> Row | None:
    """Return the row that speaks for 270 rad/s: the nearest that diverges, or 270."""
    near = [sweep[s] for s in ABOUT_270 if s in sweep]
    near.sort(key=lambda row: abs(row["speed"] - 270.0))
    found = [row for row in near if row["regime"] == "divergent"]
    return (found or near or [None])[0]


def _regime_and(
    row: Row,
    name: str,
    word: str,
    points: float,
    more: dict[str, tuple[float, Callable[[Row], float]]],
) -> Parts:
    right = float(row["regime"] == word)
    parts = {name: (points * right, float(points))}
    for what, (most, judge) in more.items():
        parts[f"{name} {what}"] = (most * judge(row) * right, float(most))
    return parts


def _share(name: str, points: float, rows: Sequence[Row]) -> Parts:
    if not rows:
        return {}
    damped = sum(row["regime"] == "damped" for row in rows)
    return {name: (points * damped / len(rows), float(points))}


def _forward(row: Row) -> float:
    return float(row["whirl"] == "forward")


def _backward(row: Row) -> float:
    if row["whirl"] == "backward":
        return 1.0
    return 0.5 if row["line_frequency"] < row["speed"] else 0.0


def _about_the_gap(row: Row) -> float:
    return float(RADIUS[0] <= row["orbit_radius"] / row["gap"] <= RADIUS[1])


def _ratio(row: Row, low: Row | None) -> float:
    if low is None or low["regime"] != "divergent" or low["orbit_radius"] == 0.0:
        return 0.0
    if "amplitude" in (row["stop"], low["stop"]):
        return 0.0
    return float(RATIO[0] <= row["orbit_radius"] / low["orbit_radius"] <= RATIO[1])
