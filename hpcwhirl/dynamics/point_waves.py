"""Arrays of `kernels.points`: rotor and casing as waves of the rotating frame.

A pair of modes of the casing, q_c and q_s of harmonic h, is Y = q_c - i q_s = a +
conj(b) in the rotating frame, with a' = z e^{i h Omega dt} a, b' = z e^{-i h Omega dt}
b; z is that of `mode_waves`. From these, the waves of each mode alone are a + b and
i (a - b), which give its displacement and its increments, those of the material.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.dynamics.certificate import LESS
from hpcwhirl.dynamics.kernels.circulant import folded
from hpcwhirl.dynamics.kernels.contact import LOOK_EVERY
from hpcwhirl.dynamics.kernels.cyclic import widths
from hpcwhirl.dynamics.kernels.kernel_types import (
    Arrays,
    Load,
    PointsContact,
    PointsRotor,
)
from hpcwhirl.dynamics.kernels.vectors import all_aligned
from hpcwhirl.dynamics.kernels.whole import EIGHT
from hpcwhirl.dynamics.mode_waves import ModeWaves, mode_waves
from hpcwhirl.dynamics.operators import friction_with_sign, pulse_load
from hpcwhirl.dynamics.slots import ring_pairs
from hpcwhirl.dynamics.walls import wall_of
from hpcwhirl.dynamics.whole_waves import WholeWaves, padded_blades, whole_waves
from hpcwhirl.reduction.bodies import centre_rows, contact_rows
from hpcwhirl.reduction.model import Model
from hpcwhirl.scene import Scene
from hpcwhirl.structure import FourierOperator

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Complexes = NDArray[np.complex128]


@dataclass(frozen=True)
class BodyWaves:
    """A body's m modes at rest as w waves of the rotating frame.

    Attributes
    ----------
    step : dt, s
    ahead : (w,), z - 1 of the rotating frame
    shapes, rises, moves : (m, w), displacements of the modes, their d and d' + d after
        a step without forces, of unit amplitudes
    gives : (w, m), change of the amplitudes by unit modal forces
    give : (m, m), change of the displacements by them
    form : (2 w, 2 w), J, energy of re and im of the amplitudes
    """

    step: float
    ahead: Complexes
    shapes: Complexes
    rises: Complexes
    moves: Complexes
    gives: Complexes
    give: Floats
    form: Floats

    @cached_property
    def rates(self) -> Complexes:
        """Velocities of the modes, (m, w), of unit amplitudes, of a free motion."""
        static = self.moves - self.rises  # d of a step earlier: rises / z
        with np.errstate(divide="ignore", invalid="ignore"):
            z = np.where(static != 0.0, self.rises / static, 0.0)
        return np.asarray(self.rises * (1 + z) / (2 * self.step))

    def real(self, rows: Complexes) -> Floats:
        """Return the rows (r, 2 w) of re and im with Re(rows a); rows : (r, w)."""
        return np.hstack([rows.real, -rows.imag])

    def write(self, q: Floats, rate: Floats) -> Floats:
        """Return re and im of amplitudes, (2 w,), with these displacements and rates.

        Of waves without a conjugate the imaginary part is 0.
        """
        rates = self.real(self.rates)
        scale = float(np.abs(rates).max())
        basis = np.vstack([self.real(self.shapes), rates / scale])
        given = np.concatenate([q, rate / scale])
        return np.asarray(np.linalg.lstsq(basis, given, rcond=None)[0])


def _energy(rises: Floats, places: Floats, omega: Floats, step: float) -> Floats:
    """Return the form of the energy of modes, J, from rows (m, 2 w) of d and x."""
    twice = rises.T @ rises / step**2
    twice += places.T @ (omega[:, None] ** 2 * (places - rises))
    return np.asarray((twice + twice.T) / 4)


def _of_modes(waves: ModeWaves, mixed: Complexes, turns: Floats) -> BodyWaves:
    """Return the waves of modes; mixed : (m, w), waves of each mode from amplitudes.

    Its columns are orthogonal.

    turns : (w,), rad, by which a step turns the amplitudes beyond z
    """
    unmixed = mixed.conj().T / (np.abs(mixed) ** 2).sum(axis=0)[:, None]
    which = np.argmax(np.abs(mixed), axis=0)
    z = 1 + waves.ahead[which]
    spin = np.expm1(1j * turns)
    parts = [row[:, None] * mixed for row in (waves.rise, waves.moves)]

    def real(rows: Complexes) -> Floats:
        return np.hstack([rows.real, -rows.imag])

    return BodyWaves(
        step=waves.step,
        ahead=np.asarray(z * spin + waves.ahead[which]),
        shapes=mixed,
        rises=parts[0],
        moves=parts[1],
        gives=np.asarray(unmixed * waves.gives),
        give=np.diag(waves.give),
        form=_energy(real(parts[0]), real(mixed), waves.omega, waves.step),
    )


def _of_whole(waves: WholeWaves) -> BodyWaves:
    """Return the waves of a rotor with terms of rotation."""
    size, width = len(waves.give), len(waves.ahead)
    places = np.append(np.arange(width), width + np.flatnonzero(waves.paired))
    form, gives = np.zeros((2 * width, 2 * width)), np.zeros((2 * width, size))
    form[np.ix_(places, places)] = waves.form
    gives[places] = waves.amplitudes(waves.give, waves.give)
    return BodyWaves(
        step=waves.step,
        ahead=waves.ahead,
        shapes=waves.shapes,
        rises=waves.rises,
        moves=np.asarray(waves.rises * (1 + 1 / (1 + waves.ahead))),
        gives=gives[:width] + 1j * gives[width:],
        give=waves.give,
        form=form,
    )


def rotor_waves(model: Model, scene: Scene) -> BodyWaves | None:
    """Return the rotor's waves; None where two of them nearly coincide."""
    if model.rotor.spin is None:
        own = mode_waves(model.rotor, scene.solver.time_step)
        size = len(own.omega)
        if not own.is_basis:
            return None
        return _of_modes(own, np.eye(size, dtype=complex), np.zeros(size))
    waves, mu = whole_waves(model, scene), friction_with_sign(scene)
    radial, along = contact_rows(model.rotor, model.blades)
    if not (waves.is_basis and waves.books(-radial - mu * along)):
        return None
    return _of_whole(waves)


