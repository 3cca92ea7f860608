"""The loss of a blade: its unbalance, its contact, and the rotor that is left.

Of a rigid wheel: m' z'' + ... + k z = -m_b r_b Omega^2 e^{i theta_j}, m' without blade.
"""

import json
import re

import numpy as np
import pytest
from jeffcott import GAP, MASS, OWN, RATIO, stiff

from hpcwhirl.campaign.simulate import simulate
from hpcwhirl.case.resolve import resolve
from hpcwhirl.case.unbalance import centre_of, circle, facts_of_unbalance
from hpcwhirl.cli import main
from hpcwhirl.dynamics.bodies.motion import after_loss
from hpcwhirl.dynamics.march import March
from hpcwhirl.dynamics.snapshot import fingerprint, restore, snapshot
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.bodies import rotor_model
from hpcwhirl.reduction.waves import tip_growth
from hpcwhirl.scene import Scene, apply_settings
from hpcwhirl.structure import blade_stiffness, bladed_disk, rotation_of
from hpcwhirl.structure.bladed_disk import blade

SMALL = {
    "rotation": "full", "blades": 5, "rotor.elements": 2, "modes": 10, "harmonics": 4,
    "time_step": 2e-6, "interval": 1e-4, "scheme": "general", "speed": 400.0,
    "lost_blade": 3,
}  # fmt: skip
RIGID = {"casing.kind": "rigid", "force": 0.0}


def march_of(**settings):
    return March(resolve(apply_settings(Scene(), SMALL | settings)))


def moment_of(rotor):
    """Return (m_b, m_b r_b) of a blade, kg and kg m: a bar of constant section."""
    assert rotor.taper == 1.0
    length = rotor.radius - rotor.disk_radius
    mass = rotor.density * rotor.blade_width * rotor.root_thickness * length
    return mass, mass * (rotor.disk_radius + length / 2)


@pytest.mark.parametrize("share", [0.4, 1.0, 1.8])
@pytest.mark.parametrize("lost", [0, 5])
def test_the_circle_is_that_of_the_lost_moment(share, lost):
    """T5 with m e of the blade, opposite to its place, and its mass less."""
    speed = share * OWN
    scene = stiff(8, speed=speed, unbalance=0.0, lost_blade=lost)
    model = resolve(scene).model
    mass, moment = moment_of(scene.engine.rotor)
    down = MASS * OWN**2 - (MASS - mass) * speed**2 + 2j * RATIO * OWN * MASS * speed
    expected = -moment * speed**2 * np.exp(2j * np.pi * lost / 8) / down
    found = centre_of(model, circle(model, scene))
    assert found == pytest.approx(expected, rel=0.03)
    facts = facts_of_unbalance(model, scene)
    assert facts["force"] == pytest.approx(moment * speed**2, rel=1e-3)
    assert facts["lag"] == pytest.approx(np.angle(down), abs=0.02)


def test_an_unbalance_beside_it_adds_to_it():
    """Of m_b r_b at the place of the blade: the wheel is balanced again."""
    lost = stiff(8, speed=400.0, unbalance=0.0, lost_blade=2)
    moment = moment_of(lost.engine.rotor)[1]
    both = apply_settings(lost, {"unbalance": moment, "unbalance_phase": np.pi / 2})
    alone, none = (
        abs(centre_of(resolve(s).model, circle(resolve(s).model, s)))
        for s in (lost, both)
    )
    assert none < 2e-3 * alone


def test_what_is_left_of_the_blade_weighs_nothing():
    """Rotor and gyroscopic terms lose those of one blade, and no other changes."""
    rotor = apply_settings(Scene(), SMALL).engine.rotor
    whole = rotor.model_copy(update={"lost_blade": -1})
    less, size = bladed_disk(whole).mass - bladed_disk(rotor).mass, 9
    own = np.s_[3 * size : 4 * size]
    assert less[own, own] == pytest.approx(blade(rotor)[0], rel=1e-5, abs=1e-12)
    less[own, own] = 0.0
    assert np.abs(less).max() == 0.0
    gone = rotation_of(whole).coriolis - rotation_of(rotor).coriolis
    gone[own, own] = 0.0
    assert np.abs(gone).max() == 0.0
    assert blade_stiffness(rotor) == blade_stiffness(whole)


def test_no_blade_lost_has_nothing_released():
    rotor = apply_settings(Scene(), SMALL | {"lost_blade": -1}).engine.rotor
    assert not rotation_of(rotor).released.any()
    assert rotor_model(rotor, 10, "full").spin.released is None


