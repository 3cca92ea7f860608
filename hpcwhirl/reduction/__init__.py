"""From structures to the modes that are marched, and what a scene requires of them.

Craig-Bampton is taken per nodal diameter on Hermitian blocks, so that cyclic symmetry
holds to round-off and degenerate pairs are never split. A mistuned rotor is reduced as
a whole, since it has no blocks; its modes bear the nodal diameter and family of the
tuned rotor's mode that they resemble most, each given once. Of an engine's file, modes
of one frequency that an eigensolver has mixed are told apart by the Fourier transform
of their tips: each nodal diameter of a degenerate family is there once.

`truncation` chooses modes by the motion that they would add, `plan` what of a model a
scene requires. N equal blades and a load on k lobes look the same after a turn by 2 pi
/ g, g = gcd(k, N): one of g sectors is marched, without a centre. That is exact for the
equations, but a motion without the symmetry may grow out of round-off, which grows from
touchdown to touchdown: after 12 touchdowns of a blade, or contact for longer than the
rotor's slowest period, a case begins anew with the whole model.

`engine_file` is the one module outside `store` that imports h5py: a model is made here,
on every rank by itself, and could not be handed arrays that `store`, three rooms above,
had read without every caller of a model passing them on.
"""
