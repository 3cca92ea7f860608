"""The unknowns of the engine search, their bounds, and engines drawn from them."""

from __future__ import annotations

import math
from typing import Any

from scipy.stats import qmc

from hpcwhirl.scene import Scene

Engine = dict[str, Any]  # {input: value} of the unknowns
# input: lowest, highest, whether the search is along its logarithm
UNKNOWNS: dict[str, tuple[float, float, bool]] = {
    "engine.casing.thickness": (0.005, 0.06, True),  # m
    "engine.casing.width": (0.02, 0.3, True),  # m
    "engine.casing.damping": (0.0005, 0.2, True),
    "engine.rotor.damping": (0.0005, 0.2, True),
    "engine.casing.support_frequency": (6.3, 25.0, False),  # rad/s
    "pulse": (1e-4, 3e-3, True),  # s
}
DIRECTIONS = ("squeeze", "stretch")
TWO_LOBED = {"engine.casing.thickness": (0.0155, 0.0225)}  # m, see stage A
# Found by hand, from what the first search missed: a rotor damped enough that friction
# no longer drives the backward whirl of the suspension, and a heavy casing.
BY_HAND = {
    "engine.casing.thickness": (0.020, 0.026),
    "engine.casing.width": (0.2, 0.3),
    "engine.casing.damping": (0.005, 0.06),
    "engine.rotor.damping": (0.025, 0.08),
    "pulse": (3e-4, 2e-3),
}


def default_engine() -> Engine:
    """Return the unknowns as the package has them at present."""
    scene = Scene()
    casing, rotor = scene.engine.casing, scene.engine.rotor
    values = (casing.thickness, casing.width, casing.damping, rotor.damping,
              casing.support_frequency, scene.pulse)  # fmt: skip
    return dict(zip(UNKNOWNS, values, strict=True)) | {"direction": scene.direction}


def to_unit(name: str, value: float) -> float:
    """Return where a value lies between its bounds, 0 to 1."""
    low, high, along_log = UNKNOWNS[name]
    if along_log:
        return math.log(value / low) / math.log(high / low)
    return (value - low) / (high - low)


def from_unit(name: str, share: float) -> float:
    """Return the value at a share of the way between the bounds, five digits."""
    low, high, along_log = UNKNOWNS[name]
    share = min(max(share, 0.0), 1.0)
    value = low * (high / low) ** share if along_log else low + share * (high - low)
    return min(max(float(f"{value:.5g}"), low), high)


def draw(
    count: int,
    seed: int,
    within: dict[str, tuple[float, float]] | None = None,
    direction: str | None = None,
) -> list[Engine]:
    """Return engines of a Sobol sequence.

    Parameters
    ----------
    count : engines, best a power of 2
    seed : of the scrambling
    within : {input: (lowest, highest)} where the box is smaller than the bounds
    direction : of the pulse; drawn as well where None
    """
    within = within or {}
    boxes = {name: within.get(name, UNKNOWNS[name][:2]) for name in UNKNOWNS}
    points = qmc.Sobol(len(UNKNOWNS) + 1, seed=seed).random_base2(
        max(0, math.ceil(math.log2(count)))
    )
    engines = []
    for *shares, last in points[:count]:
        engine: Engine = {}
        for (name, (low, high)), share in zip(boxes.items(), shares, strict=True):
            a, b = to_unit(name, low), to_unit(name, high)
            engine[name] = from_unit(name, a + share * (b - a))
        engine["direction"] = direction or DIRECTIONS[int(last >= 0.5)]
        engines.append(engine)
    return engines


def box_around(engine: Engine, half: float) -> dict[str, tuple[float, float]]:
    """Return the box within `half` of each unknown's range to both sides."""
    box = {}
    for name in UNKNOWNS:
        at = to_unit(name, engine[name])
        box[name] = (from_unit(name, at - half), from_unit(name, at + half))
    return box
