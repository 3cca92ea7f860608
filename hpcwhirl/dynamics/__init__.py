"""Time integration of both bodies and their contact.

A time integration in progress is called a march. The paper's Algorithm 1 consists of
prediction without contact, complementarity of all gaps at once (block pivoting, then
Murty's rule, which ends for any P-matrix), friction on both bodies, distribution of the
contact forces by the same shape functions that give displacements, and correction. The
recursion is in increments, so that it loses no digits on slow modes. Kernels run in
slices of 10 ms; any division into slices gives the same bits. Amplitudes below 1e-150
are set to zero, since denormals are slow.

Rooms, from the lowest: `kernels` has all compiled code, in it two time loops that share
only contact (`kernels.loop` of waves, `kernels.oracle` of bodies); `bodies` describes
rotor and casing by modes or coordinates; `waves` makes waves of them, with the
certificate and closed form of free motion (`waves.free_motion`); a module of `schemes`
makes the integrator of a scene, which `march` runs.

- `paper` is Algorithm 1 on dense matrices, the reference for the other schemes.
- `modal` integrates waves of both bodies in the rotating frame, in which no coefficient
  depends on the position of the blades: a step multiplies each complex amplitude by a
  complex number (`kernels.loop.points`). With three or more equal sectors, one contact
  point a tip and a ring of harmonics, waves lie in slots, one for each nodal diameter
  (`kernels.loop.slots`): one real transform of N points gives all gaps of both bodies,
  its conjugate all modal forces, and one pass a step reads and writes each amplitude
  once. For unequal sectors, and fewer than three, and for several contact points a tip,
  waves have rows of points. There a bound of the tips' motion in a step tells which
  tips must be computed, and a blade in contact costs only the products of its rows.
  What is special about a scene is a term of this loop: the circle of an unbalance is a
  wave that stays, a lost blade a gap that never closes, the force of supports that
  differ by direction or have a film acts on the waves that move the centre, and the
  rods of a layer that wears are springs in series with the Delassus matrix. Friction
  that follows the slip is that of permanent sliding where this obeys Coulomb's law, and
  else the rest of it is a further force of the step (`kernels.coulomb`). Where the
  speed changes, coefficients are those of intervals; with rotation, the waves of equal
  sectors differ from one interval to the next, which the motion does not, and those of
  the motion without contact are a term (`waves.driven_slots`).
  `general` serves all other models. In slots, the contribution of contact,
  which is known only after all blades are predicted, is stored as a spectrum until the
  next pass. Vector operations are explicit, so that sums and products are rounded in
  the same way on every machine. The active blades stay the same in 98 of 100 steps: the
  inverse of their part of the Delassus matrix is kept, and for more than 24 blades
  updated as blades enter and leave. Gaps are not computed in steps in which none can
  close, since the spectrum has not changed enough.
- `general` integrates the modes of both bodies one by one, the casing's in the static
  frame, and updates the positions of the blades in every step: anything, slowly. It is
  the only one for a ring of elements, which is not the same at every angle in any
  frame, and for modes that do not oscillate.
- `exact` is the pass over slots of `modal` with the factor e^{s dt} of each wave, s its
  root. Contact is an impulse at the beginning of a step, such that no blade penetrates
  at its end. Away from contact it jumps over many steps: amplitudes bound the second
  derivative of every gap (including the ring's motion past the blades), which together
  with value and rate gives the length of the jump. A jump ends one step before a blade
  might touch, so that contact begins on the same grid of steps as in `modal`.

With `rotation = "full"` the modes of a nodal diameter are coupled. `modal` and `exact`
then integrate waves of the coupled modes, forward and backward ones separately
(`turning_waves`); without rotation, a mode is two waves (`slot_waves`). The type of the
rows chooses the functions that the loop calls (`kernels.loop.point_verbs`). Waves of
the whole rotor are coupled with rotation (`whole_waves`); otherwise each mode is a wave
(`mode_waves`). `general` and `paper` integrate blocks or matrices, and `general` takes
over from `modal` if waves nearly coincide.

If the sum of all amplitudes is below the gap and every mode has damping and stiffness,
contact cannot recur: this is the certificate. It is stored with its time and bound, and
the run continues in closed form. Without it, no run ends early as `damped`.

Evidence for words is sampled independently of the traces, with 12 rows per period of
the highest frequency that moves the centre: the choice of traces changes no word. A
march can be saved and resumed between slices (`snapshot`). Equal inputs do not suffice
for that, since another LAPACK may change the sign of a mode: the SHA-256 of all numbers
passed to the kernel, of the kernels and of numba's version must be the same.
"""
