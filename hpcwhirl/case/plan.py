"""Plans: which part of a scene's model is integrated, and until when.

If g sectors move alike, only one is integrated: a model of N / g blades, spread over a
full circle by the angle g theta. A rotor of N equal blades at rest, a round ring at
rest and a load on k lobes are unchanged by a rotation of 2 pi / g, g = gcd(k, N); so is
every later motion. Only nodal diameters and harmonics h = g h' ever move. In the angle
g theta they are h' = h / g of N / g blades that turn with g Omega under a load on k / g
lobes, and this model carries 1 / g of the energy: amplitudes of mass-orthonormal modes
are y / sqrt(g), their shapes sqrt(g) times those of the whole, and the modal force is F
/ g. Displacements, gaps and multipliers are the same numbers; energies, works and
impulses count g times. Terms of rotation are those of Omega, not of g Omega: C / g, K_1
/ g^2 and K_2 / g^4.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.arrays import Floats
from hpcwhirl.case.growth import largest_free_growth
from hpcwhirl.case.profile import room_of, shape_of
from hpcwhirl.case.unbalance import has_steady, weighs
from hpcwhirl.errors import ModelError
from hpcwhirl.reduction.model import Model, has_families
from hpcwhirl.reduction.modes import ModalModel, Spin, SpinBlock
from hpcwhirl.reduction.supports import ROUND
from hpcwhirl.scene import Scene
from hpcwhirl.scene.contact_laws import PERMANENT, RIGID
from hpcwhirl.scene.kept_tables import scaled
from hpcwhirl.scene.plain_data import flatten
from hpcwhirl.scene.schemes import SCHEMES
from hpcwhirl.structure import FourierOperator

# inputs that decide folds and kernel; of lists and reals, only whether there is any
FOLDING = (
    "solver.plan", "solver.scheme", "nodal_diameter", "engine.rotor.blades",
    "engine.rotor.mistuning", "engine.rotor.lost_blade", "engine.casing.kind",
    "engine.casing.discretization", "engine.casing.contact_law",
    "engine.casing.profile", "engine.casing.profile_scale", "engine.casing.offset",
    "engine.file", "unbalance", "gravity", "engine.rotation",
)  # fmt: skip
COUNTS = "nodal_diameter", "engine.rotor.blades"
MOST_KEPT = 256  # number of cached settling times
SOON = 0.7  # largest settling time for which a certificate is sought / run
NONE = np.zeros((0, 0))
MOST_SECTORS = 32  # number of cached models of one sector


class Marched(NamedTuple):
    """The scene and the model that are integrated: of all sectors, or of one only."""

    scene: Scene
    model: Model


@dataclass(frozen=True)
class Plan:
    """The part of a case's model that is integrated, and until when.

    Where a free motion of the whole engine grows, any disturbance grows into it: then
    all sectors are integrated, and no certificate is sought.

    Attributes
    ----------
    folds : g, number of sectors that move alike, of which one is integrated; 1: all
        sectors are integrated
    settles : whether the run seeks a certificate (a proof that no blade can touch
        again), after which it continues in closed form or ends
    settling : s, time after which the ring, if not touched, moves less than the gap
    growth : 1/s, largest growth rate of a free motion of the whole engine in the run; 0
        if all decay
    """

    folds: int
    settles: bool
    settling: float
    growth: float = 0.0


def folds_of(scene: Scene) -> int:
    """Return g, the number of sectors that move alike: gcd(k, N), k lobes, N blades.

    The gcd includes the harmonics of a casing that is not round. g is 1 with unequal
    sectors, an unbalance or a layer that wears, or if plan or scheme need all sectors.
    Whether one sector may represent all depends on the model, too, see `plan_of`.
    """
    solver = scene.solver
    if solver.plan == "everything" or not SCHEMES[solver.scheme].folds:
        return 1
    worn = scene.engine.casing.contact_law != RIGID
    if worn or has_steady(scene) or not has_families(scene):
        return 1
    orders = shape_of(scene).orders.tolist()
    return math.gcd(scene.nodal_diameter, scene.engine.rotor.blades, *orders)


def kernel_of(scene: Scene) -> tuple[Any, ...]:
    """Return a key that is equal for scenes that the same compiled kernel integrates.

    Numbers of blades and lobes enter only by the number of sectors that move alike.
    """
    flat = flatten(scene)
    given = [flat[name] for name in FOLDING if name not in COUNTS]
    kinds = (bool(v) if isinstance(v, list | tuple | float) else v for v in given)
    return folds_of(scene), *kinds


def settling_time(scene: Scene, model: Model) -> float:
    """Return the time, s, after which the untouched ring moves less than the gap.

    It follows from bounds of the modes' amplitudes after the pulse, which decay at the
    rate xi omega, or, beyond critical damping, at that of the slower root. It is
    infinite for undamped modes, for a driven casing, and for a casing whose shape
    leaves no gap.
    """
    room = room_of(scene)
    if room < 0.0:
        return math.inf
    if model.casing is None:
        return 0.0 if scene.engine.casing.amplitude == 0.0 else math.inf
    if not isinstance(model.ring, FourierOperator) or model.rotor.points is not None:
        return math.inf
    if scene.force == 0.0:
        return 0.0
    load = scene.nodal_diameter, scene.force, scene.pulse
    return _settling(model, *load, room)


@lru_cache(maxsize=MOST_KEPT)
def _settling(
    model: Model, lobes: int, force: float, pulse: float, gap: float
) -> float:
    """Return the time, s, after which a ring pushed by a pulse stays within the gap.

    The ring is given by harmonics and is not touched; see `settling_time`.

    lobes, force, pulse : the pulse: its lobes, its force, N, and its duration, s
    gap : m
    """
    body, ring = model.casing, model.ring
    if body is None or ring is None:
        return 0.0
    modes = np.flatnonzero((body.diameter == lobes) & (body.phase == 0))
    omega, xi = body.omega[modes], body.ratios[modes]
    beyond = np.maximum(xi, 1.0)  # and 1 / (xi + root of xi^2 - 1), without overflow
    slower = beyond / 2 + np.sqrt(beyond - 1) / 2 * np.sqrt(beyond + 1)
    decay = np.minimum(xi, 0.5 / slower) * omega
    shape = body.shapes[ring.radial[max(2 * lobes - 1, 0)], modes]
    if not (decay > 0.0).all() or gap == 0.0:
        return math.inf
    push = np.minimum(2 * pulse / (math.pi * omega), 2 / omega**2)
    sizes = force * push * shape**2
    low, high = 0.0, 50.0 / float(decay.min())
    with np.errstate(over="ignore"):  # e^{-inf} = 0 of a mode faster than the slowest
        for _ in range(60):
            middle = 0.5 * (low + high)
            open_then = sizes @ np.exp(-decay * middle) < gap
            low, high = (low, middle) if open_then else (middle, high)
    return pulse + high


def plan_of(scene: Scene, model: Model) -> Plan:
    """Return the plan of a scene: which part is integrated, and until when.

    model : the model of all sectors
    """
    growth = largest_free_growth(scene, model)
    folds = folds_of(scene) if growth == 0.0 else 1
    settling = settling_time(scene, model)
    lean = scene.solver.plan == "lean" and SCHEMES[scene.solver.scheme].settles
    spin = model.rotor.spin
    lean = lean and (spin is None or spin.is_plain)
    lean = lean and growth == 0.0 and settling < math.inf and not weighs(scene)
    wanted = scene.solver.until == "certain" or settling < SOON * scene.end_time
    return Plan(folds, lean and wanted, settling, growth)


def lean_of(scene: Scene, model: Model, folds: int) -> Marched:
    """Return the scene and the model that are integrated.

    They are those of one sector if g > 1 sectors move alike, else those given.

    model, folds : the model of all sectors; g, see `Plan`
    """
    if folds == 1:
        return Marched(scene, model)
    return Marched(folded_scene(scene, folds), folded_model(model, folds))


def folded_body(
    body: ModalModel, rows: NDArray[np.intp], folds: int
) -> tuple[ModalModel, Floats]:
    """Return the modes of one of g sectors, and the matrix from them to the whole body.

    Parameters
    ----------
    body : modes of the whole body, rotor or ring
    rows : indices of its coordinates that the sector has
    folds : g, number of sectors

    Returns
    -------
    body : the modes of nodal diameters or harmonics h that g divides, labelled h / g;
        without mass and stiffness matrices
    lift : (n, m), displacements of the whole body's n coordinates from the sector's m
        modal amplitudes
    """
    modes = np.flatnonzero(body.diameter % folds == 0)
    lift = np.ascontiguousarray(math.sqrt(folds) * body.shapes[:, modes])
    own = body.only(modes, lift[rows])
    spin = body.spin and _folded_spin(body.spin, folds)
    return replace(own, diameter=own.diameter // folds, kept=0, spin=spin), lift


def _folded_spin(spin: Spin, folds: int) -> Spin:
    """Return the terms of rotation of one of g = `folds` sectors of the rotor.

    They are given by nodal diameter only, without matrices of the whole rotor, and
    without supports, since the centre is at rest.
    """
    waves = tuple(_folded(own, folds) for own in spin.waves if own.k % folds == 0)
    return Spin(NONE, NONE, np.zeros(0), waves=waves, support=ROUND)


def _folded(own: SpinBlock, folds: int) -> SpinBlock:
    return replace(
        own,
        k=own.k // folds,
        coriolis=own.coriolis / folds,
        stiffening=own.stiffening / folds**2,
        quartic=None if own.quartic is None else own.quartic / folds**4,
    )


def _coordinates(operator: FourierOperator, folds: int) -> NDArray[np.intp]:
    """Return indices of the coordinates of those harmonics of a ring that g divides.

    The radial ones come first, then the tangential ones.

    operator, folds : the ring, given by harmonics; g, the number of sectors
    """
    harmonics = folds * np.arange(1, operator.harmonics // folds + 1)
    pairs = np.column_stack([2 * harmonics - 1, 2 * harmonics]).ravel()
    radial = np.concatenate([[0], pairs])
    return np.concatenate([radial, operator.width + radial]).astype(np.intp)


@lru_cache(maxsize=MOST_SECTORS)
def folded_model(whole: Model, folds: int) -> Model:
    """Return the model of one of g = `folds` equal sectors, without the centre.

    The centre rests.

    Raises
    ------
    ModelError
        if the whole model has no such symmetry
    """
    foreign = whole.ring is not None and not isinstance(whole.ring, FourierOperator)
    if whole.blades % folds or foreign or not whole.rotor.cyclic or folds < 2:
        msg = f"{whole.blades} blades and their casing have no {folds} equal sectors"
        raise ModelError(msg)
    blades = whole.blades // folds
    rotor, lift = folded_body(whole.rotor, np.arange(2 * blades), folds)
    model = replace(whole, rotor=rotor, blades=blades, folds=folds, lifts=(lift, NONE))
    if whole.casing is None or not isinstance(whole.ring, FourierOperator):
        return model
    casing, ring_lift = folded_body(
        whole.casing, _coordinates(whole.ring, folds), folds
    )
    ring = FourierOperator(whole.ring.harmonics // folds, whole.ring.radius)
    return replace(model, casing=casing, ring=ring, lifts=(lift, ring_lift))


def folded_scene(scene: Scene, folds: int) -> Scene:
    """Return the scene of one of g = `folds` sectors, which turns at g Omega.

    Its load has k / g lobes and the force F / g, its friction is the coefficient at
    Omega, unless it follows the slide of each tip. Its engine, of which only the radius
    is used, is still that of the whole.
    """
    constant = {
        "friction": scene.coefficient,
        "friction_law": "constant",
        "friction_table": "",
    }
    return scene.model_copy(
        update={
            "speed": folds * scene.speed,
            "acceleration": folds * scene.acceleration,
            "speed_to": folds * scene.speed_to,
            "speed_table": scaled(scene.speed_table, folds),
            "nodal_diameter": scene.nodal_diameter // folds,
            "force": scene.force / folds,
            **({} if scene.slip != PERMANENT else constant),
            "duration": scene.end_time,
            "revolutions": 0.0,
        }
    )
