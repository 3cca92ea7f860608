"""A layer that wears follows the curve of its rods, and the ledger closes."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from rotor_files import written

from hpcwhirl.analysis.blade_motion import lobes_of, wear_numbers
from hpcwhirl.case.resolve import resolve
from hpcwhirl.dynamics.bodies.operators import friction_with_sign
from hpcwhirl.dynamics.kernels.compiled import kernel
from hpcwhirl.dynamics.kernels.contact import ENTRIES, IMPACT, WEAR, contact_space
from hpcwhirl.dynamics.kernels.kernel_types import Layer, Points
from hpcwhirl.dynamics.kernels.layer import layer_space, leave, press, to_worn, wear
from hpcwhirl.dynamics.march import March
from hpcwhirl.errors import InputError
from hpcwhirl.scene import Scene, apply_settings, named_scene

pytestmark = pytest.mark.turns


@kernel
def step(layer, worn, gaps, last, angles, rest):
    """Return the number of tips that press; -1 where none was found."""
    points, w, ring, lam, opened, space, own, ledger = rest
    if to_worn(angles[1], angles[0], points, worn, layer.under, own, gaps, last) < 0.0:
        (none, index, shape), own.soft[:] = ring, layer.soft
        leave(layer, worn, last, ledger, own)
        found = press(layer, worn, gaps, w, none, index, shape, lam, opened, space, own)
        wear(layer, worn, lam, last, ledger, own)
        return found
    for j in range(len(gaps)):
        lam[j], opened[j] = 0.0, gaps[j]
    return 0


STIFF, HARD, LIMIT = 3e6, 1e6, 20.0  # N/m, N/m, N of a rod
PLASTIC = Layer(1 / STIFF, 1 / HARD, 0.0, LIMIT, HARD, 1)
TANGENT = STIFF * HARD / (STIFF + HARD)


def pushed(depths, give=1e-18, layer=PLASTIC, turn=0.0, rods=8):
    """Return what two blades of compliance `give` meet, driven to depths, m.

    The second is driven half as deep; both turn by `turn`, rad, a step.
    """
    worn, lam, ledger = np.zeros((3, rods)), np.zeros(2), np.zeros(ENTRIES)
    space, own = contact_space(2, 0), layer_space(2)
    at = np.array([0.0, math.pi])
    points = Points(at, at, np.zeros(2), np.zeros((2, 0)))
    w = np.array([[give, 0.2 * give], [0.2 * give, give]])
    ring = np.zeros((0, 0)), np.zeros((2, 0), np.int64), np.zeros((2, 0))
    forces, opened = [], np.zeros(2)
    for n, depth in enumerate(depths):
        gaps, last = np.array([-depth, -0.5 * depth]), opened.copy()
        angles = np.array([0.1 + turn * n, 0.1 + turn * (n + 1)])
        rest = points, w, ring, lam, opened, space, own, ledger
        assert step(layer, worn, gaps, last, angles, rest) >= 0
        assert opened == pytest.approx(gaps + w @ lam, abs=1e-15)
        forces.append(lam.copy())
    return SimpleNamespace(
        forces=np.array(forces), worn=worn, rod=own.rod, ledger=ledger
    )


@pytest.mark.slow
@pytest.mark.parametrize("under", [1, 4])
def test_a_push_follows_the_bilinear_curve_of_each_rod_under_the_tip(under):
    depth, first = np.linspace(0, 3e-5, 61), LIMIT / STIFF
    layer = PLASTIC._replace(under=under)
    found = pushed(depth, layer=layer, rods=8 * under).forces[:, 0]
    curve = np.where(depth < first, STIFF * depth, LIMIT + TANGENT * (depth - first))
    assert found == pytest.approx(under * curve, rel=1e-9, abs=1e-9)


def test_bodies_stand_in_series_with_the_layer():
    found = pushed([1e-5, 4e-5], 1e-7)
    shortened = found.worn[0, found.rod] + found.forces[-1] / STIFF
    w = 1e-7 * np.array([[1, 0.2], [0.2, 1]])
    assert shortened + w @ found.forces[-1] == pytest.approx([4e-5, 2e-5], rel=1e-12)


def test_work_of_wear_is_the_area_of_the_closed_loop():
    there = np.concatenate([np.linspace(0, 3e-5, 3001), np.linspace(3e-5, 0, 3001)])
    found = pushed(there)
    for blade, share in enumerate([1.0, 0.5]):
        area = np.trapezoid(found.forces[:, blade], share * there)
        work = found.worn[1, found.rod[blade]]
        assert work == pytest.approx(area, rel=1e-6)
        assert work > 0
    assert found.ledger[WEAR] == pytest.approx(found.worn[1].sum(), rel=1e-12)
    again = pushed(np.concatenate([there, there]))
    assert np.array_equal(again.worn, found.worn)
    assert again.forces[-1, 0] == 0.0


@pytest.mark.parametrize("under", [1, 3])
def test_the_rotation_does_the_work_of_wear_on_rods_that_a_tip_slides_onto(under):
    """At constant depth the tip does none: six rods a blade, one a step, no loss."""
    rods, layer = 48, PLASTIC._replace(under=under)
    found = pushed([4e-5] * 7, turn=2 * math.pi / rods, rods=rods, layer=layer)
    begun = 0.1 + np.array([[1], [25]]) / 24 * math.pi  # of both blades, first step
    first = np.floor(begun / (2 * math.pi) * rods - 0.5 * (under - 1)).astype(int)
    at_once = (first + range(under)) % rods
    fresh = found.worn[1].sum() - found.worn[1, at_once].sum()
    assert np.count_nonzero(found.worn[0]) == 2 * (6 + under)
    assert fresh > 0
    assert found.worn[2].sum() == pytest.approx(fresh, rel=1e-9)
    assert found.ledger[IMPACT] == pytest.approx(found.worn[2].sum(), rel=1e-12)


def test_wear_by_archard_is_force_times_sliding_distance():
    rubbing = Layer(1 / STIFF, 1e-8, 0.0, 0.0, 0.0, 1)
    found = pushed(np.linspace(0, 3e-5, 400), layer=rubbing)
    assert found.worn[0, found.rod] == pytest.approx(1e-8 * found.forces.sum(axis=0))
    work = 1e-8 * (found.forces**2).sum(axis=0)
    assert found.worn[1, found.rod] == pytest.approx(work)
    assert (work > 0).all()


SHORT = {"duration": 0.012, "interval": 1e-4, "modes": 5}
SOFT = {"contact_law": "abradable", "layer_yield": 1e6}
RUBBED = {"contact_law": "archard", "wear_coefficient": 1e-11}


def march(**settings):
    made = March(resolve(apply_settings(named_scene("table2"), SHORT | settings)))
    return made, made.run()


def test_a_layer_that_never_yields_tends_to_rigid_contact_as_it_stiffens():
    """The difference is that of the rods' compliance: 1e-9 where that is least."""
    own = {"scheme": "paper", "duration": 3e-3}
    _, rigid = march(**own)
    assert rigid.impulse[-1] > 0
    apart = []
    for young in (1e16, 1e17, 1e22):
        held = {"layer_young": young, "layer_yield": 1e22, "contact_law": "abradable"}
        made, as_rigid = march(**own, **held)
        assert not made.state.worn[0].any()
        apart.append(
            abs(as_rigid.centre - rigid.centre).max() / abs(rigid.centre).max()
        )
    assert apart[-1] < 1e-9
    assert apart[0] == pytest.approx(10 * apart[1], rel=0.2)


