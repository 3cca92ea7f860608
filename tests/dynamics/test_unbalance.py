"""An unbalanced rotor: its circle, its run into the casing, and what words say of it.

T5: without contact z = e Omega^2 / (omega^2 - Omega^2 + 2 i xi omega Omega), 90 degrees
behind the unbalance at Omega = omega. T9, full annular rub in a radial spring k_b:
|A (k - m Omega^2 + i c Omega) + k_b (A - r_0) (1 + i mu)| = m e Omega^2.

The rotor is one of stiff beams; its centre, tips and springs move as one to 1e-3.
"""

import cmath
import hashlib
import json
from dataclasses import replace

import numpy as np
import pytest
from jeffcott import (
    GAP,
    HEAVY,
    MASS,
    OWN,
    RATIO,
    as_one,
    spring_casing,
    stiff,
)
from scipy.optimize import brentq

from hpcwhirl import Design
from hpcwhirl.analysis.regimes import Thresholds, evidence, name_regime
from hpcwhirl.campaign.simulate import notes_on, result_of, simulate
from hpcwhirl.case.resolve import Case, resolve
from hpcwhirl.case.unbalance import CLEAR, centre_of, circle, facts_of_unbalance
from hpcwhirl.cli import main
from hpcwhirl.dynamics.bodies.turning import by_diameter
from hpcwhirl.dynamics.kernels.contact import PULSE
from hpcwhirl.dynamics.march import March
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.model import Model, model_of
from hpcwhirl.reduction.waves import turning_matrices, unbalance_speeds
from hpcwhirl.scene import Scene, apply_settings, digest, flatten
from hpcwhirl.scene.case_digest import PHYSICS_VERSION
from hpcwhirl.scene.input_names import LATER
from hpcwhirl.store.directory.manifest import PlanFile

SMALL = {
    "rotation": "full", "blades": 5, "rotor.elements": 2, "modes": 10, "harmonics": 4,
    "time_step": 2e-6, "interval": 1e-4, "scheme": "modal", "unbalance": 2e-2,
    "unbalance_phase": 0.3,
}  # fmt: skip


def small(**settings):
    names = {"kind": "casing.kind", "damping": "engine.rotor.damping"}
    given = {names.get(name, name): value for name, value in settings.items()}
    return March(resolve(apply_settings(Scene(), SMALL | given)))


def jeffcott(speed, load=HEAVY, phase=0.0):
    """Return z of the steady circle, m, rotating frame: T5."""
    down = OWN**2 - speed**2 + 2j * RATIO * OWN * speed
    return load / MASS * speed**2 * cmath.exp(1j * phase) / down


def centre_at(scene):
    model = resolve(scene).model
    return centre_of(model, circle(model, scene))


@pytest.mark.parametrize("share", [0.3, 1.0, 2.0])
def test_the_circle_is_that_of_a_jeffcott_rotor(share):
    speed = share * OWN
    z = centre_at(stiff(8, speed=speed, unbalance_phase=0.7))
    assert z == pytest.approx(jeffcott(speed, phase=0.7), rel=0.03)


def test_the_circle_is_90_degrees_behind_at_the_critical_speed():
    scene = stiff(8)
    (critical,) = unbalance_speeds(resolve(scene).model.rotor)
    assert critical == pytest.approx(OWN, rel=1e-3)
    for speed in (critical, -critical):
        at = apply_settings(scene, {"speed": speed, "unbalance_phase": 0.7})
        facts = facts_of_unbalance(resolve(at).model, at)
        assert facts["lag"] == pytest.approx(np.pi / 2, abs=2e-3)
        assert facts["radius"] == pytest.approx(HEAVY / MASS / (2 * RATIO), rel=2e-3)
    assert np.angle(centre_at(at)) == pytest.approx(0.7 + np.pi / 2, abs=2e-3)


def test_the_circle_grows_with_the_unbalance():
    once, thrice = (centre_at(stiff(8, unbalance=u, speed=400.0)) for u in (1e-3, 3e-3))
    assert thrice == pytest.approx(3.0 * once, rel=1e-12)


