"""Supports that stand and differ by direction: ellipses, critical speeds, stability.

A rotor of mass m on k_x, k_y, c_x, c_y in the static frame: m X'' + c_x X' + k_x X =
m e Omega^2 cos Omega t, and Y alike with sin.
"""

import numpy as np
import pytest
from jeffcott import HEAVY, MASS, OWN, RATIO, set_off, stiff

from hpcwhirl.analysis.regimes import Thresholds, evidence, name_regime
from hpcwhirl.case.resolve import resolve
from hpcwhirl.case.unbalance import facts_of_unbalance, share_at_start, steady_at
from hpcwhirl.dynamics.march import March
from hpcwhirl.dynamics.start import start_of
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.bodies import rotor_model
from hpcwhirl.reduction.supports import planar
from hpcwhirl.reduction.waves import (
    largest_growth,
    turning_matrices,
    unbalance_speeds,
    wave_lines,
    wave_roots,
)
from hpcwhirl.scene import Rotor, Scene, apply_settings

STIFFNESS, DAMPING = MASS * OWN**2, 2 * RATIO * OWN * MASS
APART = {
    "stiffness_difference": 0.2 * STIFFNESS,
    "damping_difference": 0.5 * DAMPING,
}  # a damper of the mean that suspension_damping gives is within 1 %
SMALL = {
    "rotation": "full", "blades": 5, "rotor.elements": 2, "modes": 10, "harmonics": 4,
    "time_step": 2e-6, "interval": 1e-4, "scheme": "general", "speed": 400.0,
    "stiffness_difference": 1.2e7, "damping_difference": 1200.0,
}  # fmt: skip


def march_of(**settings):
    return March(resolve(apply_settings(Scene(), SMALL | settings)))


def directions(speed, apart=0.2, uneven=0.5):
    """Return X and Y over m e Omega^2 e^{i Omega t} of the rigid rotor, (2,)."""
    k = STIFFNESS * np.array([1 + apart, 1 - apart])
    c = DAMPING * np.array([1 + uneven, 1 - uneven])
    load = HEAVY * speed**2 * np.array([1.0, -1j])
    return load / (k - MASS * speed**2 + 1j * speed * c)


@pytest.mark.parametrize("share", [0.5, 0.97, 1.3])
@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_the_ellipse_is_that_of_two_directions(share, sense):
    speed = sense * share * OWN
    scene = stiff(8, speed=speed, time_step=1e-7, **APART)
    model, found = resolve(scene).model, []
    for time in (0.0, 0.3 / OWN, 1.1 / OWN):
        z = steady_at(model, scene, time)[16:18] @ [1, 1j] * np.exp(1j * speed * time)
        turned = np.exp(1j * speed * time)
        x, y = (directions(speed) * turned).real
        found.append((z, complex(x, y)))
    z, expected = np.array(found).T
    assert z == pytest.approx(expected, abs=0.03 * np.abs(expected).max())


def test_the_rotor_whirls_backward_between_its_critical_speeds():
    scene = stiff(8, **APART, scheme="general")
    speeds = unbalance_speeds(resolve(scene).model.rotor)
    assert speeds == pytest.approx(OWN * np.sqrt([0.8, 1.2]), rel=1e-3)
    for share, backward in ((0.85, False), (1.0, True), (1.15, False)):
        at = apply_settings(scene, {"speed": share * OWN})
        facts = facts_of_unbalance(resolve(at).model, at)
        assert (facts["backward"] > facts["radius"]) == backward


def test_lines_are_those_of_the_two_directions():
    """And the wave that a straight motion is named after has its frequency."""
    scene = stiff(8, stiffness_difference=0.2 * STIFFNESS, suspension_damping=0.0)
    lines = wave_lines(resolve(scene).model.rotor, 8, 300.0)
    own = [x.static for x in lines if x.family == "suspension"]
    assert np.abs(own) == pytest.approx(OWN * np.sqrt([0.8, 1.2]), rel=1e-3)
    assert own[0] < 0.0 < own[1]  # the lower one is told as backward


@pytest.mark.parametrize("speed", [0.0, 350.0, -900.0])
def test_roots_are_those_of_the_round_supports_in_the_limit(speed):
    given = {"blades": 7, "elements": 3}
    near, none = (
        rotor_model(Rotor(**given, stiffness_difference=k), 20, "full")
        for k in (1e-3, 0.0)
    )
    found, own = (wave_roots(m, m.spin.waves[1], speed) for m in (near, none))
    assert found == pytest.approx(own, rel=1e-9, abs=1e-7)


