"""Bodies of a few modes, marched by the loop `bodies` without a scene."""

from types import SimpleNamespace

import numpy as np

from hpcwhirl.dynamics.bodies.operators import body_of_modes
from hpcwhirl.dynamics.bodies.turning import Outputs
from hpcwhirl.dynamics.kernels import contact
from hpcwhirl.dynamics.kernels.kernel_types import (
    BodiesState,
    Contact,
    Coulomb,
    Layer,
    Load,
    Points,
    Ring,
    Strides,
    Tracks,
    Wall,
)
from hpcwhirl.dynamics.kernels.oracle.bodies import march_bodies

FOREVER = 10**9
NO_LAYER = Layer(0.0, 0.0, 0.0, 0.0, 0.0, 0)


class Bodies:
    """A rotor of a few modes, its tips at given angles, in a casing that may move.

    omega, ratios, radial, tangential : of the rotor's modes; shapes at the tips (N, m)
    plane : (omega, shape): one tangential mode that moves the casing under all tips
    """

    def __init__(
        self, omega, radial, tangential, *, step, speed, radius, gap, friction,
        at_rest=0.0, decay=0.0, ratios=None, slip="set-valued", plane=None,
    ):  # fmt: skip
        omega, tips = np.asarray(omega, float), len(radial)
        ratios = np.zeros(len(omega)) if ratios is None else np.asarray(ratios, float)
        seen = Outputs(radial, tangential, np.zeros((2, len(omega))))
        self.rotor = body_of_modes(omega, ratios, step, seen)
        mu = friction * np.sign(speed)
        give = self.rotor.give
        rows = np.vstack([radial, tangential])
        both = (rows * give) @ rows.T
        w = np.ascontiguousarray(both[:tips, :tips] + mu * both[:tips, tips:])
        none, moving = np.zeros((0, 0)), plane is not None
        held, still, ring = none, none, Ring(contact.RIGID, 0, 1.0)
        wave, weight = np.zeros(0), np.ones((tips, 1))
        if moving:
            wave, ring = np.array([plane[0]]), Ring(contact.WAVES, 0, 1.0)
            held, still = np.array([[plane[1]]]), np.zeros((1, 1))
        seen = Outputs(still, held, np.zeros((0, len(wave))))
        self.casing = body_of_modes(wave, 0.0 * wave, step, seen)
        sides = np.vstack([still, held]) if moving else none
        passed = (sides * self.casing.give) @ sides.T if moving else none
        self.step, self.speed, self.mu, self.gap = step, speed, mu, gap
        loose = slip == "set-valued"
        law = Coulomb(
            friction, at_rest, decay, radius,
            np.ascontiguousarray(both.T) if loose else none,
            np.ascontiguousarray(passed) if loose else none,
            np.zeros(0), always=decay > 0.0,
        )  # fmt: skip
        angle = 2 * np.pi * np.arange(tips) / tips
        points = Points(angle, angle / (2 * np.pi), np.zeros(tips), weight)
        alone = np.zeros((1, 1)) if moving else none
        self.contact = Contact(w, alone, ring, -1, points, NO_LAYER, law)
        m, c = len(self.rotor.keep), len(self.casing.keep)
        gaps = np.full(tips, gap)
        self.state = BodiesState(
            np.zeros(m), np.zeros(m), np.zeros(c), np.zeros(c), np.zeros(m),
            np.zeros(max(c, 1)), gaps, gaps.copy(), np.full(tips, -2),
            np.zeros(contact.COUNTERS, np.int64), np.zeros(contact.ENTRIES),
            np.zeros(tips), np.zeros((3, 0)),
        )  # fmt: skip
        self.state.counter[contact.LAST] = -1

    def march(self, steps, every=1):
        """Take steps; return time, amplitudes of the rotor and of the casing."""
        empty = np.zeros((0, 0))
        tracks = Tracks(
            np.zeros((0, 2)), *(np.zeros(0),) * 4, np.zeros((0, 1, 2)), empty,
            np.zeros(0), empty, np.zeros((1, contact.COLUMNS)),
            np.zeros(contact.CLOSED), empty, empty,
        )  # fmt: skip
        none, flat = np.zeros(0), np.zeros(0, np.int64)
        wall = Wall(self.gap, 0, flat, flat, *(none,) * 5, self.gap)
        load = Load(0.0, 1.0, np.zeros(len(self.casing.keep)))
        kept = []
        for _ in range(0, steps, every):
            march_bodies(
                every, Strides(FOREVER, FOREVER), 1e9, self.step, self.speed, self.mu,
                wall, load, self.rotor, self.casing, self.contact, self.state, tracks,
            )  # fmt: skip
            now = self.state.counter[contact.STEP]
            kept.append([now * self.step, *self.state.q_b, *self.state.q_c])
            if self.state.counter[contact.STOP] != contact.RUNNING:
                break
        rows, m = np.array(kept), len(self.state.q_b)
        return SimpleNamespace(
            time=rows[:, 0], rotor=rows[:, 1 : m + 1], casing=rows[:, m + 1 :]
        )