def test_the_gap_stays_that_of_the_whole_wheel():
    """Its growth at speed is known before: the tips of the others grow as they did."""
    rotor = apply_settings(Scene(), SMALL).engine.rotor
    grown = tip_growth(rotor_model(rotor, 35, "full"), 5, 400.0)
    whole = rotor.model_copy(update={"lost_blade": -1})
    expected = tip_growth(rotor_model(whole, 35, "full"), 5, 400.0)
    rest = np.arange(5) != 3
    assert grown[rest] == pytest.approx(expected[rest], rel=0.02)


@pytest.mark.parametrize("scheme", ["general", "paper"])
def test_the_centre_is_first_accelerated_by_the_lost_moment(scheme):
    """m' z'' = -m_b r_b Omega^2 e^{i theta_j}, begun at rest in its place."""
    scene = stiff(
        5, speed=500.0, unbalance=0.0, lost_blade=1, gap=1.0, scheme=scheme,
        time_step=2e-7, duration=1.6e-4, interval=2e-6, **{"casing.kind": "rigid"},
    )  # fmt: skip
    march = March(resolve(scene))
    assert march.displacements()[0] == pytest.approx(0.0, abs=1e-12)
    history = march.run()
    mass, moment = moment_of(scene.engine.rotor)
    pull = -moment * 500.0**2 * np.exp(0.4j * np.pi) / (MASS - mass)
    z, time = history.centre @ [1, 1j], history.time
    fitted = np.polyfit(time, 2 * z / time**2, 1)[-1]  # as t -> 0
    late = 2 * z[-1] / time[-1] ** 2  # the springs hardly act yet
    assert late == pytest.approx(pull, rel=0.1)
    assert abs(fitted) < 2.0 * abs(pull)


def test_the_loss_of_another_blade_is_the_same_elsewhere():
    """Of round walls at rest, turned by the angle between the two blades."""
    first, other = (
        march_of(lost_blade=j, **RIGID, gap=3e-5, modes=35, duration=0.01).run()
        for j in (0, 3)
    )
    assert first.contacts == other.contacts > 3
    turned = (first.centre @ [1, 1j]) * np.exp(2j * np.pi * 3 / 5)
    assert np.abs(other.centre @ [1, 1j] - turned).max() < 1e-10


@pytest.mark.turns
def test_without_contact_the_rotor_comes_to_its_circle():
    march = march_of(
        **RIGID | {"duration": 0.3}, gap=1.0, time_step=1e-5,
        **{"engine.rotor.damping": 0.05, "suspension_damping": 0.2},
    )  # fmt: skip
    steady = centre_of(march.model, circle(march.model, march.scene))
    z = march.run().centre @ [1, 1j]
    assert abs(z[0]) < 0.1 * abs(steady)
    assert z[-1] == pytest.approx(steady, rel=1e-4)
    assert GAP > 0.0


@pytest.mark.turns
def test_a_command_says_where_the_circle_is(capsys):
    given = ["--set", "rotation=full", "--set", "lost_blade=1"]
    assert main(["run", *given]) == 2
    assert "amplitude_limit must be > 0." in capsys.readouterr().err
    given += ["--set", "amplitude_limit=0.3"]
    assert main(["inputs", "blade-off"]) == 2
    assert "lost_blade" in capsys.readouterr().err
    small = ["--set", "blades=5", "--set", "modes=10", "--set", "harmonics=4"]
    assert main(["model", "--json", *given, *small]) == 0
    told = json.loads(capsys.readouterr().out)["rotation"]["unbalance"]
    assert told["radius"] > 0.0
    assert told["unbalance"] > 0.5  # kg m, of the blade
    assert told["force"] == pytest.approx(told["unbalance"] * 410.0**2)
    assert main(["model", *given, *small]) == 0
    shown = " ".join(capsys.readouterr().out.split())
    assert re.search(r"unbalance 1\d+ kg mm, .* times the size of the gap", shown)


def test_a_gap_at_rest_is_that_of_the_whole_wheel():
    given = {"gap_at": "rest", "gap": 1e-3, "rotation": "full", "speed": 400.0}
    lost, whole = (
        resolve(apply_settings(Scene(), SMALL | given | {"lost_blade": blade}))
        for blade in (1, -1)
    )
    assert lost.clearance == whole.clearance < 1e-3
    assert lost.scene.gap == whole.scene.gap


