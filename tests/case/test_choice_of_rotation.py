"""Rotation `auto`: all terms or none by what they change, told, and in every row."""

import json

import numpy as np
import pytest

from hpcwhirl import campaign, open_results, simulate
from hpcwhirl.case.resolve import resolve
from hpcwhirl.case.rotation_choice import FREE, LEFT_OUT, change_of, choice_of
from hpcwhirl.cli import main
from hpcwhirl.errors import InputError
from hpcwhirl.scene import Scene, apply_settings

SMALL = {
    "rotation": "auto", "blades": 6, "engine.rotor.elements": 4, "modes": 24,
    "harmonics": 4, "time_step": 2e-6, "duration": 0.02, "gap": 5e-5,
    "centre": "clamped",
}  # fmt: skip
BEARING = (
    "frequency,kxx,kxy,kyx,kyy,cxx,cxy,cyx,cyy;0.0,1.0,0.0,0.0,1.0,1.0,0.0,0.0,1.0"
)
LOW, HIGH = 10.0, 300.0  # rad/s, where the terms of two lobes hardly matter, or do


def scene(**settings):
    return apply_settings(Scene(), SMALL | settings)


def change(**settings):
    return change_of(scene(**settings))


@pytest.mark.parametrize("rotation", ["auto", "full"])
def test_the_damping_of_a_suspension_is_nothing_to_a_held_centre(rotation):
    damped = {"rotation": rotation, "rotor.damping": 0.1, "speed": HIGH}
    one, two = (
        simulate(scene(**damped, suspension_damping=own)).row for own in (-1.0, 0.03)
    )
    assert one["late_energy"] > 0.0
    assert two == one
    with pytest.raises(InputError, match="suspension_damping must be >= damping"):
        scene(**damped, centre="free", suspension_damping=0.03)


@pytest.mark.parametrize("speed", [2.0, 10.0, 40.0])
def test_rigid_blades_on_springs_change_by_the_speed(speed):
    """Their static lines are +-omega_s at any speed, so omega_s +- Omega rotate."""
    stiff = {
        "centre": "free",
        "engine.rotor.young": 1e16,
        "engine.rotor.damping": 0.0,
        "suspension_damping": 0.0,
    }
    found = change(speed=speed, **stiff)
    assert found.wave == "suspension of k = 1"
    assert found.share == pytest.approx(speed / abs(found.none), rel=1e-3)


def test_a_held_centre_leaves_what_stiffens_with_the_square_of_the_speed():
    speeds = np.array([40.0, 60.0, 80.0])
    shares = [change(speed=s).share for s in speeds]
    assert shares == pytest.approx(shares[0] * (speeds / speeds[0]) ** 2, rel=0.05)
    assert change(speed=40.0).wave.startswith("1F")
    assert change(speed=40.0, centre="free").share > 5 * shares[0]


@pytest.mark.parametrize("lobes", [0, 1, 2])
def test_a_free_centre_needs_all_terms_at_any_speed(lobes):
    choice = choice_of(scene(speed=0.5, centre="free", nodal_diameter=lobes))
    assert (choice.rotation, choice.needed) == ("full", FREE)


def test_sectors_that_hardly_differ_change_as_equal_ones():
    for more in ({}, {"centre": "free"}):
        equal = change(speed=40.0, **more)
        uneven = change(speed=40.0, mistuning=[1e-9, 0, 0, 0, 0, 0], **more)
        assert uneven.share == pytest.approx(equal.share, rel=0.02)


@pytest.mark.parametrize("chosen", ["none", "full"])
def test_a_case_is_that_of_the_rotation_chosen_to_every_bit(chosen):
    speed = LOW if chosen == "none" else HIGH
    given = scene(speed=speed, nodal_diameter=2, force=2e5)
    assert choice_of(given).rotation == chosen
    auto = simulate(given).row
    assert auto["contacts"] > 0
    assert auto == simulate(apply_settings(given, {"rotation": chosen})).row
    assert (auto["tip_growth"] > 0.0) == (chosen == "full")


def test_the_limit_is_that_of_accuracy_where_that_is_less():
    given = {"speed": LOW, "nodal_diameter": 2}
    share = change(**given).share
    assert share < LEFT_OUT
    for accuracy, limit in ((0.0, LEFT_OUT), (0.03, LEFT_OUT), (share / 2, share / 2)):
        choice = choice_of(scene(accuracy=accuracy, **given))
        assert choice.limit == limit
        assert choice.rotation == ("none" if share <= limit else "full")


@pytest.mark.parametrize(
    "needing",
    [
        {"unbalance": 1e-5}, {"gap_at": "rest"}, {"cross_coupling": 1.0},
        {"film_viscosity": 1e-3},
        {"stiffness_difference": 1e5}, {"damping_difference": 1e-3},
        {"shaft": "cantilever"}, {"lost_blade": 2},
        {"bearing": BEARING},
    ],
    ids=lambda row: next(iter(row)),
)  # fmt: skip
def test_what_needs_all_terms_gets_them(needing):
    name = next(iter(needing))
    given = scene(speed=1.0, centre="free", **needing)
    choice = choice_of(given)
    assert (choice.rotation, choice.needed, choice.change) == ("full", name, None)
    assert choice.told == f"rotation auto: full, which {name} needs"
    assert resolve(given).reduced.engine.rotation == "full"
    assert resolve(given).model.rotor.spin is not None


@pytest.mark.turns
def test_a_sweep_chooses_case_by_case(tmp_path):
    document = {
        "scene": {"duration": 0.005, "nodal_diameter": 2},
        "engine": {
            "rotation": "auto",
            "rotor": {"blades": 6, "elements": 4, "centre": "clamped"},
            "casing": {"harmonics": 4},
        },
        "solver": {"modes": 24, "time_step": 2e-6},
        "sweep": {"speed": [LOW, HIGH]},
    }
    campaign(document, tmp_path / "out")
    grown = open_results(tmp_path / "out")["tip_growth"].values
    assert grown[0] == 0.0
    assert grown[1] == resolve(scene(speed=HIGH, rotation="full")).growth > 0.0


def test_a_file_without_the_terms_has_no_choice(tmp_path):
    path = tmp_path / "rotor.h5"
    words = [x for n, v in SMALL.items() for x in ("--set", f"{n}={v}")]
    words += ["--set", "rotation=none"]
    assert main(["export-model", str(path), *words]) == 0
    with pytest.raises(InputError, match="must be none, got full or auto") as failed:
        resolve(scene(file=str(path))).check()
    assert "\n" not in str(failed.value)


@pytest.mark.turns
def test_model_tells_the_choice_and_its_numbers(capsys):
    words = [x for n, v in SMALL.items() for x in ("--set", f"{n}={v}")]
    for speed, chosen in ((LOW, "none"), (HIGH, "full")):
        own = [*words, "--set", f"speed={speed}", "--set", "nodal_diameter=2"]
        assert main(["model", "--explain", *own]) == 0
        choice = choice_of(scene(speed=speed, nodal_diameter=2))
        assert choice.told in capsys.readouterr().out
        assert choice.told.startswith(f"rotation auto: {chosen}; its terms change")
        assert main(["model", "--json", *own]) == 0
        facts = json.loads(capsys.readouterr().out)["rotation"]
        assert facts["kind"] == facts["auto"]["rotation"] == chosen
        assert facts["auto"]["change"]["share"] == choice.change.share
    assert main(["model", "--json", *words, "--set", "rotation=none"]) == 0
    assert json.loads(capsys.readouterr().out)["rotation"]["auto"] is None
