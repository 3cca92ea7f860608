"""Modal models: rotor or ring reduced to real coordinates, its modes, modal damping.

A body of equal sectors is reduced nodal diameter by nodal diameter, each with a complex
block of one sector; then the blocks are assembled to matrices in physical coordinates.
A basis at rest consists of modes at Omega = 0; with terms of rotation it is extended by
modes at a reference speed, so that it serves all speeds.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from hpcwhirl.arrays import Complexes, Floats, Indices, Integers
from hpcwhirl.errors import InputError, ModelError
from hpcwhirl.reduction import supports
from hpcwhirl.reduction.craig_bampton import craig_bampton, enriched
from hpcwhirl.reduction.cyclic_coordinates import (
    block,
    centre_width,
    diameters,
    is_simple,
    real_block,
    spread,
)
from hpcwhirl.reduction.points import Stress, TipPoints
from hpcwhirl.structure import CyclicStructure, Mount, Rotation

Added = tuple[Complexes, Complexes, Complexes]
REACH = 2.0  # reference speed that extends a basis / first natural frequency
BACKWARD = np.array([[-1j]])  # turns conj(x + i y) by 90 degrees, anticlockwise
NONE = np.zeros((0, 0))
NO_ROWS = np.zeros((0, 0), dtype=np.complex128)
ROUND_OFF = 1e-12  # omega^2, relative to the largest, of a rotor's free translation
SUSPENSION_SHARE = 0.5  # least share of strain energy in the springs of the suspension


@dataclass(frozen=True)
class Symmetry:
    """How much the sectors of a rotor from file differ from each other.

    Attributes
    ----------
    deviation : largest relative deviation from equal sectors, of frequency, damping or
        shape, see `recognise`; infinite if modes cannot be paired
    tolerance : deviation up to which sectors count as equal
    where : text that names the quantity, frequency and nodal diameter that deviate most
    """

    deviation: float
    tolerance: float
    where: str


@dataclass(frozen=True)
class SpinBlock:
    """Modes of one nodal diameter at rest, and its terms of rotation.

    The terms are matrices in the complex amplitudes of its m modes, with M = 1.

    Attributes
    ----------
    k, simple : nodal diameter; whether it is a simple harmonic
    omega : (m,), rad/s, at rest
    tips : (2, m), 1/sqrt(kg), radial and tangential motion of a tip in each mode
    hub : (m,), z_o of each mode, the complex displacement of the centre, x_o + i y_o =
        conj(z_o); zero if the centre does not move
    coriolis, stiffening, quartic : (m, m), see `Spin`; the first is skew-Hermitian
    stations : (s, m), displacement of each of the shaft's supports elsewhere, as `hub`
    material : (m, m), 1/s, damping of the shaft's material; None: 0
    """

    k: int
    simple: bool
    omega: Floats
    tips: Complexes
    hub: Complexes
    coriolis: Complexes
    stiffening: Complexes
    quartic: Complexes | None = None
    stations: Complexes = field(default_factory=lambda: NO_ROWS)
    material: Complexes | None = None

    @property
    def multiplicity(self) -> int:
        """Number of real modes per complex mode: 1 for a simple harmonic, else 2."""
        return 1 if self.simple else 2


@dataclass(frozen=True)
class Spin:
    """The terms of rotation: matrices and loads that rotation adds to a reduced rotor.

    M x" + (D + D_s + 2 Omega C) x' + (K + Omega^2 K_1 + Omega^4 K_2 + S) x = f +
    Omega^2 F_c. The supports do not rotate: those that are the same in all directions
    give D_s = c and S = i Im(k + i Omega c) at the centre, see `supports`.

    Attributes
    ----------
    coriolis : C (n, n), kg, skew-symmetric
    stiffening : K_1 (n, n), kg; for the built-in rotor K_g - M
    load : F_c (n,), kg m
    quartic : K_2 (n, n), kg s^2; None: 0
    waves : modes and terms of rotation of each nodal diameter; empty for unequal
        sectors, and for one or two sectors
    support : supports of the centre that the stiffness matrix does not include
    stations : supports of the shaft elsewhere; their springs at rest are in the
        stiffness matrix
    material : D_i (n, n), N s/m, damping of the shaft's material; None: 0
    tilt : indices of the shaft's further coordinates, if the disk tilts
    released : (n,), kg m, the pull of a lost blade with opposite sign; None: none is
        lost
    swing : F_e (n,), kg m; a changing speed adds the force -F_e dOmega/dt; None:
        unknown
    hung : (2, n), kg, loads by a unit acceleration along x and y, of a shaft with mass,
        beyond those of a rigid translation of the rotor; None: 0
    seats : (t, 2, n), displacements x, y of each of all t supports of a shaft line;
        None: the rotor has none
    """

    coriolis: Floats
    stiffening: Floats
    load: Floats
    quartic: Floats | None = None
    waves: tuple[SpinBlock, ...] = ()
    support: supports.Support | supports.Bearing = supports.ROUND
    stations: tuple[supports.Station, ...] = ()
    material: Floats | None = None
    tilt: tuple[int, ...] = ()
    released: Floats | None = None
    swing: Floats | None = None
    hung: Floats | None = None
    seats: Floats | None = None

    @property
    def supports(self) -> tuple[supports.Support | supports.Bearing, ...]:
        """The support of the centre, then those of the shaft's stations."""
        return self.support, *(one.support for one in self.stations)

    @property
    def is_round(self) -> bool:
        """Whether all supports are the same in all directions, in small motions."""
        return all(own.is_round for own in self.supports)

    @property
    def is_plain(self) -> bool:
        """Whether the supports' matrices in the rotating frame are constant in time."""
        return all(own.is_plain for own in self.supports)


