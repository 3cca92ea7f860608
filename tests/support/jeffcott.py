"""A rotor of stiff beams on its springs: centre and tips move as one to 1e-3."""

from functools import cache

import numpy as np
from rotor_files import written

from hpcwhirl.dynamics.bodies.turning import by_diameter
from hpcwhirl.reduction.bodies import casing_model
from hpcwhirl.scene import Scene, apply_settings, content_digest
from hpcwhirl.structure import bladed_disk

OWN, MASS = 583.0, 100.0  # rad/s, kg
RATIO, GAP = 0.05, 1e-4  # xi of a standing damper; m
HEAVY = 6e-3  # m e, kg m
STIFF = {
    "rotation": "full", "scheme": "general", "rotor.elements": 1, "modes": 0,
    "taper": 1.0, "disk_radius": 0.4, "root_thickness": 0.02, "blade_width": 0.2,
    "spoke_thickness": 0.03, "spoke_width": 0.1, "rim_thickness": 0.1,
    "rim_width": 0.2, "rotor.young": 1e12, "centre_stiffness": MASS * OWN**2,
    "rotor.damping": 0.0, "suspension_damping": RATIO, "casing.harmonics": 1,
    "force": 0.0, "interval": 1e-5, "gap": GAP, "unbalance": HEAVY,
}  # fmt: skip


def translations(count):
    """Return (2 count, 2): tips, radial and tangential, moved along x or y."""
    angle = 2 * np.pi * np.arange(count) / count
    radial = np.column_stack([np.cos(angle), np.sin(angle)])
    along = np.column_stack([-np.sin(angle), np.cos(angle)])
    return np.stack([radial, along], axis=1).reshape(-1, 2)


def as_one(model):
    """Return (n, 2): all places of a stiff rotor, moved along x or y."""
    tips, moved = 2 * model.blades, np.zeros((len(model.rotor.mass), 2))
    moved[:tips], moved[tips : tips + 2] = translations(model.blades), np.eye(2)
    return moved


def set_off(march, place, velocity=0.0):
    """Begin a march at a place on the x axis, m, with a velocity, m/s, static frame."""
    body, step = march.model.rotor, march.scene.solver.time_step
    lift = body.shapes[:, by_diameter(body)[0]].T @ body.mass @ as_one(march.model)
    before = (place - step * velocity) * np.exp(1j * march.scene.speed * step)
    march.state.q_b[:] = lift @ [place, 0.0]
    march.state.d_b[:] = lift @ [place - before.real, -before.imag]


@cache
def density(blades):
    """Return the density at which the stiff rotor has the mass `MASS`."""
    rotor = apply_settings(Scene(), STIFF | {"blades": blades}).engine.rotor
    nodes = np.column_stack(
        [translations(blades)[:, 0].reshape(-1, 2), np.zeros(blades)]
    )
    moved = np.r_[np.repeat(nodes, rotor.elements + 1, axis=0).ravel(), 1.0, 0.0]
    return float(rotor.density * MASS / (moved @ bladed_disk(rotor).mass @ moved))


def stiff(blades, **settings):
    """Return the scene of a stiff rotor."""
    given = STIFF | {"blades": blades, "rotor.density": density(blades)}
    return apply_settings(Scene(), given | settings)


def spring_casing(path, omega, ratio, mass):
    """Return a casing that moves as one along its normal, on a spring and a damper.

    omega : over `OWN`
    ratio : of damping
    mass : over `MASS`
    """
    written(path, {
        "modal_harmonic": [0, 1], "modal_omega": OWN * np.array([1.0, omega]),
        "modal_damping_ratio": [0.05, ratio],
        "modal_radial": [1e-6, (mass * MASS) ** -0.5],  # it breathes hardly
        "modal_tangential": [0.0, 0.0],
    }, "casing")  # fmt: skip
    named = {"discretization": "file", "engine.file": str(path)}
    engine = apply_settings(Scene(), named).engine
    source = str(path), content_digest(str(path))
    return casing_model(engine.casing, engine.rotor.radius + GAP, source)
