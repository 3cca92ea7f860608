"""The gap at rest, of which the growth of the tips leaves the clearance at speed."""

import json

import numpy as np
import pytest

from hpcwhirl import campaign, open_results, simulate
from hpcwhirl.case.resolve import resolve
from hpcwhirl.cli import main
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.waves import tip_growth
from hpcwhirl.scene import Scene, apply_settings, digest

SMALL = {
    "rotation": "full", "blades": 5, "engine.rotor.elements": 2, "modes": 10,
    "harmonics": 4, "time_step": 2e-6, "duration": 0.01, "speed": 420.0,
}  # fmt: skip
WALL = {"kind": "rigid", "amplitude": 3e-4, "growth": 20.0}


def scene(**settings):
    return apply_settings(Scene(), SMALL | settings)


def test_a_gap_at_rest_is_the_gap_at_speed_and_the_growth():
    """To every bit beside a rigid casing, which has no radius of its own."""
    rest = simulate(scene(gap=4e-4, gap_at="rest", **WALL)).row
    model = resolve(scene()).model
    grown = tip_growth(model.rotor, 5, 420.0).max()
    assert rest["tip_growth"] == grown > 0.0
    assert rest["gap"] == 4e-4
    speed = simulate(scene(gap=4e-4 - grown, **WALL)).row
    assert speed["contacts"] > 0
    assert speed["tip_growth"] == grown
    assert speed | {"gap": 4e-4} == rest


def test_a_ring_keeps_its_radius_at_rest():
    case = resolve(scene(gap=4e-4, gap_at="rest"))
    assert case.model is resolve(scene(gap=4e-4)).model
    assert case.scene.gap == case.clearance == 4e-4 - case.growth
    assert case.given.gap == 4e-4


def test_without_rotation_tips_do_not_grow():
    given = {"rotation": "none", **WALL}
    assert simulate(scene(**given)).row["tip_growth"] == 0.0


def test_cases_from_before_keep_their_digest():
    assert digest(scene(gap_at="speed")) == digest(scene())
    assert digest(scene(gap_at="rest")) != digest(scene())


@pytest.mark.turns
def test_a_sweep_has_cases_whose_tips_grow_into_the_casing(tmp_path):
    """They fail, told in one line; the others run."""
    grown = resolve(scene()).growth
    gaps = [0.5 * grown, 2.0 * grown]
    document = {
        "scene": {"duration": 0.01, "speed": 420.0, "gap_at": "rest"},
        "engine": {
            "rotation": "full",
            "rotor": {"blades": 5, "elements": 2},
            "casing": {"harmonics": 4},
        },
        "solver": {"modes": 10, "time_step": 2e-6},
        "sweep": {"gap": gaps},
    }
    campaign(document, tmp_path / "out")
    data = open_results(tmp_path / "out")
    told = [str(message) for message in data["message"].values.astype(str)]
    assert "gap must be >" in told[0]
    assert "growth of the tips" in told[0]
    assert told[1] == ""
    assert data["tip_growth"].values[1] == grown
    assert np.isnan(data["tip_growth"].values[0])


def test_values_of_a_sweep_are_checked_with_the_rotation(tmp_path):
    document = {"sweep": {"gap_at": ["speed", "rest"]}}
    with pytest.raises(InputError, match="gap_at must be speed where"):
        campaign(document, tmp_path / "out")


@pytest.mark.turns
def test_model_tells_the_clearance_at_speed(capsys):
    words = [x for n, v in SMALL.items() for x in ("--set", f"{n}={v}")]
    assert main(["model", "--json", *words, "--set", "gap_at=rest", "--set",
                 "gap=4e-4"]) == 0  # fmt: skip
    facts = json.loads(capsys.readouterr().out)["rotation"]
    assert facts["clearance"] == pytest.approx(4e-4 - facts["tip_growth"])
    assert main(["model", *words]) == 0
    assert "clearance at speed 0.128 mm" in capsys.readouterr().out
