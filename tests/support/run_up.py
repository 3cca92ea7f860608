"""A run-up of a stiff unbalanced rotor, and its motion by another integrator."""

import numpy as np
from scipy.integrate import solve_ivp

from hpcwhirl.case import speed
from hpcwhirl.case.resolve import resolve
from hpcwhirl.dynamics.march import March
from hpcwhirl.reduction.bodies import centre_rows
from hpcwhirl.reduction.waves import turning_matrices
from tests.support.jeffcott import HEAVY, MASS, stiff

OWN = 40.0  # rad/s, of the suspension
SOFT = {
    "centre_stiffness": MASS * OWN**2, "rotor.young": 1e10, "gap": 1.0, "speed": 10.0,
    "acceleration": 40.0, "duration": 1.2, "interval": 1e-3, "casing.kind": "rigid",
    "time_step": 2e-5,
}  # fmt: skip


def run_up(**settings):
    """Return (march, history) of a rotor that is run up through its critical speed."""
    march = March(resolve(stiff(3, **(SOFT | settings))))
    return march, march.run()


def orbit(march, history):
    """Return the centre in the static frame, (n,), m."""
    angle = speed.angle_at(march.scene, history.time)
    return (history.centre @ [1.0, 1j]) * np.exp(1j * angle)


def by_another(march, times):
    """Return the centre at times by DOP853, rotating frame, (n,), m.

    Of the modes that move it, M q'' + (D + 2 Omega C) q' + (K(Omega) + S + Omega' C) q
    = f, f of the unbalance, m e (Omega^2 - i Omega').
    """
    model, law = march.model, speed.law_of(march.scene)
    own = np.flatnonzero(model.rotor.diameter == 1)
    shapes = model.rotor.shapes[:, own]
    hub = centre_rows(model.rotor, model.blades)[:, own]
    rate, coriolis = law.rate, shapes.T @ model.rotor.spin.coriolis @ shapes
    known = np.array([0.0, 100.0, 200.0])
    parts = []
    for at in known:  # each matrix is a polynomial of Omega: exact in Omega^2 and Omega
        gyro, damping, stiffness, push = turning_matrices(model.rotor, at, model.blades)
        parts.append(
            [shapes.T @ m @ shapes for m in (gyro + damping, stiffness + push)]
        )
    first, second = (
        np.linalg.solve(np.vander(known, 3), np.reshape([p[i] for p in parts], (3, -1)))
        for i in (0, 1)
    )

    (a, b, c), (d, e, f) = (m.reshape(3, len(own), -1) for m in (first, second))

    def motion(time, state):
        q, v = state[: len(own)], state[len(own) :]
        omega = law.start + rate * time
        push = hub.T @ [HEAVY * omega**2, -HEAVY * rate]
        pull = (omega * (omega * a + b) + c) @ v
        pull += (omega * (omega * d + e) + f + rate * coriolis) @ q
        return np.concatenate([v, push - pull])

    at = law.start * (law.start * d + e) + f
    begun = np.linalg.solve(at, hub.T @ [HEAVY * law.start**2, 0.0])
    found = solve_ivp(
        motion, (0.0, times[-1]), np.concatenate([begun, 0.0 * begun]), "DOP853",
        t_eval=times, rtol=1e-8, atol=1e-15,
    )  # fmt: skip
    return (hub @ found.y[: len(own)]).T @ [1.0, 1j]
