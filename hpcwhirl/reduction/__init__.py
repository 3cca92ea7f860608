"""From structures to modes.

Craig-Bampton is taken per nodal diameter on Hermitian blocks, so that cyclic symmetry
holds to round-off and degenerate pairs are never split. A mistuned rotor is reduced as
a whole, since it has no blocks; its modes bear the nodal diameter and family of the
tuned rotor's mode that they resemble most, each given once. Of an engine's file, modes
of one frequency that an eigensolver has mixed are told apart by the Fourier transform
of their tips: each nodal diameter of a degenerate family is there once. A rotor from
file whose sectors are equal to 2e-5 gets the built-in's modes of it, see `recognise`.

Wheels of other codes' finite elements come through `finite_elements`: sparse, a sector
nodal diameter by nodal diameter, in the coordinates of the built-in one.
"""
