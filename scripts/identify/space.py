"""The unknowns of the engine search: coordinates, their box, and engines drawn from it.

Width of the ring and duration of the pulse are poor coordinates: they move everything
at once. What contact meets is the ring's *mass* m = 2 pi R rho h b, and how far it
*swings* on its support after the pulse, A = (2/pi) F tau / (m omega_c1) with k = 1,
undamped, from the impulse of F sin(pi t / tau). Mass, swing and thickness h are
coordinates, width b and pulse tau follow; tau stays within `PULSES`: with 20 ms the
casing was no longer struck, and the motions were lost.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from hpcwhirl.scene import Scene, flatten

Engine = dict[str, Any]  # {input: value} of the unknowns
Floats = NDArray[np.float64]
THICKNESS, WIDTH = "engine.casing.thickness", "engine.casing.width"
SUPPORT, PULSE = "engine.casing.support_frequency", "pulse"
SUSPENSION = "engine.rotor.suspension_damping"
BOX = {  # coordinate: lowest and highest; along the logarithm, but for the support
    "ring mass": (60.0, 600.0),  # kg
    "swing": (2e-3, 6e-2),  # m
    THICKNESS: (0.015, 0.08),  # m
    "engine.casing.damping": (0.0005, 0.4),
    "engine.casing.support_damping": (0.0005, 1.0),  # an elastic mounting
    SUPPORT: (6.3, 25.0),  # rad/s
    "engine.rotor.damping": (0.0005, 0.2),
    SUSPENSION: (0.0005, 1.0),  # a squeeze film
}
PULSES = (1e-4, 6e-3)  # s
UNKNOWNS = (
    THICKNESS, WIDTH, "engine.casing.damping", "engine.casing.support_damping",
    SUPPORT, "engine.rotor.damping", SUSPENSION, PULSE,
)  # fmt: skip
GAP = 1.28e-4  # m, of Table 2


def engine_of_scene(scene: Scene) -> Engine:
    """Return the unknowns of a scene; a ratio that is that of other modes as such."""
    values = flatten(scene)
    engine = {name: values[name] for name in UNKNOWNS}
    for own in ("casing.support", "rotor.suspension"):
        if engine[f"engine.{own}_damping"] < 0.0:  # as the other modes of the body
            body = own.partition(".")[0]
            engine[f"engine.{own}_damping"] = engine[f"engine.{body}.damping"]
    return engine


def engine_at(point: Floats) -> Engine:
    """Return the engine of a point of the unit cube; values have five digits."""
    share = np.clip(point, 0.0, 1.0)
    low, high = np.array(list(BOX.values())).T
    at = dict(zip(BOX, (low * (high / low) ** share).tolist(), strict=True))
    place = list(BOX).index(SUPPORT)
    at[SUPPORT] = float(low[place] + share[place] * (high - low)[place])
    given = Scene()
    around = 2 * math.pi * (given.engine.rotor.radius + GAP)
    at[WIDTH] = at["ring mass"] / (around * given.engine.casing.density * at[THICKNESS])
    momentum = at["ring mass"] * at[SUPPORT] * at["swing"]
    at[PULSE] = float(np.clip(math.pi / 2 * momentum / given.force, *PULSES))
    return {name: float(f"{at[name]:.5g}") for name in UNKNOWNS}


def allowed(engine: Engine) -> Engine:
    """Return an engine with as much damping of the suspension as its rotation wants.

    With the terms of rotation the damper stands, and gives what the suspension has
    beyond the rotor's own damping, which turns.
    """
    if engine.get("engine.rotation", "none") == "none":
        return engine
    least = max(engine[SUSPENSION], engine["engine.rotor.damping"])
    return engine | {SUSPENSION: least}


def drawn(count: int, seed: int) -> Floats:
    """Return points that fill the cube evenly, (count, coordinates): Sobol's."""
    power = max(0, math.ceil(math.log2(count)))
    return np.asarray(qmc.Sobol(len(BOX), seed=seed).random_base2(power)[:count])
