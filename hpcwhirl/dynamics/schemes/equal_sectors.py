"""Integrator of equal sectors with one contact point a tip: waves of rotor and casing.

All waves lie in slots, one for each nodal diameter, see `kernels.loop.slots`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any, cast

import numpy as np
from scipy.linalg import circulant

from hpcwhirl.arrays import Complexes, Floats, Integers
from hpcwhirl.case.limits import step_counts
from hpcwhirl.case.profile import HeldShape
from hpcwhirl.case.speed import Interval, angle_at, law_of
from hpcwhirl.case.unbalance import (
    missing_at_start,
    share_at_start,
    steady_at,
    steady_rates,
)
from hpcwhirl.dynamics.bodies.motion import Amplitudes, Motion, amplitudes
from hpcwhirl.dynamics.bodies.operators import friction_with_sign, rods_under, wears
from hpcwhirl.dynamics.bodies.turning import added_by, included_in
from hpcwhirl.dynamics.kernels import contact
from hpcwhirl.dynamics.kernels.kernel_types import Arrays, CyclicState, Load
from hpcwhirl.dynamics.kernels.loop.circulant import renew
from hpcwhirl.dynamics.kernels.loop.points import march_points
from hpcwhirl.dynamics.kernels.loop.slot_steps import slot_space, works_of_slots
from hpcwhirl.dynamics.kernels.loop.slots import (
    SEEN,
    TURNING,
    energies_of_slots,
    turning_of_slots,
)
from hpcwhirl.dynamics.kernels.loop.wave_types import (
    FlowRows,
    SlotContact,
    SlotDrive,
    SlotFlight,
    SlotPulse,
    SlotRotor,
    SlotRows,
    SlotSlides,
    SlotSpace,
)
from hpcwhirl.dynamics.kernels.vectors import FOUR, all_aligned, widths
from hpcwhirl.dynamics.schemes.integrator import (
    Balance,
    Integrator,
    at_rest,
    nothing_booked,
    unfold,
    with_space,
    write_gaps,
)
from hpcwhirl.dynamics.waves.casing import ready_at
from hpcwhirl.dynamics.waves.driven_slots import (
    NO_DRIVE,
    DrivenSlots,
    Pace,
    hub_of,
)
from hpcwhirl.dynamics.waves.flights import LONGEST, can_fly
from hpcwhirl.dynamics.waves.free_motion import FreeMotion
from hpcwhirl.dynamics.waves.free_waves import free_slots
from hpcwhirl.dynamics.waves.mode_waves import mode_waves
from hpcwhirl.dynamics.waves.point_supports import NO_SLOT, slot_support
from hpcwhirl.dynamics.waves.slot_slides import (
    Further,
    Rubbed,
    aside_of,
    drag_of_diameters,
    drag_of_modes,
    no_drag,
    no_slides,
    slot_slides,
)
from hpcwhirl.dynamics.waves.slot_waves import (
    PART,
    SlotPlaces,
    SlotWaves,
    Steps,
    differences,
    exact_steps,
    flight_of,
    no_waves,
    pairs_of_modes,
    places_of,
    slot_rows,
    turned,
)
from hpcwhirl.dynamics.waves.slots import (
    MOST_RUBBED,
    blade_waves,
    fold,
    lobe_table,
    ring_amplitudes,
    ring_modes,
    ring_slots,
    ring_table,
    ring_turned,
    rotor_amplitudes,
    rotor_slots,
    rotor_table,
    transforms,
)
from hpcwhirl.dynamics.waves.turning_waves import (
    WORST,
    Circle,
    Diameter,
    books,
    circles_of,
    diameters_of,
    is_basis,
    modal_places,
    modes_of,
)
from hpcwhirl.dynamics.waves.wave_motion import WaveMotion
from hpcwhirl.reduction.model import Model
from hpcwhirl.scene import Scene
from hpcwhirl.scene.contact_laws import PERMANENT


def equal_sectors(model: Model, scene: Scene, beat: int) -> Integrator | None:
    """Return the integrator of equal sectors, or None.

    None if two waves of a body nearly coincide: for a mode that does not oscillate, or
    at a speed at which two waves of the rotor meet.

    beat : number of time steps between two rows of evidence
    """
    diameters, mu = diameters_of(model, scene), friction_with_sign(scene)
    if diameters and not (
        is_basis(diameters) and all(books(own, mu) for own in diameters)
    ):
        return None
    step, flies = scene.solver.time_step, scene.solver.flies
    if not _oscillates(model, step, flies=flies, turns=bool(diameters)):
        return None
    return EqualWaves(model, scene, diameters, beat)


@lru_cache(maxsize=MOST_RUBBED)
def _oscillates(model: Model, step: float, *, flies: bool, turns: bool) -> bool:
    """Return whether all modes that are integrated as pairs of waves oscillate.

    flies : whether the scheme is `exact`: critical damping is less in central
        differences
    turns : whether the rotor has terms of rotation, so that its waves are others
    """
    both = model.casing, None if turns else model.rotor
    bodies = [body for body in both if body is not None]
    if not flies:
        return all(mode_waves(body, step).is_basis for body in bodies)
    return all(
        (body.omega > 0.0).all()
        and bool((np.sqrt(1 - np.minimum(body.ratios, 1.0) ** 2) * WORST > 1.0).all())
        for body in bodies
    )


@dataclass(frozen=True)
class Pairs:
    """Pairs of waves of a body's R rows of complex modes, by slot.

    waves : the waves, two rows for each row of modes
    steps : how the first waves move
    motion : how each pair moves its mode, (R, k, 1, 2)
    """

    waves: SlotWaves
    steps: Steps
    motion: WaveMotion

    def modes(self, a: Complexes) -> tuple[Complexes, Complexes]:
        """Return amplitudes and velocities of modes, (R, k), from those of waves.

        a : (2 R, k)
        """
        pairs = a.reshape(-1, 2, a.shape[1]).swapaxes(1, 2)
        x, rate = self.motion.read(pairs)
        return x[..., 0], rate[..., 0]

    def amplitudes(self, y: Complexes, rate: Complexes) -> Complexes:
        """Return the amplitudes of the waves, (2 R, k), in a motion of the modes."""
        pairs = self.motion.write(y[..., None], rate[..., None])
        return np.asarray(pairs.swapaxes(1, 2).reshape(-1, y.shape[1]))

    def before(self, a: Complexes) -> Complexes:
        """Return the amplitudes of the modes a step before, (R, k), without forces."""
        z = 1 + self.waves.ahead
        return self.modes(a / z)[0]


def _pairs(items: Floats, mu: float, step: float, *, flies: bool) -> Pairs:
    steps = exact_steps(items, step) if flies else differences(items, step)
    first = np.where(steps.there, steps.rates, 1j)[..., None]  # padding: any pair
    rates = np.stack([first, first.conj()], axis=-1)
    motion = WaveMotion(np.ones_like(rates), rates)
    return Pairs(pairs_of_modes(items, mu, steps), steps, motion)


@lru_cache(maxsize=MOST_RUBBED)
def _ring_waves(model: Model, step: float, mu: str, *, flies: bool) -> SlotWaves:
    if model.casing is None:
        return no_waves(widths(model.blades)[0])
    return _ring_pairs(model, step, mu, flies=flies).waves


@lru_cache(maxsize=MOST_RUBBED)
def _ring_pairs(model: Model, step: float, mu: str, *, flies: bool) -> Pairs:
    items = ring_table(model, step, flies=flies)[0]
    return _pairs(items, float.fromhex(mu), step, flies=flies)


@lru_cache(maxsize=MOST_RUBBED)
def _rotor_pairs(model: Model, step: float, mu: str, *, flies: bool) -> Pairs:
    items = rotor_table(model, step, flies=flies)[0]
    return _pairs(items, float.fromhex(mu), step, flies=flies)


def turning(
    diameters: list[Diameter], slots: int, mu: float, steady: tuple[Circle, ...]
) -> SlotWaves:
    """Return the waves of a rotor with terms of rotation, by slot.

    diameters, slots : waves of each nodal diameter; number of slots, padded
    mu, steady : friction with the sign of the speed; the orbits of an unbalanced rotor,
        which become the last rows of waves
    """
    rows = max(len(own.ahead) for own in diameters) + len(steady)
    there = np.zeros((rows, slots), dtype=bool)
    tables: Any = [np.zeros((rows, slots), dtype=complex) for _ in range(6)]
    opens: Any = np.zeros(slots, dtype=complex)
    near, slides = 0.0 * opens, 0.0 * opens
    form = {(f, g): np.zeros(slots, dtype=complex) for f in range(rows)
            for g in range(f, rows)}  # fmt: skip
    for own in diameters:
        k, count, shapes, moves = own.k, len(own.ahead), own.shapes, own.passing()
        values = (
            own.ahead, own.radial @ shapes, own.along @ shapes, own.pushed(mu),
            own.along @ moves, own.radial @ moves,
        )  # fmt: skip
        there[:count, k] = True
        for table, value in zip(tables, values, strict=True):
            table[:count, k] = value
        opens[k] = own.radial @ shapes @ own.pushed(mu)
        near[k] = own.radial @ own.passed(mu)
        slides[k] = own.along @ own.passed(mu)
        upper = np.triu(own.energy) + np.triu(own.energy, 1)
        for f in range(count):
            for g in range(f, count):
                form[f, g][k] = upper[f, g]
    ahead, radial, along, push, slide, moved = tables
    for f, orbit in enumerate(steady, rows - len(steady)):
        own, shape = diameters[1], orbit.shape
        there[f, own.k], ahead[f, own.k] = True, orbit.ahead
        radial[f, own.k], along[f, own.k] = own.radial @ shape, own.along @ shape
    return SlotWaves(
        there, ahead, radial.real.copy(), along, push, slide, moved, 0.0 * moved, opens,
        near, slides, form,
    )  # fmt: skip


@dataclass(frozen=True)
class Laid:
    """Waves of both bodies as the kernel has them, the casing's at speed 0.

    Attributes
    ----------
    rotor, ring : waves of rotor and casing
    at, rows : their places among the state's amplitudes; packed coefficients
    beside : row and slot of the casing's waves
    column : (N,), m/N, column 0 of the Delassus matrix
    modes : (c, 2), indices of the two waves of each of the casing's complex modes
    """

    rotor: SlotWaves
    ring: SlotWaves
    at: SlotPlaces
    rows: SlotRows | FlowRows
    beside: tuple[Integers, Integers]
    column: Floats
    modes: Integers


NO_FLIGHT = SlotFlight(
    0,
    certifiable=False,
    counts=np.zeros(0, np.int64),
    jumps=np.zeros(0),
    bounds=np.zeros(0),
)


def _laid(model: Model, rotor: SlotWaves, ring: SlotWaves, *, flies: bool) -> Laid:
    at, flight = places_of(rotor, ring), NO_FLIGHT if flies else None
    rows = slot_rows(rotor, ring, at, transforms(model.blades), flight)
    symbol = (rotor.opens + ring.opens)[: model.blades // 2 + 1]
    column = (blade_waves(model.blades) @ symbol).real.copy()
    pairs = [
        [at.ring_at(2 * mode.row + i, mode.slot) for i in range(2)]
        for mode in ring_modes(model)
    ]
    modes = np.array(pairs, dtype=np.int64).reshape(-1, 2)
    row, slot = np.nonzero(ring.there)
    return Laid(rotor, ring, at, rows, (row, slot), column, modes)


Hub = tuple[Integers, Floats]
FIXED_PLACES = 5  # first fields of `SlotDrive`, which no speed changes
HELD = "places", "moves", "nudge", "gives", "gaps", "slides", "swirl", "swirls"


def _with(driven: DrivenSlots, drive: SlotDrive) -> Hub:
    """Return the waves that move the centre, with those of a motion without contact."""
    index, moved = driven.hub()
    both = np.concatenate([hub_of(moved), drive.hub], axis=1)
    return np.append(index, drive.at).astype(np.int64), np.ascontiguousarray(both)


@lru_cache(maxsize=MOST_RUBBED)
def _laid_pairs(model: Model, step: float, mu: str, *, flies: bool) -> tuple[Laid, Hub]:
    """Return the waves of a rotor without terms of rotation, and those of its centre.

    step, mu : dt, s; `float.hex` of the friction with the sign of the speed
    flies : whether the scheme is `exact`, else central differences
    """
    rotor = _rotor_pairs(model, step, mu, flies=flies).waves
    laid = _laid(model, rotor, _ring_waves(model, step, mu, flies=flies), flies=flies)
    table = rotor_table(model, step, flies=flies)[1]
    f, k = np.nonzero(np.abs(table).sum(axis=(0, 2)))
    hub = np.repeat(table[:, f, :, k].swapaxes(0, 1), 2, axis=1)
    at = np.stack([laid.at.rotor_at(2 * f + i, k) for i in range(2)], axis=1)
    return laid, (at.ravel().astype(np.int64), np.ascontiguousarray(hub))


def _laid_turning(
    model: Model,
    step: float,
    mu: str,
    diameters: list[Diameter],
    steady: tuple[Circle, ...],
    *,
    flies: bool,
) -> tuple[Laid, Hub]:
    """Return the waves of a rotor with terms of rotation, and those of its centre.

    diameters, steady : its waves of each nodal diameter; orbits of an unbalanced rotor
    step, mu, flies : as for `_laid_pairs`
    """
    slots = widths(model.blades)[0]
    rotor = turning(diameters, slots, float.fromhex(mu), steady)
    laid = _laid(model, rotor, _ring_waves(model, step, mu, flies=flies), flies=flies)
    return laid, _turning_hub(laid.at, diameters, steady)


def _turning_hub(
    at: SlotPlaces, diameters: list[Diameter], steady: tuple[Circle, ...]
) -> Hub:
    """Return the waves that move the centre, and x_o, y_o by them, with rotation."""
    rows, values = list[tuple[int, int]](), list[complex]()
    for own in diameters:
        for f, z in enumerate(own.hub @ own.shapes):
            rows.append((f, own.k))
            values.append(complex(z))
    first = max(len(own.ahead) for own in diameters)
    for f, orbit in enumerate(steady, first):
        rows.append((f, 1))
        values.append(complex(diameters[1].hub @ orbit.shape))
    z = np.array(values)
    x, y = (np.stack(parts, -1) for parts in ((z.real, -z.imag), (-z.imag, -z.real)))
    used = np.abs(z) > 0.0
    index = np.array([at.rotor_at(*row) for row in rows], dtype=np.int64)
    return index[used], np.ascontiguousarray(np.stack([x, y])[:, used])


class EqualWaves(Integrator):
    """Integrator of equal sectors as waves of rotor and casing, by slot.

    diameters : the rotor's waves of each nodal diameter; none without terms of rotation

    Attributes
    ----------
    rotor, ring : waves of rotor and casing
    own, beside : conversion of motions of rotor and casing
    at : where waves lie among the state's amplitudes
    steady : orbits of an unbalanced rotor; none if balanced
    driven : waves of a rotor with terms of rotation whose speed changes; None: others
    moves : whether a run with such a rotor starts from a motion
    """

    moves = False

    def __init__(
        self, model: Model, scene: Scene, diameters: list[Diameter], beat: int
    ) -> None:
        step, mu, flies = (
            scene.solver.time_step, friction_with_sign(scene), scene.solver.flies,
        )  # fmt: skip
        slots, _ = widths(model.blades)
        self.drives, self.jumps = bool(diameters) and law_of(scene) is not None, flies
        still = not diameters or self.drives
        self.steady = () if still else circles_of(model, scene, diameters)
        key = model, step, mu.hex()
        self.diameters = diameters
        self.own = None if diameters else _rotor_pairs(*key, flies=flies)
        self.beside = _ring_pairs(*key, flies=flies) if model.casing else None
        laid, hub = (
            _laid_turning(*key, diameters, self.steady, flies=flies)
            if diameters
            else _laid_pairs(*key, flies=flies)
        )
        self.laid, self.at, self.rotor, self.ring = laid, laid.at, laid.rotor, laid.ring
        body = self._body(model, scene, hub, beat)
        loading = Load(scene.force, scene.pulse, np.zeros(0))
        constants = _contact(model, scene, laid.column, self._slides(model, scene))
        arrays = Arrays(loading, body, (), constants)
        seen = 0 if flies else SEEN * 2 * slots
        rows = self.at.rows + int(body.drive.filled[:, 1].sum())
        sizes = rows * PART + seen, 0, 2 * slots, 3 * slots
        state = at_rest(model.blades, scene, sizes)
        super().__init__(model, scene, arrays, state)
        march = cast(Any, march_points)
        self._made: list[SlotSpace] = []
        self.kernel = with_space(march, lambda: slot_space(arrays, state), self._made)
        self.casing_width = 2 * len(body.modes)
        if flies:
            state.counter[contact.NEXT_TRY] = ready_at(scene)
        if self.steady:
            self._put_on_circle()

    def _body(self, model: Model, scene: Scene, hub: Hub, beat: int) -> SlotRotor:
        """Return the kernel's arrays of both bodies.

        hub : waves that move the centre, at a constant speed
        """
        rows = self._own_rows(model, scene, beat)
        self.driven, drive, held = None, NO_DRIVE, NO_SLOT
        if not self.drives:
            held = slot_support(model, scene, self.diameters, self.steady, self.at)
        elif isinstance(rows, SlotRows):
            self.driven = DrivenSlots(model, scene, self.at, rows, self.ring)
            drive = self.driven.drive()
            hub = _with(self.driven, drive)
        pulse = self._pulse(model, scene)
        return SlotRotor(rows, pulse, *hub, self.laid.modes, held, drive)

    def _slides(self, model: Model, scene: Scene) -> SlotSlides:
        """Return the kernel's arrays of set-valued friction."""
        step, k = scene.solver.time_step, widths(model.blades)[0]
        aside = aside_of(self.steady, self.diameters, self.at)
        if self.driven:
            aside = self.driven.aside()
        if scene.slip == PERMANENT:
            return no_slides(model.blades, step, aside)
        flies, mu = scene.solver.flies, friction_with_sign(scene)
        diameters, waves = self.diameters, self.rotor
        swirls = np.zeros(0), np.zeros(0)
        if self.driven:
            diameters, swirls = self.driven.diameters, self.driven.swirls()
            waves = turning(diameters, k, mu, ())
        if diameters:
            own = drag_of_diameters(diameters, waves.rows, k)
        else:
            pairs = _rotor_pairs(model, step, mu.hex(), flies=flies)
            own = drag_of_modes(rotor_table(model, step, flies=flies)[0], pairs.steps)
        beside = no_drag(k)
        if self.beside is not None:
            items = ring_table(model, step, flies=flies)[0]
            beside = drag_of_modes(items, self.beside.steps)
        bodies = Rubbed(waves, own), Rubbed(self.ring, beside)
        return slot_slides(model, scene, bodies, self.at, Further(swirls, aside))

    def _own_rows(self, model: Model, scene: Scene, beat: int) -> SlotRows | FlowRows:
        """Return a copy of the packed coefficients, for the speed of a scene."""
        rows = self.laid.rows
        free, pushed, fixed, along, energy = all_aligned(
            [rows.free, rows.pushed, rows.fixed, rows.along, rows.energy]
        )
        rows = rows._replace(
            free=free, pushed=pushed, fixed=fixed, along=along, energy=energy
        )
        self._turn(model, scene, rows, scene.speed)
        if isinstance(rows, FlowRows):
            rows = rows._replace(flight=self._flight(scene, beat))
        return rows

    def _turn(
        self, model: Model, scene: Scene, rows: SlotRows | FlowRows, speed: float
    ) -> None:
        """Set the casing's coefficients in `rows` to those of a speed, rad/s."""
        if self.beside is None:
            return
        step, own = scene.solver.time_step, self.laid.beside
        turns = ring_table(model, step, flies=scene.solver.flies)[1]
        self.ring = turned(self.beside.waves, turns * speed, step)
        _put(rows.free, self.at.free_at(*own), self.ring.ahead[own])
        if isinstance(rows, FlowRows):
            _put(rows.pushed, self.at.passing_at(*own), self.ring.passing[own])

    def _flight(self, scene: Scene, beat: int) -> SlotFlight:
        """Return the coefficients of jumps of the exact flow."""
        counts = np.array([2**p for p in range(LONGEST + 1)] + [beat], dtype=np.int64)
        total, _ = step_counts(scene)
        jumps, bounds, dies = flight_of(
            self.rotor, self.ring, self.at, scene.solver.time_step, counts
        )
        flat = all_aligned([jumps, bounds])
        certifiable = can_fly(scene) and dies
        return SlotFlight(total, certifiable, counts, *flat)

    def _pulse(self, model: Model, scene: Scene) -> SlotPulse:
        """Return the effect of the pulse on the casing's waves."""
        slot, sign = fold(scene.nodal_diameter, model.blades)
        none = np.zeros((0, 2))
        if self.beside is None:
            return SlotPulse(
                np.zeros(0, np.int64), none, none, np.zeros(11), slot, sign
            )
        mu, force, steps = (
            friction_with_sign(scene), lobe_table(model, scene), self.beside.steps,
        )  # fmt: skip
        f = np.flatnonzero(force[:, slot])
        lobe, waves = force[f, slot], self.beside.waves
        give, moved = steps.give[f, slot], steps.moved[f, slot]
        radial, along = waves.radial[2 * f, slot], waves.along[2 * f, slot]
        push, move = steps.gives[f, slot] * lobe, lobe * steps.moves[f, slot]
        by_contact = complex((lobe * moved * (radial + mu * along.conj())).sum())
        beyond = lobe * (moved - 2 * (steps.gives * steps.moves)[f, slot].real)
        side = complex((along * beyond).sum())
        by_drag = complex((lobe * moved * along.conj()).sum())
        rows = np.stack([2 * f, 2 * f + 1], axis=1).ravel()
        both = np.stack([push, push.conj()], axis=1).ravel()
        passed = complex(-(self.ring.passing[rows, slot] * both).sum())
        numbers = np.array([
            (radial * give * lobe).sum(), (lobe * moved * lobe).sum(), by_contact.real,
            by_contact.imag, (radial * beyond).sum(), side.real, side.imag,
            passed.real, passed.imag, by_drag.real, by_drag.imag,
        ])  # fmt: skip
        at = np.stack([self.at.ring_at(2 * f + i, slot) for i in range(2)], axis=1)
        return SlotPulse(
            at.ravel().astype(np.int64), _two_parts(push), _two_parts(move), numbers,
            slot, sign,
        )  # fmt: skip

    def _table(self, state: CyclicState, at: Any, body: SlotWaves) -> Any:
        """Return the amplitudes of a body's waves, (rows, k), from a state."""
        row, slot = np.nonzero(body.there)
        index, out = at(row, slot), np.zeros(body.there.shape, dtype=complex)
        out[row, slot] = state.rotor[index] + 1j * state.rotor[index + FOUR]
        return out

    def _lay(self, state: CyclicState, at: Any, body: SlotWaves, a: Complexes) -> None:
        """Write the amplitudes of a body's waves, (rows, k), to a state."""
        row, slot = np.nonzero(body.there)
        index = at(row, slot)
        state.rotor[index], state.rotor[index + FOUR] = (
            a[row, slot].real,
            a[row, slot].imag,
        )

    def _rotor_motion(self, state: CyclicState, steps: int) -> tuple[Floats, Floats]:
        """Return amplitudes and velocities of the rotor's modes at rest, (m,) each."""
        a = self._table(state, self.at.rotor_at, self.rotor)
        if self.own is not None:
            y, v = self.own.modes(a)
            q, rate = (rotor_amplitudes(self.model, _flat(part)) for part in (y, v))
            return q, rate
        diameters = self.driven.diameters if self.driven else self.diameters
        waves = [a[: len(own.ahead), own.k] for own in diameters]
        pairs = zip(diameters, waves, strict=True)
        moved = zip(*(own.motion.read(w) for own, w in pairs), strict=True)
        q, rate = (self._of_modes(list(part)) for part in moved)
        stand, step = self.arrays.rotor.support.stand, self.scene.solver.time_step
        if self.driven:
            return self._driven_motion(self.driven, state, steps, (q, rate))
        if len(stand.hub):
            rate = rate + added_by(stand, q, rate, self.scene.speed * (steps * step))
        still, moving = self._orbit(a[len(a) - len(self.steady) :, 1])
        return q + still, rate + moving

    def _driven_motion(
        self,
        driven: DrivenSlots,
        state: CyclicState,
        steps: int,
        own: tuple[Floats, Floats],
    ) -> tuple[Floats, Floats]:
        """Return modes and velocities, (m,) each, at a changing speed.

        own : those of the motion by contact, without the supports' forces in the step
        """
        angle = float(angle_at(self.scene, steps, self.scene.solver.time_step))
        still, moving = driven.motion(state.rotor, angle)
        q, rate = own[0] + still, own[1] + moving
        if len(driven.stand.hub):
            rate = rate + added_by(driven.stand, q, rate, angle)
        return q, rate

    def _of_modes(self, places: list[Complexes]) -> Floats:
        """Return amplitudes of all modes at rest, (m,), from those by diameter."""
        return modal_places(self.model, self.diameters, places)

    def _orbit(self, a: Complexes) -> tuple[Floats, Floats]:
        """Return places and velocities of the modes at rest, (m,) each, on the orbit.

        It is that of an unbalanced rotor without contact; a : amplitudes of its circles
        """
        step, size = self.scene.solver.time_step, len(self.model.rotor.omega)
        places, rates = np.zeros(size), np.zeros(size)
        own = [np.zeros(len(o.shapes), dtype=complex) for o in self.diameters]
        for orbit, value in zip(self.steady, a, strict=True):
            own[1] = orbit.shape * value
            places += self._of_modes(own)
            own[1] = own[1] * orbit.rise(step)
            rates += self._of_modes(own)
        return places, rates

    @property
    def _begun(self) -> tuple[Floats, Floats]:
        """The same of the orbit at time 0."""
        return self._orbit(np.array([orbit.amplitude for orbit in self.steady]))

    def _ring_motion(self, state: CyclicState, steps: int) -> tuple[Floats, Floats]:
        if self.beside is None:
            return np.zeros(0), np.zeros(0)
        a = self._table(state, self.at.ring_at, self.beside.waves)
        both = np.stack([_apart(y) for y in self.beside.modes(a)])
        angle = float(angle_at(self.scene, steps, self.scene.solver.time_step))
        q, rate = ring_amplitudes(self.model, both, np.array([angle, angle]))
        return q, rate

    def _set_rotor(self, state: CyclicState, q: Floats, rate: Floats) -> Floats:
        """Write a motion of the rotor at time 0; return its modes a step earlier."""
        if self.driven:
            self.diameters = list(self.driven.diameters)
            mu, slots = friction_with_sign(self.scene), widths(self.model.blades)[0]
            self.rotor = turning(self.diameters, slots, mu, ())
        if self.own is not None:
            shape = self.rotor.rows // 2, 2, self.rotor.there.shape[1]
            parts = (rotor_slots(self.model, x).reshape(shape) for x in (q, rate))
            y, v = (x[:, 0] + 1j * x[:, 1] for x in parts)
            a = self.own.amplitudes(y, v)
            self._lay(state, self.at.rotor_at, self.rotor, a)
            return rotor_amplitudes(self.model, _flat(self.own.before(a)))
        stand = self.arrays.rotor.support.stand
        if len(stand.hub):
            rate = rate - included_in(stand, q, rate)
        if self.driven:
            rate = rate - self._stood(self.driven, q, rate)
        a, before = np.zeros(self.rotor.there.shape, dtype=complex), []
        for own in self.diameters:
            parts = (modes_of(self.model, own.k, x) for x in (q, rate))
            w = own.motion.write(*parts)
            a[: len(w), own.k] = w
            before.append(own.shapes @ (w * own.before))
        there = self._table(state, self.at.rotor_at, self.rotor)
        orbits = len(a) - len(self.steady)
        a[orbits:] = there[orbits:]
        self._lay(state, self.at.rotor_at, self.rotor, a)
        return modal_places(self.model, self.diameters, before)

    def set_seen(self, state: CyclicState) -> None:
        """Set the rotor's spectra of the last steps from its amplitudes."""
        a = self._table(state, self.at.rotor_at, self.rotor)
        if self.scene.solver.flies:
            return
        k, step = a.shape[1], int(state.counter[contact.STEP])
        seen = state.rotor[-SEEN * 2 * k :].reshape(SEEN, 2, k)
        for back in range(SEEN):
            spectrum = (self.rotor.radial * a).sum(axis=0)
            seen[(step - back) % SEEN] = spectrum.real, spectrum.imag
            a = a / (1 + self.rotor.ahead)

    def balance(self, state: CyclicState) -> Balance:
        """Return energies, losses and works in a state, which complete the ledger."""
        rows, step = self.arrays.rotor.rows, self.scene.solver.time_step
        energy = sum(energies_of_slots(rows, state.rotor))
        rotation, impact, drag = works_of_slots(rows, state.sums_b, step)
        drag, given = drag * friction_with_sign(self.scene), float(state.sums_c[0])
        turned = 0.0
        if self.driven:
            turned = float(state.sums_c[TURNING]) + self._held_by(state)[1]
        loss = rotation - impact + drag + given + turned - energy
        return Balance(energy, loss, rotation, drag, impact, turned)

    def motion(self, state: CyclicState, steps: int) -> Motion:
        """Return displacements and velocities of rotor and casing in a given state.

        steps : number of time steps taken so far, from which the angle of the rotor
            follows
        """
        now = *self._rotor_motion(state, steps), *self._ring_motion(state, steps)
        return unfold(self.model, Amplitudes(*now))

    def begin(self, motion: Motion) -> bool:
        """Start from a given motion; return whether the state can represent it."""
        model, scene, state = self.model, self.scene, self.state
        now = amplitudes(model, motion)
        if now is None:
            return False
        nothing_booked(state, exact=scene.solver.flies)
        own, rise = self._begun
        if self.driven:
            own, rise = self._steady_start()
            self.driven.put_beside(state.rotor, own, rise)
        before = self._set_rotor(state, now.rotor - own, now.rotor_rate - rise)
        casing = self._set_ring(state, now.casing, now.casing_rate)
        self.set_seen(state)
        past = [orbit.amplitude / (1 + orbit.ahead) for orbit in self.steady]
        own = own if self.driven else self._orbit(np.array(past))[0]
        then = now._replace(rotor=before + own, casing=casing)
        write_gaps(state, model, scene, now, then)
        energy = self.balance(state).energy
        state.ledger[contact.PULSE] = state.sums_c[0] = energy
        if self.driven:
            state.sums_c[TURNING] = -self._held_by(state)[1]
        self.moves = True
        return True

    def _set_ring(self, state: CyclicState, q: Floats, rate: Floats) -> Floats:
        if self.beside is None:
            return q
        rows = self.beside.waves.rows // 2
        parts = (ring_slots(self.model, x, rows) for x in (q, rate))
        y, v = (
            x.reshape(2, rows, -1)[0] + 1j * x.reshape(2, rows, -1)[1] for x in parts
        )
        a = self.beside.amplitudes(y, v)
        past = self.beside.before(a)
        self._lay(state, self.at.ring_at, self.beside.waves, a)
        before: Floats = ring_amplitudes(self.model, _apart(past)[None], np.zeros(1))[0]
        return before

    def _put_on_circle(self) -> None:
        """Set the state so that an unbalanced rotor starts on its orbit.

        If the run must start on a smaller one, the other waves begin with the
        difference, at rest. Their energy is entered in the ledger as work of the
        loading.
        """
        share, state = share_at_start(self.model, self.scene), self.state
        a = np.zeros(self.rotor.there.shape, dtype=complex)
        a[len(a) - len(self.steady) :, 1] = [orbit.amplitude for orbit in self.steady]
        self._lay(state, self.at.rotor_at, self.rotor, a)
        self._set_rotor(state, *((share - 1.0) * part for part in self._begun))
        self.set_seen(state)
        if share < 1.0:
            state.sums_c[0] = state.ledger[contact.PULSE] = self.balance(state).energy

    def release(self, state: CyclicState, shape: HeldShape, steps: int) -> None:
        """Let go of a casing held in a shape: add the shape to a state's motion."""
        body = self.model.casing
        if body is None or self.beside is None:
            raise TypeError(body)
        q = shape.amplitudes(body.omega, self.model.shapes[1])
        angle = float(angle_at(self.scene, steps, self.scene.solver.time_step))
        other = state._replace(rotor=np.zeros_like(state.rotor))
        self._set_ring(other, ring_turned(self.model, q, angle), np.zeros_like(q))
        before = self.balance(state).energy
        state.rotor[:] += other.rotor
        state.sums_c[0] += self.balance(state).energy - before

    def refresh(self, state: CyclicState | None, now: Interval) -> None:
        """Change the coefficients to those of a new interval of the speed.

        They are those of the casing; of the rotor, if it has terms of rotation.

        state, now : as for `Integrator.refresh`
        """
        rows = self.arrays.rotor.rows
        self._turn(self.model, self.scene, rows, self.model.folds * now.turn)
        if self.driven:
            self._drive(self.driven, state, Pace(now.speed, now.rate))

    def _drive(
        self, driven: DrivenSlots, state: CyclicState | None, pace: Pace
    ) -> None:
        """Change the rotor's waves to those of an interval; convert a state."""
        before, turned = self._held_by(state) if state else (0.0, 0.0)
        if pace != driven.pace:
            old = driven.waves
            driven.turn(pace)
            self._put_waves(driven)
            if state is not None:
                driven.convert(state.rotor, old)
        if state is None:
            return
        if state.counter[contact.STEP] == 0 and not self.moves:
            self._set_out(driven, state)
            before, turned = 0.0, 0.0
        energy, form = self._held_by(state)
        state.ledger[contact.PULSE] += energy - before
        state.sums_c[0] += energy - before
        state.sums_c[TURNING] += turned - form

    def _held_by(self, state: CyclicState) -> tuple[float, float]:
        """Return energy, and the form `SlotDrive.turning`, of a state, J."""
        rotor = self.arrays.rotor
        form = turning_of_slots(rotor.rows, rotor.drive, state.rotor)
        return sum(energies_of_slots(rotor.rows, state.rotor)), form

    def _put_waves(self, driven: DrivenSlots) -> None:
        """Write the coefficients of the rotor's waves of an interval."""
        rotor, contacts = self.arrays.rotor, self.arrays.contact
        contacts.column[:] = driven.put_rows()
        if len(contacts.slides.rows) or len(contacts.slides.at):
            made = self._slides(self.model, self.scene)
            for name in ("rows", "fixed", "swirl", "swirls", "aside"):
                getattr(contacts.slides, name)[:] = getattr(made, name)
            contacts.slides.law.rotor[:] = made.law.rotor
        drive = driven.drive()
        for name in drive._fields[FIXED_PLACES:-1]:
            getattr(rotor.drive, name)[:] = getattr(drive, name)
        for name in HELD:  # its other fields are the same, or changed in place
            getattr(rotor.drive.held, name)[:] = getattr(drive.held, name)
        rotor.hub[:] = _with(driven, drive)[1]
        if contacts.rods.w.size:
            contacts.rods.w[:] = circulant(contacts.column)
        for space in self._made:
            renew(space.solver, self.model.blades, contacts.column)

    def _steady_start(self) -> tuple[Floats, Floats]:
        """Return the steady motion of the first speed at time 0, modes (m,) each."""
        body, given = self.model.rotor, (self.model, self.scene, 0.0)
        lower = body.shapes.T @ body.mass
        return lower @ steady_at(*given), lower @ steady_rates(*given)

    def _stood(self, driven: DrivenSlots, q: Floats, rate: Floats) -> Floats:
        """Return what supports add to velocities of a motion by contact at time 0.

        q, rate : (m,), that motion, beside the steady one
        """
        if not len(driven.stand.hub):
            return 0.0 * rate
        still, moving = self._steady_start()
        whole = included_in(driven.stand, still + q, moving + rate)
        return whole - included_in(driven.stand, still, moving)

    def _set_out(self, driven: DrivenSlots, state: CyclicState) -> None:
        """Set a run that starts at rest, with the steady motion of the first speed."""
        body, less = self.model.rotor, missing_at_start(self.model, self.scene)
        lower = body.shapes.T @ body.mass
        driven.put_beside(state.rotor, *self._steady_start())
        self._set_rotor(state, *(lower @ part for part in less))
        self.set_seen(state)
        state.ledger[contact.PULSE] = state.sums_c[0] = state.sums_c[TURNING] = 0.0

    def free(self) -> FreeMotion | None:
        """Return the waves in free motion; None if supports exert forces at the centre.

        Such supports differ by direction or have a film: waves of the rotor without
        them do not move by factors.
        """
        if len(self.arrays.rotor.support.reads):
            return None
        return free_slots(
            (self.rotor, self.ring), self.at, self.arrays.rotor, self.model.blades,
            self.set_seen,
        )  # fmt: skip

    def _static(self, copies: Floats, stride: int) -> Floats:
        if not len(copies):
            return copies
        steps = stride * np.arange(1.0, len(copies) + 1)
        angles = np.asarray(angle_at(self.scene, steps, self.scene.solver.time_step))
        modes, slots = ring_modes(self.model), widths(self.model.blades)[0]
        rows = 1 + max(mode.row for mode in modes)
        laid = np.zeros((len(copies), 2, rows, slots))
        for c, mode in enumerate(modes):
            laid[:, :, mode.row, mode.slot] = copies[:, 2 * c : 2 * c + 2]
        return ring_amplitudes(self.model, laid.reshape(len(copies), -1), angles)


def _contact(
    model: Model, scene: Scene, column: Floats, slides: SlotSlides
) -> SlotContact:
    """Return the constants of contact.

    column, slides : (N,), m/N, of the Delassus matrix; set-valued friction
    """
    w = circulant(column) if wears(scene) else np.zeros((0, 0))
    return SlotContact(column, rods_under(model, scene, w), slides)


def _put(table: Floats, at: Integers, values: Complexes) -> None:
    """Write complex coefficients to a packed table; at : indices of re."""
    table[at], table[at + FOUR] = values.real, values.imag


def _two_parts(one: Complexes) -> Floats:
    """Return re and im of coefficients of waves in pairs, and of their conjugates."""
    both = np.stack([one, one.conj()], axis=1).ravel()
    return np.column_stack([both.real, both.imag])


def _flat(y: Complexes) -> Floats:
    return np.stack([y.real, y.imag], axis=1).ravel()


def _apart(y: Complexes) -> Floats:
    return np.stack([y.real, y.imag]).ravel()