def stiffening_at(spin: Spin | SpinBlock, speed: float) -> Any:
    """Return the stiffness that rotation adds to a rotor, Omega^2 K_1 + Omega^4 K_2.

    N/m for terms in physical coordinates, 1/s^2 for those of a nodal diameter's modes.

    spin, speed : terms of rotation; Omega, rad/s
    """
    first = speed**2 * spin.stiffening
    return first if spin.quartic is None else first + speed**4 * spin.quartic


@dataclass(frozen=True, eq=False)  # a key of caches by itself, not by its arrays
class ModalModel:
    """A body, rotor or casing, reduced to n coordinates, and its m modes.

    Attributes
    ----------
    mass, stiffness : (n, n); a rotor's coordinates are the tips (radial,
        tangential of blade 0, 1, ...), the centre x_o, y_o if free, then q_CB;
        a ring's are its nodal DoF. Both (0, 0) for a body with modes only
    shapes : (n, m), 1/sqrt(kg), mass-orthonormal mode shapes
    omega : (m,), rad/s, ascending, natural frequencies at rest
    diameter : (m,), nodal diameter of each mode; for a rotor that is not cyclic the one
        that dominates its tips, see `mistuned`
    rank : (m,), index of the mode among those of its nodal diameter, from 0
    phase : (m,), 0 or 1: the two members of a double harmonic
    centre_share : (m,), share of the strain energy in the shaft's springs; NaN if the
        shapes of a rotor from file do not determine the springs, see `supports`
    damping : modal damping ratio xi, one for all modes or (m,)
    unheld : (2 r, m), 1/s, h where the ratio, one for all modes, is that of the rotor
        without the part h^T h of the stiffness in its modes: sqrt(k_o) times the
        centre's motion x_o, y_o for springs k_o in K, r rows in x, y for a shaft; None:
        all of K counts, and the modes are those of the damping, too
    kept : number of fixed-interface modes actually kept (pairs are never split)
    cyclic : whether all sectors are the same, so that diameter, rank and phase are
        exact
    symmetry : deviation of the sectors, for a rotor from file with three or more blades
    spin : terms of rotation, if included; omega and shapes are those at rest
    reach : rad/s, highest omega of the basis at rest; modes above it occur only because
        the basis was extended to all speeds
    stress : stress at named points of the blades, of a rotor from file that has it
    into_whole : (n, n), coordinates of the rotor with all its blades, for unit ones of
        this rotor, which has lost one; None: none is lost
    points : contact points of a rotor that has several per tip; its tips are then the
        reference points, and the coordinates of all others come after the centre
    """

    mass: Floats
    stiffness: Floats
    shapes: Floats
    omega: Floats
    diameter: Integers
    rank: Integers
    phase: Integers
    centre_share: Floats
    damping: float | Floats
    kept: int
    cyclic: bool = True
    symmetry: Symmetry | None = None
    spin: Spin | None = None
    reach: float = math.inf
    points: TipPoints | None = None
    stress: Stress | None = None
    unheld: Floats | None = None
    into_whole: Floats | None = None

    @property
    def ratios(self) -> Floats:
        """Modal damping ratio of each mode, (m,)."""
        return np.broadcast_to(np.float64(self.damping), self.omega.shape)

    @property
    def has_matrices(self) -> bool:
        """Whether M and K are known in addition to the modes."""
        return len(self.mass) == len(self.shapes)

    @property
    def terms(self) -> Spin:
        """Terms of rotation of a rotor, which must have them."""
        if self.spin is None:
            raise TypeError(self)
        return self.spin

    def only(self, modes: Indices | NDArray[np.bool_], shapes: Floats) -> ModalModel:
        """Return the body with some of its modes, without M and K.

        modes : indices of the modes, or for each whether it is kept
        shapes : (n, modes), their displacements, perhaps in other coordinates
        """
        names = "omega", "diameter", "rank", "phase", "centre_share"
        kept = {name: getattr(self, name)[modes] for name in names}
        kept["shapes"], kept["damping"] = (
            np.ascontiguousarray(shapes),
            self.ratios[modes],
        )
        if self.unheld is not None:
            kept["unheld"] = self.unheld[:, modes]
        return replace(self, mass=NONE, stiffness=NONE, **kept)

    def damping_matrix(self) -> Floats:
        """Return the matrix of modal damping, (n, n), N s/m.

        D = M Phi diag(2 xi omega) Phi^T M, with Phi the mode shapes; of a rotor that
        is damped as without springs, M Phi `unheld_rates` Phi^T M.
        """
        lift = self.mass @ self.shapes
        if self.unheld is None:
            return (lift * (2 * self.ratios * self.omega)) @ lift.T
        rates = unheld_rates(self.ratios, self.omega, self.unheld)
        return np.asarray(lift @ rates @ lift.T)