def amplitudes(march, places):
    """Return places (n,) of the rotor, m, in the kernel's coordinates."""
    body = march.model.rotor
    if march.scene.solver.scheme == "paper":
        return places
    order, _ = by_diameter(body)
    return body.shapes[:, order].T @ (body.mass @ places)


def put(march, places):
    """Put the rotor at rest at places (n,), m, rotating frame."""
    steady = circle(march.model, march.scene)
    shift = 0.0 if march.scene.solver.scheme == "paper" else steady
    march.state.q_b[:-1] = amplitudes(march, places - shift)


@pytest.mark.turns
@pytest.mark.parametrize("scheme", ["general", "paper"])
def test_a_rotor_put_at_rest_goes_to_its_circle(scheme):
    """Marched: from the centre, in the rotating frame, by what the damper takes."""
    scene = stiff(
        4, **{"casing.kind": "rigid"}, scheme=scheme, speed=OWN, time_step=2e-6,
        duration=0.25, gap=1.0,
    )  # fmt: skip
    march = March(resolve(scene))
    places = circle(march.model, scene)
    assert march.displacements()[0] == pytest.approx(places, abs=1e-15)
    put(march, 0.0 * places)
    assert march.displacements()[0] == pytest.approx(0.0 * places, abs=1e-15)
    z = march.run().centre @ [1, 1j]
    assert abs(z[0]) < 1e-2 * abs(z[-1])
    assert z[-1] == pytest.approx(centre_of(march.model, places), rel=2e-3)
    assert z[-1] == pytest.approx(jeffcott(OWN), rel=0.03)


# T9, in units of m, omega and r_0
SPRING, DRAG, PART, SPEED, LIGHT = 25.0, 0.02, 0.6, 1.2, 0.1


def needed(a):
    """Return the force that holds a rub of radius a r_0 in place, over k r_0."""
    alone = 1.0 - SPEED**2 + 2j * RATIO * SPEED
    return a * alone + SPRING * (a - 1.0) * (1 + 1j * DRAG)


def rubbing_radius():
    return brentq(lambda a: abs(needed(a)) - PART * SPEED**2, 1.0, 1.5)


def yielding(scene, model):
    """Return what blade 0 yields beyond the rotor as one, times k, in the rub."""
    _, _, stiffness, push = turning_matrices(model.rotor, scene.speed, model.blades)
    load = np.zeros(len(stiffness))
    load[:2] = 1.0, DRAG
    moved = np.linalg.solve(stiffness + push, load)[0] * MASS * OWN**2
    return moved - ((1 + 1j * DRAG) / (1 - SPEED**2 + 2j * RATIO * SPEED)).real


def rubbing(folder, blades, step, **settings):
    """Return a march of the rotor that the casing holds."""
    scene = stiff(
        blades, speed=SPEED * OWN, friction=DRAG, time_step=step,
        unbalance=PART * MASS * GAP, plan="everything",
        unbalance_phase=cmath.phase(needed(rubbing_radius())),  # blade 0 touches
        **settings,
    )  # fmt: skip
    whole = model_of(scene)
    spring = 1.0 / (1.0 / SPRING - yielding(scene, whole))
    omega = (spring / LIGHT + SPEED**2) ** 0.5  # as if on `spring` at the speed
    casing = spring_casing(folder / "casing.h5", omega, 0.0, LIGHT)
    march = March(Case(scene, Model(whole.rotor, *casing, blades)))
    alone = centre_of(march.model, circle(march.model, march.scene))
    assert abs(alone) > 1.8 * GAP  # without the casing
    return march, spring


def put_outside(march, spring, radius):
    """Put the rotor half a percent outside of the rub, and the casing on it."""
    step, state = march.scene.solver.time_step, march.state
    put(march, 1.005 * radius * GAP * as_one(march.model)[:, 0])
    wave = SPRING * (radius - 1.0) / spring * GAP * (LIGHT * MASS) ** 0.5
    turned = np.exp(-1j * SPEED * OWN * step)
    state.q_c[1], state.q_c[2] = wave, 0.0
    state.d_c[1], state.d_c[2] = wave * (1.0 - turned.real), -wave * turned.imag
    state.gaps[:] = state.older[:] = 0.0
    state.ledger[PULSE] = march.scheme.balance(state).energy


