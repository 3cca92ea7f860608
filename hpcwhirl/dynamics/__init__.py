"""Time integration of both bodies and their contact.

Algorithm 1: prediction without contact, complementarity of all gaps at once (block
pivoting, then Murty's rule, which ends for any P-matrix), friction on both bodies,
forces spread with the same shapes that read displacements, correction. The recursion
marches increments, which loses no digits on slow modes. Kernels run in slices of 10 ms;
any division into slices gives the same bits. Amplitudes below 1e-150 are set to zero,
since denormals are slow. `kernels` contains all compiled code.

- `paper` is Algorithm 1 on dense matrices, the reference for the others.
- `modal` marches complex amplitudes, one for the two phases of a double mode, in slots
  of nodal diameters, the ring's in the rotating frame, where no coefficient depends on
  the blades' position: one real transform of N points gives all gaps of both bodies,
  its conjugate all modal forces. It is used where the rotor is cyclic, the ring has
  harmonics and N >= 3; `general` serves all other models. A step reads and writes each
  amplitude once: the contribution of contact, known once all blades have been
  predicted, is stored as a spectrum until the next pass. Vectors are written out, so
  that sums and products are rounded alike on every machine. The active blades stay the
  same in 98 of 100 steps: the inverse of their part of the Delassus matrix is kept
  until they change.
- `general` marches the rotor's real modes one by one and the ring as `modal` does: in
  the rotating frame the ring is the same at every angle for any rotor, so that W is
  constant, though not circulant, and its inverse can be kept. Tips are a product of N m
  terms a step; modal forces are summed over the blades in contact only. With a casing
  of elements, which has no such frame, it marches the modes of both bodies and updates
  the positions of the blades every step.
- `exact` is the kernel of `modal` with the coefficients of each mode's exact flow, in
  (q, d = q - q before), where the flow loses no digits on slow modes; contact gives an
  impulse at the beginning of a step so that no blade has penetrated at its end. Away
  from contact it jumps over many steps: amplitudes bound the second derivative of every
  gap (the ring's motion past the blades included), which with value and rate gives the
  length of the jump. It ends one step before a blade might touch, so that contact
  begins on the same grid of steps as in `modal`.

With `rotation = "full"` the modes of a nodal diameter are coupled. `modal` and `exact`
then march its waves, forward and backward apart, each a complex amplitude that a step
turns (`turning_waves`): those of central differences, or of the exact flow, which
jumps. One loop serves modes and waves, and the rotor's type chooses what it does with
them (`kernels.compiled.verb`). Of unequal sectors `modal` marches waves of the whole
rotor (`whole_waves`). `general` and `paper` march blocks or matrices, and `general`
takes over from `modal` where waves cannot be told apart. With rotation only runs of
equal sectors are certified.

When the sum of all amplitudes is below the gap and every mode is damped and held,
contact cannot recur: this is the certificate, stored with its time and bound, after
which the run continues in closed form. Without one, no run ends early as `damped`.

Evidence for words is sampled independently of the traces, 12 rows a period of the
fastest line that moves the centre: the choice of traces never changes a word. A march
can be saved and resumed between slices (`snapshot`). Equal inputs do not suffice, since
another LAPACK may give a mode the other sign: the SHA-256 of all numbers passed to the
kernel, of the kernels and of numba's version must be the same.
"""
