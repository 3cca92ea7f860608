"""The energy that damping takes in each step, from displacements alone.

It is summed beside the ledger of the waves, whose loss is what works leave. b is the
motion from step n - 1 to n + 1. By central differences the loss of a step is b^T D b /
(4 dt) + b^T S x_n / 2, D the damping matrix and S that of circulatory forces; by the
exact flow it is the integral of 2 xi omega v^2 of each mode, the velocity v at the
step's start, after the impulse, being that which leads to the step's end.

A rotor that loses a blade during the run is another body from then on: each stretch is
summed by its matrices, about its steady motion.
"""

import numpy as np

from hpcwhirl.case.unbalance import loss_step, steady_at, steady_rates
from hpcwhirl.dynamics.bodies.motion import lowering
from hpcwhirl.dynamics.bodies.turning import Terms, turning_terms
from hpcwhirl.dynamics.kernels import contact

NEVER = np.iinfo(np.int64).max
POINTS, WEIGHTS = np.polynomial.legendre.leggauss(12)  # of Gauss, on -1 to 1


def stretches(march, steps):
    """Return (model, scene, first step, last step) before and after a lost blade."""
    case, at = march.case, loss_step(march.scene)
    if case.before is None:
        return [(march.model, march.scene, 0, steps)]
    wheel, left = case.before, (march.model, march.scene, at, steps)
    return [(wheel.model, wheel.scene, 0, at), left]


def modal_places(march, model, scene, first, last):
    """Return both bodies, their modes' amplitudes at all steps, and first velocities.

    The rotor's are those of its motion beside the steady one, as in the ledger. At the
    step at whose end a blade is lost, they are those of the rotor with all blades.
    """
    step, begun = scene.solver.time_step, march.motion()
    bodies = [model.rotor, *([model.casing] if model.casing else [])]
    shapes = model.shapes[: len(bodies)]
    lower = [lowering(*both) for both in zip(bodies, shapes, strict=True)]
    places = []
    march.counter[contact.NEXT_TRY] = NEVER  # no jumps, which end where they please
    for n in range(first, last + 1):
        march.advance(min(n - first, 1))
        x, c = march.displacements()
        if n == last and model is not march.model:  # it is lost already
            x = march.model.rotor.into_whole @ x
        both = x - steady_at(model, scene, n * step), c
        places.append([own @ part for own, part in zip(lower, both, strict=False)])
    turning = begun.rotor_velocity - steady_rates(model, scene, first * step)
    rates = turning, begun.casing_velocity
    rates = [own @ part for own, part in zip(lower, rates, strict=False)]
    return bodies, [np.array(own) for own in zip(*places, strict=True)], rates


def terms_of(body, model, scene):
    """Return the matrices of a body's equation of motion, of its modes."""
    if body.spin is not None:
        return turning_terms(model, scene, body.shapes)
    none = np.zeros((len(body.omega), len(body.omega)))
    damping = np.diag(2 * body.ratios * body.omega)
    return Terms(np.eye(len(none)), none, damping, np.diag(body.omega**2), none)


def by_terms(terms, q, rate, step):
    """Return the damping loss of a body, J; b of the first step has its forces' part.

    q, rate : (steps + 1, m), (m,), amplitudes at all steps, velocities at the first, in
        which the forces of this step are not included
    """
    mass, gyro, damping, stiffness, push = terms
    pull = (damping + gyro) @ rate + (stiffness + push) @ q[0]
    free = q[0] + step * rate - step**2 / 2 * np.linalg.solve(mass, pull)
    b = np.vstack([2 * step * rate + q[1] - free, q[2:] - q[:-2]])
    taken = np.einsum("ni,ij,nj", b, damping, b) / (4 * step)
    return taken + np.einsum("ni,ij,nj", b, push, q[:-1]) / 2


def by_differences(march, steps):
    """Return the damping loss of both bodies in steps of central differences, J."""
    total = 0.0
    for model, scene, first, last in stretches(march, steps):
        parts = modal_places(march, model, scene, first, last)
        for body, q, rate in zip(*parts, strict=True):
            terms = terms_of(body, model, scene)
            total += by_terms(terms, q, rate, scene.solver.time_step)
    return total


def by_flow(march, steps):
    """Return the damping loss of both bodies' uncoupled modes by the exact flow, J."""
    step, total = march.scene.solver.time_step, 0.0
    bodies, places, _ = modal_places(march, march.model, march.scene, 0, steps)
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
