"""A rotor whose modes rotation couples, at a speed that changes: its blocks over Omega.

M y'' + (D + 2 Omega C) y' + (K(Omega) + S) y = f - (dOmega/dt) C x + f_0, by blocks of
modes at rest. In an interval (`case.speed`) Omega is its mean, and y = x - x_s the
motion about the circle of an unbalance at that speed. From one interval to the next x
and its increment are the same, while y and the matrices of its energy change: what the
energy gains by that is entered as work of the loading, as is the work of f_0.

K(Omega) = K_0 + Omega^2 K_1 + Omega^4 K_2 and C are stored by blocks once, so that a
refresh solves small systems alone, those of equal size at once.
"""

from __future__ import annotations

import cmath
import itertools
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.case.speed import Interval
from hpcwhirl.dynamics.kernels.kernel_types import CoupledBody, DrivenBody
from hpcwhirl.dynamics.motion import FreeSteps
from hpcwhirl.dynamics.turning import by_diameter
from hpcwhirl.reduction.bodies import centre_rows, contact_rows
from hpcwhirl.reduction.model import Model
from hpcwhirl.reduction.supports import planar
from hpcwhirl.scene import Scene

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
BLOCK = 1024  # speeds whose circles are solved for at once


class _Group(NamedTuple):
    """Blocks of one size s.

    Attributes
    ----------
    modes : (b, s), of the rotor, by diameter
    flat : (b, s, s), places of a block's entries in the kernel's arrays
    mass, gyro, damping, rest, first, quartic : (b, s, s): M, 2 C, D, K_0, K_1, K_2
    hub : (b, 2, s), x_o and y_o
    """

    modes: Integers
    flat: Integers
    mass: Floats
    gyro: Floats
    damping: Floats
    rest: Floats
    first: Floats
    quartic: Floats
    hub: Floats


