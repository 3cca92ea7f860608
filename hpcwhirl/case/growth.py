"""Growth of an engine's free motion, without contact, in a case and over the speed.

The engine's free waves are those of rotor and supports, which `reduction.growth`
computes, and those of the casing, which only modal damping changes: they never grow.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from hpcwhirl.arrays import Floats
from hpcwhirl.case.speed import extremes, law_of
from hpcwhirl.reduction.families import rotor_by_diameter
from hpcwhirl.reduction.growth import Stability, rates_over, stability
from hpcwhirl.reduction.model import Model
from hpcwhirl.reduction.numbers import representable
from hpcwhirl.scene import Scene

KNOTS = 17  # speeds of a run at which growth is computed at least; linear between them
MOST_KEPT = 256  # number of cached growth rates
MOST_SEARCHED = 32  # number of cached searches


def free_growth(scene: Scene, model: Model) -> tuple[Floats, Floats]:
    """Return growth rates of the fastest growing free motion of the whole engine.

    Parameters
    ----------
    scene : the case
    model : the model of all sectors

    Returns
    -------
    speeds, rates : (n,), rad/s and 1/s; the run's speeds, from the lowest to the
        highest, one if its speed is constant; a rate is 0 where all free motion decays
    """
    if model.rotor.spin is None:
        return np.array([scene.speed]), np.zeros(1)
    low, high = sorted(extremes(scene))
    speeds = (low,) if law_of(scene) is None else _knots(model, low, high)
    return np.array(speeds), _rates(model, speeds)


@lru_cache(maxsize=MOST_KEPT)
def _rates(model: Model, speeds: tuple[float, ...]) -> Floats:
    with representable("the growth of a free motion"):
        return rates_over(rotor_by_diameter(model), model.blades, np.array(speeds))


@lru_cache(maxsize=MOST_KEPT)
def _knots(model: Model, low: float, high: float) -> tuple[float, ...]:
    """Return speeds of a run at which to compute growth, ascending, rad/s.

    Of equal sectors they include the ends and the summit of each band in which a free
    motion grows, so that a narrow one is not missed. For unequal ones a search would
    take longer than many a run.

    low, high : lowest and highest speed of the run, with sign
    """
    knots = {*np.linspace(low, high, KNOTS).tolist()}
    spin = model.rotor.spin
    if spin is not None and spin.waves:
        found = stability_of(model, max(abs(low), abs(high)))
        for band in found.bands if found else ():
            for speed in (band.start, band.speed, band.end):
                knots |= {one for one in (speed, -speed) if low <= one <= high}
    return tuple(sorted(knots))


def largest_free_growth(scene: Scene, model: Model) -> float:
    """Return the largest growth rate of a free motion in a run, 1/s; 0 if none grows.

    scene, model : the case; the model of all sectors
    """
    return float(free_growth(scene, model)[1].max())


@lru_cache(maxsize=MOST_SEARCHED)
def stability_of(model: Model, fastest: float) -> Stability | None:
    """Return the bands of speed in which free motion grows; None without rotation.

    model, fastest : the model of all sectors; rad/s, the highest speed of interest
    """
    if model.rotor.spin is None:
        return None
    with representable("the growth of free motions over the speed"):
        return stability(rotor_by_diameter(model), model.blades, fastest)
