"""Assembly of cyclic structures, sector by sector."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hpcwhirl.arrays import Floats, Indices
from hpcwhirl.structure.tilting import Tilt


@dataclass(frozen=True)
class CyclicStructure:
    """Matrices of N sectors, identical unless mistuned, and an optional shared centre.

    Attributes
    ----------
    mass, stiffness : (n, n), kg and N/m; a sector's DoF in its own frame
        (radial, tangential, ...), sector j turned by 2 pi j / N
    sectors : number of sectors N
    sector_size : d, number of DoF of a sector; DoF a of sector j is j d + a
    boundary : DoF of a sector that a reduction keeps, e.g. tip radial, tangential
    centre : the two DoF of the centre (x, y in the structure's frame); empty if clamped
    centre_stiffness : N/m, k_o of the shaft's springs, or k_11 if the disk tilts
    mistuned : whether the sectors are not identical
    tilt : shaft and inertia of a tilting disk, whose tilt DoF are not among the n DoF;
        None for shaft springs
    """

    mass: Floats
    stiffness: Floats
    sectors: int
    sector_size: int
    boundary: tuple[int, ...]
    centre: tuple[int, ...] = ()
    centre_stiffness: float = 0.0
    mistuned: bool = False
    tilt: Tilt | None = None


def add_block(target: Floats, block: Floats, dofs: Indices) -> None:
    """Add a block at `dofs` of `target`, in place.

    A DoF that occurs twice in `dofs` (in a ring of one sector) gets both contributions.
    """
    np.add.at(target, (dofs[:, None], dofs[None, :]), block)


def turn(angle: float) -> Floats:
    """Return the (2, 2) matrix that gives components in axes turned by `angle`, rad."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, s], [-s, c]])
