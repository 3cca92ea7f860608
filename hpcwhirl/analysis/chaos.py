"""Chaos of a motion: largest Lyapunov exponent, period number, 0-1 test.

The exponent is measured by twins of the full motion (Benettin, Galgani and Strelcyn
1976, Phys. Rev. A 14:2338): a reference and a twin, a small distance away, are
integrated side by side. At equal intervals the growth of the distance is recorded, and
the twin is moved back to the initial distance along the line between both. Nothing is
linearised, so that velocity jumps at contacts need no special treatment.

With `output.chaos`, all numbers are measured on an integration that continues from the
end of a case for a number of revolutions. The section of a motion is its state once per
revolution (Poincaré).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple, Protocol

import numpy as np

from hpcwhirl.arrays import Floats
from hpcwhirl.dynamics.history import Evidence
from hpcwhirl.dynamics.march import March
from hpcwhirl.dynamics.side_by_side import SideBySide

ROUND_OFF = 2.0**-52  # least distance that is not round-off, relative to the motion
BLOCKS = 10  # blocks of growths; their means give an exponent's confidence interval
SHARE = 0.95  # confidence level of an exponent's interval
FEWEST = 2 * BLOCKS  # least number of growths from which an exponent is computed
LONGEST = 32  # longest period that is searched, revolutions
RETURNS = 3  # least number of periods that a section must cover
EXACT = 0.05  # return distance, in scales of the section, taken as 0
ANGLES = 100  # number of angles c of the 0-1 test
GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0
DELTA = 1e-9  # distance of twins, relative to the size of the motion
PARTS = 4  # intervals per revolution, at the end of which the twin is moved back
SETTLE = 0.1  # first share of the revolutions, not counted, in which the twin adjusts
STILL = 1e-9  # variation of a constant quantity, relative to its largest value
# Least scale of a column of a section, relative to the size of the motion: a motion
# that comes to a fixed point varies by what is left of its way there, however little.
LEAST_SCALE = 0.05


class Twins(Protocol):
    """A reference motion and its twin, a slightly different motion of the same system.

    Both are integrated side by side, to see how fast they separate.
    """

    def advance(self) -> float:
        """Integrate both motions by one interval; return their relative distance."""

    def draw(self, factor: float) -> None:
        """Move the twin along the line to the reference motion.

        factor : number by which the difference of both is multiplied
        """


class Exponent(NamedTuple):
    """A largest Lyapunov exponent.

    Attributes
    ----------
    rate : the exponent, 1/s, or 1 per interval if `exponent` was given the interval 1
    error : half the width of its confidence interval of level `SHARE`, same unit
    """

    rate: float
    error: float


def growths(twins: Twins, delta: float, count: int, settle: int = 0) -> Floats:
    """Return the growth ln(distance / delta) of twins in each interval, (count,).

    After each interval the twin is moved back to the distance delta. A distance of 0,
    or below round-off, counts as `ROUND_OFF`; the growth is then an upper bound.

    Parameters
    ----------
    twins : reference and twin, a distance delta apart
    delta : distance relative to the motion's size, well above round-off and so small
        that the growth does not depend on it
    count : number of intervals whose growth is returned
    settle : number of intervals before these, in which the twin turns into the fastest
        growing direction
    """
    out = np.zeros(settle + count)
    for i in range(len(out)):
        apart = twins.advance()
        out[i] = math.log(max(apart, ROUND_OFF) / delta)
        if apart > 0.0:
            twins.draw(delta / apart)
    return out[settle:]


def exponent(growth: Floats, interval: float) -> Exponent:
    """Return the Lyapunov exponent: mean growth per time, and its error by batch means.

    The means of the `BLOCKS` blocks count as independent, so a block must be longer
    than the correlation time of the motion. NaN for fewer than `FEWEST` growths.

    Parameters
    ----------
    growth : (n,), result of `growths`
    interval : s, length of an interval; or 1 for an exponent per interval

    Source: Schmeiser 1982, Oper. Res. 30:556 (batch means); Student's t
    """
    if len(growth) < FEWEST or not np.isfinite(growth).all():
        return Exponent(math.nan, math.nan)
    from scipy.special import stdtrit  # slow to import, and needed only here

    size = len(growth) // BLOCKS
    kept = growth[len(growth) - BLOCKS * size :]
    means = kept.reshape(BLOCKS, size).mean(axis=1) / interval
    wide = float(stdtrit(BLOCKS - 1, 0.5 + 0.5 * SHARE))
    error = wide * float(means.std(ddof=1)) / math.sqrt(BLOCKS)
    return Exponent(float(means.mean()), error)


def returns(section: Floats) -> tuple[int, float]:
    """Return the period n of a motion, revolutions, and how well it repeats.

    The second number is the return distance: the largest distance of a point of the
    section from the mean of all points that are multiples of n revolutions away, so
    that a closed curve, on which a point nearly returns, is not taken for a period. n
    is the smallest period whose return distance is at most twice the least one of all
    periods, plus `EXACT`. Return (0, inf) for fewer than `RETURNS` points.

    Parameters
    ----------
    section : (points, m), one point per revolution, columns divided by their scales
    """
    most = min(LONGEST, len(section) // RETURNS)
    if most < 1:
        return 0, math.inf
    far = np.array([_spread(section, n) for n in range(1, most + 1)])
    best = int(np.argmax(far <= 2.0 * far.min() + EXACT))
    return best + 1, float(far[best])


def _spread(section: Floats, n: int) -> float:
    """Return the return distance of a motion if its period is n revolutions.

    It is the largest distance of a point from the mean of all points that are multiples
    of n revolutions away.

    section : (points, m), one point per revolution, as in `returns`
    """
    rows = len(section) // n
    turns = section[len(section) - rows * n :].reshape(rows, n, -1)
    away = turns - turns.mean(axis=0)
    return float(np.sqrt((away**2).sum(axis=2)).max())


def zero_one(values: Floats) -> float:
    """Return K of the 0-1 test for chaos: near 0 for regular motion, near 1 for chaos.

    The values, less their mean, drive a walk in the plane that turns by an angle c per
    step. For a chaotic motion the walk diffuses, and its mean square displacement
    M_c(n) grows like n; for a regular motion it is bounded. K is the median over c of
    the correlation of n with M_c. The angles divide (pi/5, 4 pi/5) by the golden
    section and are the same in each call. NaN for fewer than 40 values.

    Parameters
    ----------
    values : (N,), one value per revolution, since denser samples of a smooth motion
        look regular

    Source: Gottwald and Melbourne 2009, SIAM J. Appl. Dyn. Syst. 8:129, Sec. 3
    """
    count, values = len(values), values - values.mean()
    if count < 4 * 10:
        return math.nan
    angle = math.pi * (0.2 + 0.6 * (GOLDEN * np.arange(1, ANGLES + 1) % 1.0))
    return float(np.median([_correlation(values, c) for c in angle.tolist()]))


def _correlation(values: Floats, c: float) -> float:
    """Return K_c of the 0-1 test for one angle c of the walk, -1 to 1.

    K_c is the correlation of the walk's mean square displacement M_c(n) with the lag n.

    values, c : (N,), one per revolution, mean removed; rad, angle of the walk
    """
    count, longest = len(values), len(values) // 10
    walk = np.cumsum(values * np.exp(1j * c * np.arange(1, count + 1)))
    lags = np.arange(1, longest + 1)
    moved = np.array(
        [(np.abs(walk[n : n + count - longest] - walk[: count - longest]) ** 2).mean()
         for n in lags.tolist()]
    )  # fmt: skip
    if not moved.std() > 0.0:
        return 0.0
    return float(np.corrcoef(lags, moved)[0, 1])


def twins_of(
    ended: March, revolutions: float, between: Callable[[], None] | None = None
) -> SideBySide | None:
    """Return twins that continue from the end of a case; None: no twins are possible.

    The twin is moved back about `PARTS` times per revolution, after a whole number of
    rows of evidence. A case has no twins at speed 0, or if only one of several equal
    sectors is integrated, since a twin could not leave the symmetry.

    Parameters
    ----------
    ended : integration of the case, at its end
    revolutions : number of revolutions for which the twins can be integrated
    between : called between the slices of time in which twins are integrated, such as
        to look whether the campaign must stop
    """
    speed = abs(ended.scene.speed)
    if ended.lean.model.folds > 1 or speed == 0.0:
        return None
    turn = 2 * math.pi / speed
    return SideBySide(ended, turn / PARTS, revolutions * turn, DELTA, between)


def motion_numbers(twins: SideBySide) -> dict[str, float]:
    """Integrate twins; return exponent, period and result of the 0-1 test by name.

    Names are those of `numbers_of`. Return {} if the reference or the twin ends early,
    such as at the amplitude limit.
    """
    settle = int(SETTLE * twins.intervals)
    growth = growths(twins, DELTA, twins.intervals - settle, settle)
    if twins.ended or not np.isfinite(growth).all():
        return {}
    speed = abs(twins.one.scene.speed)
    points = section_of(twins.one.history().judged, speed, twins.first_row)
    return numbers_of(growth, twins.interval, points)


def numbers_of(growth: Floats, interval: float, points: Floats) -> dict[str, float]:
    """Return `exponent`, `period`, `zero_one` and their errors of a motion, by name.

    The errors are `exponent_error` and `return_distance`. Numbers that are not finite
    are left out.

    Parameters
    ----------
    growth : (n,), ln of the twins' growth in each interval
    interval : s, length of an interval
    points : (points, m), result of `section_of`; the 0-1 test uses the first column,
        the centre's distance: in x and y, a whirl that turns fast and whose radius
        varies chaotically, but slowly, would look regular
    """
    rate, error = exponent(growth, interval)
    period, distance = returns(points)
    found = {
        "exponent": rate,
        "exponent_error": error,
        "period": period,
        "return_distance": distance,
        "zero_one": zero_one(points[:, 0]),
    }
    return {name: value for name, value in found.items() if math.isfinite(value)}


def section_of(judged: Evidence, speed: float, first: int) -> Floats:
    """Return the Poincaré section of a motion, one point per revolution.

    Parameters
    ----------
    judged : evidence of the motion
    speed : rad/s, > 0
    first : number of the row of evidence with which the section begins

    Returns
    -------
    (points, m), the m columns being the centre's distance from the axis, its x and y,
    and the square roots of the energies of rotor and casing, each divided by its
    standard deviation in time, or by `LEAST_SCALE` of its size if that is larger;
    constant ones are left out. The size is the rms of the distance, for energies that
    of the root of their sum. At whole revolutions the rotating and the static frame
    agree
    """
    from scipy.interpolate import CubicSpline  # a slow import, needed only here

    time = judged.time[first:]
    turn = 2 * math.pi / speed
    at = turn * np.arange(math.ceil(time[0] / turn), math.floor(time[-1] / turn) + 1)
    x, y = judged.centre[first:].T
    away = np.hypot(x, y)
    energies = [np.abs(e[first:]) for e in (judged.rotor, judged.casing)]
    sizes = (_rms(away), _rms(np.sqrt(sum(energies))))
    sized = [*((column, sizes[0]) for column in (away, x, y)),
             *((np.sqrt(energy), sizes[1]) for energy in energies)]  # fmt: skip
    out = [
        CubicSpline(time, column)(at) / max(column.std(), LEAST_SCALE * size)
        for column, size in sized
        if column.std() > STILL * np.abs(column).max(initial=0.0)
    ]
    return np.column_stack(out) if out else np.zeros((len(at), 1))


def _rms(values: Floats) -> float:
    return math.sqrt(float((values**2).mean()))
