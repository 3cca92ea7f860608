"""How far axes of frequency reach: from the engine's model and what was swept."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.analysis.critical import campbell
from hpcwhirl.case.resolve import resolve
from hpcwhirl.reduction.families import Line, modal_table, moving_families
from hpcwhirl.store.reading.cases import Cases

Floats = NDArray[np.float64]
MARGIN = 1.2
FAMILIES = ("1F", "2F", "suspension")
MOST_ORDERS = 12  # of the casing's super-harmonics


def rotating_top(cases: Cases, line: Sequence[int]) -> float:
    """Return the highest frequency of a map in the rotating frame, Hz.

    Above both bending families of the blades and the suspension, up to what the
    samples tell.
    """
    table = modal_table(resolve(cases.scene(line[0])).model)
    own = [m.frequency_hz for m in table if m.body == "rotor" and m.family in FAMILIES]
    return min(MARGIN * max(own), nyquist(cases, line))


def centre_top(cases: Cases, line: Sequence[int]) -> float:
    """Return the highest |omega| of a cascade of the static-frame centre, rad/s.

    The centre moves with nodal diameter 1, at omega_bd +- Omega, and at Omega.
    """
    table = modal_table(resolve(cases.scene(line[0])).model)
    own = [
        m.frequency_hz for m in table
        if m.body == "rotor" and m.nodal_diameter == 1 and m.family in FAMILIES
        and m.family != "2F"
    ]  # fmt: skip
    speed = max(abs(cases.rows[i]["speed"]) for i in line)
    top = MARGIN * (2 * np.pi * max(own, default=0.0) + speed)
    return float(min(top or np.inf, 2 * np.pi * nyquist(cases, line)))


def nyquist(cases: Cases, line: Sequence[int]) -> float:
    """Return the highest frequency that the samples of all cases tell, Hz."""
    return 0.5 / float(max(cases.rows[i]["sample_interval"] for i in line))


def own_waves(table: list[Line], k: int) -> dict[str, float]:
    """Return {family: omega, rad/s} of a diameter, of `moving_families`."""
    found = moving_families(table)
    return {family: own[k] for family, own in found.items() if k in own}


def wave_limits(own: Mapping[str, float], k: int, span: Floats) -> tuple[float, float]:
    """Return the least and the largest omega of an interaction diagram, rad/s."""
    waves = [*campbell(own, k, span).values()]
    ends = np.concatenate([np.ravel(w) for w in waves]) if waves else k * span
    low, high = min(ends.min(), 0.0), max(ends.max(), 0.0)
    more = (MARGIN - 1.0) / 2 * ((high - low) or 1.0)
    return float(low - more), float(high + more)


def highest_order(first: float, limits: tuple[float, float]) -> int:
    """Return how many of the casing's harmonics lie within limits, at least 1."""
    if first <= 0.0:
        return 1
    return int(np.clip(max(map(abs, limits)) // first, 1, MOST_ORDERS))