def check_rub(march, begin, error):
    """Check the rub of a march from a time on, s; error : of the mean radius, r_0."""
    history, radius = march.run(), rubbing_radius()
    late = history.time > begin
    z = history.centre[late] @ [1, 1j] / GAP
    assert abs(z).mean() == pytest.approx(radius, abs=error)
    assert abs(z).std() < 4e-3
    assert np.angle(z.mean()) == pytest.approx(0.0, abs=np.pi / march.model.blades)
    push = np.ptp(history.impulse[late]) / np.ptp(history.time[late])
    force = SPRING * (radius - 1.0) * MASS * OWN**2 * GAP
    assert push == pytest.approx(force, rel=0.01)
    facts = evidence(march.scene, history)
    assert facts["ledger_error"] < 1e-9
    assert name_regime(facts | {"stop": history.stop}, Thresholds())[0] == "completed"
    return history


@pytest.mark.slow
def test_a_full_annular_rub_keeps_its_published_radius(tmp_path):
    """T9; the casing's spring and the blade's, one behind the other, are k_b."""
    assert rubbing_radius() == pytest.approx(1.0525416, abs=1e-7)
    march, spring = rubbing(tmp_path, 60, 5.5e-7, duration=0.07)
    put_outside(march, spring, rubbing_radius())
    history = check_rub(march, 0.014, 1e-3)
    assert history.judged.rotor.max() < 0.0  # beyond the critical speed


@pytest.mark.evidence  # begun near it: the test before
@pytest.mark.slow
def test_a_full_annular_rub_comes_to_its_published_radius(tmp_path):
    """From where a run begins, 155 degrees away; 200 blades, whose polygon chatters."""
    march, _ = rubbing(tmp_path, 200, 4e-7, duration=0.2, scheme="modal")
    begun = march.history().centre
    assert len(begun) == 0
    check_rub(march, 0.12, 3e-3)


@pytest.mark.parametrize("speed", [200.0, -200.0])
def test_the_blade_of_the_unbalance_is_farthest_out_below_the_critical_speed(speed):
    scene = apply_settings(Scene(), SMALL | {"speed": speed})
    for blade in range(5):
        at = apply_settings(scene, {"unbalance_phase": 2 * np.pi * blade / 5})
        assert np.argmax(circle(resolve(at).model, at)[0:10:2]) == blade


@pytest.mark.parametrize("scheme", ["modal", "exact", "general", "paper"])
def test_a_circle_beyond_the_gap_begins_inside_with_its_energy_booked(scheme):
    march = small(scheme=scheme, unbalance=0.2, duration=6e-3, force=0.0)
    places = circle(march.model, march.scene)
    outward, gap = places[0:10:2].max(), march.scene.gap
    assert outward > gap
    begun = march.displacements()[0]
    assert begun[0:10:2].max() == pytest.approx((1 - CLEAR) * gap)
    assert begun == pytest.approx(places * (1 - CLEAR) * gap / outward)
    if scheme in {"general", "paper"}:
        assert march.state.gaps == pytest.approx(gap - begun[0:10:2])
    booked = march.history().ledger
    assert booked["pulse"] == booked["energy"] != 0.0
    history = march.run()
    assert history.contacts > 0
    through = sum(map(abs, history.ledger.values()))
    assert abs(history.ledger["residual"]) < 1e-9 * through


def test_a_circle_without_contact_is_damped_and_a_forward_whirl():
    march = small(force=0.0, unbalance=5e-3, duration=0.1)
    history = march.run()
    assert history.centre == pytest.approx(
        np.tile(history.circle[0], (1000, 1)), rel=1e-12
    )
    facts = evidence(march.scene, history) | {"stop": history.stop}
    assert facts["late_energy"] == 0.0
    words = name_regime(facts, Thresholds())
    assert words == ("completed", "damped", "forward")
    assert facts["line_frequency"] == pytest.approx(march.scene.speed, rel=0.05)


