"""An engine's motions at a fast preset, and how far they are from the paper's.

Words are flat: nearly every engine misses them all alike. `vigour` puts motions in one
order - damped, kept up, growing - by evidence that changes gradually: when contact
ended, what share of the loss contact replaces, growth, how soon the amplitude limit is
reached. `miss` is how far it is from a word, `cost` the sum over what the paper shows.
What has not been computed counts as missed whole, so that computing more never costs.

Modes, harmonics and step are the same for every engine, so that one kernel serves all:
some 25 ms a case. On three engines with steps and divergences, 51 speeds each, 144 of
153 regimes were those of the default inputs (`SCREEN` against `hpcwhirl campaign`).
Where a basin ends they need not be: engines with all motions are asked at the default
inputs, too. The cost leads and decides nothing; engines are judged by words, at full
numerics.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from identify.linear import WANTED, growths, linear_miss
from identify.score import Row, pick
from identify.space import GAP, Engine

from hpcwhirl.campaign.simulate import simulate
from hpcwhirl.errors import InputError
from hpcwhirl.scene import Scene, apply_settings
from hpcwhirl.scene.case_digest import PHYSICS_VERSION

SCREEN: dict[str, Any] = {
    "solver.modes": 44, "engine.casing.harmonics": 6,
    "engine.casing.families": "bending", "solver.time_step": 2.4e-5,
    "duration": 1.5, "solver.amplitude_limit": 0.05, "output.traces": "summary",
}  # fmt: skip
KINDS: dict[str, dict[str, Any]] = {
    "table 2": {"gap": GAP, "friction": 0.1},
    "default": {"gap": GAP, "friction": 0.1},
    "clamped": {"gap": GAP, "friction": 0.1, "engine.rotor.centre": "clamped"},
    "table 1, k=1": {"gap": 1e-3, "friction": 0.2, "revolutions": 20.0},
}
MOTIONS = {  # rad/s: the paper's words
    270.0: ("divergent", "backward"), 410.0: ("sustained", "forward"),
    420.0: ("divergent", "forward"), 520.0: ("damped", "forward"),
}  # fmt: skip
ORDER = (410.0, 420.0, 520.0, 270.0)  # in which they are asked
OTHERS = (60.0, 150.0, 240.0, 330.0, 370.0, 490.0)  # rad/s, damped in the paper
WORDS = ("regime", "whirl", "stop")
NUMBERS = ("orbit_radius", "line_frequency", "whirl_ratio", "growth_rate", "window",
           "end_time", "late_fed", "late_lost", "late_contacts", "last_contact",
           "gap")  # fmt: skip
LEAST_STEPS = 10.5  # of a pulse
UNLIKELY = 0.4  # of what linear theory wants, beyond which nothing is integrated
HOPELESS = 0.6  # mean miss of 410 and 420 rad/s beyond which the rest is not computed
WRONG = 0.2  # of a word that is wrong, however near
TURNED = 0.3  # of a motion that turns the wrong way altogether
RISEN = 0.4  # ln amplitude over the window that the word `divergent` wants
SHOWN = 1.4  # gaps: radius at which a kept-up motion loses its bound
WEIGHTS = {"linear": 2.0, "410": 1.5, "420": 1.5, "270": 1.3, "520": 1.1, "others": 1.0,
           "default": 1.5}  # fmt: skip
Compute = Callable[[Engine, str, float], Row]


def about() -> dict[str, Any]:
    """Return what costs depend on beside the engine; kept with them."""
    linear = [[speed, root, grows] for (speed, root), grows in WANTED.items()]
    return {"physics": PHYSICS_VERSION, "preset": SCREEN, "kinds": KINDS,
            "others": OTHERS, "given up": (UNLIKELY, HOPELESS), "weights": WEIGHTS,
            "linear": linear}  # fmt: skip


def motion(engine: Engine, kind: str, speed: float) -> Row:
    """Return what an engine does in a case; by nothing but defaults if `default`."""
    step = min(SCREEN["solver.time_step"], engine["pulse"] / LEAST_STEPS)
    own = SCREEN | {"solver.time_step": step}
    own = {"output.traces": "summary"} if kind == "default" else own
    row: Row = {"kind": kind, "speed": speed}
    try:
        scene = apply_settings(Scene(), engine | own | KINDS[kind] | {"speed": speed})
        found = simulate(scene).row
    except InputError:  # cannot be integrated: a miss of everything
        blank = dict.fromkeys(NUMBERS, 0.0) | dict.fromkeys(WORDS, "none")
        return row | blank | {"status": "failed", "asked": 1.0}
    row |= {"status": "ok", "asked": scene.end_time}
    row |= {name: str(found[name]) for name in WORDS}
    return row | {name: float(found[name]) for name in NUMBERS}


def vigour(row: Row) -> float:
    """Return where a motion lies: -2 to -1.4 damped, about 0 kept up, 1 to 2 growing.

    Without contact in the window it rises with the time of the last contact; with
    contact with the share of the loss that is replaced, and with the growth of ln
    amplitude; and beyond the amplitude limit the sooner that was reached.
    """
    if row["status"] != "ok":
        return -2.0
    if row["stop"] == "amplitude":
        return 2.0 - min(row["end_time"] / row["asked"], 1.0)
    if not row["late_contacts"]:
        return -2.0 + min(row["last_contact"] / row["end_time"], 0.6)
    lost = row["late_lost"]
    held = np.clip(row["late_fed"] / lost, 0.0, 1.0) if lost > 0.0 else 0.0
    change = row["growth_rate"] * row["window"]
    rise = min(change / RISEN, 1.0) if change > 0 else max(change, -0.4)
    return float(held - 1.0 + rise)


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
        wide = np.clip(row["orbit_radius"] / row["gap"], 0.0, SHOWN) / SHOWN
        far = (1.0 - lively) / 3.0 - 0.2 * wide * (lively > -1.0)
    return WRONG + (1.0 - WRONG) * float(np.clip(far, 0.0, 1.0))


def off(row: Row) -> float:
    """Return 0 where a motion is the paper's, else up to 1 by both its words.

    Directions count by the power on each side. A centre that has come to rest turns
    nowhere, however its last orbit turned.
    """
    regime, whirl = MOTIONS[row["speed"]]
    sign = 1.0 if whirl == "forward" else -1.0
    turned = float(np.clip(0.5 - 0.5 * sign * row["whirl_ratio"], WRONG, 1.0))
    turned *= row["whirl"] != whirl
    return min(miss(row, regime) + TURNED * turned, 1.0)


def cost(linear: float, rows: Sequence[Row]) -> float:
    """Return what a search makes small: 0 where all is as in the paper.

    linear : `linear_miss`
    """
    misses = dict.fromkeys(WEIGHTS, 1.0) | {"linear": linear}
    sweep, default = pick(rows, "table 2"), pick(rows, "default")
    misses |= {f"{s:g}": off(row) for s, row in sweep.items() if s in MOTIONS}
    calm = [miss(row, "damped") for s, row in sweep.items() if s in OTHERS]
    if calm:
        misses["others"] = float(np.mean(calm))
    if default:
        misses["default"] = float(np.mean([off(row) for row in default.values()]))
    return sum(WEIGHTS[part] * value for part, value in misses.items())


def words_right(rows: Sequence[Row], kind: str = "table 2") -> int:
    """Return how many of the paper's four motions have regime and whirl right."""
    sweep = pick(rows, kind)
    return sum((sweep[speed]["regime"], sweep[speed]["whirl"]) == words
               for speed, words in MOTIONS.items() if speed in sweep)  # fmt: skip


def screened(engine: Engine, compute: Compute = motion) -> tuple[float, list[Row]]:
    """Return what linear theory misses, and the rows of an engine, as many as it needs.

    First linear theory, then 410 and 420 rad/s, then 520 and 270; those with all four
    motions are asked for speeds that the paper has damped, and at the default inputs:
    other numerics are to words on the border of a basin what another draw is.
    """
    linear, rows = linear_miss(growths(engine)), list[Row]()
    if linear > UNLIKELY:
        return linear, rows
    for speed in ORDER:
        rows.append(compute(engine, "table 2", speed))
        if len(rows) == 2 and off(rows[0]) + off(rows[1]) > 2 * HOPELESS:
            return linear, rows
    if words_right(rows) == len(MOTIONS):
        rows += [compute(engine, "table 2", speed) for speed in OTHERS]
        rows += [compute(engine, "default", speed) for speed in MOTIONS]
    return linear, rows