@pytest.mark.parametrize("own", [SOFT, RUBBED])
def test_what_nothing_else_takes_vanishes_with_the_time_step(own):
    """Rotation, wear and the tips' own work are found apart; no loss is left."""
    own = own | {"scheme": "general", "duration": 0.02}  # ends in flight
    losses = [march(time_step=dt, **own)[1].ledger for dt in (1e-6, 2.5e-7)]
    coarse, fine = (one["impact"] for one in losses)
    assert 0 < fine < 0.35 * coarse
    assert coarse < 0.02 * losses[0]["wear"]


@pytest.fixture(scope="module")
def one_blade(tmp_path_factory):
    """Return a function: slope of a tip's motion, radial over tangential -> an engine.

    One mode of 1200 rad/s and 1 kg, damped by 0.5 %; with a slope < 0 a tip that moves
    outward moves against the rotation, and friction pulls it further out.
    """
    folder = tmp_path_factory.mktemp("one_blade")

    def engine(slope):
        angle = math.atan(slope)
        return str(written(folder / f"{slope}.h5", {
            "omega": [1200.0], "damping_ratio": [0.005],
            "modal_tip_radial": [[math.sin(angle)]],
            "modal_tip_tangential": [[math.cos(angle)]],
        }))  # fmt: skip

    return engine


# a casing that becomes eccentric within the run, and so feeds a blade into its layer
FEEDING = {
    "duration": 2.0, "interval": 5e-3, "time_step": 5e-6, "scheme": "general",
    "gap": 1e-5, "friction": 0.6, "blades": 1, "engine.casing.kind": "rigid",
    "contact_law": "abradable", "layer_yield": 1e6,
    "engine.casing.profile": "harmonic,amplitude,phase;1,5e-5,0", "profile_rise": 2.0,
}  # fmt: skip