def unheld_rates(ratios: Floats, omega: Floats, held: Any) -> Any:
    """Return the modal damping, (m, m), 1/s, that a rotor without springs would have.

    It is 2 xi sqrt(Lambda - h^H h), Lambda = diag(omega^2) with springs k_o at the
    centre and h^H h their part of it: diagonal in the modes of the rotor without these
    springs, in which the translation of the whole rotor is not damped.

    Parameters
    ----------
    ratios, omega : (m,), xi, the same for all modes; rad/s, with the springs
    held : h, (2 r, m) of real modes, (r, m) of complex ones, see `ModalModel.unheld`
    """
    squares, shapes = np.linalg.eigh(np.diag(omega**2) - held.conj().T @ held)
    squares[squares < ROUND_OFF * squares.max()] = 0.0
    rates = 2 * ratios * np.sqrt(squares)
    return (shapes * rates) @ shapes.conj().T


def has_centre(model: ModalModel, blades: int) -> bool:
    """Return whether the centre of a rotor is free to move, not clamped.

    model, blades : modal model of the rotor; N
    """
    return len(model.shapes) > 2 * blades + model.kept


def centre_rows(model: ModalModel, blades: int) -> Floats:
    """Return the centre's displacement x_o, y_o in each of m modes, (2, m), 1/sqrt(kg).

    It is 0 if the centre is clamped; model, blades : modal model of the rotor; N
    """
    if not has_centre(model, blades):
        return np.zeros((2, len(model.omega)))
    return model.shapes[2 * blades : 2 * blades + 2]


def unlike(model: ModalModel, blades: int) -> tuple[supports.Station, ...]:
    """Return the supports whose force no constant matrix gives, with their places.

    They differ by direction, have a squeeze film, or are stops, the last ones; () for a
    rotor without any.

    model, blades : modal model of the rotor; N
    """
    spin = model.spin
    if spin is None or spin.is_plain:
        return ()
    every = spin.stations
    if has_centre(model, blades):
        hub = np.eye(len(model.shapes))[2 * blades : 2 * blades + 2]
        every = supports.Station(hub, spin.support), *every
    return supports.apart_of(every)


