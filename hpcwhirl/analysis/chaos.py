"""Chaos of a motion: largest Lyapunov exponent, period number, 0-1 test.

The exponent is measured by twins of the full motion (Benettin, Galgani and Strelcyn
1976, Phys. Rev. A 14:2338): a reference and a twin, a small distance away, are
integrated side by side. At equal intervals the growth of the distance is recorded, and
the twin is moved back to the initial distance along the line between both. Nothing is
linearised, so that velocity jumps at contacts need no special treatment.

The numbers are measured on a march that continues from the end of a case.
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
BLOCKS = 10  # blocks of growths whose means give the interval of an exponent
SHARE = 0.95  # confidence level of the interval
FEWEST = 2 * BLOCKS  # growths below which there is no interval
LONGEST = 32  # longest period that is searched, revolutions
RETURNS = 3  # least number of periods that a section must cover
EXACT = 1e-3  # distance of a return, relative to the size of the motion, taken as 0
ANGLES = 100  # number of angles c of the 0-1 test
GOLDEN = (math.sqrt(5.0) - 1.0) / 2.0
DELTA = 1e-9  # distance of twins, relative to the size of the motion
PARTS = 4  # intervals per revolution, at the end of which the twin is moved back
SETTLE = 0.1  # first share of the revolutions, not counted, in which the twin adjusts
STILL = 1e-9  # variation of a constant quantity, relative to its largest value


class Twins(Protocol):
    """A reference motion and its twin, which are integrated side by side."""

    def advance(self) -> float:
        """Integrate both motions by one interval; return their relative distance."""

    def draw(self, factor: float) -> None:
        """Multiply the difference of the twin from the reference motion by `factor`."""


class Exponent(NamedTuple):
    """A largest Lyapunov exponent.

    Attributes
    ----------
    rate : the exponent, in the unit of 1 / interval
    error : half the width of the exponent's confidence interval of level `SHARE`
    """

    rate: float
    error: float


def growths(twins: Twins, delta: float, count: int, settle: int = 0) -> Floats:
    """Return the growth ln(distance / delta) of twins in each interval, (count,).

    A distance of 0, or below round-off, counts as `ROUND_OFF`, so that the growth is an
    upper bound then.

    Parameters
    ----------
    twins : reference and twin, a distance `delta` apart
    delta : distance relative to the motion's size, above round-off, in the linear range
    settle : number of intervals before those counted, in which the twin turns into the
        fastest growing direction
    """
    out = np.zeros(settle + count)
    for i in range(len(out)):
        apart = twins.advance()
        out[i] = math.log(max(apart, ROUND_OFF) / delta)
        if apart > 0.0:
            twins.draw(delta / apart)
    return out[settle:]


def exponent(growth: Floats, interval: float) -> Exponent:
    """Return the mean of growths as Lyapunov exponent, with its error by batch means.

    The means of the `BLOCKS` blocks count as independent, so a block must be longer
    than the correlation time of the motion. NaN for fewer than `FEWEST` growths.

    Parameters
    ----------
    growth : (n,), result of `growths`
    interval : length of an interval, s; or 1 for an exponent per interval

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
    """Return (n, distance): the period n of a section, and the distance of its returns.

    Every point is compared with the mean of all points that are multiples of n away, so
    that a closed curve, on which a point nearly returns, is not taken for a period. n
    is the smallest period whose distance is at most twice the least distance of all
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
    """Return the largest distance of points n revolutions apart from their mean.

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
    """Return K_c of the 0-1 test: correlation of mean square displacement with lag.

    values, c : (N,), one per revolution, mean removed; angle of the walk, rad
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

    The twin is moved back `PARTS` times per revolution, or at each row of evidence.
    A case has no twins at speed 0, or if only one of several equal sectors is
    integrated, since a twin could not leave the symmetry.

    Parameters
    ----------
    ended : integration of the case, at its end
    revolutions : number of revolutions of the measurement
    between : called between slices of the integration
    """
    speed = abs(ended.scene.speed)
    if ended.lean.model.folds > 1 or speed == 0.0:
        return None
    turn = 2 * math.pi / speed
    return SideBySide(ended, turn / PARTS, revolutions * turn, DELTA, between)


def motion_numbers(twins: SideBySide) -> dict[str, float]:
    """Integrate twins; return {name: exponent, period or result of the 0-1 test}.

    Return {} if the reference or the twin ends at a limit.
    """
    settle = int(SETTLE * twins.intervals)
    growth = growths(twins, DELTA, twins.intervals - settle, settle)
    if twins.ended or not np.isfinite(growth).all():
        return {}
    speed = abs(twins.one.scene.speed)
    points = section_of(twins.one.history().judged, speed, twins.first_row)
    return numbers_of(growth, twins.interval, points)


def numbers_of(growth: Floats, interval: float, points: Floats) -> dict[str, float]:
    """Return {name: exponent, period or result of the 0-1 test}, finite ones only.

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
    first : row of evidence with which the section begins

    Returns
    -------
    (points, m), distance of the centre from the axis, its x and y, and the square roots
    of the energies of rotor and casing, each divided by its standard deviation in time;
    constant ones are left out. At whole revolutions the rotating and the static frame
    agree
    """
    from scipy.interpolate import CubicSpline  # a slow import, needed only here

    time = judged.time[first:]
    turn = 2 * math.pi / speed
    at = turn * np.arange(math.ceil(time[0] / turn), math.floor(time[-1] / turn) + 1)
    x, y = judged.centre[first:].T
    energies = [np.sqrt(np.abs(e[first:])) for e in (judged.rotor, judged.casing)]
    out = [
        CubicSpline(time, column)(at) / column.std()
        for column in (np.hypot(x, y), x, y, *energies)
        if column.std() > STILL * np.abs(column).max(initial=0.0)
    ]
    return np.column_stack(out) if out else np.zeros((len(at), 1))
