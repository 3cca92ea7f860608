"""The operations of the time loop `points.march_points`, by type of its rows.

The rows are the coefficients of the waves: `wave_types.PointRows` and `SectorRows`, by
points whose gaps are bounded (`bounded`), or `SlotRows` and `FlowRows`, by slots
(`slot_steps`, `slot_flights`). Texts here have the arguments of all implementations:

rows : the rows, a field of the rotor, whose type selects the implementation
rotor, contact, wall : constant arrays of the loop; `kernel_types.Wall`
state, space : `kernel_types.CyclicState`; work space of the loop
step, speed, mu : dt, s; Omega, rad/s; friction with the sign of the speed
"""

from __future__ import annotations

from hpcwhirl.dynamics.kernels.compiled import verb


@verb
def set_out(rows, state, space):
    """Prepare the work space for a call of the loop, from a state."""


@verb
def flew(rows, rotor, wall, strides, mu, step, speed, loading, state, space, tracks):
    """Jump over steps if no point can touch for a while; return whether it did.

    strides, loading, tracks : arguments of `points.march_points`
    """


@verb
def advance(rows, rotor, contact, wall, step, speed, state, space):
    """Take a step without contact forces, after those of the last step.

    If it is checked (`contact.slips_now`), the slip of the last step's contacts is
    entered in ledger[SLIP].
    """


@verb
def kick(rows, rotor, thrust, angle, state, space):
    """Add the effect of the pulse on the casing to the predicted step.

    Return the motion along the pulse over two steps, m, without any force of the step.

    thrust, angle : N; rad, the rotor's angle times the number of lobes
    """


@verb
def farthest(rows, rotor, limit, state, space):
    """Return the largest displacement of a contact point, m, or a bound of it.

    The bound is returned if it is below `contact.NEAR` times the limit, m.
    """


@verb
def touch(rows, rotor, contact, wall, mu, step, speed, thrust, angle, every, looks,
          state, space):  # fmt: skip
    """Find the contact forces of a step, enter their works, apply or keep them.

    Return the number of points in contact; 0 if none; -1 if no solution was found.

    thrust, angle : as in `kick`
    every, looks : whether all gaps must be computed; whether bounds must be computed
    """


@verb
def work_of_kick(rows, rotor, thrust, angle, moved, state, space):
    """Return the work of the pulse in a step, J; moved : m, result of `kick`."""


@verb
def sample(rows, rotor, wall, mu, step, speed, state, space, keep, judge, tracks):
    """Write the state of a step to the traces or to the evidence.

    keep, judge, tracks : as in `contact.write_sample`
    """


@verb
def conclude(rows, rotor, wall, step, speed, state, space):
    """Complete the state at the end of a call of the loop."""
