"""A shaft line: Timoshenko beams with rotary inertia and gyroscopic terms, and disks.

A shaft lies along s, with nodes between its elements. Its motion in the static frame is
Z = X + i Y and, of its cross sections, the rotation Phi, which is dZ/ds of a slender
beam. A round shaft is the same in all directions, so that its matrices are real and

M Z'' - i Omega G Z' + K Z = F

in the n coordinates (Z_0, Phi_0, Z_1, Phi_1, ...), followed by the displacements of
pedestals: masses beside the shaft that do not rotate. G has the polar moments of
inertia. In the rotating frame, Z = z e^{i Omega t}, with damping D_i of the shaft's
material, which rotates, and D_s of supports, which do not,

M z'' + [D_i + D_s + 2 i Omega (M - G / 2)] z'
    + [K + i Omega D_s - Omega^2 (M - G)] z = f.

An element of length L has cubic shape functions with the shear parameter p = 12 E I /
(kappa G_s A L^2) (J. Przemieniecki, Theory of Matrix Structural Analysis, 1968; H.
Nelson, A finite rotating shaft element using Timoshenko beam theory, J. Mech. Design
102, 1980), taken from the section in its middle; a linear taper is integrated exactly.
kappa of a tube follows from its inner over its outer diameter m and Poisson's ratio nu
(G. Cowper, The shear coefficient in Timoshenko's beam theory, J. Appl. Mech. 33, 1966):

kappa = 6 (1 + nu) (1 + m^2)^2 / [(7 + 6 nu) (1 + m^2)^2 + (20 + 12 nu) m^2].

The material's damping is viscous, D_i = eta_V K, or has a loss factor eta_H, whose
dissipation per cycle does not depend on the frequency. A loss factor has no matrix in
the time domain; it is taken as modal damping of the free shaft with ratio eta_H / 2,

D_i = eta_H M Psi diag(omega) Psi^T M, K Psi = M Psi diag(omega^2),

which dissipates as much in a vibration in a mode at its frequency omega in the rotating
frame, and more than the loss factor in a faster one.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from scipy.linalg import eigh

from hpcwhirl.arrays import Floats, Indices

_X, _W = np.polynomial.legendre.leggauss(5)  # exact to degree 9
POINTS, WEIGHTS = (_X + 1) / 2, _W / 2
NODE = 2  # coordinates of a node: Z, Phi
GROUND = -1  # of `LineSupport.to`
WHOLE, INNER = -1, -2  # of `LineSupport.part`
STOP = "stop"  # kind of `LineSupport.law`


@dataclass(frozen=True)
class Tube:
    """An element of a shaft: a tube or a rod, whose diameters may vary linearly.

    Attributes
    ----------
    length : m
    outer, inner : diameters at both ends, m; inner 0: solid
    young, density : Pa; kg/m^3
    shear : shear modulus, Pa; infinite: a beam without shear, of Bernoulli or Rayleigh
    poisson : Poisson's ratio, for the shear coefficient
    rotary : whether cross sections have moments of inertia
    node : number of its first node; -1: its place among the tubes of a line
    """

    length: float
    outer: tuple[float, float]
    inner: tuple[float, float]
    young: float
    density: float
    shear: float
    poisson: float
    rotary: bool = True
    node: int = -1

    def at(self, xi: float) -> tuple[float, float]:
        """Return area, m^2, and second moment of area, m^4, at xi along the element.

        xi : position, 0 at its first node to 1 at its second
        """
        out, within = (a * (1 - xi) + b * xi for a, b in (self.outer, self.inner))
        area = math.pi / 4 * (out**2 - within**2)
        return area, math.pi / 64 * (out**4 - within**4)

    @property
    def shear_coefficient(self) -> float:
        """Cowper's kappa of the section with the mean diameters."""
        ratio = (sum(self.inner) / sum(self.outer)) ** 2
        square, nu = (1 + ratio) ** 2, self.poisson
        below = square * (7 + 6 * nu) + ratio * (20 + 12 * nu)
        return 6 * square * (1 + nu) / below

    @property
    def shear_parameter(self) -> float:
        """Shear parameter p = 12 E I / (kappa G_s A L^2), 0 without shear."""
        area, second = self.at(0.5)
        stiff = self.shear_coefficient * self.shear * area * self.length**2
        return 12 * self.young * second / stiff