def unlike_waves(
    spin: Spin, piece: SpinBlock
) -> list[tuple[Complexes, supports.Support | supports.Bearing]]:
    """Return the supports of `unlike`, with their motion in modes as `SpinBlock.hub`.

    They are those of a rotor whose centre is free.

    spin, piece : terms of rotation; modes of a nodal diameter that move the centre
    """
    rows: tuple[Any, ...] = piece.hub, *piece.stations
    pairs = zip(rows, spin.supports, strict=True)
    every = supports.apart_of(tuple(supports.Station(*pair) for pair in pairs))
    return [(one.rows, one.support) for one in every]


def with_ratio(
    model: ModalModel, chosen: NDArray[np.bool_], ratio: float
) -> ModalModel:
    """Return a body's modal model with another damping ratio for some of its modes.

    Parameters
    ----------
    model : the modal model, with m modes
    chosen : (m,), whether a mode gets the ratio
    ratio : damping ratio xi of these modes; if negative, nothing is changed
    """
    if ratio < 0.0 or not chosen.any():
        return model
    return replace(model, damping=np.where(chosen, ratio, model.ratios))


@dataclass(frozen=True)
class Block:
    """The reduced matrices of one nodal diameter, Hermitian, and their modes.

    Attributes
    ----------
    k, simple : nodal diameter; whether it is a simple harmonic
    mass, stiffness : (n, n), in n complex amplitudes of one sector: its boundary DoF,
        the centre, fixed-interface modes
    omega, modes : (n,), rad/s; (n, n), a mode in each column; empty if not needed
    coriolis, stiffening, load, quartic : terms of rotation, if included, see `Spin`
    basis : (d, n), displacements of a sector's d DoF and the centre in each amplitude,
        those of a disk's tilt apart; None: the amplitudes are these displacements
    """

    k: int
    simple: bool
    mass: Complexes
    stiffness: Complexes
    omega: Floats
    modes: Complexes
    coriolis: Complexes | None = None
    stiffening: Complexes | None = None
    load: Complexes | None = None
    quartic: Complexes | None = None
    basis: Complexes | None = None

    @property
    def multiplicity(self) -> int:
        """Number of real coordinates per complex one: 1 if `simple`, else 2."""
        return 1 if self.simple else 2


def _fixed_frequencies(structure: CyclicStructure) -> dict[int, Floats]:
    """Return the fixed-interface frequencies of each nodal diameter, {k: rad/s}."""
    out = {}
    inner = np.setdiff1d(np.arange(structure.sector_size), structure.boundary)
    for k in diameters(structure.sectors):
        stiffness = block(structure.stiffness, structure, k)[np.ix_(inner, inner)]
        mass = block(structure.mass, structure, k)[np.ix_(inner, inner)]
        squared = eigh(stiffness, mass, eigvals_only=True)
        out[k] = np.sqrt(np.maximum(squared, 0.0))
    return out


def check_modes(eta: int, most: int, blades: int) -> None:
    """Raise InputError if a rotor has fewer fixed-interface modes than are asked for.

    eta, most, blades : number of modes asked for, and of those there are; N
    """
    if eta > most:
        of = "1 blade has" if blades == 1 else f"{blades} blades have"
        msg = f"modes must be <= {most}, got {eta}: {of} {most} fixed-interface modes"
        raise InputError(f"{msg}; set `modes` together with `blades`")


def share_out(structure: CyclicStructure, eta: int) -> dict[int, int]:
    """Distribute `eta` fixed-interface modes over nodal diameters, {k: its number}.

    Together these are the lowest `eta` real modes of the whole structure; a pair of
    equal frequency that `eta` would split is left out, to preserve the symmetry.
    """
    inner = structure.sector_size - len(structure.boundary)
    check_modes(eta, inner * structure.sectors, structure.sectors)
    listed = [
        (omega, k)
        for k, values in _fixed_frequencies(structure).items()
        for omega in values
    ]
    return lowest_of(listed, structure.sectors, eta)[0]


