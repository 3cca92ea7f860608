"""The initial motion of a case with a given energy: a random point of an energy shell.

Of the m chosen modes, with amplitudes q_j, velocities q'_j and frequencies omega_j at
rest, the shell of the energy E is the sphere sum (q'_j^2 + omega_j^2 q_j^2) = 2 E in 2
m dimensions; with velocities alone it is sum q'_j^2 = 2 E, in m. A vector of normal
numbers, divided by its norm, is uniform on the sphere (Muller 1959,
doi:10.1145/377939.377946). Each number follows from a hash of `start_draw` and the
mode's name: it does not depend on speed, gap or energy, and choosing further modes
changes no number.

With the terms of rotation the strain energy of the rotor is that of its stiffness at
speed, U = q^T K q / 2, as in the ledger. The shell is then an ellipsoid, and a vector
of normal numbers y gives the amplitudes q = K^(-1/2) y, uniform in the metric of the
energy: half of it is strain energy in the mean, at all speeds. Beyond a critical speed,
where K has a direction without stiffness, the shell has no end; the amplitudes are then
those of the shell at rest, scaled to the energy.

The motion is added to that with which the run would begin without it: an unbalanced
rotor on its circle (`case.unbalance`). The energy is that about the circle.
"""

from __future__ import annotations

import hashlib
import math
from collections import Counter
from collections.abc import Iterator
from functools import lru_cache

import numpy as np

from hpcwhirl.arrays import Floats, Indices
from hpcwhirl.case.profile import departure_at_start
from hpcwhirl.case.resolve import Case
from hpcwhirl.case.unbalance import steady_start
from hpcwhirl.dynamics.bodies.motion import Amplitudes, Motion, gaps_of
from hpcwhirl.dynamics.schemes.integrator import unfold
from hpcwhirl.errors import InputError, shown
from hpcwhirl.reduction.families import family_ranks
from hpcwhirl.reduction.model import MOST_KEPT, Model
from hpcwhirl.reduction.modes import centre_rows, has_centre, stiffening_at
from hpcwhirl.scene import Scene
from hpcwhirl.scene.rules import NO_BLADE

Name = tuple[str, str, str]  # body, family, nodal diameter
BITS = 53  # number of random bits in a number between 0 and 1
STIFF = 1e-9  # least stiffness of a direction, relative to the largest, for a shell
CLOSED = 1e-9  # least share of the gap that must remain open at the start


def start_of(case: Case) -> Motion | None:
    """Return the initial motion with a case's `start_energy`; None if that is 0.

    Raises
    ------
    InputError
        if `start_modes` chooses no mode, if the direction has no energy > 0 at this
        speed, or if a gap would be closed
    """
    scene, model = case.scene, case.model
    if scene.start_energy == 0.0:
        return None
    drawn = scene.start_modes, scene.start_draw, scene.start_as
    found = direction(model, scene.speed, *drawn)
    unit = energy_of(model, scene.speed, found)
    if not unit > 0.0:
        msg = "start_energy: this direction of start_modes has no energy > 0 at "
        raise InputError(msg + f"{scene.speed:g} rad/s, by centrifugal softening")
    scale = math.sqrt(scene.start_energy / unit)
    motion = unfold(model, Amplitudes(*(scale * part for part in found)))
    first = case.before or case.whole  # before a blade is lost in the run
    places, rates = steady_start(first.model, first.scene)
    _check_open(first.model, first.scene, motion, places)
    return motion._replace(
        rotor=motion.rotor + places, rotor_velocity=motion.rotor_velocity + rates
    )


def _check_open(model: Model, scene: Scene, motion: Motion, places: Floats) -> None:
    """Raise InputError if an initial displacement of the bodies closes a gap.

    motion : of all sectors
    places : (n,), m, what is added to the rotor's displacement, of an unbalance
    """
    if scene.start_as != "both":
        return
    rest = model.clearances(scene.gap) + departure_at_start(scene, model.angles)
    rest -= places[model.places[0]]
    moved = gaps_of(model, 0.0, motion.rotor, motion.casing, 0.0)
    moved -= model.clearances(0.0)
    closing = moved < 0.0
    if scene.engine.rotor.lost_blade != NO_BLADE:
        closing[scene.engine.rotor.lost_blade] = False
    if not (closing & (rest + moved < CLOSED * scene.gap)).any():
        return
    share = max(float((rest[closing] / -moved[closing]).min()), 0.0)
    msg = "start_energy must leave the gaps open, which this direction does up to "
    msg += f"{scene.start_energy * share**2:.4g} J (start_as = {shown('velocities')} "
    msg += f"does always), got {scene.start_energy:g} J"
    raise InputError(msg)


def direction(
    model: Model, speed: float, modes: str, draw: float, how: str
) -> Amplitudes:
    """Return a random motion of the chosen modes, with an energy of some 1 J.

    Its amplitudes and rates are scaled later to the energy `start_energy`.

    Parameters
    ----------
    model, speed : of all sectors; Omega, rad/s
    modes, draw, how : the inputs start_modes, start_draw and start_as
    """
    rotor, casing = names_of(model), casing_names(model)
    of_casing = np.zeros(0) if model.casing is None else model.casing.omega
    bodies = (rotor, model.rotor.omega), (casing, of_casing)
    _check(modes, [*rotor, *casing])
    found, shares = list[Floats](), 0.0
    for names, omega in bodies:
        parts = np.zeros((2, len(names)))
        for mode, name in _chosen(names, modes):
            still = how != "both" or omega[mode] == 0.0
            parts[0, mode] = 0.0 if still else _normal(draw, "place", name)
            parts[1, mode] = _normal(draw, "rate", name)
        shares += float((parts**2).sum()) / 2.0
        chosen = np.flatnonzero(parts[0])
        parts[0, chosen] /= omega[chosen]
        if names is rotor and model.rotor.spin is not None:
            parts[0, chosen] = _softened(model, speed, chosen, parts[0, chosen])
        found += [parts[0], parts[1]]
    return Amplitudes(*(part / math.sqrt(shares) for part in found))