def test_words_are_of_the_motion_about_the_circle():
    """It begins a little inside of it and touches nothing: what is left dies out."""
    march = small(
        kind="rigid", unbalance=1.92e-2, duration=0.5, time_step=1e-5, damping=0.02,
        suspension_damping=0.1,
    )  # fmt: skip
    history = march.run()
    facts = evidence(march.scene, history) | {"stop": history.stop}
    assert history.contacts == 0
    assert facts["growth_centre"] < -1.0
    assert facts["growth_rotor"] < -1.0
    radius = abs(complex(*history.circle[0]))
    assert facts["orbit_radius"] == pytest.approx(radius, rel=1e-3)
    assert name_regime(facts, Thresholds()) == ("completed", "damped", "forward")


DRAWN = np.random.default_rng(18)
QUIET = [
    {"speed": DRAWN.choice([-1, 1]) * 10 ** DRAWN.uniform(0.7, 3),
     "unbalance": 10 ** DRAWN.uniform(-8, -3), "blades": int(DRAWN.integers(3, 7)),
     "time_step": 10 ** DRAWN.uniform(-6, -5), "damping": 10 ** DRAWN.uniform(-5, -2)}
    for _ in range(4)
]  # fmt: skip


@pytest.mark.turns
@pytest.mark.parametrize("scheme", ["paper", "general", "modal", "exact"])
@pytest.mark.parametrize("given", QUIET)
def test_a_rotor_that_only_round_off_moves_rests_on_its_circle(scheme, given):
    own = {"modes": 2 * given["blades"], "suspension_damping": 1.1 * given["damping"]}
    for force in (0.0, 1.0):  # a pulse that moves the casing alone
        march = small(
            **given | own, scheme=scheme, gap=5e-3, force=force, duration=0.05,
            **{"casing.damping": 0.1, "pulse": 1e-4},
        )  # fmt: skip
        history = march.run()
        assert history.contacts == 0
        assert history.circle.any()
        facts = evidence(march.scene, history) | {"stop": history.stop}
        assert facts["growth_rotor"] == facts["growth_centre"] == 0.0
        assert facts["ledger_error"] < 1e-9
        assert name_regime(facts, Thresholds())[:2] == ("completed", "damped")


@pytest.mark.turns
@pytest.mark.parametrize("scheme", ["paper", "general", "modal", "exact"])
@pytest.mark.parametrize("unbalance", [0.0, 1e-3])
@pytest.mark.parametrize("force", [0.0, 1.0])  # a pulse that moves the casing alone
def test_a_rotor_at_rest_is_not_damped_where_its_free_motion_grows(
    scheme, unbalance, force
):
    """A pushed rotor shows the growth that one at rest would have."""
    own = {"scheme": scheme, "unbalance": unbalance, "force": force, "duration": 0.05}
    for coupling, word in ((0.0, "damped"), (1.2e7, "undecided")):
        march = small(cross_coupling=coupling, gap=1e-3, pulse=1e-4, **own)
        history = march.run()
        facts = evidence(march.scene, history) | {"stop": history.stop}
        assert history.contacts == 0
        assert name_regime(facts, Thresholds())[:2] == ("completed", word)
        assert (facts["growth_rotor"] > 0.0) == (coupling > 0.0)
    pushed = small(
        cross_coupling=coupling, kind="rigid", unbalance=0.0, start_energy=1e-12,
        time_step=1e-5, duration=0.1,
    ).run()  # fmt: skip
    assert pushed.contacts == 0
    grown = evidence(march.scene, pushed)["growth_rotor"]
    assert grown == pytest.approx(facts["growth_rotor"], rel=1e-3)


OFF = {  # runs that begin at rest, and not in their motion without contact
    "smaller circle": {"unbalance": 5e-2, "gap": 1e-5},
    "unequal sectors": {
        "unbalance": 5e-2, "gap": 1e-5, "mistuning": [0.01, -0.02, 0.03, 0.0, 0.01],
    },
    "lost blade": {"lost_blade": 2, "gap": 4e-3, "amplitude_limit": 0.5},
    "run-up": {"acceleration": 900.0, "gap": 4e-3},
}  # fmt: skip
UNFIT = {("exact", "unequal sectors"), ("exact", "lost blade"), ("exact", "run-up"),
         ("paper", "run-up")}  # fmt: skip
STARTS = [(scheme, name) for scheme in ("paper", "general", "modal", "exact")
          for name in OFF if (scheme, name) not in UNFIT]  # fmt: skip


