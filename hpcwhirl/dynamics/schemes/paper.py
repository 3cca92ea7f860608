"""Scheme `paper`: the paper's Algorithm 1 on the dense reduced matrices."""

from __future__ import annotations

import numpy as np

from hpcwhirl.case.unbalance import circle, share_at_start
from hpcwhirl.dynamics.bodies.operators import dense_arrays
from hpcwhirl.dynamics.bodies.turning import jitter
from hpcwhirl.dynamics.schemes.integrator import Integrator
from hpcwhirl.dynamics.schemes.two_bodies import TwoBodies, dense_coordinates
from hpcwhirl.reduction.model import Model
from hpcwhirl.scene import Scene


def build(model: Model, scene: Scene, _: int) -> Integrator:
    """Return the integrator of a scene by the paper's Algorithm 1 on full matrices.

    An unbalanced rotor starts on its circle, the motion without contact.
    """
    arrays, step = dense_arrays(model, scene), scene.solver.time_step
    places, ring = circle(model, scene), np.zeros(int(arrays.casing.starts[-1]))
    still = np.zeros(len(model.rotor.mass)) if places is None else places
    rotor = dense_coordinates(arrays.rotor, still, step)
    held = rotor, dense_coordinates(arrays.casing, ring, step)
    whole = TwoBodies(model, scene, arrays, held)
    whole.of_modes = False
    if places is not None:
        share = share_at_start(model, scene)
        rises = rotor.steps.increments((share - 1.0) * places, 0.0 * places)
        whole.put_on_circle(share * places, rises)
        whole.jitter = jitter(arrays.rotor, model, step)
    return whole
