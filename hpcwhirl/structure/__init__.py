"""Structures: element matrices, assembly, bladed disk, ring.

They give M and K of both bodies. The rotor consists of tapered Bernoulli beams with
rods, a disk of beams (spokes and rim) and shaft springs. The casing is a ring of
harmonics in closed form, or of curved elements, cubic in both displacements, on a soft
foundation. Harmonics are the default: their modes need no interpolation at the moving
contact points, and make the Delassus matrix constant and circulant. The terms of
rotation of a bladed disk (Coriolis, stiffening, softening) use the same elements.
"""

from hpcwhirl.structure.assembly import CyclicStructure
from hpcwhirl.structure.bladed_disk import blade_stiffness, bladed_disk
from hpcwhirl.structure.fourier import FourierOperator, harmonic_matrices
from hpcwhirl.structure.ring import RingOperator, ring
from hpcwhirl.structure.rotation import Rotation, rotation_of
from hpcwhirl.structure.tilting import Tilt

__all__ = [
    "CyclicStructure",
    "FourierOperator",
    "RingOperator",
    "Rotation",
    "Tilt",
    "blade_stiffness",
    "bladed_disk",
    "harmonic_matrices",
    "ring",
    "rotation_of",
]
