"""Constant arrays of the loop `kernels.oracle.bodies`: rotor, casing and contact.

They are made once per case: coefficients of a time step of a body, as modes or as
matrices; compliances of contact; the pulse; the rods of a layer that wears. Other time
loops use the same friction and layer.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from hpcwhirl.arrays import Floats
from hpcwhirl.case.unbalance import circle
from hpcwhirl.dynamics.bodies.pulse import pulse_load
from hpcwhirl.dynamics.bodies.timestep import recursion
from hpcwhirl.dynamics.bodies.turning import (
    ALIKE,
    Outputs,
    Turning,
    body_of,
    circling,
    coupled_body,
    standing,
    turning,
)
from hpcwhirl.dynamics.kernels.contact import ELEMENTS, RIGID, WAVES
from hpcwhirl.dynamics.kernels.kernel_types import (
    NOTHING,
    Arrays,
    Body,
    Contact,
    Coulomb,
    Layer,
    Load,
    Points,
    Ring,
    Rods,
    Stand,
)
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.bodies import centre_rows, contact_rows
from hpcwhirl.reduction.model import Model
from hpcwhirl.reduction.modes import ModalModel, has_centre
from hpcwhirl.scene import Scene, contact_laws
from hpcwhirl.scene.contact_laws import PERMANENT
from hpcwhirl.scene.kept_tables import kept_rows
from hpcwhirl.structure import FourierOperator

EMPTY = np.zeros((0, 0))  # matrix of a body that is absent
NO_SLIDES = Coulomb(
    0.0, 0.0, 0.0, 0.0, EMPTY, EMPTY, np.zeros(0), always=False
)  # of permanent sliding


def friction_with_sign(scene: Scene, speed: float | None = None) -> float:
    """Return mu sign(Omega): friction opposes the rotation and is 0 at Omega = 0.

    mu is the coefficient of the scene's friction law at the speed.

    speed : Omega, rad/s; None: that of the scene
    """
    own = scene.speed if speed is None else speed
    return float(scene.coefficient_at(own) * np.sign(own))


def _modal_body(body: ModalModel | None, step: float, rows: Outputs) -> Body:
    """Return the time loop's arrays of a body as uncoupled modes, a block for each.

    body, step : the modes; None for a rigid casing, which has none; dt, s
    """
    if body is None:
        return body_of_modes(np.zeros(0), np.zeros(0), step, rows)
    return body_of_modes(body.omega, body.ratios, step, rows)


def body_of_modes(omega: Floats, ratios: Floats, step: float, rows: Outputs) -> Body:
    """Return the time loop's arrays of uncoupled modes, a block for each.

    omega, ratios, step : (n,), rad/s; (n,), damping ratios; dt, s
    rows : what the modes move
    """
    keep, pull, give = recursion(omega, ratios, step)
    mass, damping = np.ones(len(omega)), 2 * ratios * omega
    matrices = Turning(keep, pull, give, mass, omega**2, damping, NOTHING)
    return body_of(matrices, np.arange(len(omega) + 1), rows)


def _dense_body(body: ModalModel | None, step: float, rows: Outputs) -> Body:
    """Return the time loop's arrays of a body as dense matrices.

    body : matrices of the body; None: a rigid casing, which has none
    step : dt, s
    """
    if body is None:
        return _modal_body(None, step, rows)
    damping = body.damping_matrix()
    left, one = body.mass / step**2 + damping / (2 * step), np.eye(len(body.mass))
    inverse = np.linalg.solve(left, one)
    # a product with M / dt^2 would let the energy drift by its round-off: 2e-10 of it
    # in 20,000 steps, instead of 1e-12
    keep = one - inverse @ (damping / step)
    matrices = Turning(
        keep, inverse @ body.stiffness, (inverse + inverse.T) / 2,
        body.mass, body.stiffness, damping, EMPTY,
    )  # fmt: skip
    return _one_block(matrices, rows)


def _turning_body(model: Model, scene: Scene, rows: Outputs) -> Body:
    """Return the time loop's arrays of a rotor with terms of rotation, as matrices."""
    step, still = turning(model, scene), circle(model, scene)
    stand = standing(model, scene, step.inverse, np.eye(len(step.keep)))
    if still is None:
        return _one_block(step, rows, stand)
    padded = Outputs._make(np.pad(part, ((0, 0), (0, 1))) for part in rows)
    body = _one_block(circling(step, still), padded, stand)
    return body._replace(still=np.append(still, 1.0))


