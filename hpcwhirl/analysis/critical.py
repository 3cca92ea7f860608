"""Critical speeds by linear modal coincidence, Eq. (13), and super-harmonics."""

from __future__ import annotations

from collections.abc import Mapping


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