def lowest_of(
    listed: Iterable[tuple[float, int]], sectors: int, most: int
) -> tuple[dict[int, int], float]:
    """Choose the lowest modes of all nodal diameters; return how many each one keeps.

    Returns {nodal diameter: number of its lowest modes that are kept}, and the highest
    frequency of these, or its square, as `listed` has it

    listed : (frequency or its square, nodal diameter) of each mode, in any order
    sectors : N
    most : number of real modes to keep; one fewer if that would split a pair
    """
    counts, left, last = dict.fromkeys(diameters(sectors), 0), most, 0.0
    for value, k in sorted(listed):
        width = 1 if is_simple(k, sectors) else 2
        if width > left:
            break
        counts[k] += 1
        left -= width
        last = value
    return counts, last


def reference_speed(structure: CyclicStructure) -> float:
    """Return the speed, rad/s, whose modes extend a basis at rest to all speeds.

    It is `REACH` times the first frequency of nodal diameter 0 of a structure of equal
    sectors at rest.
    """
    mass, stiffness = (
        block(a, structure, 0).real for a in (structure.mass, structure.stiffness)
    )
    return speed_of_basis(mass, stiffness)


def speed_of_basis(mass: Floats, stiffness: Floats) -> float:
    """Return the speed, rad/s, whose modes extend a basis at rest to all speeds.

    It is `REACH` times the lowest natural frequency; mass, stiffness : (n, n), at rest
    """
    squared = eigh(stiffness, mass, eigvals_only=True, subset_by_index=(0, 0))[0]
    return REACH * float(np.sqrt(max(squared, 0.0)))


def reduction_basis(
    mass: Any,
    stiffness: Any,
    kept: tuple[Indices, int],
    taut: Any = None,
    near: Any = None,
) -> Any:
    """Return the Craig-Bampton basis, (n, b + eta), or an extended one for all speeds.

    It has b static modes, one for each boundary DoF, and eta fixed-interface modes.

    Parameters
    ----------
    mass, stiffness : (n, n), at rest
    kept : ((b,), indices of the boundary DoF; eta)
    taut : (n, n), stiffness at the reference speed, whose modes are added to the basis;
        None: a basis at rest only
    near : lowest fixed-interface modes of a similar structure, see `craig_bampton`
    """
    basis, _ = craig_bampton(mass, stiffness, *kept, near)
    if taut is None:
        return basis
    other, _ = craig_bampton(mass, taut, *kept, near)
    return enriched(mass, basis, other, kept[0])


def highest_of(mass: Any, stiffness: Any, count: int) -> float:
    """Return the highest natural frequency, rad/s, that a basis at rest has.

    Of a basis for all speeds it is a part; modes above this frequency do not count.

    mass, stiffness : (n, n), reduced by a basis that was extended to all speeds
    count : number of its leading coordinates, those of the basis at rest
    """
    first, last = (slice(count), slice(count)), (count - 1, count - 1)
    given = stiffness[first], mass[first]
    squared = eigh(*given, eigvals_only=True, subset_by_index=last)
    return float(np.sqrt(max(squared[0], 0.0)))


def _blocks(
    structure: CyclicStructure, eta: int | None, rotation: Rotation | None
) -> Iterator[Block]:
    counts = {} if eta is None else share_out(structure, eta)
    for k in diameters(structure.sectors):
        simple = is_simple(k, structure.sectors)
        mass = block(structure.mass, structure, k)
        stiffness = block(structure.stiffness, structure, k)
        added = None if rotation is None else _added(rotation, structure, k)
        basis = None
        if eta is not None:
            hub = structure.sector_size + np.arange(centre_width(structure, k))
            boundary = np.r_[np.array(structure.boundary, dtype=np.intp), hub]
            taut = None
            if added is not None:
                taut = stiffness + reference_speed(structure) ** 2 * added[1]
            basis = reduction_basis(mass, stiffness, (boundary, counts[k]), taut)
            if added is not None:
                added = _reduced(basis, mass, added)
            mass = basis.conj().T @ mass @ basis
            stiffness = basis.conj().T @ stiffness @ basis
        if structure.mount is not None and k == 1:
            size = structure.sector_size if eta is None else len(structure.boundary)
            own = structure.mount, np.array([size]), BACKWARD
            mass, stiffness = supports.with_mount(*own, mass, stiffness)
            if added is not None:
                added = supports.turning_mount(*own, *added)
        if simple:
            squared, modes = eigh(stiffness.real, mass.real)
        else:
            squared, modes = eigh(stiffness, mass)
        omega = np.sqrt(np.maximum(squared, 0.0))
        more = *(added or (None, None, None)), None, basis
        yield Block(k, simple, mass, stiffness, omega, modes + 0j, *more)


