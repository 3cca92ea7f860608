"""Critical speeds by linear modal coincidence, Eq. (13), and super-harmonics."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.reduction.families import Line, first_family, moving_families

Floats = NDArray[np.float64]


def critical_speeds(
    rotor: Mapping[int, float], casing: Mapping[int, float], orders: int = 1
) -> list[dict[str, float | int]]:
    """Return the speeds at which travelling waves of both bodies coincide.

    Omega = (omega_bd,k + n omega_c,k) / k; n = 1 is Eq. (13), n > 1 the n-th
    super-harmonic in time of the casing's mode (Sec. 4.2.3: n = 9).

    Parameters
    ----------
    rotor, casing : {nodal diameter: frequency, rad/s}, e.g. of 1F
    orders : the highest n

    Returns
    -------
    records of nodal_diameter, order and speed (rad/s), by diameter then order;
    k = 0 has none, and neither has a diameter that one body lacks
    """
    return [
        {"nodal_diameter": k, "order": n, "speed": (rotor[k] + n * casing[k]) / k}
        for k in sorted(rotor.keys() & casing.keys())
        if k > 0
        for n in range(1, orders + 1)
    ]


def critical_of_families(table: list[Line], orders: int = 1) -> list[dict[str, Any]]:
    """Return the critical speeds of `moving_families` with 1F of the casing.

    Super-harmonics are told of 1F alone.

    Parameters
    ----------
    table : `modal_table` of a model
    orders : the highest n of 1F

    Returns
    -------
    records as of `critical_speeds` and their family, by diameter, order and speed
    """
    casing = first_family(table, "casing")
    rows: list[dict[str, Any]] = [
        row | {"family": family}
        for family, own in moving_families(table).items()
        for row in critical_speeds(own, casing, orders if family == "1F" else 1)
    ]
    names = ("nodal_diameter", "order", "speed")
    return sorted(rows, key=lambda row: tuple(row[name] for name in names))


def coincidences(
    rotor: Mapping[int, float], casing: Mapping[int, float], orders: int = 1
) -> list[dict[str, float | int]]:
    """Return the speeds > 0 with n omega_c = |k Omega +- omega_bd|.

    In the casing's frame the rotor's waves stand at k Omega + omega_bd (turning with
    the rotation) and k Omega - omega_bd (against it). side = -1 is
    Omega = (omega_bd + n omega_c) / k, Eq. (13) for n = 1, seen from the casing turning
    with the rotation; side = +1 is Omega = (n omega_c - omega_bd) / k; side = 0 is
    Omega = (omega_bd - n omega_c) / k, the wave then turning against the rotation.

    Parameters
    ----------
    rotor, casing : {nodal diameter: frequency, rad/s}
    orders : the highest n

    Returns
    -------
    records of nodal_diameter, order, side and speed (rad/s)
    """
    out: list[dict[str, float | int]] = []
    for k in sorted(rotor.keys() & casing.keys() - {0}):
        for n in range(1, orders + 1):
            own, other = rotor[k], n * casing[k]
            found = {-1: own + other, 1: other - own, 0: own - other}
            out += [
                {"nodal_diameter": k, "order": n, "side": side, "speed": speed / k}
                for side, speed in found.items()
                if speed > 0.0
            ]
    return out


def campbell(
    rotor: Mapping[str, float], k: int, speeds: Floats
) -> dict[str, tuple[Floats, Floats]]:
    """Return {mode: (k Omega + omega_bd, k Omega - omega_bd)}, rad/s, casing's frame.

    Parameters
    ----------
    rotor : {name of the mode: omega_bd, rad/s} of nodal diameter k
    k : nodal diameter
    speeds : (n,), Omega, rad/s

    Returns
    -------
    pairs of (n,), signed: > 0 turns with the rotation
    """
    return {name: (k * speeds + w, k * speeds - w) for name, w in rotor.items()}