def floquet(model, speed):
    """Return the growth rates of free motion, 1/s, from a turn of the whole rotor."""
    body, support = model.rotor, model.rotor.spin.support
    gyro, damping, stiffness, push = turning_matrices(body, speed, model.blades)
    n, hub = len(body.mass), slice(2 * model.blades, 2 * model.blades + 2)
    steps, mirror = 2000, np.diag([1.0, -1.0])
    step, state = np.pi / abs(speed) / steps, np.eye(2 * n)

    def flow(time):
        k, c = stiffness + push, damping + gyro
        turned = np.exp(-2j * speed * time)
        beta = support.stiffness_apart - 1j * speed * support.damping_apart
        k, c = k.copy(), c.copy()
        k[hub, hub] += planar(turned * beta) @ mirror
        c[hub, hub] += planar(turned * support.damping_apart) @ mirror
        right = np.linalg.solve(body.mass, np.hstack([k, c]))
        return np.vstack([np.hstack([np.zeros((n, n)), np.eye(n)]), -right])

    for i in range(steps):  # implicit midpoint: never unstable by itself
        half = step / 2 * flow((i + 0.5) * step)
        state = np.linalg.solve(np.eye(2 * n) - half, state + half @ state)
    return np.log(np.abs(np.linalg.eigvals(state))) / (np.pi / abs(speed))


@pytest.mark.parametrize("apart", [4e6, 1.2e7])
def test_growth_is_that_of_a_turn_marched_in_the_rotating_frame(apart):
    """Floquet's multipliers, of the whole rotor: damping that turns feeds it.

    Less than on round supports, as is known of them, by what holds the ellipse.
    """
    given = {"blades": 3, "rotor.elements": 1, "modes": 0, "suspension_damping": 0.02}
    given |= {"engine.rotor.damping": 0.02, "damping_difference": 0.0, "speed": 1500.0}
    given |= {"stiffness_difference": apart}
    model = resolve(apply_settings(Scene(), SMALL | given)).model
    rate = largest_growth(model.rotor, 3, 1500.0)
    round_one = apply_settings(Scene(), SMALL | given | {"stiffness_difference": 0.0})
    assert 0.0 < rate < 0.97 * largest_growth(resolve(round_one).model.rotor, 3, 1500.0)
    assert floquet(model, 1500.0).max() == pytest.approx(rate, rel=0.01)


QUIET = {
    "casing.kind": "rigid", "gap": 1.0, "amplitude_limit": 1e3, "force": 0.0,
    "duration": 1e-2,
}  # fmt: skip


def kicked(march, size=1.0):
    """Give the modes velocities, m/s, at rest in place."""
    rng, d = np.random.default_rng(1), march.state.d_b
    d[:] = march.scene.solver.time_step * size * rng.choice([-1, 1], len(d))
    return march


@pytest.mark.parametrize("scheme", ["general", "paper"])
def test_a_free_rotor_keeps_to_its_ellipse_about_which_nothing_moves(scheme):
    """At its steady motion, that of the differences, it stays when marched."""
    given = {"unbalance": 1e-2, "scheme": scheme} | QUIET
    if scheme == "paper":
        with pytest.raises(InputError, match="unbalance must be 0 with scheme paper"):
            march_of(**given)
        return
    march = march_of(**given)
    history = march.run()
    z, turned = history.centre @ [1, 1j], np.exp(-2j * 400.0 * history.time)
    parts = np.linalg.lstsq(np.column_stack([turned**0, turned]), z, rcond=None)[0]
    facts = facts_of_unbalance(march.model, march.scene)
    assert np.abs(parts) == pytest.approx([facts["radius"], facts["backward"]])
    assert abs(parts[1]) > 0.05 * abs(parts[0])
    own = len(march.model.rotor.omega)
    assert np.abs(march.state.q_b[:own]).max() < 1e-15
    assert march.displacements()[0] == pytest.approx(
        steady_at(march.model, march.scene, march.steps * 2e-6), rel=1e-9, abs=1e-18
    )


def test_steady_motion_is_what_the_differences_come_to():
    """From rest: the motion about the ellipse dies out, and none of it is left."""
    march = march_of(
        **QUIET | {"duration": 0.3}, unbalance=1e-2, time_step=1e-5,
        **{"engine.rotor.damping": 0.1, "suspension_damping": 0.2},
    )  # fmt: skip
    march.state.q_b[: len(march.model.rotor.omega)] = 1e-6
    first = march.scheme.balance(march.state).energy
    march.run()
    assert march.scheme.balance(march.state).energy < 1e-10 * first


