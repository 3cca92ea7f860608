"""Amplification factors, separation margins and clearance used, as in API 617.

Of API Standard 617, 8th edition, part 1 (the same in API RP 684, SP6.8.2):

- AF = N_c / (N_2 - N_1), N_c the speed of a peak of the response, N_1 and N_2 those
  beside it at which the amplitude is 1 / sqrt(2) of the peak's (4.8.2.1).
- Where AF < 2.5 the response is critically damped and needs no margin. Otherwise
  (4.8.2.10) a peak below the lowest operating speed must be away from it by
  SM = min(16, 17 [1 - 1 / (AF - 1.5)]) per cent of it, and one above the highest by
  SM = min(26, 10 + 17 [1 - 1 / (AF - 1.5)]) per cent of that.
- The scale factor S = A_1 / A, from 0.5 to 6, with A_1 = 25.4 um sqrt(12000 rpm / N_mc)
  and A the largest peak-to-peak amplitude at a probe, here the shaft's centre, over the
  operating speeds (4.8.2.11). S times the amplitude at a close clearance must not
  exceed 75 % of that clearance at any speed up to the highest (4.8.2.12).
- Unbalance: 4 times 6350 g mm W / N_mc, W the mass in kg, N_mc in rpm (4.8.2.7).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from hpcwhirl.reduction.numbers import zero_between

LEAST_AF = 2.5  # amplification factor below which a response is critically damped
CLEARANCE = 0.75  # largest share of a clearance that the scaled response may use
SCALES = 0.5, 6.0  # least and largest scale factor
RPM = 30.0 / math.pi  # of 1 rad/s
HALF = math.sqrt(0.5)
DIGITS = 1e-10  # relative error of speeds


class Operating(NamedTuple):
    """The operating speeds: from the lowest to the highest continuous one, rad/s."""

    low: float
    high: float


@dataclass(frozen=True)
class Peak:
    """A peak of the response at one place.

    Attributes
    ----------
    speed, amplitude : N_c, rad/s; in the unit of the response
    below, above : N_1 and N_2, rad/s; None where the range ends first, or where the
        response rises above this peak first
    """

    speed: float
    amplitude: float
    below: float | None
    above: float | None

    @property
    def amplification(self) -> float | None:
        """AF; with one of N_1, N_2 alone twice its distance; None without both."""
        sides = [
            abs(self.speed - side)
            for side in (self.below, self.above)
            if side is not None
        ]
        return self.speed * len(sides) / (2 * sum(sides)) if sides else None

    @property
    def two_sided(self) -> bool:
        """Whether both half-power points are known."""
        return None not in (self.below, self.above)


def amplification(below: float, peak: float, above: float) -> float:
    """Return AF = N_c / (N_2 - N_1); N_1, N_c, N_2 in any unit of speed."""
    return peak / (above - below)


def required_margin(factor: float, *, above: bool) -> float:
    """Return the separation margin SM that API 617 requires, a share of the speed.

    factor, above : AF; whether the peak lies above the operating speeds, not below
    """
    if factor < LEAST_AF:
        return 0.0
    raised = 17.0 * (1.0 - 1.0 / (factor - 1.5))
    return (min(26.0, 10.0 + raised) if above else min(16.0, raised)) / 100.0


class Margin(NamedTuple):
    """The separation of a peak from the operating speeds.

    Attributes
    ----------
    actual : share of the nearest operating speed; 0: among the operating speeds
    required : the share that API 617 requires, 0 where critically damped
    verdict : "critically damped", "kept", "too close", "inside" the operating speeds,
        or "unknown" without an amplification factor
    """

    actual: float
    required: float | None
    verdict: str


def margin_of(peak: Peak, operating: Operating) -> Margin:
    """Return the separation of a peak from the operating speeds, with its verdict."""
    above, factor = peak.speed > operating.high, peak.amplification
    edge = operating.high if above else operating.low
    inside = operating.low <= peak.speed <= operating.high
    actual = 0.0 if inside else abs(peak.speed - edge) / edge
    if factor is None:
        return Margin(actual, None, "unknown")
    if factor < LEAST_AF:
        return Margin(actual, 0.0, "critically damped")
    needed = required_margin(factor, above=above)
    if inside:
        return Margin(actual, needed, "inside")
    return Margin(actual, needed, "kept" if actual >= needed else "too close")


def scale_factor(amplitude: float, highest: float) -> float:
    """Return the scale factor S of a response at operating speeds.

    amplitude, highest : m, largest at a probe, zero to peak; rad/s, N_mc
    """
    limit = 25.4e-6 * math.sqrt(12000.0 / (highest * RPM))
    return min(max(limit / (2 * amplitude), SCALES[0]), SCALES[1])


def unbalance_of(mass: float, highest: float) -> float:
    """Return the unbalance that a response is computed for, kg m.

    mass, highest : W, kg; N_mc, rad/s
    """
    return 4 * 6350e-6 * mass / (highest * RPM)


def peaks_of(
    size: Callable[[float], float], speeds: Sequence[float], sizes: Sequence[float]
) -> list[Peak]:
    """Return the peaks of a response, ascending in speed.

    size : function from the speed, rad/s, to the amplitude
    speeds, sizes : its samples; a peak is a sample above both neighbours, made exact
    """
    return [
        _peak(size, speeds, sizes, i)
        for i in range(1, len(speeds) - 1)
        if sizes[i - 1] < sizes[i] >= sizes[i + 1]
    ]


def _peak(
    size: Callable[[float], float],
    speeds: Sequence[float],
    sizes: Sequence[float],
    place: int,
) -> Peak:
    from scipy.optimize import minimize_scalar  # slow to import

    found = minimize_scalar(
        lambda speed: -size(speed),
        bounds=(speeds[place - 1], speeds[place + 1]),
        method="bounded",
        options={"xatol": DIGITS * speeds[place]},
    )
    speed = float(found.x)
    top = size(speed)

    def over(at: float) -> float:
        return size(at) - HALF * top

    sides = []
    for outward in (range(place - 1, -1, -1), range(place + 1, len(speeds))):
        inner = speed
        side = None
        for i in outward:
            if sizes[i] > top:
                break
            if sizes[i] < HALF * top:
                side = zero_between(over, inner, speeds[i])
                break
            inner = speeds[i]
        sides.append(side)
    return Peak(speed, top, *sides)
