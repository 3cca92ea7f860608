"""Code of the time integration that numba compiles, and its cache on disk.

Terms used in these modules, besides those of the manual:

- slot: a nodal diameter 0 .. N // 2, as an index of a spectrum
- spectrum: (2 k,), re of the k slots, then im; k is N // 2 + 1, padded to vectors
- row (of modes): the f-th mode of every slot; column: re or im of one slot, in all rows
- items: the coefficients of a mode or wave that a step needs, in a fixed order
- folded row: values of all blades (2 wide,), of which the first half are those of
  blades j = 0 .. N // 2, padded to `wide`, the second those of blades N - j, see
  `loop.circulant.folded`; in signatures, `row` is the index where it begins in a flat
  array
- pending step: a step whose contact forces have been computed, but not yet applied
- active blades: those in contact; push, where: their multipliers, N, and their indices
- known: the active blades of the last solution; tips: displacements of all tips
- d, d': increments of an amplitude, q_n - q_{n-1} and q_{n+1} - q_n, in the last and in
  the present step; so d' + d is the change from step n - 1 to n + 1
- W: Delassus matrix, m/N, opening of all gaps by unit multipliers

`hpcwhirl.dynamics.kernel_cache` keeps the compiled code on disk.
"""