def _added(rotation: Rotation, structure: CyclicStructure, k: int) -> Added:
    """Return a rotor's terms of rotation (C, K_g, F_c + i F_e) on nodal diameter k.

    They are not yet reduced; loads are 0 unless k = 0.
    C is the matrix of Coriolis forces, K_g the stress stiffness, F_c the centrifugal
    load and F_e the load of a changing speed, see `Rotation`. Both loads are real; one
    complex array holds them, so that both are reduced at once.
    """
    coriolis = block(rotation.coriolis, structure, k, skew=True)
    load = np.zeros(len(coriolis), dtype=np.complex128)
    if k == 0:
        size, hub = structure.sector_size, list(structure.centre)
        both = rotation.load + 1j * rotation.swing
        load[:size] = np.sqrt(structure.sectors) * both[:size]
        load[size:] = both[hub][: len(load) - size]
    return coriolis, block(rotation.stiffening, structure, k), load


def _reduced(basis: Complexes, mass: Complexes, added: Added) -> Added:
    """Return the terms of rotation of a nodal diameter, reduced by a basis.

    They are C, K_1 = K_g - M and the loads F_c + i F_e.

    basis, mass, added : (n, m); (n, n); (C, K_g, loads), result of `_added`
    """
    back, (coriolis, stiffening, load) = basis.conj().T, added
    return back @ coriolis @ basis, back @ (stiffening - mass) @ basis, back @ load


def physical_columns(
    piece: Block, structure: CyclicStructure, kept: int, size: int, start: int
) -> Floats:
    """Return the matrix from a block's real coordinates to physical coordinates.

    Returns (size, r), r real coordinates: the real, then the imaginary parts of the
    complex ones of the block.

    The first `kept` coordinates of a block are DoF of a sector, followed by those of
    the centre, if any, and by the amplitudes q_CB of fixed-interface modes, which are
    copied to the rows from `start` on.

    piece, size : block of a nodal diameter; number of physical coordinates of the body
    """
    width, inner = piece.multiplicity, len(piece.mass)
    out = np.zeros((size, inner * width))
    waves = spread(piece.k, structure.sectors)
    rows = kept * np.arange(structure.sectors)
    hub = centre_width(structure, piece.k)
    first = kept + hub
    count = inner - first
    for part in range(width):
        shift = part * inner
        for a in range(kept):
            out[rows + a, shift + a] = waves[:, part]
        if hub == 1:  # x_o + i y_o = conj(z_o)
            out[structure.sectors * kept + part, shift + kept] = (1.0, -1.0)[part]
        elif hub == 2:
            out[structure.sectors * kept + np.arange(2), kept + np.arange(2)] = 1.0
        row = start + part * count
        out[row : row + count, shift + first : shift + inner] = np.eye(count)
    return out


def _real_modes(piece: Block) -> list[Floats]:
    """Return the complex modes of a block as pairs of real modes.

    Returns an array for the first, and one for the second mode of each pair (only the
    first for a simple harmonic), in the block's real coordinates: the real, then the
    imaginary parts of its complex ones
    """
    re, im = piece.modes.real, piece.modes.imag
    if piece.simple:
        return [re]
    return [np.vstack([re, im]), np.vstack([-im, re])]


