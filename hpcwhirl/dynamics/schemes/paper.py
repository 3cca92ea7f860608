"""Scheme `paper`: Algorithm 1 on the dense reduced matrices. Slow and obvious."""

from __future__ import annotations

from dataclasses import replace

import hpcwhirl.dynamics.kernels.dense
import hpcwhirl.dynamics.kernels.standing  # noqa: F401 - what matrices do
from hpcwhirl.case.unbalance import circle, share_at_start
from hpcwhirl.dynamics.casing_trace import waves_of_coordinates
from hpcwhirl.dynamics.operators import dense_arrays
from hpcwhirl.dynamics.schemes.bodies import started, two_bodies
from hpcwhirl.dynamics.schemes.integrator import Integrator, reader
from hpcwhirl.reduction.model import Model
from hpcwhirl.scene import Scene


def build(model: Model, scene: Scene, _: int) -> Integrator:
    """Return the integrator of a scene."""
    whole, size = two_bodies(model, scene, dense_arrays(model, scene)), None
    places = circle(model, scene)
    if places is not None:
        share, size = share_at_start(model, scene), len(places)
        whole = started(whole, model, scene, share * places, 0.0 * places)
    return replace(
        whole,
        displacements=lambda s, _: (s.q_b[:size].copy(), s.q_c.copy()),
        casing_waves=reader(model, scene, lambda x, _: waves_of_coordinates(model, x)),
    )
