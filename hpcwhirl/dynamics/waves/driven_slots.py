"""Waves of equal sectors at a changing speed, for the loop `points`.

In an interval of the speed (`case.speed`) the equation of a nodal diameter

x'' + (D + 2 Omega C) x' + (K(Omega) + S + dOmega/dt C) x = f + f_0

has constant coefficients: its waves are those of `turning_waves`, with a further skew
matrix in S. From one interval to the next the waves differ, the motion is continuous:
displacements and increments of the modes give the amplitudes of the new waves.

x is the sum of y, which contact causes, and r, which the forces f_0 of unbalance, Euler
and weight drive (`bodies.varying`). Both have waves of the same shapes: those of y are
integrated as at a constant speed; those of r, on the few nodal diameters that f_0
moves, are a term of the loop, `kernels.loop.wave_types.SlotDrive`.

Waves are computed for all nodal diameters with the same number of modes at once, and
kept with all coefficients that follow from them: the next run of the same rotor through
the same speeds, as of another gap, only copies these.
"""

from __future__ import annotations

import math
from collections import OrderedDict
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from hpcwhirl.arrays import Complexes, Floats, Integers
from hpcwhirl.dynamics.bodies.operators import friction_with_sign
from hpcwhirl.dynamics.bodies.turning import (
    ALIKE,
    drawn_loads,
    driven_standing,
    included_in,
    set_standing,
    unlike_rows,
)
from hpcwhirl.dynamics.bodies.varying import loads_of
from hpcwhirl.dynamics.kernels.loop.wave_types import SlotDrive, SlotHeld, SlotRows
from hpcwhirl.dynamics.kernels.vectors import FOUR
from hpcwhirl.dynamics.waves.slot_waves import (
    FIXED,
    FREE,
    PART,
    PUSHED,
    SlotPlaces,
    SlotWaves,
)
from hpcwhirl.dynamics.waves.slots import blade_waves
from hpcwhirl.dynamics.waves.turning_waves import (
    Diameter,
    Differences,
    modal_places,
    modes_of,
)
from hpcwhirl.reduction.model import Model
from hpcwhirl.reduction.modes import SpinBlock
from hpcwhirl.reduction.supports import Station, apart_of
from hpcwhirl.reduction.waves import modal_damping
from hpcwhirl.scene import Scene

NONE, NOWHERE = np.zeros(0), np.zeros(0, np.int64)
EMPTY: Complexes = np.zeros((0, 0), complex)
NO_HOLD = SlotHeld(
    NOWHERE, NOWHERE, EMPTY, EMPTY, np.zeros((0, 3), complex), EMPTY,
    np.zeros(0, complex), NONE, EMPTY, EMPTY, 0, ALIKE,
)  # fmt: skip
NO_DRIVE = SlotDrive(
    np.zeros((0, 2), np.int64), 0, *(NOWHERE,) * 3, NONE, NONE, np.zeros((0, 2)),
    np.zeros((2, 0, 2)), *(NONE,) * 4, np.zeros((2, 0), complex), NO_HOLD,
)  # fmt: skip
TOO_NEAR = 1e9  # condition number of waves beyond which the speed is shifted
SHIFTS = 0.0, 1e-7, -1e-7, 1e-6, -1e-6, 1e-5, -1e-5  # of the speed, relative


class Pace(NamedTuple):
    """Omega, rad/s, and dOmega/dt, rad/s^2, of an interval."""

    speed: float
    rate: float


class _Alike(NamedTuple):
    """The b nodal diameters with m modes each: terms of rotation, places of waves.

    Attributes
    ----------
    number, k : (b,), numbers of the diameters among all, and the diameters
    rest, first, quartic, coriolis, damping : (b, m, m), see `SpinBlock`
    held : (q, b, m), displacement of each of q supports, that of the centre first
    moved : (q, b, m, m), products of these
    radial, along : (b, m), as in `turning_waves.Differences`
    wave : (b, w), index of re of each wave's amplitude in the state
    free, pushed, beside : (b, w), indices in `free`, `pushed`, `along` of `SlotRows`
    fixed : (b,), index in `SlotRows.fixed`
    pairs : (4, p), nodal diameter b and waves f <= g of each product of two waves in an
        energy, and its index in `SlotRows.energy`
    """

    number: Integers
    k: Integers
    rest: Complexes
    first: Complexes
    quartic: Complexes
    coriolis: Complexes
    damping: Complexes
    held: Complexes
    moved: Complexes
    radial: Complexes
    along: Complexes
    wave: Integers
    free: Integers
    pushed: Integers
    beside: Integers
    fixed: Integers
    pairs: Integers


