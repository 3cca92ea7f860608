"""Critical speeds, where waves of rotor and casing coincide: Eq. (13), super-harmonics.

Waves of the same nodal diameter k travel together if their frequencies agree in one
frame. Frequencies are those of linear modes without contact.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from operator import itemgetter
from typing import Any

import numpy as np

from hpcwhirl.reduction.families import (
    Line,
    first_family,
    moving_families,
    moving_ranks,
)
from hpcwhirl.reduction.modes import ModalModel, SpinBlock
from hpcwhirl.reduction.numbers import zero_between
from hpcwhirl.reduction.supports import Bearing
from hpcwhirl.reduction.waves import wave_roots

REACH = 3.0  # highest speed searched / critical speed by frequencies at rest
POINTS = 61  # number of speeds between which crossings are searched


def critical_speeds(
    rotor: Mapping[int, float], casing: Mapping[int, float], orders: int = 1
) -> list[dict[str, float | int]]:
    """Return the critical speeds, where travelling waves of both bodies coincide.

    Omega = (omega_bd,k + n omega_c,k) / k; n = 1 is Eq. (13), n > 1 the n-th
    super-harmonic in time of the casing's mode (Sec. 4.2.3: n = 9).

    Parameters
    ----------
    rotor, casing : {nodal diameter: frequency, rad/s}, e.g. of 1F
    orders : the highest n

    Returns
    -------
    dicts of nodal_diameter, order n and speed (rad/s), sorted by diameter, then order;
    none for k = 0, and none for a diameter that one body lacks
    """
    return [
        {"nodal_diameter": k, "order": n, "speed": (rotor[k] + n * casing[k]) / k}
        for k in sorted(rotor.keys() & casing.keys())
        if k > 0
        for n in range(1, orders + 1)
    ]


def critical_of_waves(
    model: ModalModel, casing: Mapping[int, float], orders: int = 1
) -> list[dict[str, Any]]:
    """Return the critical speeds of a rotor whose frequencies depend on its speed.

    Eq. (13) in the static frame is k Omega + omega_-(Omega) = n omega_c, with omega_- <
    0 the frequency, in the rotating frame, of the wave against the rotation. It is
    solved for 1F, and for the families that move the shaft (n = 1 only). A critical
    speed is the lowest speed at which the left side rises through n omega_c, searched
    up to `REACH` times the critical speed that follows from frequencies at rest, and
    for waves that move the centre within the range of a bearing's table.

    Parameters
    ----------
    model : rotor of equal sectors with terms of rotation
    casing : {nodal diameter: omega of 1F, rad/s}
    orders : the highest n, for 1F

    Returns
    -------
    dicts of nodal_diameter, order n, speed (rad/s) and family of the rotor's wave,
    sorted by diameter, order, speed
    """
    rows: list[dict[str, Any]] = []
    for piece in model.spin.waves if model.spin else ():
        k = piece.k
        if k == 0 or k not in casing:
            continue
        for rank, family in moving_ranks(model, k).items():
            most = orders if family == "1F" else 1
            levels = [casing[k] * n for n in range(1, most + 1)]
            top = REACH * float(piece.omega[rank] + levels[-1]) / k
            at = len(piece.omega) + rank  # backward, by Im s

            def line(speed: float, at: int = at, piece: SpinBlock = piece) -> float:
                root = wave_roots(model, piece, float(speed))[at]
                return float(piece.k * speed - root.imag)

            speeds = _crossings(line, levels, _within(model, piece, top))
            rows += [
                {"nodal_diameter": k, "order": n, "speed": speed, "family": family}
                for n, speed in speeds.items()
            ]
    return sorted(rows, key=itemgetter("nodal_diameter", "order", "speed"))


def _within(model: ModalModel, piece: SpinBlock, top: float) -> tuple[float, float]:
    """Return the speeds, rad/s, of a search that begins at 0 and ends at `top`.

    Waves that move the centre are known only within the range of a bearing's table.
    """
    support = model.terms.support
    if not (piece.hub.any() and isinstance(support, Bearing)):
        return 0.0, top
    low, high = support.range
    return low, min(top, high)


def _crossings(
    line: Callable[[float], float], levels: Sequence[float], ends: tuple[float, float]
) -> dict[int, float]:
    """Return {n: lowest speed, rad/s, at which a frequency rises through level n}.

    A level that is not reached is left out.

    Parameters
    ----------
    line : function from the speed, rad/s, to the frequency, rad/s
    levels : rad/s, levels 1, 2, ...
    ends : rad/s, speeds at which the search begins and ends
    """
    if not ends[0] < ends[1]:
        return {}
    speeds = np.linspace(*ends, POINTS)
    values = np.array([line(speed) for speed in speeds])
    out = {}
    for n, level in enumerate(levels, 1):
        above = values >= level
        rising = np.flatnonzero(above[1:] & ~above[:-1])
        if len(rising):
            low, high = speeds[rising[0]], speeds[rising[0] + 1]
            out[n] = zero_between(partial(_above, line, level), low, high)
    return out


def _above(line: Callable[[float], float], level: float, speed: float) -> float:
    return line(speed) - level


def critical_of_families(table: list[Line], orders: int = 1) -> list[dict[str, Any]]:
    """Return the critical speeds of a rotor whose frequencies do not depend on speed.

    They are the speeds of Eq. (13) at which the rotor's 1F, or a family that moves the
    shaft, coincides with the casing's 1F. Super-harmonics (n > 1) are listed for the
    rotor's 1F only.

    Parameters
    ----------
    table : modal table of a model, from `modal_table`
    orders : the highest n, for 1F

    Returns
    -------
    dicts of nodal_diameter, order n, speed (rad/s) and family of the rotor's mode,
    sorted by diameter, order, speed
    """
    casing = first_family(table, "casing")
    rows: list[dict[str, Any]] = [
        row | {"family": family}
        for family, frequencies in moving_families(table).items()
        for row in critical_speeds(frequencies, casing, orders if family == "1F" else 1)
    ]
    return sorted(rows, key=itemgetter("nodal_diameter", "order", "speed"))


def coincidences(
    rotor: Mapping[int, float], casing: Mapping[int, float], orders: int = 1
) -> list[dict[str, float | int]]:
    """Return all speeds > 0 at which a rotor's wave excites a mode of the casing.

    Their condition is n omega_c = |k Omega +- omega_bd|; Eq. (13) is one of its cases.
    In the casing's frame the rotor's waves have frequencies k Omega + omega_bd (wave
    with the rotation) and k Omega - omega_bd (wave against it). side = -1 is
    Omega = (omega_bd + n omega_c) / k, Eq. (13) for n = 1: seen from the casing the
    wave turns with the rotation; side = +1 is Omega = (n omega_c - omega_bd) / k;
    side = 0 is Omega = (omega_bd - n omega_c) / k: the wave turns against the rotation.

    Parameters
    ----------
    rotor, casing : {nodal diameter: frequency, rad/s}
    orders : the highest n

    Returns
    -------
    dicts of nodal_diameter, order n, side and speed (rad/s)
    """
    out: list[dict[str, float | int]] = []
    for k in sorted(rotor.keys() & casing.keys() - {0}):
        for n in range(1, orders + 1):
            of_rotor, of_casing = rotor[k], n * casing[k]
            speeds = {
                -1: of_rotor + of_casing,
                1: of_casing - of_rotor,
                0: of_rotor - of_casing,
            }
            out += [
                {"nodal_diameter": k, "order": n, "side": side, "speed": speed / k}
                for side, speed in speeds.items()
                if speed > 0.0
            ]
    return out
