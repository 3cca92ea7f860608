"""Scheme `modal`: cyclic amplitudes by central differences."""

from __future__ import annotations

from hpcwhirl.dynamics.schemes import general
from hpcwhirl.dynamics.schemes.cyclic import cyclic_modes, is_cyclic
from hpcwhirl.dynamics.schemes.integrator import Integrator
from hpcwhirl.dynamics.schemes.waves import waves_apart
from hpcwhirl.dynamics.schemes.whole import whole_apart
from hpcwhirl.reduction.model import Model
from hpcwhirl.scene import Scene


def build(model: Model, scene: Scene, beat: int) -> Integrator:
    """Return what marches a scene.

    The cyclic kernel, with rotation that of waves, or the general one where the rotor's
    sectors are not equal, the ring is the paper's elements or there are fewer than
    three blades; with rotation by waves of the whole rotor where they can be told
    apart.
    """
    if is_cyclic(model):
        return cyclic_modes(model, scene, beat)
    waves = waves_apart(model, scene, beat) or whole_apart(model, scene)
    return waves or general.build(model, scene, beat)
