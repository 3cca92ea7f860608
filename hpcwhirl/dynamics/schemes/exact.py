"""Scheme `exact`: free motion by its exact solution, with jumps between contacts."""

from __future__ import annotations

from hpcwhirl.dynamics.schemes.by_sectors import has_waves, is_cyclic
from hpcwhirl.dynamics.schemes.equal_sectors import equal_sectors
from hpcwhirl.dynamics.schemes.integrator import Integrator
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.model import Model
from hpcwhirl.scene import Scene
from hpcwhirl.scene.schemes import STEPWISE, either


def build(model: Model, scene: Scene, beat: int) -> Integrator:
    """Return the integrator of a scene by scheme `exact`, as modes or as waves.

    beat : number of time steps between two rows of evidence

    Raises
    ------
    InputError
        if the scheme cannot compute the rotor or casing, or two waves nearly coincide
    """
    _check(model)
    march = equal_sectors(model, scene, beat)
    if march is None:
        raise InputError(
            "scheme exact needs modes that oscillate, and waves that differ: here a "
            "mode has no stiffness, or two waves of the rotor nearly coincide at its "
            f"speed; scheme must be {either(STEPWISE)} here, got 'exact'"
        )
    return march


def _check(model: Model) -> None:
    """Raise InputError for a rotor, casing or damping that `exact` cannot integrate."""
    if not is_cyclic(model) and not has_waves(model):
        raise InputError(
            "scheme exact needs three or more equal blades and a ring of harmonics or "
            f"a rigid casing: scheme must be {either(STEPWISE)} here, got 'exact'"
        )
    bodies = [body for body in (model.rotor, model.casing) if body is not None]
    worst = max(float(body.ratios.max()) for body in bodies)
    if not worst < 1.0:
        raise InputError(f"scheme exact needs damping < 1 in every mode, got {worst:g}")
