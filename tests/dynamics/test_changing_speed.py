"""Speed and gap that change in time: laws, refresh, passage of a critical speed."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import fresnel

from hpcwhirl.analysis.over_speed import (
    Spell,
    crossings,
    in_shown_units,
    spells_of,
    told_over_speed,
    words_over_speed,
)
from hpcwhirl.analysis.regimes import evidence
from hpcwhirl.campaign.simulate import notes_on, result_of
from hpcwhirl.case import speed
from hpcwhirl.case.resolve import resolve
from hpcwhirl.case.unbalance import share_at_start
from hpcwhirl.dynamics.history import Evidence
from hpcwhirl.dynamics.march import March
from hpcwhirl.dynamics.waves import driven_slots
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.waves import largest_growth, tip_growth, turning_matrices
from hpcwhirl.scene import Scene, apply_settings
from hpcwhirl.scene.units import showing
from hpcwhirl.scene.words import BY_PULSE, BY_SPEED
from hpcwhirl.structure.elements import Section
from hpcwhirl.structure.rotation import loads_of
from tests.support.jeffcott import HEAVY, MASS, stiff
from tests.support.run_up import by_another, orbit, run_up

LAWS = {
    "linear": speed.SpeedLaw("linear", 100.0, 0.0, 40.0),
    "linear, then held": speed.SpeedLaw("linear", 100.0, 120.0, 40.0),
    "smooth": speed.SpeedLaw("smooth", 100.0, 120.0, 40.0),
    "run-down": speed.SpeedLaw("decay", 100.0, 20.0, -40.0),
    "table": speed.SpeedLaw("table", 50.0, times=(0, 0.4, 0.9), speeds=(50, 90, 70)),
}
RUB = {"speed": 300.0, "acceleration": 200.0, "duration": 0.06, "time_step": 5e-6}
UNEQUAL = {"mistuning": [0.03 * float(np.sin(7.0 * j)) for j in range(22)]}
FULL = {"rotation": "full"}
KINDS = {
    "cyclic": RUB,
    "general": RUB | {"scheme": "general"},
    "unequal": RUB | UNEQUAL,
    "elements": RUB | {"casing.discretization": "elements", "time_step": 3e-6},
    "driven": RUB | {"rotation": "full", "unbalance": 2e-3},
    "apart": RUB
    | FULL
    | {
        "unbalance": 2e-3,
        "gravity": 9.81,
        "stiffness_difference": 1.2e7,
        "damping_difference": 1200.0,
    },
    "film": RUB | FULL | {"unbalance": 2e-3, "film_viscosity": 0.01},
    "started": RUB | {"rotation": "full", "start_energy": 5.0, "start_as": "both"},
}


def march_of(**settings):
    return March(resolve(apply_settings(Scene(), settings)))


def closing(history):
    ledger = dict(history.ledger)
    residual = abs(ledger.pop("residual"))
    return residual / sum(map(abs, ledger.values()))


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_the_angle_is_the_integral_of_the_speed(law):
    for time in (0.2, 0.5, 1.3):
        found, _ = quad(law.speed, 0.0, time, points=[0.4, 0.5, 0.9], limit=200)
        assert float(law.angle(time)) == pytest.approx(found, rel=1e-10)


def test_a_decay_has_its_rate_at_first_and_its_time_constant():
    law = LAWS["run-down"]
    assert float(law.speed(1e-6)) == pytest.approx(100.0 - 40e-6, rel=1e-9)
    assert float(law.speed(2.0)) == pytest.approx(20.0 + 80.0 / np.e, rel=1e-12)


@pytest.mark.turns
@pytest.mark.parametrize("kind", ["cyclic", "driven", "apart", "film", "started"])
def test_a_speed_that_hardly_changes_is_a_constant_one(kind):
    given = KINDS[kind] | {"duration": 0.02}
    still = given | {"acceleration": 0.0}
    if kind != "cyclic":
        still["scheme"] = "general"
    (moving, held) = (
        march_of(**s).run() for s in (given | {"acceleration": 1e-9}, still)
    )
    size = np.abs(held.centre).max()
    assert np.abs(moving.centre - held.centre).max() < 1e-9 * size
    assert moving.contacts == held.contacts > 0


@pytest.mark.turns
def test_coefficients_that_another_run_has_made_give_the_same_bits():
    given = KINDS["apart"] | {"duration": 0.01, "traces": "blades"}
    driven_slots._kept.clear()
    driven_slots._sizes.clear()
    alone = march_of(**given).run()
    made = len(driven_slots._kept)
    wide = march_of(**given | {"gap": 4e-4}).run()  # the same speeds
    assert len(driven_slots._kept) == made > 1
    again = march_of(**given).run()
    assert np.array_equal(again.tips, alone.tips)
    assert not np.array_equal(wide.tips, alone.tips)
    other = march_of(**given | {"friction": 0.2}).run()  # others of contact
    assert len(driven_slots._kept) > made
    assert not np.array_equal(other.tips, alone.tips)


@pytest.mark.turns
@pytest.mark.parametrize("blades", [{}, UNEQUAL], ids=["equal", "unequal"])
def test_the_ring_in_both_frames_is_the_same(blades):
    fine = RUB | blades | {"duration": 0.03, "casing.harmonics": 4}
    own, other = (march_of(**fine, scheme=s).run() for s in ("modal", "general"))
    assert np.abs(own.centre - other.centre).max() < 1e-12 * np.abs(own.centre).max()
    dense = march_of(**fine, scheme="paper").run()  # by parabolas, not by lines
    assert (
        np.abs(own.centre - dense.centre).max() < speed.USUAL * np.abs(own.centre).max()
    )


@pytest.mark.turns
def test_waves_of_intervals_move_and_work_as_coupled_modes(monkeypatch):
    """In the same intervals of many steps, in contact: motion, works, evidence."""
    monkeypatch.setattr(speed, "rides", lambda *_: True)
    given = KINDS["driven"] | {
        "duration": 4e-3, "acceleration": 2000.0, "blades": 7, "traces": "blades",
    }  # fmt: skip
    (march, own), (_, other) = (
        (march, march.run()) for march in (march_of(**given, scheme=name)
                                           for name in ("modal", "general"))
    )  # fmt: skip
    assert len(march.scheme.arrays.rotor.drive.at) > 0
    assert 3 < march.schedule.sections[0].every < march.total / 3
    assert own.contacts == other.contacts > 0
    for name in ("tips", "centre", "energy", "lost", "fed", "circle"):
        one, two = getattr(own, name), getattr(other, name)
        assert np.abs(one - two).max() <= 1e-9 * np.abs(two).max(), name
    whole = own.judged.whole, other.judged.whole
    assert np.abs(whole[0] - whole[1]).max() <= 1e-9 * whole[1].max()
    near = 1e-9 * sum(map(abs, other.ledger.values()))
    for term, value in own.ledger.items():
        assert abs(value - other.ledger[term]) <= near, term


@pytest.fixture(scope="module")
def passage():
    """A run-up through a critical speed, with intervals that do not count."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(speed, "USUAL", 1e-6)
        march, history = run_up()
    return SimpleNamespace(march=march, history=history)


