"""Stress at named points of the blades, linear in a rotor's coordinates.

sigma = S x, with x the displacements from the equilibrium at speed: it is the stress of
the vibration, without that of the centrifugal load. Results have von Mises' equivalent
stress of six components, given in any orthogonal axes that turn with the rotor, or the
signed value of a single component.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from hpcwhirl.arrays import Floats
from hpcwhirl.store.models.engine_file import COMPONENTS, Given, wrong_name

ROWS, NAMES = "stress", "stress_name"


@dataclass(frozen=True)
class Stress:
    """Stress at P points of each blade.

    Attributes
    ----------
    names : P names, all different
    rows : (N, P, c, n), Pa/m, S of a rotor's n coordinates; c = 6: normal stresses xx,
        yy, zz, then shear stresses yz, zx, xy
    """

    names: tuple[str, ...]
    rows: Floats

    def of(self, basis: Floats) -> Stress:
        """Return the stress in the coordinates y of x = basis y."""
        return replace(self, rows=self.rows @ basis)

    def at(self, places: Floats) -> Floats:
        """Return the stress at all points, (N, P), Pa, for displacements (n,), m.

        It is von Mises' stress of six components, or the only component with its sign.
        """
        found = self.rows @ places
        return von_mises(found) if found.shape[-1] > 1 else found[..., 0]


def von_mises(stress: Floats) -> Floats:
    """Return von Mises' equivalent stress (...,) of components (..., 6)."""
    normal, shear = stress[..., :3], stress[..., 3:]
    apart = normal - np.roll(normal, 1, axis=-1)
    squared = (apart**2).sum(axis=-1) / 2 + 3 * (shear**2).sum(axis=-1)
    return np.asarray(np.sqrt(squared))


def stress_of(given: Given, blades: int) -> Stress | None:
    """Return the stress of a rotor in the file's coordinates; None if it has none.

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
