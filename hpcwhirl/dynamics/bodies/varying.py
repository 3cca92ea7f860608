"""A rotor at a changing speed: matrices of its coupled modes for any Omega.

M x'' + (D + 2 Omega C) x' + (K(Omega) + S) x = f - (dOmega/dt) C x + f_0, in blocks of
modes at rest, one for each nodal diameter. The run is divided into intervals
(`case.speed`), in which Omega is its mean. As the equation is linear, x = y + r. r is
the motion due to f_0, the forces of the unbalance, Euler's forces on the blades, the
weight and F_0 of bearings (`kernels.standing`); it begins with the steady motion at the
first speed, the circle of the unbalance and the sag. y is the motion due to contact. At
a constant speed r is that motion, and y the one about it, as in `case.unbalance`. Both
are integrated by the same scheme, see `kernels.oracle.body`, and stand on the same
supports, see `kernels.standing`.

From one interval to the next the motion is continuous, while the matrices of its energy
change: the change of the energy of y is entered as work of the loading.

K(Omega) = K_0 + Omega^2 K_1 + Omega^4 K_2 and C are stored by blocks once. For a new
interval only small systems are solved, those of equal size at once.
"""

from __future__ import annotations

import cmath
import itertools
import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.arrays import Floats, Integers
from hpcwhirl.case.speed import Interval, angle_at
from hpcwhirl.case.unbalance import weight_forces
from hpcwhirl.dynamics.bodies.motion import CentralSteps
from hpcwhirl.dynamics.bodies.turning import (
    added_by,
    by_diameter,
    drawn_loads,
    driven_standing,
    forces_at,
    included_in,
    set_standing,
    unlike_rows,
)
from hpcwhirl.dynamics.kernels.kernel_types import BodiesState, Body, Stand
from hpcwhirl.reduction.bodies import centre_rows, contact_rows
from hpcwhirl.reduction.model import Model
from hpcwhirl.reduction.supports import planar
from hpcwhirl.scene import Scene

LEAST = 1e-12  # share of the largest force on a mode below which others are round-off


@dataclass(frozen=True)
class Loads:
    """Forces f_0 on the m modes of a rotor that no contact causes, at any speed.

    Attributes
    ----------
    moment : kg m, of the unbalance, as x + i y
    hub : (2, m), x_o, y_o for unit amplitudes of the modes
    euler, released : (m,), forces of Euler by unit -dOmega/dt; of a lost blade by unit
        Omega^2
    weight : (2, m), of the weight, factors of cos and sin of the rotor's angle
    """

    moment: complex
    hub: Floats
    euler: Floats
    released: Floats
    weight: Floats

    def at(self, speed: float, rate: float) -> Floats:
        """Return f_0 without the weight, (m,), at a speed, rad/s, and rate, rad/s^2."""
        pull = (speed**2 - 1j * rate) * self.moment
        force = np.array([pull.real, pull.imag]) @ self.hub - rate * self.euler
        return np.asarray(force + speed**2 * self.released)

    def moves(self) -> NDArray[np.bool_]:
        """Return which modes these forces move, (m,), but by round-off."""
        own = self.euler[None], self.released[None], self.weight
        rows = abs(self.moment) * self.hub, *own
        sizes = np.abs(np.vstack(rows))
        least = LEAST * sizes.max(axis=1, keepdims=True)
        return np.asarray((sizes > least).any(axis=0))


def loads_of(model: Model, scene: Scene) -> Loads:
    """Return the forces on a rotor's modes at rest that no contact causes."""
    body, spin = model.rotor, model.rotor.terms
    none, loads = np.zeros(len(body.shapes)), (spin.swing, spin.released)
    euler, released = (
        body.shapes.T @ (none if load is None else load) for load in loads
    )
    moment = scene.unbalance * cmath.exp(1j * scene.unbalance_phase)
    weight = weight_forces(model, scene) @ body.shapes
    hub = centre_rows(body, model.blades)
    return Loads(moment, hub, euler, released, weight)


