"""Scheme `exact`: free motion by its exact solution, with jumps between contacts."""

from __future__ import annotations

from hpcwhirl.dynamics.schemes.equal_sectors import equal_sectors
from hpcwhirl.dynamics.schemes.integrator import Integrator
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.model import Model
from hpcwhirl.scene import Scene


def build(model: Model, scene: Scene, beat: int) -> Integrator:
    """Return the integrator of a scene by scheme `exact`, as modes or as waves.

    beat : number of time steps between two rows of evidence

    Raises
    ------
    InputError
        if a mode has no stiffness, or two waves nearly coincide; other scenes that the
        scheme cannot integrate are handed over to `modal`, see `case.handover`
    """
    march = equal_sectors(model, scene, beat)
    if march is None:
        raise InputError(
            "scheme exact needs modes that oscillate, and waves that differ: here a "
            "mode has no stiffness, or two waves of the rotor nearly coincide at its "
            "speed; scheme must be 'modal', 'general' or 'paper' here, got 'exact'"
        )
    return march