@pytest.mark.turns
@pytest.mark.parametrize(("scheme", "name"), STARTS)
def test_a_run_off_its_motion_without_contact_begins_at_rest(scheme, name):
    """Its increments are those of two steps; one of 0 is a velocity of dt x'' / 2."""
    own = {"force": 0.0, "unbalance": 0.0, "speed": 300.0, "duration": 3e-4}
    ends = []
    for step in (4e-6, 2e-6, 1e-6):
        march = small(**own | OFF[name], scheme=scheme, time_step=step)
        first = march.motion()
        march.run()
        last = march.motion()
        fast = np.abs(last.rotor_velocity).max()
        assert np.abs(first.rotor_velocity).max() < 1e-9 * fast
        ends.append(last.rotor)
    if name in ("lost blade", "run-up"):  # without contact: of second order
        assert march.history().contacts == 0
        missed = [np.abs(end - ends[-1]).max() for end in ends[:-1]]
        assert missed[0] == pytest.approx(5.0 * missed[1], rel=0.1)


@pytest.mark.parametrize("coupling", [0.0, 1.2e7])  # the whirl decays, or it grows
def test_a_motion_far_below_the_circle_is_judged_as_the_motion_it_is(coupling):
    """At 1e-8 of the circle, in places that have its size, as in modes without it."""
    found = []
    for scheme in ("paper", "general"):
        march = small(
            scheme=scheme, kind="rigid", unbalance=1e-3, cross_coupling=coupling,
            duration=0.1, time_step=1e-5, suspension_damping=0.1, damping=0.02,
        )  # fmt: skip
        places = circle(march.model, march.scene)
        put(march, (1.0 + 1e-8) * places)
        march.state.ledger[PULSE] = march.scheme.balance(march.state).energy
        history = march.run()
        facts = evidence(march.scene, history) | {"stop": history.stop}
        assert history.contacts == 0
        assert name_regime(facts, Thresholds())[1] == (
            "undecided" if coupling else "damped"
        )
        found.append([facts[f"growth_{n}"] for n in ("rate", "rotor", "centre")])
    assert found[0] == pytest.approx(found[1], rel=1e-3)
    assert (np.array(found) > 1.0).all() if coupling else (np.array(found) < -1.0).all()


@pytest.mark.parametrize(
    ("given", "told"),
    [({"unbalance": -1.0}, "unbalance must be >= 0"),
     ({"unbalance": "20 mm"}, "unbalance must be in kg m"),
     ({"unbalance": 200.0}, "unbalance must be < ")],
)  # fmt: skip
def test_what_an_unbalance_may_not_be_is_one_line(given, told):
    with pytest.raises(InputError, match=told) as refused:
        March(resolve(apply_settings(Scene(), SMALL | given)))
    assert len(str(refused.value).splitlines()) == 1


def test_an_unbalance_has_units():
    scene = apply_settings(Scene(), SMALL | {"unbalance": "20 g mm"})
    assert scene.unbalance == 2e-5
    scene = apply_settings(scene, {"unbalance_phase": "90 degree"})
    assert scene.unbalance_phase == pytest.approx(np.pi / 2)


def test_no_unbalance_changes_no_digest():
    """Cases from before there was this input are found by their digests."""
    plain = apply_settings(Scene(), {"rotation": "full"})
    assert {"unbalance", "unbalance_phase"} < {*LATER}
    values = {n: v for n, v in flatten(plain).items() if n not in LATER}
    told = json.dumps([PHYSICS_VERSION, values, ""], sort_keys=True)
    assert digest(plain) == hashlib.sha256(told.encode()).hexdigest()
    loads, phases = [0.0, 1e-3, 2e-3], [0.0, 0.5]
    sweep = {"speed": [300.0, 410.0], "unbalance": loads, "unbalance_phase": phases}
    design = Design.of({"engine": {"rotation": "full"}, "sweep": sweep})
    scenes = [apply_settings(plain, settings) for settings in design.settings]
    assert list(design.digests) == [digest(scene) for scene in scenes]
    assert [design.digests[i] for i in range(len(scenes))] == list(design.digests)
    assert len(set(design.digests)) == len(scenes) == 12


