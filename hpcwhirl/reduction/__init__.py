"""Model reduction: from mass and stiffness matrices of rotor and casing to their modes.

The Craig-Bampton reduction works on the Hermitian block of each nodal diameter, so that
cyclic symmetry holds to round-off and degenerate pairs are never split. A mistuned
rotor is reduced as a whole, since it has no blocks; each of its modes is labelled with
the nodal diameter and family of the tuned rotor's mode that it resembles most, each
label used once. In an engine's file, modes of equal frequency that an eigensolver has
mixed are separated by the Fourier transform of their tips. A rotor from file whose
sectors are equal within 2e-5 gets modes of the built-in rotor's form, see `recognise`.

`finite_elements` reduces the sparse matrices of other finite-element codes to the
coordinates of the built-in rotor: a wheel at once, a sector by nodal diameters.

`shaft_whirl` has the free motions and critical speeds of a shaft line on supports.
"""