class DrivenRotor:
    """The blocks of a rotor's modes, for any speed.

    Attributes
    ----------
    order, starts : of `by_diameter`
    shapes : (n, m), of the modes in this order
    speed, circle : rad/s; (m,), amplitudes of x_s at it
    """

    def __init__(self, model: Model, scene: Scene) -> None:
        spin, body = model.rotor.spin, model.rotor
        if spin is None:
            raise TypeError(model)
        self.order, self.starts = by_diameter(body)
        self.support, self.step = spin.support, scene.solver.time_step
        self.moment = scene.unbalance * cmath.exp(1j * scene.unbalance_phase)
        self.shapes = body.shapes[:, self.order]
        self.hub = centre_rows(body, model.blades)[:, self.order]
        rows = contact_rows(body, model.blades)
        self.radial, self.tangential = (part[:, self.order] for part in rows)
        swing = np.zeros(len(body.mass)) if spin.swing is None else spin.swing
        self.euler = self.shapes.T @ swing
        none = np.zeros_like(spin.stiffening)
        terms = (
            body.mass, 2 * spin.coriolis, body.damping_matrix(), body.stiffness,
            spin.stiffening, none if spin.quartic is None else spin.quartic,
        )  # fmt: skip
        self.groups = self._grouped([self.shapes.T @ t @ self.shapes for t in terms])
        self.circle = np.zeros(len(self.order))

    def _grouped(self, terms: list[Floats]) -> list[_Group]:
        ends = list(itertools.pairwise(self.starts.tolist()))
        sizes = np.array([b - a for a, b in ends])
        begun = np.concatenate([[0], np.cumsum(sizes**2)])
        out = []
        for size in sorted(set(sizes.tolist()) - {0}):
            own = np.flatnonzero(sizes == size)
            modes = np.array([np.arange(*ends[b]) for b in own])
            place = np.arange(size)
            flat = begun[own][:, None, None] + size * place[None, :] + place[:, None]
            parts = [t[modes[:, :, None], modes[:, None, :]] for t in terms]
            parts = [
                (part + (-1.0 if i == 1 else 1.0) * part.swapaxes(1, 2)) / 2
                for i, part in enumerate(parts)
            ]
            hub = self.hub[:, modes].swapaxes(0, 1)
            out.append(_Group._make([modes, flat, *parts, np.ascontiguousarray(hub)]))
        return out

    def _held(self, group: _Group, speed: Any) -> tuple[Floats, Floats, Floats, Floats]:
        """Return (2 Omega C, D, K, S) of blocks at a speed, (b, s, s) each."""
        own = self.support.at(speed)
        held, back = own.turning(speed), group.hub.swapaxes(1, 2)
        stiffness = group.rest + speed**2 * group.first + speed**4 * group.quartic
        return (
            speed * group.gyro + back @ planar(1j * own.damping.imag) @ group.hub,
            group.damping + own.damping.real * (back @ group.hub),
            stiffness + held.real * (back @ group.hub),
            back @ planar(1j * held.imag) @ group.hub,
        )

    def _circle_of(self, group: _Group, held: Floats, speed: float) -> Floats:
        """Return the amplitudes x_s of blocks, (b, s); held : K + S."""
        pull = speed**2 * self.moment
        load = np.array([pull.real, pull.imag]) @ group.hub
        return np.asarray(np.linalg.solve(held, load[:, :, None])[:, :, 0])

    def centres(self, speeds: Floats) -> Floats:
        """Return the centre's place on the circle at each speed, (n, 2), m."""
        out = np.zeros((len(speeds), 2))
        for i, speed in enumerate(speeds.tolist()):
            for group in self.groups:
                if group.hub.any():
                    _, _, stiffness, push = self._held(group, speed)
                    at = self._circle_of(group, stiffness + push, speed)
                    out[i] += (group.hub @ at[:, :, None]).sum(axis=0)[:, 0]
        return out

    def set(self, body: DrivenBody, interval: Interval) -> None:
        """Set the kernel's arrays of a rotor to those of an interval."""
        step, speed, rate = self.step, interval.speed, interval.rate
        circle, modes = np.zeros_like(self.circle), len(self.order)
        for group in self.groups:
            gyro, damping, stiffness, push = self._held(group, speed)
            before = (damping + gyro) / (2 * step)
            mass = group.mass / step**2
            inverse = np.linalg.solve(mass + before, np.eye(mass.shape[-1]))
            swerve = 0.5 * rate * group.gyro
            for array, value in (
                (body.keep, inverse @ (mass - before)),
                (body.pull, inverse @ (stiffness + push)),
                (body.give, inverse), (body.stiffness, stiffness),
                (body.damping, damping), (body.push, push), (body.swerve, swerve),
            ):  # fmt: skip
                array[group.flat] = value
            if self.moment:
                at = self._circle_of(group, stiffness + push, speed)
                circle[group.modes] = at
            turned = -1j * rate * self.moment
            load = np.array([turned.real, turned.imag]) @ group.hub
            there = circle[group.modes][:, :, None]
            body.force[group.modes] = load - (swerve @ there)[:, :, 0]
        body.force[:modes] -= rate * self.euler
        body.work[:] = 0.0
        self.circle = circle
        for m in range(modes, len(body.read)):  # the mode that reads x_s
            tips = self.radial @ circle
            body.read[m] = np.concatenate([tips, self.hub @ circle])
            body.radial[:, m], body.tangential[:, m] = tips, self.tangential @ circle

    def compliance(self, body: DrivenBody, mu: float) -> Floats:
        """Return the rotor's W (N, N), m/N; mu with the sign of the speed."""
        out = np.zeros((len(self.radial), len(self.radial)))
        push = self.radial + mu * self.tangential
        for group in self.groups:
            give = body.give[group.flat]
            rows = self.radial[:, group.modes].swapaxes(0, 1)
            moved = rows @ give @ push[:, group.modes].swapaxes(0, 1).swapaxes(1, 2)
            out += moved.sum(axis=0)
        return out

    def dense(self, body: DrivenBody) -> tuple[Floats, Floats, Floats]:
        """Return keep and pull (m, m), and d' by the constant force (m,).

        pull includes what `swerve` gives.
        """
        out = np.zeros((2, len(self.order), len(self.order)))
        moved = np.zeros(len(self.order))
        for group in self.groups:
            places = group.modes[:, :, None], group.modes[:, None, :]
            keep, pull, give, swerve = (
                part[group.flat]
                for part in (body.keep, body.pull, body.give, body.swerve)
            )
            out[0][places], out[1][places] = keep, pull + give @ swerve
            force = body.force[group.modes][:, :, None]
            moved[group.modes] = (give @ force)[:, :, 0]
        return out[0], out[1], moved


def driven(body: CoupledBody) -> DrivenBody:
    """Return a rotor's arrays with those of a changing speed, which are still 0."""
    modes = int(body.starts[-1])
    return DrivenBody(*body, np.zeros_like(body.keep), np.zeros(modes), np.zeros(modes))


@dataclass(frozen=True)
class DrivenSteps:
    """The steps of its modes at the present speed, see `motion.FreeSteps`."""

    rotor: DrivenRotor
    body: DrivenBody
    step: float

    def velocities(self, x: Floats, d: Floats) -> Floats:
        """Return x' from x and d = x_n - x_{n-1}."""
        keep, pull, moved = self.rotor.dense(self.body)
        free = FreeSteps(keep, pull, self.step).velocities(x, d)
        return np.asarray(free + moved / (2 * self.step))

    def increments(self, x: Floats, v: Floats) -> Floats:
        """Return d from x and x'."""
        keep, pull, moved = self.rotor.dense(self.body)
        less = v - moved / (2 * self.step)
        return FreeSteps(keep, pull, self.step).increments(x, less)
