"""Truths 3 and 7: bars with exact answers, through the contact code of engines."""

from itertools import pairwise

import numpy as np
import pytest
from evidence import bar_rigs as rigs
from evidence import bars

SLOW = pytest.mark.slow
SCHEMES = [
    "general",
    "paper",
    *(pytest.param(s, marks=SLOW) for s in ("modal", "exact")),
]
IMPACTS = ["drop", "two bars"]


def step_of(rig, courant):
    return courant * rig.bar.length / (rig.bar.elements * rig.bar.wave_speed)


def gaps_and_multipliers(march):
    """March to the end; return gaps (n, N), m, and multipliers (n, N), N."""
    history = march.run()
    impulse = np.diff(history.blade_impulse, axis=0, prepend=0.0)
    gaps = march.scene.gap + history.casing[:, 0, :1] - history.tips[:, :, 0]
    return gaps, impulse / history.interval


# Exact answers


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_dropped_bar_bounces_as_it_should(scheme):
    # Doyen, Ern, Piperno (2011), section 3: one contact of 2 L / c, v_0 gained
    row = bars.measure("drop", 50, 0.125, scheme)
    assert row["touched"] == 1
    for name, error in (("impulse", 0.01), ("rebound", 0.025), ("contact", 0.02)):
        assert abs(row[name]) < error, name
    assert row["end"] < 0.01
    assert row["drag"] < 0.015
    assert row["residual"] < 1e-9


@pytest.mark.parametrize("scheme", ["general", "paper"])
def test_equal_bars_exchange_their_velocities(scheme):
    row = bars.measure("two bars", 50, 0.125, scheme)
    for name, error in (("impulse", 0.015), ("rebound", 0.03), ("contact", 0.02)):
        assert abs(row[name]) < error, name
    assert row["end"] < 0.01
    assert row["residual"] < 1e-9
    rig = rigs.two_bars(50)
    march = rigs.march_of(rig, step_of(rig, 0.125), scheme)
    own, other = bars.mean_velocities(march, rig.bar, 40)
    assert own == pytest.approx(-rig.arrival, rel=0.015)  # inward
    assert abs(other) < 0.015 * rig.arrival
    assert own + other == pytest.approx(
        -rig.arrival, rel=1e-4
    )  # but for the pulse's sum


@pytest.mark.parametrize("blades", [1, 5])
def test_a_bar_of_as_many_areas_serves_all_blades_alike(blades):
    rig = rigs.two_bars(30)
    march = rigs.march_of(rig, step_of(rig, 0.25), blades=blades)
    history = march.run()
    assert history.contacts == blades
    impulses = history.blade_impulse[-1]
    assert impulses == pytest.approx(impulses[0], rel=1e-9)
    assert impulses[0] == pytest.approx(rig.bar.mass * rig.arrival, rel=0.025)


@pytest.mark.parametrize("scheme", SCHEMES)
def test_a_clamped_bar_is_pressed_by_what_its_waves_say(scheme):
    # 51 elements have as many modes as 50 of a free bar: one kernel for both
    row = bars.measure("clamped", 51, 0.125, scheme)
    assert abs(row["impulse"]) < 3e-4
    assert row["force"] < 0.01
    assert abs(row["peak"] - 1.0) < 0.01
    assert row["end"] < 1e-12  # it is where the wall is
    assert row["residual"] < 1e-9


def test_a_pressed_bar_pushes_back_with_its_stiffness_in_the_mean():
    rig = rigs.clamped(60)
    step = rig.bar.passage / 960
    impulse = rigs.march_of(rig, step).run().impulse
    mean = (impulse[4 * 960 - 1] - impulse[3 * 960 - 1]) / rig.bar.passage
    static = rig.bar.young * rig.bar.area / rig.bar.length * 1.0
    assert mean == pytest.approx(static, rel=2e-3)


# Orders


@pytest.mark.turns
@pytest.mark.order
@pytest.mark.parametrize("name", IMPACTS)
def test_impacts_are_of_order_two_thirds_in_step_and_mesh(name):
    # a front disperses over (h / L)^(2/3) of the bar; the ends' mass falls with h
    count = range(4)
    rows = [bars.measure(name, 25 * 2**n, 0.25, series="step and mesh") for n in count]
    found = bars.orders(rows, "step and mesh")
    for column in ("impulse", "rebound", "end", "drag"):
        assert 0.6 < found[column] < 0.8, column
    assert found["loss"] == pytest.approx(1.0, abs=0.02)