@pytest.mark.slow
def test_a_run_up_is_that_of_another_integrator(passage):
    found = passage.history.centre @ [1.0, 1j]
    true = by_another(passage.march, passage.history.time)
    assert np.abs(found - true).max() < 1e-6 * np.abs(true).max()
    assert not any(passage.history.ledger.values())  # of what contact causes


@pytest.mark.turns
def test_what_contact_causes_is_all_beside_the_motion_without_it(passage):
    judged, circle = passage.history.judged, passage.history.circle
    assert not judged.energy.any()
    assert np.abs(judged.centre - circle).max() < 1e-15 * np.abs(circle).max()
    march = passage.march
    at = float(
        speed.speed_at(march.scene, march.last_row * march.scene.solver.time_step)
    )
    _, _, stiffness, _ = turning_matrices(march.model.rotor, at, march.model.blades)
    motion, mass = march.motion(), march.model.rotor.mass
    moving = motion.rotor_velocity @ mass @ motion.rotor_velocity
    whole = 0.5 * (moving + motion.rotor @ stiffness @ motion.rotor)
    swing = 0.5 * (moving + abs(motion.rotor @ stiffness @ motion.rotor))
    assert judged.whole[-1] == pytest.approx(whole, abs=2e-2 * swing)


@pytest.mark.turns
def test_contact_adds_to_the_motion_without_it():
    given = {**KINDS["driven"], "duration": 0.012}
    rub, free = march_of(**given), march_of(**given, gap=5e-2, force=0.0)
    one, other = rub.run(), free.run()
    assert one.contacts > 0
    assert other.contacts == 0
    assert np.array_equal(one.circle, other.circle)
    away = np.hypot(*(one.judged.centre - one.circle).T)
    assert away[0] < 1e-3 * away.max()


