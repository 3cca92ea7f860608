"""Blades of a run: amplitude, peak, localisation; contacts; wear of the casing's layer.

Contacts tell which blade touched the casing, where on the casing, when, and how hard.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from hpcwhirl.arrays import Floats, Integers
from hpcwhirl.dynamics.bodies.operators import rod_area
from hpcwhirl.dynamics.kernels.layer import CUT, DEPTH
from hpcwhirl.scene import Scene


def blade_numbers(time: Floats, tips: Floats, start: float) -> dict[str, float]:
    """Return a run's results `blade_amplitude`, `blade_peak` and `localisation`.

    {} with one sample or none. The amplitude, m, is the largest of all blades, of the
    rms about the mean: it does not depend on whether a sample lies at a crest, and
    excludes a steady deflection; for harmonic motion it is proportional to the peak.
    The peak, m, is the largest displacement of a tip in the whole run. Localisation is
    that of the amplitudes; blades at rest have amplitude 0 and localisation 1.

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
    """Return the vibration amplitude of each of N blades, (N,), m.

    It is the rms distance of the tip from its mean position.

    Parameters
    ----------
    tips : (n, N, 2), m, rotating frame: radial, tangential
    """
    away = tips - tips.mean(axis=0)
    return np.asarray(np.sqrt(_squares(away).mean(axis=0)))


def _squares(tips: Floats) -> Floats:
    """Return the squared magnitude of each displacement of N tips, (n, N), m^2.

    tips : (n, N, 2), m, radial and tangential displacements at n times
    """
    return np.asarray(tips[..., 0] ** 2 + tips[..., 1] ** 2)


def localisation(size: Floats) -> float:
    """Return how much a motion is concentrated on few blades, 1 to N.

    The localisation of blade amplitudes a, `size` : (N,), is N sum a^4 / (sum a^2)^2.

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
    """Contacts of a run: c entries, one for each sampling interval a blade touches in.

    Attributes
    ----------
    time : (c,), s, middle of the sampling interval
    blade : (c,), number of the touching blade, 0 .. N - 1; with several contact points
        per tip, number of the contact point
    angle : (c,), rad in [0, 2 pi), position of the contact on the casing, static frame
    impulse : (c,), N s, normal contact force integrated over the sampling interval
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
    blade_impulse : (n, N), N s, normal impulse of each of N blades, or contact points,
        summed from the start of the run
    speed : Omega, rad/s
    angles : (N,), rad, angle of each contact point at t = 0; None: the columns of
        `blade_impulse` are blades, at 2 pi j / N
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
    """Return the results `wear_*` of the casing's abradable layer; {} without one.

    The layer consists of M radial rods around the casing. The results are the largest
    worn depth, m; the worn volume, m^3; the number of lobes of the wear; and the work,
    J, that the rotation does where a tip slides onto a less worn rod and presses it.

    layer : (3, M), by rod: worn depth, m, work of wear, J, that work of rotation, J
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
    """Return how often wear repeats around the casing: its strongest harmonic >= 1.

    Return 0 where nothing is worn.

    depth : (M,), m, worn depth of each of M rods, at equal angles around the casing
    """
    sizes = np.abs(np.fft.rfft(depth))[1:]
    return 1 + int(sizes.argmax()) if depth.any() else 0
