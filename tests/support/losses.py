"""The energy that damping takes in each step, from displacements alone.

It is summed beside the ledger of the waves, whose loss is what works leave. b is the
motion from step n - 1 to n + 1. By central differences the loss of a step is b^T D b /
(4 dt) + b^T S x_n / 2, D the damping matrix and S that of circulatory forces; by the
exact flow it is the integral of 2 xi omega v^2 of each mode, the velocity v at the
step's start, after the impulse, being that which leads to the step's end.
"""

import numpy as np

from hpcwhirl.case.unbalance import steady_at
from hpcwhirl.dynamics.bodies.motion import lowering
from hpcwhirl.dynamics.bodies.turning import turning_terms
from hpcwhirl.dynamics.kernels import contact

NEVER = np.iinfo(np.int64).max
POINTS, WEIGHTS = np.polynomial.legendre.leggauss(12)  # of Gauss, on -1 to 1


def modal_places(march, steps):
    """Return amplitudes of both bodies' modes at steps 0 .. `steps`, and b of step 0.

    The rotor's are those of its motion beside the steady one, as in the ledger.
    """
    model, step = march.model, march.scene.solver.time_step
    bodies = [model.rotor, *([model.casing] if model.casing else [])]
    shapes = model.shapes[: len(bodies)]
    lower = [lowering(*both) for both in zip(bodies, shapes, strict=True)]
    places, begun = [], march.motion()
    march.counter[contact.NEXT_TRY] = NEVER  # no jumps, which end where they please
    for n in range(steps + 1):
        march.advance(min(n, 1))
        x, c = march.displacements()
        both = x - steady_at(model, march.scene, n * step), c
        places.append([own @ part for own, part in zip(lower, both, strict=False)])
    rates = begun.rotor_velocity, begun.casing_velocity
    first = [own @ part * 2 * step for own, part in zip(lower, rates, strict=False)]
    return bodies, [np.array(own) for own in zip(*places, strict=True)], first


def by_differences(march, steps):
    """Return the damping loss of both bodies in steps of central differences, J."""
    step, total = march.scene.solver.time_step, 0.0
    bodies, places, first = modal_places(march, steps)
    for body, q, begun in zip(bodies, places, first, strict=True):
        at_rest = not begun.any()
        b = np.vstack([q[1] - q[0] if at_rest else begun, q[2:] - q[:-2]])
        if body.spin is not None:
            terms = turning_terms(march.model, march.scene, body.shapes)
            total += np.einsum("ni,ij,nj", b, terms.damping, b) / (4 * step)
            total += np.einsum("ni,ij,nj", b, terms.push, q[:-1]) / 2
        else:
            total += (2 * body.ratios * body.omega * b**2).sum() / (4 * step)
    return total


def by_flow(march, steps):
    """Return the damping loss of both bodies' uncoupled modes by the exact flow, J."""
    step, total = march.scene.solver.time_step, 0.0
    bodies, places, _ = modal_places(march, steps)
    t = step * (POINTS + 1.0) / 2
    for body, q in zip(bodies, places, strict=True):
        rate, omega = body.ratios * body.omega, body.omega
        swing = omega * np.sqrt(1 - body.ratios**2)

        def sine(time, swing=swing):
            return np.sin(swing * time) / swing

        def decay(time, rate=rate, swing=swing):
            return np.exp(-rate * time), np.cos(swing * time)

        fall, turn = decay(step)
        start = (q[1:] - fall * (turn + rate * sine(step)) * q[:-1]) / fall / sine(step)
        for at, weight in zip(t, WEIGHTS, strict=True):
            fall, turn = decay(at)
            v = fall * (turn - rate * sine(at)) * start
            v = v - fall * omega**2 * sine(at) * q[:-1]
            total += (2 * rate * v**2).sum() * weight * step / 2
    return total
