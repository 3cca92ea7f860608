"""What a scene adds to the loops of waves is what the loop `bodies` makes of it."""

import numpy as np
import pytest

from hpcwhirl.case.resolve import resolve
from hpcwhirl.dynamics.kernels import contact
from hpcwhirl.dynamics.kernels.loop.wave_types import PointsRotor, SlotRotor
from hpcwhirl.dynamics.kernels.vectors import FOUR
from hpcwhirl.dynamics.march import March
from hpcwhirl.scene import Scene, apply_settings

SMALL = {
    "blades": 5, "modes": 10, "harmonics": 4, "nodal_diameter": 1, "gap": 5e-5,
    "rotation": "full", "speed": 420.0, "friction": 0.2, "time_step": 4e-6,
    "duration": 6e-3, "revolutions": 0.0, "interval": 1e-4, "traces": "blades",
}  # fmt: skip
UNEVEN = {"mistuning": [0.05, -0.02, 0.01, 0.01, -0.02]}
APART = {"stiffness_difference": 5e6, "damping_difference": -20.0,
         "suspension_damping": 0.05}  # fmt: skip
FILM = {
    "film_viscosity": 0.05, "film_length": 0.03, "film_radius": 0.05,
    "film_clearance": 2e-4,
}  # fmt: skip
SCENES = {
    "unlike": APART,
    "unlike, back": {**APART, "speed": -420.0},
    "unlike, unbalance": {**APART, "unbalance": 2e-3},
    "unlike, uneven": {**APART, **UNEVEN},
    "unlike, oval": {
        **APART, "casing.profile": "harmonic,amplitude,phase;2,1e-5,0.3",
        "casing.profile_release": 3e-3,
    },
    "film": FILM,
    "film, unbalance": {**FILM, "unbalance": 5e-4},
    "film, uneven": {**FILM, **UNEVEN, "unbalance": 5e-4},
    "film, rigid": {
        **FILM, "casing.kind": "rigid", "casing.amplitude": 8e-5, "casing.rise": 1e-3,
    },
    "closing": {**APART, "gap_closure": 2e-5, "gap_time": 3e-3},
    "unbalance, uneven": {**UNEVEN, "unbalance": 2e-3},
    "oval, uneven": {
        **UNEVEN, "casing.profile": "harmonic,amplitude,phase;2,1e-5,0.3",
        "casing.profile_release": 3e-3,
    },
    "lost": {"lost_blade": 2, "amplitude_limit": 0.5, "centre_stiffness": 3e8},
}  # fmt: skip
IN_TABLE = {"unlike", "film", "lost"}  # of which tests/dynamics/test_laws.py asks


def march_of(name, **given):
    return March(resolve(apply_settings(Scene(), {**SMALL, **SCENES[name], **given})))


def off(one, other):
    """Return the largest difference, relative to the largest number."""
    return np.abs(one - other).max() / np.abs(other).max()


@pytest.mark.parametrize("name", sorted(SCENES.keys() - IN_TABLE))
def test_waves_with_a_term_move_as_bodies_do(name):
    waves, bodies = (march_of(name, scheme=s) for s in ("modal", "general"))
    kind = PointsRotor if "uneven" in name else SlotRotor
    assert isinstance(waves.scheme.arrays.rotor, kind)
    one, other = waves.run(), bodies.run()
    assert one.contacts == other.contacts > 1
    assert off(one.tips, other.tips) < 1e-9
    assert off(one.centre, other.centre) < 1e-8
    here, there = waves.motion(), bodies.motion()
    assert off(here.rotor, there.rotor) < 1e-9
    assert off(here.rotor_velocity, there.rotor_velocity) < 1e-8
    through = sum(map(abs, other.ledger.values()))
    for term, value in one.ledger.items():
        assert value == pytest.approx(other.ledger[term], abs=1e-8 * through), term
    assert abs(one.ledger["residual"]) < 1e-10 * through


@pytest.mark.parametrize("name", ["unlike, unbalance", "film, uneven"])
def test_a_term_in_slices_gives_the_same_bits(name):
    whole, parts = (march_of(name, scheme="modal") for _ in range(2))
    whole.advance(whole.total)
    while not parts.done:
        parts.advance(7)
    assert whole.counter[contact.TOUCHED] > 0
    for one, other in zip(parts.state, whole.state, strict=True):
        assert one.tobytes() == other.tobytes()


def test_supports_push_only_the_waves_that_move_the_centre():
    """With equal sectors those of nodal diameter 1; with unequal ones all may."""
    equal, uneven = (
        march_of(n, scheme="modal").scheme for n in ("unlike", "unlike, uneven")
    )
    support, slots = equal.arrays.rotor.support, equal.rotor.there.shape[1]
    pushed = support.gives.reshape(-1, 2, FOUR).any(axis=(0, 1))
    assert np.flatnonzero(pushed).tolist() == [1] == [support.slot]
    assert np.array_equal(
        equal.arrays.rotor.centre,
        equal.at.rotor_at(np.flatnonzero(equal.rotor.there[:, 1]), 1),
    )
    assert slots <= FOUR  # so that one group has all waves
    pushed = uneven.arrays.rotor.support.gives.reshape(-1, 2, 2, FOUR).any(axis=1)
    assert np.count_nonzero(pushed) > 2 * equal.rotor.there[:, 1].sum()  # re, im
