"""Matrices of a time step of a rotor with the terms of rotation, for the kernels.

(M/dt^2 + (D + 2 Omega C)/2dt) x_{n+1} = f_n + (2M/dt^2 - K(Omega)) x_n
    - (M/dt^2 - (D + 2 Omega C)/2dt) x_{n-1}

Coriolis forces, treated implicitly, do no work: b^T C b = 0, b = x_{n+1} - x_{n-1}. D
includes the supports' damping c_s, and K(Omega) their skew part S, which does the work
b^T S x_n / 2 in a step, entered as damping. Together they are the loss of a damper that
does not rotate, less the work that its torque takes from the rotation.

The force of an unbalance is constant in the rotating frame, and x_s the steady
displacement by it, the circle of the rotor without contact (`case.unbalance`). A
coordinate s that stays 1 represents the force in kernels without constant forces:

modes: the amplitudes are those of y = x - x_s, and a mode without mass, stiffness and
damping adds x_s at the tips and the centre; in scheme `modal` it is a wave, see
`waves.turning_waves.Circle`. If supports differ by direction, two further modes for
each harmonic h, which vary as cos h Omega t and sin h Omega t, add its Re xi and
-Im xi.

matrices: the coordinates are x, and the column of s in A^-1 K is -A^-1 F. Energy and
loss are those of x less `Body.still`, (x_s, 1), that is of y: the potential of the
force is included.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hpcwhirl.arrays import Complexes, Floats, Integers
from hpcwhirl.case.speed import law_of
from hpcwhirl.case.unbalance import has_steady, steady
from hpcwhirl.dynamics.bodies.motion import CentralSteps
from hpcwhirl.dynamics.kernels.kernel_types import (
    NO_MODES,
    NOTHING,
    Bearings,
    Body,
    Stand,
)
from hpcwhirl.dynamics.kernels.standing import (
    JOURNAL,
    PLAIN,
    ROLLING,
    add_support,
    at_support,
    film_at,
    room_of,
    solve_supports,
    terms_at,
    turned_at,
)
from hpcwhirl.reduction.bearing_laws import Rolling
from hpcwhirl.reduction.bodies import centre_rows, contact_rows
from hpcwhirl.reduction.model import Model
from hpcwhirl.reduction.modes import ModalModel, unlike
from hpcwhirl.reduction.supports import Support
from hpcwhirl.reduction.waves import turning_matrices
from hpcwhirl.scene import Scene

EPSILON = float(np.finfo(float).eps)
ROUNDS = 30  # of the iteration for the half of a journal's film that carries


def circling_modes(body: Body, model: Model, scene: Scene) -> Body:
    """Add modes that represent the orbit of an unbalanced rotor to its kernel arrays.

    The orbit is the motion without contact: on equal supports a circle, x_s, see
    `case.unbalance`, else an ellipse.

    body : the kernel's arrays of the rotor's modes without them
    """
    (rows, pulls), count = read_by(model, scene), 2 * model.blades
    radial, tangential = (rows[:, places] for places in model.places)
    hub = rows[:, count : count + 2]
    none = np.zeros(len(rows))
    return body._replace(
        keep=np.append(body.keep, pulls > 0.0),
        pull=np.append(body.pull, pulls),
        give=np.append(body.give, none),
        mass=np.append(body.mass, none),
        stiffness=np.append(body.stiffness, none),
        damping=np.append(body.damping, none),
        push=np.append(body.push, none),
        starts=np.append(body.starts, body.starts[-1] + 1 + np.arange(len(rows))),
        read=np.vstack([body.read, np.hstack([radial, hub])]),
        radial=np.ascontiguousarray(np.hstack([body.radial, radial.T])),
        tangential=np.ascontiguousarray(np.hstack([body.tangential, tangential.T])),
    )


def read_by(model: Model, scene: Scene) -> tuple[Floats, Floats]:
    """Return the modes that represent an unbalanced rotor's orbit without contact.

    They are one for the circle, and two for each further harmonic of `case.unbalance`,
    its cosine and its sine.

    Returns
    -------
    rows : (w, n), m, displacements for unit amplitudes, in the n coordinates of the
        rotor; w = 0 if it is balanced
    pulls : (w,), factor of the amplitude in a step, 2 - 2 cos a, where a harmonic turns
        by a in a step
    """
    found = steady(model, scene)
    if found is None:
        return np.zeros((0, len(model.rotor.shapes))), np.zeros(0)
    parts = [[shape.real, -shape.imag] for shape in found.shapes[1:]]
    rows = [found.still, *(row for pair in parts for row in pair)]
    half = 0.5 * scene.speed * scene.solver.time_step * found.orders[1:]
    return np.array(rows), np.append(0.0, np.repeat(4.0 * np.sin(half) ** 2, 2))


def amplitudes_at(steps: int, model: Model, scene: Scene) -> tuple[Floats, Floats]:
    """Return (amplitudes, increments) of the modes `read_by` at a step, (w,) each."""
    found = steady(model, scene)
    if found is None:
        return np.zeros(0), np.zeros(0)
    angle = scene.speed * scene.solver.time_step * found.orders[1:]
    now, half = angle * steps, 0.5 * angle
    q = np.stack([np.cos(now), np.sin(now)], axis=1).ravel()
    between, size = now - half, 2.0 * np.sin(half)
    d = np.stack([-size * np.sin(between), size * np.cos(between)], axis=1).ravel()
    return np.append(1.0, q), np.append(0.0, d)


def jitter(body: Body, model: Model, step: float) -> tuple[float, float]:
    """Return energy, J, and squared motion of the centre, m^2, due to round-off.

    They are upper bounds for one step of scheme `paper` of an unbalanced rotor. A step
    computes A^-1 K (x, 1), which vanishes on the circle, as a difference of numbers of
    size |A^-1 K| |(x_s, 1)|, n products each, and adds it to x. With e the relative
    error of a number, the error of the increment of x is at most

    a = n e |A^-1 K| |(x_s, 1)| + e |x_s|

    with energy a M a / 2 dt^2 + a |K| a / 2. The centre that has this energy is at most
    sqrt(2 c E) away, c being its static compliance. Errors of different steps are
    independent, so that their energies add.

    body : as matrices of one block, with the coordinate of `circling`
    step : dt, s
    """
    still, hub = np.abs(body.still), 2 * model.blades
    pull, mass, stiffness = (
        np.abs(whole(part)) for part in (body.pull, body.mass, body.stiffness)
    )
    error = EPSILON * (len(still) * pull @ still + still)
    energy = 0.5 * float(error @ (mass / step**2 + stiffness) @ error)
    own = model.rotor.stiffness
    soft = np.linalg.solve(own, np.eye(len(own))[:, hub])[hub]
    return energy, 2.0 * float(soft) * energy


def circling(step: Turning, places: Floats) -> Turning:
    """Add the coordinate s = 1, for the unbalance's force, to a rotor's matrices.

    places : (n,), displacement of the circle, x_s, m, in the rotor's coordinates
    """
    size = len(places)
    padded = Turning._make(np.pad(matrix, (0, 1)) for matrix in step)
    padded.pull[:size, size] = -step.pull @ places
    return padded


NONE = np.zeros((0, 0))  # for a rotor without such supports
EMPTY, NO_NUMBERS = np.zeros(0), np.zeros(0, dtype=complex)
ALIKE = Stand(
    *(NONE,) * 3, *(NO_NUMBERS,) * 2, np.zeros(1), 0.0, *(EMPTY,) * 2,
    *(NO_NUMBERS,) * 4,
    Bearings(
        NO_MODES, NO_MODES, NO_NUMBERS, *(EMPTY,) * 2, NO_NUMBERS, EMPTY, NO_NUMBERS
    ),
    np.zeros((0, 2)),
)  # fmt: skip


class Terms(NamedTuple):
    """The matrices of a rotor's equation of motion with rotation, (n, n).

    They are M, 2 Omega C, D, K(Omega) and S: inertia, Coriolis forces, damping,
    stiffness at speed, and circulatory forces of the supports; 2 Omega C and S are
    skew-symmetric, the others symmetric.
    """

    mass: Floats
    gyro: Floats
    damping: Floats
    stiffness: Floats
    push: Floats


class Turning(NamedTuple):
    """Matrices of a step d' = keep d - pull x + inverse f, and of its energy, (n, n).

    x are the coordinates, d = x_n - x_{n-1} and d' their last and next increment, f the
    forces.

    Attributes
    ----------
    keep, pull, inverse : matrices of the step
    mass, stiffness : symmetric, give the energy: kinetic plus Jacobi's potential
    damping, push : D, symmetric, and S, skew, give the damping loss
    """

    keep: Floats
    pull: Floats
    inverse: Floats
    mass: Floats
    stiffness: Floats
    damping: Floats
    push: Floats


def turning_terms(model: Model, scene: Scene, basis: Floats | None = None) -> Terms:
    """Return the matrices of a rotor's equation of motion with terms of rotation.

    basis : (n, m), shapes whose amplitudes are the coordinates; None: the model's own
    """
    body = model.rotor
    matrices = [body.mass, *turning_matrices(body, scene.speed, model.blades)]
    if basis is not None:
        matrices = [basis.T @ matrix @ basis for matrix in matrices]
    mass, gyro, damping, stiffness, push = matrices
    return Terms(
        mass,
        (gyro - gyro.T) / 2,
        (damping + damping.T) / 2,
        (stiffness + stiffness.T) / 2,
        (push - push.T) / 2,
    )


def turning(model: Model, scene: Scene, basis: Floats | None = None) -> Turning:
    """Return the matrices of a time step of a rotor with terms of rotation.

    basis : (n, m), shapes whose amplitudes are the coordinates; None: the model's own
    """
    return step_of(turning_terms(model, scene, basis), scene.solver.time_step)


def step_of(terms: Terms, step: float) -> Turning:
    """Return the matrices of a time step from those of the equation of motion.

    step : dt, s
    """
    mass, gyro, damping, stiffness, push = terms
    before, one = (damping + gyro) / (2 * step), np.eye(len(mass))
    inverse = np.linalg.solve(mass / step**2 + before, one)
    return Turning(
        one - inverse @ (2 * before),  # a product with M / dt^2 would round off more
        np.asarray(inverse @ (stiffness + push)),
        np.asarray(inverse),
        mass,
        stiffness,
        damping,
        push,
    )


def unlike_rows(model: Model, basis: Floats) -> Floats:
    """Return the displacements x, y of s supports that `standing` is about, (2 s, m).

    basis : (n, m), shapes whose amplitudes are the coordinates
    """
    own = unlike(model.rotor, model.blades)
    return np.vstack(
        [np.zeros((0, basis.shape[1])), *(one.rows @ basis for one in own)]
    )


def standing(model: Model, scene: Scene, inverse: Floats, basis: Floats) -> Stand:
    """Return the kernel's arrays of supports that no constant matrix represents.

    They differ by direction, have a film, or are stops. Of other supports the result is
    `ALIKE`, without forces.

    Parameters
    ----------
    inverse : (m, m), increments of the rotor's coordinates in a step by unit forces on
        them
    basis : (n, m), shapes whose amplitudes are the coordinates
    """
    every = unlike(model.rotor, model.blades)
    if not every:
        return ALIKE
    own, hub = [one.support.at(scene.speed) for one in every], unlike_rows(model, basis)
    moved = np.ascontiguousarray((inverse @ hub.T).T)
    give = _given(own, hub @ moved.T, scene.solver.time_step)
    film, clearance = np.array([one.film for one in own]), _clearances(own)
    nonlinear = film.any() or any(one.bearing or one.stop for one in own)
    found = steady(model, scene) if nonlinear else None
    rows = np.vstack([one.rows for one in every])
    places = np.zeros((2, len(rows)), dtype=complex)
    if found is not None:
        places = np.array([found.still @ rows.T, found.of(1) @ rows.T])
    z, (x, y) = places[0, ::2] + 1j * places[0, 1::2], places[1].reshape(-1, 2).T
    near = np.abs(z / np.where(film > 0.0, clearance, 1.0)) ** 2
    across = np.array([film_at(one)[0] for one in near])
    sag, lift = (x - 1j * y).conj() / 2, (x + 1j * y) / 2
    stiffness, damping = _apart(own)
    return Stand(
        np.ascontiguousarray(hub), moved, np.ascontiguousarray(give), stiffness,
        damping, np.array([scene.speed]), scene.solver.time_step, film, clearance,
        z, 1j * scene.speed * film * across * z, sag, lift, _bearings(own, sag),
        _stops(own, scene.speed),
    )  # fmt: skip


def _clearances(own: list[Support]) -> Floats:
    """Return the clearances of films and bearings, (s,), m; 1 of other supports."""
    return np.array([
        one.clearance or 1.0 if one.bearing is None else one.bearing.clearance
        for one in own
    ])  # fmt: skip


def _given(own: list[Support], moved: Floats, step: float) -> Floats:
    """Return `Stand.give` of supports at a speed, (2 s, 2 s).

    moved, step : (2 s, 2 s), m/N, change of their displacements by unit forces; dt, s
    """
    over = np.where([one.stop > 0.0 for one in own], 1.0, 2 * step)
    return np.ascontiguousarray(moved / np.repeat(over, 2)[:, None])


def _stops(own: list[Support], speed: float) -> Floats:
    """Return `Stand.stops` of supports, of which the last ones are stops, (m, 2)."""
    rows = [(one.stop, one.rub * np.sign(speed)) for one in own if one.stop > 0.0]
    return np.array(rows, dtype=float).reshape(-1, 2)


def _apart(own: list[Support]) -> Complexes:
    """Return k_d and c_d of supports, (2, s); 0 of bearings, whose force has them."""
    each = ((one.stiffness_apart, one.damping_apart) for one in own)
    parts = [
        (0j, 0j) if one.bearing else pair for one, pair in zip(own, each, strict=True)
    ]
    return np.ascontiguousarray(np.array(parts, dtype=complex).T)


def _bearings(own: list[Support], sag: Complexes) -> Bearings:
    """Return the kernel's arrays of journal and rolling bearings among supports.

    own, sag : supports at a speed; (s,), m, static frame
    """
    rows = [_bearing(*one) for one in zip(own, sag.tolist(), strict=True)]
    kinds = int, int, complex, float, float, complex, float, complex
    return Bearings._make(map(np.array, zip(*rows, strict=True), kinds))


def _bearing(own: Support, sag: complex) -> tuple[complex, ...]:
    """Return the numbers of a support in the order of `Bearings`.

    own, sag : the support at a speed; m, static frame
    """
    law, held = own.bearing, own.stiffness + own.spring
    if law is None:
        return PLAIN, 1, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0
    rest = held, own.damping.real, own.drawn_at(sag)
    if isinstance(law, Rolling):
        between = np.exp(2j * np.pi / law.balls)
        return ROLLING, law.balls, between, law.hertz, law.cage, *rest
    return JOURNAL, 1, 1.0, law.film, 0.5, *rest


def driven_standing(model: Model, hub: Floats, step: float) -> Stand:
    """Return the arrays of the supports of `standing` where the speed changes.

    Those that depend on the speed are 0 until `set_standing` is called.

    hub, step : (2 s, n), x, y of the supports for unit coordinates; dt, s
    """
    every = [one.support for one in unlike(model.rotor, model.blades)]
    if not every:
        return ALIKE
    own = [one.at(0.0) for one in every]
    size = len(every)
    k, c, circle, balance, sag, lift = np.zeros((6, size), dtype=complex)
    return Stand(
        np.ascontiguousarray(hub), np.zeros_like(hub), np.zeros((2 * size,) * 2), k, c,
        np.zeros(1), step, np.array([one.film for one in own]), _clearances(own),
        circle, balance, sag, lift, _bearings(own, sag), _stops(own, 0.0),
    )  # fmt: skip


def set_standing(model: Model, stand: Stand, speed: float, moved: Floats) -> None:
    """Set the arrays of supports to those of a speed, rad/s.

    moved : (2 s, n), increments of the coordinates in a step by unit forces there
    """
    if not len(stand.hub):
        return
    every = [one.support.at(speed) for one in unlike(model.rotor, model.blades)]
    size = moved.shape[1]
    stand.speed[:], stand.moved[:, :size] = speed, moved
    stand.give[:] = _given(every, stand.hub[:, :size] @ moved.T, stand.step)
    stand.stops[:] = _stops(every, speed)
    stand.stiffness[:], stand.damping[:] = _apart(every)
    stand.bearings.stiffness[:] = [own.stiffness + own.spring for own in every]
    stand.bearings.damping[:] = [own.damping.real for own in every]
    stand.bearings.drawn[:] = [own.drawn_at(own.place) for own in every]


def drawn_loads(stand: Stand, rows: Floats) -> Floats:
    """Return the forces F_0 of the bearings, (2, m), N, as `varying.Loads.weight`.

    They are added to f_0, since the supports' forces have the rest beyond them only.

    rows : (2 s, m), x, y of the supports for unit amplitudes of the modes
    """
    drawn = stand.bearings.drawn
    ways = np.stack([drawn, -1j * drawn])
    return np.asarray(ways.view(np.float64) @ rows)


def added_by(stand: Stand, x: Floats, free: Floats, angle: float) -> Floats:
    """Return what the supports add to velocities (d + d') / 2 dt of a step, (n,).

    A step without contact is d' = keep d - pull x + G f(x, v), v = (d + d') / 2 dt,
    with the force f of supports that differ by direction or have a film, see
    `kernels.standing`, and G = stand.moved.

    stand : the kernel's arrays of the supports
    x, free : (n,), a rotor's coordinates, and their velocities without this force
    angle : rad, of the rotor, on which the supports' directions depend in its frame
    """
    stand = without_stops(stand)
    when, push, size = _when(angle), np.zeros(room_of(stand)), len(x)
    for p in range(len(stand.film)):
        place, moving = (at_support(stand.hub, p, row, 0, size) for row in (x, free))
        add_support(stand, p, place, moving, when, push)
    solve_supports(stand, push)
    return _gained(stand, push[: len(stand.hub)])


def without_stops(stand: Stand) -> Stand:
    """Return the arrays of supports that are no stops.

    Velocities without those of a step's contact have no part of a stop's, either.
    """
    count = len(stand.film) - len(stand.stops)
    size = 2 * count
    return stand._replace(
        hub=stand.hub[:size], moved=stand.moved[:size], film=stand.film[:count],
        give=np.ascontiguousarray(stand.give[:size, :size]), stops=stand.stops[:0],
    )  # fmt: skip


def _when(angle: float) -> tuple[complex, float]:
    """Return `when` of `kernels.standing.terms_at`; angle : rad, of the rotor."""
    return turned_at(angle), angle


def included_in(stand: Stand, x: Floats, v: Floats, angle: float = 0.0) -> Floats:
    """Return what the supports have added to velocities (d + d') / 2 dt, (n,).

    stand : the kernel's arrays of the supports
    x, v : (n,), a rotor's coordinates, and their velocities
    angle : rad, of the rotor, see `added_by`
    """
    return _gained(stand, forces_at(stand, x, v, angle))


def forces_at(stand: Stand, x: Floats, v: Floats, angle: float) -> Floats:
    """Return the supports' forces at known velocities, (2 s,), N, rotating frame.

    In a step the velocities without these forces determine which half of a journal's
    film carries: they are found by iteration.

    stand, x, v, angle : as in `included_in`
    """
    push = _forces(stand, x, v, v, angle)
    if not (stand.bearings.kind == JOURNAL).any():
        return push
    for _ in range(ROUNDS):
        last, free = push, v - _gained(stand, push)
        push = _forces(stand, x, v, free, angle)
        if np.array_equal(push, last):
            break
    return push


def _forces(stand: Stand, x: Floats, v: Floats, free: Floats, angle: float) -> Floats:
    """Return the supports' forces, (2 s,), N, by velocities with and without them.

    Those of stops, which are of a step's contact, are 0.

    stand, x, v, angle : as in `included_in`; free : (n,), without them
    """
    when, push, size = _when(angle), np.zeros(len(stand.hub)), len(x)
    for p in range(len(stand.film) - len(stand.stops)):
        place, rate, before = (
            at_support(stand.hub, p, row, 0, size) for row in (x, v, free)
        )
        held, even, drift = terms_at(stand, p, place, before, when)
        force = -held - even * rate - drift * rate.conjugate()
        push[2 * p], push[2 * p + 1] = force.real, force.imag
    return push


def _gained(stand: Stand, push: Floats) -> Floats:
    """Return what forces of the supports, (2 s,), N, add to the velocities, (n,)."""
    return np.asarray(push @ stand.moved / (2 * stand.step))


@dataclass(frozen=True)
class SupportedSteps(CentralSteps):
    """Conversion between velocities and increments of a rotor on such supports.

    stand : the kernel's arrays of the supports, see `added_by`
    """

    stand: Stand

    def velocities(self, x: Floats, d: Floats, time: float = 0.0) -> Floats:
        """Return the rotor's velocities (d + d') / 2 dt.

        x, d : (n,), its coordinates, and their increments in the last step
        time : s, of x, on which the supports' directions depend in the rotating frame
        """
        free = super().velocities(x, d)
        return free + added_by(self.stand, x, free, self.stand.speed[0] * time)

    def increments(self, x: Floats, v: Floats, time: float = 0.0) -> Floats:
        """Return the rotor's increments d = x_n - x_{n-1}, (n,).

        x, v : (n,), its coordinates, and their velocities
        time : s, of x, see `velocities`
        """
        own = included_in(self.stand, x, v, self.stand.speed[0] * time)
        return super().increments(x, v - own)


def steps_on(stand: Stand, free: CentralSteps) -> CentralSteps:
    """Return the conversion between velocities and increments of a rotor on supports.

    stand : the kernel's arrays of the supports, see `standing`
    free : the conversion without forces that no constant matrix represents
    """
    if not len(stand.hub):
        return free
    return SupportedSteps(free.keep, free.pull, free.step, stand)


def by_diameter(body: ModalModel) -> tuple[Integers, Integers]:
    """Return the blocks of modes that rotation couples, one for each nodal diameter.

    They are given as order, (m,), which sorts modes by nodal diameter, and starts, (b +
    1,), the first mode of each block, and m. Modes of unequal sectors form one block.
    """
    if not body.cyclic:
        return np.arange(len(body.omega)), np.array([0, len(body.omega)])
    order = np.argsort(body.diameter, kind="stable")
    _, first = np.unique(body.diameter[order], return_index=True)
    return order, np.append(first, len(order))


def by_blocks(matrix: Floats, starts: Integers) -> Floats:
    """Return the diagonal blocks of a matrix (n, n) as the kernel has them.

    starts : (b + 1,), first coordinate of each block, and n
    """
    ends = itertools.pairwise(starts.tolist())
    return np.concatenate([NOTHING, *(matrix[a:b, a:b].T.ravel() for a, b in ends)])


def whole(block: Floats) -> Floats:
    """Return the matrix (n, n) of a body that is one block, from the kernel's array."""
    size = math.isqrt(len(block))
    return block.reshape(size, size).T


