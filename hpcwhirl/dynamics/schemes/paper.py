"""Scheme `paper`: the paper's Algorithm 1 on the dense reduced matrices."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

import hpcwhirl.dynamics.kernels.dense
import hpcwhirl.dynamics.kernels.standing  # noqa: F401 - registers their verbs
from hpcwhirl.case.unbalance import circle, share_at_start
from hpcwhirl.dynamics.casing import waves_of_coordinates
from hpcwhirl.dynamics.operators import dense_arrays
from hpcwhirl.dynamics.schemes.integrator import Integrator, reader
from hpcwhirl.dynamics.schemes.two_bodies import dense_coordinates, started, two_bodies
from hpcwhirl.dynamics.turning import jitter
from hpcwhirl.reduction.model import Model
from hpcwhirl.scene import Scene


def build(model: Model, scene: Scene, _: int) -> Integrator:
    """Return the integrator of a scene by the paper's Algorithm 1 on full matrices."""
    arrays, step = dense_arrays(model, scene), scene.solver.time_step
    places, ring = circle(model, scene), np.zeros(len(arrays.casing.keep))
    still = np.zeros(len(model.rotor.mass)) if places is None else places
    held = (
        dense_coordinates(arrays.rotor, still, step),
        dense_coordinates(arrays.casing, ring, step),
    )
    whole = two_bodies(model, scene, arrays, held)
    if places is not None:
        share = share_at_start(model, scene)
        whole = started(whole, model, scene, share * places, 0.0 * places)
        whole = replace(whole, jitter=jitter(arrays.rotor, model, step))
    return replace(
        whole,
        casing_waves=reader(model, scene, lambda x, _: waves_of_coordinates(model, x)),
    )
