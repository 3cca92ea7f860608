"""Scheme `paper`: Algorithm 1 on the dense reduced matrices. Slow and obvious."""

from __future__ import annotations

from dataclasses import replace

import hpcwhirl.dynamics.kernels.dense  # noqa: F401 - what matrices do
from hpcwhirl.dynamics.casing_trace import waves_of_coordinates
from hpcwhirl.dynamics.operators import dense_arrays
from hpcwhirl.dynamics.schemes.bodies import two_bodies
from hpcwhirl.dynamics.schemes.integrator import Integrator, reader
from hpcwhirl.reduction.model import Model
from hpcwhirl.scene import Scene


def build(model: Model, scene: Scene, _: int) -> Integrator:
    """Return what marches a scene."""
    return replace(
        two_bodies(model, scene, dense_arrays(model, scene)),
        displacements=lambda s, _: (s.q_b.copy(), s.q_c.copy()),
        casing_waves=reader(model, scene, lambda x, _: waves_of_coordinates(model, x)),
    )
