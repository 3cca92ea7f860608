"""Starts of a given energy: points of a shell, which then move freely."""

import numpy as np
import pytest
from scipy.stats import beta, kstest

from hpcwhirl.case.resolve import resolve
from hpcwhirl.dynamics.march import March
from hpcwhirl.dynamics.start import direction, names_of, start_of
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.modes import stiffening_at
from hpcwhirl.scene import Scene, apply_settings

pytestmark = pytest.mark.turns

MODES = "rotor suspension, rotor 1F 2, casing 1F"


def case_of(**settings):
    given = {
        "blades": 7, "force": 0.0, "gap": 1e-2, "duration": 0.02, "start_energy": 0.3,
        "start_modes": MODES, "traces": "summary",
    }  # fmt: skip
    return resolve(apply_settings(Scene(), given | settings))


def matrices(body, speed):
    """Return M and K, with the terms of rotation."""
    if body.spin is None:
        return body.mass, body.stiffness
    stiffness = body.stiffness + stiffening_at(body.spin, speed)
    assert body.spin.support.at(speed).turning(speed).real == 0.0
    return body.mass, stiffness


@pytest.mark.parametrize("rotation", ["none", "full"])
@pytest.mark.parametrize("how", ["velocities", "both"])
def test_the_energy_of_a_start_is_the_input(rotation, how):
    for draw, energy in ((0.0, 0.3), (1.0, 1e-6), (0.731, 20.0)):
        case = case_of(
            rotation=rotation, start_as=how, start_draw=draw, start_energy=energy,
            scheme="exact", gap=0.4,
        )  # fmt: skip
        motion = start_of(case)
        parts = (case.model.rotor, *motion[:2]), (case.model.casing, *motion[2:4])
        total = 0.0
        for body, x, v in parts:
            mass, stiffness = matrices(body, case.scene.speed)
            total += (v @ mass @ v + x @ stiffness @ x) / 2.0
        assert total == pytest.approx(energy, rel=1e-11)
        assert (np.abs(motion.rotor).max() > 0.0) == (how == "both")
        ledger = March(case).history().ledger
        assert ledger["pulse"] == pytest.approx(energy, rel=1e-11)


@pytest.mark.parametrize("scheme", ["modal", "general", "paper"])
def test_central_differences_book_the_energy_of_a_start_but_for_the_step(scheme):
    off = []
    for step in (2e-6, 1e-6):
        given = {"scheme": scheme, "time_step": step, "start_as": "both"}
        march = March(case_of(**given, start_modes="rotor suspension, rotor 1F 2"))
        march.reach(march.total)
        ledger = march.history().ledger
        assert abs(ledger["residual"]) < 1e-10 * ledger["pulse"]
        off.append(ledger["pulse"] / 0.3 - 1.0)
    assert off[0] == pytest.approx(2.0 * off[1], rel=0.02)  # that of half a step before
    assert 0.0 < off[1] < 1e-4


@pytest.mark.parametrize("how", ["velocities", "both"])
def test_draws_are_uniform_over_the_shell(how):
    model = case_of().model
    names = names_of(model)
    chosen = [n for n, name in enumerate(names) if name[1] in {"1F", "suspension"}]
    count = len(chosen) * (2 if how == "both" else 1)
    shares, signs = [], []
    for draw in range(600):
        found = direction(model, 0.0, "rotor 1F, rotor suspension", float(draw), how)
        places, rates = found.rotor * model.rotor.omega, found.rotor_rate
        assert not found.casing_rate.any()
        both = np.concatenate([places[chosen], rates[chosen]])[-count:]
        assert both @ both == pytest.approx(2.0)
        shares.append(both**2 / 2.0)
        signs.append(both > 0.0)
    share = np.array(shares)
    assert share.mean(axis=0) == pytest.approx(1.0 / count, rel=0.25)
    assert np.mean(signs, axis=0) == pytest.approx(0.5, abs=0.1)
    law = beta(0.5, (count - 1) / 2.0)  # of one coordinate squared
    assert kstest(share.ravel(), law.cdf).pvalue > 1e-3
    between = np.corrcoef(share.T) - np.eye(count)
    assert np.abs(between).max() < 0.2
    assert between.sum() / (count * (count - 1)) == pytest.approx(
        -1.0 / (count - 1), abs=0.03
    )


ONE_FAMILY = {"blades": 7, "rotor.elements": 3, "modes": 14, "speed": 300.0}


@pytest.mark.parametrize("speed", [0.0, 200.0, 500.0, 800.0])
@pytest.mark.parametrize("modes", ["rotor 1F 2", "rotor 1F 0, rotor 2F 2, rotor 1F 2"])
def test_half_of_a_start_s_energy_is_strain_energy_at_all_speeds(modes, speed):
    """Equipartition over the shell of T + U(Omega), to three standard errors."""
    body = (model := case_of(**ONE_FAMILY, rotation="full").model).rotor
    stiffness, shares = matrices(body, speed)[1], []
    for draw in range(300):
        found = direction(model, speed, modes, float(draw), "both")
        place = body.shapes @ found.rotor
        strain, kinetic = place @ stiffness @ place, found.rotor_rate @ found.rotor_rate
        assert strain + kinetic == pytest.approx(2.0)
        shares.append(strain / (strain + kinetic))
    assert np.mean(shares) == pytest.approx(0.5, abs=3.0 * np.std(shares) / 300**0.5)


def test_beyond_a_critical_speed_a_start_is_that_of_rest():
    model = case_of(**ONE_FAMILY, rotation="full").model
    rest, fast = (
        direction(model, speed, "rotor suspension", 3.0, "both")
        for speed in (0.0, 2000.0)
    )
    assert np.array_equal(rest.rotor_rate, fast.rotor_rate)
    assert fast.rotor == pytest.approx(rest.rotor, rel=1e-6)


