"""Coefficients of the layer's rods for the kernels, from the contact law of a scene.

The layer on the casing that wears is modelled by rods side by side, see
`kernels.layer`.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from hpcwhirl.arrays import Floats
from hpcwhirl.dynamics.kernels.kernel_types import Layer
from hpcwhirl.scene import Scene
from hpcwhirl.scene.contact_laws import RIGID, rods_around


def rod_area(scene: Scene) -> float:
    """Return the area of a rod's end, m^2: axial width times circumferential length."""
    length = 2 * math.pi * scene.engine.rotor.radius / rods_of(scene)
    return float(scene.engine.casing.layer_width * length)


def _flex(scene: Scene) -> float:
    """Return the elastic compliance l / (E A) of a rod, m/N, see `_abradable`."""
    casing = scene.engine.casing
    return float(casing.layer_thickness / (casing.layer_young * rod_area(scene)))


def _abradable(scene: Scene) -> Layer:
    """Return the coefficients of plastic rods: elastic up to a limit, then hardening.

    Stiffness is A E / l, limit A sigma_y, hardening A H / l; A is the area of a rod; E,
    l, sigma_y and H are Young's modulus, thickness, yield stress and hardening modulus
    of the layer.
    """
    casing, area = scene.engine.casing, rod_area(scene)
    growth = area * casing.layer_hardening / casing.layer_thickness
    limit, under = area * casing.layer_yield, casing.layer_rods
    return Layer(_flex(scene), 1.0 / growth, 0.0, limit, growth, under)


def _archard(scene: Scene) -> Layer:
    """Return the coefficients of elastic rods that wear by Archard's law.

    A rod wears by k N v dt / A in a step: k is the wear coefficient, 1/Pa, N the force
    and A the area of a rod, v = |Omega| R.
    """
    casing, area = scene.engine.casing, rod_area(scene)
    slid = scene.engine.rotor.radius * scene.solver.time_step  # at 1 rad/s
    rub = casing.wear_coefficient * slid / area
    return Layer(_flex(scene), 0.0, rub, 0.0, 0.0, casing.layer_rods)


LAWS: dict[str, Callable[[Scene], Layer]] = {
    "abradable": _abradable,
    "archard": _archard,
}  # {contact law: function that returns its rods}


def wears(scene: Scene) -> bool:
    """Return whether the casing has a layer that wears."""
    return bool(scene.engine.casing.contact_law != RIGID)


def rods_of(scene: Scene) -> int:
    """Return the number M of rods of a scene's layer, 0 without one."""
    if not wears(scene):
        return 0
    casing, radius = scene.engine.casing, scene.engine.rotor.radius
    return int(rods_around(casing.layer_edge, radius, casing.layer_rods))


def layer_of(scene: Scene) -> Layer:
    """Return the coefficients of a scene's layer; without a layer all are 0."""
    if not wears(scene):
        return Layer(0.0, 0.0, 0.0, 0.0, 0.0, 0)
    return LAWS[scene.engine.casing.contact_law](scene)


def unworn(scene: Scene) -> Floats:
    """Return the state of an unworn layer, (3, rods): worn depth and works, all 0.

    The rows are those of `worn` in `kernels.kernel_types.BodiesState`.
    """
    return np.zeros((3, rods_of(scene)))
