"""Frames of the wheel: a blade that pushes has a closed gap, and none overlaps."""

import base64

import numpy as np
import pytest

import hpcwhirl
from hpcwhirl.analysis.wheel_motion import (
    FARTHEST,
    GAP_SHARE,
    LONGEST_SHARE,
    frames_of,
)
from hpcwhirl.errors import InputError
from hpcwhirl.report.figures.wheel import _blades
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


@pytest.mark.turns
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


def test_a_tip_is_drawn_as_far_out_as_its_radial_displacement_tells():
    """Or an enlarged bend would carry it through the casing, which it touches."""
    one = scene()
    done = hpcwhirl.simulate(one)
    found = frames_of(one, done.row, done.traces, 60)
    scale = 3.0 * found.enlarged()
    assert scale * abs(found.tips[:, :, 1]).max() > 0.1
    for n in range(0, len(found.time), 7):
        far = abs(_blades(found, n, scale, 0.2)[:, -1])
        np.testing.assert_allclose(far, 1.0 + scale * found.tips[n, :, 0], rtol=1e-12)


@pytest.mark.parametrize(("gap", "rate"), [(1e-4, 0.0), (1e-2, 0.0), (1e-4, 9.0)])
def test_neither_gap_nor_last_frames_of_a_divergent_motion_set_the_scale_alone(
    gap, rate
):
    one = scene()
    done = hpcwhirl.simulate(one)
    found = frames_of(one, done.row, done.traces, 60)
    grown = 1e-3 * np.exp(rate * np.linspace(0.0, 1.0, len(found.time)))
    tips = np.repeat(grown, 2 * 9).reshape(-1, 9, 2)
    none = {"centre": 0 * found.centre, "wall": 0 * found.wall}
    made = found._replace(gap=np.full(len(grown), gap), tips=tips, **none)
    drawn = np.sort(made.enlarged() * grown)
    shares = made.enlarged() * gap / GAP_SHARE, drawn[-1] / FARTHEST
    usual = np.quantile(drawn, 0.75) / LONGEST_SHARE
    assert max(*shares, usual) == pytest.approx(1.0)


def test_a_case_without_full_traces_is_refused():
    one = scene(**{"output.traces": "orbit"})
    done = hpcwhirl.simulate(one)
    with pytest.raises(InputError, match="needs traces = full"):
        frames_of(one, done.row, done.traces, 60)