def _centre_share(piece: Block, structure: CyclicStructure, kept: int) -> Floats:
    """Return the share of a block's modes' strain energy in the shaft's springs, (m,).

    piece, kept : block of a nodal diameter; number of a sector's DoF in it
    """
    moved = piece.modes[kept : kept + centre_width(structure, piece.k)]
    mount = structure.mount if piece.k == 1 else None
    if mount is not None:
        moved = np.vstack([moved, piece.modes[len(piece.modes) - mount.more :]])
    energy = supports.energy_in_shaft(mount, structure.centre_stiffness, moved)
    return np.asarray(energy / np.maximum(piece.omega**2, np.finfo(float).tiny))


def _labels(piece: Block, share: Floats, phase: int) -> list[Floats]:
    """Return the labels [omega, k, rank, phase, share] of a block's m modes, each (m,).

    share, phase : (m,), share of strain energy in the shaft's springs; 0 or 1, which
        mode of each pair the labels are for
    """
    same = np.ones(len(piece.omega))
    rank = np.arange(len(piece.omega), dtype=np.float64)
    return [piece.omega, piece.k * same, rank, phase * same, share]


def _summed(pieces: list[tuple[Block, Floats]], name: str) -> Floats:
    """Return a whole body's matrix, (n, n), in physical coordinates from its blocks.

    pieces : block of each nodal diameter, and matrix from its real to the n physical
        coordinates
    name : the matrix's name in a block, such as "mass"
    """
    parts = [
        columns @ real_block(getattr(piece, name), simple=piece.simple)
        for piece, columns in pieces
    ]  # one product of whole matrices: 500 blades have 251 blocks
    return np.asarray(np.hstack(parts) @ np.hstack([c for _, c in pieces]).T)


def assembled(pieces: list[tuple[Block, Floats]]) -> tuple[Floats, Floats]:
    """Return M, K of the whole body in physical coordinates from its blocks, (n, n).

    pieces : block of each nodal diameter, and matrix from its real to the n physical
        coordinates, from `physical_columns`
    """
    return _summed(pieces, "mass"), _summed(pieces, "stiffness")


def assembled_spin(
    pieces: list[tuple[Block, Floats]], tilt: tuple[int, ...] = ()
) -> Spin | None:
    """Return a rotor's terms of rotation in physical coordinates from its blocks.

    None if the blocks have no terms of rotation.

    pieces : block of each nodal diameter, and matrix from its real to the physical
        coordinates
    tilt : indices of the shaft's further coordinates, if the disk tilts
    """
    if any(piece.load is None for piece, _ in pieces):
        return None
    load, swing = np.zeros((2, len(pieces[0][1])))
    for piece, columns in pieces:
        if piece.k == 0 and piece.load is not None:  # a simple harmonic, so real
            load += columns @ piece.load.real
            swing += columns @ piece.load.imag
    coriolis, quartic = _summed(pieces, "coriolis"), None
    if pieces[0][0].quartic is not None:
        quartic = _summed(pieces, "quartic")
    turned, stiffening = (coriolis - coriolis.T) / 2, _summed(pieces, "stiffening")
    return Spin(turned, stiffening, load, quartic, tilt=tilt, swing=swing)


def whole_basis(
    structure: CyclicStructure, eta: int, rotation: Rotation | None = None
) -> Floats:
    """Return the basis to which `modal_model` reduces a structure, (d, n).

    Its columns are displacements of all d DoF of the structure for unit values of the n
    coordinates; they are 0 for coordinates of a disk's tilt, which no DoF has.

    structure, eta, rotation : parameters of `modal_model`
    """
    kept, size = len(structure.boundary), len(structure.mass)
    blocks = list(_blocks(structure, eta, rotation))
    count = sum(len(b.mass) * b.multiplicity for b in blocks)
    start = kept * structure.sectors + len(structure.centre)
    out = np.zeros((size, count))
    for piece in blocks:
        given = np.asarray(piece.basis)
        wide = np.pad(given, ((0, 0), (0, len(piece.mass) - given.shape[1])))
        columns = physical_columns(piece, structure, kept, count, start)
        own = replace(piece, mass=np.zeros((len(wide), 0), dtype=complex))
        spread_out = physical_columns(own, structure, structure.sector_size, size, size)
        out += spread_out @ real_block(wide, simple=piece.simple) @ columns.T
        inner = len(piece.mass) - kept - centre_width(structure, piece.k)
        start += inner * piece.multiplicity
    return out