def deflection(xi: float, length: float, p: float) -> Floats:
    """Return the shape functions of Z along an element, (4,), for (Z, Phi) of its ends.

    xi, length, p : position, 0 to 1; m; shear parameter
    """
    shapes = [
        1 - 3 * xi**2 + 2 * xi**3 + p * (1 - xi),
        length * (xi * (1 - xi) ** 2 + p * xi * (1 - xi) / 2),
        3 * xi**2 - 2 * xi**3 + p * xi,
        length * (xi**2 * (xi - 1) - p * xi * (1 - xi) / 2),
    ]
    return np.array(shapes) / (1 + p)


def rotation(xi: float, length: float, p: float) -> tuple[Floats, Floats]:
    """Return the shape functions of Phi along an element, and of dPhi/ds, (4,) each.

    xi, length, p : position, 0 to 1; m; shear parameter
    """
    turned = [
        6 * xi * (xi - 1) / length,
        (1 - xi) * (1 - 3 * xi + p),
        6 * xi * (1 - xi) / length,
        xi * (3 * xi - 2 + p),
    ]
    bent = [
        6 * (2 * xi - 1) / length, 6 * xi - 4 - p, 6 * (1 - 2 * xi) / length,
        6 * xi - 2 + p,
    ]  # fmt: skip
    return np.array(turned) / (1 + p), np.array(bent) / (1 + p) / length


def tube_matrices(tube: Tube) -> tuple[Floats, Floats, Floats]:
    """Return mass, gyroscopic matrix and stiffness (M, G, K) of a shaft's element.

    Each is (4, 4) in (Z, Phi) of its first and of its second node.
    """
    mass, gyro, stiffness = np.zeros((3, 4, 4))
    length, p = tube.length, tube.shear_parameter
    sheared = np.array([-1.0, -length / 2, 1.0, -length / 2]) * p / (1 + p) / length
    kappa_g = tube.shear_coefficient * tube.shear if p else 0.0
    for xi, weight in zip(POINTS, WEIGHTS, strict=True):
        (area, second), ds = tube.at(xi), weight * length
        moved, (turned, bent) = deflection(xi, length, p), rotation(xi, length, p)
        mass += tube.density * area * ds * np.outer(moved, moved)
        if tube.rotary:
            swung = tube.density * second * ds * np.outer(turned, turned)
            mass += swung
            gyro += 2 * swung
        stiffness += tube.young * second * ds * np.outer(bent, bent)
        stiffness += kappa_g * area * ds * np.outer(sheared, sheared)
    return mass, gyro, stiffness


@dataclass(frozen=True)
class ShaftDisk:
    """A rigid disk on a shaft.

    Attributes
    ----------
    node : of the shaft, from 0
    mass : kg
    polar, about_diameter : moments of inertia I_p, I_d, kg m^2
    """

    node: int
    mass: float
    polar: float = 0.0
    about_diameter: float = 0.0


@dataclass(frozen=True)
class LineSupport:
    """A bearing, seal or other support of a shaft line, static frame.

    Attributes
    ----------
    at, to : coordinates that it connects, of the n of the line; `to` may be `GROUND`
    rows : (speed, k_xx, k_xy, k_yx, k_yy, c_xx, c_xy, c_yx, c_yy) at each speed; rad/s,
        N/m, N s/m
    film, clearance : damping c_0, N s/m, of a squeeze film, which c_xx and c_yy
        include, and its clearance, m; 0: no film
    law : ("journal", mu, L, R, c) or ("rolling", K, c, n, share of the cage) of a
        bearing, see `reduction.bearing_laws`; (`STOP`, c, mu) of a ring with friction
        that stops the shaft; () for another support
    part : number of the support over the whirl's frequency of whose force this one is a
        part; `INNER`: it holds the mass of a branch of such a support; `WHOLE`: neither
    at_rest : stiffness in the modes at rest, N/m; None: the mean at the first speed
    """

    at: int
    to: int
    rows: tuple[tuple[float, ...], ...]
    film: float = 0.0
    clearance: float = 0.0
    law: tuple[str | float, ...] = ()
    part: int = WHOLE
    at_rest: float | None = None

    @property
    def springs(self) -> float:
        """Stiffness in the modes at rest, N/m: (k_xx + k_yy) / 2 at the first speed.

        Of a journal or rolling bearing one for the modes at rest, of small motions at
        100 rad/s and at 10 um of its balls: a film has none at rest.
        """
        if self.at_rest is not None:
            return self.at_rest
        if self.law:
            return _reference(self.law)
        return (self.rows[0][1] + self.rows[0][4]) / 2

    @property
    def is_spring(self) -> bool:
        """Whether it is a constant spring, the same in all directions."""
        _, xx, xy, yx, yy, *damping = self.rows[0]
        alone = len(self.rows) == 1 and not self.law and self.at_rest is None
        return alone and xx == yy and xy == yx == 0.0 and not any(damping)

    def row(self, size: int) -> Floats:
        """Return the row, (n,), that gives its displacement from n coordinates."""
        return row_between(self.at, self.to, size)


