"""Time integration of both bodies and their contact, in slices.

Algorithm 1: prediction without contact, complementarity of all gaps at once (block
pivoting, then Murty's rule, which ends for any P-matrix), friction on both bodies,
forces spread with the shapes that displacements are read with, correction. The
recursion marches increments, which loses no digits on slow modes. Kernels run in slices
of 10 ms; any cut gives the same bits. Amplitudes below 1e-150 are set to zero, since
denormals are slow. `kernels` is all compiled code.

- `paper` is Algorithm 1 on dense matrices, the oracle of others.
- `modal` marches complex amplitudes, one for the two phases of a double mode, in slots
  of nodal diameters, the ring's in the rotating frame, where nothing depends on the
  blades' place: one real transform of N points gives all gaps of both bodies, its
  conjugate all modal forces. It takes over where the rotor is cyclic, the ring is
  harmonics and N >= 3; `general` does the rest. In a step each amplitude is read and
  written once: what contact adds is known once all blades have been predicted, and
  waits as a spectrum for the next pass. Vectors are written out, so that sums and
  products are rounded as they stand, on every machine. The active blades stay the same
  in 98 of 100 steps: the inverse of their part of the Delassus matrix is kept until
  they change.
- `general` marches the rotor's real modes one by one and the ring as `modal` does: in
  the rotating frame the ring is the same at every angle whatever the rotor, so that W
  is constant, though not circulant, and its inverse kept. Tips are a product of N m
  terms a step; modal forces are summed over the blades in contact alone. Beside a
  casing of elements, which has no such frame, it takes both bodies' modes and the
  places of the blades from step to step.
- `exact` is the kernel of `modal` with the coefficients of each mode's exact flow, in
  (q, d = q - q before), where the flow loses no digits on slow modes; contact gives an
  impulse at the beginning of a step so that no blade has penetrated at its end. Away
  from contact it jumps: amplitudes bound the second derivative of every gap (the ring's
  motion past the blades included), value and rate do the rest; a jump ends one step
  before a blade might touch, so contact begins on the same grid of steps as in `modal`.

When the sum of all amplitudes is below the gap and every mode is damped and held,
contact cannot recur: that is the certificate, stored with its time and bound, and from
then on the rest is closed form. No certificate, no early `damped`.

Evidence for words is taken at a rate of its own, 12 rows a period of the fastest line
that moves the centre: traces decide what is kept, never a word. A march may be left and
taken up between slices (`snapshot`). Equal inputs are not enough, since another LAPACK
may give a mode the other sign: a SHA-256 of every number that the kernel is given, of
the kernels and of numba's version decides.
"""