class Outputs(NamedTuple):
    """Displacements for unit values of a body's n coordinates.

    Attributes
    ----------
    radial, tangential : (r, n), of the contact points or the ring's coordinates
    hub : (2, n), x_o, y_o of a rotor; (0, n) of a casing
    """

    radial: Floats
    tangential: Floats
    hub: Floats


def body_of(
    step: Turning, starts: Integers, rows: Outputs, stand: Stand = ALIKE
) -> Body:
    """Return the kernel's arrays of a body.

    step : its matrices as the kernel has them, see `by_blocks`
    starts, rows : as in `by_blocks`; what the body moves
    stand : forces of supports that no constant matrix represents
    """
    read = np.ascontiguousarray(np.vstack([rows.radial, rows.hub]).T)
    radial, tangential = map(np.ascontiguousarray, (rows.radial, rows.tangential))
    return Body(
        step.keep, step.pull, step.inverse, step.mass, step.stiffness, step.damping,
        step.push, starts, int(starts[-1]), read, radial, tangential, stand,
        blocks=len(starts) - 1,
    )  # fmt: skip


def coupled_body(model: Model, scene: Scene) -> Body:
    """Return the kernel's arrays of a rotor as modes at rest, coupled by rotation.

    With an unbalance they include modes that represent its circle x_s, see
    `circling_modes`; at a changing speed, `dynamics.bodies.varying` adds further modes.
    """
    order, starts = by_diameter(model.rotor)
    shapes = model.rotor.shapes[:, order]
    step = turning(model, scene, shapes)
    radial, tangential = (
        rows[:, order] for rows in contact_rows(model.rotor, model.blades)
    )
    hub = centre_rows(model.rotor, model.blades)[:, order]
    same = step._replace(mass=np.eye(len(order)))
    blocks = Turning._make(by_blocks(matrix, starts) for matrix in same)
    stand = standing(model, scene, step.inverse, shapes)
    body = body_of(blocks, starts, Outputs(radial, tangential, hub), stand)
    if has_steady(scene) and law_of(scene) is None:
        return circling_modes(body, model, scene)
    return body
