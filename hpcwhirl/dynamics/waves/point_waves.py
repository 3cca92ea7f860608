"""Rotor and casing as waves of the rotating frame, for one or several points a tip.

A pair of modes of the casing, q_c and q_s of harmonic h, is Y = q_c - i q_s = a +
conj(b) in the rotating frame. A step without forces multiplies a by z e^{i h Omega dt},
b by z e^{-i h Omega dt}; z is that of `mode_waves`. The two modes have the waves a + b
and i (a - b), which give their displacements, and their increments, which are those of
the material.

The steady motion of an unbalanced rotor without contact is given by further waves,
which no force changes: one that is constant in the rotating frame, and where supports
differ by direction others that turn by 2 Omega dt in a step, see `case.unbalance`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.arrays import Complexes, Floats, Integers
from hpcwhirl.case.unbalance import steady
from hpcwhirl.dynamics.bodies.operators import friction_with_sign
from hpcwhirl.dynamics.bodies.turning import Terms, turning_terms
from hpcwhirl.dynamics.kernels.vectors import ROW
from hpcwhirl.dynamics.waves.mode_waves import ModeWaves, mode_waves
from hpcwhirl.dynamics.waves.point_sectors import (
    nearly_equal,
    travelling,
    with_conjugates,
)
from hpcwhirl.dynamics.waves.slots import ring_modes
from hpcwhirl.dynamics.waves.wave_motion import WaveMotion
from hpcwhirl.dynamics.waves.whole_waves import WholeWaves, whole_waves
from hpcwhirl.reduction.bodies import contact_rows
from hpcwhirl.reduction.model import Model
from hpcwhirl.scene import Scene

Rows = tuple[Floats, Floats]


def real_rows(rows: Complexes) -> Floats:
    """Return real factors (r, 2 waves) of re and im of amplitudes, from complex ones.

    The product of the result and amplitudes a (all re, then all im) is Re(rows a).

    rows : (r, waves), factors of the complex amplitudes a (waves,)
    """
    return np.hstack([rows.real, -rows.imag])


@dataclass(frozen=True)
class BodyWaves:
    """A body's m modes at rest as w waves of the rotating frame.

    Attributes
    ----------
    step : dt, s
    still, spins : (w,), z_0 - 1 and h: a step without forces multiplies an amplitude by
        z = z_0 e^{i h alpha}, where the body turns by alpha in the frame of the blades
    ahead : (w,), z - 1
    shapes, rises, moves : (m, w), for unit amplitudes of the waves: displacements x_n
        of the modes, their increments d' = x_n - x_{n-1}, and d' + d, d the increment
        in the step before
    gives : (w, m), change of the amplitudes by unit modal forces
    give : (m, m), change of the modes' displacements by unit modal forces
    form : (2 w, 2 w), J, energy as a quadratic form of re and im of the amplitudes
    """

    step: float
    still: Complexes
    spins: Floats
    ahead: Complexes
    shapes: Complexes
    rises: Complexes
    moves: Complexes
    gives: Complexes
    give: Floats
    form: Floats

    @cached_property
    def rates(self) -> Complexes:
        """Velocities of the modes, (m, waves), for unit amplitudes in free motion."""
        static = self.moves - self.rises  # d of a step earlier: rises / z
        with np.errstate(divide="ignore", invalid="ignore"):
            z = np.where(static != 0.0, self.rises / static, 0.0)
        return np.asarray(self.rises * (1 + z) / (2 * self.step))

    @cached_property
    def motion(self) -> WaveMotion:
        """How re and im of the waves move the modes."""
        return WaveMotion(real_rows(self.shapes), real_rows(self.rates))

    def turned(self, angle: float) -> BodyWaves:
        """Return the same waves, with another turn of the frame in a step, rad."""
        spin = np.expm1(1j * angle * self.spins)
        return replace(self, ahead=(1 + self.still) * spin + self.still)

    def conjugated(self, which: NDArray[np.bool_]) -> BodyWaves:
        """Return the same waves, described by the conjugate amplitudes of some of them.

        which : (waves,), whether to conjugate the amplitude of a wave
        """
        sign = np.concatenate([np.ones(len(which)), np.where(which, -1.0, 1.0)])

        def turned(rows: Complexes) -> Complexes:
            return np.where(which, rows.conj(), rows)

        return replace(
            self,
            still=turned(self.still),
            spins=np.where(which, -self.spins, self.spins),
            ahead=turned(self.ahead),
            shapes=turned(self.shapes),
            rises=turned(self.rises),
            moves=turned(self.moves),
            gives=turned(self.gives.T).T,
            form=sign[:, None] * self.form * sign,
        )

    def apart(self, diameter: Integers) -> BodyWaves:
        """Return the same waves, without energy from products of different diameters.

        These products of amplitudes are round-off.

        diameter : (waves,), nodal diameter of each wave
        """
        twice = np.tile(diameter, 2)
        same = np.equal.outer(twice, twice)
        return replace(self, form=np.where(same, self.form, 0.0))


def _energy(rises: Floats, places: Floats, omega: Floats, step: float) -> Floats:
    """Return a body's energy, J, as a quadratic form of re and im of its waves.

    The form is a symmetric matrix (2 waves, 2 waves).

    rises, places : (m, 2 waves), increments in a step, and amplitudes, of the modes for
        unit re and im of the waves
    omega, step : (m,), rad/s; dt, s
    """
    twice = rises.T @ rises / step**2
    twice += places.T @ (omega[:, None] ** 2 * (places - rises))
    return np.asarray((twice + twice.T) / 4)


def _of_modes(waves: ModeWaves, mixed: Complexes, spins: Floats) -> BodyWaves:
    """Return a body's waves, such as travelling ones, as combinations of its modes.

    waves : the modes, each as a complex amplitude that a time step without forces
        multiplies by a factor z, see `mode_waves`
    mixed : (m, waves), amplitudes of the modes in each wave, orthogonal columns
    spins : (waves,), h of each wave, see `BodyWaves`
    """
    unmixed = mixed.conj().T / (np.abs(mixed) ** 2).sum(axis=0)[:, None]
    which = np.argmax(np.abs(mixed), axis=0)
    parts = [row[:, None] * mixed for row in (waves.rise, waves.moves)]
    return BodyWaves(
        step=waves.step,
        still=waves.ahead[which],
        spins=spins,
        ahead=waves.ahead[which],
        shapes=mixed,
        rises=parts[0],
        moves=parts[1],
        gives=np.asarray(unmixed * waves.gives),
        give=np.diag(waves.give),
        form=_energy(real_rows(parts[0]), real_rows(mixed), waves.omega, waves.step),
    )


def _of_whole(waves: WholeWaves) -> BodyWaves:
    """Return the waves of a rotor with terms of rotation, converted to `BodyWaves`.

    waves : the same waves, with amplitudes in the order of `whole_waves`
    """
    size, width = len(waves.give), len(waves.ahead)
    places = np.append(np.arange(width), width + np.flatnonzero(waves.paired))
    form, gives = np.zeros((2 * width, 2 * width)), np.zeros((2 * width, size))
    form[np.ix_(places, places)] = waves.form
    gives[places] = waves.amplitudes(waves.give, waves.give)
    return BodyWaves(
        step=waves.step,
        still=waves.ahead,
        spins=np.zeros(width),
        ahead=waves.ahead,
        shapes=waves.shapes,
        rises=waves.rises,
        moves=np.asarray(waves.rises * (1 + 1 / (1 + waves.ahead))),
        gives=gives[:width] + 1j * gives[width:],
        give=waves.give,
        form=form,
    )


@dataclass(frozen=True)
class SteadyWaves:
    """The steady motion of an unbalanced rotor without contact, as s further waves.

    Their amplitudes are 1 at time 0, and no force changes them.

    Attributes
    ----------
    step : dt, s
    ahead : (s,), z - 1: a step multiplies an amplitude by z, of magnitude 1
    shapes : (m, s), displacements of the modes at rest for unit amplitudes
    """

    step: float
    ahead: Complexes
    shapes: Complexes

    @property
    def past(self) -> Complexes:
        """Displacements of the modes two steps before, (m, s), for unit amplitudes."""
        return np.asarray(self.shapes / (1 + self.ahead) ** 2)

    @property
    def rates(self) -> Complexes:
        """Velocities (x_{n+1} - x_{n-1}) / 2 dt, (m, s), for unit amplitudes."""
        z = 1 + self.ahead
        return np.asarray(self.shapes * (z - 1 / z) / (2 * self.step))


def steady_waves(model: Model, scene: Scene) -> SteadyWaves:
    """Return the steady motion by unbalance as waves; none if the rotor is balanced.

    With equal sectors each wave has nodal diameter 1: x = Re(Y a) travels around the
    rotor, so that a motion Re(xi a) is a sum of two waves, a and its conjugate.
    """
    body, step, size = model.rotor, scene.solver.time_step, len(model.rotor.omega)
    found = steady(model, scene)
    if found is None:
        none = np.zeros((size, 0), dtype=complex)
        return SteadyWaves(step, none[0], none)
    lower, turns = body.shapes.T @ body.mass, 1j * scene.speed * step * found.orders
    parts: list[tuple[Complexes, complex]] = [
        (lower @ shape, complex(np.expm1(turn)))
        for shape, turn in zip(found.shapes, turns, strict=True)
    ]
    sectors = nearly_equal(model) if body.cyclic else None
    if sectors is not None and 1 in sectors.blocks:
        block = sectors.blocks[1]
        way = block @ block.conj().T
        own = [(way @ (2 * parts[0][0]), 0j)]
        for shape, turn in parts[1:]:
            own += [(way @ shape, turn), (way @ shape.conj(), turn.conjugate())]
        parts = own
    shapes, ahead = zip(*parts, strict=True)
    return SteadyWaves(step, np.array(ahead), np.array(shapes).T)


def rotor_waves(model: Model, scene: Scene) -> tuple[BodyWaves, Rows] | None:
    """Return the rotor's waves, and its modes' displacements of the contact points.

    The latter are (radial, tangential), (points, m) each, for unit modal amplitudes.
    The result is None where two waves nearly coincide.
    """
    rows, body = contact_rows(model.rotor, model.blades), model.rotor
    if body.spin is None:
        own, size = mode_waves(body, scene.solver.time_step), len(body.omega)
        blocks = list(travelling(model).values()) if has_sectors(model) else []
        blocks = blocks or [np.eye(size)]
        mixed = np.hstack(with_conjugates(blocks))
        return (_of_modes(own, mixed, np.zeros(size)), rows) if own.is_basis else None
    terms = turning_terms(model, scene, body.shapes)
    blocks = list[Any]()
    sectors = nearly_equal(model) if has_sectors(model) else None
    if sectors is not None:
        even = sectors.even(terms, sectors.matrix), sectors.even(rows, sectors.rows)
        if even[0] is not None and even[1] is not None:
            terms, rows = Terms._make(even[0]), (even[1][0], even[1][1])
            blocks = list(sectors.blocks.values())
    waves, mu = whole_waves(model, scene, terms, blocks), friction_with_sign(scene)
    if not (waves.is_basis and waves.books(-rows[0] - mu * rows[1])):
        return None
    return _of_whole(waves), rows


def has_sectors(model: Model) -> bool:
    """Return whether a rotor's sectors may be equal, or nearly so.

    Rotors with several contact points a tip are from files, whose sectors differ by
    round-off.
    """
    return model.rotor.cyclic or model.rotor.points is not None


def casing_waves(model: Model, scene: Scene) -> BodyWaves | None:
    """Return the waves of a casing of harmonics in the frame of the blades.

    The result is None where two waves nearly coincide.
    """
    if model.casing is None:
        none, empty = np.zeros((0, 0)), np.zeros((0, 0), dtype=complex)
        row = empty.ravel()
        return BodyWaves(1.0, row, none.ravel(), row, *(empty,) * 4, none, none)
    own = mode_waves(model.casing, scene.solver.time_step)
    if not own.is_basis:
        return None
    size = len(own.omega)
    mixed, spins = np.eye(size, dtype=complex), np.zeros(size)
    for mode in ring_modes(model):
        if len(mode.members) == 2:
            pair = list(mode.members)
            mixed[np.ix_(pair, pair)] = [[1.0, 1.0], [1j, -1j]]
            spins[pair] = mode.harmonic, -mode.harmonic
    return _of_modes(own, mixed, spins).turned(scene.speed * scene.solver.time_step)


@dataclass(frozen=True)
class PointWaves:
    """Waves of rotor and casing, and their indices among the kernel's amplitudes.

    Attributes
    ----------
    rotor, casing : the waves of each body
    steady : the steady motion of an unbalanced rotor
    rows : radial and tangential displacements of the contact points by the rotor's
        modes, (points, m)
    index : (waves,), indices of the amplitudes of rotor, casing and steady motion among
        `size` complex numbers
    """

    rotor: BodyWaves
    casing: BodyWaves
    steady: SteadyWaves
    rows: Rows
    index: Integers
    size: int

    @property
    def half(self) -> int:
        """Number of complex amplitudes in the kernel's state, padded."""
        return -(-self.size // ROW) * ROW

    def places(self) -> tuple[Integers, Integers]:
        """Return indices of re and im of the waves of rotor and of casing.

        They are (2 waves,) each, into the kernel's amplitudes.
        """
        own, beside, _ = self.apart
        return (
            np.concatenate([own, self.half + own]),
            np.concatenate([beside, self.half + beside]),
        )

    @property
    def apart(self) -> tuple[Integers, Integers, Integers]:
        """Indices of the complex amplitudes of rotor, of casing, of steady motion."""
        own, beside = len(self.rotor.ahead), len(self.casing.ahead)
        first, second, third = np.split(self.index, [own, own + beside])
        return first, second, third

    def spread(self, rows: Complexes) -> Floats:
        """Return factors of re and im of the kernel's amplitudes, (r, 2 half).

        The result's product with the kernel's amplitudes, all re, then all im, is
        Re(rows a).

        rows : (r, waves), factors of the complex amplitudes a
        """
        out = np.zeros((len(rows), 2 * self.half))
        out[:, self.index], out[:, self.half + self.index] = rows.real, -rows.imag
        return out


def point_waves(model: Model, scene: Scene) -> PointWaves | None:
    """Return the waves of rotor and casing; None where they are no basis of the motion.

    That is so if some of a body's waves nearly coincide. The amplitudes of the casing
    and of the steady motion come first: without rotation the rotor's have imaginary
    parts that move no tip, so that the rows that give the gaps end before them.
    """
    found, casing = rotor_waves(model, scene), casing_waves(model, scene)
    if found is None or casing is None:
        return None
    (rotor, rows), steady = found, steady_waves(model, scene)
    own, beside = len(rotor.ahead), len(casing.ahead)
    first = beside + len(steady.ahead)
    size = first + own
    index = np.concatenate([np.arange(first, size), np.arange(first)])
    return PointWaves(rotor, casing, steady, rows, index, size)