def casing_waves(model: Model, scene: Scene) -> BodyWaves | None:
    """Return the waves of a casing of harmonics; None where two nearly coincide."""
    if model.casing is None:
        none, empty = np.zeros((0, 0)), np.zeros((0, 0), dtype=complex)
        return BodyWaves(1.0, empty[:, :1].ravel(), *(empty,) * 4, none, none)
    own = mode_waves(model.casing, scene.solver.time_step)
    if not own.is_basis:
        return None
    size = len(own.omega)
    mixed, turns = np.eye(size, dtype=complex), np.zeros(size)
    for harmonic, (one, *other) in ring_pairs(model):
        if other:
            pair = [one, other[0]]
            mixed[np.ix_(pair, pair)] = [[1.0, 1.0], [1j, -1j]]
            spin = harmonic * scene.speed * scene.solver.time_step
            turns[pair] = spin, -spin
    return _of_modes(own, mixed, turns)


@dataclass(frozen=True)
class PointWaves:
    """Both bodies' waves, and their places among the kernel's amplitudes.

    rotor, casing : their waves
    """

    rotor: BodyWaves
    casing: BodyWaves

    @property
    def half(self) -> int:
        """Number of the kernel's complex amplitudes, padded."""
        return -(-(len(self.rotor.ahead) + len(self.casing.ahead)) // EIGHT) * EIGHT

    def places(self) -> tuple[Integers, Integers]:
        """Return the indices of re and im of each body's waves, (2 w,) each."""
        b, c = len(self.rotor.ahead), len(self.casing.ahead)
        own, beside = np.arange(b), b + np.arange(c)
        return (
            np.concatenate([own, self.half + own]),
            np.concatenate([beside, self.half + beside]),
        )

    def spread(self, rotor: Floats, casing: Floats) -> Floats:
        """Return rows (r, 2 half) of those of re and im of each body, (r, 2 w)."""
        out = np.zeros((len(rotor), 2 * self.half))
        for place, rows in zip(self.places(), (rotor, casing), strict=True):
            out[:, place] = rows
        return out


def point_waves(model: Model, scene: Scene) -> PointWaves | None:
    """Return the waves of both bodies; None where they are no basis of the motion."""
    rotor, casing = rotor_waves(model, scene), casing_waves(model, scene)
    return None if rotor is None or casing is None else PointWaves(rotor, casing)


def _rows_of_casing(model: Model, angle: float) -> tuple[Floats, Floats]:
    """Return w and u at all points from the casing's modes, (P, m) each.

    angle : rad, of blade 0
    """
    if model.casing is None or not isinstance(model.ring, FourierOperator):
        none = np.zeros((model.contacts, 0))
        return none, none
    rows = model.ring.rows(angle + model.angles, model.stations)
    w, u = (row @ model.casing.shapes for row in rows)
    return w, u


def _pulse_rows(model: Model, scene: Scene) -> Floats:
    """Return the pulse's load on cos and sin of its harmonic by modes, (2, m)."""
    if model.casing is None:
        return np.zeros((2, 0))
    rows = np.zeros((2, len(model.casing.omega)))
    rows[0] = pulse_load(model, scene) @ model.casing.shapes
    for _, (one, *other) in ring_pairs(model):
        if other:
            rows[1, other[0]] = rows[0, one]
    return rows


@dataclass(frozen=True)
class _Reads:
    """What points read of modes of rotor and casing, and the forces on these modes.

    Attributes
    ----------
    waves : of both bodies
    rotor, casing : (P, m) each, gaps
    forces : of both bodies, (m, P + 2), of unit multipliers with friction and of the
        pulse's cos and sin
    """

    waves: PointWaves
    rotor: Floats
    casing: Floats
    forces: tuple[Floats, Floats]

    def read(self, rotor: Floats, casing: Floats) -> Floats:
        """Return the rows of displacements from amplitudes; both (r, m), of modes."""
        b, c = self.waves.rotor, self.waves.casing
        return self.waves.spread(b.real(rotor @ b.shapes), c.real(casing @ c.shapes))

    def change(self, rotor: Floats, casing: Floats) -> Floats:
        """Return what unit forces change of displacements, (r, P + 2)."""
        b, c = self.waves.rotor, self.waves.casing
        return np.asarray(
            rotor @ b.give @ self.forces[0] + casing @ c.give @ self.forces[1]
        )

    def moved(self, rotor: Floats, casing: Floats) -> Floats:
        """Return the rows of d' + d from amplitudes before any force, and forces."""
        b, c = self.waves.rotor, self.waves.casing
        rows = self.waves.spread(b.real(rotor @ b.moves), c.real(casing @ c.moves))
        numbers, points = self.change(rotor, casing), len(self.rotor)
        extra = padded_blades(points + 2) - points - 2
        return np.hstack([rows, np.pad(numbers, ((0, 0), (0, extra)))])

    def before(self, past: Floats) -> Floats:
        """Return the rows of gaps two steps before; past : (P, m), of the casing."""
        b, c = self.waves.rotor, self.waves.casing
        return self.waves.spread(
            b.real(self.rotor @ (b.shapes - b.moves)),
            c.real(past @ (c.shapes - c.moves)),
        )

    def push(self) -> Floats:
        """Return what unit forces change of the amplitudes, (P + 2, 2 half)."""
        bodies = self.waves.rotor, self.waves.casing
        given = (b.gives @ f for b, f in zip(bodies, self.forces, strict=True))
        own, beside = (np.vstack([a.real, a.imag]).T for a in given)
        return self.waves.spread(own, beside)

    def ahead(self) -> tuple[Floats, Floats]:
        """Return z - 1, re then im, and the bound of a step's motion of any gap."""
        b, c = self.waves.rotor, self.waves.casing
        ahead, most = (np.zeros(self.waves.half, dtype=t) for t in (complex, float))
        own = np.append(b.ahead, c.ahead)
        ahead[: len(own)] = own
        rows = self.rotor @ b.shapes, self.casing @ c.shapes
        most[: len(own)] = np.abs(np.hstack(rows)).max(axis=0)
        growth = np.maximum(np.abs(1 + ahead), 1.0) ** LOOK_EVERY
        return np.append(ahead.real, ahead.imag), most * np.abs(ahead) * growth / LESS


def point_arrays(model: Model, scene: Scene, waves: PointWaves) -> Arrays:
    """Return the arrays of `kernels.points.march_points`."""
    mu, hub = friction_with_sign(scene), centre_rows(model.rotor, model.blades)
    out, side = (-rows for rows in contact_rows(model.rotor, model.blades))
    w, u = _rows_of_casing(model, 0.0)
    past, _ = _rows_of_casing(model, -2.0 * scene.speed * scene.solver.time_step)
    kick, still = _pulse_rows(model, scene), np.zeros_like(w)
    none = np.zeros((2, out.shape[1]))
    forces = np.vstack([out + mu * side, none]).T, np.vstack([w + mu * u, kick]).T
    own = _Reads(waves, out, w, forces)
    opens = own.moved(np.vstack([out, none]), np.vstack([w, kick]))
    reach, shapes = np.zeros(waves.half), waves.rotor.shapes
    farthest = (np.abs(rows @ shapes).max(axis=0) for rows in (out, side))
    reach[: shapes.shape[1]] = np.hypot(*farthest)
    flat = (
        *own.ahead(), own.read(out, w), own.before(past), own.push(), opens,
        own.moved(side, u), own.read(-out, still), own.read(-side, still),
        own.read(hub, still[:2]), reach,
    )  # fmt: skip
    rows = all_aligned([np.ravel(array) for array in flat])
    rotor = PointsRotor._make([*rows, *_entries(waves), *_casing_entries(waves)])
    w_of_both = np.ascontiguousarray(own.change(out, w)[:, : model.contacts])
    loading = Load(scene.force, scene.pulse, kick[0])
    return Arrays(loading, rotor, (), _contact(model, scene, w_of_both))


def _contact(model: Model, scene: Scene, compliance: Floats) -> PointsContact:
    chosen = folded(model.contacts, widths(model.contacts)[1])
    orders = wall_of(model, scene).orders
    phases = np.multiply.outer(orders, model.angles[chosen])
    waves = np.stack([np.cos(phases), np.sin(phases)], axis=1)
    return PointsContact(
        compliance, *all_aligned([model.clearances(0.0)[chosen], waves.ravel()])
    )


def _entries(waves: PointWaves) -> tuple[Integers, Floats, int]:
    """Return the entries of the energy that are not 0, those of the rotor first."""
    pairs, values, count = [], [], []
    for place, body in zip(waves.places(), (waves.rotor, waves.casing), strict=True):
        upper = np.triu(body.form) + np.triu(body.form, 1)
        rows, columns = np.nonzero(upper)
        pairs.append(np.column_stack([place[rows], place[columns]]))
        values.append(upper[rows, columns])
        count.append(len(rows))
    return np.vstack(pairs).astype(np.int64), np.concatenate(values), count[0]


def _casing_entries(waves: PointWaves) -> tuple[Integers, Floats]:
    """Return the two amplitudes of which each mode of the casing is the sum."""
    rows, place = waves.casing.real(waves.casing.shapes), waves.places()[1]
    index, shares = np.zeros((len(rows), 2), np.int64), np.zeros((len(rows), 2))
    for m, row in enumerate(rows):
        there = np.flatnonzero(row)
        index[m, : len(there)], shares[m, : len(there)] = place[there], row[there]
    return index, shares