@pytest.mark.parametrize("speed", [290.0, 230.0, 190.0, 162.0])
def test_lobes_worn_are_the_blades_frequency_over_the_speed(one_blade, speed):
    _, told = march(**FEEDING, speed=speed, **{"engine.file": one_blade(-0.2)})
    sizes = np.abs(np.fft.rfft(told.layer[0]))
    assert 3 + sizes[3:].argmax() == round(1200 / speed)  # 1, 2: the casing's own
    assert told.ledger["friction"] > 0.1
    most = max(map(abs, told.ledger.values()))
    assert abs(told.ledger["residual"]) < 1e-10 * most


def test_without_friction_no_lobes_are_worn(one_blade):
    own = {"speed": 230.0, "engine.file": one_blade(-0.2)}
    rubbed, smooth = (
        np.abs(np.fft.rfft(march(**FEEDING | own | mu)[1].layer[0]))[3:].max()
        for mu in ({}, {"friction": 0.0})
    )
    assert rubbed > 5 * smooth > 0


def test_stribeck_friction_falls_from_that_at_rest():
    law = {"friction_law": "stribeck", "friction_at_rest": 0.3, "friction_speed": 40.0}
    scene = apply_settings(named_scene("table2"), law | {"friction": 0.1})
    sliding = scene.speed * scene.engine.rotor.radius
    falls = 0.1 + 0.2 * math.exp(-sliding / 40.0)
    assert friction_with_sign(scene) == pytest.approx(falls, rel=1e-15)
    own = {"duration": 2e-3, "scheme": "modal"}
    _, by_law = march(**own, **law)
    _, plain = march(**own, friction=friction_with_sign(scene))
    assert plain.contacts > 0
    assert np.array_equal(by_law.centre, plain.centre)


@pytest.mark.parametrize("lobes", [1, 2])
def test_stribeck_friction_of_one_sector_is_that_of_all(lobes):
    law = {"friction_law": "stribeck", "friction_at_rest": 0.3, "friction_speed": 200.0}
    own = {"duration": 4e-3, "scheme": "modal", "nodal_diameter": lobes, "gap": 2e-5}
    by_law, plain = (
        March(resolve(apply_settings(named_scene("table2"), own | given))).run()
        for given in (law, {"friction": 0.1 + 0.2 * math.exp(-205.0 / 200.0)})
    )
    assert (plain.folds, plain.contacts > 0) == (lobes, True)
    assert by_law.ledger == plain.ledger


def test_no_tip_passes_over_rods_in_a_step_at_any_speed():
    own = {"contact_law": "abradable", "layer_edge": 1e-3, "modes": 0, "speed": 400.0}
    case = resolve(apply_settings(Scene(), own | {"solver.accuracy": 0.1}))
    case.check()
    assert case.step == pytest.approx(0.9 * 1e-3 / (0.5 * 400.0), rel=1e-12)
    faster = {"acceleration": 5e3, "duration": 0.1, "time_step": 2.5e-6}
    with pytest.raises(
        InputError, match=r"^speed must be <= 800 rad/s with .* got 900"
    ):
        resolve(apply_settings(Scene(), own | faster)).check()


def test_lobes_are_the_strongest_harmonic_of_the_depth():
    angle = np.linspace(0, 2 * math.pi, 360, endpoint=False)
    depth = 1e-4 + 3e-5 * np.cos(5 * angle) + 1e-5 * np.cos(2 * angle)
    assert lobes_of(depth) == 5
    assert lobes_of(0 * depth) == 0


def test_numbers_of_wear_are_those_of_the_rods():
    made, told = march(scheme="general", **SOFT, **{"output.traces": "full"})
    numbers = wear_numbers(made.scene, told.layer)
    depth, work, turned = made.state.worn
    assert len(depth) == round(2 * math.pi * 0.5 * 4 / 4e-3)
    volume = depth.sum() * 0.05 * 2 * math.pi * 0.5 / len(depth)
    assert numbers["wear_volume"] == pytest.approx(volume, rel=1e-12)
    assert numbers["wear_depth"] == depth.max() > 0
    assert told.ledger["wear"] == pytest.approx(work.sum(), rel=1e-12)
    assert numbers["wear_turning"] == pytest.approx(turned.sum(), rel=1e-12)
    assert (np.diff(told.worn, axis=0) >= 0).all()
    assert np.array_equal(told.worn[-1], depth)
