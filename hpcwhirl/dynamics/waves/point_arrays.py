"""Constant arrays of the kernel `points`, from the waves of both bodies.

Tips have one or several contact points each; rotor and casing are waves, see
`point_waves`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.sparse.csgraph import connected_components

from hpcwhirl.arrays import Complexes, Floats, Integers
from hpcwhirl.dynamics.bodies.operators import (
    NO_SLIDES,
    coulomb_law,
    friction_with_sign,
    rods_under,
)
from hpcwhirl.dynamics.bodies.pulse import pulse_load
from hpcwhirl.dynamics.bodies.turning import unlike_rows
from hpcwhirl.dynamics.kernels.contact import NOWHERE
from hpcwhirl.dynamics.kernels.kernel_types import Arrays, Load
from hpcwhirl.dynamics.kernels.loop.circulant import folded
from hpcwhirl.dynamics.kernels.loop.wave_types import (
    PointRows,
    PointsContact,
    PointsEnergy,
    PointSlides,
    PointsRotor,
    SectorRows,
)
from hpcwhirl.dynamics.kernels.vectors import FOUR, ROW, all_aligned, widths
from hpcwhirl.dynamics.waves.casing import wall_of
from hpcwhirl.dynamics.waves.point_sectors import (
    FEWEST,
    SAME,
    BladeRows,
    Slots,
    diameters_of,
    sector_rows,
    slots_of,
)
from hpcwhirl.dynamics.waves.point_supports import support_arrays
from hpcwhirl.dynamics.waves.point_waves import PointWaves, has_sectors, real_rows
from hpcwhirl.dynamics.waves.slots import ring_modes
from hpcwhirl.dynamics.waves.whole_waves import drift_of, padded_blades
from hpcwhirl.errors import ModelError
from hpcwhirl.reduction.bodies import centre_rows
from hpcwhirl.reduction.model import Model
from hpcwhirl.scene import Scene
from hpcwhirl.scene.contact_laws import PERMANENT
from hpcwhirl.scene.rules import NO_BLADE
from hpcwhirl.structure import FourierOperator


def _rows_of_casing(model: Model) -> tuple[Floats, Floats]:
    """Return the casing's radial and tangential displacements w, u at contact points.

    They are (points, m) each, for unit amplitudes of its m modes; of a rigid casing
    (points, 0). Blade 0 is at angle 0.
    """
    if model.casing is None or not isinstance(model.ring, FourierOperator):
        none = np.zeros((model.contacts, 0))
        return none, none
    rows = model.ring.rows(model.angles, model.stations)
    w, u = (row @ model.casing.shapes for row in rows)
    return w, u


def _pulse_rows(model: Model, scene: Scene) -> Floats:
    """Return modal forces (2, m) of unit loads on the casing, as the pulse's lobes.

    The two loads, cos k theta and sin k theta, give one at any angle of the rotor.
    """
    if model.casing is None:
        return np.zeros((2, 0))
    rows = np.zeros((2, len(model.casing.omega)))
    rows[0] = pulse_load(model, scene) @ model.casing.shapes
    for mode in ring_modes(model):
        if len(mode.members) == 2:
            one, other = mode.members
            rows[1, other] = rows[0, one]
    return rows


@dataclass(frozen=True)
class Reads:
    """Factors between amplitudes of waves, motion of contact points, and forces.

    There are P contact points and m modes of a body. Motions are from step n - 1 to
    n + 1, see `kernels.loop.points`.

    Attributes
    ----------
    waves : waves of both bodies
    out, side : (P, m), for unit modes of the rotor: change of the gaps, and motion of
        the casing relative to the tip along the rotation
    w, u : (P, m), for unit modes of the casing: its radial displacement w, which is the
        change of the gaps, and its displacement u along the rotation
    turn : rad, by which the rotor turns in a step
    hub : (2, m), x_o, y_o for unit modes of the rotor
    held : (2 s, m), x, y of each support of `standing` for unit modes of the rotor
    forces : (m, P + F) of each body: modal forces of unit multipliers with friction, of
        the pulse's cos and sin, of a force on each of s supports, x and y, and with
        set-valued friction of a force along theta on each point
    friction : mu, with the sign of the speed
    slots : where the kernel has the waves of equal sectors; None: of unequal ones
    """

    waves: PointWaves
    out: Floats
    side: Floats
    w: Floats
    u: Floats
    turn: float
    hub: Floats
    held: Floats
    forces: tuple[Floats, Floats]
    friction: float
    slots: Slots | None = None

    def by_waves(self, rotor: Floats, casing: Floats) -> Complexes:
        """Return r displacements for unit amplitudes of the waves, (r, waves).

        rotor, casing : (r, m) each, the displacements for unit amplitudes of the modes
        """
        b, c = self.waves.rotor, self.waves.casing
        steady = rotor @ self.waves.steady.shapes
        return np.hstack([rotor @ b.shapes, casing @ c.shapes, steady])

    def at_centre(self) -> Complexes:
        """Return x_o and y_o for unit amplitudes of the waves, (2, waves)."""
        return self.by_waves(self.hub, np.zeros((2, self.w.shape[1])))

    def moved(self, rotor: Floats, casing: Floats) -> Complexes:
        """Return how r displacements change from step n - 1 to n + 1, (r, waves).

        The change is for free motion (without contact forces) that has a unit amplitude
        at step n + 1, and for fixed points of the bodies: the turn of the frame is left
        out. The works of contact forces need it, which are those on the motion that
        contact causes: the steady motion of an unbalanced rotor has no part in them.

        rotor, casing : (r, m) each, the displacements for unit amplitudes of the modes
        """
        b, c = self.waves.rotor, self.waves.casing
        none = np.zeros((len(rotor), len(self.waves.steady.ahead)))
        return np.hstack([rotor @ b.moves, casing @ c.moves, none])

    def change(self, rotor: Floats, casing: Floats) -> Floats:
        """Return the change of r displacements in a step by unit forces, (r, P + F).

        The forces are the multipliers with their friction, and F others, see `forces`.

        rotor, casing : (r, m) each, the displacements for unit amplitudes of the modes
        """
        b, c = self.waves.rotor, self.waves.casing
        return np.asarray(
            rotor @ b.give @ self.forces[0] + casing @ c.give @ self.forces[1]
        )

    def numbers(self, rotor: Floats, casing: Floats) -> Floats:
        """Return the change of r displacements in a step by unit forces, (r, padded).

        It is `change` with columns of 0 appended, as the kernel needs it. Forces change
        a motion over two steps by the same amount as a displacement.

        rotor, casing : (r, m) each, the displacements for unit amplitudes of the modes
        """
        forces = self.forces[0].shape[1]
        extra = padded_blades(forces) - forces
        return np.pad(self.change(rotor, casing), ((0, 0), (0, extra)))

    def long(self, rotor: Floats, casing: Floats) -> Floats:
        """Return changes of r displacements over two steps, for unit waves and forces.

        They are those of the bodies' material, (r, width): for unit real and imaginary
        parts of the amplitudes, then for unit forces, with padding.

        rotor, casing : (r, m) each, the displacements for unit amplitudes of the modes
        """
        moved = self.waves.spread(self.moved(rotor, casing))
        return np.hstack([moved, self.numbers(rotor, casing)])

    def before(self) -> Complexes:
        """Return the gaps at step n - 1 for unit waves at step n + 1, (P, waves).

        The motion between is free; the points are at the casing's angle of step n - 1.
        """
        b, steady = self.waves.rotor, self.waves.steady
        return np.hstack([
            self.out @ (b.shapes - b.moves),
            self.stood * np.exp(-2j * self.turn * self.waves.casing.spins),
            self.out @ steady.past,
        ])  # fmt: skip

    @cached_property
    def stood(self) -> Complexes:
        """Casing's part of the gaps at step n - 1, (P, waves of the casing).

        It is that for unit amplitudes at step n + 1, at the points' angles of that
        step. A wave of spin h is e^{i h theta} along the circumference.
        """
        casing = self.waves.casing
        return np.asarray(self.w @ (casing.shapes - casing.moves))

    def flat_before(self) -> Floats:
        """Return `before` as the kernel has it, flat: by point, or by slot."""
        before = self.before()
        if self.slots is None:
            return self.waves.spread(before).ravel()
        each = len(before) // self.slots.blades
        return self.slots.laid(before[:each], self.slots.single + 2 * self.slots.pairs)

    def flat_turned(self) -> Floats:
        """Return how the turn of the frame in two steps changes gaps, for the kernel.

        See `PointRows.turned`; the casing and the steady motion have the first waves.
        """
        casing, steady = self.waves.casing, self.waves.steady
        own, beside = self.waves.apart[0], len(steady.ahead)
        rows = np.hstack([
            self.stood * np.expm1(-2j * self.turn * casing.spins),
            self.out @ (steady.past - steady.shapes),
        ])  # fmt: skip
        first = len(casing.ahead) + beside
        if len(own) and own.min() < first:
            msg = "the casing's amplitudes must come first"
            raise ModelError(msg)
        wide = np.zeros((len(rows), 2, _padded(first)))
        wide[:, 0, :first], wide[:, 1, :first] = rows.real, -rows.imag
        return wide.ravel()

    def push(self) -> Complexes:
        """Return the change of the waves' amplitudes by unit forces, (P + F, waves).

        The forces are the multipliers with their friction, and F others, see `forces`.
        """
        bodies = self.waves.rotor, self.waves.casing
        given = [b.gives @ f for b, f in zip(bodies, self.forces, strict=True)]
        none = np.zeros((len(self.waves.steady.ahead), given[0].shape[1]))
        return np.vstack([*given, none]).T

    def ahead(self) -> tuple[Floats, Floats, Floats]:
        """Return the step's factors z - 1 of all waves, and two bounds of gaps' motion.

        z - 1 is re, then im, (2 half,). The bounds hold for the motion of any gap in a
        step: per unit amplitude, (half,), and per unit force, (P + F,).
        """
        waves = self.waves
        bodies = waves.rotor, waves.casing, waves.steady
        turned = np.concatenate([body.ahead for body in bodies])
        most = drift_of(self.by_waves(self.out, self.w), turned)
        ahead, drift = (np.zeros(waves.half, dtype=t) for t in (complex, float))
        ahead[waves.index], drift[waves.index] = turned, most
        rush = np.abs(self.push()) @ most
        return np.append(ahead.real, ahead.imag), drift, rush

    def bounds(self) -> Floats:
        """Return bounds of motion of points by unit forces of supports, (2, 2 s).

        In m/N: of the motion in the step in which the forces act, and of what they add
        to the motion in any later step.
        """
        first = len(self.out) + 2
        theirs = slice(first, first + len(self.held))
        moved = self.change(self.out, self.w)[:, theirs]
        return np.stack([np.abs(moved).max(axis=0), self.ahead()[2][theirs]])

    def slides(self, scene: Scene) -> PointSlides:
        """Return the kernel's coefficients of set-valued friction."""
        points = len(self.out)
        places, shape = np.zeros((points, 0), np.int64), np.zeros((points, 0))
        step, none = scene.solver.time_step, np.zeros(0)
        b, c, steady = self.waves.rotor, self.waves.casing, self.waves.steady
        circled = steady.shapes * (steady.ahead / (1 + steady.ahead))
        still = 0.0 * self.side @ b.shapes, 0.0 * self.u @ c.shapes
        both = self.side @ (circled * (1 + 1 / (1 + steady.ahead)))
        aside = self.waves.spread(np.hstack([*still, both]))[: both.any() * points]
        if scene.slip == PERMANENT:
            arrays = (none,) * 4 + tuple(all_aligned([aside.ravel()]))
            return PointSlides(NO_SLIDES, step, places, shape, *arrays)
        own, past = (
            self.waves.spread(np.hstack([self.side @ x, self.u @ y, self.side @ z]))
            for x, y, z in (
                (b.rises, c.rises, circled),
                (b.moves - b.rises, c.moves - c.rises, circled / (1 + steady.ahead)),
            )
        )
        drag = self.waves.spread(self.push()[-points:].conj())
        rotor, ring = np.vstack([self.out, self.side]), np.vstack([self.w, self.u])
        law = rotor @ b.give @ rotor.T + ring @ c.give @ ring.T
        flat = own, past, drag, self.ahead()[2][-points:], aside
        made = all_aligned([np.ravel(array) for array in flat])
        return PointSlides(coulomb_law(scene, law.T), step, places, shape, *made)

    def rows(self) -> PointRows:
        """Return the kernel's coefficients for unequal sectors, a row a point.

        The rows that give the gaps end with the last amplitude that moves a point.
        """
        spread, out, side = self.waves.spread, self.out, self.side
        both = (self.by_waves(rotor, c) for rotor, c in ((out, self.w), (side, self.u)))
        read, slide = map(spread, both)
        last = int(np.flatnonzero(read.any(axis=0) | slide.any(axis=0)).max(initial=0))
        size, apart = max(_padded(last + 1), self.waves.half), self._apart()
        push = spread(self.push()[: len(out)].conj())
        slides, factors = self.long(side, self.u), (np.zeros(0),) * 2
        if apart is not None:
            push = (read + self.friction * slide)[:, :size]
            slides = np.hstack([slide[:, :size], self.numbers(side, self.u)])
            factors = apart
        rows = (
            read[:, :size], self.flat_before(), self.flat_turned(), push,
            self.long(out, self.w), slides, *factors,
        )  # fmt: skip
        return PointRows._make(all_aligned([np.ravel(array) for array in rows]))

    def _apart(self) -> tuple[Floats, Floats] | None:
        """Return `PointRows.moves` and `gives`; None where a wave has no such factors.

        With terms of rotation the modes of a wave move by different factors.
        """
        move = self._moves()
        if move is None:
            return None
        own = BladeRows(
            self.by_waves(self.out, self.w), self.by_waves(self.side, self.u),
            self.before(), self.push()[: len(self.out)], move, self.friction,
        )  # fmt: skip
        if not own.by_rows().all():
            return None
        both = []
        for values in (move, own.gives()):
            flat = np.zeros((2, self.waves.half))
            flat[:, self.waves.index] = values.real, values.imag
            both.append(flat.ravel())
        return both[0], both[1]

    def by_slots(self, blades: int, *, equal: bool) -> tuple[Reads, SectorRows] | None:
        """Return a copy with waves by nodal diameter, and the kernel's coefficients.

        They are those for equal sectors. The result is None if the sectors are unequal,
        or fewer than `FEWEST`. Waves of nodal diameter below 0 are replaced by their
        conjugates.

        blades : N
        equal : whether the sectors may be equal, see `point_waves.has_sectors`
        """
        if blades < FEWEST or not equal:
            return None
        points, both = len(self.out), self._told()
        back = diameters_of(both, blades) < 0
        bodies = self.waves.rotor, self.waves.casing
        ends = np.cumsum([len(body.ahead) for body in bodies])
        own, beside, _ = np.split(back, ends)
        waves = replace(
            self.waves,
            rotor=self.waves.rotor.conjugated(own),
            casing=self.waves.casing.conjugated(beside),
        )
        turned = replace(self, waves=waves)
        told, each = turned._told(), points // blades
        diameter, push = diameters_of(told, blades), turned.push()[:points]
        if not (
            _is_turned(told, diameter, blades) and _is_turned(push, -diameter, blades)
        ):
            return None
        move = turned._moves()
        if move is None:
            return None
        blade = BladeRows(
            turned.by_waves(self.out, self.w)[:each],
            turned.by_waves(self.side, self.u)[:each],
            turned.before()[:each], push[:each], move, self.friction,
        )  # fmt: skip
        slots = slots_of(blades, diameter, blade)
        first, second, _ = np.split(diameter, ends)
        placed = replace(
            waves,
            rotor=waves.rotor.apart(first),
            casing=waves.casing.apart(second),
            index=slots.index,
            size=slots.size,
        )
        rows = sector_rows(slots, blade, self.numbers(self.side, self.u))
        return replace(turned, waves=placed, slots=slots), rows

    def _told(self) -> Complexes:
        """Return gaps and tangential motion of all contact points for unit waves.

        The motion is that of the casing relative to the tip along the rotation. They
        are (2 P, waves), two rows for each point.
        """
        both = [
            self.by_waves(rotor, casing)
            for rotor, casing in ((self.out, self.w), (self.side, self.u))
        ]
        return np.stack(both, axis=1).reshape(2 * len(self.out), -1)

    def _moves(self) -> Complexes | None:
        """Return the factor of each wave by which it moves in two steps, (waves,).

        In free motion a wave multiplies its displacements by a complex factor in each
        step, and so the motion over two steps, x_n - x_{n-2}, is the displacement x_n
        times a factor. None if, for a wave, it is not the same for all modes at rest.
        """
        out = []
        for body in (self.waves.rotor, self.waves.casing):
            size = (np.abs(body.shapes) ** 2).sum(axis=0)
            factor = (body.shapes.conj() * body.moves).sum(axis=0)
            factor = factor / np.where(size > 0.0, size, 1.0)
            miss = np.abs(body.moves - factor * body.shapes).max(initial=0.0)
            if miss > SAME * np.abs(body.moves).max(initial=0.0):
                return None
            out.append(factor)
        return np.concatenate([*out, np.zeros(len(self.waves.steady.ahead))])


