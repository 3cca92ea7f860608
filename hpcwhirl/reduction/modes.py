"""Reduced rotor and ring in real coordinates, their modes and modal damping."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

from hpcwhirl.errors import InputError, ModelError
from hpcwhirl.reduction.craig_bampton import craig_bampton
from hpcwhirl.reduction.cyclic import (
    Complexes,
    block,
    centre_width,
    diameters,
    is_simple,
    real_block,
    spread,
)
from hpcwhirl.structure import CyclicStructure

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
SUSPENSION_SHARE = 0.5  # of a mode's strain energy in the shaft's springs: suspension


@dataclass(frozen=True)
class Symmetry:
    """What is known of the equality of a rotor's sectors, see `recognise`.

    Attributes
    ----------
    deviation : the largest; relative. Infinite where pairs are missing
    tolerance : up to which sectors are taken for equal
    where : of what it is, at which frequency and nodal diameter
    """

    deviation: float
    tolerance: float
    where: str


@dataclass(frozen=True)
class ModalModel:
    """A body in reduced physical coordinates, with its modes.

    Attributes
    ----------
    mass, stiffness : (n, n); a rotor's coordinates are the tips (radial,
        tangential of blade 0, 1, ...), the centre x_o, y_o if free, then q_CB;
        a ring's are its nodal DoF. Both (0, 0) where a file gives modes alone
    shapes : (n, m), mass-orthonormal
    omega : (m,), rad/s, ascending
    diameter : (m,), nodal diameter of each mode; of a rotor that is not cyclic
        the one that dominates its tips, see `mistuned`
    rank : (m,), place of the mode among those of its nodal diameter, from 0
    phase : (m,), 0 or 1: the two members of a double harmonic
    centre_share : (m,), share of the strain energy in the shaft's springs; nan of a
        rotor from file whose shapes do not tell the springs, see `shaft`
    damping : modal damping ratio xi, of every mode or (m,)
    kept : fixed-interface modes really kept (pairs are never split)
    cyclic : whether all sectors are the same, so that k, rank and phase are exact
    symmetry : of a rotor from file of three blades and more: what was found
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

    @property
    def ratios(self) -> Floats:
        """Modal damping ratio of each mode, (m,)."""
        return np.broadcast_to(np.float64(self.damping), self.omega.shape)

    @property
    def has_matrices(self) -> bool:
        """Whether M and K are known, not the modes alone."""
        return len(self.mass) == len(self.shapes)

    def damping_matrix(self) -> Floats:
        """Return D = M Phi diag(2 xi omega) Phi^T M, (n, n)."""
        lift = self.mass @ self.shapes
        return (lift * (2 * self.ratios * self.omega)) @ lift.T


def has_centre(model: ModalModel, blades: int) -> bool:
    """Return whether a rotor's centre is free."""
    return len(model.shapes) > 2 * blades + model.kept


def centre_rows(model: ModalModel, blades: int) -> Floats:
    """Return modal shapes of (x_o, y_o), (2, m); zeros where it is clamped."""
    if not has_centre(model, blades):
        return np.zeros((2, len(model.omega)))
    return model.shapes[2 * blades : 2 * blades + 2]


def with_ratio(
    model: ModalModel, chosen: NDArray[np.bool_], ratio: float
) -> ModalModel:
    """Return the body with a damping ratio of their own for some modes.

    Parameters
    ----------
    model : the body
    chosen : (m,), which modes
    ratio : xi of those; negative: as they are
    """
    if ratio < 0.0 or not chosen.any():
        return model
    return replace(model, damping=np.where(chosen, ratio, model.ratios))


@dataclass(frozen=True)
class Block:
    """One nodal diameter: Hermitian reduced matrices and, where asked, their modes."""

    k: int
    simple: bool
    mass: Complexes
    stiffness: Complexes
    omega: Floats
    modes: Complexes

    @property
    def multiplicity(self) -> int:
        """How many real coordinates a complex one stands for."""
        return 1 if self.simple else 2


def _fixed_frequencies(structure: CyclicStructure) -> dict[int, Floats]:
    """Return the fixed-interface frequencies of every nodal diameter, rad/s."""
    out = {}
    inner = np.setdiff1d(np.arange(structure.sector_size), structure.boundary)
    for k in diameters(structure.sectors):
        stiffness = block(structure.stiffness, structure, k)[np.ix_(inner, inner)]
        mass = block(structure.mass, structure, k)[np.ix_(inner, inner)]
        squared = eigh(stiffness, mass, eigvals_only=True)
        out[k] = np.sqrt(np.maximum(squared, 0.0))
    return out


def share_out(structure: CyclicStructure, eta: int) -> dict[int, int]:
    """Return how many fixed-interface modes each nodal diameter keeps.

    The lowest `eta` real modes of the whole structure; a degenerate pair that
    `eta` would split is left out whole, so that the symmetry stays.
    """
    inner = structure.sector_size - len(structure.boundary)
    most = inner * structure.sectors
    if eta > most:
        msg = f"modes must be <= {most} (all fixed-interface modes), got {eta}"
        raise InputError(msg)
    listed = [
        (omega, k)
        for k, values in _fixed_frequencies(structure).items()
        for omega in values
    ]
    counts, left = dict.fromkeys(diameters(structure.sectors), 0), eta
    for _, k in sorted(listed):
        width = 1 if is_simple(k, structure.sectors) else 2
        if width > left:
            break
        counts[k] += 1
        left -= width
    return counts


