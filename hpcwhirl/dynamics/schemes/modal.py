"""Scheme `modal`: amplitudes of modes or waves by central differences."""

from __future__ import annotations

from hpcwhirl.dynamics.layer import wears
from hpcwhirl.dynamics.schemes import general
from hpcwhirl.dynamics.schemes.cyclic import cyclic_modes, is_cyclic
from hpcwhirl.dynamics.schemes.integrator import Integrator
from hpcwhirl.dynamics.schemes.rotating_waves import waves_apart
from hpcwhirl.dynamics.schemes.several_points import points_apart
from hpcwhirl.dynamics.schemes.whole import whole_apart
from hpcwhirl.reduction.model import Model
from hpcwhirl.scene import Scene


def build(model: Model, scene: Scene, beat: int) -> Integrator:
    """Return the integrator of a scene.

    It is that of the cyclic kernel, for waves if there are terms of rotation, for three
    or more equal sectors in a rigid casing or one of harmonics; else that of the waves
    of the whole rotor, or of both bodies with several contact points a tip. Scheme
    `general` takes over if two waves nearly coincide, and for all layers that wear.

    beat : steps between rows of evidence
    """
    if wears(scene):
        return general.build(model, scene, beat)
    if model.rotor.points is not None:
        return points_apart(model, scene) or general.build(model, scene, beat)
    if is_cyclic(model):
        return cyclic_modes(model, scene, beat)
    waves = waves_apart(model, scene, beat) or whole_apart(model, scene)
    return waves or general.build(model, scene, beat)