@pytest.mark.turns
def test_a_circle_beyond_the_gap_is_all_beside_whatever_the_gap():
    given = KINDS["driven"] | {"unbalance": 0.1, "duration": 1e-3}
    near, far = march_of(**given), march_of(**given, gap=5e-2, force=0.0)
    shares = [share_at_start(march.model, march.scene) for march in (near, far)]
    assert shares[0] < shares[1] == 1.0
    assert np.array_equal(near.run().circle, far.run().circle)


@pytest.mark.turns
@pytest.mark.parametrize("touches", [True, False])
def test_what_the_casing_holds_is_judged_as_a_whole(touches):
    # the circle grows by 0.3 while the orbit in contact stays
    march = march_of(**KINDS["driven"])
    march.warm()
    history = march.history()
    time = np.linspace(0.0, 1.0, 1001)[1:]
    on = np.ones_like(time)
    circle = 1e-3 * np.column_stack([np.exp(0.75 * (time - 1.0)), 0.0 * on])
    centre = np.column_stack([0.0 * on, 1e-4 * on])
    away = np.hypot(*(centre - circle).T)
    judged = Evidence(time, centre, away**2, on, on, on, on, on)
    history = replace(
        history, judged=judged, circle=circle, end=1.0,
        last_contact=1.0 if touches else 0.1,
    )  # fmt: skip
    found = evidence(march.scene, history)
    assert found["summit"] == 0.0  # which `divergent` by growth needs
    if touches:
        assert found["growth_centre"] == pytest.approx(0.0, abs=1e-12)
        assert found["growth_rotor"] == pytest.approx(0.0, abs=1e-12)
    else:
        assert found["growth_centre"] == pytest.approx(0.75, abs=0.02)
        assert found["growth_rotor"] == pytest.approx(0.75, abs=0.02)


BALANCED = {
    "rotation": "full", "scheme": "general", "speed": 300.0, "duration": 0.03,
    "blades": 7, "modes": 20, "casing.harmonics": 6, "time_step": 5e-6, "gap": 1e-4,
}  # fmt: skip


@pytest.mark.turns
def test_a_balanced_rotor_at_a_hardly_changing_speed_has_the_evidence_of_a_still_one():
    """Round-off of the motion without contact drives no rotor."""
    still, changing = (march_of(**BALANCED, acceleration=rate) for rate in (0.0, 1e-6))
    found, history = evidence(still.scene, still.run()), changing.run()
    assert history.last_contact > 0.02
    assert np.abs(history.circle).max() < 1e-15 * np.abs(history.centre).max()
    other = evidence(changing.scene, history)
    names = [n for n in found if n.startswith("growth") or n == "summit"]
    assert found["summit"] != 0.0
    for name in (*names, "late_energy"):
        assert other[name] == pytest.approx(found[name], rel=1e-5, abs=1e-5), name


@pytest.mark.turns
def test_a_balanced_rotor_is_judged_by_what_contact_causes():
    """Not by the energy with which blades stretch as the speed changes."""
    march = march_of(**BALANCED, acceleration=2000.0)
    history = march.run()
    assert history.last_contact > 0.02
    still = replace(history.judged, whole=np.ones_like(history.judged.whole))
    found = evidence(march.scene, history)
    other = evidence(march.scene, replace(history, judged=still))
    assert found.pop("driven_energy") != other.pop("driven_energy")
    assert other == found