class _Group(NamedTuple):
    """Matrices of all those blocks of coupled modes that have the same size s.

    There are b such blocks, each for a nodal diameter; their systems are solved at
    once.

    Attributes
    ----------
    modes : (b, s), indices of the modes, sorted by nodal diameter
    moved : (b,), whether f_0, the force without contact, moves a block
    flat, again : (b, s, s), (c, s, s), indices in the kernel's arrays of the entries of
        all blocks, and of the second copies of the c blocks that f_0 moves
    mass, gyro, damping, rest, first, quartic : (b, s, s): M, 2 C, D, K_0, K_1, K_2
    held : (q, b, 2, s), x, y of each of q supports for unit amplitudes, that of the
        centre first
    """

    modes: Integers
    moved: NDArray[np.bool_]
    flat: Integers
    again: Integers
    mass: Floats
    gyro: Floats
    damping: Floats
    rest: Floats
    first: Floats
    quartic: Floats
    held: Floats


class DrivenRotor:
    """A rotor at a changing speed: its modes in blocks, with arrays for any speed.

    A block has the modes of one nodal diameter. f_0 are the forces of the unbalance,
    Euler's forces on the blades, and the weight.

    Attributes
    ----------
    order, starts : results of `by_diameter`
    shapes, mass : (n, m), shapes of the modes in this order; (n, n), M
    alike : (r,), indices of the modes that f_0 moves, block by block
    begun : (a + 1,), index in `alike` of the first mode of each of a blocks, and r
    force, weight : (m,), f_0 in the present interval of speed, without the weight; (2,
        m), the weight by cos and sin of the rotor's angle, with F_0 of the bearings
    hung : (2, m), the weight alone
    held : (2 s, m), x, y of the supports of `kernels.standing`
    """

    def __init__(self, model: Model, scene: Scene) -> None:
        spin, body = model.rotor.terms, model.rotor
        self.model, self.scene = model, scene
        self.order, self.starts = by_diameter(body)
        self.step = scene.solver.time_step
        self.supports = spin.support, *(one.support for one in spin.stations)
        self.mass = body.mass
        self.loads = loads_of(model, scene)
        self.shapes = body.shapes[:, self.order]
        self.hub = centre_rows(body, model.blades)[:, self.order]
        elsewhere = [one.rows @ self.shapes for one in spin.stations]
        self.rows = np.stack([self.hub, *elsewhere])
        rows = contact_rows(body, model.blades)
        self.radial, self.tangential = (part[:, self.order] for part in rows)
        none = np.zeros_like(spin.stiffening)
        damping = body.damping_matrix()
        if spin.material is not None:
            damping = damping + spin.material
        terms = (
            body.mass, 2 * spin.coriolis, damping, body.stiffness,
            spin.stiffening, none if spin.quartic is None else spin.quartic,
        )  # fmt: skip
        self.groups = self._grouped([self.shapes.T @ t @ self.shapes for t in terms])
        moved = [g.modes[g.moved].ravel() for g in self.groups]
        sizes = [s for g in self.groups for s in g.moved.sum() * [g.modes.shape[1]]]
        self.alike = np.concatenate(moved).astype(np.int64)
        self.begun = np.concatenate([[0], np.cumsum(sizes, dtype=np.int64)])
        self.force = np.zeros(len(self.order))
        self.weight = self.hung = self.loads.weight[:, self.order]
        self.held = unlike_rows(model, self.shapes)

    def _grouped(self, terms: list[Floats]) -> list[_Group]:
        ends = list(itertools.pairwise(self.starts.tolist()))
        sizes = np.array([b - a for a, b in ends])
        begun = np.concatenate([[0], np.cumsum(sizes**2)])
        out, further = [], int(begun[-1])
        for size in sorted(set(sizes.tolist()) - {0}):
            own = np.flatnonzero(sizes == size)
            modes = np.array([np.arange(*ends[b]) for b in own])
            place = np.arange(size)
            inside = size * place[None, :] + place[:, None]
            parts = [t[modes[:, :, None], modes[:, None, :]] for t in terms]
            parts = [
                (part + (-1.0 if i == 1 else 1.0) * part.swapaxes(1, 2)) / 2
                for i, part in enumerate(parts)
            ]
            held = np.ascontiguousarray(self.rows[:, :, modes].swapaxes(1, 2))
            moved = self.loads.moves()[self.order[modes]].any(axis=1)
            extra = further + size**2 * np.arange(moved.sum())
            further += size**2 * len(extra)
            flat, again = (at[:, None, None] + inside for at in (begun[own], extra))
            out.append(_Group._make([modes, moved, flat, again, *parts, held]))
        return out

    def _held(self, group: _Group, speed: Any) -> tuple[Floats, Floats, Floats, Floats]:
        """Return the matrices 2 Omega C, D, K, S of a group at a speed, (b, s, s) each.

        They are the matrices of `turning.Terms`, without that of inertia.

        speed : Omega, rad/s
        """
        stiffness = group.rest + speed**2 * group.first + speed**4 * group.quartic
        gyro, damping, push = speed * group.gyro, group.damping, 0.0 * stiffness
        for support, rows in zip(self.supports, group.held, strict=True):
            own, back = support.at(speed), rows.swapaxes(1, 2)
            held = own.turning(speed)
            gyro = gyro + back @ planar(1j * own.damping.imag) @ rows
            damping = damping + own.damping.real * (back @ rows)
            stiffness = stiffness + held.real * (back @ rows)
            push = push + back @ planar(1j * held.imag) @ rows
        return gyro, damping, stiffness, push

    def set(self, body: Body, interval: Interval) -> None:
        """Set the kernel's arrays of the rotor to those of an interval of speed."""
        step, speed, rate = self.step, interval.speed, interval.rate
        self.force = self.loads.at(speed, rate)[self.order]
        for group in self.groups:
            gyro, damping, stiffness, push = self._held(group, speed)
            before = (damping + gyro) / (2 * step)
            mass = group.mass / step**2
            inverse = np.linalg.solve(mass + before, np.eye(mass.shape[-1]))
            swerve = 0.5 * rate * group.gyro
            for array, value in (
                (body.keep, inverse @ (mass - before)),
                (body.pull, inverse @ (stiffness + push + swerve)),
                (body.give, inverse),
            ):  # fmt: skip
                array[group.flat], array[group.again] = value, value[group.moved]
            for array, value in (
                (body.stiffness, stiffness), (body.damping, damping), (body.push, push),
                (body.swerve, swerve),
            ):  # fmt: skip
                array[group.flat] = value
        if len(self.held):
            moved = self._moved(body, np.eye(len(self.order)), self.held).T
            set_standing(self.model, body.stand, speed, moved)
            body.stand.moved[:, body.own :] = moved[:, self.alike]
            self.weight = self.hung + drawn_loads(body.stand, self.held)
        self._set_forces(body)

    def _set_forces(self, body: Body) -> None:
        """Set the increments in a step by f_0, and by `weight`."""
        forces = np.stack([self.force, *self.weight])
        moved = self._moved(body, np.eye(len(self.order)), forces).T
        body.force[body.own :] = moved[0, self.alike]
        body.weight[:, body.own :] = moved[1:, self.alike]

    def forces(self, time: float) -> Floats:
        """Return f_0 at a time, s, (m,), in the present interval of speed."""
        angle = float(angle_at(self.scene, time))
        turned = np.array([math.cos(angle), math.sin(angle)])
        return np.asarray(self.force + turned @ self.weight)

    def whole(self, values: Floats) -> Floats:
        """Return the sum of the motions by and without contact, y + r, amplitudes (m,).

        values : amplitudes or increments of a state: those of y (m,), then those of r,
            of the modes `alike` only
        """
        out = values[: len(self.order)].copy()
        out[self.alike] += values[len(out) :]
        return out

    def compliance(self, body: Body, mu: float) -> Floats:
        """Return the rotor's part of the Delassus matrix at this speed, (N, N), m/N.

        body : the kernel's arrays of the rotor
        mu : friction coefficient with the sign of the speed
        """
        push = self.radial + mu * self.tangential
        return self._moved(body, self.radial, push)

    def responses(self, body: Body) -> Floats:
        """Return what unit contact forces add to gaps and slides at this speed, m/N.

        They are those of `kernels.kernel_types.Coulomb`, (2 N, 2 N).

        body : the kernel's arrays of the rotor
        """
        rows = np.vstack([self.radial, self.tangential])
        return self._moved(body, rows, rows).T

    def _moved(self, body: Body, rows: Floats, push: Floats) -> Floats:
        """Return displacements at the end of a step by unit forces, m/N.

        rows, push : (r, m), (f, m), displacements and forces in the modes
        """
        out = np.zeros((len(rows), len(push)))
        for group in self.groups:
            seen, forces = (
                part[:, group.modes].swapaxes(0, 1) for part in (rows, push)
            )
            moved = seen @ body.give[group.flat] @ forces.swapaxes(1, 2)
            out += moved.sum(axis=0)
        return out

    def dense(self, body: Body, time: float) -> tuple[Floats, Floats, Floats]:
        """Return a step's matrices, keep and pull, and its increment by the force f_0.

        keep and pull are (m, m), as in `turning.Turning`, with the force -(dOmega/dt) C
        x in pull; the increment is (m,).

        body, time : the kernel's arrays of the rotor at the present speed; s
        """
        out = np.zeros((2, len(self.order), len(self.order)))
        moved, whole = np.zeros(len(self.order)), self.forces(time)
        for group in self.groups:
            places = group.modes[:, :, None], group.modes[:, None, :]
            keep, pull, give = (
                part[group.flat] for part in (body.keep, body.pull, body.give)
            )
            out[0][places], out[1][places] = keep, pull
            force = whole[group.modes][:, :, None]
            moved[group.modes] = (give @ force)[:, :, 0]
        return out[0], out[1], moved


