"""Scheme `modal`: amplitudes of modes or waves by central differences."""

from __future__ import annotations

from hpcwhirl.dynamics.operators import wears
from hpcwhirl.dynamics.schemes import general
from hpcwhirl.dynamics.schemes.by_sectors import (
    cyclic_modes,
    is_cyclic,
    waves_apart,
    whole_apart,
)
from hpcwhirl.dynamics.schemes.integrator import Integrator
from hpcwhirl.dynamics.schemes.several_points import points_apart
from hpcwhirl.reduction.model import Model
from hpcwhirl.scene import Scene


def build(model: Model, scene: Scene, beat: int) -> Integrator:
    """Return the integrator of a scene by the scheme modal.

    Three or more equal sectors in a rigid casing or one of harmonics: the cyclic
    kernel, of modes or, with terms of rotation, of waves. Other rotors: waves of the
    whole rotor. Several contact points a tip: waves of both bodies. Two waves that
    nearly coincide, or a layer that wears: the integrator of scheme `general`.

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