@pytest.mark.turns
@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_a_rotor_at_rest_is_not_damped_at_speeds_where_its_free_motion_grows(sense):
    """Over them and speeds at which all motion decays, up and down."""
    own = {
        "rotation": "full", "blades": 5, "modes": 10, "casing.harmonics": 3,
        "rotor.damping": 0.02, "suspension_damping": 0.02, "force": 0.0, "gap": 0.01,
        "time_step": 2e-5, "duration": 0.2, "output.windows": 8,
    }  # fmt: skip
    for first, last, words in (
        (760.0, 800.0, ["damped", "undecided"]),
        (800.0, 760.0, ["undecided", "damped"]),
    ):
        rate = sense * (last - first) / 0.2
        march = march_of(**own, speed=sense * first, acceleration=rate)
        rotor, history = march.model.rotor, march.run()
        assert not history.judged.rotor.any()
        row = result_of(march.case, history).row
        assert [one.regime for one in spells_of(row["words_over_speed"])] == words
        assert row["regime"] == words[-1]
        for at, word in zip((first, last), words, strict=True):
            grows = largest_growth(rotor, 5, sense * at) > 0.0
            assert grows == (word == "undecided")


@pytest.mark.turns
def test_the_error_of_an_interval_is_of_second_order(passage):
    size, missed = np.abs(passage.history.centre).max(), []
    with pytest.MonkeyPatch.context() as patch:
        for accuracy in (4e-3, 1e-3):  # half the interval
            patch.setattr(speed, "USUAL", accuracy)
            _, history = run_up()
            away = np.abs(history.centre - passage.history.centre).max()
            missed.append(away / size)
    assert missed[0] < 4e-3
    assert 3.0 < missed[0] / missed[1] < 5.0


@pytest.mark.parametrize("scheme", ["modal", "general"])
def test_an_interval_is_as_long_as_its_phase_may_err(scheme):
    """That of a wave of the ring in the rotor's frame, and of one of the rotor."""
    given = RUB | {"rotation": "full", "scheme": scheme}
    case = resolve(apply_settings(Scene(), given))
    (section,) = speed.schedule_of(case.scene, case.model).sections
    ring = case.scene.engine.casing.harmonics if scheme == "modal" else 2
    parts = (ring, section.every, 1), (2, section.every * section.shared, section.every)
    for fastest, every, more in parts:
        for steps, kept in ((every, True), (every + more, False)):
            time = RUB["time_step"] * np.linspace(0.0, steps, 1001)
            turned = RUB["speed"] * time + RUB["acceleration"] * time**2 / 2
            missed = np.abs(turned - turned[-1] * time / time[-1]).max()
            assert (fastest * missed <= speed.USUAL) == kept


@pytest.mark.turns
def test_a_run_up_with_rotation_is_that_of_all_sectors():
    """Euler's force and the changing matrices are those of the whole rotor."""
    given = RUB | {"rotation": "full", "nodal_diameter": 2, "duration": 5e-4}
    march = march_of(**given)
    assert march.case.plan.folds == 2
    assert march.lean.model.folds == 1
    assert march.run().stop == "end"


@pytest.mark.parametrize("closure", [5e-5, -5e-5])
def test_the_least_gap_ahead_is_that_of_all_later_intervals(closure):
    given = RUB | {"gap_closure": closure, "gap_time": 0.05}
    case = resolve(apply_settings(Scene(), given))
    schedule = speed.schedule_of(case.scene, case.model)
    last = round(RUB["duration"] / RUB["time_step"]) - 1
    for steps in (3, 3000, last):
        least = schedule.span(last)[1] if closure > 0.0 else schedule.span(steps)[0]
        found = schedule.least_gap(steps)
        assert found == pytest.approx(schedule.gap(least * RUB["time_step"]), rel=1e-12)


def steps_and_gaps(schedule):
    """Return the times of all steps, and the gap by the intervals' lines, m."""
    step = schedule.scene.solver.time_step
    count, at, times, gaps = round(schedule.scene.end_times[-1] / step), 0, [], []
    while at < count:
        now = schedule.interval(at)
        since, at = schedule.span(at)
        own = step * np.arange(since, min(at, count) + 1)
        times.append(own)
        gaps.append(now.gap + now.opening * (own - now.since))
    return np.concatenate(times), np.concatenate(gaps)


