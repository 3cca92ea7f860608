"""A rotor of stiff beams on its springs: centre and tips move as one to 1e-3."""

from functools import cache

import numpy as np

from hpcwhirl.scene import Scene, apply_settings
from hpcwhirl.structure import bladed_disk

OWN, MASS, RATIO, GAP = (
    583.0,
    100.0,
    0.05,
    1e-4,
)  # rad/s, kg, xi of a standing damper, m
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
