"""Forces of supports on a rotor, and its angular momentum, from its motion.

With x the displacements of a rotor's coordinates in the rotating frame, t its rigid
translation and Z = z e^{i Omega t} the place of a support, static frame, what holds the
rotor there exerts the force

F = -t^T (K x + D x') e^{i Omega t} + F_s(Z, Z'),

with springs and modal damping of the rotor's own matrices, which turn with it, and F_s
of what does not turn, see `supports`. The first part is that of springs at the centre;
of a shaft that overhangs two bearings the disk's force f and moment m give the
bearings' forces by equilibrium, and a cantilever's clamp bears f. A shaft line has
every support by itself, its springs included.

The rotor's angular momentum about the axis is H = dL/dOmega, L its Lagrangian,

H = I_0 Omega + F_e x' + x'^T C x + Omega (2 F_c x - x^T K_1 x) - 2 Omega^3 x^T K_2 x

with the terms of `reduction.modes.Spin`, the loads F_c and F_e with those of an
unbalance, and I_0 the polar moment of inertia of the undeformed rotor. Without terms of
rotation it is I_0 Omega + F_e x'. The drive gives what the other torques leave,

T = dH/dt - T_contact - sum Im(conj(Z) F_s) - Im(conj(S) g),

S the first moment of the rotor's mass, g the acceleration of gravity; T_contact is that
of friction at the tips' radius, on whose normal forces the line through the axis is.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from hpcwhirl.arrays import Complexes, Floats
from hpcwhirl.dynamics.kernels.standing import journal_terms, rolling_force
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.bearing_laws import Journal, Law
from hpcwhirl.reduction.bodies import swing_at_rest
from hpcwhirl.reduction.model import Model, why_unknown
from hpcwhirl.reduction.steady import translation
from hpcwhirl.reduction.supports import (
    Bearing,
    Support,
    at_rest,
    bearing_of,
    law_of,
)
from hpcwhirl.scene import Rotor, Scene
from hpcwhirl.structure import polar_inertia
from hpcwhirl.structure.shaft import (
    INNER,
    WHOLE,
    LineSupport,
    ShaftLine,
    line_of,
    name_of,
)

PLANE = np.array([1.0, 1.0j])  # makes x + i y of x and y
RESTING = 1.0 - 1e-9  # |Z| over the clearance of a stop, beyond which it is pressed
COLUMNS = 3  # of `ShaftLoads.of_motions` beside forces: H, torque, contact's impulse


@dataclass(frozen=True, eq=False)
class SupportForce:
    """What holds a rotor at one place, and how its force follows from the motion.

    Attributes
    ----------
    name : of the place, such as "centre" or "station 2"
    row : (n,), z = x + i y of the place for unit coordinates of the rotor
    held, drag : (n,), complex, the part of the force that turns with the rotor, as
        minus held @ x and minus drag @ x', N/m and N s/m
    support : springs, dampers and film that do not turn; None: there are none
    part : as of `structure.shaft.LineSupport`
    """

    name: str
    row: Complexes
    held: Complexes
    drag: Complexes
    support: Support | Bearing | None = None
    part: int = WHOLE


@dataclass(frozen=True, eq=False)
class ShaftLoads:
    """Forces of all supports on a rotor, and its angular momentum.

    Attributes
    ----------
    forces : what holds the rotor, by place; then branches of supports over the whirl's
        frequency, which are parts of the force at their place, or inside
    coriolis, stiffening, quartic : C, K_1, K_2 of `reduction.modes.Spin`, (n, n)
    load, swing : F_c and F_e, (n,), kg m, with those of an unbalance; None: unknown
    inertia : I_0, kg m^2
    moment : (n,), kg, complex, first moment of the mass for unit coordinates
    eccentricity : kg m, first moment of the undeformed rotor, complex
    gravity : g_x + i g_y, m/s^2, static frame
    """

    forces: tuple[SupportForce, ...]
    coriolis: Floats | None
    stiffening: Floats | None
    quartic: Floats | None
    load: Floats
    swing: Floats | None
    inertia: float
    moment: Complexes
    eccentricity: complex
    gravity: complex

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the places at which the rotor is held."""
        return tuple(one.name for one in self.forces if one.part == WHOLE)

    def of_motions(self, x: Floats, v: Floats, speed: Floats, angle: Floats) -> Floats:
        """Return forces, angular momentum and torques of k motions, (k, 2 s + 2).

        They are F_x, F_y of each of s supports, N, static frame; H, N m s, NaN if
        unknown; and the torque of supports and weight about the axis, N m. A row has
        the same bits whichever others are computed with it.
        Forces and torque are NaN while a stop is pressed, whose force the motion does
        not tell.

        x, v : (k, n), m, m/s, rotating frame
        speed, angle : (k,), Omega, rad/s; rad, by which the rotor has turned
        """
        x, v = map(np.ascontiguousarray, (x, v))  # else other bits
        turn, torque = np.exp(1j * angle), np.zeros(len(x))
        out = np.zeros((len(self.names), len(x)), dtype=complex)
        for number, one in enumerate(self.forces):
            force = -(_each(one.held, x) + _each(one.drag, v)) * turn
            if one.support is not None:
                z, moving = _each(one.row, x), _each(one.row, v)
                place, rate = z * turn, (moving + 1j * speed * z) * turn
                own = _by_support(one.support, (place, rate), speed, angle)
                if isinstance(one.support, Support) and one.support.stop > 0.0:
                    pressed = abs(place) > RESTING * one.support.stop
                    own = np.where(pressed, complex(np.nan, np.nan), own)
                torque += (place.conjugate() * own).imag
                force += own
            if one.part != INNER:
                out[number if one.part == WHOLE else one.part] += force
        if self.gravity:
            first = (_each(self.moment, x) + self.eccentricity) * turn
            torque += (first.conjugate() * self.gravity).imag
        pairs = [part for force in out for part in (force.real, force.imag)]
        return np.stack([*pairs, self.angular_momenta(x, v, speed), torque], axis=1)

    def angular_momenta(self, x: Floats, v: Floats, speed: Floats) -> Floats:
        """Return H of k motions, (k,), N m s; x, v, speed : as in `of_motions`."""
        if self.swing is None:
            return np.full(len(x), np.nan)
        total = self.inertia * speed + _each(self.swing, v)
        if self.coriolis is None or self.stiffening is None:
            return np.asarray(total)
        total = total + _both(v, self.coriolis, x) + 2 * speed * _each(self.load, x)
        total = total - speed * _both(x, self.stiffening, x)
        if self.quartic is not None:
            total = total - 2 * speed**3 * _both(x, self.quartic, x)
        return np.asarray(total)


