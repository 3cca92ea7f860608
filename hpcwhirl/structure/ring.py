"""The elastic casing: a ring of curved elements on a soft support."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hpcwhirl.arrays import Floats, Integers
from hpcwhirl.scene import Casing
from hpcwhirl.structure.elements import (
    POINTS,
    WEIGHTS,
    CyclicStructure,
    Section,
    add_block,
    curved,
    hermite,
)

NODE = 4  # DoF per node: u, u', w, w'


@dataclass(frozen=True)
class RingOperator:
    """Contact operator of a casing that is a ring of curved elements.

    It gives the ring's displacements at angles and, transposed, the nodal loads of
    forces there: both use the same shape functions, and so are work-conjugate.

    Attributes
    ----------
    elements : number of elements, and of nodes
    radius : m, mean radius of the ring
    """

    elements: int
    radius: float  # m

    @property
    def radial(self) -> Integers:
        """Indices of the radial DoF (w, w') of every node, node by node."""
        nodes = NODE * np.arange(self.elements)[:, None]
        return np.ravel(nodes + np.array([2, 3]))

    @property
    def tangential(self) -> Integers:
        """Indices of the tangential DoF (u, u') of every node, node by node."""
        return self.radial - 2

    @property
    def length(self) -> float:
        """Arc length of an element of the ring, m."""
        return 2 * np.pi * self.radius / self.elements

    def rows(self, angles: Floats, _: object = None) -> tuple[Floats, Floats]:
        """Return the matrices from the DoF to displacements w and u at m angles, rad.

        They are the same at all axial places, which a second argument may give.

        Returns
        -------
        (m, 4 elements) each: for w, radial outward, and for u, tangential
        """
        angles = np.atleast_1d(np.asarray(angles, dtype=np.float64))
        position = np.mod(angles, 2 * np.pi) / (2 * np.pi) * self.elements
        first = np.minimum(position.astype(int), self.elements - 1)
        shapes = hermite(position - first, self.length)
        radial = np.zeros((len(angles), NODE * self.elements))
        tangential = np.zeros_like(radial)
        for local, (end, slope) in enumerate(((0, 0), (0, 1), (1, 0), (1, 1))):
            node = NODE * ((first + end) % self.elements) + slope
            radial[np.arange(len(angles)), node + 2] += shapes[local]
            tangential[np.arange(len(angles)), node] += shapes[local]
        return radial, tangential

    def turned(self, x: Floats, angle: float) -> Floats:
        """Return nodal displacements in axes turned by an angle, rad, (4 elements,).

        They are turned by a Fourier transform. Matrices of a ring of equal elements are
        circulant, so that no energy is lost, except for that of the shortest wave if
        the number of elements is even.

        x : (4 elements,), those in the axes that are not turned
        """
        nodes = x.reshape(-1, NODE)
        waves = np.fft.rfft(nodes, axis=0)
        h = np.arange(len(waves))[:, None]
        shifted = np.fft.irfft(waves * np.exp(1j * h * angle), len(nodes), axis=0)
        return np.asarray(shifted).ravel()

    def _points(self) -> tuple[Floats, Floats]:
        """Return angles, rad, and weights, m, of all Gauss points, to integrate around.

        The weights are arc lengths: they sum up to the circumference of the ring.
        """
        edges = np.arange(self.elements)[:, None] + POINTS[None, :]
        angles = (edges * 2 * np.pi / self.elements).ravel()
        return angles, np.tile(WEIGHTS, self.elements) * self.length

    def waves(self) -> Floats:
        """Return the matrices that give cos and sin amplitudes of w from the DoF.

        Returns (H + 1, 2, 4 elements), of harmonics 0 .. H = elements // 2 of the
        radial displacement w; integrals around the ring are sums over Gauss points
        """
        angles, weights = self._points()
        radial, out = self.rows(angles)[0], []
        for h in range(self.elements // 2 + 1):
            shapes = np.array([np.cos(h * angles), np.sin(h * angles)])
            norm = np.maximum((weights * shapes**2).sum(axis=1), weights[0])
            out.append((weights * shapes) @ radial / norm[:, None])
        return np.array(out)

    def lobes(self, k: int) -> Floats:
        """Return the nodal loads of a pulse with k lobes, (4 elements,).

        The pulse is a radial pressure ~ cos(k theta); loads are scaled so that the
        generalized force on the unit shape cos(k theta) is 1.
        """
        angles, weights = self._points()
        shape = np.cos(k * angles)
        load = (weights * shape) @ self.rows(angles)[0]
        return np.asarray(load / (weights @ shape**2))


def ring(casing: Casing, radius: float) -> tuple[CyclicStructure, RingOperator]:
    """Return a casing as a ring of curved elements: its matrices, its contact operator.

    casing, radius : inputs of the casing; m, mean radius

    DoF of node j: (u, u', w, w'), u tangential with theta, w radial outward,
    static frame. The foundation k_f = rho A omega_c1^2 acts on u and w.
    """
    operator = RingOperator(casing.elements, radius)
    thick = (casing.thickness, casing.thickness)
    section = Section(casing.width, thick, casing.young, casing.density)
    line_mass = casing.density * casing.width * casing.thickness
    foundation = line_mass * casing.support_frequency**2
    parts = curved(operator.length, radius, section, foundation)
    size = NODE * casing.elements
    mass, stiffness = np.zeros((size, size)), np.zeros((size, size))
    for e in range(casing.elements):
        dofs = np.r_[
            NODE * e + np.arange(NODE),
            NODE * ((e + 1) % casing.elements) + np.arange(NODE),
        ]
        for target, part in zip((mass, stiffness), parts, strict=True):
            add_block(target, part, dofs)
    return CyclicStructure(mass, stiffness, casing.elements, NODE, ()), operator
