"""What holds the disk of a bladed disk that tilts: a shaft, reduced to few coordinates.

As its centre moves, the disk tilts: conical whirl. In the rotating frame, of the centre
z, the slope phi of the shaft at the disk and further coordinates q of the shaft, y =
(z, phi, q),

M y'' + [D_i + 2 i Omega (M - G / 2)] y' + [K + Omega^2 (G - M)] y = (F, M_o, 0)

for a flat disk, whose blades are affected by the tilt only through the centre. M and G
have the moments of inertia of the disk, I_d and I_p, and those of the shaft.

A massless shaft has no further coordinates. With bending stiffness E I it is a
cantilever of length L,

k_11 = 12 E I / L^3, k_12 = -6 E I / L^2, k_22 = 4 E I / L,

or it overhangs two bearings, L_1 apart, by L_2, with the compliance

a_11 = L_2^2 (L_1 + L_2) / 3 E I, a_12 = L_2 (2 L_1 + 3 L_2) / 6 E I,
a_22 = (L_1 + 3 L_2) / 3 E I

(Genta, Dynamics of Rotating Systems, 2005; Den Hartog, Mechanical Vibrations, 1956).

Any other is a shaft line, see `shaft`, with springs and dampers at its stations. It is
reduced by the Craig-Bampton method: boundary are Z and Phi of the disk's station and
the coordinates on which a force other than a constant spring's acts; then follow the
lowest modes of the rest, which is held there.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import eigh

from hpcwhirl.arrays import Floats, Indices
from hpcwhirl.errors import InputError
from hpcwhirl.scene import Rotor
from hpcwhirl.scene.shaft_tables import WORDS
from hpcwhirl.structure.shaft import (
    NODE,
    LineSupport,
    ShaftLine,
    added_matrix,
    line_matrices,
    line_of,
)

NONE = np.zeros((0, 0))


@dataclass(frozen=True, eq=False)
class Mount:
    """A shaft that holds the disk, in 1 + w complex coordinates y = (z, phi, q).

    Attributes
    ----------
    mass, gyro, stiffness : M, kg; G, kg m^2; K, N/m; real, (1 + w, 1 + w), of shaft and
        tilting disk, with the constant springs and added masses of supports
    damping : D_i, N s/m, (1 + w, 1 + w), of the shaft's material
    rows : (s, 1 + w), displacement of each further force of a support
    supports : coefficients of these s forces; the stiffness k at their first speed is
        part of K
    weight : (1 + w,), kg, load of shaft and its disks by a unit acceleration
    seats : (t, 1 + w), displacement of each of all t supports, constant springs too
    """

    mass: Floats
    gyro: Floats
    stiffness: Floats
    damping: Floats
    rows: Floats
    supports: tuple[LineSupport, ...] = ()
    weight: Floats = field(default_factory=lambda: np.zeros(0))
    seats: Floats = field(default_factory=lambda: NONE)

    @property
    def is_line(self) -> bool:
        """Whether it is a shaft line, which has mass, and supports of its own."""
        return bool(self.mass[0, 0])

    @property
    def more(self) -> int:
        """Number w of complex coordinates besides the centre's."""
        return len(self.mass) - 1

    @property
    def factor(self) -> Floats:
        """Matrix L, (1 + w, 1 + w), with K = L^T L: sqrt of the energy, twice."""
        squared, shapes = np.linalg.eigh(self.stiffness)
        return np.asarray(np.sqrt(np.maximum(squared, 0.0))[:, None] * shapes.T)


def shaft_stiffness(rotor: Rotor) -> tuple[float, float, float]:
    """Return the stiffness of a rotor's overhung, massless shaft at the disk.

    It is (k_11, k_12, k_22), N/m, N, N m, from displacement and slope of the shaft at
    the disk to force and moment there.
    """
    bending = rotor.shaft_young * np.pi * rotor.shaft_diameter**4 / 64
    span, out = rotor.shaft_length, rotor.shaft_overhang
    if rotor.shaft == "cantilever":
        found = np.array([12 / span**3, -6 / span**2, 4 / span]) * bending
    else:
        cross = out * (2 * span + 3 * out) / 6
        centre, slope = out**2 * (span + out) / 3, (span + 3 * out) / 3
        down = centre * slope - cross**2
        found = np.array([slope, -cross, centre]) * bending / down
    k_11, k_12, k_22 = found.tolist()
    return k_11, k_12, k_22


