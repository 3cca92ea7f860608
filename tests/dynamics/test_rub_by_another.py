"""A rub on an elastic layer at a changing speed, against another integrator.

The layer's rods hardly wear, so that contact is a smooth law, and DOP853 integrates the
model's matrices in the rotating frame, the ring in the static one, with all works.
"""

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from hpcwhirl.case import speed
from hpcwhirl.case.resolve import resolve
from hpcwhirl.dynamics.bodies.operators import layer_of
from hpcwhirl.dynamics.bodies.pulse import pulse_load
from hpcwhirl.dynamics.march import March
from hpcwhirl.reduction.bodies import centre_rows, contact_rows
from hpcwhirl.reduction.waves import turning_matrices
from hpcwhirl.scene import apply_settings, named_scene

RUB = {
    "duration": 5e-3, "interval": 2e-5, "time_step": 1e-6, "traces": "full",
    "modes": 15, "casing.harmonics": 4, "blades": 5, "gap": 1e-4, "scheme": "general",
    "contact_law": "archard", "wear_coefficient": 1e-30, "layer_young": 1e8,
    "rotation": "full", "unbalance": 3e-3, "unbalance_phase": 0.4,
}  # fmt: skip
KINDS = {
    "run-down": {"speed": 300.0, "acceleration": -8000.0},
    "clockwise": {"speed": -300.0, "acceleration": -8000.0, "cross_coupling": 3e6},
    "unequal": {"speed": 300.0, "acceleration": 8000.0, "gap_closure": 3e-5,
                "gap_time": 2e-3, "mistuning": [0.03, -0.02, 0.05, 0.0, -0.04]},
}  # fmt: skip
WORKS = "damping", "pulse", "friction", "rotation"
STEP = 1e-6  # rad, of the slope of the ring


def polynomials(rotor, shapes, blades, sense):
    """Return 2 Omega C + D and K + S over Omega, (5, m, m) each, and K alone.

    They are exact polynomials of the fourth degree on one side of Omega = 0.
    """
    at = sense * np.array([100.0, 200.0, 300.0, 400.0, 500.0])
    found = []
    for each in at:
        gyro, damping, held, push = turning_matrices(rotor, each, blades)
        parts = gyro + damping, held + push, damping, held
        found.append([shapes.T @ part @ shapes for part in parts])
    rows = np.reshape(found, (5, -1))
    return np.linalg.solve(np.vander(at), rows).reshape(5, 4, *2 * [len(shapes.T)])