def test_a_direction_depends_on_nothing_but_the_draw_and_the_mode():
    one = case_of(start_draw=5.0).model
    other = case_of(start_draw=5.0, gap=2e-2, speed=300.0, modes=60).model
    few = direction(one, 300.0, "rotor suspension", 5.0, "both")
    more = direction(other, 300.0, "rotor suspension, casing 3", 5.0, "both")
    held = [n for n, name in enumerate(names_of(one)) if name[1] == "suspension"]
    ratio = more.rotor_rate[held] / few.rotor_rate[held]
    assert ratio == pytest.approx(ratio[0])
    assert more.rotor[held] / few.rotor[held] == pytest.approx(ratio[0], rel=1e-4)
    assert direction(one, 300.0, "rotor 1", 6.0, "both").rotor_rate != pytest.approx(
        direction(one, 300.0, "rotor 1", 5.0, "both").rotor_rate
    )


def test_without_a_pulse_each_mode_decays_as_the_closed_form():
    case = case_of(scheme="exact", start_as="both", start_draw=2.0)
    start, march = start_of(case), March(case)
    march.reach(march.total)
    history, end = march.history(), march.motion()
    assert history.contacts == 0
    time = march.steps * case.step
    bodies = (
        (case.model.rotor, start[:2], end[0]),
        (case.model.casing, start[2:4], end[2]),
    )
    for body, (x, v), found in bodies:
        lower = body.shapes.T @ body.mass
        q, rate, omega, xi = lower @ x, lower @ v, body.omega, body.ratios
        damped = omega * np.sqrt(1.0 - xi**2)
        wave = q * np.cos(damped * time)
        wave += (rate + xi * omega * q) / damped * np.sin(damped * time)
        true = body.shapes @ (np.exp(-xi * omega * time) * wave)
        assert found == pytest.approx(true, abs=1e-9 * np.abs(x).max())


@pytest.mark.parametrize("scheme", ["exact", "paper"])
def test_a_start_and_a_pulse_add_up(scheme):
    given = {"scheme": scheme, "duration": 2e-3, "start_as": "both"}
    ends = []
    for force, energy in ((0.0, 0.3), (75e3, 0.0), (75e3, 0.3)):
        march = March(case_of(**given, force=force, start_energy=energy))
        march.reach(march.total)
        assert march.history().contacts == 0
        ends.append(march.motion())
    for alone, pushed, both in list(zip(*ends, strict=True))[:4]:
        size = np.abs(both).max()
        assert both == pytest.approx(alone + pushed, abs=1e-9 * size)


def test_a_start_that_repeats_is_that_of_one_sector():
    given = {"blades": 8, "nodal_diameter": 2, "start_modes": "rotor 1F 2, casing 2"}
    march = March(case_of(**given, scheme="exact"))
    assert march.lean.model.folds == 2
    assert march.history().ledger["pulse"] == pytest.approx(0.3, rel=1e-11)
    other = March(case_of(**(given | {"start_modes": "rotor 1F 1"})))
    assert other.lean.model.folds == 1


def test_a_start_may_close_no_gap():
    with pytest.raises(InputError, match="must leave the gaps open") as refused:
        start_of(case_of(start_as="both", gap=1e-4, start_energy=5.0))
    most = float(str(refused.value).split("up to ")[1].split(" J")[0])
    assert 0.0 < most < 5.0
    start_of(case_of(start_as="both", gap=1e-4, start_energy=0.999 * most))
    with pytest.raises(InputError):
        start_of(case_of(start_as="both", gap=1e-4, start_energy=1.001 * most))
    still = start_of(case_of(gap=1e-4, start_energy=5.0))
    assert not still.rotor.any()
    assert not still.casing.any()


SHAPED = {
    "offset": {"offset": 9e-5, "offset_angle": 3.1},
    "lobes": {"casing.kind": "rigid", "amplitude": 9e-5, "rise": 0.0},
    "fading in": {"offset": 9e-5, "offset_angle": 3.1, "profile_rise": 1e-3},
}


@pytest.mark.parametrize("kind", SHAPED)
def test_a_start_may_close_no_gap_of_a_casing_that_is_not_round(kind):
    """The largest start that is allowed just touches it."""
    given = {"start_as": "both", "gap": 1e-4, "start_modes": "rotor suspension"}
    given |= SHAPED[kind] | {"nodal_diameter": 2}
    with pytest.raises(InputError, match="must leave the gaps open") as refused:
        start_of(case_of(**given, start_energy=5.0))
    most = float(str(refused.value).split("up to ")[1].split(" J")[0])
    with pytest.raises(InputError):
        start_of(case_of(**given, start_energy=1.001 * most))
    case = case_of(**given, start_energy=0.999 * most)
    blades = case.scene.engine.rotor.blades
    angle = 2 * np.pi * np.arange(blades) / blades
    shape = {"offset": np.cos(angle - 3.1), "lobes": np.cos(2 * angle)}.get(kind, 0.0)
    gaps = 1e-4 - 9e-5 * shape - start_of(case).rotor[0 : 2 * blades : 2]
    assert 0.0 < gaps.min() < 1e-7


@pytest.mark.parametrize(
    "modes", ["rotor 99F", "", "casing suspension", "rotor 1F, blade 1"]
)
def test_modes_that_there_are_not_are_refused_in_one_line(modes):
    with pytest.raises(InputError, match="start_modes must choose modes") as refused:
        start_of(case_of(start_modes=modes))
    assert "\n" not in str(refused.value)
    assert "rotor suspension" in str(refused.value)
