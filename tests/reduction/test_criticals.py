"""Critical speeds with damping, and the cross coupling for zero log decrement.

A rigid rotor on a damper c_s that stands and one c_r that turns,

m Z'' + (c_s + c_r) Z' + (k - i Omega c_r - i q) Z = 0,

has its damped critical speed at omega sqrt(1 - xi^2) if c_r = 0, and is stable iff q <
(c_s + c_r) omega - Omega c_r = Q_0.
"""

import json

import numpy as np
import pytest
from jeffcott import MASS, OWN, RATIO, stiff

from hpcwhirl.case.resolve import resolve
from hpcwhirl.cli import main
from hpcwhirl.reduction.criticals import damped_criticals, stability_limit
from hpcwhirl.reduction.families import rotor_by_diameter
from hpcwhirl.reduction.waves import unbalance_speeds, wave_lines
from hpcwhirl.scene import Scene, apply_settings
from hpcwhirl.scene.bearing_tables import HEAD

SMALL = {
    "rotation": "full", "blades": 5, "rotor.elements": 2, "modes": 10, "harmonics": 4,
}  # fmt: skip
TILT = {"shaft": "two bearings", "shaft_diameter": 0.1}
ENGINES = {
    "springs": {},
    "damped": {"suspension_damping": 0.3},
    "tilting": TILT,
    "coupled": {"cross_coupling": 3e5},
    "apart": {"stiffness_difference": 4e6, "damping_difference": 500.0},
}


def rotor_of(speed=300.0, **given):
    scene = apply_settings(Scene(), SMALL | {"speed": speed} | given)
    return rotor_by_diameter(resolve(scene).model)


def of_shaft(model, speed):
    """Return the waves of k = 1 at a speed."""
    return [one for one in wave_lines(model, 5, speed) if one.nodal_diameter == 1]


def table(apart, coupling=0.0):
    """Return a bearing's table of two speeds, with a cross coupling, N/m."""
    rows = [
        (speed, k + apart, coupling, -coupling, k, 3e3, 0, 0, 3e3)
        for speed, k in ((0, 3e7), (2000, 5e7))
    ]
    return ";".join([HEAD, *(",".join(map(repr, map(float, row))) for row in rows)])


@pytest.mark.parametrize("ratio", [1e-4, 0.05, 0.4])
def test_the_damped_critical_speed_of_a_jeffcott_rotor(ratio):
    model = resolve(stiff(6, speed=400.0, suspension_damping=ratio)).model.rotor
    (one,) = damped_criticals(model, 6)
    (undamped,) = unbalance_speeds(model)
    assert one.forward
    assert one.speed == pytest.approx(undamped * np.sqrt(1 - ratio**2), rel=5e-4)
    assert one.growth == pytest.approx(-ratio * OWN, rel=2e-3)


def test_a_rotor_that_does_not_swing_has_no_damped_critical_speed():
    model = resolve(stiff(6, speed=400.0, suspension_damping=1.2)).model.rotor
    assert damped_criticals(model, 6) == []
    assert len(unbalance_speeds(model)) == 1


@pytest.mark.parametrize("name", ENGINES)
def test_at_a_damped_critical_speed_a_free_wave_turns_with_the_rotor(name):
    model = rotor_of(**ENGINES[name])
    found = damped_criticals(model, 5)
    assert found
    for one in found:
        lines = of_shaft(model, one.speed)
        met = min(lines, key=lambda line: abs(abs(line.static) - one.speed))
        assert abs(met.static) == pytest.approx(one.speed, rel=1e-9)
        assert (met.growth, met.family) == (one.growth, one.family)
        assert (met.static > 0.0) == one.forward


@pytest.mark.parametrize("name", ["springs", "tilting", "apart"])
def test_without_damping_critical_speeds_are_the_undamped_ones(name):
    still = {"rotor.damping": 1e-7, "suspension_damping": 1e-7}
    given = {n: v for n, v in ENGINES[name].items() if n != "damping_difference"}
    model = rotor_of(**(given | still))
    found = [one.speed for one in damped_criticals(model, 5)]
    assert found == pytest.approx(unbalance_speeds(model), rel=1e-9)


@pytest.mark.parametrize("speed", [200.0, 500.0, -500.0])
@pytest.mark.parametrize("turning", [0.0, 0.02])
def test_q0_of_a_jeffcott_rotor_is_c_omega_less_what_turns(speed, turning):
    scene = stiff(6, speed=speed, **{"rotor.damping": turning})
    limit = stability_limit(resolve(scene).model.rotor, speed)
    expected = 2 * MASS * OWN * (RATIO * OWN - turning * abs(speed))
    assert limit.coupling == pytest.approx(expected, rel=3e-3)
    assert limit.frequency == pytest.approx(OWN, rel=1e-3)


def worst(model, speed):
    return max(line.growth for line in of_shaft(model, speed))


@pytest.mark.parametrize("speed", [300.0, 700.0, -300.0])
@pytest.mark.parametrize("name", ENGINES)
def test_the_log_decrement_at_q0_is_zero(name, speed):
    given = ENGINES[name]
    limit = stability_limit(rotor_of(speed, **given), speed)
    already = given.get("cross_coupling", 0.0)
    for share, sign in ((1.0, 0.0), (1.001, 1.0), (0.999, -1.0)):
        coupling = already + share * limit.coupling
        model = rotor_of(speed, **(given | {"cross_coupling": coupling}))
        grown = worst(model, speed) * np.sign(limit.coupling)
        assert np.sign(round(grown, 6)) == sign


@pytest.mark.parametrize("apart", [0.0, 5e6])
def test_q0_is_that_of_a_bearing_s_table_too(apart):
    limit = stability_limit(rotor_of(bearing=table(apart)), 300.0)
    held = rotor_of(bearing=table(apart, limit.coupling))
    assert worst(held, 300.0) == pytest.approx(0.0, abs=1e-6)


def test_q0_of_a_rotor_without_damping_is_zero():
    scene = stiff(6, speed=300.0, suspension_damping=0.0)
    assert stability_limit(resolve(scene).model.rotor, 300.0).coupling == 0.0


@pytest.mark.parametrize("given", [{"centre": "clamped"}, {"lost_blade": 1}])
def test_a_rotor_without_waves_of_its_centre_has_neither(given):
    model = rotor_of(**given)
    assert damped_criticals(model, 5) == []
    assert stability_limit(model, 300.0) is None


@pytest.mark.turns
def test_model_tells_both_kinds_of_critical_speeds_and_q0(capsys):
    words = ["model", *(f"--set={n}={v}" for n, v in SMALL.items()), "--set=speed=300"]
    assert main([*words, "--json"]) == 0
    rotation = json.loads(capsys.readouterr().out)["rotation"]
    (damped,), (undamped,) = (
        rotation[name] for name in ("damped_critical_speeds", "unbalance_speeds")
    )
    assert main(words) == 0
    told = capsys.readouterr().out
    for speed in (damped["speed"], undamped):
        assert f" {speed:.2f} " in told
    coupling = rotation["stability_limit"]["coupling"]
    assert f"Q0 for zero log decrement at 300 rad/s: {coupling:.4g} N/m" in told
