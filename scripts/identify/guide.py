"""How far an engine is from the paper's four motions, in evidence, not in words.

Words are flat: nearly every engine misses them all alike. `vigour` puts motions in one
order - damped, kept up, growing - by evidence that changes gradually: when contact
ended, what share of the loss contact replaces, growth, how soon the amplitude limit is
reached. `miss` is how far it is from a word, `cost` the sum over what the paper shows.
What has not been computed counts as missed whole, so that an engine that was given up
early never passes one that was not, and computing more never costs.

Distances to thresholds of linear theory (`identify.linear`) are there before the first
contact. The step from sustained (410 rad/s) to divergent (420) and the divergence at
270 may lie at other speeds: the cost then is that of the best place plus how far away
it is. The guide leads and decides nothing; engines are judged by words, at full
numerics.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import NamedTuple

from identify.linear import linear_miss
from identify.score import Row, is_other, pick

WRONG = 0.2  # of a word that is wrong, however near
TURNED = 0.3  # of a motion that turns the wrong way altogether
FAR = 60.0  # rad/s from where the paper sees a motion: as bad as not at all
RISEN = 0.4  # ln amplitude over the window that the word `divergent` wants
SHOWN = 1.4  # gaps: radius at which a kept-up motion loses its bound
WEIGHTS = {
    "step": 2.5, "270": 1.3, "520": 1.1, "others": 1.0, "clamped": 0.3,
    "table 1, k=1": 0.3, "long": 1.5, "sure": 2.0, "default": 1.5, "linear": 2.0,
}  # fmt: skip
WORDS = ((270.0, "divergent", "backward"), (410.0, "sustained", "forward"),
         (420.0, "divergent", "forward"), (520.0, "damped", "forward"))  # fmt: skip
SCATTERED = (270.0, 410.0, 420.0)  # rad/s, asked of engines a little off
ABOUT_270 = (250.0, 270.0, 300.0)


def clip(value: float, low: float, high: float) -> float:
    """Return a value, or the bound that it passes."""
    return min(max(value, low), high)


def vigour(row: Row) -> float:
    """Return where a motion lies: -2 to -1.4 damped, about 0 kept up, 1 to 2 growing.

    Without contact in the window it rises with the time of the last contact; with
    contact with the share of the loss that is replaced, and with the growth of ln
    amplitude; and beyond the amplitude limit the sooner that was reached.
    """
    if row["status"] != "ok":
        return -2.0
    if row["stop"] == "amplitude":
        return 2.0 - clip(row["end_time"] / row["asked"], 0.0, 1.0)
    if not row["late_contacts"]:
        return -2.0 + clip(row["last_contact"] / row["end_time"], 0.0, 0.6)
    lost = row["late_lost"]
    kept = clip(row["late_fed"] / lost, 0.0, 1.0) if lost > 0.0 else 0.0
    change = row["growth_rate"] * row["window"]
    rise = clip(change / RISEN, 0.0, 1.0) if change > 0 else clip(change, -0.4, 0.0)
    return kept - 1.0 + rise


def miss(row: Row, word: str) -> float:
    """Return 0 where a word is right, else `WRONG` to 1 by `vigour`."""
    if row["regime"] == word:
        return 0.0
    if row["status"] != "ok" or row["regime"] == "none":
        return 1.0
    lively = vigour(row)
    if word == "damped":
        far = (lively + 1.4) / 3.4
    elif word == "sustained":
        far = abs(lively) / 2.0
    else:
        wide = clip(row["orbit_radius"] / row["gap"], 0.0, SHOWN) / SHOWN
        far = (1.0 - lively) / 3.0 - 0.2 * wide * (lively > -1.0)
    return WRONG + (1.0 - WRONG) * clip(far, 0.0, 1.0)


def turned(row: Row, whirl: str) -> float:
    """Return 0 where a direction is right, else up to 1 by the power on each side.

    A centre that has come to rest turns nowhere, however its last orbit turned.
    """
    if row["whirl"] == whirl:
        return 0.0
    sign = 1.0 if whirl == "forward" else -1.0
    return clip(0.5 - 0.5 * sign * row["whirl_ratio"], WRONG, 1.0)


def off(row: Row, regime: str, whirl: str) -> float:
    """Return 0 where a motion is as it should be, else up to 1 by both its words."""
    return min(miss(row, regime) + TURNED * turned(row, whirl), 1.0)


class Step(NamedTuple):
    """From sustained to divergent between two speeds: how badly, and where."""

    cost: float
    below: Row
    above: Row


def step(sweep: dict[float, Row]) -> Step | None:
    """Return the best step from sustained to divergent of a sweep over the speed."""
    speeds = sorted(s for s in sweep if 320.0 < s < 520.0)
    found = [
        Step(_step_cost(sweep[a], sweep[b]), sweep[a], sweep[b])
        for a, b in pairwise(speeds)
    ]
    return min(found, key=lambda each: each.cost, default=None)


def _step_cost(below: Row, above: Row) -> float:
    away = abs(below["speed"] - 410.0) + abs(above["speed"] - 420.0)
    two = off(below, "sustained", "forward"), off(above, "divergent", "forward")
    wrong = sorted(two)
    return (wrong[1] + 0.2 * wrong[0]) / 1.2 + away / (2 * FAR)


def misses(rows: list[Row]) -> dict[str, float]:
    """Return {part: 0 to 1} of each of `WEIGHTS`; 1 of what was not computed."""
    sweep = pick(rows, "table 2")
    out = dict.fromkeys(WEIGHTS, 1.0) | {"linear": linear_miss(rows)}
    found = step(sweep)
    if found is not None:
        out["step"] = min(found.cost, 1.0)
    low = [off(sweep[s], "divergent", "backward") + abs(s - 270.0) / FAR
           for s in ABOUT_270 if s in sweep]  # fmt: skip
    out["270"] = min([*low, 1.0])
    if 520.0 in sweep:
        out["520"] = off(sweep[520.0], "damped", "forward")
    for kind in ("long", "default"):
        kept = pick(rows, kind)
        if all(speed in kept for speed, _, _ in WORDS):
            out[kind] = _mean(off(kept[s], regime, whirl) for s, regime, whirl in WORDS)
    return out | _groups(rows, sweep) | _sure(rows)


def _sure(rows: Sequence[Row]) -> dict[str, float]:
    """Return the mean over engines a little off of their worst motion, if computed."""
    kinds = {row["kind"] for row in rows if row["kind"].startswith("scatter")}
    wanted = {speed: regime for speed, regime, _ in WORDS}
    worst = [max(miss(row, wanted[speed]) for speed, row in pick(rows, kind).items())
             for kind in sorted(kinds)]  # fmt: skip
    return {"sure": _mean(worst)} if worst else {}


def _groups(rows: Sequence[Row], sweep: dict[float, Row]) -> dict[str, float]:
    """Return the misses of what is damped in the paper; only of what is complete."""
    kinds = {kind: list(pick(rows, kind).values()) for kind in ("clamped",)}
    kinds["table 1, k=1"] = list(pick(rows, "table 1, k=1").values())
    kinds["others"] = [row for s, row in sweep.items() if is_other(s) and _calm(s)]
    if not kinds["clamped"]:  # of those given up before, a part is not comparable
        return {}
    return {name: _mean(miss(r, "damped") for r in group)
            for name, group in kinds.items()}  # fmt: skip


def _calm(speed: float) -> bool:
    """Return whether a speed is far enough from the step to be called another."""
    return speed < 390.0 or speed > 440.0


def _mean(values: Iterable[float]) -> float:
    held = list(values)
    return sum(held) / len(held) if held else 1.0


def cost(rows: list[Row]) -> float:
    """Return what a search makes small: 0 where all is as in the paper."""
    found = misses(rows)
    return sum(weight * found[part] for part, weight in WEIGHTS.items())


def words_right(rows: Sequence[Row], kind: str = "table 2") -> int:
    """Return how many of the paper's four motions have regime and whirl right."""
    sweep = pick(rows, kind)
    return sum(
        (sweep[speed]["regime"], sweep[speed]["whirl"]) == (regime, whirl)
        for speed, regime, whirl in WORDS
        if speed in sweep
    )


def steady_share(rows: Sequence[Row]) -> float:
    """Return the share of engines a little off that keep all motions, 0 to 1."""
    kinds = {row["kind"] for row in rows if row["kind"].startswith("scatter")}
    whole = [words_right(rows, kind) == len(SCATTERED) for kind in kinds]
    return sum(whole) / len(whole) if whole else 0.0


def shows_all(rows: Sequence[Row]) -> bool:
    """Return whether all four motions are right, for 2.5 s, at the default inputs."""
    kinds = ("table 2", "long", "default")
    return all(words_right(rows, kind) == len(WORDS) for kind in kinds)