def driven(body: Body, rotor: DrivenRotor) -> Body:
    """Return the kernel's arrays of a rotor of changing speed, with modes for r added.

    r is the motion without contact. Arrays that depend on the speed are 0 until
    `DrivenRotor.set` is called.

    body, rotor : the kernel's arrays at constant speed; blocks of the rotor's modes
    """
    size = int((np.diff(rotor.begun) ** 2).sum())
    starts = np.concatenate([body.starts, body.own + rotor.begun[1:]])
    names = ("keep", "pull", "give", "stiffness", "damping", "push", "swerve")
    zeros = np.zeros((len(names), len(body.keep) + size))
    blocks: dict[str, Any] = dict(zip(names, zeros, strict=True))
    radial, tangential = (
        np.ascontiguousarray(np.hstack([rows, rows[:, rotor.alike]]))
        for rows in (body.radial, body.tangential)
    )
    force = np.zeros(int(starts[-1]))
    hub = np.hstack([rotor.held, rotor.held[:, rotor.alike]])
    return body._replace(
        stand=driven_standing(rotor.model, hub, rotor.scene.solver.time_step),
        weight=np.zeros((2, len(force))),
        **blocks,
        mass=np.append(body.mass, np.zeros(size)),
        starts=starts,
        read=np.vstack([body.read, body.read[rotor.alike]]),
        radial=radial,
        tangential=tangential,
        force=force,
        alike=rotor.alike,
        blocks=len(body.starts) - 1,
    )


