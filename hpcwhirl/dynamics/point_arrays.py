"""Constant arrays of the kernel `points`, from the waves of both bodies.

Tips have several contact points each; rotor and casing are waves, see `point_waves`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from hpcwhirl.arrays import Complexes, Floats, Integers
from hpcwhirl.dynamics.casing import wall_of
from hpcwhirl.dynamics.kernels.circulant import folded
from hpcwhirl.dynamics.kernels.cyclic import widths
from hpcwhirl.dynamics.kernels.kernel_types import Arrays, Load
from hpcwhirl.dynamics.kernels.vectors import all_aligned
from hpcwhirl.dynamics.kernels.wave_types import (
    PointRows,
    PointsContact,
    PointsRotor,
    SectorRows,
)
from hpcwhirl.dynamics.operators import friction_with_sign, pulse_load
from hpcwhirl.dynamics.point_sectors import (
    FEWEST,
    SAME,
    BladeRows,
    diameters_of,
    sector_rows,
    slots_of,
)
from hpcwhirl.dynamics.point_waves import PointWaves, real_rows
from hpcwhirl.dynamics.slots import ring_modes
from hpcwhirl.dynamics.whole_waves import drift_of, padded_blades
from hpcwhirl.reduction.bodies import centre_rows
from hpcwhirl.reduction.model import Model
from hpcwhirl.scene import Scene
from hpcwhirl.structure import FourierOperator


def _rows_of_casing(model: Model, angle: float) -> tuple[Floats, Floats]:
    """Return the casing's radial and tangential displacements w, u at contact points.

    They are (points, m) each, for unit amplitudes of its m modes; of a rigid casing
    (points, 0).

    angle : rad, of blade 0
    """
    if model.casing is None or not isinstance(model.ring, FourierOperator):
        none = np.zeros((model.contacts, 0))
        return none, none
    rows = model.ring.rows(angle + model.angles, model.stations)
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
class _Reads:
    """Factors between amplitudes of waves, motion of contact points, and forces.

    There are P contact points and m modes of a body. Motions are from step n - 1 to
    n + 1, see `kernels.points`.

    Attributes
    ----------
    waves : waves of both bodies
    out, side : (P, m), for unit modes of the rotor: change of the gaps, and motion of
        the casing relative to the tip along the rotation
    w, u : (P, m), for unit modes of the casing: its radial displacement w, which is the
        change of the gaps, and its displacement u along the rotation
    past : (P, m), w at the angles that the points had two steps before
    forces : (m, P + 2) of each body: modal forces of unit multipliers with friction,
        and of the pulse's cos and sin
    friction : mu, with the sign of the speed
    """

    waves: PointWaves
    out: Floats
    side: Floats
    w: Floats
    u: Floats
    past: Floats
    forces: tuple[Floats, Floats]
    friction: float

    def read(self, rotor: Floats, casing: Floats) -> Complexes:
        """Return r displacements for unit amplitudes of the waves, (r, waves).

        rotor, casing : (r, m) each, the displacements for unit amplitudes of the modes
        """
        b, c = self.waves.rotor, self.waves.casing
        return np.hstack([rotor @ b.shapes, casing @ c.shapes])

    def moved(self, rotor: Floats, casing: Floats) -> Complexes:
        """Return how r displacements change from step n - 1 to n + 1, (r, waves).

        The change is for free motion (without contact forces) that has a unit amplitude
        at step n + 1, and for fixed points of the bodies: the turn of the frame is left
        out. The works of contact forces need it.

        rotor, casing : (r, m) each, the displacements for unit amplitudes of the modes
        """
        b, c = self.waves.rotor, self.waves.casing
        return np.hstack([rotor @ b.moves, casing @ c.moves])

    def change(self, rotor: Floats, casing: Floats) -> Floats:
        """Return the change of r displacements in a step by unit forces, (r, P + 2).

        The forces are the multipliers with their friction, and the pulse's cos and sin.

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
        points = len(self.out)
        extra = padded_blades(points + 2) - points - 2
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
        b, c = self.waves.rotor, self.waves.casing
        return np.hstack(
            [self.out @ (b.shapes - b.moves), self.past @ (c.shapes - c.moves)]
        )

    def push(self) -> Complexes:
        """Return the change of the waves' amplitudes by unit forces, (P + 2, waves).

        The forces are the multipliers with their friction, and the pulse's cos and sin.
        """
        bodies = self.waves.rotor, self.waves.casing
        given = (b.gives @ f for b, f in zip(bodies, self.forces, strict=True))
        return np.hstack([one.T for one in given])

    def ahead(self) -> tuple[Floats, Floats, Floats]:
        """Return the step's factors z - 1 of all waves, and two bounds of gaps' motion.

        z - 1 is re, then im, (2 half,). The bounds hold for the motion of any gap in a
        step: per unit amplitude, (half,), and per unit multiplier, (P,).
        """
        waves = self.waves
        turned = np.append(waves.rotor.ahead, waves.casing.ahead)
        most = drift_of(self.read(self.out, self.w), turned)
        ahead, drift = (np.zeros(waves.half, dtype=t) for t in (complex, float))
        ahead[waves.index], drift[waves.index] = turned, most
        rush = np.abs(self.push()[: len(self.out)]) @ most
        return np.append(ahead.real, ahead.imag), drift, rush

    def rows(self) -> PointRows:
        """Return the kernel's coefficients for unequal sectors, a row a point."""
        points = len(self.out)
        rows = (
            self.waves.spread(self.read(self.out, self.w)),
            self.waves.spread(self.before()),
            self.waves.spread(self.push()[:points].conj()),
            self.long(self.out, self.w), self.long(self.side, self.u),
        )  # fmt: skip
        return PointRows._make(all_aligned([np.ravel(array) for array in rows]))

    def by_slots(self, blades: int) -> tuple[_Reads, SectorRows] | None:
        """Return a copy with waves by nodal diameter, and the kernel's coefficients.

        They are those for equal sectors. The result is None if the sectors are unequal,
        or fewer than `FEWEST`. Waves of nodal diameter below 0 are replaced by their
        conjugates.
        """
        if blades < FEWEST:
            return None
        points, both = len(self.out), self._told()
        back = diameters_of(both, blades) < 0
        own, beside = np.split(back, [len(self.waves.rotor.ahead)])
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
            turned.read(self.out, self.w)[:each],
            turned.read(self.side, self.u)[:each],
            turned.before()[:each], push[:each], move, self.friction,
        )  # fmt: skip
        slots = slots_of(blades, diameter, blade)
        first, second = np.split(diameter, [len(own)])
        placed = replace(
            waves,
            rotor=waves.rotor.apart(first),
            casing=waves.casing.apart(second),
            index=slots.index,
            size=slots.size,
        )
        numbers = self.numbers(self.out, self.w), self.numbers(self.side, self.u)
        rows = sector_rows(slots, blade, numbers)
        return replace(turned, waves=placed), rows

    def _told(self) -> Complexes:
        """Return gaps and tangential motion of all contact points for unit waves.

        The motion is that of the casing relative to the tip along the rotation. They
        are (2 P, waves), two rows for each point.
        """
        both = [
            self.read(rotor, casing)
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
        return np.concatenate(out)


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


def point_arrays(
    model: Model, scene: Scene, waves: PointWaves
) -> tuple[Arrays, PointWaves]:
    """Return the arrays of `kernels.points.march_points`, and the waves they use.

    waves : waves of both bodies; for equal sectors the result has them by nodal
        diameter
    """
    mu, hub = friction_with_sign(scene), centre_rows(model.rotor, model.blades)
    out, side = (-rows for rows in waves.rows)
    w, u = _rows_of_casing(model, 0.0)
    past, _ = _rows_of_casing(model, -2.0 * scene.speed * scene.solver.time_step)
    kick, still = _pulse_rows(model, scene), np.zeros_like(w)
    none = np.zeros((2, out.shape[1]))
    forces = np.vstack([out + mu * side, none]).T, np.vstack([w + mu * u, kick]).T
    own = _Reads(waves, out, side, w, u, past, forces, mu)
    found = own.by_slots(model.blades)
    own, rows = (own, own.rows()) if found is None else found
    waves, points = own.waves, model.contacts
    reach, shapes = np.zeros(waves.half), waves.rotor.shapes
    farthest = (np.abs(rows @ shapes).max(axis=0) for rows in (out, side))
    reach[waves.index[: shapes.shape[1]]] = np.hypot(*farthest)
    steps = own.ahead()
    spread = waves.spread
    flat = (
        *steps, spread(own.push()[points:].conj()), own.long(none, kick),
        spread(own.read(-out, still)), spread(own.read(-side, still)),
        spread(own.read(hub, still[:2])), reach,
    )  # fmt: skip
    first, second, third, *rest = all_aligned([np.ravel(array) for array in flat])
    rotor = PointsRotor._make(
        [first, second, third, rows, *rest, *_entries(waves), *_casing_entries(waves)]
    )
    w_of_both = np.ascontiguousarray(own.change(out, w)[:, :points])
    loading = Load(scene.force, scene.pulse, kick[0])
    return Arrays(loading, rotor, (), _contact(model, scene, w_of_both)), waves


def _contact(model: Model, scene: Scene, compliance: Floats) -> PointsContact:
    chosen = folded(model.contacts, widths(model.contacts)[1])
    orders = wall_of(model, scene).orders
    phases = np.multiply.outer(orders, model.angles[chosen])
    waves = np.stack([np.cos(phases), np.sin(phases)], axis=1)
    return PointsContact(
        compliance, *all_aligned([model.clearances(0.0)[chosen], waves.ravel()])
    )


def _entries(waves: PointWaves) -> tuple[Integers, Floats, int]:
    """Return the energy of both bodies as a sum of products of two amplitudes.

    The results are the indices of the pairs of amplitudes, (p, 2), their coefficients,
    (p,), J, and the number of those of the rotor, which come first. Products with
    coefficient 0 are left out.

    waves : waves of both bodies
    """
    pairs, values, count = [], [], []
    for place, body in zip(waves.places(), (waves.rotor, waves.casing), strict=True):
        upper = np.triu(body.form) + np.triu(body.form, 1)
        rows, columns = np.nonzero(upper)
        pairs.append(np.column_stack([place[rows], place[columns]]))
        values.append(upper[rows, columns])
        count.append(len(rows))
    return np.vstack(pairs).astype(np.int64), np.concatenate(values), count[0]


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
