"""The unknowns of the engine search, their bounds, and engines drawn from them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import qmc

from hpcwhirl.scene import Scene, flatten

Engine = dict[str, Any]  # {input: value} of the unknowns
# input: lowest, highest, whether the search is along its logarithm
UNKNOWNS: dict[str, tuple[float, float, bool]] = {
    "engine.casing.thickness": (0.005, 0.06, True),  # m
    "engine.casing.width": (0.02, 0.3, True),  # m
    "engine.casing.damping": (0.0005, 0.2, True),
    "engine.casing.support_damping": (0.0005, 1.0, True),  # an elastic mounting
    "engine.casing.support_frequency": (6.3, 25.0, False),  # rad/s
    "engine.rotor.damping": (0.0005, 0.2, True),
    "engine.rotor.suspension_damping": (0.0005, 1.0, True),  # a squeeze film
    "pulse": (1e-4, 3e-3, True),  # s
}
# Found by hand, before this search took its present form: with one damping ratio for
# each body the backward whirl of the suspension hides what the paper shows, hence the
# two ratios of their own. They start the search beside a Sobol sequence; in the order
# of UNKNOWNS.
BY_HAND = (
    (0.02181, 0.2845, 0.01835, 0.01835, 13.85, 0.00524, 0.7, 0.399e-3),
    (0.02663, 0.2077, 0.1214, 0.4303, 16.29, 0.01103, 0.1964, 0.7802e-3),
    (0.0295, 0.149, 0.0511, 0.612, 13.4, 0.0116, 0.115, 0.435e-3),
    (0.0218, 0.160, 0.064, 0.064, 14.6, 0.0104, 0.0104, 0.97e-3),
)


def default_engine() -> Engine:
    """Return the unknowns as the package has them at present."""
    values = flatten(Scene())
    engine = {name: values[name] for name in UNKNOWNS}
    for own in ("casing.support", "rotor.suspension"):
        if engine[f"engine.{own}_damping"] < 0.0:  # as the other modes of the body
            body = own.split(".", maxsplit=1)[0]
            engine[f"engine.{own}_damping"] = engine[f"engine.{body}.damping"]
    return engine


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


def engine_at(point: Sequence[float]) -> Engine:
    """Return the engine of a point of the unit cube."""
    return {n: from_unit(n, float(x)) for n, x in zip(UNKNOWNS, point, strict=True)}


def point_of(engine: Engine) -> list[float]:
    """Return the point of the unit cube of an engine."""
    return [to_unit(name, engine[name]) for name in UNKNOWNS]


def first_population(count: int, seed: int) -> NDArray[np.float64]:
    """Return the points that a search begins with, (count, unknowns).

    The present default and those found by hand, then a Sobol sequence.
    """
    by_hand = [dict(zip(UNKNOWNS, values, strict=True)) for values in BY_HAND]
    first = default_engine()
    others = [engine for engine in by_hand if engine != first]
    starts = [point_of(engine) for engine in (first, *others)][:count]
    drawn = qmc.Sobol(len(UNKNOWNS), seed=seed).random_base2(
        max(0, math.ceil(math.log2(count)))
    )
    return np.vstack([starts, drawn[: count - len(starts)]])
