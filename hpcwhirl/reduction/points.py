"""Points of blades of a rotor from file: contact points of a tip, points with stress.

Contact point m = 0 .. n_c - 1 of blade j lies at the axial place zeta_m, 0 in the
casing's middle, and at the angle 2 pi j / N + tau_m, with radial and tangential axes at
that angle. Its clearance is the scene's gap plus that of the tip's profile. One point
of each blade, `TipPoints.reference`, represents the tip in the traces of blades, in the
labels of modes and in the radial growth with the speed.

Stress is linear in the coordinates, sigma = S x, with x the displacements from the
equilibrium at speed: it is the stress of the vibration, without that of the centrifugal
load. Results have von Mises' equivalent stress of six components, given in any
orthogonal axes that turn with the rotor, or the signed value of a single component.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hpcwhirl.arrays import Floats, Integers
from hpcwhirl.store.models.engine_file import COMPONENTS, Given, wrong_name

BY_POINT = "tip_station", "tip_angle", "tip_gap"
BY_BLADE = (
    "tip_radial",
    "tip_tangential",
    "modal_tip_radial",
    "modal_tip_tangential",
)  # arrays over (blade, point), or over (blade, point, mode) if modal


@dataclass(frozen=True)
class TipPoints:
    """The n_c contact points of each of N tips: their coordinates and positions.

    Attributes
    ----------
    radial, tangential : (N, n_c), indices of their displacements among a rotor's
        coordinates
    station : (n_c,), m, axial positions zeta, ascending, 0 in the casing's middle
    angle : (n_c,), rad, tau, angle of the point less that of its blade
    gap : (n_c,), m, clearance of the point less the scene's gap: the tip's profile
    """

    radial: Integers
    tangential: Integers
    station: Floats
    angle: Floats
    gap: Floats

    @property
    def count(self) -> int:
        """Number of contact points per blade, n_c."""
        return len(self.station)

    @property
    def reference(self) -> int:
        """Index of the contact point that represents its tip: the middle one."""
        return reference_of(self.count)


def reference_of(count: int) -> int:
    """Return the index of the contact point that represents its tip: the middle one.

    count : n_c, number of contact points of a tip
    """
    return count // 2


def with_single_points(given: Given) -> Given:
    """Return an engine file's arrays, without the axis over contact points if n_c = 1.

    Raises
    ------
    InputError
        if a file with one point per tip has an array of `BY_POINT`, such as axial
        places, which only several points may have
    """
    flat = {name: given[name] for name in BY_BLADE if name in given}
    for name, array in flat.items():
        axes = 2 if name.startswith("modal") else 1
        if array.ndim > axes and array.shape[1] == 1:
            flat[name] = array[:, 0]
    out = replace(given, arrays={**given.arrays, **flat})
    if points_in(out) == 1:
        beside = next((name for name in BY_POINT if name in given), None)
        if beside is not None:
            raise given.refusal(
                f"has rotor/{beside}, but one contact point a tip: it belongs to "
                "rotor/tip_radial, or modal_tip_radial, of several points (N, n_c)"
            )
    return out


def points_in(given: Given) -> int:
    """Return the number of contact points per tip, n_c, that an engine's file has."""
    for name, axes in (("tip_radial", 1), ("modal_tip_radial", 2)):
        if name in given and given[name].ndim > axes:
            return int(given[name].shape[1])
    return 1


def tip_points(given: Given, blades: int, start: int) -> TipPoints | None:
    """Return the contact points of a rotor from file; None if each tip has only one.

    The reference points' coordinates are the first of a rotor, (radial, tangential) of
    blade 0, 1, ...; those of all other points, blade by blade, begin at `start`.

    Raises
    ------
    InputError
        if axial places are missing or do not ascend, an array does not have one entry
        per point, or an angle exceeds pi
    """
    count = points_in(given)
    if count == 1:
        return None
    at = _places(given, count)
    rows = np.zeros((blades, count), dtype=np.int64)
    own, others = reference_of(count), np.delete(np.arange(count), reference_of(count))
    rows[:, own] = 2 * np.arange(blades)
    rows[:, others] = start + 2 * np.arange(blades * (count - 1)).reshape(blades, -1)
    return TipPoints(rows, rows + 1, *at)