@pytest.mark.order
def test_a_held_contact_is_of_second_order_in_the_step():
    # the force of a step acts at its start: every second one of half the step
    rig, coarse = rigs.clamped(20), 1920
    forces = [
        bars.multipliers(rigs.march_of(rig, rig.duration / n).run())[:: n // coarse]
        for n in (coarse, 2 * coarse, 4 * coarse)
    ]
    apart = [np.linalg.norm(a - b) for a, b in pairwise(forces)]
    assert np.log2(apart[0] / apart[1]) == pytest.approx(2.0, abs=0.1)


@pytest.mark.turns
@pytest.mark.order
def test_a_held_contact_is_of_first_order_in_step_and_mesh():
    # the wall's acceleration jumps
    series = "step and mesh"
    rows = [bars.measure("clamped", 25 * 2**n, 0.25, series=series) for n in range(4)]
    assert bars.orders(rows, series)["force"] == pytest.approx(1.0, abs=0.1)


# What Carpenter's correction does at a touch


@pytest.mark.turns
@pytest.mark.parametrize("name", IMPACTS)
def test_the_peak_multiplier_grows_with_the_rate_and_the_impulse_does_not(name):
    coarse, middle, fine = (bars.measure(name, 50, 0.1 / 4**n) for n in range(3))
    assert fine["peak"] / middle["peak"] == pytest.approx(4.0, rel=0.05)
    assert fine["peak"] > 3 * coarse["peak"] > 3
    for row in (coarse, middle):
        assert row["impulse"] == pytest.approx(fine["impulse"], abs=1e-3)
    # within two steps the end's mass has been stopped, wherever the gap closed
    assert fine["touch"] == pytest.approx(1.0, abs=0.01)


@pytest.mark.turns
@pytest.mark.parametrize("name", IMPACTS)
@pytest.mark.parametrize("elements", [25, 100])
def test_an_impact_loses_the_kinetic_energy_of_the_ends_mass(name, elements):
    # sqrt(3)/6 h/L of the bar's, half of that for two bars; some more in long steps
    rows = [bars.measure(name, elements, courant) for courant in (0.4, 0.13, 0.011)]
    assert rows[2]["expected"] == pytest.approx(1.0, abs=0.001)
    assert rows[2]["loss"] < 0.29 / elements
    for row in rows:
        assert 0.999 < row["expected"] < 1.25
        assert row["touched"] == 1


def test_a_contact_that_is_held_loses_nothing():
    rig = rigs.clamped(40)
    ledger = rigs.march_of(rig, step_of(rig, 0.25)).run().ledger
    assert abs(ledger["impact"]) < 1e-12 * ledger["energy"]
    assert ledger["rotation"] == pytest.approx(ledger["energy"], rel=1e-9)


def assert_complementary(gaps, push):
    assert push.min() >= 0.0
    assert np.count_nonzero(push) > 100
    assert gaps.min() > -1e-11  # of some 10 m that bar and wall go
    assert np.abs(gaps[push > 0.0]).max() < 1e-11


@pytest.mark.parametrize(
    ("name", "elements", "scheme"),
    [("drop", 50, "general"), ("clamped", 51, "paper"),
     pytest.param("clamped", 51, "modal", marks=SLOW),
     pytest.param("drop", 50, "exact", marks=SLOW)],
)  # fmt: skip
def test_gaps_at_a_wall_stay_open_and_forces_push(name, elements, scheme):
    rig, blades = rigs.RIGS[name](elements), 3 if scheme in {"modal", "exact"} else 1
    march = rigs.march_of(rig, step_of(rig, 0.25), scheme, blades)
    assert_complementary(*gaps_and_multipliers(march))


@pytest.mark.parametrize("scheme", ["general", "paper"])
def test_gaps_between_bars_stay_open_and_forces_push(scheme):
    rig = rigs.two_bars(30)
    march = rigs.march_of(rig, step_of(rig, 0.25), scheme, blades=2)
    assert_complementary(*gaps_and_multipliers(march))


# Friction


@pytest.mark.parametrize(
    ("scheme", "speed"),
    [("general", 2.0), ("paper", -2.0), pytest.param("modal", 2.0, marks=SLOW)],
)
def test_friction_is_mu_times_the_normal_force_against_the_rotation(scheme, speed):
    rig, slider, mu = rigs.drop(50), rigs.Slider(), 0.4
    blades = 3 if scheme == "modal" else 1
    march = rigs.march_of(
        rig, step_of(rig, 0.25), scheme, blades, slider, friction=mu, speed=speed
    )
    history, step = march.run(), march.scene.solver.time_step
    y = np.r_[0.0, 0.0, history.tips[:, 0, 1]]
    force = slider.mass * ((y[2:] - 2 * y[1:-1] + y[:-2]) / step**2)
    force += slider.mass * slider.omega**2 * y[1:-1]
    push = np.diff(history.blade_impulse[:, 0], prepend=0.0) / step
    assert push.max() > 0
    assert force == pytest.approx(
        -np.sign(speed) * mu * push, abs=1e-6 * mu * push.max()
    )
    exact = np.sign(speed) * rig.dragged(slider, mu, history.time)
    assert np.abs(y[2:] - exact).max() < 0.015 * np.abs(exact).max()


@pytest.mark.parametrize("name", IMPACTS)
def test_friction_does_not_touch_the_bounce(name):
    rig = rigs.RIGS[name](30)
    smooth, rough = (
        rigs.march_of(rig, step_of(rig, 0.25), friction=mu, speed=1.0).run()
        for mu in (0.0, 0.5)
    )
    assert np.abs(smooth.tips[:, :, 1]).max() < 1e-10  # of modes as heavy as the bar
    assert rough.tips[:, 0, 0] == pytest.approx(smooth.tips[:, 0, 0], abs=1e-11)
    assert rough.ledger["friction"] > 0
    assert abs(rough.ledger["residual"]) < 1e-9 * rough.ledger["energy"]


# Blades that know nothing of each other


def test_a_lobed_wall_touches_only_the_bar_it_comes_to():
    rig = rigs.drop(20)
    march = rigs.march_of(rig, step_of(rig, 0.25), blades=4, nodal_diameter=1)
    history = march.run()
    assert history.contacts == 1
    assert not history.blade_impulse[-1, 1:].any()
    moved = np.abs(history.tips).max(axis=(0, 2))
    assert moved[1:].max() < 1e-9 * moved[0]
    alone = rigs.march_of(rig, step_of(rig, 0.25)).run()
    assert history.tips[:, 0] == pytest.approx(alone.tips[:, 0], abs=1e-9)