def _each(row: Any, x: Floats) -> Any:
    """Return the product of a row (n,) and each of k vectors (k, n), (k,).

    Each product is one of a row and a column, so that its bits do not depend on k.
    """
    return (row[None, :] @ x[:, :, None])[:, 0, 0]


def _both(x: Floats, matrix: Floats, y: Floats) -> Floats:
    """Return x^T M y of k pairs of vectors, (k,), each by itself, see `_each`.

    x, matrix, y : (k, n), (n, n), (k, n)
    """
    return np.asarray((x[:, None, :] @ (matrix @ y[:, :, None]))[:, 0, 0])


def _by_support(
    support: Support | Bearing,
    motion: tuple[Complexes, Complexes],
    speed: Floats,
    angle: Floats,
) -> Complexes:
    """Return the force of a support in k motions, (k,), N, static frame.

    motion : Z, Z' of the rotor there, (k,), m, m/s, static frame
    speed, angle : (k,), Omega, rad/s; rad, by which the rotor has turned
    """
    first: Any = support.at(float(speed[0]))
    if first.film == 0.0 and first.bearing is None and (speed == speed[0]).all():
        return np.asarray(first.force(*motion))
    out = []
    for place, rate, omega, turned in zip(*motion, speed, angle, strict=True):
        now, here = support.at(float(omega)), (complex(place), complex(rate))
        own = now.force(*here)
        if now.bearing is not None:
            own += force_of(now.bearing, here, float(omega), float(turned))
        out.append(own)
    return np.array(out, dtype=complex)


def force_of(
    law: Law, motion: tuple[complex, complex], speed: float, angle: float
) -> complex:
    """Return the force of a journal or rolling bearing on the rotor, N, static frame.

    law, motion : of the bearing; Z, Z' of the rotor there, m, m/s, static frame
    speed, angle : Omega, rad/s; rad, by which the rotor has turned
    """
    place, rate = motion
    if isinstance(law, Journal):
        stream = rate - 0.5j * speed * place
        even, drift = journal_terms(place, stream, law.clearance)
        return complex(-law.film * (even * stream + drift * stream.conjugate()))
    first, between = np.exp(1j * law.cage * angle), np.exp(2j * np.pi / law.balls)
    given = complex(first), complex(between), law.balls, law.clearance
    return complex(law.hertz * rolling_force(place, *given))