def test_free_motion_in_the_static_frame_is_of_two_directions():
    """What begins along x stays there, whatever the speed."""
    none = {"damping_difference": 0.0, "suspension_damping": 0.0}
    ends = []
    for speed in (0.0, 300.0, -800.0):
        scene = stiff(
            5, speed=speed, time_step=1e-6, plan="everything",
            stiffness_difference=0.2 * STIFFNESS, unbalance=0.0, **none, **QUIET,
        )  # fmt: skip
        march = March(resolve(scene))
        set_off(march, 1e-4)
        history = march.run()
        z = history.centre @ [1, 1j] * np.exp(1j * speed * history.time)
        ends.append(z / 1e-4)
        wave = np.cos(OWN * np.sqrt(1.2) * history.time)
        assert z.real / 1e-4 == pytest.approx(wave, abs=1e-2)
        assert np.abs(z.imag).max() < 5e-3 * 1e-4
    assert ends[0] == pytest.approx(ends[1], abs=5e-3)


def test_what_supports_that_differ_take_is_booked():
    march = kicked(march_of(**QUIET, **{"engine.rotor.damping": 0.0}))
    before = march.scheme.balance(march.state)
    march.advance(march.total)
    after = march.scheme.balance(march.state)
    assert abs(after.damping) > 1e-3 * before.energy
    gone = after.energy + after.damping
    assert gone == pytest.approx(before.energy, rel=1e-11)


def test_an_unbalance_on_such_supports_leaves_the_ledger_closed_in_contact():
    """What contact does to the ellipse itself is no energy of the motion about it."""
    march = march_of(unbalance=0.05, gap=2e-5, duration=0.05, friction=0.2)
    history = march.run()
    assert history.contacts > 0
    ledger = history.ledger
    assert abs(ledger["residual"]) < 1e-10 * sum(map(abs, ledger.values()))


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"stiffness_difference": 3.5e7}, r"must be within \+-3.4e\+07 N/m"),
        ({"damping_difference": 1e5}, "the mean that suspension_damping gives"),
        ({"suspension_damping": -1.0}, "the mean that suspension_damping gives"),
    ],
)  # fmt: skip
def test_supports_that_cannot_be_are_refused_in_one_line(given, told):
    with pytest.raises(InputError, match=told) as failed:
        march_of(**given)
    assert "\n" not in str(failed.value)


def test_a_step_is_stable_in_the_stiffer_direction(monkeypatch):
    """The limit is that of k_o + |k_d|, in which a light rotor on stiff springs is."""
    monkeypatch.setattr("hpcwhirl.case.resolve.check_limits", lambda *_: None)
    light = {"unbalance": 0.0, "rotor.density": 1.0, "centre_stiffness": 1e12}
    given = {**QUIET, **light, "duration": 1e-3, "suspension_damping": 0.0}
    case, soft = (
        resolve(stiff(5, stiffness_difference=k, speed=300.0, **given))
        for k in (9e11, 0.0)
    )
    limits = [one.model.limits(300.0)["rotor"] for one in (case, soft)]
    assert limits[0] < 0.8 * limits[1]
    for share, stays in ((0.99, True), (1.02, False)):
        scene = apply_settings(case.given, {"time_step": share * limits[0]})
        march = kicked(March(resolve(scene)))
        march.advance(2000)
        assert (np.abs(march.state.q_b).max() < 1.0) == stays


def test_velocities_of_an_unbalanced_rotor_are_those_of_its_displacements():
    """Of central differences, with the part of its ellipse that turns backward."""
    given = {
        "rotation": "full", "blades": 5, "rotor.elements": 2, "modes": 10,
        "stiffness_difference": 1e7, "suspension_damping": 0.05, "unbalance": 1e-3,
        "force": 0.0, "gap": 5e-3, "time_step": 2e-6, "duration": 1e-4,
        "casing.kind": "rigid", "scheme": "general",
    }  # fmt: skip
    march = March(resolve(apply_settings(Scene(), given)))
    motions = []
    for _ in range(3):
        march.advance(1)
        motions.append(march.motion())
    before, now, after = motions
    moved = (after.rotor - before.rotor) / (2.0 * march.scene.solver.time_step)
    size = np.abs(moved).max()
    assert size > 0.1 * march.scene.speed * np.abs(now.rotor).max()
    assert np.abs(now.rotor_velocity - moved).max() < 1e-6 * size