@pytest.mark.parametrize("modes", [44, 48, 50])
def test_a_rotor_that_loses_a_blade_may_have_any_number_of_modes(modes):
    own = {"blades": 5, "rotor.elements": 3, "modes": modes, "lost_blade": 1}
    model = resolve(apply_settings(Scene(), {"rotation": "full"} | own)).model
    assert len(model.rotor.omega) >= modes


LATER = {
    "duration": 8e-3, "gap": 2e-4, "force": 3e4, "amplitude_limit": 2.0,
    "unbalance": 0.1, "traces": "full",
}  # fmt: skip
AT = 3.002e-3  # s, no multiple of a slice


UNLIKE = {"stiffness_difference": 1.2e7, "damping_difference": 1200.0}
HELD = {
    "springs": {}, "cantilever": {"shaft": "cantilever"}, "unlike": UNLIKE,
    "film": {"film_viscosity": 1e3, "film_clearance": 0.04, "film_length": 0.1},
}  # fmt: skip


@pytest.mark.parametrize(
    ("held", "scheme"),
    [(h, s) for h in HELD for s in ("modal", "general")]
    + [("springs", "paper"), ("cantilever", "paper")],
)
def test_what_is_left_goes_on_as_it_moved(held, scheme):
    """Displacements, velocities and momentum; the energy's change is in the ledger."""
    given = LATER | HELD[held]
    march = march_of(**given, lost_blade_time=AT, scheme=scheme)
    march.advance(march.lost_at - 1)
    march._call(1)
    before, ledger, old = march.motion(), march.history().ledger, march.scheme
    march._lose()
    after, left = march.motion(), march.model.rotor
    assert march.scheme is not old
    assert march.steps * march.scene.solver.time_step == pytest.approx(AT)
    own = after_loss(march.model, before)
    for found, wanted in zip(after[:4], own[:4], strict=True):
        assert found == pytest.approx(wanted, rel=1e-8, abs=1e-9 * abs(wanted).max())
    tips = np.r_[:6, 8:12]  # of the other blades, and the centre
    assert after.rotor[tips] == pytest.approx(before.rotor[tips], abs=1e-14)
    whole = march.case.before.model.rotor.mass
    lost = left.into_whole.T @ whole @ left.into_whole - left.mass
    assert np.linalg.eigvalsh(lost).min() > -1e-9 * abs(lost).max()  # of the blade
    push = np.zeros(len(lost))
    push[10] = 1.0  # a translation along x: all tips with the centre
    angles = 2 * np.pi * np.arange(5) / 5
    push[0:10:2], push[1:10:2] = np.cos(angles), -np.sin(angles)
    static = np.linalg.solve(left.stiffness[12:, 12:], -left.stiffness[12:, :12])
    push[12:] = static @ push[:12]
    had = left.into_whole @ push @ whole @ before.rotor_velocity
    has, gone = (push @ m @ after.rotor_velocity for m in (left.mass, lost))
    assert has == pytest.approx(had - gone, rel=1e-7)
    now = march.history().ledger
    assert now["residual"] == pytest.approx(
        ledger["residual"], abs=1e-9 * now["energy"]
    )
    assert now["pulse"] - ledger["pulse"] == pytest.approx(
        now["energy"] - ledger["energy"]
    )


def test_a_blade_that_is_lost_after_the_run_changes_no_bit():
    given = LATER | {"scheme": "modal"}
    whole, later = (
        march_of(**given, lost_blade=blade, lost_blade_time=time)
        for blade, time in ((-1, 0.0), (3, 8e-3))
    )
    assert fingerprint(whole) == fingerprint(later)
    one, other = whole.run(), later.run()
    assert (one.tips == other.tips).all()
    assert one.ledger == other.ledger


@pytest.mark.turns
@pytest.mark.parametrize("scheme", ["modal", "general", "paper"])
def test_a_blade_that_is_lost_at_once_is_lost_at_the_start(scheme):
    """Of a wheel at rest in its place, in a rigid casing, where nothing acts before."""
    given = RIGID | {
        "gap": 2e-4, "duration": 4e-3, "interval": 2e-6, "scheme": scheme,
        "traces": "full", "amplitude_limit": 2.0,
    }  # fmt: skip
    first = march_of(**given).run()
    later = march_of(**given, lost_blade_time=1e-3).run()
    moved = later.tips[500:]
    assert np.abs(later.tips[:500]).max() < 1e-15
    size = np.abs(moved).max()
    assert first.contacts > 0
    assert np.abs(moved - first.tips[: len(moved)]).max() <= 1e-9 * size