def _one_block(step: Turning, rows: Outputs, stand: Stand = ALIKE) -> Body:
    """Return the time loop's arrays of a body as matrices; `step` : of `Turning`."""
    starts = np.array([0, len(step.keep)])
    blocks = Turning._make(np.ascontiguousarray(part.T).ravel() for part in step)
    return body_of(blocks, starts, rows, stand)


def rotor_compliance(model: Model, scene: Scene, mu: float) -> Floats:
    """Return the rotor's part of the Delassus matrix, (N, N), m/N.

    Entry [i, j] is the inward displacement of tip i, at the end of a step, due to a
    unit normal force on tip j and its friction. With several contact points a tip it is
    that of all points, (N n_c, N n_c).

    mu : friction with the sign of the speed
    """
    radial, tangential = contact_rows(model.rotor, model.blades)
    moved = _moved(model, scene, radial)
    return np.ascontiguousarray(moved @ (radial + mu * tangential).T)


def _moved(model: Model, scene: Scene, rows: Floats) -> Floats:
    """Return how unit forces on the rotor's modes move rows (r, m) in a step, m/N."""
    if model.rotor.spin is not None:
        return np.asarray(rows @ turning(model, scene, model.rotor.shapes).inverse)
    _, _, give = recursion(
        model.rotor.omega, model.rotor.ratios, scene.solver.time_step
    )
    return rows * give


def ring_compliance(model: Model, step: float, mu: float) -> Floats:
    """Return the radial displacements of an elastic ring by unit forces, (R, R), m/N.

    Row i has those at the end of a step due to a unit normal force, and its friction,
    on radial coordinate i; (0, 0) for a rigid casing.

    step, mu : dt, s; friction with the sign of the speed
    """
    if model.casing is None or model.ring is None:
        return EMPTY
    _, _, give = recursion(model.casing.omega, model.casing.ratios, step)
    outward = model.casing.shapes[model.ring.radial]
    along = model.casing.shapes[model.ring.tangential]
    return np.asarray(((outward + mu * along) * give) @ outward.T)


def contact_operators(model: Model, scene: Scene) -> Contact:
    """Return the constants of contact: compliances, contact points and layer.

    Compliances, m/N, give the displacements at the end of a step due to a unit normal
    force and its friction (the corrections of Algorithm 1), by (M/dt^2 + D/2dt)^-1 =
    Phi diag(give) Phi^T: the rotor's part of the Delassus matrix, and for the ring, in
    row i, all radial displacements due to a force on radial coordinate i.
    """
    step, mu = scene.solver.time_step, friction_with_sign(scene)
    each = rotor_compliance(model, scene, mu), ring_compliance(model, step, mu)
    lost, kind = scene.engine.rotor.lost_blade, ring_kind(model)
    points, layer = points_of(model), layer_of(scene)
    return Contact(*each, kind, lost, points, layer, coulomb_of(model, scene))


def coulomb_of(model: Model, scene: Scene) -> Coulomb:
    """Return the law of set-valued friction, with empty arrays if sliding is permanent.

    Its matrices give how unit contact forces, normal and of friction, move the contact
    points of both bodies, outward or along theta, at the end of a step.
    """
    if scene.slip == PERMANENT:
        return NO_SLIDES
    step, ring = scene.solver.time_step, EMPTY
    rows = np.vstack(contact_rows(model.rotor, model.blades))
    if model.casing is not None and model.ring is not None:
        _, _, give = recursion(model.casing.omega, model.casing.ratios, step)
        shapes = model.casing.shapes
        both = np.vstack([shapes[model.ring.radial], shapes[model.ring.tangential]])
        ring = np.ascontiguousarray((both * give) @ both.T)
    return coulomb_law(scene, (_moved(model, scene, rows) @ rows.T).T, ring)


