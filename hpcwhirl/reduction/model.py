"""The mechanical model of a scene: both bodies by their modes, and where they touch.

The contact operator gives the casing's displacements at the contact points, and the
loads on the casing of forces there.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from scipy.linalg import eigh

from hpcwhirl.arrays import Floats, Integers
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.bodies import casing_model, file_model, rotor_model
from hpcwhirl.reduction.equilibrium import loaded
from hpcwhirl.reduction.modes import ModalModel, has_centre, stiffening_at
from hpcwhirl.reduction.numbers import representable
from hpcwhirl.reduction.round_casing import check_lobes
from hpcwhirl.scene import Casing, Rotor, Scene, content_digest
from hpcwhirl.structure import FourierOperator, RingOperator

MOST_KEPT = 32  # number of cached models, 100 kB to some MB each


@dataclass(frozen=True, eq=False)  # compared by identity, see `model_of`
class Model:
    """The mechanical model that is integrated: bladed disk, and casing around it.

    If load and engine repeat g times around the circumference, only one of g equal
    sectors is integrated, and the model is that of the sector.

    Attributes
    ----------
    rotor, casing : modes of the bodies; the casing's are None if it is rigid
    ring : contact operator, which gives the casing's displacements at angles, and loads
        on its coordinates from forces there; None if the casing is rigid
    blades : number of blades N, those of the sector if g > 1
    folds : g; 1 if the whole engine is integrated
    lifts : for g > 1, matrices (n, m) for rotor and casing from the sector's m
        amplitudes to the n displacements of the whole body
    """

    rotor: ModalModel
    casing: ModalModel | None
    ring: RingOperator | FourierOperator | None
    blades: int
    folds: int = 1
    lifts: tuple[Floats, Floats] | None = None

    @property
    def shapes(self) -> tuple[Floats, Floats]:
        """Mode shapes of rotor and of casing, (n, m) each, of m modes of the body."""
        casing = np.zeros((0, 0)) if self.casing is None else self.casing.shapes
        return self.lifts or (self.rotor.shapes, casing)

    @property
    def each(self) -> int:
        """Number of contact points per blade, n_c."""
        return 1 if self.rotor.points is None else self.rotor.points.count

    @property
    def contacts(self) -> int:
        """Number of contact points, N n_c, of N blades with n_c points each."""
        return self.blades * self.each

    @property
    def places(self) -> tuple[Integers, Integers]:
        """Indices of the contact points' coordinates among those of the rotor.

        Those of radial, and of tangential displacements, (N n_c,) each.
        """
        points = self.rotor.points
        if points is None:
            tips = np.arange(0, 2 * self.blades, 2)
            return tips, tips + 1
        return points.radial.ravel(), points.tangential.ravel()

    @property
    def angles(self) -> Floats:
        """Angles of the contact points from blade 0, (N n_c,), rad, blade by blade."""
        angle = 2.0 * math.pi * np.arange(self.blades) / self.blades
        points = self.rotor.points
        if points is None:
            return angle
        return np.add.outer(angle, points.angle).ravel()

    @property
    def stations(self) -> Floats:
        """Axial positions of contact points, (N n_c,), m, 0 in the casing's middle."""
        points = self.rotor.points
        return np.zeros(self.contacts) if points is None else self._by_point("station")

    def clearances(self, gap: float) -> Floats:
        """Return the clearances of all N n_c contact points, (N n_c,), m.

        gap : m, gap of the scene, to which the tip's profile is added
        """
        if self.rotor.points is None:
            return np.full(self.blades, gap)
        return gap + self._by_point("gap")

    def _by_point(self, name: str) -> Floats:
        return np.tile(getattr(self.rotor.points, name), self.blades)

    def limits(self, speed: float) -> dict[str, float]:
        """Return the largest stable time step of each body, {body: 2 / omega_max, s}.

        speed : rad/s. The rotor's omega_max includes its stiffening with the speed and
            the supports in their stiffer direction. Coriolis forces do no work and do
            not limit the step.
        """
        bodies = {"rotor": self.rotor, "casing": self.casing}
        each = {n: b for n, b in bodies.items() if b}
        return {n: 2.0 / highest(b, speed, self.blades) for n, b in each.items()}


def why_unknown(model: Model) -> str:
    """Return why loads of a shaft do not follow from the motion; "" if they do."""
    if not model.rotor.has_matrices:
        return "of a file with modes only, what holds the rotor is unknown"
    if not has_centre(model.rotor, model.blades):
        return "a clamped centre has no supports"
    return ""


def highest(body: ModalModel, speed: float, blades: int) -> float:
    """Return the highest natural frequency of a body at a speed, rad/s.

    It follows from the stiffness at this speed, without Coriolis forces, and limits the
    time step.

    body, blades : modal model of rotor or casing; number of blades
    speed : Omega, rad/s
    """
    if body.spin is None:
        return float(body.omega.max())
    stiffness = body.stiffness + stiffening_at(body.spin, speed)
    if has_centre(body, blades):
        hub = 2 * blades + np.arange(2)
        stiffness[hub, hub] += body.spin.support.at(speed).stiffest(speed)
    for one in body.spin.stations:
        stiffest = one.support.at(speed).stiffest(speed)
        stiffness += stiffest * one.rows.T @ one.rows
    last = len(stiffness) - 1
    squared = eigh(stiffness, body.mass, eigvals_only=True, subset_by_index=(last,) * 2)
    return float(np.sqrt(max(squared[0], np.finfo(float).tiny)))