@lru_cache(maxsize=16)
def shaft_loads(model: Model, scene: Scene) -> ShaftLoads:
    """Return how the loads of a shaft follow from the motion of its rotor.

    model, scene : model of all sectors, and its scene

    Raises
    ------
    InputError
        if the centre is clamped, or the rotor's matrices are unknown
    """
    if why := why_unknown(model):
        raise InputError(f"output.forces must be none, got supports: {why}")
    body, spin = model.rotor, model.rotor.spin
    hub = np.zeros(len(body.mass), dtype=complex)
    hub[2 * model.blades : 2 * model.blades + 2] = PLANE
    uneven = scene.unbalance * np.exp(1j * scene.unbalance_phase)
    moved = translation(body, model.blades)
    moment, offset = body.mass @ moved, uneven
    load, swing = np.zeros(len(hub)), _swing(model, scene)
    if spin is not None:
        pull = spin.load if spin.released is None else spin.load + spin.released
        load = pull + (uneven.conjugate() * hub).real
        offset = uneven + (0.0 if spin.released is None else moved @ spin.released)
        if spin.hung is not None:
            moment = moment + PLANE @ spin.hung
    if swing is not None:
        swing = swing + ((1j * uneven).conjugate() * hub).real
    rotor = scene.engine.rotor
    return ShaftLoads(
        _forces(model, rotor, hub),
        spin.coriolis if spin else None,
        spin.stiffening if spin else None,
        spin.quartic if spin else None,
        load,
        swing,
        0.0 if scene.engine.file else polar_inertia(rotor),
        moment,
        offset,
        scene.gravity * np.exp(1j * scene.gravity_angle),
    )


def _swing(model: Model, scene: Scene) -> Floats | None:
    """Return F_e of the rotor alone, (n,), kg m; None if it is unknown."""
    spin = model.rotor.spin
    if spin is not None:
        return spin.swing
    if scene.engine.file:
        return None
    return swing_at_rest(scene.engine.rotor, scene.solver.modes)


def _forces(model: Model, rotor: Rotor, hub: Complexes) -> tuple[SupportForce, ...]:
    """Return what holds a rotor; hub : (n,), z of the centre for unit coordinates."""
    body = model.rotor
    if body.spin is not None and body.spin.seats is not None:
        return _of_line(line_of(rotor.shaft), body.spin.seats)
    support = None if body.spin is None else body.spin.support
    moved = translation(body, model.blades)
    own = moved @ body.stiffness, moved @ body.damping_matrix()
    if body.spin is None or not body.spin.tilt:
        return (SupportForce("centre", hub, *own, support),)
    sense = -1.0 if body.cyclic else 1.0
    x, y = body.spin.tilt[:2]
    moments = [part[x] + 1j * sense * part[y]
               for part in (body.stiffness, body.damping_matrix())]  # fmt: skip
    held = _in_equilibrium(rotor, own, moments)
    if support is None or support == Support():
        return held
    zero = np.zeros_like(hub)
    return (*held, SupportForce("centre", hub, zero, zero, support))


def _in_equilibrium(
    rotor: Rotor, forces: tuple[Complexes, Complexes], moments: list[Complexes]
) -> tuple[SupportForce, ...]:
    """Return what holds a massless shaft: a clamp, or two bearings.

    forces, moments : (n,), of the disk on its shaft, for unit coordinates, and for unit
        velocities
    """
    rest = np.zeros_like(forces[0])
    if rotor.shaft == "cantilever":
        return (SupportForce("clamp", rest, *forces),)
    span, out = rotor.shaft_length, rotor.shaft_overhang
    pairs = zip(forces, moments, strict=True)
    held, drag = ((force * (span + out) + moment) / span for force, moment in pairs)
    return (
        SupportForce("bearing 1", rest, forces[0] - held, forces[1] - drag),
        SupportForce("bearing 2", rest, held, drag),
    )


def _of_line(line: ShaftLine, rows: Floats) -> tuple[SupportForce, ...]:
    """Return what holds a shaft line.

    rows : (s, 2, n), displacements x, y of its s supports for unit coordinates
    """
    out, used = [], dict[str, int]()
    for own, row in zip(line.supports, rows, strict=True):
        name = name_of(line, own) if own.part == WHOLE else ""
        used[name] = used.get(name, 0) + 1
        if name and used[name] > 1:
            name = f"{name}, {used[name]}"
        zero = np.zeros(rows.shape[2], dtype=complex)
        out.append(SupportForce(name, PLANE @ row, zero, zero, _whole(own), own.part))
    return tuple(out)


def _whole(own: LineSupport) -> Support | Bearing:
    """Return springs, dampers and film of a support of a shaft line, all of them."""
    if found := at_rest(own):
        return found
    if own.law:
        return Support(bearing=law_of(own.law))
    return bearing_of(list(own.rows), 0.0)
