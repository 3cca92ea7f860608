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
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from hpcwhirl.scene import Scene, flatten

Engine = dict[str, Any]  # {input: value} of the unknowns


class Coordinate(NamedTuple):
    """Where a coordinate lies: lowest, highest, and whether along its logarithm."""

    low: float
    high: float
    along_log: bool = True

    def share(self, value: float) -> float:
        """Return where a value lies between the bounds, 0 to 1."""
        if self.along_log:
            return math.log(value / self.low) / math.log(self.high / self.low)
        return (value - self.low) / (self.high - self.low)

    def value(self, share: float) -> float:
        """Return the value at a share of the way; outside 0 to 1 that at the bound."""
        share = min(max(share, 0.0), 1.0)
        if self.along_log:
            return self.low * (self.high / self.low) ** share
        return self.low + share * (self.high - self.low)


THICKNESS, WIDTH = "engine.casing.thickness", "engine.casing.width"
SUPPORT, PULSE = "engine.casing.support_frequency", "pulse"
COORDINATES: dict[str, Coordinate] = {
    "ring mass": Coordinate(60.0, 600.0),  # kg
    "swing": Coordinate(2e-3, 6e-2),  # m
    THICKNESS: Coordinate(0.015, 0.08),  # m
    "engine.casing.damping": Coordinate(0.0005, 0.4),
    "engine.casing.support_damping": Coordinate(0.0005, 1.0),  # an elastic mounting
    SUPPORT: Coordinate(6.3, 25.0, along_log=False),  # rad/s
    "engine.rotor.damping": Coordinate(0.0005, 0.2),
    "engine.rotor.suspension_damping": Coordinate(0.0005, 1.0),  # a squeeze film
}
PULSES = (1e-4, 6e-3)  # s
UNKNOWNS = (
    THICKNESS, WIDTH, "engine.casing.damping", "engine.casing.support_damping",
    SUPPORT, "engine.rotor.damping", "engine.rotor.suspension_damping", PULSE,
)  # fmt: skip
GAP = 1.28e-4  # m, of Table 2


def default_engine() -> Engine:
    """Return the unknowns as the package has them at present."""
    return engine_of_scene(Scene())


def engine_of_scene(scene: Scene) -> Engine:
    """Return the unknowns of a scene; a ratio that is that of other modes as such."""
    values = flatten(scene)
    engine = {name: values[name] for name in UNKNOWNS}
    for own in ("casing.support", "rotor.suspension"):
        if engine[f"engine.{own}_damping"] < 0.0:  # as the other modes of the body
            body = own.split(".", maxsplit=1)[0]
            engine[f"engine.{own}_damping"] = engine[f"engine.{body}.damping"]
    return engine


def ring_mass(engine: Engine) -> float:
    """Return the casing's mass, kg."""
    return _mass_of_a_square_metre() * float(engine[THICKNESS]) * float(engine[WIDTH])


def swing(engine: Engine) -> float:
    """Return how far the pulse lets the casing swing on its support, undamped, m."""
    impulse = 2 / math.pi * Scene().force * float(engine[PULSE])
    return impulse / (ring_mass(engine) * float(engine[SUPPORT]))


def _mass_of_a_square_metre() -> float:
    """Return the casing's mass over the area of its section, kg/m^2."""
    given = Scene().engine
    return 2 * math.pi * (given.rotor.radius + GAP) * given.casing.density


def engine_at(point: Sequence[float] | NDArray[np.float64]) -> Engine:
    """Return the engine of a point of the unit cube; values have five digits."""
    at = {
        name: coordinate.value(float(share))
        for (name, coordinate), share in zip(COORDINATES.items(), point, strict=True)
    }
    engine = {name: at[name] for name in UNKNOWNS if name in at}
    engine[WIDTH] = at["ring mass"] / (_mass_of_a_square_metre() * at[THICKNESS])
    momentum = at["ring mass"] * at[SUPPORT] * at["swing"]
    pulse = math.pi / 2 * momentum / Scene().force
    engine[PULSE] = min(max(pulse, PULSES[0]), PULSES[1])
    return {name: float(f"{engine[name]:.5g}") for name in UNKNOWNS}


def allowed(engine: Engine) -> Engine:
    """Return an engine with as much damping of the suspension as its rotation wants.

    With the terms of rotation the damper stands, and gives what the suspension has
    beyond the rotor's own damping, which turns.
    """
    if engine.get("engine.rotation", "none") == "none":
        return engine
    ratio = "engine.rotor.suspension_damping"
    return engine | {ratio: max(engine[ratio], engine["engine.rotor.damping"])}


def point_of(engine: Engine) -> NDArray[np.float64]:
    """Return the point of an engine, (coordinates,); of one in the box in 0 to 1."""
    told = engine | {"ring mass": ring_mass(engine), "swing": swing(engine)}
    return np.array([c.share(float(told[name])) for name, c in COORDINATES.items()])


def drawn(count: int, seed: int) -> NDArray[np.float64]:
    """Return points that fill the cube evenly, (count, coordinates): Sobol's."""
    power = max(0, math.ceil(math.log2(count)))
    points = qmc.Sobol(len(COORDINATES), seed=seed).random_base2(power)
    return np.asarray(points[:count])


def neighbours(engine: Engine, change: float) -> list[Engine]:
    """Return engines with one unknown off by a relative change, down and up."""
    return [
        allowed(engine | {name: float(f"{engine[name] * (1.0 + sign * change):.6g}")})
        for name in UNKNOWNS
        for sign in (-1.0, 1.0)
    ]


def scattered(
    engine: Engine, scatter: float, draws: int, seed: int = 1
) -> list[Engine]:
    """Return engines whose unknowns are off by a scatter, each draw its own.

    What else an engine sets stays.
    """
    chance = np.random.default_rng([seed, round(1e6 * scatter)])
    factors = np.exp(scatter * chance.standard_normal((draws, len(UNKNOWNS))))
    return [
        allowed(engine | {n: float(f"{engine[n] * f:.6g}") for n, f in factors_of})
        for factors_of in (list(zip(UNKNOWNS, own, strict=True)) for own in factors)
    ]