def row_between(at: int, to: int, size: int) -> Floats:
    """Return the row, (n,), of coordinate `at` less coordinate `to`, or `GROUND`."""
    row = np.zeros(size)
    row[at] = 1.0
    if to != GROUND:
        row[to] = -1.0
    return row


@dataclass(frozen=True)
class AddedMass:
    """Mass of the fluid in a seal or bearing, which moves with a shaft, without weight.

    Its force is -m Z'', Z the displacement in the static frame.

    Attributes
    ----------
    at, to : as of `LineSupport`
    mass : m, kg, the same along x and y
    """

    at: int
    to: int
    mass: float


def _reference(law: tuple[str | float, ...]) -> float:
    """Return a stiffness, N/m, of a bearing; law : `LineSupport.law`."""
    kind, *numbers = law
    if kind == STOP:
        return 0.0
    a, b, c, d = map(float, numbers)
    if kind == "journal":  # mu, L, R, c
        return 100.0 * a * c * (b / d) ** 3
    return 0.75 * a * c * math.sqrt(1e-5)  # K, c, n, share of the cage


@dataclass(frozen=True)
class OverWhirl:
    """A support whose coefficients depend on the whirl's frequency, as it is fitted.

    Attributes
    ----------
    support : its number among the supports of a line
    low, high : range of the table, rad/s
    error, between : largest difference of the fit's dynamic stiffness from the table's,
        relative to it, at the table's rows, and from a monotone cubic between them
    branches : number of masses on springs and dampers that it has
    """

    support: int
    low: float
    high: float
    error: float
    between: float
    branches: int


@dataclass(frozen=True)
class ShaftLine:
    """A shaft of elements one after the other, with disks, and pedestals beside it.

    Attributes
    ----------
    tubes : elements between a node and the next; several may lie side by side
    disks : rigid disks
    pedestals : kg, mass of each pedestal, which supports may connect to the shaft
    viscous : eta_V, s, of the material's damping
    loss : eta_H, loss factor of the material
    supports : bearings and other supports
    stations : node of each station that users name
    added : added masses, which have no part in `mass`
    over_whirl : supports over the whirl's frequency; the masses of their branches are
        pedestals of 0 kg with added masses
    """

    tubes: tuple[Tube, ...]
    disks: tuple[ShaftDisk, ...] = ()
    pedestals: tuple[float, ...] = ()
    viscous: float = 0.0
    loss: float = 0.0
    supports: tuple[LineSupport, ...] = ()
    stations: tuple[int, ...] = ()
    added: tuple[AddedMass, ...] = ()
    over_whirl: tuple[OverWhirl, ...] = ()

    @property
    def nodes(self) -> int:
        """Number of nodes of the shaft."""
        return int(self.first.max()) + 2

    @property
    def first(self) -> Indices:
        """Number of the first node of each element, (tubes,)."""
        return np.array(
            [e if tube.node < 0 else tube.node for e, tube in enumerate(self.tubes)]
        )

    @property
    def size(self) -> int:
        """Number n of complex coordinates."""
        return NODE * self.nodes + len(self.pedestals)

    @property
    def places(self) -> Floats:
        """Positions of the nodes along the shaft, (nodes,), m, from the first one."""
        lengths = np.zeros(self.nodes)
        lengths[self.first + 1] = [tube.length for tube in self.tubes]
        return np.cumsum(lengths)

    @property
    def mass(self) -> float:
        """Mass of shaft and disks, kg."""
        parts = [
            sum(w * tube.at(xi)[0] for xi, w in zip(POINTS, WEIGHTS, strict=True))
            * tube.density
            * tube.length
            for tube in self.tubes
        ]
        return float(sum(parts) + sum(disk.mass for disk in self.disks))

    @property
    def polar(self) -> float:
        """Polar moment of inertia of shaft and disks, kg m^2."""
        parts = [
            sum(2 * w * tube.at(xi)[1] for xi, w in zip(POINTS, WEIGHTS, strict=True))
            * tube.density
            * tube.length
            for tube in self.tubes
        ]
        return float(sum(parts) + sum(disk.polar for disk in self.disks))