def _softened(model: Model, speed: float, chosen: Indices, places: Floats) -> Floats:
    """Return amplitudes on the shell at a speed from those on the shell at rest, (m,).

    They are K^(-1/2) Lambda^(1/2) q, Lambda and K being the stiffness at rest and at
    speed; unchanged where K is not positive definite.

    chosen, places : (m,), indices of modes of the rotor; q, their amplitudes
    """
    omega = model.rotor.omega[chosen]
    values, shapes = np.linalg.eigh(_stiffness(model, speed, chosen))
    if not values.min(initial=math.inf) > STIFF * values.max(initial=0.0):
        return places
    return np.asarray((shapes / np.sqrt(values)) @ (shapes.T @ (omega * places)))


def _stiffness(model: Model, speed: float, chosen: Indices) -> Floats:
    """Return the stiffness at speed of some modes of the rotor, (m, m).

    speed, chosen : Omega, rad/s; (m,), indices of the modes
    """
    rotor, spin = model.rotor, model.rotor.terms
    shapes = rotor.shapes[:, chosen]
    out = np.diag(rotor.omega[chosen] ** 2)
    out += shapes.T @ stiffening_at(spin, speed) @ shapes
    if has_centre(rotor, model.blades):
        hub = centre_rows(rotor, model.blades)[:, chosen]
        out += spin.support.at(speed).turning(speed).real * (hub.T @ hub)
    for one in spin.stations:
        rows = one.rows @ shapes
        out += one.support.at(speed).turning(speed).real * (rows.T @ rows)
    return np.asarray((out + out.T) / 2)


def _normal(draw: float, part: str, name: str) -> float:
    """Return a normally distributed number that depends on nothing but the arguments.

    draw, part : the input start_draw; "place" for an amplitude, "rate" for its velocity
    name : label of a mode
    """
    from scipy.special import ndtri  # slow to import

    told = hashlib.sha256(f"{draw!r} {part} {name}".encode()).digest()
    whole = int.from_bytes(told[:8]) >> (64 - BITS)
    return float(ndtri((whole + 0.5) / 2**BITS))


@lru_cache(maxsize=MOST_KEPT)
def names_of(model: Model) -> list[Name]:
    """Return the name of each mode of the rotor: body, family and nodal diameter."""
    own = model.rotor
    families = {int(k): family_ranks(own, int(k)) for k in np.unique(own.diameter)}
    pairs = zip(own.diameter.tolist(), own.rank.tolist(), strict=True)
    return [("rotor", families[k][rank], str(k)) for k, rank in pairs]


@lru_cache(maxsize=MOST_KEPT)
def casing_names(model: Model) -> list[Name]:
    """Return the name of each mode of the casing: body, family and nodal diameter."""
    own = model.casing
    if own is None:
        return []
    pairs = zip(own.diameter.tolist(), own.rank.tolist(), strict=True)
    return [("casing", f"{rank + 1}F", str(k)) for k, rank in pairs]


def _chosen(names: list[Name], modes: str) -> Iterator[tuple[int, str]]:
    """Yield (index, label) of each mode that the input start_modes chooses.

    A label is a mode's name and its number among the modes of this name, of which a
    pair has two.

    names, modes : body, family and nodal diameter of each mode; the input
    """
    parts = _parts(modes)
    met = Counter[Name]()
    for mode, name in enumerate(names):
        if any(part <= {*name} for part in parts):
            yield mode, f"{' '.join(name)} {met[name]}"
        met[name] += 1


def _parts(modes: str) -> list[set[str]]:
    """Return the sets of words between the commas of the input start_modes."""
    return [{*part.split()} for part in modes.split(",")]


def _check(modes: str, names: list[Name]) -> None:
    """Raise InputError if a part of the input start_modes chooses no mode.

    names : body, family and nodal diameter of each mode of the model
    """
    if all(p and any(p <= {*name} for name in names) for p in _parts(modes)):
        return
    known = sorted({f"{body} {family}" for body, family, _ in names})
    msg = "start_modes must choose modes of the model by body, family and nodal "
    msg += f"diameter, such as {shown('rotor suspension, casing 1F 2')}; there are "
    raise InputError(f"{msg}{', '.join(known[-8:])}, got {shown(modes)}")


def energy_of(model: Model, speed: float, state: Amplitudes) -> float:
    """Return the energy, J, of a motion relative to the steady one, as in the ledger.

    It is the sum of 1/2 (dq/dt)^2 + 1/2 omega^2 q^2 over the modes of both bodies; of a
    rotor with terms of rotation the strain energy is 1/2 q^T K(Omega) q, with that of
    its supports.

    speed, state : Omega, rad/s; the motion in modal amplitudes
    """
    total = 0.0
    pairs = (model.rotor, state[:2]), (model.casing, state[2:])
    for body, (q, rate) in pairs:
        if body is None:
            continue
        total += 0.5 * float(rate @ rate)
        if body.spin is None:
            total += 0.5 * float((body.omega * q) @ (body.omega * q))
            continue
        moved = np.flatnonzero(q)
        total += 0.5 * float(q[moved] @ _stiffness(model, speed, moved) @ q[moved])
    return total
