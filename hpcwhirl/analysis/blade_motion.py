"""Blades: amplitude, peak, localisation; their contacts; wear of the casing's layer.

Contacts tell which blade touched the casing where, when, and how hard.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hpcwhirl.arrays import Floats, Integers
from hpcwhirl.dynamics.kernels.layer import CUT, DEPTH
from hpcwhirl.dynamics.operators import rod_area
from hpcwhirl.scene import Scene


def blade_numbers(time: Floats, tips: Floats, start: float) -> dict[str, float]:
    """Return the blades' amplitude, peak and localisation; {} with one sample or none.

    The amplitude is the rms about the mean: it does not depend on whether a sample lies
    at a crest, and excludes a steady deflection; for harmonic motion it is proportional
    to the peak. Blades at rest have amplitude 0 and localisation 1.

    Parameters
    ----------
    time : (n,), s
    tips : (n, N, 2), m, rotating frame: radial, tangential; n = 0 without samples
    start : s, time from which amplitudes are taken
    """
    if not len(tips):
        return {}
    late = time > start
    if late.sum() < 2:  # one sample has no amplitude
        return {}
    size = blade_amplitudes(tips[late])
    return {
        "blade_amplitude": float(size.max()),
        "blade_peak": float(np.sqrt(_squares(tips).max())),
        "localisation": localisation(size),
    }


def blade_amplitudes(tips: Floats) -> Floats:
    """Return the rms distance of each of N tips from its mean position, (N,), m.

    Parameters
    ----------
    tips : (n, N, 2), m, rotating frame: radial, tangential
    """
    away = tips - tips.mean(axis=0)
    return np.asarray(np.sqrt(_squares(away).mean(axis=0)))


def _squares(tips: Floats) -> Floats:
    """Return squared magnitudes (n, N), m^2, of N tips' displacements (n, N, 2), m."""
    return np.asarray(tips[..., 0] ** 2 + tips[..., 1] ** 2)


def localisation(size: Floats) -> float:
    """Return the localisation N sum a^4 / (sum a^2)^2 of blade amplitudes a, (N,).

    This is N times the inverse participation ratio of the blades' energies: 1 if all
    blades have equal amplitudes, N if only one blade moves, 1.5 for a standing wave of
    a tuned wheel.
    """
    largest = size.max()
    if not largest > 0.0:
        return 1.0
    energy = (size / largest) ** 2
    return float(len(size) * (energy**2).sum() / energy.sum() ** 2)


class Touches(NamedTuple):
    """Contacts of all blades: c entries, each of a blade in a sampling interval.

    Attributes
    ----------
    time : (c,), s, middle of the interval
    blade : (c,), 0 .. N - 1, the column of the impulses
    angle : (c,), rad in [0, 2 pi), position on the casing, static frame
    impulse : (c,), N s, normal
    """

    time: Floats
    blade: Integers
    angle: Floats
    impulse: Floats


def touches(
    time: Floats, blade_impulse: Floats, speed: float, angles: Floats | None = None
) -> Touches:
    """Return the contacts of a run in order of time.

    Blade j is at theta_j = Omega t + 2 pi j / N, evaluated at the middle of the
    sampling interval, during which the blade turns by Omega times the interval.

    Parameters
    ----------
    time : (n,), s, equally spaced, the first one interval after the start
    blade_impulse : (n, N), N s, cumulative normal impulse of each column
    speed : Omega, rad/s
    angles : (N,), rad, angle at t = 0 of the contact point of each column; None: the
        columns are blades
    """
    if not len(time):
        none = np.zeros(0)
        return Touches(none, np.zeros(0, np.int64), none, none)
    change = np.diff(
        blade_impulse, axis=0, prepend=np.zeros((1, blade_impulse.shape[1]))
    )
    sample, blade = np.nonzero(change > 0.0)
    interval = time[1] - time[0] if len(time) > 1 else time[0]
    when = time[sample] - interval / 2
    around = 2 * np.pi
    place = around * blade / blade_impulse.shape[1]
    if angles is not None:
        place = angles[blade]
    angle = (speed * when + place) % around
    return Touches(when, blade, angle, change[sample, blade])


def wear_numbers(scene: Scene, layer: Floats) -> dict[str, float | int]:
    """Return depth, volume, lobes and work of a worn layer, by name; {} without one.

    layer : (3, M) of M rods around the casing, see `dynamics.history.History`
    """
    depth = layer[DEPTH]
    if not len(depth):
        return {}
    return {
        "wear_depth": float(depth.max()),
        "wear_volume": float(depth.sum() * rod_area(scene)),
        "wear_lobes": lobes_of(depth),
        "wear_turning": float(layer[CUT].sum()),
    }


def lobes_of(depth: Floats) -> int:
    """Return the strongest harmonic >= 1 of worn depth (M,) over the angle; 0: none."""
    sizes = np.abs(np.fft.rfft(depth))[1:]
    return 1 + int(sizes.argmax()) if depth.any() else 0
