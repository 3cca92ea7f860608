"""A rigid casing comes to the blades in many steps, or is refused in one line."""

import numpy as np
import pytest

from hpcwhirl.case.resolve import resolve
from hpcwhirl.cli import main
from hpcwhirl.dynamics.kernels.shape import faded
from hpcwhirl.dynamics.march import March
from hpcwhirl.dynamics.waves.casing import wall_of
from hpcwhirl.errors import InputError
from hpcwhirl.scene import apply_settings, named_scene

STEP = 2e-6


def scene(**settings):
    short = {"kind": "rigid", "friction": 0.0, "duration": 2e-3, "interval": 1e-5}
    return apply_settings(named_scene("table2"), short | {"time_step": STEP} | settings)


def impulse(**settings):
    return March(resolve(scene(**settings))).run().impulse[-1]


def test_a_rigid_casing_inside_the_blades_is_refused_in_one_line(capsys):
    words = ["kind=rigid", "amplitude=1.4e-4", "rise=0", "friction=0", "duration=0.01"]
    assert main(["run", "table2", *(part for w in words for part in ("--set", w))]) == 2
    text = capsys.readouterr().err
    assert text.count("\n") == 1
    assert "rise must be >= 5e-05 s (50 time steps)" in text
    assert text.endswith("got 0\n")


@pytest.mark.parametrize(
    ("settings", "told"),
    [
        ({"amplitude": 1.4e-4, "rise": 0.0, "scheme": "exact"}, "rise must be"),
        ({"amplitude": 1.4e-4, "rise": 49 * STEP}, "rise must be"),
        ({"amplitude": -1.4e-4, "rise": 0.0}, "rise must be"),  # blade 11 of 22
        ({"amplitude": 1.4e-4, "rise": 0.0, "nodal_diameter": 2}, "rise must be"),
        ({"amplitude": 1e-9, "rise": 0.0, "gap": 0.0}, "rise must be"),
        ({"amplitude": -2e-4, "rise": 0.0, "blades": 3, "modes": 20}, "rise must be"),
        ({"amplitude": 1.2e-4, "rise": 5e-5, "growth": 5e3}, "rise must be"),
        ({"amplitude": 1e-6, "rise": 0.0, "growth": 0.06 / STEP}, "growth must be"),
        ({"amplitude": 1e-6, "growth": -1.0 / STEP}, "growth must be"),
    ],
)
def test_no_rigid_casing_jumps_into_the_blades(settings, told):
    with pytest.raises(InputError, match=told):
        March(resolve(scene(**settings)))


@pytest.mark.parametrize(
    "settings",
    [
        {"amplitude": 1.4e-4, "rise": 50 * STEP},
        {"amplitude": 1.2e-4, "rise": 0.0},  # outside the blades, always
        {"amplitude": 1.28e-4, "rise": 0.0},  # just so
        {"amplitude": -1.4e-4, "rise": 0.0, "nodal_diameter": 0},  # outward
        {"amplitude": 1.4e-4, "rise": 1e-5, "accuracy": 0.01},  # which sets the step
    ],
)
def test_a_rigid_casing_that_does_not_jump_is_accepted(settings):
    assert March(resolve(scene(**settings))).total > 0


def test_the_impulse_of_a_rigid_casing_comes_to_rest_as_the_step_falls():
    rigid = {"amplitude": 1.4e-4, "rise": 50 * STEP}  # the shortest accepted
    coarse, fine, finer, finest = (
        impulse(**rigid, time_step=STEP / 2**n) for n in range(4)
    )
    assert coarse == pytest.approx(finest, rel=0.1)
    assert abs(finest - finer) < 0.6 * abs(finer - fine) < 0.36 * abs(fine - coarse)


def test_a_casing_that_has_always_stood_there_has_no_rise():
    case = resolve(scene(amplitude=1e-4, rise=0.0, nodal_diameter=2))
    for time in (-4e-6, 0.0, 4e-6):
        assert faded(wall_of(case.model, case.scene), 0, time) == (-1e-4, 0.0)


def test_the_trace_of_a_rigid_casing_is_its_shape_at_every_sample():
    history = March(
        resolve(
            scene(
                amplitude=1e-5, rise=1e-4, growth=50.0, nodal_diameter=2,
                duration=3e-4, traces="full",
                **{"engine.casing.profile": "harmonic,amplitude,phase;2,2e-6,0.5"},
            )
        )
    ).run()  # fmt: skip
    assert len(history.time) > 3
    ramp = 0.5 * (1 - np.cos(np.pi * np.minimum(history.time / 1e-4, 1.0)))
    lobes = -1e-5 * np.exp(50.0 * history.time) * ramp
    assert history.casing[:, 2, 0] == pytest.approx(lobes + 2e-6 * np.cos(0.5))
    assert history.casing[:, 2, 1] == pytest.approx(2e-6 * np.sin(0.5))
    assert not history.casing[:, [0, 1, 3]].any()


def test_no_distortion_stays_none_however_it_grows():
    march = March(resolve(scene(amplitude=0.0, growth=1e6, duration=1e-2)))
    history = march.run()
    assert history.stop == "end"
    assert not np.any(history.energy)
