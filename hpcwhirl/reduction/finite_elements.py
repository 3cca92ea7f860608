"""Reduction of finite-element matrices to a rotor: sparse Craig-Bampton (Eq. 1).

Equations are those of the paper. A whole wheel is reduced at once. A sector is reduced
per nodal diameter k with u_right = e^{i k 2 pi / N} u_left in axes that turn with the
sectors, so that each k has Hermitian matrices of one sector (Eqs. 5 and 10), and a
shared centre belongs to k = 1 only, (x, y) = sqrt(N / 2) (1, i) z_o (Eq. 11). The
reduced matrices are expanded to all sectors as in `modes`: tips stay physical, complex
amplitudes become their real and imaginary parts. So the wheel is cyclic to round-off.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg import LinAlgError, eigh

from hpcwhirl.arrays import Floats, Integers
from hpcwhirl.reduction import modes
from hpcwhirl.reduction.cyclic_coordinates import (
    centre_width,
    diameters,
    is_simple,
    spread,
)
from hpcwhirl.reduction.factors import Tell
from hpcwhirl.reduction.points import Stress
from hpcwhirl.reduction.sparse_modes import (
    PAIR,
    Condensed,
    Project,
    condensed,
    for_all_speeds,
    lowest_ritz,
    whole_pairs,
)
from hpcwhirl.reduction.spin import check_turned, stiffness_terms
from hpcwhirl.store.models.wheel_file import Cut, FiniteElements
from hpcwhirl.structure import CyclicStructure
from hpcwhirl.structure.elements import turn

MORE = 2  # modes computed of each diameter in addition to the mean number wanted
STRAINED = 1e-4  # largest strain by a translation, `_strained`; 14 digits give 1e-6
INDEFINITE = -1e-9  # lowest eigenvalue, relative to the highest, that counts as 0
ROUND_OFF = 1e-15  # largest omega^2 of a rigid mode, relative to n times the largest


@dataclass(frozen=True)
class Imported:
    """A rotor reduced from finite-element matrices, as an engine's file stores it.

    Its n coordinates are the displacements of tips (radial, tangential of blade 0, 1,
    ...; with several contact points a tip, of all points), the centre's x_o, y_o, and
    amplitudes q of fixed-interface modes.

    Attributes
    ----------
    mass, stiffness : (n, n), kg and N/m
    spin : terms of rotation, if the wheel has them
    blades : N
    centre : whether x_o, y_o exist
    kept : number of fixed-interface modes at rest
    added : number of further coordinates that make the basis serve all speeds
    highest : rad/s, highest omega of the kept modes; no mode below it is missing
    omega : (n,), rad/s, ascending, natural frequencies of the rotor
    rigid : number of frequencies that are 0, apart from round-off
    condition : worst condition number of the factored matrices, see `Condensed`
    strained : largest relative force on a tip in a rigid translation, which must be
        about 0, see `_strained`; None without a centre
    carried : mass that moves in a rigid translation, kg; None without a centre
    points : {name in an engine's file: array (n_c,)}, places of the n_c contact points
        of a tip; {} with one point
    stress : stress at named points, if the wheel has it
    """

    mass: Floats
    stiffness: Floats
    spin: modes.Spin | None
    blades: int
    centre: bool
    kept: int
    added: int
    highest: float
    omega: Floats
    rigid: int
    condition: float
    strained: float | None
    carried: float | None
    points: dict[str, Floats] = field(default_factory=dict)
    stress: Stress | None = None


@dataclass(frozen=True)
class _Reduced:
    """Reduced M, K and terms of rotation of a wheel, before its shaft is added.

    Attributes
    ----------
    mass, stiffness : (n, n), kg and N/m, tips and centre first
    spin : terms of rotation, if the wheel has them
    last : (rad/s)^2, highest omega^2 of the fixed-interface modes at rest
    condition : worst condition number of the factored matrices, see `Condensed`
    added : number of coordinates that the basis for all speeds has in addition
    stress : (N P c, n), from coordinates to c stress components at P points of N blades
    """

    mass: Floats
    stiffness: Floats
    spin: modes.Spin | None
    last: float
    condition: float
    added: int
    stress: Floats | None


class _Map:
    """Builder of the sparse matrix T of u = T v, from free DoF v to all DoF u.

    It expresses DoF that are not free: tips and centre in turned axes, the right cut of
    a sector by its left cut, and fixed DoF, which are 0.
    """

    def __init__(self) -> None:
        self.rows: list[Integers] = []
        self.columns: list[Integers] = []
        self.values: list[NDArray[Any]] = []
        self.width = 0

    def add(self, rows: Integers, columns: Integers, values: Any) -> None:
        """Set entries of T, the sparse matrix from free DoF v to all DoF u.

        rows, columns : (c,), indices of c entries: DoF of u, free DoF of v
        values : (c,), or one value for all
        """
        self.rows.append(rows)
        self.columns.append(columns)
        self.values.append(np.broadcast_to(values, rows.shape))

    def fresh(self, count: int) -> Integers:
        """Add `count` new free DoF, columns of T, and return their indices."""
        self.width += count
        return np.arange(self.width - count, self.width)

    def add_turned(self, pairs: Integers, columns: Integers, angle: Floats) -> None:
        """Set the rows of T that express m points' displacements in turned axes.

        pairs : (m, 2), the two DoF in u of each point
        columns : (m, 2), the two free DoF of each point, in turned axes
        angle : (m,), rad, by which the axes of the free DoF are turned
        """
        for j, (pair, turned) in enumerate(zip(pairs, columns, strict=True)):
            self.add(np.repeat(pair, 2), np.tile(turned, 2), turn(angle[j]).T.ravel())

    def matrix(self, size: int) -> sparse.csr_array:
        """Return the sparse matrix T of u = T v, from free DoF v to `size` DoF u."""
        sides = (self.rows, self.columns)
        places = tuple(np.concatenate(side).astype(np.int32) for side in sides)
        values = np.concatenate(self.values)
        return sparse.csr_array((values, places), shape=(size, self.width))


def imported(wheel: FiniteElements, tell: Tell) -> Imported:
    """Return the reduced rotor of finite-element matrices of a wheel or of one sector.

    Parameters
    ----------
    wheel : matrices and geometry of a wheel or a sector
    tell : called with a line for each nodal diameter of a sector and each large factor

    Raises
    ------
    InputError, ModelError
        if the matrices cannot be those of a rotor
    """
    _check_definite(wheel)
    try:
        if wheel.cut is None:
            reduced = _whole(wheel, tell)
        else:
            reduced = _of_sectors(wheel, wheel.cut, tell)
    except LinAlgError:
        raise wheel.refusal("mass must be positive definite, and is not") from None
    return _rotor(wheel, reduced)


def _check_definite(wheel: FiniteElements) -> None:
    """Raise InputError if a wheel's mass or stiffness is seen not to be positive.

    Signs of this are a diagonal entry or a Ritz value below 0.
    """
    moving = np.setdiff1d(np.arange(wheel.mass.shape[0]), wheel.held)
    for name, matrix in (("mass", wheel.mass), ("stiffness", wheel.stiffness)):
        diagonal = matrix.diagonal()[moving]
        if not diagonal.min() > 0:
            dof = moving[np.argmin(diagonal)]
            raise wheel.refusal(
                f"{name} must be positive, got {diagonal.min():.3g} at degree of "
                f"freedom {dof}"
            )
        lowest = lowest_ritz(matrix[moving][:, moving])
        if not lowest > (0.0 if name == "mass" else INDEFINITE):
            kind = "definite" if name == "mass" else "semidefinite"
            raise wheel.refusal(
                f"{name} must be positive {kind}, got an eigenvalue of at most "
                f"{lowest:.3g} if scaled to unit diagonal"
            )


def _projected(wheel: FiniteElements, lift: sparse.csr_array) -> list[Any]:
    """Return a wheel's matrices in free DoF, T^H A T: M, K and, if any, C, K_1, K_2.

    wheel, lift : finite-element matrices A; T, from free DoF to all DoF, see `_Map`
    """
    back = lift.conj().T.tocsr()
    matrices = [wheel.mass, wheel.stiffness]
    if wheel.turning:
        first, quartic = stiffness_terms(wheel.stiffness, wheel.turning)
        matrices += [wheel.turning["coriolis"], first]
        matrices += [] if quartic is None else [quartic]
    return [back @ a @ lift for a in matrices]


def _whole(wheel: FiniteElements, tell: Tell) -> _Reduced:
    """Return the reduced matrices of a wheel whose file has matrices of all sectors.

    tell : called with a line before each large factor is made
    """
    lift, size = _Map(), wheel.mass.shape[0]
    tips = lift.fresh(wheel.tips.size).reshape(-1, 2)
    lift.add_turned(wheel.tips, tips, wheel.angle)
    if wheel.centre is not None:
        hub = lift.fresh(2)[None, :]
        angle = np.array([wheel.centre.angle])
        lift.add_turned(wheel.centre.dofs[None, :], hub, angle)
    boundary = lift.width
    rest = np.setdiff1d(np.arange(size), _named(wheel))
    lift.add(rest, lift.fresh(len(rest)), 1.0)
    turned = lift.matrix(size)
    project = partial(_projected, wheel, turned)
    piece = condensed(
        project, boundary, wheel.modes, tell, keep=wheel.stress is not None
    )
    count = whole_pairs(piece.squared, piece.reach, wheel.modes)
    still = piece.lowest(count)
    piece = _finished(wheel, still, project, tell)
    last, spin = float(piece.squared.max(initial=0.0)), None
    if wheel.turning:
        coriolis, first, *second = piece.turning
        load = piece.loaded(turned.T @ wheel.turning["centrifugal_load"])
        spin = modes.Spin(coriolis, first, load, second[0] if second else None)
    return _Reduced(
        mass=piece.mass,
        stiffness=piece.stiffness,
        spin=spin,
        last=last,
        condition=piece.condition,
        added=len(piece.mass) - len(still.mass),
        stress=wheel.stress and wheel.stress[1] @ turned @ piece.lift,
    )


def _finished(
    wheel: FiniteElements, piece: Condensed, project: Project, tell: Tell
) -> Condensed:
    """Return a wheel's reduction, with its terms of rotation if it has any.

    With them, modes are added to the basis so that it serves all speeds.

    piece : reduction at rest, to the modes that are kept
    project : function that returns the wheel's sparse matrices in free DoF
    tell : called with a line before each large factor is made
    """
    if not wheel.turning:
        return piece
    return for_all_speeds(piece, project, wheel.turning.get("speeds", ()), tell)


def _named(wheel: FiniteElements) -> Integers:
    """Return the indices of a wheel's DoF that are expressed by others or fixed.

    They are the DoF of tips and centre, which are expressed in turned axes, those on a
    sector's right cut, and fixed ones.
    """
    cut, centre = wheel.cut, wheel.centre
    sides = [] if cut is None else [cut.right, cut.right_plane.ravel()]
    hub = [] if centre is None else [centre.dofs]
    return np.concatenate([wheel.tips.ravel(), wheel.held, *hub, *sides])


def _sector_map(
    wheel: FiniteElements, cut: Cut, k: int
) -> tuple[sparse.csr_array, int]:
    """Return a sector's matrix T on nodal diameter k, and its number of boundary DoF.

    T gives all DoF of the sector from its free DoF, of which tips and centre, the
    boundary, come first.

    wheel, cut : matrices of the sector; DoF on its left and right cut
    """
    lift, size = _Map(), wheel.mass.shape[0]
    tips = lift.fresh(wheel.tips.size).reshape(-1, 2)
    lift.add_turned(wheel.tips, tips, wheel.angle)
    if wheel.centre is not None and k == 1:
        axes = turn(wheel.centre.angle).T @ np.array([1.0, 1.0j])
        lift.add(
            wheel.centre.dofs, lift.fresh(1).repeat(2), np.sqrt(wheel.blades / 2) * axes
        )
    boundary = lift.width
    rest = np.setdiff1d(np.arange(size), _named(wheel))
    column_of = np.full(size, -1)
    column_of[rest] = lift.fresh(len(rest))
    lift.add(rest, column_of[rest], 1.0)
    step = 2 * np.pi / wheel.blades
    wave = np.cos(k * step) if is_simple(k, wheel.blades) else np.exp(1j * k * step)
    lift.add(cut.right, column_of[cut.left], wave)
    ahead = wave * turn(step).T  # from the next sector's axes to this one's
    for a, b in np.ndindex(2, 2):
        left = column_of[cut.left_plane[:, b]]
        lift.add(cut.right_plane[:, a], left, ahead[a, b])
    return lift.matrix(size), boundary


def _of_sectors(wheel: FiniteElements, cut: Cut, tell: Tell) -> _Reduced:
    """Return the reduced matrices of a wheel whose file has matrices of one sector.

    cut : DoF on the sector's left and right cut
    tell : called with a line for each nodal diameter and each large factor
    """
    blades = wheel.blades
    even = -(-wheel.modes // blades) + MORE
    pieces: dict[int, Condensed] = {}
    counts, last = dict.fromkeys(diameters(blades), 0), 0.0
    wanted = dict.fromkeys(diameters(blades), even)
    while wanted:
        for k, count in wanted.items():
            tell(f"nodal diameter {k} of {blades // 2}: {count} modes")
            lift, boundary = _sector_map(wheel, cut, k)
            pieces[k] = condensed(
                partial(_projected, wheel, lift), boundary, count, tell,
                keep=wheel.stress is not None,
            )  # fmt: skip
        listed = [(value, k) for k, p in pieces.items() for value in p.squared]
        counts, last = modes.lowest_of(listed, blades, wheel.modes)
        wanted = {
            k: 2 * len(piece.squared)
            for k, piece in pieces.items()
            if piece.reach <= last * (1 + PAIR)
        }
    added = 0
    for k, piece in pieces.items():
        if wheel.turning:
            tell(f"nodal diameter {k} of {blades // 2}: shapes at speed")
        project = partial(_projected, wheel, _sector_map(wheel, cut, k)[0])
        rest = piece.lowest(counts[k])
        pieces[k] = _finished(wheel, rest, project, tell)
        more = len(pieces[k].mass) - len(rest.mass)
        added += more if is_simple(k, blades) else 2 * more
    mass, stiffness, spin, stress = _spread(wheel, cut, pieces)
    condition = max(piece.condition for piece in pieces.values())
    return _Reduced(mass, stiffness, spin, last, condition, added, stress)


def _spread(
    wheel: FiniteElements, cuts: Cut, pieces: dict[int, Condensed]
) -> tuple[Floats, Floats, modes.Spin | None, Floats | None]:
    """Return (M, K, terms of rotation, stress) of all sectors from reduced blocks.

    Their coordinates are the tips of all blades, the centre, and the amplitudes of
    fixed-interface modes of all nodal diameters.

    cuts : DoF on the sector's left and right cut
    pieces : {nodal diameter: matrices of the reduced sector}
    """
    blades, none, own = wheel.blades, np.zeros((0, 0)), 2 * wheel.each
    hub = () if wheel.centre is None else (own * blades, own * blades + 1)
    structure = CyclicStructure(none, none, blades, own, tuple(range(own)), hub)
    blocks, nothing = [], np.zeros((0, 0), dtype=np.complex128)
    for k, piece in pieces.items():
        simple = is_simple(k, blades)
        mass, stiffness, *turning = (
            a + 0j for a in (piece.mass, piece.stiffness, *piece.turning)
        )
        block = modes.Block(k, simple, mass, stiffness, np.zeros(0), nothing)
        if wheel.turning:
            coriolis, first, *second = turning
            load = np.zeros(len(mass), dtype=np.complex128)
            if k == 0:
                pushed = _sector_map(wheel, cuts, 0)[0].conj().T
                whole = pushed @ wheel.turning["centrifugal_load"]
                load += np.sqrt(blades) * piece.loaded(whole)
            block = replace(
                block,
                coriolis=coriolis,
                stiffening=first,
                load=load,
                quartic=second[0] if second else None,
            )
        blocks.append(block)
    whole = sum(len(block.mass) * block.multiplicity for block in blocks)
    pairs, start = [], own * blades + len(hub)
    for block in blocks:
        pairs.append(
            (block, modes.physical_columns(block, structure, own, whole, start))
        )
        inner = len(block.mass) - own - centre_width(structure, block.k)
        start += inner * block.multiplicity
    stress = None
    if wheel.stress is not None:
        each = [_spread_stress(wheel, cuts, pieces[one[0].k], one) for one in pairs]
        stress = np.sum(each, axis=0)
    return *modes.assembled(pairs), modes.assembled_spin(pairs), stress


def _spread_stress(
    wheel: FiniteElements, cuts: Cut, piece: Condensed, pair: tuple[modes.Block, Floats]
) -> Floats:
    """Return the part of all blades' stress that comes from nodal diameter k, (N r, n).

    It is a matrix from n coordinates of the wheel to r stress values of each of N
    blades. A wave moves blade j by Re(w_j y), w_j = sqrt(2 / N) e^{2 pi i k j / N} of a
    pair, with y = y_0 + i y_1 in the block's real coordinates.

    piece : reduced sector on diameter k
    pair : its block, and the matrix from the block's real coordinates to the n ones
    """
    if wheel.stress is None:
        raise TypeError(wheel)
    block, columns = pair
    own = wheel.stress[1] @ _sector_map(wheel, cuts, block.k)[0] @ piece.lift
    waves = spread(block.k, wheel.blades)
    turned = np.multiply.outer(waves @ [1.0, -1j][: block.multiplicity], own)
    parts = (turned.real, -turned.imag)[: block.multiplicity]
    rows = np.concatenate(parts, axis=-1).reshape(-1, columns.shape[1])
    return np.asarray(rows @ columns.T)


def _rotor(wheel: FiniteElements, reduced: _Reduced) -> Imported:
    """Return the rotor of a reduced wheel: with the shaft's mass and springs, checked.

    Raises
    ------
    InputError
        if matrices are indefinite or a rigid translation strains the wheel
    """
    places, centre = wheel.places, wheel.centre
    parts = reduced.mass, reduced.stiffness
    mass, stiffness = (np.array((a + a.T) / 2) for a in parts)
    strained, carried, spin = None, None, reduced.spin
    if centre is not None:
        hub = 2 * len(places) + np.arange(2)
        mass[hub, hub] += centre.mass
        spin = spin and _with_shaft(spin, centre.mass, hub)
        moved = _translation(len(mass), places)
        carried = float(moved[:, 0] @ mass @ moved[:, 0])
        strained = _strained(stiffness, places)
        if not centre.held and not strained <= STRAINED:
            raise wheel.refusal(_FRAMES.format(strained, STRAINED))
        if spin and not centre.held:
            speeds = wheel.turning.get("speeds")
            check_turned(spin, mass, moved, speeds, wheel.wrong)
        stiffness[hub, hub] += centre.stiffness
    squared = _eigenvalues(wheel, mass, stiffness)
    rigid = squared <= ROUND_OFF * len(squared) * squared[-1]
    return Imported(
        mass=mass,
        stiffness=stiffness,
        spin=spin,
        blades=wheel.blades,
        centre=centre is not None,
        kept=len(mass) - 2 * len(places) - (2 if centre else 0) - reduced.added,
        added=reduced.added,
        highest=float(np.sqrt(reduced.last)),
        omega=np.sqrt(np.maximum(squared, 0.0)),
        rigid=int(np.count_nonzero(rigid)),
        condition=reduced.condition,
        strained=strained,
        carried=carried,
        points=wheel.points,
        stress=_stress(wheel, reduced),
    )


def _stress(wheel: FiniteElements, reduced: _Reduced) -> Stress | None:
    """Return the stress at named points of all blades; None if the wheel has none.

    It is a linear function of the reduced coordinates.
    """
    if wheel.stress is None or reduced.stress is None:
        return None
    names, size = wheel.stress[0], len(reduced.mass)
    rows = reduced.stress.reshape(wheel.blades, len(names), -1, size)
    return Stress(names, np.ascontiguousarray(rows))


def _with_shaft(spin: modes.Spin, mass: float, hub: Integers) -> modes.Spin:
    """Return a rotor's terms of rotation plus those of the shaft's mass at the centre.

    mass, hub : kg, of the shaft; (2,), indices of the centre's coordinates
    """
    coriolis, first = spin.coriolis.copy(), spin.stiffening.copy()
    coriolis[np.ix_(hub, hub)] += mass * np.array([[0.0, -1.0], [1.0, 0.0]])
    first[hub, hub] -= mass
    return replace(spin, coriolis=coriolis, stiffening=first)


_FRAMES = (
    "a translation of tips and centre must strain the shaft's springs alone, but "
    "strains the wheel by {:.2g} of its stiffness (at most {:g}): look at blades, "
    "indices (from 0), their order (anticlockwise), angles (rad) and cuts; or say "
    "[centre] held = true if something else holds the wheel"
)


def _eigenvalues(wheel: FiniteElements, mass: Floats, stiffness: Floats) -> Floats:
    """Return omega^2 of all n modes of a reduced rotor, (n,), (rad/s)^2.

    Raise InputError for a mass matrix that is not positive definite, or a stiffness
    that is not positive semidefinite.

    wheel : the file's wheel, named in messages
    mass, stiffness : (n, n), of the reduced rotor
    """
    lowest, highest = np.linalg.eigvalsh(mass)[[0, -1]]
    if not lowest > len(mass) * np.finfo(float).eps * highest:
        value = f"eigenvalue {lowest:.2g} of the reduced one"
        raise wheel.refusal(f"mass must be positive definite, got {value}")
    squared = eigh(stiffness, mass, eigvals_only=True)
    if not squared[0] >= INDEFINITE * squared[-1]:
        value = f"omega^2 = {squared[0]:.3g} rad^2/s^2"
        raise wheel.refusal(f"stiffness must be positive semidefinite, got {value}")
    return np.asarray(squared)


def _translation(size: int, angle: Floats) -> Floats:
    """Return a rotor's coordinates in unit translations along x and y, (size, 2).

    Tips (radial, tangential of each) come first, then the centre; those of modes are 0.

    size, angle : number of coordinates; (t,), rad, of t tips or contact points
    """
    out, count = np.zeros((size, 2)), 2 * len(angle)
    out[0:count:2] = np.column_stack([np.cos(angle), np.sin(angle)])
    out[1:count:2] = np.column_stack([-np.sin(angle), np.cos(angle)])
    out[count : count + 2] = np.eye(2)
    return out


def _strained(stiffness: Floats, angle: Floats) -> float:
    """Return how much a rigid translation strains a wheel: 0 if it moves freely.

    It is the largest force on a DoF of the tips, divided by the sum of |stiffness| in
    its row. Wrong angles or orders of blades make it large.

    stiffness, angle : (n, n), N/m, tips first; (t,), rad, of t tips or contact points
    """
    tips = stiffness[: 2 * len(angle)]
    force = np.abs(tips @ _translation(len(stiffness), angle)).max(axis=1)
    return float((force / np.abs(tips).sum(axis=1)).max())
