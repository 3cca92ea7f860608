"""Structures: element matrices, assembly, bladed disk, ring."""

from hpcwhirl.structure.assembly import CyclicStructure
from hpcwhirl.structure.bladed_disk import blade_stiffness, bladed_disk
from hpcwhirl.structure.fourier import FourierOperator, harmonic_matrices
from hpcwhirl.structure.ring import RingOperator, ring

__all__ = [
    "CyclicStructure",
    "FourierOperator",
    "RingOperator",
    "blade_stiffness",
    "bladed_disk",
    "harmonic_matrices",
    "ring",
]
