"""What of the model a scene requires: decided from the scene and its whole model."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from hpcwhirl.case.sectors import folded_model, folded_scene
from hpcwhirl.reduction.model import Model, has_families
from hpcwhirl.scene import Scene
from hpcwhirl.scene.schemes import SCHEMES
from hpcwhirl.structure import FourierOperator

FOLDING = (
    "solver.plan",
    "solver.scheme",
    "nodal_diameter",
    "engine.rotor.blades",
    "engine.rotor.mistuning",
    "engine.casing.kind",
    "engine.casing.discretization",
    "engine.file",
)  # inputs that `folds_of` and kernels depend on; of a pattern, whether there is one
MOST_KEPT = 256  # numbers
SOON = 0.7  # of the run: a certificate expected later is not looked for


class Marched(NamedTuple):
    """A scene and its model as they are marched: all sectors, or one."""

    scene: Scene
    model: Model


@dataclass(frozen=True)
class Plan:
    """What is marched for a scene.

    Attributes
    ----------
    folds : g, sectors that move alike, of which one is marched; 1: all
    settles : whether it is looked for the proof that no contact can recur, from which
        on the run goes on in closed form or ends
    settling : s, when the ring by itself, at the earliest, swings less than the gap
    """

    folds: int
    settles: bool
    settling: float


def folds_of(scene: Scene) -> int:
    """Return g, the sectors that move alike: gcd(k, N), or 1 where all are marched."""
    solver = scene.solver
    if solver.plan == "everything" or not SCHEMES[solver.scheme].folds:
        return 1
    if not has_families(scene):
        return 1
    return math.gcd(scene.nodal_diameter, scene.engine.rotor.blades)


def settling_time(scene: Scene, model: Model) -> float:
    """Return when the ring that nothing touches swings less than the gap, s.

    From bounds of its modes after the pulse, which decay with xi omega; infinite where
    they do not, or where a casing is driven.
    """
    if model.casing is None:
        return 0.0 if scene.engine.casing.amplitude == 0.0 else math.inf
    if not isinstance(model.ring, FourierOperator):
        return math.inf
    if scene.force == 0.0:
        return 0.0
    load = scene.nodal_diameter, scene.force, scene.pulse
    return _settling(model, *load, scene.gap)


@lru_cache(maxsize=MOST_KEPT)
def _settling(
    model: Model, lobes: int, force: float, pulse: float, gap: float
) -> float:
    """Return the same of a ring of harmonics that is loaded."""
    body, ring = model.casing, model.ring
    if body is None or ring is None:
        return 0.0
    own = np.flatnonzero((body.diameter == lobes) & (body.phase == 0))
    omega, decay = body.omega[own], (body.ratios * body.omega)[own]
    shape = body.shapes[ring.radial[max(2 * lobes - 1, 0)], own]
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
    """Return what is marched for a scene and its whole model."""
    folds, settling = folds_of(scene), settling_time(scene, model)
    lean = scene.solver.plan == "lean" and SCHEMES[scene.solver.scheme].settles
    wanted = scene.solver.until == "certain" or settling < SOON * scene.end_time
    return Plan(folds, lean and wanted and settling < math.inf, settling)


def lean_of(scene: Scene, model: Model) -> Marched:
    """Return what is marched for a scene and its whole model."""
    folds = folds_of(scene)
    if folds == 1:
        return Marched(scene, model)
    return Marched(folded_scene(scene, folds), folded_model(model, folds))
