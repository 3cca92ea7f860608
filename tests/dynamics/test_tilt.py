"""Disks that tilt on overhung shafts: their lines, and the marched motion.

(k_11 - m w^2) (k_22 - I_d w^2 + I_p Omega w) = k_12^2 of a rigid disk on a massless
shaft, w in the static frame, forward > 0.
"""

import numpy as np
import pytest
from jeffcott import MASS, density, stiff
from scenes import SHAFT

from hpcwhirl.case.resolve import resolve
from hpcwhirl.dynamics.march import March
from hpcwhirl.reduction.bodies import rotor_model
from hpcwhirl.reduction.waves import unbalance_speeds, wave_lines
from hpcwhirl.scene import Rotor, Scene, apply_settings, named_scene
from hpcwhirl.structure import bladed_disk
from hpcwhirl.structure.mount import shaft_stiffness

# L_1 0.6, L_2 0.4, d 0.05 m, E 2.11e11 Pa, m 60, I_d 1.5, I_p 3, Omega 300 rad/s
OVERHUNG = {
    "shaft": "two bearings", "shaft_length": 0.6, "shaft_overhang": 0.4,
    "shaft_diameter": 0.05, "shaft_young": 2.11e11, "tilt_inertia": 1.5,
    "polar_inertia": 3.0, "unbalance": 0.0, "suspension_damping": 0.0, "speed": 300.0,
}  # fmt: skip
LINES = -501.768, -78.499, 185.714, 994.554  # ROSS 2.3.0: 78.4990 ... 994.552


def overhung(**settings):
    heavy = {"rotor.density": density(8) * 60.0 / MASS}
    return stiff(8, **OVERHUNG | heavy | settings)


def lines_of(scene):
    lines = wave_lines(
        resolve(scene).model.rotor, scene.engine.rotor.blades, scene.speed
    )
    own = [x.static for x in lines if x.family in {"suspension", "conical"}]
    return sorted(own)


def test_an_overhung_disk_has_the_lines_of_other_codes():
    assert lines_of(overhung()) == pytest.approx(LINES, rel=2e-4)


def test_lines_of_a_mirrored_speed_are_the_same_in_the_sense_of_rotation():
    assert lines_of(overhung(speed=-300.0)) == pytest.approx(LINES, rel=2e-4)


def test_a_disk_at_rest_on_a_cantilever_has_den_hartog_s_frequencies():
    """D = I_d / m L^2 = 1/3: w sqrt(m L^3 / 3 E I) = sqrt(3) -+ 1."""
    own = {"shaft": "cantilever", "shaft_length": 0.5, "speed": 0.0}
    scene = overhung(**own, tilt_inertia=60.0 * 0.5**2 / 3)
    unit = np.sqrt(shaft_stiffness(scene.engine.rotor)[0] / 4 / 60.0)
    found = np.array(lines_of(scene)[2:]) / unit
    assert found == pytest.approx([np.sqrt(3) - 1, np.sqrt(3) + 1], rel=1e-3)


def test_a_shaft_on_two_bearings_far_apart_leans_as_one_that_is_simply_held():
    """Force and moment of a unit place and slope, by the compliance that is printed."""
    rotor = overhung().engine.rotor
    k_11, k_12, k_22 = shaft_stiffness(rotor)
    bending = 2.11e11 * np.pi * 0.05**4 / 64
    give = np.array([[0.4**2 / 3, 0.4 * 2.4 / 6], [0.4 * 2.4 / 6, 1.8 / 3]]) / bending
    assert np.array([[k_11, k_12], [k_12, k_22]]) @ give == pytest.approx(
        np.eye(2), abs=1e-12
    )


def test_inertia_that_is_not_given_is_that_of_the_blades():
    """Of a thin disk about its axis, and about a diameter half of it."""
    rotor = Rotor(shaft="cantilever", disk_radius=1e-3, taper=1.0)
    tilt = bladed_disk(rotor).mount
    bars = rotor.density * rotor.blade_width * rotor.root_thickness
    polar, across = tilt.gyro[1, 1], tilt.mass[1, 1]
    assert polar == pytest.approx(22 * bars * 0.5**3 / 3, rel=2e-2)
    assert across == polar / 2


def test_a_rotor_taken_as_a_whole_tilts_as_one_of_equal_sectors():
    given = {"blades": 5, "elements": 4, "shaft": "cantilever", "shaft_diameter": 0.05}
    found = []
    for change in ((), (1e-9, 0.0, 0.0, 0.0, 0.0)):
        model = rotor_model(Rotor(**given, mistuning=change), 20, "full")
        found.append([x for x in wave_lines(model, 5, 300.0) if x.nodal_diameter == 1])
    lines = [sorted(x.static for x in own)[5:15] for own in found]
    assert {"suspension", "conical"} <= {x.family for x in found[0]}
    assert lines[0] == pytest.approx(lines[1], rel=1e-5)


