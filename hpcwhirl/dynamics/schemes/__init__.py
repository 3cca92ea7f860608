"""Schemes of time integration: each makes the integrator of a scene.

A scheme is a row of the table in `scene.schemes` and a module of its name here, whose
function `build(model, scene, beat)` returns an `integrator.Integrator`: a compiled
kernel, its constant arrays, and the state of rotor and casing, which is all that is
needed to resume a run (`kernels.kernel_types`). `beat` is the number of time steps
between two rows of evidence, the samples by which a run is judged.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hpcwhirl.dynamics.schemes.integrator import Integrator
    from hpcwhirl.reduction.model import Model
    from hpcwhirl.scene import Scene


def scheme_of(model: Model, scene: Scene, beat: int) -> Integrator:
    """Return the integrator of a scene, made by the scheme that [solver] names.

    Parameters
    ----------
    model : reduced model of the scene's rotor and casing
    scene : scene to integrate
    beat : number of time steps between two rows of evidence
    """
    scheme = import_module(f"{__name__}.{scene.solver.scheme}")
    built: Integrator = scheme.build(model, scene, beat)
    return built
