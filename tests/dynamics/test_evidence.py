"""Words do not depend on what is kept of a motion, and a run stops at a step."""

import numpy as np
import pytest

from hpcwhirl.campaign.simulate import result_of, simulate
from hpcwhirl.case.limits import beat_of, fastest_line
from hpcwhirl.case.resolve import resolve
from hpcwhirl.dynamics.march import March
from hpcwhirl.scene import apply_settings, named_scene
from hpcwhirl.scene.quantities import BLADES

pytestmark = pytest.mark.turns

SCENE = named_scene("mostly_damped")
# coarser than the run, aliasing, finer than and out of step with the evidence
KEPT = [
    {"traces": "summary"},
    {"traces": "orbit", "interval": 2e-4},
    {"traces": "orbit", "interval": 0.02},
    {"traces": "orbit", "interval": 10.0},
    {"traces": "full", "interval": 1.7e-5},
]
ASIDE = {"sample_interval", *BLADES}  # tell what is kept, and are told by it
# a motion in contact, one that is certified, one of few sectors, one that blows up
MOTIONS = {
    "touching": {"duration": 0.02},
    "certified": {"gap": 1e-3, "duration": 0.3, "nodal_diameter": 2},
    "damped": {"gap": 8e-4, "duration": 0.2, "time_step": 4e-6},
    "stopped": {"amplitude_limit": 6e-4, "duration": 0.05},
}
SCHEMES = [
    *(("modal", motion) for motion in MOTIONS),
    *(
        pytest.param(scheme, motion, marks=pytest.mark.slow)
        for scheme in ("exact", "general", "paper")
        for motion in ("certified", "stopped")
    ),
]


def scene(**settings):
    return apply_settings(SCENE, settings)


def apart(one, other):
    """Names of the variables of two rows that are not the same bit for bit."""
    return {n for n in one.keys() | other.keys() if one.get(n) != other.get(n)} - ASIDE


@pytest.mark.parametrize(("scheme", "motion"), SCHEMES)
def test_no_variable_depends_on_what_is_kept(scheme, motion):
    settings = MOTIONS[motion] | {"scheme": scheme}
    if scheme in {"general", "paper"}:  # no certificate in so few steps
        settings |= {"duration": 0.006, "gap": 1e-4}
    rows = [simulate(scene(**settings, **kept)).row for kept in KEPT]
    assert all(apart(rows[0], row) == set() for row in rows[1:])
    assert rows[0]["contacts"] > 0 or rows[0]["certificate"] > 0
    assert rows[0]["stop"] == ("amplitude" if motion == "stopped" else "end")


def test_a_slow_clock_does_not_turn_an_orbit_round():
    # 50 samples a second made this forward orbit backward, ten left none of it
    settings = {"speed": 410.0, "time_step": 4e-6, "duration": 0.6}
    rows = [
        simulate(scene(**settings, interval=interval)).row
        for interval in (2e-4, 0.02, 0.1)
    ]
    assert [row["whirl"] for row in rows] == ["forward"] * 3
    assert rows[0]["orbit_radius"] == rows[2]["orbit_radius"] > 0.0
    assert rows[0]["growth_rate"] == rows[2]["growth_rate"] != 0.0


def test_a_run_stops_at_the_step_at_which_a_tip_is_beyond_the_limit():
    settings = {"duration": 0.01, "traces": "full", "interval": 1e-6}
    limit = 3e-4
    whole = March(resolve(scene(**settings)))
    tips = whole.run().tips
    far = np.hypot(tips[..., 0], tips[..., 1]).max(axis=1)
    first = int(np.argmax(far > limit)) + 1  # samples begin after the first step
    assert far.max() > limit
    for kept in KEPT:
        march = March(
            resolve(scene(**settings | kept | {"amplitude_limit": limit / 0.5}))
        )
        march.run()
        # a step is refused by its prediction, before contact pushes the tips back
        assert first - 1 <= march.steps <= first
        assert result_of(march.case, march.history()).row["stop"] == "amplitude"


@pytest.mark.parametrize(
    ("blades", "stiffness"), [(12, 1e6), (22, 1e6), (22, 3.4e7), (12, 1e9)]
)
def test_evidence_resolves_every_line_that_matters(blades, stiffness):
    own = scene(blades=blades, centre_stiffness=stiffness)
    model = resolve(own).model
    rate = 2 * np.pi / (beat_of(model, own) * own.solver.time_step)
    assert rate > 10 * fastest_line(model, own.speed)
    # under a load that stands, what lies above gives little of the whole
    hub = model.rotor.shapes[2 * blades : 2 * blades + 2]
    gives = (hub**2).sum(axis=0) / model.rotor.omega**2
    fast = model.rotor.omega + own.speed > fastest_line(model, own.speed)
    assert gives[fast].sum() < 0.1 * gives.sum()


def test_short_runs_have_rows_enough_to_be_judged():
    for duration in (0.01, 0.1):
        march = March(resolve(scene(duration=duration)))
        assert 0.4 * march.total / march.beat >= 63


SLOWLY_RINGING = {
    "speed": 366.0, "gap": 2.6e-4, "friction": 0.2, "casing.thickness": 0.016,
    "casing.width": 0.0734, "casing.damping": 0.03, "support_damping": -1.0,
}  # fmt: skip


def test_an_orbit_behind_the_rings_slow_ringing_is_not_damped():
    # at 1 s the ring's energy falls and hides that the rotor is kept up: at 5 s the
    # same motion is sustained
    row = simulate(scene(**SLOWLY_RINGING, duration=1.0, traces="summary")).row
    assert row["late_contacts"] == 1
    assert row["growth_rate"] < -0.4
    assert row["regime"] == "undecided"
