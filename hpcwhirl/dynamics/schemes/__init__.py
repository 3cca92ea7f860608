"""Schemes: the kernel that integrates a scene, its arrays, and its initial state.

A scheme is a row of the table in `scene.schemes` and a module of its name here with the
function `build(model, scene, beat)`; `beat` is the number of steps between rows of
evidence. A state is all that is needed to resume a march, see `kernels.kernel_types`.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hpcwhirl.dynamics.schemes.integrator import Integrator
    from hpcwhirl.reduction.model import Model
    from hpcwhirl.scene import Scene


def scheme_of(model: Model, scene: Scene, beat: int) -> Integrator:
    """Return the integrator of a scene by the scheme of its [solver].

    Parameters
    ----------
    model : model of the scene
    scene : scene to integrate
    beat : steps between rows of evidence
    """
    scheme = import_module(f"{__name__}.{scene.solver.scheme}")
    built: Integrator = scheme.build(model, scene, beat)
    return built
