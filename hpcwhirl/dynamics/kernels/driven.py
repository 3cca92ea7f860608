"""A rotor whose speed changes: modes coupled by rotation, and forces of the change.

Within an interval of steps the matrices of `coupled` belong to its mean speed. What
the change adds at step n, of amplitudes y about the circle of that speed,

f = f_0 - (dOmega/dt) C y_n,

is explicit; f_0 has the unbalance's tangential force, Euler's force on the blades, and
C x_s. Its work, (d' + d) f / 2, is entered as work of the loading.
"""

from __future__ import annotations

from hpcwhirl.dynamics.kernels import coupled, verbs
from hpcwhirl.dynamics.kernels.contact import PULSE
from hpcwhirl.dynamics.kernels.coupled import apply_blocks
from hpcwhirl.dynamics.kernels.kernel_types import DrivenBody
from hpcwhirl.dynamics.kernels.verbs import does

for _verb, _function in (
    (verbs.predict, coupled.predict),
    (verbs.read, coupled.read),
    *((verb, function) for verb, function in coupled.OF_MODES),
    (verbs.meet, coupled.meet),
    (verbs.accept, coupled.accept),
    (verbs.energy, coupled.energy),
):
    does(_verb, DrivenBody)(_function.py_func)


@does(verbs.stand, DrivenBody)
def stand(body, motion, _, __):
    """Add the increments by the forces of the changing speed.

    `normal`, which contact sets later, is work space.
    """
    q, _, _, ahead, following, change, _ = motion
    body.work[:] = body.force
    apply_blocks(body.swerve, body.starts, q, -1.0, body.work)
    change[:] = 0.0
    apply_blocks(body.give, body.starts, body.work, 1.0, change)
    for m in range(len(q)):
        ahead[m] += change[m]
        following[m] += change[m]


@does(verbs.yielded, DrivenBody)
def yielded(body, motion, _, ledger):
    """Enter their work in the step."""
    for m in range(body.own):
        both = motion.d[m] + motion.ahead[m]
        ledger[PULSE] += 0.5 * body.work[m] * both