class Another:
    """The same scene by DOP853; a state is (y, y', p, p', r, r', works)."""

    def __init__(self, march):
        model, self.scene = march.model, march.scene
        self.model, self.law = model, speed.law_of(self.scene)
        rotor, self.shapes = model.rotor, model.rotor.shapes
        self.radial, self.tangential = contact_rows(rotor, model.blades)
        self.hub = centre_rows(rotor, model.blades)
        self.sense = np.sign(self.scene.speed)
        self.terms = polynomials(rotor, self.shapes, model.blades, self.sense)
        self.coriolis = self.shapes.T @ rotor.spin.coriolis @ self.shapes
        self.swing = self.shapes.T @ rotor.spin.swing
        self.load = self.scene.force * pulse_load(model, self.scene)
        self.load = self.load @ model.casing.shapes
        layer, self.mu = layer_of(self.scene), self.sense * self.scene.coefficient
        self.stiff = layer.under / layer.flex
        m, n = len(self.swing), len(self.load)
        self.cuts = np.cumsum([0, m, m, n, n, m, m, len(WORKS)])
        ends = march.total * self.scene.solver.time_step
        self.found = solve_ivp(
            self.rate, (0.0, ends), self.begun(), "DOP853", rtol=1e-8, atol=1e-13,
            max_step=3e-5, dense_output=True,
        )  # fmt: skip

    def parts(self, state):
        return [state[a:b] for a, b in pairwise(self.cuts)]

    def at(self, omega):
        """Return 2 Omega C + D, K + S, D and K at a speed."""
        return np.tensordot(np.vander([omega], 5)[0], self.terms, 1)

    def unbalance(self, omega):
        phase = np.exp(1j * self.scene.unbalance_phase)
        pull = (omega**2 - 1j * self.law.rate) * self.scene.unbalance * phase
        return self.hub.T @ [pull.real, pull.imag]

    def begun(self):
        state, omega = np.zeros(self.cuts[-1]), self.law.start
        pull = self.scene.unbalance * omega**2
        pull *= np.exp(1j * self.scene.unbalance_phase)
        circle = np.linalg.solve(self.at(omega)[1], self.hub.T @ [pull.real, pull.imag])
        state[self.cuts[4] : self.cuts[5]] = circle
        return state

    def rate(self, time, state):
        y, v, p, w, r, s, _ = self.parts(state)
        omega, rise = float(self.law.speed(time)), self.law.rate
        drag, hold, damping, _ = self.at(omega)
        swerve = rise * self.coriolis
        angles = self.model.angles + float(self.law.angle(time))
        casing = self.model.casing
        (out, along), (up, _), (low, _) = (
            [rows @ casing.shapes for rows in self.model.ring.rows(angles + turned)]
            for turned in (0.0, STEP, -STEP)
        )
        gap = self.scene.gap - float(speed.closure_at(self.scene, time))
        push = self.stiff * np.maximum(0.0, self.radial @ (y + r) - gap - out @ p)
        load = self.load * np.sin(np.pi * time / self.scene.pulse)
        load *= time < self.scene.pulse
        drop = 2 * casing.ratios * casing.omega
        force = -(self.radial + self.mu * self.tangential).T @ push
        y_ = force - drag @ v - (hold + swerve) @ y
        r_ = self.unbalance(omega) - rise * self.swing
        r_ -= drag @ s + (hold + swerve) @ r
        p_ = (out + self.mu * along).T @ push + load - drop * w - casing.omega**2 * p
        degrees = np.arange(4, 0, -1)
        stiffens = rise * np.tensordot(
            degrees * np.vander([omega], 4)[0], self.terms[:4, 3], 1
        )
        skew = (hold - hold.T) / 2
        closes = self.scene.gap_closure / self.scene.gap_time
        closes *= np.exp(-time / self.scene.gap_time)
        works = [
            v @ damping @ v + v @ skew @ y + w @ (drop * w),
            load @ w + y @ stiffens @ y / 2 - v @ swerve @ y,
            self.mu * push @ (along @ w - self.tangential @ (v + s)),
            push @ (self.radial @ s + closes - omega * (up - low) @ p / (2 * STEP))
            + self.mu * push @ (self.tangential @ s),
        ]
        return np.concatenate([v, y_, w, p_, s, r_, works])


@pytest.mark.turns
@pytest.mark.parametrize("kind", KINDS)
def test_a_rub_at_a_changing_speed_is_that_of_another_integrator(kind, monkeypatch):
    monkeypatch.setattr(speed, "USUAL", 1e-8)
    scene = apply_settings(named_scene("table2"), RUB | KINDS[kind])
    history = (march := March(resolve(scene))).run()
    assert history.contacts > 1
    other = Another(March(resolve(scene)))
    y, _, _, _, r, *_ = other.parts(other.found.sol(history.time))
    for rows, seen in (
        (other.radial, history.tips[..., 0]),
        (other.tangential, history.tips[..., 1]),
        (other.hub, history.centre),
    ):
        by_contact = (rows @ y).T
        miss = np.abs(seen - (rows @ (y + r)).T).max()
        assert miss < 1e-3 * np.abs(by_contact).max()
    works = other.parts(other.found.y[:, -1])[-1]
    for name, true in zip(WORKS, works, strict=True):
        assert history.ledger[name] == pytest.approx(true, abs=2e-4 * max(works)), name
    assert march.done
