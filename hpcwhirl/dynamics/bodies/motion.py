"""The physical state of a march: displacements and velocities of rotor and casing.

It is expressed in coordinates that all schemes share, those of the matrices of the
whole model: of the rotor in the rotating frame, of the casing in the static frame. So a
march can begin with the last state of another one that had another scheme, speed, gap
or friction. If the modes differ, the state is projected onto the new ones,
M-orthogonally.

A march begins with the rotor at angle 0. A motion that was read at another angle is
`turned`: rotor and casing are rotated back together, which makes no difference, since
casing and supports are the same in all directions (`check_continuable`).

The state of the loop `bodies` has increments d = x_n - x_{n-1} instead of velocities v.
They are related by a step without forces, d' = keep d - pull x, v = (d + d') / 2 dt.
The relation is inverted exactly: a free motion that is read and begun again is the
uninterrupted one, to round-off.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple, Protocol

import numpy as np

from hpcwhirl.arrays import Floats
from hpcwhirl.case.profile import is_round
from hpcwhirl.dynamics.bodies.timestep import recursion
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.model import MOST_KEPT, Model
from hpcwhirl.reduction.modes import ModalModel
from hpcwhirl.scene import Scene
from hpcwhirl.scene.contact_laws import RIGID

BODIES = "rotor", "casing"
SAME = 1e-8  # largest relative part of a motion by which its sectors may differ


class Motion(NamedTuple):
    """Displacements and velocities of rotor and casing, in the model's coordinates.

    Attributes
    ----------
    rotor, rotor_velocity : (n,), m, m/s, rotating frame
    casing, casing_velocity : (c,), m, m/s, static frame; (0,) of a rigid casing
    angle : rad, by which the rotor has turned since the start
    """

    rotor: Floats
    rotor_velocity: Floats
    casing: Floats
    casing_velocity: Floats
    angle: float = 0.0


class Amplitudes(NamedTuple):
    """Modal amplitudes of rotor and casing, and their velocities.

    Attributes
    ----------
    rotor, rotor_rate : (m,), sqrt(kg) m, sqrt(kg) m/s
    casing, casing_rate : (c,), sqrt(kg) m, sqrt(kg) m/s
    """

    rotor: Floats
    rotor_rate: Floats
    casing: Floats
    casing_rate: Floats


class Steps(Protocol):
    """Conversion between a body's velocities and the increments in a kernel's state.

    A state has d = x_n - x_{n-1} instead of velocities v; x are displacements or modal
    amplitudes.
    """

    def velocities(self, x: Floats, d: Floats, time: float = 0.0) -> Floats:
        """Return a body's velocities v, (n,), from x and increments d = x_n - x_{n-1}.

        x, time : (n,), displacements or modal amplitudes of the body; s, of x_n
        """

    def increments(self, x: Floats, v: Floats, time: float = 0.0) -> Floats:
        """Return a body's increments d = x_n - x_{n-1}, (n,), from x and velocities v.

        x, time : (n,), displacements or modal amplitudes of the body; s, of x_n
        """


@dataclass(frozen=True)
class CentralSteps:
    """Conversion between velocities and increments of a body, for central differences.

    A step without contact is d' = keep d - pull x; d = x_n - x_{n-1} and d' are the
    last and the next increment of x, displacements or modal amplitudes. The velocity is
    (d + d') / 2 dt.

    keep, pull : (n,) for modes, or (n, n) for displacements
    step : dt, s
    """

    keep: Floats
    pull: Floats
    step: float

    def velocities(self, x: Floats, d: Floats, _: float = 0.0) -> Floats:
        """Return a body's velocities (d + d') / 2 dt, with d' = keep d - pull x.

        x, d : (n,), displacements or amplitudes, and their increments in the last step
        """
        ahead = _times(self.keep, d) - _times(self.pull, x)
        return np.asarray((d + ahead) / (2 * self.step))

    def increments(self, x: Floats, v: Floats, _: float = 0.0) -> Floats:
        """Return a body's increments d, which solve (1 + keep) d = 2 dt v + pull x.

        They are those of the last step, (n,).

        x, v : (n,), displacements or amplitudes, and velocities
        """
        right = 2 * self.step * v + _times(self.pull, x)
        if self.keep.ndim == 1:
            return np.asarray(right / (1 + self.keep))
        return np.asarray(np.linalg.solve(np.eye(len(right)) + self.keep, right))


def _times(matrix: Floats, x: Floats) -> Floats:
    return matrix * x if matrix.ndim == 1 else np.asarray(matrix @ x)


@lru_cache(maxsize=MOST_KEPT)
def modal_steps(body: ModalModel | None, step: float) -> Steps:
    """Return the conversion between velocities and increments of modes, cached.

    body, step : modes without terms of rotation, None for a rigid casing; dt, s
    """
    omega = body.omega if body else np.zeros(0)
    ratios = body.ratios if body else np.zeros(0)
    keep, pull, _ = recursion(omega, ratios, step)
    return CentralSteps(keep, pull, step)


def amplitudes(model: Model, motion: Motion) -> Amplitudes | None:
    """Return a motion as amplitudes of the modes of a model, of all sectors or of one.

    Return None if the model is of one sector and the motion differs between sectors. A
    part of the motion that no modes of the model represent is lost.

    Raises
    ------
    InputError
        if the number of coordinates of a body differs from that of the motion
    """
    check_sizes(model, motion)
    own, beside = model.shapes
    pairs = (
        (model.rotor, own, (motion.rotor, motion.rotor_velocity)),
        (model.casing, beside, (motion.casing, motion.casing_velocity)),
    )
    found: list[Floats] = []
    for body, lift, values in pairs:
        if body is None:
            found += values
            continue
        lower = lowering(body, lift)
        for x in values:
            q = lower @ x
            if model.folds > 1 and not _repeats(x, lift @ q):
                return None
            found.append(q)
    return Amplitudes(*found)


def after_loss(model: Model, motion: Motion) -> Motion:
    """Return a motion in the coordinates of the rotor that has lost a blade.

    model, motion : of this rotor; of the rotor with all its blades
    """
    into = model.rotor.into_whole
    if into is None:
        return motion
    pair = np.stack([motion.rotor, motion.rotor_velocity], axis=1)
    x, v = np.linalg.solve(into, pair).T
    return motion._replace(rotor=x, rotor_velocity=v)


def check_sizes(model: Model, motion: Motion) -> None:
    """Raise InputError if a motion has another number of coordinates than a model.

    The numbers are compared for the rotor and for the casing.
    """
    values = motion.rotor, motion.casing
    for name, x, size in zip(BODIES, values, map(len, model.shapes), strict=True):
        if len(x) != size:
            raise InputError(
                f"a motion can be continued only by a {name} with the same number of "
                f"coordinates: it has {len(x)}, the {name} of this case {size}"
            )


def lowering(body: ModalModel, lift: Floats) -> Floats:
    """Return the matrix (m, n) that gives a body's modal amplitudes from displacements.

    It is lift^T M if M is known, else the pseudo-inverse of `lift`.

    lift : (n, m), displacements for unit amplitudes

    Raises
    ------
    InputError
        if displacements do not determine the amplitudes
    """
    if body.has_matrices:
        return np.asarray(lift.T @ body.mass)
    rank = int(np.linalg.matrix_rank(lift))
    if rank < lift.shape[1]:
        raise InputError(
            "a motion cannot be continued with the modes of this file: a body has "
            f"{lift.shape[1]}, and its displacements determine only {rank} of them"
        )
    return np.asarray(np.linalg.pinv(lift))


def _repeats(x: Floats, found: Floats) -> bool:
    return bool(np.linalg.norm(x - found) <= SAME * np.linalg.norm(x))


def gaps_of(
    model: Model, gap: float, rotor: Floats, casing: Floats, angle: float
) -> Floats:
    """Return the gaps of all contact points, (N n_c,), m, at an angle of the rotor.

    Parameters
    ----------
    model : model of all sectors or of one; a rigid casing must have no lobes
    gap : m
    rotor, casing : (n,), (c,), m, displacements in the coordinates of the model
    angle : rad, of blade 0; in a model of one of g sectors, g times that angle
    """
    gaps = model.clearances(gap) - rotor[model.places[0]]
    if model.ring is None:
        return np.asarray(gaps)
    rows = model.ring.rows(angle + model.angles, model.stations)[0]
    return np.asarray(gaps + rows @ casing)


def turned(model: Model, motion: Motion) -> Motion:
    """Return a motion with its casing turned back, so that the rotor is at angle 0.

    A march starts at that angle; the motion may have been read at another.

    model : of all sectors
    """
    if model.ring is None or motion.angle == 0.0:
        return motion._replace(angle=0.0)

    values = motion.casing, motion.casing_velocity
    casing, velocity = (model.ring.turned(x, motion.angle) for x in values)
    return motion._replace(casing=casing, casing_velocity=velocity, angle=0.0)


def check_continuable(model: Model, scene: Scene) -> None:
    """Raise InputError if no march of a scene can start from another's motion.

    A motion that was read at another angle of the rotor is turned back to angle 0,
    where the new march starts. So casing and supports must be the same at all angles.
    """
    spin, casing = model.rotor.spin, scene.engine.casing
    if casing.contact_law != RIGID:
        raise InputError(
            "a motion cannot be continued with a layer that wears: casing.contact_law "
            f"must be {RIGID}, got {casing.contact_law}"
        )
    if spin is not None and not spin.is_round:
        raise InputError(
            "a motion can be continued only on supports that are alike in x and y: "
            "those of this engine differ"
        )
    if not is_round(scene):
        raise InputError(
            "a motion can be continued only in a round casing: profile must be empty, "
            f"and offset 0 m, got {casing.offset:g}"
        )
    if model.casing is None and casing.amplitude != 0.0:
        raise InputError(
            "a motion can be continued only in a rigid casing without lobes: amplitude "
            f"must be 0 m, got {casing.amplitude:g}"
        )
