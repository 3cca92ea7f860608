"""Scheme `exact`: free motion by its exact solution, with jumps between contacts."""

from __future__ import annotations

from hpcwhirl.dynamics.schemes.by_sectors import (
    cyclic_modes,
    has_waves,
    is_cyclic,
    waves_apart,
)
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
    if not has_waves(model):
        return cyclic_modes(model, scene, beat)
    march = waves_apart(model, scene, beat)
    if march is None:
        raise InputError(
            "scheme exact cannot tell apart two waves of this rotor, which nearly "
            f"coincide at its speed: scheme must be {either(STEPWISE)} here, "
            "got 'exact'"
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