@dataclass(frozen=True, eq=False)
class LineMatrices:
    """The matrices of a free shaft line in its n complex coordinates, real, (n, n).

    Attributes
    ----------
    mass, gyro, stiffness : M, kg; G, kg m^2; K, N/m
    damping : D_i, N s/m, of the material, which rotates
    """

    mass: Floats
    gyro: Floats
    stiffness: Floats
    damping: Floats


def line_matrices(line: ShaftLine) -> LineMatrices:
    """Return the matrices of a shaft line that nothing holds."""
    mass, gyro, stiffness = np.zeros((3, line.size, line.size))
    for node, tube in zip(line.first, line.tubes, strict=True):
        dofs = NODE * node + np.arange(2 * NODE)
        for target, part in zip(
            (mass, gyro, stiffness), tube_matrices(tube), strict=True
        ):
            target[np.ix_(dofs, dofs)] += part
    for disk in line.disks:
        at = NODE * disk.node
        mass[at, at] += disk.mass
        mass[at + 1, at + 1] += disk.about_diameter
        gyro[at + 1, at + 1] += disk.polar
    for place, heavy in enumerate(line.pedestals, NODE * line.nodes):
        mass[place, place] += heavy
    damping = _damping(line, mass, stiffness)
    return LineMatrices(mass + added_matrix(line), gyro, stiffness, damping)


def added_matrix(line: ShaftLine) -> Floats:
    """Return the part of a shaft line's M by added masses, (n, n), kg."""
    matrix = np.zeros((line.size, line.size))
    for one in line.added:
        row = row_between(one.at, one.to, line.size)
        matrix += one.mass * np.outer(row, row)
    return matrix


def _damping(line: ShaftLine, mass: Floats, stiffness: Floats) -> Floats:
    """Return the matrix D_i of the material's damping, (n, n), N s/m.

    mass, stiffness : M and K of the free shaft line, (n, n)
    """
    damping = line.viscous * stiffness
    if line.loss:
        own = slice(NODE * line.nodes)  # pedestals are not part of the shaft
        squared, modes = eigh(stiffness[own, own], mass[own, own])
        lift = mass[own, own] @ modes
        rates = line.loss * np.sqrt(np.maximum(squared, 0.0))
        damping[own, own] += (lift * rates) @ lift.T
    return damping


@lru_cache(maxsize=64)
def line_of(text: str) -> ShaftLine:
    """Return the shaft line of a text that a scene stores, see `scene.shaft_tables`."""
    given = json.loads(text)
    tubes = tuple(map(_tube_of, given["tubes"]))
    pedestals = NODE * (max(tube.node for tube in tubes) + 2)

    def ends(node: int, pedestal: int) -> tuple[int, int]:  # the shaft, or a pedestal
        foot = pedestals + int(pedestal) if pedestal >= 0 else GROUND
        return (NODE * int(node), foot) if node >= 0 else (foot, GROUND)

    supports = tuple(
        _support_of(*ends(node, pedestal), rows, *film)
        for node, pedestal, rows, *film in given["supports"]
    )
    added = tuple(
        AddedMass(*ends(node, pedestal), mass)
        for node, pedestal, mass in given.get("added", ())
    )
    line = ShaftLine(
        tubes,
        tuple(ShaftDisk(int(node), *rest) for node, *rest in given["disks"]),
        tuple(given["pedestals"]),
        given["viscous"],
        given["loss"],
        supports,
        tuple(map(int, given["stations"])),
        added,
    )
    for number, *numbers, branches in given.get("over_whirl", ()):
        line = _with_branches(line, int(number), numbers, branches)
    return line