def mount_of(rotor: Rotor, mass: Floats, radii: Floats) -> Mount | None:
    """Return the shaft that lets a disk tilt; None for a rotor on springs.

    Parameters
    ----------
    rotor : inputs of the rotor
    mass : (n, n), mass matrix of all sectors; for each sector in turn, the radial,
        tangential and rotational DoF of its nodes, then the centre's
    radii : m, radial positions of the nodes of a sector
    """
    if rotor.shaft == "springs":
        return None
    polar = rotor.polar_inertia or polar_of(rotor, mass, radii)
    tilt = rotor.tilt_inertia or polar / 2
    if rotor.shaft in WORDS:
        k_11, k_12, k_22 = shaft_stiffness(rotor)
        held = Mount(
            np.zeros((2, 2)), np.zeros((2, 2)), np.array([[k_11, k_12], [k_12, k_22]]),
            np.zeros((2, 2)), np.zeros((0, 2)),
        )  # fmt: skip
    else:
        held = reduced(line_of(rotor.shaft), rotor.shaft_station, rotor.shaft_modes)
    held.mass[1, 1] += tilt
    held.gyro[1, 1] += polar
    return held


def polar_of(rotor: Rotor, mass: Floats, radii: Floats) -> float:
    """Return the polar moment of inertia of disk and blades, kg m^2.

    rotor, mass, radii : as for `mount_of`
    """
    turned = np.zeros((len(radii), 3))
    turned[:, 1], turned[:, 2] = radii, 1.0
    shape = np.zeros(len(mass))
    shape[: turned.size * rotor.blades] = np.tile(turned.ravel(), rotor.blades)
    return float(shape @ mass @ shape)


def reduced(line: ShaftLine, station: int, modes: int) -> Mount:
    """Return a shaft line reduced to the coordinates of a mount.

    Parameters
    ----------
    line : the shaft with its supports
    station : number of the disk's station
    modes : number of modes kept, at most all

    Raises
    ------
    InputError
        if the line has no such station, or can move without strain
    """
    if not 0 <= station < len(line.stations):
        raise InputError(
            f"shaft_station must be 0 to {len(line.stations) - 1}, the stations of the "
            f"shaft, got {station}"
        )
    own, disk = line_matrices(line), NODE * line.stations[station]
    stiffness, acting = own.stiffness.copy(), []
    for support in line.supports:
        row = support.row(line.size)
        stiffness += support.springs * np.outer(row, row)
        if not support.is_spring:
            acting.append(support)
    _check_held(stiffness)
    points = [place for one in acting for place in (one.at, one.to) if place >= 0]
    kept = [disk, disk + 1]
    kept += [place for place in dict.fromkeys(points) if place not in kept]
    basis = _basis(own.mass, stiffness, np.array(kept, dtype=np.intp), modes)
    parts = (own.mass, own.gyro, stiffness, own.damping)
    mass, gyro, held, damping = (_even(basis.T @ part @ basis) for part in parts)
    rows = np.zeros((len(acting), line.size))
    for row, support in zip(rows, acting, strict=True):
        row[:] = support.row(line.size)
    moved = np.zeros(line.size)
    moved[: NODE * line.nodes : NODE] = 1.0  # pedestals are carried by their ground
    load = basis.T @ (own.mass - added_matrix(line)) @ moved
    seats = np.array([support.row(line.size) for support in line.supports]) @ basis
    return Mount(mass, gyro, held, damping, rows @ basis, tuple(acting), load, seats)


def _check_held(stiffness: Floats) -> None:
    """Raise InputError for a shaft line that moves without strain."""
    lowest, *_, highest = np.linalg.eigvalsh(_scaled(stiffness))
    if not lowest > 1e-12 * highest:
        raise InputError(
            "shaft must be held by springs that resist each displacement and tilt, as "
            "two bearings at two stations do; its bearings leave a motion free"
        )


def _scaled(matrix: Floats) -> Floats:
    size = 1 / np.sqrt(np.maximum(np.diag(matrix), np.finfo(float).tiny))
    return np.asarray(matrix * np.outer(size, size))


def _basis(mass: Floats, stiffness: Floats, kept: Indices, modes: int) -> Floats:
    """Return the Craig-Bampton basis of a shaft line, (n, b + m).

    mass, stiffness : (n, n); kept : (b,), indices of the boundary; modes : number m
    """
    inner = np.setdiff1d(np.arange(len(mass)), kept)
    count = min(modes, len(inner))
    basis = np.zeros((len(mass), len(kept) + count))
    basis[kept, np.arange(len(kept))] = 1.0
    within = np.ix_(inner, inner)
    coupling = stiffness[np.ix_(inner, kept)]
    basis[inner, : len(kept)] = -np.linalg.solve(stiffness[within], coupling)
    if count:
        matrices = stiffness[within], mass[within]
        own = eigh(*matrices, subset_by_index=(0, count - 1))[1]
        basis[inner, len(kept) :] = own
    return basis


def _even(matrix: Floats) -> Floats:
    return np.asarray((matrix + matrix.T) / 2)