@pytest.mark.turns
def test_model_tells_the_circle(capsys):
    given = {n: v for n, v in SMALL.items() if n != "interval"} | {"unbalance": 5e-3}
    settings = [word for n, v in given.items() for word in ("--set", f"{n}={v}")]
    assert main(["model", "--json", *settings]) == 0
    circle_told = json.loads(capsys.readouterr().out)["rotation"]["unbalance"]
    scene = apply_settings(Scene(), given)
    assert circle_told["radius"] == pytest.approx(abs(centre_at(scene)))
    assert circle_told["force"] == pytest.approx(5e-3 * scene.speed**2)
    assert circle_told["over_gap"] == pytest.approx(circle_told["reach"] / scene.gap)
    assert not circle_told["touches"]
    assert main(["model", *settings]) == 0
    told = " ".join(capsys.readouterr().out.split())
    assert f"circles with {1e3 * circle_told['radius']:.4g} mm" in told
    assert "they touch nothing" in told
    assert main(["model", "--explain", *settings]) == 0
    assert "circle of the unbalance" in capsys.readouterr().out


def test_a_campaign_from_before_there_was_an_unbalance_goes_on(tmp_path):
    tables = {"engine": {"rotation": "full"}, "sweep": {"speed": [300.0, 410.0]}}
    new = Design.of(tables).manifest()
    base = {n: v for n, v in new.base.items() if not n.startswith("unbalance")}
    PlanFile(tmp_path).write(replace(new, base=base))
    old = PlanFile(tmp_path).read()
    assert not any(name.startswith("unbalance") for name in old.base)
    assert list(old.digests) == list(new.digests)
    assert old.digests.identity == new.digests.identity
    PlanFile(tmp_path).check_same(old, new)
    wider = tables | {"sweep": tables["sweep"] | {"unbalance": [0.0, 1e-3]}}
    PlanFile(tmp_path).check_same(old, Design.of(wider).manifest())
    heavy = Design.of(tables, {"unbalance": 1e-3}).manifest()
    with pytest.raises(InputError, match="begun with unbalance = 0"):
        PlanFile(tmp_path).check_same(old, heavy)


@pytest.mark.turns
@pytest.mark.parametrize(("unbalance", "word"), [(4e-3, "damped"), (1e-2, "sustained")])
def test_a_rub_that_holds_the_rotor_off_its_circle_is_sustained(unbalance, word):
    scene = apply_settings(Scene(), {
        "rotation": "full", "speed": 420.0, "friction": 0.05, "force": 0.0,
        "unbalance": unbalance, "time_step": 2e-6, "traces": "summary",
    })  # fmt: skip
    row = simulate(scene).row
    assert (row["regime"], row["whirl"]) == (word, "forward")
    assert row["late_contacts"] == (word == "sustained")


def test_a_run_begins_clear_of_lobes_that_stand_from_the_start():
    given = {"casing.kind": "rigid", "amplitude": 8e-5, "rise": 0.0, "speed": 500.0}
    march = March(resolve(stiff(8, **given, nodal_diameter=2)))
    moved, _ = march.displacements()
    angle = 2 * np.pi * np.arange(8) / 8
    gaps = GAP - 8e-5 * np.cos(2 * angle) - moved[0:16:2]
    assert np.abs(moved).max() > 0.0
    assert gaps.min() > 0.0
    far = facts_of_unbalance(march.model, march.scene)["reach"]
    assert far > GAP - 8e-5  # the circle itself would be inside them


def test_a_rotor_that_sits_on_its_circle_is_told_where_its_free_motion_grows():
    """Its word stays undecided: nothing has disturbed it."""
    march = small(cross_coupling=1.2e7, unbalance=1e-3, force=0.0, gap=1e-3,
                  duration=0.05)  # fmt: skip
    row = result_of(march.case, march.run()).row
    assert row["regime"] == "undecided"
    (told,) = notes_on(march.scene, row)
    assert told.startswith(f"free motion grows by {row['free_growth']:.3g} 1/s")
    assert "nothing has disturbed" in told
    calm = small(unbalance=1e-3, force=0.0, gap=1e-3, duration=0.05)
    assert not notes_on(calm.scene, result_of(calm.case, calm.run()).row)