def coulomb_law(
    scene: Scene, rotor: Floats, ring: Floats = EMPTY, folds: int = 1
) -> Coulomb:
    """Return the law of set-valued friction of a scene.

    rotor, ring : responses, see `kernels.kernel_types.Coulomb`
    folds : number of sectors, of which one is integrated, at so many times the speed
    """
    decay = scene.friction_speed if scene.friction_law == "stribeck" else 0.0
    rubs = wears(scene) and layer_of(scene).rub > 0.0
    return Coulomb(
        scene.friction, scene.friction_at_rest, decay,
        scene.engine.rotor.radius / folds, np.ascontiguousarray(rotor), ring,
        _over_slip(scene),
        scene.friction_law != "constant" or rubs,
    )  # fmt: skip


def _over_slip(scene: Scene) -> Floats:
    """Return the table of friction over sliding speed, of a set-valued law."""
    if not scene.friction_table:
        return np.zeros(0)
    return np.array(kept_rows(scene.friction_table)).T.ravel()


def points_of(model: Model) -> Points:
    """Return angles, clearances and axial weights of the contact points of all tips.

    Points are listed blade by blade.
    """
    turn, points = np.arange(model.blades) / model.blades, model.rotor.points
    if points is not None:
        turn = np.add.outer(turn, points.angle / (2.0 * math.pi)).ravel()
    weight = np.ones((model.contacts, 1))
    if isinstance(model.ring, FourierOperator):
        weight = np.ascontiguousarray(model.ring.axial.at(model.stations))
    return Points(model.angles, turn, model.clearances(0.0), weight)


def ring_kind(model: Model) -> Ring:
    """Return how a casing is discretised: rigid, of elements, or of harmonics.

    With the kind come the number of elements or the highest harmonic, and the length of
    an element, m.
    """
    if model.ring is None:
        return Ring(RIGID, 0, 1.0)
    if isinstance(model.ring, FourierOperator):
        return Ring(WAVES, model.ring.harmonics, 1.0)
    return Ring(ELEMENTS, model.ring.elements, model.ring.length)


def modal_arrays(model: Model, scene: Scene) -> Arrays:
    """Return the arrays of `kernels.oracle.bodies` for both bodies as modes.

    If the terms of rotation are included, they couple the rotor's modes.
    """
    step = scene.solver.time_step
    if model.rotor.spin is None:
        hub = centre_rows(model.rotor, model.blades)
        own = Outputs(*contact_rows(model.rotor, model.blades), hub)
        rotor = _modal_body(model.rotor, step, own)
    else:
        rotor = coupled_body(model, scene)
    beside, lobes = Outputs(EMPTY, EMPTY, EMPTY), np.zeros(0)
    if model.casing is not None and model.ring is not None:
        shapes, ring = model.casing.shapes, model.ring
        beside = Outputs(shapes[ring.radial], shapes[ring.tangential], shapes[:0])
        lobes = pulse_load(model, scene) @ shapes
    casing = _modal_body(model.casing, step, beside)
    load = Load(scene.force, scene.pulse, lobes)
    return Arrays(load, rotor, casing, contact_operators(model, scene))


def dense_arrays(model: Model, scene: Scene) -> Arrays:
    """Return the arrays of `kernels.oracle.bodies` for both bodies as matrices.

    Scheme `paper` needs them. Raise InputError if a body has no matrices M and K.
    """
    if not model.rotor.has_matrices:
        raise InputError(
            "scheme paper needs M and K, which engine.file lacks: scheme must be "
            "'modal' or 'general', got 'paper'"
        )
    if model.casing is not None and not model.casing.has_matrices:
        raise InputError(
            "scheme paper needs M and K of the casing: families must be 'all', and "
            "discretization not 'file', nor 'shell' with one contact point a tip, got "
            f"'{scene.engine.casing.families}' and "
            f"'{scene.engine.casing.discretization}'"
        )
    step, size = scene.solver.time_step, len(model.rotor.mass)
    hub = np.zeros((2, size))
    if has_centre(model.rotor, model.blades):
        hub[[0, 1], [2 * model.blades, 2 * model.blades + 1]] = 1.0
    radial, tangential = (np.eye(size)[places] for places in model.places)
    own = Outputs(radial, tangential, hub)
    if model.rotor.spin is None:
        rotor = _dense_body(model.rotor, step, own)
    else:
        rotor = _turning_body(model, scene, own)
    beside = Outputs(EMPTY, EMPTY, EMPTY)
    if model.casing is not None and model.ring is not None:
        one, ring = np.eye(len(model.casing.mass)), model.ring
        beside = Outputs(one[ring.radial], one[ring.tangential], one[:0])
    casing = _dense_body(model.casing, step, beside)
    load = Load(scene.force, scene.pulse, pulse_load(model, scene))
    return Arrays(load, rotor, casing, contact_operators(model, scene))