def test_a_state_from_before_the_loss_and_one_after_it_go_on():
    case = resolve(apply_settings(Scene(), SMALL | LATER | {"lost_blade_time": AT}))
    whole = March(case)
    whole.run()
    for steps in (700, 1501, 1502, 3000):
        march, other = March(case), March(case)
        march.advance(steps)
        assert restore(other, snapshot(march))
        assert other.steps == steps
        other.run()
        assert (other.tracks.tips == whole.tracks.tips).all()
        assert (other.state.ledger == whole.state.ledger).all()


def test_a_later_loss_is_told_from_none():
    with pytest.raises(InputError, match="lost_blade_time must be 0 where no blade"):
        apply_settings(Scene(), SMALL | {"lost_blade": -1, "lost_blade_time": 1.0})


def test_a_run_down_that_hardly_slows_is_a_run_at_constant_speed():
    given = LATER | {"lost_blade_time": AT, "scheme": "general", "duration": 6e-3}
    still = march_of(**given).run()
    slow = march_of(**given, acceleration=-1e-6).run()
    size = np.abs(still.tips).max()
    assert slow.contacts == still.contacts > 3
    assert np.abs(slow.tips - still.tips).max() <= 1e-8 * size
    assert slow.ledger["residual"] == pytest.approx(
        0.0, abs=1e-9 * sum(map(abs, slow.ledger.values()))
    )


@pytest.mark.turns
@pytest.mark.parametrize("at", [0.0, AT])
def test_the_ledger_of_a_run_down_closes_and_its_parts_have_the_same_bits(at):
    given = LATER | {"lost_blade_time": at, "acceleration": -2e4, "scheme": "general"}
    case = resolve(apply_settings(Scene(), SMALL | given))
    whole = March(case)
    history = whole.run()
    ledger = dict(history.ledger)
    assert abs(ledger.pop("residual")) <= 1e-10 * sum(map(abs, ledger.values()))
    assert history.contacts > 3
    for steps in (999, 1500, 2750):
        march, other = March(case), March(case)
        march.advance(steps)
        assert restore(other, snapshot(march))
        other.run()
        assert (other.tracks.tips == whole.tracks.tips).all()


def translation(rotor, blades):
    """Return the coordinates of a rotor, (n, 2), moved by 1 along x and along y."""
    size = 2 * blades + 2
    angles = 2 * np.pi * np.arange(blades) / blades
    moved = np.zeros((len(rotor.mass), 2))
    moved[0 : 2 * blades : 2] = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    moved[1 : 2 * blades : 2] = np.stack([-np.sin(angles), np.cos(angles)], axis=1)
    moved[size - 2 : size] = np.eye(2)
    inner = rotor.mass[size:, size:]
    assert np.linalg.cond(inner) < 1e12
    held = rotor.stiffness[size:, size:]
    moved[size:] = np.linalg.solve(held, -rotor.stiffness[size:, :size] @ moved[:size])
    return moved


def test_a_case_tells_the_force_of_its_support_and_words_before_and_after():
    scene = apply_settings(Scene(), SMALL | LATER | {
        "lost_blade_time": 4e-3, "traces": "orbit", "scheme": "modal",
        "output.windows": 2, "engine.rotor.taper": 1.0,
    })  # fmt: skip
    found = simulate(scene)
    row, force = found.row, found.traces["support_force"]
    assert force.shape == (len(found.traces["centre"]), 1, 2)
    assert row["support_peak"] == pytest.approx(np.hypot(*force[:, 0].T).max())
    assert row["support_peak_time"] > 4e-3  # after the loss
    assert row["support_peak_place"] == row["support_names"] == "centre"
    assert row["torque_peak"] == np.abs(found.traces["shaft_torque"]).max()
    spring = scene.engine.rotor.centre_stiffness * row["centre_peak"]
    assert row["support_peak"] == pytest.approx(spring, rel=0.2)
    pushed = scene.friction * scene.engine.rotor.radius * row["contact_impulse"]
    assert row["friction_torque"] == pytest.approx(pushed / 8e-3)
    rotor = scene.engine.rotor
    mass, moment = moment_of(rotor)
    length = rotor.radius - rotor.disk_radius
    inertia = moment**2 / mass + mass * length**2 / 12
    assert row["released_energy"] == pytest.approx(0.5 * inertia * scene.speed**2)
    assert row["words_over_speed"].startswith("0..0.00")
    whole = simulate(apply_settings(scene, {"lost_blade": -1, "lost_blade_time": 0.0}))
    assert "support_peak" not in whole.row
    assert "support_force" not in whole.traces
