"""Plans: which part of a scene's model is integrated, and until when."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from hpcwhirl.case.profile import room_of, shape_of
from hpcwhirl.case.sectors import folded_model, folded_scene
from hpcwhirl.reduction.model import Model, has_families
from hpcwhirl.scene import Scene
from hpcwhirl.scene.contact_laws import RIGID
from hpcwhirl.scene.schemes import SCHEMES
from hpcwhirl.structure import FourierOperator

# inputs that decide folds and kernel; of mistuning, only whether there is any
FOLDING = (
    "solver.plan", "solver.scheme", "nodal_diameter", "engine.rotor.blades",
    "engine.rotor.mistuning", "engine.rotor.lost_blade", "engine.casing.kind",
    "engine.casing.discretization", "engine.casing.contact_law",
    "engine.casing.profile", "engine.casing.profile_scale", "engine.casing.offset",
    "engine.file", "unbalance", "engine.rotation",
)  # fmt: skip
MOST_KEPT = 256  # number of cached settling times
SOON = 0.7  # part of a run by whose end a certificate must be possible, to be sought


class Marched(NamedTuple):
    """A scene and its model as they are integrated: all sectors, or one."""

    scene: Scene
    model: Model


@dataclass(frozen=True)
class Plan:
    """The part of a model that is integrated, and until when.

    Attributes
    ----------
    folds : g, number of sectors that move alike, of which one is integrated; 1: all
        sectors are integrated
    settles : whether the run seeks a certificate, after which it continues in closed
        form or ends
    settling : s, time after which the ring, if not touched, moves less than the gap
    """

    folds: int
    settles: bool
    settling: float


def folds_of(scene: Scene) -> int:
    """Return the number g of sectors that move alike: gcd(k, N), k lobes, N blades.

    The gcd includes the harmonics of a casing that is not round. g is 1 with unequal
    sectors, an unbalance or a layer that wears, or if plan or scheme need all sectors.
    """
    solver = scene.solver
    if solver.plan == "everything" or not SCHEMES[solver.scheme].folds:
        return 1
    worn = scene.engine.casing.contact_law != RIGID
    if worn or scene.unbalance != 0.0 or not has_families(scene):
        return 1
    orders = shape_of(scene).orders.tolist()
    return math.gcd(scene.nodal_diameter, scene.engine.rotor.blades, *orders)


def settling_time(scene: Scene, model: Model) -> float:
    """Return the time, s, after which the untouched ring moves less than the gap.

    It follows from bounds of the modes' amplitudes after the pulse, which decay as
    e^{-xi omega t}. It is infinite for undamped modes, for a driven casing, and for a
    casing whose shape leaves no gap.
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
    """Return `settling_time` of a ring of harmonics under a pulse.

    force, pulse, gap : N, s, m
    """
    body, ring = model.casing, model.ring
    if body is None or ring is None:
        return 0.0
    modes = np.flatnonzero((body.diameter == lobes) & (body.phase == 0))
    omega, decay = body.omega[modes], (body.ratios * body.omega)[modes]
    shape = body.shapes[ring.radial[max(2 * lobes - 1, 0)], modes]
    if not (decay > 0.0).all() or gap == 0.0:
        return math.inf
    push = np.minimum(2 * pulse / (math.pi * omega), 2 / omega**2)
    sizes = force * push * shape**2
    low, high = 0.0, 50.0 / float(decay.min())
    for _ in range(60):
        middle = 0.5 * (low + high)
        open_then = sizes @ np.exp(-decay * middle) < gap
        low, high = (low, middle) if open_then else (middle, high)
    return pulse + high


def plan_of(scene: Scene, model: Model) -> Plan:
    """Return the plan of a scene; `model` is the model of all sectors."""
    folds, settling = folds_of(scene), settling_time(scene, model)
    lean = scene.solver.plan == "lean" and SCHEMES[scene.solver.scheme].settles
    spin = model.rotor.spin
    lean = lean and (spin is None or spin.support.is_plain)
    wanted = scene.solver.until == "certain" or settling < SOON * scene.end_time
    return Plan(folds, lean and wanted and settling < math.inf, settling)


def lean_of(scene: Scene, model: Model) -> Marched:
    """Return the scene and the model that are integrated for a scene and its model.

    They are those of all sectors, or of one sector if g > 1 sectors move alike.
    """
    folds = folds_of(scene)
    if folds == 1:
        return Marched(scene, model)
    return Marched(folded_scene(scene, folds), folded_model(model, folds))