def test_a_whirl_that_supports_drive_to_the_amplitude_limit_diverges():
    """It takes its energy from cross coupling, not from the load or from contact."""
    given = {
        "rotation": "full", "blades": 5, "rotor.elements": 2, "modes": 10,
        "cross_coupling": 1.2e7, "force": 0.0, "gap": 0.1, "start_energy": 1.0,
        "time_step": 2e-5, "duration": 1.0, "casing.kind": "rigid", "scheme": "modal",
        "amplitude_limit": 0.05,
    }  # fmt: skip
    march = March(resolve(apply_settings(Scene(), given)))
    history = march.run()
    assert history.stop == "amplitude"
    assert history.contacts == 0
    assert -history.ledger["damping"] > 10.0 * history.ledger["pulse"]
    facts = evidence(march.scene, history) | {"stop": history.stop}
    assert name_regime(facts, Thresholds()) == ("stopped", "divergent", "forward")


OIL = {
    "film_viscosity": 3e-3, "film_length": 0.03, "film_radius": 0.06,
    "film_clearance": 1.2e-4,
}  # fmt: skip
HELD = {  # what holds the centre, beyond constant matrices
    "apart": {"stiffness_difference": 1e7, "damping_difference": 1e3},
    "film": OIL,
    "both": {"stiffness_difference": 1e7, "damping_difference": 1e3, **OIL},
}
OFF = {  # starts off the motion without contact
    "circle": {"unbalance": 5e-2, "gap": 5e-5},
    "energy": {
        "start_energy": 2.0,
        "start_modes": "rotor suspension",
        "start_as": "both",
    },
}
STARTS = [
    (scheme, held, off) for scheme in ("general", "modal", "paper") for held in HELD
    for off in OFF if off == "energy" or (scheme != "paper" and held != "both")
]  # fmt: skip


@pytest.mark.parametrize(("scheme", "held", "off"), STARTS)
def test_a_start_has_its_velocities_and_an_error_of_second_order(scheme, held, off):
    """The first increment has the force of all supports, or it misses dt x'' / 2."""
    given = {
        "rotation": "full", "blades": 5, "rotor.elements": 2, "modes": 10,
        "harmonics": 4, "speed": 300.0, "suspension_damping": 0.05, "gap": 5e-3,
        "force": 0.0, "duration": 2.4e-4, "casing.kind": "rigid", "scheme": scheme,
        "plan": "everything",
    } | HELD[held] | OFF[off]  # fmt: skip
    ends = []
    for step in (2e-6, 1e-6, 5e-7):
        case = resolve(apply_settings(Scene(), given | {"time_step": step}))
        march, start = March(case), start_of(case)
        first = march.motion()
        if start is not None:
            told = start.rotor_velocity
        else:  # on the scaled circle, which does not move in the rotating frame
            before, after = (
                steady_at(case.model, case.scene, t) for t in (-step, step)
            )
            told = share_at_start(case.model, case.scene) * (after - before) / 2 / step
        history = march.run()
        last = march.motion()
        fast = max(np.abs(m.rotor_velocity).max() for m in (first, last))
        assert first.rotor_velocity == pytest.approx(told, abs=1e-9 * fast)
        assert history.contacts == 0
        ledger = history.ledger
        assert abs(ledger["residual"]) < 1e-10 * sum(map(abs, ledger.values()))
        ends.append(last.rotor)
    far, close = (np.abs(end - ends[-1]).max() for end in ends[:-1])
    assert far == pytest.approx(5.0 * close, rel=0.1)  # (16 - 1) / (4 - 1)


def test_a_motion_in_a_film_is_continued_as_if_uninterrupted():
    """Its velocities are those of its displacements, by central differences."""
    step = 2e-6
    given = {
        "rotation": "full", "blades": 5, "rotor.elements": 2, "modes": 10,
        "harmonics": 4, "speed": 300.0, "gap": 5e-3, "force": 0.0, "duration": 1e-3,
        "casing.kind": "rigid", "scheme": "general", "time_step": step, **OIL,
        **OFF["energy"],
    }  # fmt: skip
    case = resolve(apply_settings(Scene(), given))
    march, motions = March(case), []
    for _ in range(101):
        march.advance(1)
        motions.append(march.motion())
    before, now, after = motions[-3:]
    speed = np.abs(now.rotor_velocity).max()
    moved = (after.rotor - before.rotor) / (2.0 * step)
    assert now.rotor_velocity == pytest.approx(moved, abs=1e-7 * speed)
    other = March(case, now)
    other.advance(51)
    march.advance(50)
    size = np.abs(march.motion().rotor).max()
    assert other.motion().rotor == pytest.approx(march.motion().rotor, abs=1e-11 * size)