@dataclass(frozen=True)
class _Waves:
    """The waves of nodal diameters with the same number of modes, as `Differences`.

    Arrays have the shapes of those of `Differences` after one axis for the diameters.
    """

    ahead: Complexes
    shapes: Complexes
    rises: Complexes
    energy: Complexes
    rate: Complexes
    push: Complexes
    rates: Complexes
    give: Complexes
    inverse: Complexes
    condition: float

    def turned(self, old: _Waves, a: Complexes, which: Any = slice(None)) -> Complexes:
        """Return amplitudes (b, w) of a motion given by those of old waves.

        which : the diameters that have it; an index: the one, with amplitudes (w,)
        """
        parts = (old.shapes[which], old.rises[which])
        both = np.concatenate([part @ a[..., None] for part in parts], axis=-2)
        return np.asarray((self.inverse[which] @ both)[..., 0])


ARRAYS = [one.name for one in fields(_Waves)][:-1]


def _back(matrix: Complexes) -> Complexes:
    return np.asarray(matrix.conj().swapaxes(-2, -1))


class _Prepared(NamedTuple):
    """What follows from the speed and its rate, for all runs of a rotor.

    Attributes
    ----------
    waves : as in `DrivenSlots`
    rows : values of the rotor's coefficients in `SlotRows`, by names of its tables
    opens : (k,), m/N, the rotor's part of the opening by a unit spectrum
    drive : the kernel's arrays of the motion r
    hub : result of `DrivenSlots.hub`
    moved : (2 s, m), increments of the modes by unit forces on the supports
    """

    waves: list[_Waves]
    rows: dict[str, Floats]
    opens: Complexes
    drive: SlotDrive
    hub: tuple[Integers, Complexes]
    moved: Floats

    @property
    def size(self) -> int:
        """Bytes of all arrays."""
        waves = [getattr(one, name) for one in self.waves for name in ARRAYS]
        few = self.opens, *self.hub, self.moved
        each = *waves, *self.rows.values(), *few, *self.drive, *self.drive.held
        return sum(int(getattr(array, "nbytes", 0)) for array in each)


MOST_BYTES = 2**25  # of all that is kept
_kept: OrderedDict[Any, _Prepared] = OrderedDict()
_sizes: dict[Any, int] = {}  # bytes of what is kept, by the same keys


def _keep(key: Any, made: _Prepared) -> None:
    """Keep coefficients; forget those not used for longest beyond `MOST_BYTES`."""
    _kept[key], _sizes[key] = made, made.size
    room = MOST_BYTES - sum(_sizes.values())
    while room < 0:
        room += _sizes.pop(_kept.popitem(last=False)[0])


class _Terms(NamedTuple):
    """Matrices (b, m, m): D, D + 2 Omega C, K(Omega), S + dOmega/dt C."""

    damping: Complexes
    loss: Complexes
    stiffness: Complexes
    push: Complexes


def _terms(own: _Alike, supports: Any, pace: Pace) -> _Terms:
    """Return the matrices of nodal diameters, as `reduction.waves.diameter_matrices`.

    supports : of the centre, then of the shaft elsewhere
    """
    speed, rate = pace
    gyro, damping, push = 2 * speed * own.coriolis, own.damping, rate * own.coriolis
    stiffness = own.rest + speed**2 * own.first + speed**4 * own.quartic
    for support, moved in zip(supports, own.moved, strict=True):
        here = support.at(speed)
        held = here.turning(speed)
        damping = damping + here.damping.real * moved
        gyro = gyro - 1j * here.damping.imag * moved
        stiffness = stiffness + held.real * moved
        push = push - 1j * held.imag * moved
    return _Terms(damping, damping + gyro, stiffness, push)


def _roots(own: _Alike, terms: _Terms, step: float) -> tuple[Complexes, Complexes]:
    """Return roots s (b, w), and shapes (b, m, w) that open the gap by real numbers."""
    whole, size = terms.stiffness + terms.push, own.rest.shape[-1]
    same = np.eye(size)
    both = np.concatenate([whole, terms.loss], axis=2)
    companion = np.zeros((len(both), 2 * size, 2 * size), dtype=complex)
    companion[:, :size, size:] = same
    companion[:, size:] = -np.linalg.solve(same - step**2 / 4 * whole, both)
    roots, vectors = np.linalg.eig(companion)
    shapes = vectors[:, :size]
    opened = (own.radial[:, None] @ shapes)[:, 0]
    far = np.abs(opened)
    turn = np.where(far > 0.0, opened.conj() / np.where(far, far, 1.0), 1.0)
    return roots, shapes * (turn / np.linalg.norm(shapes, axis=1))[:, None]