def _blocks(structure: CyclicStructure, eta: int | None) -> Iterator[Block]:
    counts = {} if eta is None else share_out(structure, eta)
    for k in diameters(structure.sectors):
        simple = is_simple(k, structure.sectors)
        mass = block(structure.mass, structure, k)
        stiffness = block(structure.stiffness, structure, k)
        if eta is not None:
            hub = structure.sector_size + np.arange(centre_width(structure, k))
            boundary = np.r_[np.array(structure.boundary, dtype=np.intp), hub]
            basis, _ = craig_bampton(mass, stiffness, boundary, counts[k])
            mass = basis.conj().T @ mass @ basis
            stiffness = basis.conj().T @ stiffness @ basis
        if simple:
            squared, modes = eigh(stiffness.real, mass.real)
        else:
            squared, modes = eigh(stiffness, mass)
        omega = np.sqrt(np.maximum(squared, 0.0))
        yield Block(k, simple, mass, stiffness, omega, modes.astype(np.complex128))


def physical_columns(
    piece: Block, structure: CyclicStructure, kept: int, size: int, start: int
) -> Floats:
    """Return the (size, real DoF of the block) map to physical coordinates.

    The first `kept` coordinates of a block are sector DoF, then perhaps the
    centre, then q_CB, which stay as they are from row `start` on.
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
        place = start + part * count
        out[place : place + count, shift + first : shift + inner] = np.eye(count)
    return out


def _real_modes(piece: Block) -> list[Floats]:
    """Return the block's modes in its real coordinates (a, b), one array a phase."""
    re, im = piece.modes.real, piece.modes.imag
    if piece.simple:
        return [re]
    return [np.vstack([re, im]), np.vstack([-im, re])]


def _centre_share(piece: Block, structure: CyclicStructure, kept: int) -> Floats:
    """Return the share of each mode's strain energy in the shaft's springs, (m,)."""
    hub = piece.modes[kept : kept + centre_width(structure, piece.k)]
    energy = structure.centre_stiffness * (np.abs(hub) ** 2).sum(axis=0)
    return np.asarray(energy / np.maximum(piece.omega**2, np.finfo(float).tiny))


def _labels(piece: Block, share: Floats, phase: int) -> list[Floats]:
    """Return [omega, k, rank, phase, share] of a block's modes, each (m,)."""
    same = np.ones(len(piece.omega))
    rank = np.arange(len(piece.omega), dtype=np.float64)
    return [piece.omega, piece.k * same, rank, phase * same, share]


def assembled(
    pieces: list[tuple[Block, Floats]],
) -> tuple[Floats, Floats]:
    """Return (M, K) of all blocks in physical coordinates."""
    size = len(pieces[0][1])
    mass, stiffness = np.zeros((size, size)), np.zeros((size, size))
    for piece, columns in pieces:
        mass += columns @ real_block(piece.mass, simple=piece.simple) @ columns.T
        own = real_block(piece.stiffness, simple=piece.simple)
        stiffness += columns @ own @ columns.T
    return mass, stiffness


def modal_model(
    structure: CyclicStructure, damping: float, eta: int | None = None
) -> ModalModel:
    """Return the body's reduced matrices and modes, nodal diameter by diameter.

    Parameters
    ----------
    structure
        sectors and centre; with `eta`, each sector keeps its boundary DoF
    damping
        modal damping ratio xi, of every mode
    eta
        fixed-interface modes of the Craig-Bampton reduction (Eq. 1); None keeps
        every DoF of the structure
    """
    if structure.mistuned:
        msg = "a mistuned structure has no nodal diameters: reduce it as a whole"
        raise ModelError(msg)
    kept = structure.sector_size if eta is None else len(structure.boundary)
    blocks = list(_blocks(structure, eta))
    size = sum(len(b.mass) * b.multiplicity for b in blocks)
    physical = kept * structure.sectors + len(structure.centre)
    pieces, shapes, labels, start = [], [], [], physical
    for piece in blocks:
        columns = physical_columns(piece, structure, kept, size, start)
        pieces.append((piece, columns))
        share = _centre_share(piece, structure, kept)
        for phase, modes in enumerate(_real_modes(piece)):
            shapes.append(columns @ modes)
            labels.append(_labels(piece, share, phase))
        inner = len(piece.mass) - kept - centre_width(structure, piece.k)
        start += inner * piece.multiplicity
    omega, diameter, rank, phases, shares = map(
        np.concatenate, zip(*labels, strict=True)
    )
    order = np.lexsort((phases, rank, diameter, omega))
    mass, stiffness = assembled(pieces)
    return ModalModel(
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
    )