def _padded(size: int) -> int:
    return -(-size // ROW) * ROW


def _is_turned(rows: Complexes, diameter: Integers, blades: int) -> bool:
    """Return whether waves move the points of each blade like those of blade 0.

    The motion of blade j is that of blade 0 times e^{i n theta_j}, theta_j = 2 pi j / N
    its angle, as for equal sectors.

    rows : (blades c, waves), motion of the points, blade by blade, for unit amplitudes
    diameter : (waves,), nodal diameter n of each wave
    """
    each = rows.reshape(blades, -1, rows.shape[1])
    angle = 2 * np.pi * (np.outer(np.arange(blades), diameter) % blades) / blades
    miss = np.abs(each - each[:1] * np.exp(1j * angle)[:, None]).max(axis=(0, 1))
    return bool((miss <= SAME * np.abs(rows).max()).all())


def reads_of(model: Model, scene: Scene, waves: PointWaves) -> Reads:
    """Return the factors between amplitudes, motion of contact points, and forces.

    A lost blade moves no point, and no force on it moves the rotor.

    waves : waves of both bodies
    """
    mu, lost = friction_with_sign(scene), scene.engine.rotor.lost_blade
    out, side = (-rows for rows in waves.rows)
    if lost != NO_BLADE:
        out[lost] = side[lost] = 0.0
    w, u = _rows_of_casing(model)
    turn = scene.speed * scene.solver.time_step
    kick, hub = _pulse_rows(model, scene), centre_rows(model.rotor, model.blades)
    held = unlike_rows(model, model.rotor.shapes)
    none, still = np.zeros_like(hub), np.zeros((len(held), w.shape[1]))
    loose = len(out) * (scene.slip != PERMANENT)
    forces = (
        np.vstack([out + mu * side, none, held, side[:loose]]).T,
        np.vstack([w + mu * u, kick, still, u[:loose]]).T,
    )
    return Reads(waves, out, side, w, u, turn, hub, held, forces, mu)


def point_arrays(model: Model, scene: Scene, waves: PointWaves) -> tuple[Arrays, Reads]:
    """Return the arrays of `kernels.loop.points`, and what they are made of.

    waves : waves of both bodies; for equal sectors those of the result are by nodal
        diameter
    """
    own = reads_of(model, scene, waves)
    found = own.by_slots(model.blades, equal=has_sectors(model))
    own, rows = (own, own.rows()) if found is None else found
    waves, points = own.waves, model.contacts
    still, kick = np.zeros_like(own.w), _pulse_rows(model, scene)
    none, reach = np.zeros((2, own.out.shape[1])), np.zeros(waves.half)
    outward, along = (own.by_waves(-rows, still) for rows in (own.out, own.side))
    reach[waves.index] = np.hypot(np.abs(outward), np.abs(along)).max(axis=0)
    (steps, drift, rush), spread = own.ahead(), waves.spread
    flat = (
        steps, drift, rush[:points], spread(own.push()[points : points + 2].conj()),
        own.long(none, kick),
        spread(outward), spread(along), spread(own.at_centre()), reach,
    )  # fmt: skip
    first, second, third, *rest = all_aligned([np.ravel(array) for array in flat])
    rotor = PointsRotor._make([
        first, second, third, rows, *rest, _energy(waves), *_casing_entries(waves),
        support_arrays(model, scene, waves, own.held, own.bounds()),
    ])  # fmt: skip
    w_of_both = np.ascontiguousarray(own.change(own.out, own.w)[:, :points])
    loading = Load(scene.force, scene.pulse, kick[0])
    contact = _contact(model, scene, w_of_both, own.slides(scene))
    return Arrays(loading, rotor, (), contact), own


class TurningCasing:
    """The kernel's coefficients of a casing that turns by a changing angle in a step.

    Those of a rotor without terms of rotation do not depend on the speed.

    rotor, slides : the kernel's arrays, of which those of the casing are changed
    own : what they were made of
    """

    def __init__(self, rotor: PointsRotor, slides: PointSlides, own: Reads) -> None:
        waves = own.waves
        self.rotor, self.own, self.place = rotor, own, waves.apart[1]
        self.along = slides.rush
        size, points = len(waves.rotor.ahead), len(own.out)
        mine = slice(size, size + len(self.place))
        self.stood = own.stood
        self.gaps = own.by_waves(own.out, own.w)[:, mine]
        self.pushed = np.abs(own.push()[:points, mine])
        self.rush = rotor.rush - self.pushed @ rotor.drift[self.place]
        self.dragged = np.abs(own.push()[-points:, mine])[: len(slides.rush)]
        self.rest = self.along - self.dragged @ rotor.drift[self.place]

    def set(self, turn: float) -> None:
        """Set the coefficients to those of a turn in a step, rad."""
        rotor, place, half = self.rotor, self.place, self.own.waves.half
        ahead = self.own.waves.casing.turned(turn).ahead
        rotor.ahead[place], rotor.ahead[half + place] = ahead.real, ahead.imag
        rotor.drift[place] = drift_of(self.gaps, ahead)
        rotor.rush[:] = self.rush + self.pushed @ rotor.drift[place]
        self.along[:] = self.rest + self.dragged @ rotor.drift[place]
        rows, spins = rotor.rows, self.own.waves.casing.spins
        if not isinstance(rows, PointRows):
            rows.before[:] = replace(self.own, turn=turn).flat_before()
            return
        points, back = len(self.gaps), -2j * turn * spins
        for flat, factor in (
            (rows.before, np.exp(back)),
            (rows.turned, np.expm1(back)),
        ):
            parts, values = flat.reshape(points, 2, -1), self.stood * factor
            parts[:, 0, place], parts[:, 1, place] = values.real, -values.imag


def _contact(
    model: Model, scene: Scene, compliance: Floats, slides: PointSlides
) -> PointsContact:
    chosen = folded(model.contacts, widths(model.contacts)[1])
    orders = wall_of(model, scene).orders
    phases = np.multiply.outer(orders, model.angles[chosen])
    waves = np.stack([np.cos(phases), np.sin(phases)], axis=1)
    clear, lost = model.clearances(0.0), scene.engine.rotor.lost_blade
    if lost != NO_BLADE:
        clear[lost] = NOWHERE
    rods = rods_under(model, scene, compliance)
    aligned = all_aligned([clear[chosen], waves.ravel()])
    return PointsContact._make([compliance, *aligned, rods, slides])


def _energy(waves: PointWaves) -> PointsEnergy:
    """Return the energy of both bodies, in blocks of amplitudes that it couples.

    waves : waves of both bodies
    """
    sizes, which, form, count = [0], [], [], []
    for place, body in zip(waves.places(), (waves.rotor, waves.casing), strict=True):
        upper = np.triu(body.form) + np.triu(body.form, 1)
        for own in _coupled(upper):
            size = -(-len(own) // FOUR) * FOUR
            part = np.zeros((size, size))
            part[: len(own), : len(own)] = upper[np.ix_(own, own)]
            which.append(np.pad(place[own], (0, size - len(own))))
            form += [row[i - i % FOUR :] for i, row in enumerate(part)]
            sizes.append(size)
        count.append(len(which))
    none = np.zeros(0, np.int64)
    arrays = np.cumsum(sizes), np.concatenate([none, *which]).astype(np.int64)
    return PointsEnergy(*arrays, np.concatenate([np.zeros(0), *form]), count[0])


def _coupled(form: Floats) -> list[Integers]:
    """Return the sets of amplitudes, (n,) indices each, that a form's products couple.

    Those without a product are left out.
    """
    count, label = connected_components(form != 0.0, directed=False)
    used = np.flatnonzero((form != 0.0).any(axis=0) | (form != 0.0).any(axis=1))
    order = used[np.argsort(label[used], kind="stable")]
    parts = np.split(order, np.searchsorted(label[order], np.arange(1, count)))
    return [np.sort(part) for part in parts if len(part)]


def _casing_entries(waves: PointWaves) -> tuple[Integers, Floats]:
    """Return the two amplitudes of waves that give each of the casing's c modes.

    They are indices and factors, (c, 2) each.

    waves : waves of both bodies
    """
    rows, place = real_rows(waves.casing.shapes), waves.places()[1]
    index, shares = np.zeros((len(rows), 2), np.int64), np.zeros((len(rows), 2))
    for m, row in enumerate(rows):
        there = np.flatnonzero(row)
        index[m, : len(there)], shares[m, : len(there)] = place[there], row[there]
    return index, shares
