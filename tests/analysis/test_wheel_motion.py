"""Frames of the wheel: a blade that pushes has a closed gap, and none overlaps."""

import base64

import numpy as np
import pytest

import hpcwhirl
from hpcwhirl.analysis.wheel_motion import frames_of
from hpcwhirl.errors import InputError
from hpcwhirl.report.page import motion

PROFILE = "harmonic,amplitude,phase;2,2e-5,0.3"
FULL = {"engine.rotation": "full"}
SCENES = {
    "as it stands": {},
    "backward": FULL | {"speed": -420.0},
    "unbalance": FULL | {"unbalance": 2e-3},
    "gap at rest": FULL | {"gap_at": "rest", "gap": 4e-4},
    "oval that rises": {"engine.casing.profile": PROFILE, "engine.casing.offset": 3e-5,
                        "engine.casing.profile_rise": 0.01},
    "release": {"engine.casing.profile": PROFILE,
                "engine.casing.profile_release": 0.01},
    "rigid": {"engine.casing.kind": "rigid", "unbalance": 2e-2, **FULL},
    "lost blade": FULL | {"engine.rotor.lost_blade": 3},
    "run-up": {"acceleration": 300.0},
}  # fmt: skip


def scene(**inputs):
    from hpcwhirl.scene import apply_settings

    few = {"engine.rotor.blades": 9, "solver.modes": 54, "speed": 420.0,
           "duration": 0.03, "output.traces": "full"}  # fmt: skip
    return apply_settings(hpcwhirl.Scene(), few | inputs)


@pytest.mark.parametrize("name", SCENES)
def test_blades_that_keep_pushing_have_closed_gaps_and_none_overlaps(name):
    one = scene(**SCENES[name])
    done = hpcwhirl.simulate(one)
    found = frames_of(one, done.row, done.traces, 200)
    gaps = found.openings() / one.gap
    pushed = found.force > 0.0
    held = pushed & np.roll(pushed, 1, axis=0) & np.roll(pushed, -1, axis=0)
    assert gaps.min() > -1e-6
    assert not held.any() or np.median(abs(gaps[held])) < 1e-6
    assert name == "rigid" or (found.force > 0.0).any()


def test_forces_add_up_to_the_impulse_of_the_contacts():
    one = scene()
    done = hpcwhirl.simulate(one)
    found = frames_of(one, done.row | {"regime": "sustained"}, done.traces, 10_000)
    step = found.time[1] - found.time[0]
    impulse = done.traces["blade_impulse"]
    first = int(np.abs(done.traces["time"] - found.time[0]).argmin())
    want = impulse[-1] - impulse[first]
    np.testing.assert_allclose(step * found.force[1:].sum(axis=0), want, rtol=1e-9)


def test_a_page_keeps_frames_to_16_bits():
    one = scene()
    done = hpcwhirl.simulate(one)
    found = frames_of(one, done.row, done.traces, 60)
    coded = motion._coded(found, one)
    raw = base64.b64decode(coded["data"])
    count, blades = found.force.shape
    tips = np.frombuffer(raw, "<i2", 2 * count * blades, 8 * count + 4 * count)
    tips = tips.reshape(found.tips.shape) * (coded["scales"][1] / 32767)
    np.testing.assert_allclose(tips, found.tips, atol=coded["scales"][1] / 60_000)
    assert len(coded["data"]) < 100_000


def test_a_case_without_full_traces_is_refused():
    one = scene(**{"output.traces": "orbit"})
    done = hpcwhirl.simulate(one)
    with pytest.raises(InputError, match="needs traces = full"):
        frames_of(one, done.row, done.traces, 60)