def rod_area(scene: Scene) -> float:
    """Return the area A, m^2, that a rod of the layer has at the casing's surface.

    It is the layer's axial width times the rod's length along the circumference.
    """
    length = 2 * math.pi * scene.engine.rotor.radius / rods_of(scene)
    return float(scene.engine.casing.layer_width * length)


def _flex(scene: Scene) -> float:
    """Return the elastic compliance of a rod of the layer, l / (E A), m/N.

    l is the layer's thickness, E its Young's modulus, A the rod's area.
    """
    casing = scene.engine.casing
    return float(casing.layer_thickness / (casing.layer_young * rod_area(scene)))


def _abradable(scene: Scene) -> Layer:
    """Return the constants of rods of a layer that wears by plastic compression.

    A rod has the stiffness A E / l, yields at the force A sigma_y, and hardens by A H /
    l. A is the area of a rod; E, l, sigma_y and H are Young's modulus, thickness, yield
    stress and hardening modulus of the layer.
    """
    casing, area = scene.engine.casing, rod_area(scene)
    growth = area * casing.layer_hardening / casing.layer_thickness
    limit, under = area * casing.layer_yield, casing.layer_rods
    soft = float(np.divide(1.0, growth))  # raises, in `representable`, beyond numbers
    return Layer(_flex(scene), soft, 0.0, limit, growth, under)


def _archard(scene: Scene) -> Layer:
    """Return the constants of elastic rods of a layer that wears by Archard's law.

    The wear of a rod in a step is k N v dt / A, m: k is the wear coefficient, 1/Pa, N
    the force and A the area of the rod, v = |Omega| R.
    """
    casing, area = scene.engine.casing, rod_area(scene)
    slid = scene.engine.rotor.radius * scene.solver.time_step  # at 1 rad/s
    rub = casing.wear_coefficient * slid / area
    return Layer(_flex(scene), 0.0, rub, 0.0, 0.0, casing.layer_rods)


LAWS: dict[str, Callable[[Scene], Layer]] = {
    "abradable": _abradable,
    "archard": _archard,
}  # {contact law: function that returns its rods}


def wears(scene: Scene) -> bool:
    """Return whether the scene's casing has a layer that wears."""
    return bool(scene.engine.casing.contact_law != contact_laws.RIGID)


def rods_of(scene: Scene) -> int:
    """Return the number M of rods around the casing's layer, 0 without a layer."""
    if not wears(scene):
        return 0
    casing, radius = scene.engine.casing, scene.engine.rotor.radius
    return int(contact_laws.rods_around(casing.layer_edge, radius, casing.layer_rods))


def layer_of(scene: Scene) -> Layer:
    """Return the constants of the rods of a casing's layer, by its contact law.

    They are 0 for a casing without a layer.
    """
    if not wears(scene):
        return Layer(0.0, 0.0, 0.0, 0.0, 0.0, 0)
    return LAWS[scene.engine.casing.contact_law](scene)


def rods_under(model: Model, scene: Scene, w: Floats) -> Rods:
    """Return the layer as a term of the loop `points`; with empty arrays without one.

    w : (N, N), m/N, Delassus matrix of both bodies
    """
    tips = len(w) if wears(scene) else 0
    return Rods(
        layer_of(scene), model.angles[:tips], np.ascontiguousarray(w[:tips, :tips]),
        EMPTY, np.zeros((tips, 0), np.int64), np.zeros((tips, 0)),
    )  # fmt: skip


def unworn(scene: Scene) -> Floats:
    """Return the state of a layer before any wear: zeros, (3, rods).

    The rows are those of `kernels.kernel_types.BodiesState.worn`.
    """
    return np.zeros((3, rods_of(scene)))
