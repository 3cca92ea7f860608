"""Scheme `general`: any rotor, any ring, mode by mode. The oracle of others."""

from __future__ import annotations

import hpcwhirl.dynamics.kernels.general  # noqa: F401 - what modes do
from hpcwhirl.dynamics.operators import modal_arrays
from hpcwhirl.dynamics.schemes.bodies import two_bodies
from hpcwhirl.dynamics.schemes.integrator import Integrator
from hpcwhirl.reduction.model import Model
from hpcwhirl.scene import Scene


def build(model: Model, scene: Scene, _: int) -> Integrator:
    """Return what marches a scene."""
    return two_bodies(model, scene, modal_arrays(model, scene))
