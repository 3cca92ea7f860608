"""Structures: element matrices, assembly, bladed disk, ring."""

from hpcwhirl.structure.assembly import CyclicStructure
from hpcwhirl.structure.bladed_disk import blade_stiffness, bladed_disk
from hpcwhirl.structure.ring import RingOperator, ring

__all__ = ["CyclicStructure", "RingOperator", "blade_stiffness", "bladed_disk", "ring"]