def modal_model(
    structure: CyclicStructure,
    damping: float,
    eta: int | None = None,
    rotation: Rotation | None = None,
) -> ModalModel:
    """Return the modal model of a structure of equal sectors: rotor or ring.

    It is reduced nodal diameter by nodal diameter.

    Parameters
    ----------
    structure
        sectors and centre; with `eta`, each sector keeps its boundary DoF
    damping
        modal damping ratio xi, of every mode
    eta
        fixed-interface modes of the Craig-Bampton reduction; None keeps
        every DoF of the structure
    rotation
        matrices of the rotor's rotation, if included; needs `eta`. The basis gets
        further modes, so that it serves all speeds
    """
    if structure.mistuned:
        msg = "a mistuned structure has no nodal diameters: reduce it as a whole"
        raise ModelError(msg)
    kept = structure.sector_size if eta is None else len(structure.boundary)
    blocks = list(_blocks(structure, eta, rotation))
    size = sum(len(b.mass) * b.multiplicity for b in blocks)
    physical = kept * structure.sectors + len(structure.centre)
    pieces, shapes, labels, start = [], [], [], physical
    tilt: tuple[int, ...] = ()
    for piece in blocks:
        columns = physical_columns(piece, structure, kept, size, start)
        pieces.append((piece, columns))
        share = _centre_share(piece, structure, kept)
        for phase, modes in enumerate(_real_modes(piece)):
            shapes.append(columns @ modes)
            labels.append(_labels(piece, share, phase))
        inner = len(piece.mass) - kept - centre_width(structure, piece.k)
        if structure.mount is not None and piece.k == 1:
            last = np.arange(inner - structure.mount.more, inner)
            tilt = tuple((start + np.add.outer(last, [0, inner])).ravel().tolist())
        start += inner * piece.multiplicity
    omega, diameter, rank, phases, shares = map(
        np.concatenate, zip(*labels, strict=True)
    )
    order = np.lexsort((phases, rank, diameter, omega))
    mass, stiffness = assembled(pieces)
    model = ModalModel(
        mass=mass,
        stiffness=stiffness,
        shapes=np.ascontiguousarray(np.hstack(shapes)[:, order]),
        omega=omega[order],
        diameter=diameter[order].astype(np.int64),
        rank=rank[order].astype(np.int64),
        phase=phases[order].astype(np.int64),
        centre_share=shares[order],
        damping=damping,
        kept=size - physical,
        spin=assembled_spin(pieces, tilt),
    )
    return on_mount(model, structure.mount, structure.sectors, -1.0)


def on_mount(
    model: ModalModel, mount: Mount | None, blades: int, sense: float
) -> ModalModel:
    """Return a rotor with the supports and the damping of a shaft line.

    Its modal damping does not include the shaft's stiffness. A rotor on springs or on a
    massless shaft is returned unchanged.

    sense : sign of the coordinates' imaginary parts, which are y; the centre's is y_o
    """
    spin = model.spin
    if mount is None or not mount.is_line or spin is None:
        return model
    x = np.r_[2 * blades, spin.tilt[::2]]
    y = np.r_[2 * blades + 1, spin.tilt[1::2]]
    signs = np.r_[1.0, np.full(mount.more, sense)]

    def rows(own: Floats) -> Floats:  # (r, 1 + w) -> (r, 2, n)
        out = np.zeros((len(own), 2, len(model.mass)))
        out[:, 0, x], out[:, 1, y] = own, own * signs
        return out

    inner = np.zeros_like(model.mass)
    inner[np.ix_(x, x)] = mount.damping
    inner[np.ix_(y, y)] = mount.damping * np.outer(signs, signs)
    stations = tuple(
        supports.Station(row, supports.of_line(own))
        for row, own in zip(rows(mount.rows), mount.supports, strict=True)
    )
    (hung,) = rows((mount.weight - mount.mass[0])[None])
    held = rows(mount.factor).reshape(-1, len(model.mass)) @ model.shapes
    material = inner if inner.any() else None
    seats = rows(mount.seats)
    own = replace(spin, stations=stations, material=material, hung=hung, seats=seats)
    return replace(model, unheld=held, spin=own)