def model_of(scene: Scene) -> Model:
    """Return the model of a scene with the scene's number of modes; R_c = R_bd + gap.

    Scenes with the same engine and reduction share one object while it is among the
    `MOST_KEPT` last used; a file with changed content counts as another engine.

    Raises
    ------
    InputError
        if the model of these inputs cannot be computed in double precision
    """
    rotor, casing, file = scene.engine.rotor, scene.engine.casing, scene.engine.file
    content, ring = content_digest(file), None
    if casing.kind != "rigid":
        source = (file, content) if casing.discretization == "file" else ("", "")
        if source[0]:
            check_lobes(*source, scene.nodal_diameter)
        ring = casing, rotor.radius + scene.gap, source
    modes = _modes_of_file(scene) if file else scene.solver.modes
    found = _model(rotor, modes, (file, content), ring, scene.engine.rotation)
    return _loaded(found, cmath.rect(scene.gravity, scene.gravity_angle))


@lru_cache(maxsize=MOST_KEPT)
def _loaded(model: Model, weight: complex) -> Model:
    """Return a model whose bearings are those of its equilibrium under its weight.

    weight : g_x + i g_y, m/s^2
    """
    rotor = loaded(model.rotor, model.blades, weight)
    return model if rotor is model.rotor else replace(model, rotor=rotor)


def _modes_of_file(scene: Scene) -> int | None:
    """Return how many fixed-interface modes are kept of a scene's rotor from file.

    None: all of them.
    """
    if scene.solver.truncation == 0.0 or not has_families(scene):
        return None
    return scene.solver.modes


def has_families(scene: Scene) -> bool:
    """Return whether the rotor's modes form families and the casing's are harmonics.

    They do if all sectors of the rotor are equal and the casing is not made of finite
    elements.
    """
    engine = scene.engine
    if not scene.has_harmonics or engine.rotor.is_uneven:
        return False
    if not engine.file:
        return True
    source = engine.file, content_digest(engine.file)
    with representable("the rotor"):
        return file_model(*source, engine.rotor, rotation=engine.rotation).cyclic


def is_cyclic(model: Model) -> bool:
    """Return whether a model's rotor can be integrated as modes by nodal diameter.

    Each mode is two waves, so that sectors must be equal, the casing
    rigid or a ring of harmonics, and rotation must not couple modes. At least three
    blades are needed, because with fewer, nodal diameter 1 has one phase but moves both
    coordinates of the centre; the model of one of several sectors that move alike has
    no centre, and may have fewer.
    """
    plain = isinstance(model.ring, RingOperator) or not model.rotor.cyclic
    plain = plain or model.rotor.spin is not None
    return not plain and (model.blades > 2 or model.folds > 1)


def has_waves(model: Model) -> bool:
    """Return whether a model's rotor can be integrated as waves by nodal diameter.

    It can with equal sectors and terms of rotation, except with fewer than three
    blades, where nodal diameter 1 has both coordinates of the centre, and with a ring
    of elements, which is not the same at every angle.
    """
    spin, alike = model.rotor.spin, not isinstance(model.ring, RingOperator)
    return alike and spin is not None and bool(spin.waves)


@lru_cache(maxsize=MOST_KEPT)
def _model(
    rotor: Rotor,
    modes: int | None,
    source: tuple[str, str],
    ring: tuple[Casing, float, tuple[str, str]] | None,
    rotation: str,
) -> Model:
    """Return the model of an engine; cached by the inputs that determine it.

    Parameters
    ----------
    rotor, rotation : inputs of the rotor; "none" or "full"
    modes : number of fixed-interface modes to keep; None: all of a file
    source : path of the engine's file and SHA-256 of its content; ("", "") without a
        file
    ring : arguments of `casing_model`; None: the casing is rigid
    """
    with representable("the rotor"):
        if source[0]:
            body = file_model(*source, rotor, modes, rotation)
        else:
            body = rotor_model(rotor, modes or 0, rotation)
    if ring is None:
        return Model(body, None, None, rotor.blades)
    with representable("the casing"):
        casing, operator = casing_model(*ring, wide=body.points is not None)
    model = Model(body, casing, operator, rotor.blades)
    _check_stations(model, source[0])
    return model


def _check_stations(model: Model, file: str) -> None:
    """Raise InputError where contact points of a tip lie beyond the casing's ends."""
    points, ring = model.rotor.points, model.ring
    if points is None or not isinstance(ring, FourierOperator):
        return
    least, most = ring.axial.ends
    beyond = points.station[(points.station < least) | (points.station > most)]
    if len(beyond):
        raise InputError(
            f"engine.file {file} has rotor/tip_station {beyond[0]:g} m, beyond the "
            f"casing, which reaches from {least:g} to {most:g} m"
        )