@dataclass(frozen=True)
class DrivenSteps:
    """Conversion between velocities and increments of a rotor at a changing speed.

    It is one of `motion.Steps`. A velocity is (x_{n+1} - x_{n-1}) / 2 dt and includes
    what the forces of unbalance and Euler's force add in this step, at the present
    speed.

    rotor, body, step : blocks of the rotor's modes; the kernel's arrays; dt, s
    """

    rotor: DrivenRotor
    body: Body
    step: float

    def unforced(self, time: float = 0.0) -> CentralSteps:
        """Return the conversion for the motion by contact, which f_0 does not drive.

        f_0 are the forces of unbalance, Euler's forces and the weight; time : s
        """
        keep, pull, _ = self.rotor.dense(self.body, time)
        return CentralSteps(keep, pull, self.step)

    def set_out(self, state: BodiesState, v: Floats, rate: Floats) -> None:
        """Set the increments in a state from velocities, at the start of a run.

        The state has two parts of the motion: that which contact causes, and the motion
        without contact. Increments are changes of the amplitudes in a step.

        state : in and out; its amplitudes are those at the start already
        v, rate : (m,), velocities of the part that contact causes, and of the other
        """
        own, modes = self.rotor, len(v)
        y, whole = state.q_b[:modes], own.whole(state.q_b)
        state.d_b[:] = self._rises((y, whole - y, v, v + rate), 0.0)

    def carry(self, state: BodiesState, parts: tuple[Floats, ...], time: float) -> None:
        """Set a state to a motion by contact and one without it.

        parts : y, r, (n,), m, displacements by contact and without it, and y', x',
            (n,), m/s, velocities by contact and of the whole motion x = y + r
        time : s
        """
        own = self.rotor
        lower = own.shapes.T @ own.mass
        y, r, rate, whole = (lower @ part for part in parts)
        state.q_b[:] = np.concatenate([y, r[own.alike]])
        state.d_b[:] = self._rises((y, r, rate, whole), time)

    def _rises(self, parts: tuple[Floats, ...], time: float) -> Floats:
        """Return the increments of a state; parts, time : as in `carry`, in modes."""
        (y, r, rate, whole), stand = parts, self._stand
        free, angle = rate, self._angle(time)
        if len(stand.hub):
            beside = forces_at(stand, r, whole - rate, angle)
            push = forces_at(stand, y + r, whole, angle) - beside
            free = rate - push @ stand.moved / (2 * self.step)
        rise = self.unforced(time).increments(y, free)
        all_rise = self.increments(y + r, whole, time)
        return np.concatenate([rise, (all_rise - rise)[self.rotor.alike]])

    @property
    def _stand(self) -> Stand:
        """The supports' arrays of the rotor's own modes."""
        stand, size = self.body.stand, len(self.rotor.order)
        parts = stand.hub[:, :size], stand.moved[:, :size]
        hub, moved = map(np.ascontiguousarray, parts)
        return stand._replace(hub=hub, moved=moved)

    def _angle(self, time: float) -> float:
        return float(angle_at(self.rotor.scene, time))

    def by_contact(self, state: BodiesState, time: float) -> tuple[Floats, Floats]:
        """Return displacements y and velocities y', (m,), of the motion by contact.

        state, time : amplitudes and increments; s
        """
        size = len(self.rotor.order)
        y, d = state.q_b[:size], state.d_b[:size]
        free = self.unforced(time).velocities(y, d)
        if not len(self.body.stand.hub):
            return y, free
        x, rise = self.rotor.whole(state.q_b), self.rotor.whole(state.d_b)
        whole, beside = (
            self.velocities(*part, time) for part in ((x, rise), (x - y, rise - d))
        )
        return y, whole - beside

    def velocities(self, x: Floats, d: Floats, time: float = 0.0) -> Floats:
        """Return the rotor's velocities, (m,), from the state of its modes.

        x, d : (m,), amplitudes, and their increments x_n - x_{n-1} in the last step
        time : s, of x
        """
        keep, pull, moved = self.rotor.dense(self.body, time)
        free = CentralSteps(keep, pull, self.step).velocities(x, d)
        free, stand = free + moved / (2 * self.step), self._stand
        if not len(stand.hub):
            return np.asarray(free)
        return np.asarray(free + added_by(stand, x, free, self._angle(time)))

    def increments(self, x: Floats, v: Floats, time: float = 0.0) -> Floats:
        """Return the rotor's last increments x_n - x_{n-1}, (m,), in its modes.

        x, v, time : (m,), amplitudes, and their velocities; s, of x
        """
        keep, pull, moved = self.rotor.dense(self.body, time)
        less, stand = v - moved / (2 * self.step), self._stand
        if len(stand.hub):
            less = less - included_in(stand, x, v, self._angle(time))
        return CentralSteps(keep, pull, self.step).increments(x, less)