CLOSING = {
    "most of it": {"gap_closure": 1.25e-4, "gap_time": 0.02},
    "slowly": {"gap_closure": 1.3e-4, "gap_time": 0.015},
    "by growth": {"rotation": "full", "gap_at": "rest", "speed": 100.0, "gap": 4e-4,
                  "acceleration": 8e3},
    "smoothly": {"rotation": "full", "gap_at": "rest", "speed": 100.0, "gap": 4e-4,
                 "acceleration": 8e3, "ramp": "smooth", "speed_to": 500.0},
    "opening": {"gap_closure": -5e-4, "gap_time": 0.01},
}  # fmt: skip


@pytest.mark.turns
@pytest.mark.parametrize("name", CLOSING)
def test_the_gap_errs_by_its_accuracy_of_what_is_left(name):
    """Not of the gap at the start, at every step of the run."""
    given = {"duration": 0.05, "time_step": 5e-6, **CLOSING[name]}
    case = resolve(apply_settings(Scene(), given))
    schedule = speed.schedule_of(case.scene, case.model)
    times, gaps = steps_and_gaps(schedule)
    true = schedule.gaps(times)
    assert true.min() > 0.0
    assert np.abs(gaps / true - 1.0).max() < 1.02 * speed.USUAL


TABLES = {
    "speed": "time,speed;0,300;0.0100013,300;0.0100023,301;0.03,301;0.05,340",
    "gap": "time,gap;0,1.28e-4;0.0100013,1.28e-4;0.0100023,1.2e-4;0.03,2e-5;0.05,2e-5",
}


JUMPLESS = {
    "speed": "time,speed;0,300;0.01,300;0.03,300;0.05,340",
    "gap": "time,gap;0,1.28e-4;0.01,1.28e-4;0.03,2e-5;0.05,2e-5",
}


def test_a_gap_by_a_table_is_exact_at_every_step():
    given = {"gap_table": TABLES["gap"], "duration": 0.06, "time_step": 5e-6}
    case = resolve(apply_settings(Scene(), given))
    schedule = speed.schedule_of(case.scene, case.model)
    times, gaps = steps_and_gaps(schedule)
    assert gaps == pytest.approx(schedule.gaps(times), rel=1e-9)


@pytest.mark.parametrize("kind", TABLES)
def test_two_close_rows_of_a_table_shorten_no_interval_but_their_own(kind):
    """A jump in 1 us costs three intervals more than none."""
    counts = []
    for table in (TABLES[kind], JUMPLESS[kind]):
        given = {f"{kind}_table": table, "duration": 0.06, "time_step": 5e-6}
        case = resolve(apply_settings(Scene(), {"speed": 300.0, **given}))
        schedule = speed.schedule_of(case.scene, case.model)
        at, count = 0, 0
        while at < 12000:
            at, count = schedule.span(at)[1], count + 1
        counts.append(count)
    assert counts[0] <= counts[1] + 3


def test_a_table_of_constant_speed_is_that_speed():
    own = {"duration": 3e-3, "time_step": 5e-6, "scheme": "general", "blades": 5,
           "speed": 300.0, "traces": "full"}  # fmt: skip
    still = march_of(**own).run()
    table = march_of(**own, speed_table="time,speed;0,300;0.001,300").run()
    assert still.contacts == table.contacts > 0
    assert np.abs(table.tips - still.tips).max() < 1e-9 * np.abs(still.tips).max()


@pytest.mark.turns
def test_the_largest_amplitude_of_a_passage_is_that_of_cornus_spiral():
    # without damping, q = omega^2 / |dOmega/dt|: max |z| / e -> 1.467 sqrt(q) as q
    # grows, at Omega / omega = 1 +- 2.16 / sqrt(q) (Lewis 1932; stationary phase)
    along = np.linspace(0.0, 3.0, 30001)
    sine, cosine = fresnel(along)
    size = np.hypot(cosine + 0.5, sine + 0.5)
    most, late = size.max() * np.sqrt(np.pi) / 2, along[size.argmax()] * np.sqrt(np.pi)
    found = []
    for rate, start in ((10.0, 20.0), (-10.0, 60.0)):
        march, history = run_up(
            acceleration=rate, speed=start, duration=3.4, suspension_damping=0.0,
            time_step=4e-5,
        )  # fmt: skip
        own = float(march.model.rotor.omega[march.model.rotor.diameter == 1][0])
        root = own / np.sqrt(abs(rate))
        radius = np.abs(orbit(march, history))
        at = float(speed.speed_at(march.scene, history.time[radius.argmax()])) / own
        assert at == pytest.approx(1.0 + np.sign(rate) * late / root, abs=0.01)
        found.append(radius.max() / (HEAVY / MASS) / (most * root))
    assert found[0] > 1.0 > found[1]  # Omega^2 grows, or falls, until the peak
    assert np.mean(found) == pytest.approx(1.0, abs=0.01)


