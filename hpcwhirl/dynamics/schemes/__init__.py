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
    from hpcwhirl.case.plan import Marched
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


def before_and_after(
    before: Marched, after: Marched, beat: int
) -> tuple[Integrator, Integrator]:
    """Return the integrators of a rotor with all its blades, and without one.

    Both are of one kind, so that the state, its works and the samples of the first go
    on in the second.

    Parameters
    ----------
    before, after : scene and model until and from the loss of a blade
    beat : number of time steps between two rows of evidence
    """
    scheme = import_module(f"{__name__}.{after.scene.solver.scheme}")
    own = getattr(scheme, "before_and_after", None)
    if own is not None:  # its integrator depends on how equal the sectors are
        pair: tuple[Integrator, Integrator] = own(before, after, beat)
        return pair
    return scheme_of(*before[::-1], beat), scheme_of(*after[::-1], beat)
