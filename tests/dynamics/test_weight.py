"""The rotor's weight: its sag, the motion of the gap, and where it is refused."""

import json

import numpy as np
import pytest

from hpcwhirl.case.resolve import resolve
from hpcwhirl.case.unbalance import facts_of_weight, steady
from hpcwhirl.cli import main
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.steady import translation
from hpcwhirl.scene import apply_settings, named_scene
from hpcwhirl.scene.shaft_tables import text_of
from hpcwhirl.structure.shaft import line_of

SMALL = {
    "rotation": "full", "blades": 5, "modes": 10, "harmonics": 4, "gravity": 9.81,
    "time_step": 1e-6, "duration": 1e-3, "gap": 2e-4,
}  # fmt: skip


def case_of(**given):
    return resolve(apply_settings(named_scene("four_motions"), SMALL | given))


def mass_of(model):
    t = translation(model.rotor, model.blades)
    return float((t.conj() @ model.rotor.mass @ t).real) / 2


@pytest.mark.parametrize("speed", [300.0, -420.0])
@pytest.mark.parametrize("apart", [0.0, 1e7])
def test_springs_carry_the_weight_of_a_rotor_without_damping(speed, apart):
    """In each direction by their stiffness; blades that turn give and take nothing."""
    given = {"engine.rotor.damping": 0.0, "suspension_damping": 0.0}
    for angle, stiffness in ((-np.pi / 2, 3.4e7 - apart), (0.0, 3.4e7 + apart)):
        case = case_of(
            speed=speed, stiffness_difference=apart, gravity_angle=angle,
            **given, **{"rotor.centre_stiffness": 3.4e7},
        )  # fmt: skip
        told = facts_of_weight(case.model, case.scene)
        sag = mass_of(case.model) * 9.81 / stiffness
        assert told["sag"] == pytest.approx(sag, rel=1e-6)
        assert told["angle"] == pytest.approx(angle, abs=1e-9)
        assert told["change"] == pytest.approx(2 * sag, rel=0.05)


def test_a_shaft_s_bearings_carry_the_weight_of_shaft_and_disks():
    """Each its share, by the positions of the masses: a lever at rest."""
    line = {
        "sections": [{"length": 0.5, "outer": 0.1, "elements": 8}] * 2,
        "disks": [{"station": 2, "mass": 50.0}],
        "bearings": [{"station": i, "kxx": 5e7, "cxx": 1.0} for i in (0, 2)],
    }
    given = {
        "engine.rotor.damping": 0.0, "shaft_station": 1, "shaft_modes": 40,
        "shaft": text_of(line, "the shaft"),
    }  # fmt: skip
    model = (case := case_of(**given)).model
    bare = case_of(**{"engine.rotor.damping": 0.0}).model
    shaft = line_of(case.scene.engine.rotor.shaft).mass - 50.0
    sag = steady(model, case.scene).of(1).conj()
    for station, carried in zip(model.rotor.terms.stations, (0.0, 50.0), strict=True):
        x, y = station.rows @ sag
        load = 9.81 * (carried + (shaft + mass_of(bare)) / 2)
        assert abs(x + 1j * y) / 2 * 5e7 == pytest.approx(load, rel=1e-3)


def test_blades_that_turn_carry_their_own_damping_to_the_side():
    """Damping that rotates pushes a rotor in the sense of rotation: x > 0 by a sag."""
    case = case_of(**{"engine.rotor.damping": 0.02})
    assert facts_of_weight(case.model, case.scene)["angle"] > -np.pi / 2


def test_the_sag_is_steady_in_the_static_frame():
    case = case_of(speed=300.0)
    found, hub = steady(case.model, case.scene), 2 * case.model.blades
    z = [
        np.exp(1j * angle) * (found.at(angle)[hub : hub + 2] @ [1, 1j])
        for angle in np.linspace(0.0, 6.0, 7)
    ]
    assert np.ptp(z) == pytest.approx(0.0, abs=1e-12 * abs(z[0]))


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"rotation": "none"}, "gravity must be 0 where engine.rotation is none"),
        ({"centre": "clamped"}, "gravity must be 0 where engine.rotor.centre is cl"),
        ({"scheme": "paper"}, "gravity must be 0 with scheme paper"),
        (
            {"film_viscosity": 1e-4, "film_clearance": 1e-5},
            "would close the squeeze film",
        ),
        ({"gravity": 1e4}, "gravity must be < "),
    ],
)
def test_where_weight_is_refused_a_line_says_why(given, told):
    with pytest.raises(InputError, match=told) as failed:
        case_of(**given).check()
    assert "\n" not in str(failed.value)


def test_auto_rotation_takes_weight_for_a_reason():
    assert case_of(rotation="auto").reduced.engine.rotation == "full"
    assert case_of(scheme="exact").handed_over.startswith("the rotor's weight")


@pytest.mark.turns
def test_model_tells_the_sag_beside_the_gap(capsys):
    asked = [f"{name}={value}" for name, value in SMALL.items()]
    given = [part for text in asked for part in ("--set", text)]
    assert main(["model", "four_motions", *given]) == 0
    assert "weight moves the centre by 0.0" in capsys.readouterr().out
    assert main(["model", "four_motions", "--json", *given]) == 0
    told = json.loads(capsys.readouterr().out)["rotation"]["weight"]
    assert 0.0 < told["over_gap"] < 0.2
