"""Element matrices, and their assembly into cyclic structures, sector by sector.

Elements are a tapered Bernoulli beam with rod, and a curved ring element. Shape
functions are defined on xi in [0, 1]. Every integrand is a polynomial, so that the
Gauss rule is exact.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from hpcwhirl.arrays import Floats, Indices
from hpcwhirl.structure.mount import Mount

_X, _W = np.polynomial.legendre.leggauss(4)  # exact to degree 7
POINTS, WEIGHTS = (_X + 1) / 2, _W / 2


def hermite(xi: float | Floats, length: float, order: int = 0) -> Floats:
    """Return the cubic Hermite shape functions of an element, or their derivatives.

    Parameters
    ----------
    xi
        position in the element, 0 to 1, array of any shape
    length
        element length, m; scales the two slope shapes
    order
        order of the derivative with respect to arc length: 0, 1 or 2

    Returns
    -------
    (4, ...) : value at node 1, slope at node 1, value at node 2, slope at node 2
    """
    x = np.asarray(xi, dtype=np.float64)
    one = np.ones_like(x)
    if order == 0:
        shapes = [1 - 3 * x**2 + 2 * x**3, x * (1 - x) ** 2]
        shapes += [3 * x**2 - 2 * x**3, x**2 * (x - 1)]
    elif order == 1:
        shapes = [6 * x * (x - 1), (1 - x) * (1 - 3 * x)]
        shapes += [6 * x * (1 - x), x * (3 * x - 2)]
    else:
        shapes = [12 * x - 6 * one, 6 * x - 4 * one]
        shapes += [6 * one - 12 * x, 6 * x - 2 * one]
    scale = np.array([1.0, length, 1.0, length]).reshape((4,) + (1,) * x.ndim)
    return np.asarray(np.array(shapes) * scale / length**order)


@dataclass(frozen=True)
class Section:
    """A rectangular cross section whose thickness varies linearly along an element."""

    width: float  # out of plane, m
    thickness: tuple[float, float]  # in plane, m, at both ends
    young: float  # Pa
    density: float  # kg/m^3

    def at(self, xi: float) -> tuple[float, float]:
        """Return area, m^2, and second moment of area, m^4, at xi along the element.

        xi : position, 0 at its first node to 1 at its second
        """
        h = self.thickness[0] * (1 - xi) + self.thickness[1] * xi
        return self.width * h, self.width * h**3 / 12


@lru_cache(maxsize=64)  # mistuned blades of an engine differ by a factor on K only
def beam(length: float, section: Section) -> tuple[Floats, Floats]:
    """Return mass and stiffness (M, K) of a straight element: Bernoulli beam and rod.

    Returns
    -------
    M, K : (6, 6), SI units; DoF (axial, transverse, rotation) at both nodes, the
        transverse axis 90 degrees anticlockwise from the axial one; read-only
    """
    mass, stiffness = np.zeros((6, 6)), np.zeros((6, 6))
    rod, bend = [0, 3], [1, 2, 4, 5]
    for xi, weight in zip(POINTS, WEIGHTS, strict=True):
        area, second = section.at(xi)
        ds = weight * length
        n_axial = np.array([1 - xi, xi])
        b_axial = np.array([-1.0, 1.0]) / length
        n_bend, b_bend = hermite(xi, length), hermite(xi, length, 2)
        line_mass = section.density * area * ds
        mass[np.ix_(rod, rod)] += line_mass * np.outer(n_axial, n_axial)
        mass[np.ix_(bend, bend)] += line_mass * np.outer(n_bend, n_bend)
        stretch, flex = section.young * area * ds, section.young * second * ds
        stiffness[np.ix_(rod, rod)] += stretch * np.outer(b_axial, b_axial)
        stiffness[np.ix_(bend, bend)] += flex * np.outer(b_bend, b_bend)
    mass.flags.writeable = stiffness.flags.writeable = False
    return mass, stiffness


def curved(
    length: float, radius: float, section: Section, foundation: float
) -> tuple[Floats, Floats]:
    """Return mass and stiffness (M, K) of a curved ring element on its foundation.

    Both displacements are cubic Hermite. Strain energy U and kinetic energy T:

    U = 1/2 int [EA (u' + w/R)^2 + EI (w'' - u'/R)^2 + k_f (u^2 + w^2)] ds,
    T = 1/2 int rho A (u_t^2 + w_t^2) ds, u' = du/ds and u_t = du/dt.

    Parameters
    ----------
    length, radius
        arc length of the element and radius R, m
    section
        rectangular section; `thickness` radial, `width` axial
    foundation
        k_f, N/m per m of arc, radial and tangential

    Returns
    -------
    M, K : (8, 8); DoF (u, u', w, w') at both nodes; u tangential (with theta),
        w radial outward
    """
    mass, stiffness = np.zeros((8, 8)), np.zeros((8, 8))
    u, w = [0, 1, 4, 5], [2, 3, 6, 7]
    for xi, weight in zip(POINTS, WEIGHTS, strict=True):
        area, second = section.at(xi)
        ds = weight * length
        shape, slope = hermite(xi, length), hermite(xi, length, 1)
        membrane, bending = np.zeros(8), np.zeros(8)
        membrane[u], membrane[w] = slope, shape / radius
        bending[u], bending[w] = -slope / radius, hermite(xi, length, 2)
        stiffness += ds * section.young * area * np.outer(membrane, membrane)
        stiffness += ds * section.young * second * np.outer(bending, bending)
        both = np.outer(shape, shape) * ds
        for dofs in (u, w):
            mass[np.ix_(dofs, dofs)] += section.density * area * both
            stiffness[np.ix_(dofs, dofs)] += foundation * both
    return mass, stiffness


@dataclass(frozen=True)
class CyclicStructure:
    """Mass and stiffness of N sectors, equal unless mistuned, and of a shared centre.

    Attributes
    ----------
    mass, stiffness : (n, n), kg and N/m; a sector's DoF in its own frame
        (radial, tangential, ...), sector j turned by 2 pi j / N
    sectors : number of sectors N
    sector_size : d, number of DoF of a sector; DoF a of sector j is j d + a
    boundary : DoF of a sector that a reduction keeps, e.g. tip radial, tangential
    centre : the two DoF of the centre (x, y in the structure's frame); empty if clamped
    centre_stiffness : N/m, k_o of the shaft's springs; 0 if the disk tilts
    mistuned : whether the sectors are not identical
    mount : shaft of a tilting disk, which is not part of the matrices; None for shaft
        springs
    """

    mass: Floats
    stiffness: Floats
    sectors: int
    sector_size: int
    boundary: tuple[int, ...]
    centre: tuple[int, ...] = ()
    centre_stiffness: float = 0.0
    mistuned: bool = False
    mount: Mount | None = None


def add_block(target: Floats, block: Floats, dofs: Indices) -> None:
    """Add an element matrix to a structure's matrix, in place.

    A DoF that occurs twice in `dofs` (in a ring of one sector) gets both contributions.

    target, block, dofs : (n, n); (b, b); (b,), indices of the element's DoF among the n
    """
    np.add.at(target, (dofs[:, None], dofs[None, :]), block)


def turn(angle: float) -> Floats:
    """Return the matrix, (2, 2), that gives a vector's components in turned axes.

    It multiplies the components (x, y).

    angle : rad, by which the axes are turned anticlockwise
    """
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, s], [-s, c]])