def _with_branches(
    line: ShaftLine, number: int, numbers: list[float], branches: list[list[float]]
) -> ShaftLine:
    """Return a line with the branches of a support over the whirl's frequency.

    A branch is a mass M that moves with the shaft less what the support stands on: its
    inertia is an added mass, whose displacement is a pedestal's without mass. In the
    modes at rest it is on a spring kappa and leaves the shaft alone, whose support has
    its stiffness at rest, so that all of these springs are positive.

    number : of the support
    numbers, branches : range, errors, see `OverWhirl`; w_0, zeta, kappa and A of each
        branch, see `scene.whirl_fit`
    """
    own = line.supports[number]
    supports, added = list(line.supports), list(line.added)
    at_rest = own.springs
    for place, branch in enumerate(branches, line.size):
        natural, ratio, stiff, xx, xy, yx, yy = branch
        c = 2.0 * ratio * stiff / natural
        to_shaft = 0.0, xx, xy, yx, yy, 0.0, 0.0, 0.0, 0.0
        held = 0.0, stiff - xx, -xy, -yx, stiff - yy, c, 0.0, 0.0, c
        supports += [
            LineSupport(own.at, place, (to_shaft,), part=number, at_rest=0.0),
            LineSupport(place, own.to, (held,), part=INNER, at_rest=stiff),
        ]
        squared = (xx**2 + yy**2) / 2 + xy * yx  # half the trace of A^2
        at_rest += (xx + yy) / 2 - squared / stiff
        added.append(AddedMass(place, own.to, stiff / natural**2))
    supports[number] = replace(own, at_rest=max(at_rest, 0.0))
    low, high, error, between = numbers
    fit = OverWhirl(number, low, high, error, between, len(branches))
    return replace(
        line,
        pedestals=(*line.pedestals, *(0.0 for _ in branches)),
        supports=tuple(supports),
        added=tuple(added),
        over_whirl=(*line.over_whirl, fit),
    )


def _support_of(
    at: int, to: int, rows: list[list[float]], film: Any = None
) -> LineSupport:
    """Return a support from its rows, from the numbers of `small_damping`, or its law.

    at, to, rows, film : see `LineSupport`; mu, L, R, c of a squeeze film, or `law`
    """
    plain = LineSupport(at, to, tuple(map(tuple, rows)))
    if film is None:
        return plain
    if isinstance(film[0], str):
        return replace(plain, law=tuple(film))
    viscosity, length, radius, clearance = film
    c = small_damping(viscosity, length, radius, clearance)
    row = (0.0, *(0.0,) * 4, c, 0.0, 0.0, c)
    return LineSupport(at, to, (row,), c, clearance)


def name_of(line: ShaftLine, own: LineSupport) -> str:
    """Return the name of a support: its station or pedestal, and its kind."""
    kind = str(own.law[0]) if own.law else "film" if own.film else ""
    film, foot = f" {kind}" if kind else "", own.at - NODE * line.nodes
    if foot >= 0:
        return f"pedestal {foot}{film}"
    return f"station {line.stations.index(own.at // NODE)}{film}"


def small_damping(
    viscosity: float, length: float, radius: float, clearance: float
) -> float:
    """Return the damping c_0, N s/m, of a squeeze film in small motions.

    viscosity, length, radius, clearance : mu, Pa s; L, R and c of the film, m
    """
    return math.pi * viscosity * radius * (length / clearance) ** 3


def _tube_of(row: list[float]) -> Tube:
    """Return an element from its row in the text of a shaft line.

    row : first node, length, m, outer diameter at both ends, inner diameter at both
        ends, m, E, Pa, rho, kg/m^3, G, Pa, 0 without shear, nu, whether it has rotary
        inertia
    """
    node, length, out, out_after, within, within_after = row[:6]
    young, density, shear, poisson, rotary = row[6:]
    return Tube(
        length, (out, out_after), (within, within_after), young, density,
        shear or math.inf, poisson, bool(rotary), int(node),
    )  # fmt: skip
