"""Numbers that show whether a sustained motion is periodic, quasi-periodic or chaotic.

They are measured on a march that continues from the end of a case, together with a
twin.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.analysis.chaos import exponent, growths, returns, zero_one
from hpcwhirl.dynamics.history import Evidence
from hpcwhirl.dynamics.march import March
from hpcwhirl.dynamics.side_by_side import SideBySide

Floats = NDArray[np.float64]
DELTA = 1e-9  # distance of twins, relative to the size of the motion
PARTS = 4  # intervals per revolution, at the end of which the twin is moved back
SETTLE = 0.1  # first share of the revolutions, not counted, in which the twin adjusts
STILL = 1e-9  # variation of a constant quantity, relative to its largest value


def twins_of(
    ended: March, revolutions: float, between: Callable[[], None] | None = None
) -> SideBySide | None:
    """Return twins that continue from the end of a case, None if there can be none.

    The twin is moved back `PARTS` times per revolution, or at each row of evidence.
    Nothing can be measured at speed 0, or if only one of several equal sectors is
    integrated, since its twins could not leave the symmetry.

    Parameters
    ----------
    ended : march at the end of its case
    revolutions : number of revolutions of the measurement
    between : called between slices
    """
    speed = abs(ended.scene.speed)
    if ended.lean.model.folds > 1 or speed == 0.0:
        return None
    turn = 2 * math.pi / speed
    return SideBySide(ended, turn / PARTS, revolutions * turn, DELTA, between)


def motion_numbers(twins: SideBySide) -> dict[str, float]:
    """Integrate twins to their end; return the numbers of `scene.quantities.CHAOS`.

    {} if one of them ends at a limit.
    """
    settle = int(SETTLE * twins.intervals)
    growth = growths(twins, DELTA, twins.intervals - settle, settle)
    if twins.ended or not np.isfinite(growth).all():
        return {}
    speed = abs(twins.one.scene.speed)
    points = section_of(twins.one.history().judged, speed, twins.first_row)
    return numbers_of(growth, twins.interval, points)


def numbers_of(growth: Floats, interval: float, points: Floats) -> dict[str, float]:
    """Return the numbers of `scene.quantities.CHAOS` that are finite.

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
    """Return the section of a motion once a revolution, t = 2 pi m / Omega.

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