def test_the_unbalance_meets_the_forward_lines_that_follow_the_speed():
    """A synchronous motion: (k_11 - m w^2) (k_22 + (I_p - I_d) w^2) = k_12^2."""
    k_11, k_12, k_22 = shaft_stiffness(overhung().engine.rotor)
    roots = np.roots([-60.0 * 1.5, 1.5 * k_11 - 60.0 * k_22, k_11 * k_22 - k_12**2])
    expected = np.sqrt(roots[roots > 0.0])
    found = unbalance_speeds(resolve(overhung()).model.rotor)
    assert found == pytest.approx(expected, rel=1e-3)


@pytest.mark.turns
@pytest.mark.parametrize("scheme", ["modal", "exact", "general", "paper"])
def test_marched_the_centre_moves_in_these_lines(scheme):
    """Begun off its place: four lines are all that it does, Jacobi's energy stays."""
    scene = overhung(
        scheme=scheme, force=0.0, gap=1.0, time_step=2e-6, duration=0.2,
        amplitude_limit=1e3, interval=5e-4, plan="everything",
        **{"casing.kind": "rigid", "unbalance": 1e-3},
    )  # fmt: skip
    march = March(resolve(apply_settings(scene, {"gap": 1e-5})))
    first = march.scheme.balance(march.state)
    march.wall = march.wall._replace(gap=1.0)
    history = march.run()
    time, z = history.time, history.centre @ [1, 1j]
    waves = np.exp(1j * np.outer(time, lines_of(scene) - np.array(300.0)))
    basis = np.column_stack([waves, np.ones(len(time))])
    parts, *_ = np.linalg.lstsq(basis, z, rcond=None)
    assert np.abs(z - basis @ parts).max() < 2e-3 * np.abs(z).max()
    assert (np.abs(parts[1:3]) > 0.05 * np.abs(z).max()).all()
    last = march.scheme.balance(march.state)
    close = 1e-7 if scheme == "paper" else 1e-9  # round-off of 1e5 dense steps
    assert last.energy + last.damping == pytest.approx(first.energy, rel=close)
    assert abs(last.damping) < 1e-9 * abs(first.energy)


SMALL = {
    "rotation": "full", "blades": 7, "rotor.elements": 3, "modes": 14, "speed": 1e-3,
    "rotor.damping": 0.01, "suspension_damping": 0.03,
}  # fmt: skip
SHAFTS = {
    "springs": {},
    "two bearings": {"shaft": "two bearings"},
    "cantilever": {"shaft": "cantilever"},
    "thin": {"shaft": "two bearings", "shaft_diameter": 0.06},
    "given inertia": {
        "shaft": "two bearings", "tilt_inertia": 3.0, "polar_inertia": 4.0,
    },
    "light": {"shaft": "cantilever", "rotor.density": 800.0},
}  # fmt: skip


UNEVEN = {
    "equal": {},
    "mistuned": {"mistuning": [0.04, -0.03, 0.0, 0.05, -0.04, 0.02, 0.01]},
    "lost blade": {"lost_blade": 2},
}


@pytest.mark.turns
@pytest.mark.parametrize("uneven", UNEVEN)
@pytest.mark.parametrize("shaft", SHAFTS)
def test_the_suspension_has_the_damping_ratio_that_is_asked_for(shaft, uneven):
    """-Re s / |s| of the modes listed as suspension; of a split pair the mean.

    After the loss of a blade the damper is still that of the whole wheel.
    """
    scene = apply_settings(Scene(), SMALL | SHAFTS[shaft] | UNEVEN[uneven])
    lines = wave_lines(resolve(scene).model.rotor, 7, scene.speed)
    own = [x for x in lines if x.family == "suspension"]
    ratios = [-x.growth / np.hypot(x.growth, x.rotating) for x in own]
    lost = "lost_blade" in UNEVEN[uneven]
    assert np.mean(ratios) == pytest.approx(0.03, rel=0.05 if lost else 3e-3)


@pytest.mark.turns
def test_a_film_at_the_disk_of_a_shaft_line_and_a_lost_blade_keep_the_ledger():
    """Forces of supports at the disk act beside those at the shaft's stations."""
    given = SHAFT | {"rotation": "full", "blades": 7, "modes": 20, "duration": 4e-3}
    for more in ({"film_viscosity": 0.02}, {"lost_blade": 2}, {"cross_coupling": 1e6}):
        scene = apply_settings(named_scene("table2"), given | {"gap": 1e-4} | more)
        history = March(resolve(scene)).run()
        ledger = dict(history.ledger)
        residual = abs(ledger.pop("residual"))
        assert history.contacts > 0
        assert residual <= 1e-11 * sum(map(abs, ledger.values())) + history.blur[0]
