"""The certificate of unequal sectors with all that rotation adds."""

import numpy as np
import pytest
from alike import assert_rest_as_marched

from hpcwhirl.case.resolve import resolve
from hpcwhirl.dynamics.kernels.loop.flight import LESS
from hpcwhirl.dynamics.kernels.loop.wave_types import PointsRotor
from hpcwhirl.dynamics.march import March
from hpcwhirl.scene import Scene, apply_settings

NAMES = {
    "shaft": "engine.rotor.suspension_damping", "damping": "engine.rotor.damping",
    "ring": "casing.damping", "kind": "casing.kind",
}  # fmt: skip
SMALL = {
    "rotation": "full", "blades": 5, "modes": 10, "harmonics": 4, "scheme": "modal",
    "mistuning": [0.05, -0.02, 0.01, 0.01, -0.02], "time_step": 4e-6,
    "revolutions": 0.0, "interval": 1e-3,
}  # fmt: skip


def march_of(**settings):
    given = {NAMES.get(name, name): value for name, value in settings.items()}
    march = March(resolve(apply_settings(Scene(), {**SMALL, **given})))
    assert isinstance(march.scheme.arrays.rotor, PointsRotor)
    return march


def coast_of(march):
    return march.scheme.free()


def drawn(seed, **given):
    """Return inputs of an engine that nearly always comes to rest after contact."""
    random = np.random.default_rng(seed)
    blades = int(random.integers(2, 9))
    return {
        "blades": blades, "modes": 2 * blades, "harmonics": min(4, blades),
        "mistuning": random.normal(0.0, 0.03, blades).tolist(),
        "speed": float(random.uniform(-500.0, 500.0)), "nodal_diameter": 2,
        "gap": float(10 ** random.uniform(-4.2, -3.9)), "ring": 0.1, "shaft": 0.1,
        "damping": float(random.uniform(0.005, 0.05)), "duration": 0.3,
        "friction": float(random.choice([0.0, 0.02])), "traces": "full",
    } | given  # fmt: skip


@pytest.mark.turns
@pytest.mark.parametrize(
    ("seed", "unbalance"),
    [(2, 1e-2), (4, 1e-3), (7, 0.0), (9, 1e-2), (11, 1e-3), (12, 0.0)],
)
def test_the_rest_in_closed_form_is_the_rest_marched(seed, unbalance):
    given = drawn(seed, unbalance=unbalance)
    one, other = march_of(**given), march_of(**given, plan="everything")
    history, _ = one.run(), other.run()
    assert history.certificate < 0.9 * history.end
    assert one.marched < 0.9 * one.total
    assert_rest_as_marched(one, other)


def moved(march, steps):
    """Return how far each tip moves radially at most in so many free steps, (N,), m."""
    blades, most = march.model.blades, 0.0
    for _ in range(steps):
        march.advance(1)
        tips = march.displacements()[0][: 2 * blades : 2]
        most = np.maximum(most, np.abs(tips))
    return most


@pytest.mark.turns
@pytest.mark.parametrize(("wave", "share"), [(0, 0.9), (4, 0.9), (None, 0.2)])
@pytest.mark.parametrize("unbalance", [0.0, 1e-3])
def test_the_bound_of_the_certificate_is_one_of_each_blade(wave, share, unbalance):
    """A single wave reaches it; the circle of an unbalance is part of it."""
    march = march_of(
        gap=1.0, force=0.0, duration=0.05, speed=300.0, unbalance=unbalance,
        kind="rigid", amplitude_limit=10.0, until="certain",
    )  # fmt: skip
    own, random = march.scheme.waves, np.random.default_rng(2)
    slow, paired = (np.argsort(np.abs(own.rotor.ahead)), own.rotor.ahead.imag != 0.0)
    size = random.normal(size=(2, len(slow))) * 1e-7 * paired
    if wave is not None:
        size[:, np.delete(slow, wave)] = 0.0
    place = own.apart[0]
    march.state.rotor[place], march.state.rotor[own.half + place] = size
    coast = coast_of(march)
    bound = coast.bound(march.state)[0].sum(axis=1)
    assert coast.possible
    assert bound.shape == (5,)
    far = coast.farthest(march.state)
    most = moved(march, 3000)
    assert (most < LESS * bound).all()
    assert (most > share * bound).all()
    assert most.max() < far


def test_a_lost_blade_bounds_nothing():
    march = march_of(
        gap=1.0, lost_blade=2, duration=0.05, speed=100.0, force=0.0,
        amplitude_limit=10.0, kind="rigid",
    )  # fmt: skip
    coast = coast_of(march)
    march.state.rotor[:] = 1e-6
    bound = coast.bound(march.state)[0].sum(axis=1)
    assert bound[2] == 0.0
    assert (np.delete(bound, 2) > 0.0).all()


@pytest.mark.parametrize(
    "given",
    [
        {"speed": 900.0, "damping": 0.02, "shaft": 0.02},  # free motion grows
        {"damping": 0.0, "shaft": 0.0},  # it lasts
    ],
)
def test_no_certificate_where_motion_may_last(given):
    march = march_of(gap=1.0, duration=0.05, **given)
    coast = coast_of(march)
    assert not coast.possible
    assert march.coast is None


def test_a_run_until_certain_ends_there():
    given = drawn(7, until="certain")
    march = march_of(**given)
    history = march.run()
    assert history.stop == "certain"
    assert history.end == history.certificate < given["duration"]
