"""The motion of a rub has the word that its Poincaré section shows.

Damped unbalanced rotors of 6 and 9 blades with `rotation = "full"` and little friction,
in `draft`, rub for 2 s; the section is that of the last 40 %. A synchronous rub is a
fixed point: *periodic* with period 1. A section that contracts is not *quasi-periodic*,
one that stays within 2 % of the orbit not *chaotic*. Scenes that do not end sustained,
and sections of which neither holds, are not asked.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.campaign.simulate import simulate
from hpcwhirl.scene import apply_settings, named_scene, preset_inputs

COUNT, LEAST = 100, 1.0
FIXED = 2e-4  # largest spread of a fixed point, relative to the orbit
VARIES = 0.02  # least spread of a motion that is no fixed point
CONTRACTS = 3.0  # ratio of the spreads of the first and last third of a section
Row = dict[str, Any]


def drawn(seed: int, index: int) -> Row:
    """Return the inputs of a rub."""
    random = np.random.default_rng([seed, index])
    return {
        "rotation": "full",
        "blades": int(random.choice([6, 9])),
        "unbalance": float(10 ** random.uniform(-2.0, -1.0)),
        "gap": float(10 ** random.uniform(-4.3, -3.7)),
        "friction": float(random.uniform(0.0, 0.03)),
        "speed": float(random.uniform(220.0, 480.0)),
        "suspension_damping": float(random.uniform(0.05, 0.3)),
        "engine.casing.damping": float(random.uniform(0.05, 0.3)),
        "support_damping": float(random.uniform(0.05, 0.3)),
        "force": float(random.choice([0.0, 1e4])),
        "duration": 2.0,
        "chaos": 80.0,
        "traces": "orbit",
        "interval": 1e-4,
    }


def judged(scene: Row) -> Row:
    """Integrate a rub; compare the word of its motion with its section."""
    settings = preset_inputs("draft") | scene
    result = simulate(apply_settings(named_scene("four_motions"), settings))
    row = result.row
    if row["regime"] != "sustained":
        return {"held": None, "regime": row["regime"]}
    points = _section(result.traces, scene["speed"], row["window"])
    spread = [_spread(part) for part in np.array_split(points, 3)]
    word, period = row["motion"], row["period"]
    turn = 2 * math.pi / scene["speed"]
    ends = [turn * row["exponent"], turn * row["exponent_error"]]
    told = {"word": word, "period": period, "spread": spread, "exponent": ends}
    held = _held(word, period, spread)
    why = f"{word}, period {period}, spread {spread[0]:.1g} to {spread[-1]:.1g}, "
    return {"held": held, "why": f"{why}exponent {ends[0]:.3g}"} | told


def _held(word: str, period: int, spread: list[float]) -> bool | None:
    """Return whether a word suits a section of such spreads; None: cannot say."""
    if spread[-1] < FIXED:
        return word == "periodic" and period == 1
    if word == "quasi-periodic":
        return spread[-1] * CONTRACTS > spread[0]
    if word == "chaotic" or (word == "periodic" and period > 1):
        return spread[-1] > VARIES
    if word == "periodic":
        return spread[-1] < VARIES
    return None


def _section(traces: Any, speed: float, window: float) -> NDArray[np.complex128]:
    """Return the centre at whole revolutions in the window, m, static frame."""
    time, z = traces["time"], traces["centre"] @ np.array([1.0, 1j])
    turn = 2 * math.pi / speed
    first = math.ceil((time[-1] - window) / turn)
    at = turn * np.arange(first, math.floor(time[-1] / turn))
    turned = z * np.exp(-1j * speed * time)  # slow where the rub is synchronous
    return np.asarray(np.interp(at, time, turned.real)
                      + 1j * np.interp(at, time, turned.imag))  # fmt: skip


def _spread(points: NDArray[np.complex128]) -> float:
    """Return how far points lie from their mean, relative to their distance."""
    size = math.sqrt(float(np.mean(np.abs(points) ** 2)))
    return float(np.abs(points - points.mean()).max()) / size
