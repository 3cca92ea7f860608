"""A case in a lane has the bits it has alone, whoever rides beside it."""

import subprocess
import sys

import numpy as np
import pytest

from hpcwhirl.case.resolve import resolve
from hpcwhirl.dynamics.batch import Batch
from hpcwhirl.dynamics.kernels import contact
from hpcwhirl.dynamics.lanes import Lanes, can_ride
from hpcwhirl.dynamics.march import March
from hpcwhirl.errors import InputError
from hpcwhirl.scene import apply_settings, named_scene

MIXED = [
    {"nodal_diameter": 1},
    {"nodal_diameter": 2, "speed": -380.0, "friction": 0.3},
    {"nodal_diameter": 3, "speed": 300.0, "friction": 0.0, "duration": 2.3e-3},
    {"nodal_diameter": 1, "speed": 520.0, "duration": 1.7e-3, "interval": 3e-5},
    {"nodal_diameter": 1, "force": 1.0, "direction": "stretch"},
    {"nodal_diameter": 3, "speed": 0.0, "friction": 0.2, "duration": 1.9e-3},
    {"nodal_diameter": 2, "speed": -450.0, "pulse": 5e-4},
]
SLOW_21, SLOW_12 = (pytest.param(n, marks=pytest.mark.slow) for n in (21, 12))


def scene(**settings):
    fast = {"duration": 3e-3, "interval": 1e-5, "traces": "full", "time_step": 2e-6,
            "plan": "everything"}  # fmt: skip
    return apply_settings(named_scene("table2"), fast | settings)


def marched(scenes, slices=(1, 7, 100, 333), first=0):
    """Return the marches of the scenes, four lanes, refilled; first : lane to fill."""
    marches = [March(resolve(s)) for s in scenes]
    lanes, waiting, ended = Lanes(marches[0]), list(marches), []
    order = [(first + i) % 4 for i in range(4)]
    for lane in order:
        if waiting:
            lanes.load(lane, waiting.pop(0))
    turn = 0
    while len(ended) < len(marches):
        lanes.advance(slices[turn % len(slices)])
        turn += 1
        for lane in lanes.ended():
            ended.append(lanes.unload(lane))
            if waiting:
                lanes.load(lane, waiting.pop(0))
    return marches


def assert_same_bits(one, other):
    for a, b in zip(one.state + one.tracks, other.state + other.tracks, strict=True):
        assert a.shape == b.shape
        assert np.array_equal(a, b)


def alone(own):
    march = March(resolve(own))
    march.advance(10**9)
    return march


@pytest.mark.parametrize("blades", [22, SLOW_21, SLOW_12])
def test_a_lane_has_the_bits_of_the_case_alone(blades):
    scenes = [scene(blades=blades, **settings) for settings in MIXED]
    together = marched(scenes, first=blades % 4)
    touched = 0
    for case, march in zip(scenes, together, strict=True):
        own = alone(case)
        assert_same_bits(own, march)
        assert own.history().ledger == march.history().ledger
        touched += int(march.counter[contact.TOUCHED])
    assert touched > 2000


def test_what_rides_beside_does_not_matter():
    cases = [scene(**MIXED[i]) for i in (0, 1)]
    one, _ = marched(cases)
    other = marched([cases[1], cases[0]], slices=(41,), first=3)[1]
    assert_same_bits(one, other)


def test_a_march_may_enter_a_lane_and_leave_it_at_any_step():
    march, own = March(resolve(scene())), March(resolve(scene()))
    march.advance(501)
    lanes = Lanes(march)
    lanes.load(1, March(resolve(scene(speed=300.0))))
    lanes.advance(100)
    lanes.load(2, march)
    lanes.advance(401)
    assert lanes.unload(2) is march
    march.advance(10**9)
    own.advance(10**9)
    assert_same_bits(march, own)


@pytest.mark.parametrize("lanes", [1, 3, 8])
def test_a_batch_yields_every_case_once_with_its_history(lanes):
    scenes = [scene(**settings) for settings in MIXED]
    called = []
    found = dict(Batch(map(resolve, scenes), lanes).run(lambda: called.append(1)))
    assert sorted(found) == list(range(len(scenes)))
    assert called
    for place, history in found.items():
        own = March(resolve(scenes[place])).run()
        assert history.stop == own.stop == "end"
        assert history.ledger == own.ledger
        assert history.contacts == own.contacts
        assert history.seconds > 0
        assert np.array_equal(history.tips, own.tips)
        assert np.array_equal(history.centre, own.centre)
        assert np.array_equal(history.casing, own.casing)
        assert history.casing.any()


def test_a_case_that_grows_beyond_the_limit_ends_alone():
    usual = scene()
    low = scene(amplitude_limit=1e-5)
    together = marched([usual, low, usual], slices=(10**6,))
    assert together[1].history().stop == "amplitude"
    assert together[1].steps < together[0].steps
    for case, march in zip((usual, low, usual), together, strict=True):
        assert_same_bits(alone(case), march)


def test_a_nonfinite_case_ends_alone():
    marches = [March(resolve(scene())) for _ in range(2)]
    lanes = Lanes(marches[0])
    marches[0].state.rotor[30] = np.inf
    for lane in (0, 1):
        lanes.load(lane, marches[lane])
    while not lanes.ended():
        lanes.advance(50)
    assert lanes.ended() == [0]
    assert lanes.unload(0).history().stop in {"nonfinite", "complementarity"}
    while not lanes.ended():
        lanes.advance(10**6)
    assert_same_bits(lanes.unload(1), alone(scene()))


@pytest.mark.slow
def test_compiled_kernels_are_found_in_the_cache():
    # by a second process: what closes over compiled functions would be missed
    script = (
        "from hpcwhirl.dynamics.lanes import Lanes\n"
        "from hpcwhirl.dynamics.march import March\n"
        "from hpcwhirl.scene import named_scene\n"
        "march = March(resolve(named_scene('table2')))\n"
        "march.advance(1)\n"
        "lanes = Lanes(march)\n"
        "lanes.load(0, march)\n"
        "lanes.advance(1)\n"
        "kernels = march.scheme.kernel, lanes.kernel\n"
        "print(sum(len(k.stats.cache_misses) for k in kernels))\n"
    )
    for _ in range(2):
        done = subprocess.run(
            [sys.executable, "-c", script], capture_output=True, text=True, check=True
        )
    assert done.stdout.split() == ["0"]


def test_only_what_the_kernel_knows_may_ride():
    rigid = {"kind": "rigid", "amplitude": 2e-4}
    refused = [rigid, {"discretization": "elements"}, {"scheme": "exact"}]
    refused += [{"scheme": "general"}, {"scheme": "paper"}]
    assert can_ride(resolve(scene()))
    for settings in refused:
        assert not can_ride(resolve(scene(**settings)))
    with pytest.raises(InputError, match="a lane takes"):
        next(Batch([resolve(scene(**rigid))]).run())


def test_cases_that_do_not_share_a_model_are_refused():
    with pytest.raises(InputError, match="must share engine, gap"):
        next(Batch(map(resolve, [scene(), scene(gap=2e-3)])).run())
    with pytest.raises(InputError, match="lanes must be in"):
        Batch([], 0)