def reordered(rows: Any) -> tuple[Any, Any]:
    """Split an array over contact points into reference points, and all other points.

    Parameters
    ----------
    rows : (N, n_c, 2, ...), radial and tangential entries of n_c points of N tips

    Returns
    -------
    own, others : (2 N, ...) of reference points; (2 N (n_c - 1), ...) of the others,
        blade by blade
    """
    rest = rows.shape[3:]
    own = reference_of(rows.shape[1])
    others = np.delete(rows, own, axis=1)
    return rows[:, own].reshape(-1, *rest), others.reshape(-1, *rest)


def _places(given: Given, count: int) -> tuple[Floats, Floats, Floats]:
    """Return axial position, m, angle, rad, and extra gap, m, of n_c contact points.

    They are arrays (n_c,) of the file, checked.

    given, count : arrays of an engine's file; n_c
    """
    if "tip_station" not in given:
        raise given.refusal(
            f"has {count} contact points a tip, but no rotor/tip_station: their axial "
            f"places ({count},), m, ascending"
        )
    none = np.zeros(count)
    station, angle, gap = (given.arrays.get(name, none) for name in BY_POINT)
    for name, array in zip(BY_POINT, (station, angle, gap), strict=True):
        if array.shape != (count,):
            allowed = f"have one entry a contact point, {count}"
            raise given.wrong(name, allowed, len(array))
    back = np.flatnonzero(np.diff(station) < 0.0)
    if len(back):
        first = int(back[0])
        got = f"{station[first + 1]:g} m after {station[first]:g} m"
        raise given.wrong("tip_station", "ascend from point to point", got)
    if not np.abs(angle).max() <= math.pi:
        worst = angle[np.abs(angle).argmax()]
        raise given.wrong("tip_angle", "be within +-pi rad", f"{worst:g}")
    return station, angle, gap


ROWS, NAMES = "stress", "stress_name"


@dataclass(frozen=True)
class Stress:
    """Stress at P named points of each of N blades, linear in a rotor's n coordinates.

    Attributes
    ----------
    names : P names, all different
    rows : (N, P, c, n), Pa/m, S in sigma = S x, with x the coordinates and c stress
        components: 6 (normal stresses xx, yy, zz, shear stresses yz, zx, xy), or 1
    """

    names: tuple[str, ...]
    rows: Floats

    def of(self, basis: Floats) -> Stress:
        """Return the same stress as a function of m new coordinates y, x = basis y.

        basis : (n, m)
        """
        return replace(self, rows=self.rows @ basis)

    def at(self, places: Floats) -> Floats:
        """Return the stress at P points of N blades in a displacement, (N, P), Pa.

        It is von Mises' stress of six components, or the only component with its sign.

        places : (n,), m, displacements x in the rotor's coordinates
        """
        found = self.rows @ places
        return von_mises(found) if found.shape[-1] > 1 else found[..., 0]


def von_mises(stress: Floats) -> Floats:
    """Return von Mises' equivalent stress, (...,), Pa.

    stress : (..., 6), Pa, normal stresses xx, yy, zz, then shear stresses yz, zx, xy
    """
    normal, shear = stress[..., :3], stress[..., 3:]
    apart = normal - np.roll(normal, 1, axis=-1)
    squared = (apart**2).sum(axis=-1) / 2 + 3 * (shear**2).sum(axis=-1)
    return np.asarray(np.sqrt(squared))


def stress_of(given: Given, blades: int) -> Stress | None:
    """Return the stress at named points of a rotor from file; None if it has none.

    It is a function of the coordinates of the file's matrices.

    Raises
    ------
    InputError
        if rows or names are missing or have a wrong size, or two names are equal
    """
    there = [name for name in (ROWS, NAMES) if name in given]
    if not there:
        return None
    if len(there) == 1:
        other = NAMES if there[0] == ROWS else ROWS
        raise given.refusal(f"has rotor/{there[0]} without rotor/{other}")
    if "mass" not in given:
        allowed = "come with rotor/mass, whose coordinates it refers to"
        raise given.wrong(ROWS, allowed, "modes alone")
    rows, names = given[ROWS], tuple(map(str, given[NAMES]))
    if rows.shape[2] not in COMPONENTS:
        told = " or ".join(map(str, COMPONENTS))
        raise given.wrong(ROWS, f"have {told} components (axis 2)", rows.shape[2])
    size = blades, len(names), rows.shape[2], len(given["mass"])
    if rows.shape != size:
        told = "blades, names, components, coordinates"
        raise given.wrong(ROWS, f"be {size} ({told})", rows.shape)
    wrong = wrong_name(names)
    if wrong is not None:
        raise given.wrong(NAMES, "be names that are all different", repr(wrong))
    return Stress(names, rows)
