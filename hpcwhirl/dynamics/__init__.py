"""Time integration of both bodies and their contact.

A time integration in progress is called a march. Algorithm 1 consists of prediction
without contact, complementarity of all gaps at once (block pivoting, then Murty's rule,
which ends for any P-matrix), friction on both bodies, distribution of the contact
forces by the same shape functions that give displacements, and correction. The
recursion is in increments, so that it loses no digits on slow modes. Kernels run in
slices of 10 ms; any division into slices gives the same bits. Amplitudes below 1e-150
are set to zero, since denormals are slow. `kernels` contains all compiled code.

- `paper` is Algorithm 1 on dense matrices, the reference for the other schemes.
- `modal` integrates complex amplitudes, one for the two phases of a double mode, in
  slots, one for each nodal diameter. Those of the ring are in the rotating frame, in
  which no coefficient depends on the position of the blades: one real transform of N
  points gives all gaps of both bodies, its conjugate all modal forces. It is used if
  the rotor is cyclic, the ring has harmonics and N >= 3. For unequal sectors, and fewer
  than three, it integrates waves of the whole rotor beside the same ring, without
  rotation one for each mode (`mode_waves`): a bound of how far a tip moves in a step
  tells which tips have to be read, and a blade in contact costs its own rows only.
  `general` serves all other models. A step reads and writes each amplitude once: the
  contribution of contact, which is known only after all blades are predicted, is stored
  as a spectrum until the next pass. Vector operations are explicit, so that sums and
  products are rounded in the same way on every machine. The active blades stay the same
  in 98 of 100 steps: the inverse of their part of the Delassus matrix is kept, and for
  more than 24 blades corrected as blades come and go. Steps in which no gap can close,
  since no slot has moved far enough, are not transformed.
- `general` integrates the rotor's real modes one by one, and the ring as `modal` does:
  in the rotating frame the ring is the same at every angle for any rotor, so that W is
  constant, though not circulant, and its inverse can be kept. Tips take a product of N
  m terms in each step; modal forces are summed only over the blades in contact. With a
  casing of elements, which has no such frame, it integrates the modes of both bodies
  and updates the positions of the blades in every step.
- `exact` is the kernel of `modal` with the coefficients of each mode's exact flow, in
  (q, d = q - q before), in which the flow loses no digits on slow modes; contact is an
  impulse at the beginning of a step, such that no blade penetrates at its end. Away
  from contact it jumps over many steps: amplitudes bound the second derivative of every
  gap (including the ring's motion past the blades), which together with value and rate
  gives the length of the jump. A jump ends one step before a blade might touch, so that
  contact begins on the same grid of steps as in `modal`.

With `rotation = "full"` the modes of a nodal diameter are coupled. `modal` and `exact`
then integrate waves, forward and backward ones separately, each a complex amplitude
that is multiplied by a complex number in each step (`turning_waves`): waves of central
differences, or of the exact flow, which jumps. One loop serves modes and waves; the
type of the rotor chooses the functions it calls (`kernels.compiled.verb`). Waves of the
whole rotor are coupled then (`whole_waves`). `general` and `paper` integrate blocks or
matrices, and `general` takes over from `modal` if waves nearly coincide.

If the sum of all amplitudes is below the gap and every mode is damped and held, contact
cannot recur: this is the certificate. It is stored with its time and bound, and the run
continues in closed form. Without it, no run ends early as `damped`.

Evidence for words is sampled independently of the traces, with 12 rows per period of
the fastest line that moves the centre: the choice of traces never changes a word. A
march can be saved and resumed between slices (`snapshot`). Equal inputs do not suffice
for that, since another LAPACK may change the sign of a mode: the SHA-256 of all numbers
passed to the kernel, of the kernels and of numba's version must be the same.
"""
