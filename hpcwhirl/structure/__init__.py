"""Structures: element matrices, assembly, bladed disk, ring.

These modules make the mass and stiffness matrices, M and K, of rotor and casing. Rotor:
tapered Bernoulli beams with rods, a disk of beams (spokes and rim), shaft springs.
Casing: a ring of harmonics in closed form, or of curved elements, cubic in both
displacements, on a soft foundation; a casing that varies along its axis is a simply
supported shell. Harmonics are the default: they need no interpolation at the moving
contact points, and make the Delassus matrix constant and circulant. The terms of
rotation of a bladed disk (Coriolis, stiffening, softening) use the same elements.
Shaft: a line of Timoshenko beams with disks, round in section, see `shaft`.
"""

from hpcwhirl.structure.bladed_disk import blade_stiffness, bladed_disk, polar_inertia
from hpcwhirl.structure.elements import CyclicStructure
from hpcwhirl.structure.fourier import (
    FourierOperator,
    Sines,
    Stations,
    Uniform,
    harmonic_matrices,
    shell_matrices,
)
from hpcwhirl.structure.mount import Mount
from hpcwhirl.structure.ring import RingOperator, ring
from hpcwhirl.structure.rotation import Rotation, rotation_of
from hpcwhirl.structure.shaft import LineSupport, small_damping

__all__ = [
    "CyclicStructure",
    "FourierOperator",
    "LineSupport",
    "Mount",
    "RingOperator",
    "Rotation",
    "Sines",
    "Stations",
    "Uniform",
    "blade_stiffness",
    "bladed_disk",
    "harmonic_matrices",
    "polar_inertia",
    "ring",
    "rotation_of",
    "shell_matrices",
    "small_damping",
]