def test_a_gap_closes_by_its_law_and_ahead_counts_its_least():
    given = {"speed": 200.0, "gap": 6e-4, "duration": 0.6, "accuracy": 1e-3}
    still = march_of(**given)
    free = still.run()
    assert 0.0 < free.certificate < 0.3  # no contact can recur at a constant gap
    more = {"gap_closure": 5.99e-4, "gap_time": 0.1}
    march = march_of(**given, **more)
    for time in (0.0, 0.1, 0.5):
        want = 6e-4 - 5.99e-4 * -np.expm1(-time / 0.1)
        assert march.schedule.gap(time) == pytest.approx(want, rel=1e-12)
    closed = march.run()
    assert closed.last_contact > free.certificate
    assert closed.certificate < 0.0
    assert closed.gap_error < 1e-9
    assert closing(closed) < 1e-11


def test_a_gap_by_a_table_is_that_of_the_law_it_samples():
    given = {"speed": 200.0, "gap": 6e-4, "duration": 0.02, "time_step": 5e-6,
             "friction": 0.0}  # fmt: skip
    law = {"gap_closure": 5e-4, "gap_time": 0.01}
    times = np.linspace(0.0, 0.02, 41)
    gaps = 6e-4 + 5e-4 * np.expm1(-times / 0.01)
    rows = ";".join(
        f"{t!r},{g!r}" for t, g in zip(times.tolist(), gaps.tolist(), strict=True)
    )
    one = march_of(**given, **law)
    two = march_of(**given, gap_table=f"time,gap;{rows}")
    for time in (0.0, 0.00512, 0.02):
        assert one.schedule.gap(time) == pytest.approx(two.schedule.gap(time), rel=2e-3)


@pytest.mark.turns
def test_the_gap_at_rest_shrinks_by_the_growth_at_each_speed():
    given = {"rotation": "full", "gap_at": "rest", "gap": 1e-3, "time_step": 8e-6,
             "acceleration": 100.0, "duration": 1.0, "speed": 200.0}  # fmt: skip
    march = march_of(**given)
    for time in (0.0, 0.5, 1.0):
        at = 200.0 + 100.0 * time
        want = 1e-3 - tip_growth(march.model.rotor, march.model.blades, at).max()
        assert march.schedule.gap(time) == pytest.approx(want, rel=1e-9)


def test_eulers_load_turns_as_the_centrifugal_one_pulls():
    section = Section(0.01, (0.02, 0.015), 2e11, 8000.0)
    length, (x, y) = 0.3, (0.2, -0.05)
    load, swing = loads_of(length, section, (x, y))
    away = np.array([x, y, 0.0, x + length, y, 0.0])  # displacements X, and z x X
    around = np.array([-y, x, 1.0, -y, x + length, 1.0])
    inertia = load @ away  # integral of rho A X^2
    assert swing @ around == pytest.approx(inertia, rel=1e-12)
    assert swing @ away == pytest.approx(0.0, abs=1e-12 * inertia)


@pytest.mark.turns
def test_blades_lag_behind_a_rotor_that_is_run_up():
    given = {"rotation": "full", "force": 0.0, "duration": 0.5, "accuracy": 1e-2,
             "gap": 5e-3, "rotor.damping": 0.3, "suspension_damping": 0.3,
             "blades": 7, "modes": 35, "casing.harmonics": 6}  # fmt: skip
    march = march_of(**given, speed=50.0, acceleration=100.0)
    march.run()
    rotor, (body, blades) = (
        march.motion().rotor,
        (march.model.rotor, march.model.blades),
    )
    at = 50.0 + 100.0 * march.steps * march.scene.solver.time_step
    _, _, stiffness, push = turning_matrices(body, at, blades)
    bent = np.linalg.solve(stiffness + push, -100.0 * body.spin.swing)
    assert bent[1 : 2 * blades : 2].max() < 0.0  # against the acceleration
    tips = slice(0, 2 * blades)
    assert np.abs(rotor - bent)[tips].max() < 1e-2 * np.abs(bent[tips]).max()


