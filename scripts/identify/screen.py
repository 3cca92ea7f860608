"""An engine's motions at a fast preset of fixed sizes, in an order that ends early.

Modes, harmonics and step are the same for every engine, so that one kernel serves all:
some 25 ms a case. On three engines with steps and divergences, 51 speeds each, 144 of
153 regimes were those of the default inputs (`SCREEN` against `hpcwhirl campaign`).
Where a basin ends they need not be: one engine diverged at 270 rad/s with every step
from 24 to 4 us and came to rest with 2 us, as at the default inputs. So engines with
all motions are asked at the default inputs before they count (`default`).
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from identify.guide import SCATTERED, steady_share, step, vigour, words_right
from identify.guide import WORDS as MOTIONS
from identify.linear import WANTED, linear_miss, linear_rows
from identify.score import Row, pick
from identify.space import GAP, Engine, scattered

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
    "long": {"gap": GAP, "friction": 0.1, "duration": 2.5},
    "default": {"gap": GAP, "friction": 0.1},
    "clamped": {"gap": GAP, "friction": 0.1, "engine.rotor.centre": "clamped"},
    "table 1, k=1": {"gap": 1e-3, "friction": 0.2, "revolutions": 20.0},
}
WORDS = ("regime", "whirl", "stop")
NUMBERS = (
    "orbit_radius", "line_frequency", "whirl_ratio", "growth_rate", "window",
    "end_time", "late_fed", "late_lost", "late_contacts", "last_contact",
    "centre_peak", "gap",
)  # fmt: skip
UP, DOWN = (440.0, 470.0), (390.0, 360.0)
BESIDE_270 = (250.0, 300.0)
OTHERS = (60.0, 100.0, 150.0, 200.0, 240.0, 330.0, 370.0, 490.0)
CLAMPED, TABLE1 = (270.0, 420.0), (270.0,)
LEAST_STEPS = 10.5  # of a pulse
UNLIKELY = 0.4  # of what linear theory wants, beyond which nothing is integrated
HOPELESS = 0.4  # cost of the step beyond which the rest is not computed
DRAWS, SCATTER = 8, 0.01  # engines beside one that has all motions
STEADY = 0.75  # share of them that keep the motions, from which on it is verified
NEAR = 0.12  # and within which all of it is, where 520 is right
Compute = Callable[[Engine, str, float], Row]


def about() -> dict[str, Any]:
    """Return what rows depend on beside the engine; kept with them."""
    speeds = (UP, DOWN, BESIDE_270, OTHERS, CLAMPED, TABLE1, SCATTERED)
    return {
        "physics": PHYSICS_VERSION, "preset": SCREEN, "kinds": KINDS,
        "speeds": speeds, "given up": (UNLIKELY, HOPELESS, NEAR, STEADY),
        "linear": WANTED, "scatter": (DRAWS, SCATTER), "numbers": NUMBERS,
    }  # fmt: skip


def motion(engine: Engine, kind: str, speed: float) -> Row:
    """Return what an engine does in a case, its numbers to six digits.

    So they are the same whether computed now or read from what was kept.
    """
    row: Row = {"kind": kind, "speed": speed}
    usual = KINDS["table 2" if kind.startswith("scatter") else kind]
    own = numerics(engine, kind) | usual | {"speed": speed}
    try:
        scene = apply_settings(Scene(), engine | own)
        found = simulate(scene).row
    except InputError:  # cannot be integrated: a miss of everything
        blank = dict.fromkeys(NUMBERS, 0.0) | dict.fromkeys(WORDS, "none")
        return row | blank | {"status": "failed", "asked": 1.0}
    row |= {"status": "ok", "asked": scene.end_time}
    row |= {name: str(found[name]) for name in WORDS}
    return row | {name: float(f"{float(found[name]):.6g}") for name in NUMBERS}


def numerics(engine: Engine, kind: str) -> dict[str, Any]:
    """Return the preset, or for the kind `default` nothing but the default inputs."""
    if kind == "default":
        return {"output.traces": "summary"}
    step = min(SCREEN["solver.time_step"], engine["pulse"] / LEAST_STEPS)
    return SCREEN | {"solver.time_step": step}


def screened(engine: Engine, compute: Compute = motion) -> list[Row]:
    """Return the rows of an engine, as many as it is worth.

    First what linear theory says, then 410 and 420 rad/s, then where the step is, if
    not there. Engines without a step, or without rest at 520, are given up; those near
    the paper's are asked for the other speeds, which the paper has damped; those with
    all motions, whether they keep them for 2.5 s, and where every unknown is a little
    off; and where most of those do, at the default inputs: other numerics are to words
    on the border of a basin what another draw is.
    """
    rows = linear_rows(engine)
    if linear_miss(rows) > UNLIKELY:
        return rows
    pair = [compute(engine, "table 2", speed) for speed in (410.0, 420.0)]
    rows += pair + _looked_for(engine, pair, compute)
    found = step(pick(rows, "table 2"))
    if found is None or found.cost > HOPELESS:
        return rows
    rows.append(compute(engine, "table 2", 520.0))
    if vigour(rows[-1]) > 0.5:
        return rows
    damped = rows[-1]["regime"] == "damped"
    rows += _around_270(engine, compute)
    if damped and found.cost < NEAR:
        rows += _the_rest(engine, rows, compute)
    if words_right(rows) == len(MOTIONS):
        rows += [compute(engine, "long", speed) for speed, _, _ in MOTIONS]
    if words_right(rows, "long") == len(MOTIONS):
        rows += _beside(engine, compute)
    if steady_share(rows) >= STEADY:
        rows += [compute(engine, "default", speed) for speed, _, _ in MOTIONS]
    return rows


def _looked_for(engine: Engine, rows: list[Row], compute: Compute) -> list[Row]:
    """Return further rows until the step from sustained to divergent is found."""
    below, above = rows
    lively, livelier = vigour(below), vigour(above)
    if below["regime"] == "sustained" and above["regime"] == "divergent":
        return []
    if max(lively, livelier) < -1.0:  # nothing here: perhaps further away
        return [compute(engine, "table 2", s) for s in (DOWN[1], UP[1])]
    ladder, until = (DOWN, "sustained") if lively >= 1.0 else (UP, "divergent")
    return _along(engine, ladder, {until, "damped"}, compute)


def _around_270(engine: Engine, compute: Compute) -> list[Row]:
    """Return 270 rad/s, and speeds beside it where that does not diverge."""
    speeds = (270.0, *BESIDE_270)
    return _along(engine, speeds, {"divergent"}, compute)


def _along(
    engine: Engine, speeds: tuple[float, ...], until: set[str], compute: Compute
) -> list[Row]:
    """Return rows along speeds until one of these regimes is met."""
    out: list[Row] = []
    for speed in speeds:
        out.append(compute(engine, "table 2", speed))
        if out[-1]["regime"] in until:
            break
    return out


def _the_rest(engine: Engine, rows: list[Row], compute: Compute) -> list[Row]:
    """Return what the paper has damped: other speeds, clamped centre, Table 1."""
    have = pick(rows, "table 2")
    out = [compute(engine, "table 2", s) for s in OTHERS if s not in have]
    out += [compute(engine, "clamped", speed) for speed in CLAMPED]
    return out + [compute(engine, "table 1, k=1", speed) for speed in TABLE1]


def _beside(engine: Engine, compute: Compute) -> list[Row]:
    """Return the motions of engines whose unknowns are a little off."""
    draws = enumerate(scattered(engine, SCATTER, DRAWS))
    return [compute(other, f"scatter {i}", s) for i, other in draws for s in SCATTERED]


def timed(engine: Engine) -> tuple[list[Row], float]:
    """Return the rows of an engine and the processor time that they took, s."""
    start = time.process_time()
    rows = screened(engine)
    return rows, time.process_time() - start