def _waves(own: _Alike, terms: _Terms, step: float) -> _Waves:
    """Return the waves of nodal diameters by central differences."""
    roots, shapes = _roots(own, terms, step)
    size = shapes.shape[1]
    ahead = roots * step / (1 - roots * step / 2)
    rises = shapes * (ahead / (1 + ahead))[:, None]
    before = shapes / (1 + ahead)[:, None]
    energy = _back(rises) @ rises / step**2 + _back(shapes) @ terms.stiffness @ before
    same: Any = np.eye(size)
    give = np.linalg.solve(same / step**2 + terms.loss / (2 * step), same)
    scale = np.abs(rises).max(axis=(1, 2))[:, None, None]
    basis = np.concatenate([shapes, rises / scale], axis=1)
    inverse: Any = np.linalg.solve(basis, np.eye(2 * size))
    sizes = (np.linalg.norm(part, axis=(1, 2)) for part in (basis, inverse))
    condition = float((next(sizes) * next(sizes)).max())
    inverse[:, :, size:] /= scale
    return _Waves(
        ahead, shapes, rises, (energy + _back(energy)) / 4, terms.damping, terms.push,
        rises * (2 + ahead)[:, None] / (2 * step), np.asarray(give), inverse, condition,
    )  # fmt: skip


class DrivenSlots:
    """A rotor of equal sectors at a changing speed: its waves in any interval.

    rows : the kernel's coefficients, of which `turn` changes those of the rotor
    ring : waves of the casing

    Attributes
    ----------
    pace : of the interval whose waves these are
    waves : of the nodal diameters with the same number of modes, in turn
    now : what follows from the pace
    tables : indices of the rotor's coefficients in tables of `SlotRows`, by their names
    stand, held : the supports' arrays, which are those of the pace; (2 s, m), x, y of
        the supports for unit amplitudes of the modes
    weight : (2, m), of the weight and of F_0 of bearings at the pace, see `Loads`
    """

    def __init__(
        self,
        model: Model,
        scene: Scene,
        at: SlotPlaces,
        rows: SlotRows,
        ring: SlotWaves,
    ) -> None:
        self.model, self.scene, self.at, self.rows = model, scene, at, rows
        self.mu, self.step = friction_with_sign(scene), scene.solver.time_step
        self.loads, spin = loads_of(model, scene), model.rotor.terms
        self.weight = self.loads.weight
        self.supports = spin.support, *(one.support for one in spin.stations)
        pieces, moves = spin.waves, self.loads.moves().astype(float)
        sizes = np.array([len(piece.omega) for piece in pieces])
        self.alike = [
            self._alike(np.flatnonzero(sizes == size)) for size in np.unique(sizes)
        ]
        self.moved = [
            n for n, p in enumerate(pieces) if modes_of(model, p.k, moves).any()
        ]
        self.first = at.rows * PART
        self.waves, self.pushes = list[_Waves](), list[Any]()
        self.summed = list[Complexes]()
        self.tables = _tables_of(self.alike)
        self.key = (
            model.rotor, model.blades, at.rotor.tobytes(), at.ring.tobytes(), self.step,
            self.mu, scene.unbalance, scene.unbalance_phase, scene.gravity,
            scene.gravity_angle,
        )  # fmt: skip
        hub = unlike_rows(model, model.rotor.shapes)
        self.stand, self.held = driven_standing(model, hub, self.step), hub
        self.ring = ring.opens, ring.slides
        self.turn(Pace(scene.speed, 0.0))

    def _alike(self, chosen: Integers) -> _Alike:
        spin, rotor = self.model.rotor.terms, self.model.rotor
        pieces = [spin.waves[n] for n in chosen]
        size = len(pieces[0].omega)
        none = np.zeros((size, size), dtype=complex)
        scale = np.array([(2.0 - p.simple) / self.model.blades for p in pieces])
        tips = -np.sqrt(scale)[:, None, None] * np.array([p.tips for p in pieces])
        rows = [[p.hub, *_stations(p, len(spin.stations))] for p in pieces]
        held = np.array(rows, dtype=complex).swapaxes(0, 1)
        quartic = [none if p.quartic is None else p.quartic for p in pieces]
        k = np.array([p.k for p in pieces])
        return _Alike(
            chosen, k,
            np.array([np.diag(p.omega**2) + none for p in pieces]),
            np.array([p.stiffening + none for p in pieces]), np.array(quartic),
            np.array([p.coriolis for p in pieces]),
            np.array([modal_damping(rotor, p) + none for p in pieces]),
            held, held.conj()[..., None] * held[..., None, :], tips[:, 0], tips[:, 1],
            *self._laid(k, np.arange(2 * size)),
        )  # fmt: skip

    def _laid(self, k: Integers, waves: Integers) -> tuple[Integers, ...]:
        """Return where waves lie in state and coefficients, see `_Alike.wave` on."""
        at, (few, many) = self.at, PUSHED
        group, lane = k // FOUR, (k % FOUR)[:, None]
        wave = at.rotor_at(waves, k[:, None])
        items = at.rotor * few + at.ring * many
        begun, own = (np.cumsum(part) - part for part in (items, at.rotor))
        return (
            wave, wave // PART * FREE * FOUR + lane,
            (begun[group][:, None] + waves * few) * FOUR + lane,
            (own[group][:, None] + waves) * PART + lane,
            group * FIXED * FOUR + lane[:, 0], self._products(k, waves),
        )  # fmt: skip

    def _products(self, k: Integers, waves: Integers) -> Integers:
        """Return `_Alike.pairs`."""
        entry = {pair: e for e, pair in enumerate(_pairs(self.rows))}
        rows = self.at.rotor_at(waves, (k // FOUR * FOUR)[:, None]).tolist()
        found = [
            (b, f, g, PART * entry[row[f], row[g]] + int(k[b]) % FOUR)
            for b, row in enumerate(rows)
            for f, g in zip(*np.triu_indices(len(waves)), strict=True)
            if (row[f], row[g]) in entry
        ]
        return np.array(found).T

    def turn(self, pace: Pace) -> None:
        """Change waves, coefficients and supports to those of an interval."""
        self.pace, key = pace, (*self.key, pace)
        if key in _kept:
            _kept.move_to_end(key)
            self._recall(_kept[key])
            return
        self._find_waves(pace)
        self._stand_on()
        opens, drive = self._put_all_rows(), self._drive()
        rows = {name: getattr(self.rows, name)[at] for name, at in self.tables.items()}
        moved = self.stand.moved.copy()
        self.now = _Prepared(self.waves, rows, opens, drive, self._hub(), moved)
        _keep(key, self.now)
        self._add_ring()

    def _recall(self, made: _Prepared) -> None:
        """Change waves, coefficients and supports to those that were kept."""
        self.now, self.waves = made, made.waves
        for name, at in self.tables.items():
            getattr(self.rows, name)[at] = made.rows[name]
        self._set_stand(made.moved)
        self._add_ring()

    def _add_ring(self) -> None:
        """Add the casing's part to coefficients of a unit spectrum of multipliers."""
        for own in self.alike:
            at = own.fixed + 4 * FOUR
            self.rows.fixed[at] += self.ring[1][own.k].real
            self.rows.fixed[at + FOUR] += self.ring[1][own.k].imag

    def put_rows(self) -> Floats:
        """Return column 0 of the Delassus matrix, (N,); `turn` has put the rows."""
        opens, blades = self.ring[0] + self.now.opens, self.model.blades
        return np.asarray((blade_waves(blades) @ opens[: blades // 2 + 1]).real)

    def hub(self) -> tuple[Integers, Complexes]:
        """Return the waves of y that move the centre, and z_o of each."""
        return self.now.hub

    def _find_waves(self, pace: Pace) -> None:
        """Compute the waves of an interval.

        Where two waves nearly coincide, they are those of a speed beside it.
        """
        for shift in SHIFTS:
            near = Pace(pace.speed * (1.0 + shift), pace.rate)
            self.waves = [
                _waves(own, _terms(own, self.supports, near), self.step)
                for own in self.alike
            ]
            if max(waves.condition for waves in self.waves) < TOO_NEAR:
                break
        each = zip(self.alike, self.waves, strict=True)
        self.pushes = [self._push(own, waves) for own, waves in each]

    @property
    def diameters(self) -> list[Diameter]:
        """The waves of each nodal diameter."""
        out: dict[int, Diameter] = {}
        for own, waves in zip(self.alike, self.waves, strict=True):
            for b, n in enumerate(own.number.tolist()):
                out[n] = Differences(
                    int(own.k[b]), self.step, waves.ahead[b], waves.shapes[b],
                    waves.rises[b], own.radial[b], own.along[b], own.held[0, b],
                    waves.energy[b], waves.rate[b], waves.push[b], waves.rates[b],
                    waves.give[b],
                )  # fmt: skip
        return [out[n] for n in sorted(out)]

    @cached_property
    def _driven(self) -> list[tuple[int, int]]:
        """Group, and number in it, of each nodal diameter that f_0 moves."""
        places = {
            n: (i, b)
            for i, own in enumerate(self.alike)
            for b, n in enumerate(own.number.tolist())
        }
        return [places[n] for n in self.moved]

    @cached_property
    def places(self) -> tuple[Integers, int, Integers, Integers, Integers]:
        """Return the fields of `SlotDrive` from `filled` to `slot`."""
        filled = list[tuple[int, int]]()
        at, own, slot = [NOWHERE], [NOWHERE], [NOWHERE]
        for i, b in self._driven:
            wave, k = self.alike[i].wave[b], int(self.alike[i].k[b])
            n = np.arange(len(wave))
            begun = self.first + PART * sum(rows for _, rows in filled)
            filled.append((k, -(-len(wave) // FOUR)))
            at.append(begun + n // FOUR * PART + n % FOUR)
            own.append(wave)
            slot.append(0 * n + k)
        each = [np.concatenate(part).astype(np.int64) for part in (at, own, slot)]
        rows = np.array(filled, dtype=np.int64).reshape(-1, 2)
        return rows, self.first, each[0], each[1], each[2]

    def _forces(self) -> list[Complexes]:
        """Return the changes of the modes in a step by f_0, of each driven diameter."""
        load = self.loads.at(*self.pace)
        return [
            self.waves[i].give[b] @ modes_of(self.model, self.alike[i].k[b], load)
            for i, b in self._driven
        ]

    def _weights(self) -> list[Complexes]:
        """Return the changes of the modes in a step by the weight, (2, m), see `Loads`.

        They are those of each driven diameter, by cos and sin of the rotor's angle.
        """
        out = []
        for i, b in self._driven:
            k, give = int(self.alike[i].k[b]), self.waves[i].give[b]
            rows = [give @ modes_of(self.model, k, row) for row in self.weight]
            out.append(np.array(rows))
        return out

    def _weight(self) -> Complexes:
        """Return `SlotDrive.weight`."""
        if not self.weight.any():
            return NO_DRIVE.weight
        each = zip(self._weights(), self._driven, strict=True)
        return np.hstack([
            [self._pushed(i, b, row) for row in more] for more, (i, b) in each
        ])  # fmt: skip

    def _pushed(self, i: int, b: int, more: Complexes) -> Complexes:
        """Return the change of waves by one of the modes in a step, of a diameter."""
        return np.asarray(self.waves[i].inverse[b] @ np.concatenate([more, more]))

    @cached_property
    def _own(self) -> tuple[int, int]:
        """Group, and number in it, of nodal diameter 1, which moves the supports."""
        places = [
            (i, b)
            for i, own in enumerate(self.alike)
            for b in np.flatnonzero(own.k == 1).tolist()
        ]
        return places[0]

    def _held(self) -> SlotHeld:
        """Return the kernel's arrays of supports that no constant matrix represents."""
        spin = self.model.rotor.terms
        if spin.is_plain:
            return NO_HOLD
        i, b = self._own
        own, waves, step = self.alike[i], self.waves[i], self.step
        hubs, more = self._hubs, self._lifted
        forces = len(hubs) - len(self.stand.stops)
        gives = waves.inverse[b] @ np.concatenate([more, more])
        passing = waves.rises[b] * (1 + 1 / (1 + waves.ahead[b]))
        moves, beside = hubs @ passing / (2 * step), (i, b) in self._driven
        moves[forces:] = hubs[forces:] @ waves.shapes[b]
        apart = own.along[b] @ more - own.along[b] @ passing @ gives
        size, nudge = len(hubs), np.zeros((3, len(hubs)), dtype=complex)
        at = NOWHERE
        if beside:
            n = self._driven.index((i, b))
            each = [self._forces()[n], *self._weights()[n]]
            nudge[:] = [
                hubs @ change / (2 * step) - moves @ self._pushed(i, b, change)
                for change in each
            ]
            nudge[:, forces:] = 0.0  # their displacements after the step are in `moves`
            at = self.places[2][self.places[4] == 1]
        summed = self.summed[i][b]
        return SlotHeld(
            own.wave[b], at, (hubs @ (waves.shapes[b] - waves.rises[b])).conj(),
            moves.conj(), nudge.T.conj().copy(), gives.T.copy(), own.radial[b] @ more,
            apart.view(float).reshape(size, 2).ravel(),
            2.0 * gives.conj().T @ summed, gives.conj().T @ summed @ gives, 1,
            self.stand,
        )  # fmt: skip

    @property
    def _hubs(self) -> Complexes:
        """Displacements of the supports that no constant matrix represents, (s, m)."""
        i, b = self._own
        rows = self.alike[i].held[:, b]
        every = apart_of(tuple(map(Station, rows, self.supports)))
        return np.array([one.rows for one in every])

    @property
    def _lifted(self) -> Complexes:
        """Change of the modes of nodal diameter 1 by unit conj(f), (m, s)."""
        i, b = self._own
        return np.asarray(self.waves[i].give[b] @ self._hubs.conj().T)

    def _stand_on(self) -> None:
        """Set the supports' arrays to those of the present speed."""
        if self.model.rotor.terms.is_plain:
            return
        diameters, rows = self.diameters, []
        for change in self._lifted.T:
            for turn in (1.0, -1.0j):
                parts = [0j * own.radial for own in diameters]
                parts[1] = turn * change
                rows.append(modal_places(self.model, diameters, parts))
        self._set_stand(np.array(rows))

    def _set_stand(self, moved: Floats) -> None:
        """Set the supports' arrays; moved : (2 s, m), see `_Prepared.moved`."""
        set_standing(self.model, self.stand, self.pace.speed, moved)
        self.weight = self.loads.weight + drawn_loads(self.stand, self.held)

    def drive(self) -> SlotDrive:
        """Return a copy of the kernel's arrays of the motion r, and of the work on y.

        The supports in it are those of this rotor.
        """
        parts, held = _copied(self.now.drive), _copied(self.now.drive.held)
        return SlotDrive._make([*parts[:-1], SlotHeld._make([*held[:-1], self.stand])])

    def _drive(self) -> SlotDrive:
        """Return the kernel's arrays of the motion r, and of the work on y."""
        works = self._works()
        beyond = self._weight(), self._held()
        if not self.moved:
            return SlotDrive._make([*NO_DRIVE[:9], *works, *beyond])
        columns, free = [], []
        for more, (i, b) in zip(self._forces(), self._driven, strict=True):
            own, waves = self.alike[i], self.waves[i]
            push = self._pushed(i, b, more)
            seen = np.stack([own.radial[b], own.along[b], own.held[0, b]])
            columns.append(seen @ waves.shapes[b])
            free.append(_rows(waves.ahead[b], columns[-1][0], push))
        radial, along, hub = np.hstack(columns)
        rest = np.concatenate(free), radial.real.copy(), _parts(along), hub_of(hub)
        return SlotDrive._make([*self.places, *rest, *works, *beyond])

    def _works(self) -> tuple[Floats, ...]:
        """Return `turning`, `spin`, `swirl` and `swirls` of `SlotDrive`."""
        rows, groups = int(self.at.rotor.sum()), len(self.at.rotor)
        form, spin, swirl, swirls = (
            np.zeros(size)
            for size in (len(self.rows.energy), rows * FOUR, rows * PART, groups * FOUR)
        )
        each, self.summed = zip(self.alike, self.waves, self.pushes, strict=True), []
        for own, waves, (_, push) in each:
            turned, summed = self._summed(own, waves)
            self.summed.append(summed)
            _put_form(form, own, 0.5 * turned - summed)
            size = np.abs(1 + waves.ahead) ** 2
            spin[own.beside // PART * FOUR + own.beside % PART] = (
                np.diagonal(turned, axis1=1, axis2=2).real / size
            )
            _put_swirl(swirl, swirls, own, push, summed)
        return form, spin, swirl, swirls

    def swirls(self) -> tuple[Floats, Floats]:
        """Return `swirl` and `swirls` of `SlotDrive`, by forces along theta instead."""
        groups, rows = len(self.at.rotor), int(self.at.rotor.sum())
        swirl, swirls = np.zeros(rows * PART), np.zeros(groups * FOUR)
        for own, waves in zip(self.alike, self.waves, strict=True):
            _, push = self._pushed_by(waves, own.along.conj())
            _put_swirl(swirl, swirls, own, push, self._summed(own, waves)[1])
        return swirl, swirls

    def aside(self) -> tuple[Integers, Integers, Complexes]:
        """Return `at`, `slot`, `aside` of `SlotSlides`, of motion without contact."""
        each = [
            self.alike[i].along[b] @ self.waves[i].rises[b] for i, b in self._driven
        ]
        _, _, at, _, slot = self.places
        return at, slot, np.concatenate([np.zeros(0, complex), *each])

    def _summed(self, own: _Alike, waves: _Waves) -> tuple[Complexes, Complexes]:
        """Return the forms H and G (b, w, w) of the work of the force, J.

        G without its diagonal, see `kernels.loop.slots.turn_slots`.
        """
        ahead = waves.ahead
        before = waves.shapes / (1 + ahead)[:, None]
        part = _back(waves.shapes) @ own.coriolis @ before
        turned = -0.5 * self.pace.rate * (part + _back(part))
        back, on = ahead.conj()[:, :, None], ahead[:, None]
        apart = -(back + on + back * on)  # 1 - conj(z_f) z_g
        alone = np.eye(ahead.shape[1], dtype=bool)
        return turned, np.where(alone, 0.0, turned / np.where(alone, 1.0, apart))

    def _push(self, own: _Alike, waves: _Waves) -> tuple[Complexes, Complexes]:
        """Return what unit multipliers change: modes (b, m, 1), and waves (b, w)."""
        return self._pushed_by(waves, (own.radial + self.mu * own.along).conj())

    @staticmethod
    def _pushed_by(waves: _Waves, force: Complexes) -> tuple[Complexes, Complexes]:
        more = waves.give @ force[:, :, None]
        both = np.concatenate([more, more], axis=1)
        return more, (waves.inverse @ both)[:, :, 0]

    def _put_all_rows(self) -> Complexes:
        """Write the rotor's coefficients of the interval; return `_Prepared.opens`."""
        opens = 0j * self.ring[0]
        each = zip(self.alike, self.waves, self.pushes, strict=True)
        for own, waves, pushes in each:
            opens[own.k] += self._put_rows(own, waves, *pushes)
        return np.asarray(opens)

    def _put_rows(
        self, own: _Alike, waves: _Waves, more: Complexes, push: Complexes
    ) -> Complexes:
        """Write the coefficients of waves; return the opening by multipliers, (b,).

        more, push : as `_push` returns them
        """
        rows, along = self.rows, own.along[:, None]
        seen = np.stack([own.radial, own.along], axis=1) @ waves.shapes
        moves = waves.rises * (1 + 1 / (1 + waves.ahead))[:, None]
        opened = (seen[:, 0] * push).sum(axis=1)
        _put(rows.free, own.free, waves.ahead)
        rows.free[own.free + 2 * FOUR] = seen[:, 0].real
        _put(rows.pushed, own.pushed, (along @ moves)[:, 0])
        _put(rows.pushed, own.pushed + 2 * FOUR, push)
        _put(rows.along, own.beside, seen[:, 1])
        _put(rows.fixed, own.fixed, opened)
        slides = (along @ more)[:, 0, 0]
        _put(rows.fixed, own.fixed + 4 * FOUR, slides)
        _put_form(rows.energy, own, waves.energy)
        return np.asarray(opened)

    def _hub(self) -> tuple[Integers, Complexes]:
        """Return the waves of y that move the centre, and z_o of each."""
        index, moved = [NOWHERE], [np.zeros(0, complex)]
        for own, waves in zip(self.alike, self.waves, strict=True):
            for b in np.flatnonzero(own.held[0].any(axis=1)).tolist():
                index.append(own.wave[b])
                moved.append(own.held[0, b] @ waves.shapes[b])
        return np.concatenate(index), np.concatenate(moved)

    def convert(self, state: Floats, old: list[_Waves]) -> None:
        """Write the amplitudes of a motion, which a state has as those of old waves."""
        at, parts = self.places[2], [np.zeros(0, complex)]
        rest = self.beside(state)
        for i, b in self._driven:
            a, rest = np.split(rest, [self.waves[i].ahead.shape[1]])
            parts.append(self.waves[i].turned(old[i], a, b))
        _put(state, at, np.concatenate(parts))
        each = zip(self.alike, self.waves, old, strict=True)
        for own, waves, was in each:
            a = state[own.wave] + 1j * state[own.wave + FOUR]
            _put(state, own.wave, waves.turned(was, a))

    def beside(self, state: Floats) -> Complexes:
        """Return the amplitudes of the motion without contact, (n,), in a state."""
        at = self.places[2]
        return np.asarray(state[at] + 1j * state[at + FOUR])

    def _changes(self, angle: float) -> list[Complexes]:
        """Return the changes of the modes in a step by f_0 and the weight.

        angle : rad, of the rotor
        """
        turned = np.array([math.cos(angle), math.sin(angle)])
        each = zip(self._forces(), self._weights(), strict=True)
        return [more + turned @ weight for more, weight in each]

    def motion(self, state: Floats, angle: float) -> tuple[Floats, Floats]:
        """Return the motion without contact in a state, modes and velocities (m,).

        The velocities are those without the supports' forces in the step.

        angle : rad, of the rotor
        """
        rest, diameters = self.beside(state), self.diameters
        places, rates = ([0j * own.radial for own in diameters] for _ in range(2))
        for n, more in zip(self.moved, self._changes(angle), strict=True):
            own = diameters[n]
            a, rest = np.split(rest, [len(own.ahead)])
            places[n] = own.shapes @ a
            rates[n] = own.rates @ a + more / (2 * self.step)
        q, v = (modal_places(self.model, diameters, x) for x in (places, rates))
        return q, v

    def put_beside(self, state: Floats, q: Floats, rate: Floats) -> None:
        """Write a motion without contact at time 0: modes, and velocities, (m,)."""
        out, diameters = [np.zeros(0, complex)], self.diameters
        if len(self.stand.hub):
            rate = rate - included_in(self.stand, q, rate)
        for n, more in zip(self.moved, self._changes(0.0), strict=True):
            own = diameters[n]
            x, v = (modes_of(self.model, own.k, part) for part in (q, rate))
            out.append(own.motion.write(x, v - more / (2 * self.step)))
        _put(state, self.places[2], np.concatenate(out))


def _copied(parts: tuple[Any, ...]) -> list[Any]:
    """Return parts of which arrays are copies."""
    return [np.copy(part) if isinstance(part, np.ndarray) else part for part in parts]


def _put_swirl(
    swirl: Floats, swirls: Floats, own: _Alike, push: Complexes, summed: Complexes
) -> None:
    """Write the work by what unit forces push, (b, w), of a form (b, w, w)."""
    given = push.conj()[:, None] @ summed
    _put(swirl, own.beside, 2.0 * given[:, 0])
    swirls[own.k] = (given @ push[:, :, None])[:, 0, 0].real


def _tables_of(alike: list[_Alike]) -> dict[str, Integers]:
    """Return indices of the rotor's coefficients in tables of `SlotRows`, by name."""
    items = {
        "free": ("free", (0, 1, 2)), "pushed": ("pushed", (0, 1, 2, 3)),
        "along": ("beside", (0, 1)), "fixed": ("fixed", (0, 1, 4, 5)),
    }  # fmt: skip
    found = {
        name: [getattr(own, field) + FOUR * n for own in alike for n in each]
        for name, (field, each) in items.items()
    }
    found["energy"] = [own.pairs[3] + FOUR * n for own in alike for n in (0, 1)]
    return {
        name: np.concatenate([np.ravel(part) for part in parts])
        for name, parts in found.items()
    }


def hub_of(z: Complexes) -> Floats:
    """Return x_o and y_o for unit re and im of amplitudes, (2, n, 2), from z_o (n,)."""
    axes = (z.real, -z.imag), (-z.imag, -z.real)
    return np.ascontiguousarray(np.stack([np.stack(axis, -1) for axis in axes]))


def _pairs(rows: SlotRows) -> list[tuple[int, int]]:
    """Return the two amplitudes of each product of `SlotRows.pairs` of the rotor."""
    pairs = rows.pairs.reshape(-1, 2)[: rows.split].tolist()
    return [(i, j) for i, j in pairs]


def _stations(piece: SpinBlock, count: int) -> Any:
    """Return the displacements of the shaft's supports, 0 where the shaft rests."""
    if len(piece.stations) == count:
        return piece.stations
    return np.zeros((count, len(piece.omega)))


def _put(table: Floats, at: Integers, values: Complexes) -> None:
    """Write complex coefficients to a packed table; at : indices of re."""
    table[at], table[at + FOUR] = values.real, values.imag


def _put_form(table: Floats, own: _Alike, form: Complexes) -> None:
    """Write Hermitian forms (b, w, w) of waves to a packed table."""
    b, f, g, at = own.pairs
    _put(table, at, form[b, f, g] * np.where(f < g, 2.0, 1.0))


def _rows(ahead: Complexes, radial: Complexes, push: Complexes) -> Floats:
    """Return `SlotDrive.free` of the waves of a slot, padded to rows of four."""
    items = np.stack([ahead.real, ahead.imag, radial.real, push.real, push.imag])
    items = np.pad(items, ((0, 0), (0, -len(ahead) % FOUR)))
    return items.reshape(len(items), -1, FOUR).swapaxes(0, 1).ravel()


def _parts(z: Complexes) -> Floats:
    return np.column_stack([z.real, z.imag])