@pytest.mark.turns
@pytest.mark.parametrize(
    ("given", "word", "note"),
    [
        ({"acceleration": 6000.0, "force": 0.0}, "overloaded", [BY_SPEED]),
        ({"acceleration": 3500.0, "speed": 100.0}, "overloaded", [BY_SPEED]),
        ({"acceleration": 60.0, "unbalance": 2e-3, "friction": 0.4}, "stopped", []),
        ({"acceleration": 60.0, "force": 1e8}, "overloaded", [BY_PULSE]),
    ],
)
def test_what_eulers_force_carries_to_the_limit_is_overloaded(given, word, note):
    """By what put in more energy: the changing speed, friction, or the pulse."""
    own = {"rotation": "full", "speed": 300.0, "duration": 0.05, "accuracy": 0.03,
           "blades": 12, "harmonics": 8, "modes": 30}  # fmt: skip
    march = march_of(**own | given)
    history = march.run()
    row = result_of(march.case, history).row
    assert (row["stop"], row["outcome"]) == ("amplitude", word)
    assert notes_on(march.scene, row) == note
    bent = row["driven_energy"]
    ledger = row["ledger_friction"] + row["ledger_rotation"]
    if note == [BY_SPEED]:
        assert bent > 10.0 * max(ledger, row["ledger_pulse"])
    else:
        assert bent < 0.01 * max(ledger, row["ledger_pulse"])


def test_one_window_of_a_hardly_changing_run_has_its_words():
    given = {"speed": 300.0, "duration": 0.4, "accuracy": 1e-3, "output.windows": 1}
    march = march_of(**given, acceleration=1e-9)
    history = march.run()
    row = result_of(march.case, history).row
    (only,) = words_over_speed(march.case, history)
    assert (only.regime, only.whirl) == (row["regime"], row["whirl"])
    assert only.begin == 0.0
    assert only.end == pytest.approx(0.4, rel=1e-4)


def test_words_over_speed_are_read_as_they_were_told():
    spells = [
        Spell(0.0, 0.5, 100.0, 150.0, "damped", "none"),
        Spell(0.5, 1.0, 150.0, 200.0, "sustained", "backward"),
    ]
    assert spells_of(told_over_speed(spells)) == spells
    one = "0..0.5 s 100..100 rad/s damped none"
    with showing(("rpm",)):
        turned = in_shown_units(f"{one}; {one}")
    assert turned == "; ".join(2 * ["0..0.5 s 954.93 rpm damped none"])
    assert spells_of("") == []


def test_a_critical_speed_is_crossed_when_the_speed_is_there(passage):
    case = passage.march.case
    (one,) = [c for c in crossings(case) if c["of"] == "unbalance"]
    law = speed.law_of(case.scene)
    assert float(law.speed(one["time"])) == pytest.approx(one["speed"], rel=1e-5)
    assert one["rising"]


@pytest.mark.parametrize(
    ("settings", "told"),
    [
        ({"acceleration": -200.0, "duration": 3.0}, "must keep its sign"),
        ({"speed_table": "time,speed;0,410"}, "two rows at least"),
        ({"speed_table": "time,gap;0,410;1,2"}, "columns time,speed"),
        ({"gap_closure": 2e-4}, "by which closure and growth of the tips reduce it"),
    ],
)
def test_what_cannot_change_is_refused_in_one_line(settings, told):
    with pytest.raises(InputError) as refused:
        march_of(**settings)
    assert told in str(refused.value)
    assert "\n" not in str(refused.value)


def test_an_unbalanced_rotor_begins_at_rest_on_its_circle():
    march = March(resolve(stiff(3, acceleration=100.0, duration=0.01)))
    motion = march.motion()
    spot = motion.rotor[2 * march.model.blades : 2 * march.model.blades + 2]
    assert np.hypot(*spot) > 0.0
    size = np.abs(motion.rotor).max() * march.scene.speed
    assert np.abs(motion.rotor_velocity).max() < 1e-9 * size
