"""Inputs with units: the numbers that SI gives, wherever a value may stand."""

import subprocess
import sys

import pytest
from synthetic import grid_of, synthetic

import hpcwhirl
from hpcwhirl.campaign.plan.design import Design
from hpcwhirl.cli import main
from hpcwhirl.errors import InputError
from hpcwhirl.scene import Scene, apply_settings, digest, parse_setting
from hpcwhirl.scene.documents import units_of_document
from hpcwhirl.scene.quantities import INPUTS
from hpcwhirl.scene.units import (
    in_si,
    measure,
    showing,
    shown_in,
    units_asked,
    written_in,
)

RPM = 0.10471975511965977  # rad/s


@pytest.mark.parametrize(
    ("text", "unit", "expected"),
    [
        ("0.8 mm", "m", 0.8e-3),
        ("0.8mm", "m", 0.8e-3),
        ("128 um", "m", 1.28e-4),
        ("3000 rpm", "rad/s", 3000 * RPM),
        ("50 Hz", "rad/s", 50 * 6.283185307179586),
        ("1 kHz", "rad/s", 6283.185307179586),
        ("30 kN", "N", 30e3),
        ("210 GPa", "Pa", 210e9),
        ("7.8 g/cm^3", "kg/m^3", 7800.0),
        ("34 kN/mm", "N/m", 3.4e7),
        ("0.63 ms", "s", 0.63e-3),
        ("5 %", "1", 0.05),
        ("-2e1 ms", "s", -0.02),
    ],
)
def test_a_number_with_a_unit_is_the_number_that_si_gives(text, unit, expected):
    assert in_si(text, unit) == expected


@pytest.mark.parametrize("decimals", range(1, 200, 33))
def test_a_decimal_prefix_changes_no_digit(decimals):
    assert in_si(f"0.{decimals} mm", "m") == float(f"0.{decimals}e-3")


def test_every_unit_of_an_input_is_known_to_the_library():
    for name, told in INPUTS.items():
        if told.unit != "1":
            assert in_si(f"2 {told.unit}", told.unit) == 2.0, name


def test_a_scene_with_units_is_the_scene_without():
    plain = Scene(speed=3000 * RPM, gap=0.8e-3, engine={"rotor": {"radius": 0.9}})
    told = Scene(speed="3000 rpm", gap="0.8 mm", engine={"rotor": {"radius": "900 mm"}})
    assert told == plain
    assert digest(told) == digest(plain)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("gap=0.8 kg", "gap must be in m or a unit of the same kind, got 'kg'"),
        ("gap=0.8 mmm", "unknown unit 'mmm'; did you mean 'mm'?"),
        ("rotor.radius=3 s", "engine.rotor.radius must be in m"),
        ("friction=0.1 m", "friction must be a number, got 'm'"),
        ("gap=-1 mm", "gap must be >= 0.0, got -0.001"),
        ("nodal_diameter=2 mm", "nodal_diameter must be a whole number"),
        ("pulse=1 days since 2000-01-01", "pulse must be in s"),
        ("pulse=1 lg(re 1 s)", "pulse must be in s"),
        ("gap=0.8 m^1.0", "gap must be in m"),
        ("gap=0.8 m/0", "gap must be in m"),
        ("gap=1 m^99999999999", "gap must be in m"),
    ],
)
def test_a_unit_of_another_kind_is_one_clear_line(text, told, capfd):
    with pytest.raises(InputError) as failed:
        apply_settings(Scene(), dict([parse_setting(text)]))
    assert capfd.readouterr().err == ""  # of UDUNITS
    assert told in str(failed.value)
    assert "\n" not in str(failed.value)


@pytest.mark.parametrize(
    ("with_units", "plain"),
    [
        (
            {"sweep": {"speed": ["1000 rpm", 200.0], "gap": ["0.1 mm", "0.2 mm"]}},
            {"sweep": {"speed": [1000 * RPM, 200.0], "gap": [1e-4, 2e-4]}},
        ),
        (
            {"sweep": {"gap": {"start": "0.1 mm", "stop": "0.3 mm", "step": "0.1 mm"}}},
            {"sweep": {"gap": [1e-4, 2e-4, 3e-4]}},
        ),
        (
            {"sweep": {"force": {"start": "1 kN", "stop": "3 kN", "num": 3}}},
            {"sweep": {"force": [1e3, 2e3, 3e3]}},
        ),
        (
            {
                "zip": {
                    "casing.thickness": ["30 mm", "40 mm"],
                    "casing.width": [1.0, 2.0],
                }
            },
            {"zip": {"casing.thickness": [0.03, 0.04], "casing.width": [1.0, 2.0]}},
        ),
        (
            {"cases": [{"gap": "0.1 mm"}, {"gap": 2e-4, "speed": "60 rpm"}]},
            {"cases": [{"gap": 1e-4}, {"gap": 2e-4, "speed": 60 * RPM}]},
        ),
    ],
)
def test_a_campaign_with_units_has_the_cases_of_one_without(with_units, plain):
    found, expected = Design.of(with_units), Design.of(plain)
    assert list(found.digests) == list(expected.digests)


def test_drawn_inputs_and_resolutions_take_units():
    law = {"distribution": "uniform", "low": "0.1 mm", "high": "0.3 mm"}
    told = {"sample": {"method": "sobol", "count": 4, "gap": law}}
    plain = {"sample": {"method": "sobol", "count": 4,
                        "gap": law | {"low": 1e-4, "high": 3e-4}}}  # fmt: skip
    assert list(Design.of(told).digests) == list(Design.of(plain).digests)
    sweep = {"speed": [100.0, 200.0], "gap": [1e-4, 4e-4]}
    finest = {"over": ["speed", "gap"], "scale": {"gap": "log"}}
    told = finest | {"resolution": {"speed": "200 rpm", "gap": "5 %"}}
    plain = finest | {"resolution": {"speed": 200 * RPM, "gap": 0.05}}
    found, expected = (Design.of({"sweep": sweep, "refine": r}) for r in (told, plain))
    assert found.most == expected.most


def test_a_range_of_two_units_is_refused():
    given = {"start": "1000 rpm", "stop": 500, "num": 3}
    with pytest.raises(InputError, match="must have one unit for all its numbers"):
        Design.of({"sweep": {"speed": given}})


@pytest.mark.turns
def test_a_case_is_chosen_by_a_value_with_a_unit(tmp_path, capsys):
    folder = synthetic(tmp_path / "out", grid_of(gap=[1e-4, 4e-4], speed=[60 * RPM]))
    assert main(["cases", str(folder), "--at", "gap=0.4 mm", "--csv"]) == 0
    assert len(capsys.readouterr().out.splitlines()) == 2
    assert main(["cases", str(folder), "--at", "speed=60rpm", "--csv"]) == 0
    assert main(["cases", str(folder), "--at", "gap=1 s"]) == 2
    assert "gap must be in m or a unit" in capsys.readouterr().err


@pytest.mark.turns
def test_plain_numbers_do_not_load_the_library():
    script = (
        "import sys, hpcwhirl; s = hpcwhirl.Scene(speed=300.0); "
        "print('cf_units' in sys.modules, s.speed); "
        "s = hpcwhirl.Scene(speed='300 rpm'); print('cf_units' in sys.modules)"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=True
    )
    assert done.stdout.split() == ["False", "300.0", "True"]


@pytest.mark.parametrize(
    "text", ["1e-4", "12", " 1.5E+3 ", ".5", "1.", "-7", "1 2", "1, 2", "1 2 mm"]
)
def test_a_number_alone_has_no_unit(text):
    assert measure(text) is None


def test_a_scene_keeps_numbers_alone():
    assert isinstance(hpcwhirl.Scene(gap="0.8 mm").gap, float)


def test_numbers_are_shown_in_the_first_unit_of_their_kind():
    """1/s is no angular speed, a number without a unit is none of %."""
    with showing(("rpm", "um", "practical")):
        assert shown_in("rad/s") == ("rpm", pytest.approx(1 / RPM))
        assert shown_in("m") == ("um", 1e6)
        assert shown_in("N") == ("kN", 1e-3)
        for unit in ("1/s", "1", "", "kg"):
            assert shown_in(unit) == (unit, 1.0)
    assert shown_in("rad/s") == ("rad/s", 1.0)
    assert shown_in("m") == ("mm", 1e3)
    with showing(("ms", "si")):
        assert shown_in("s") == ("ms", 1e3)
        assert shown_in("m") == ("m", 1.0)


@pytest.mark.parametrize(
    ("asked", "told"),
    [("mmm", "did you mean 'mm'"), ("kg", "'kg'"), ("mm,", "''"), ("%", "'%'")],
)
def test_a_unit_of_nothing_shown_is_refused(asked, told):
    with pytest.raises(ValueError, match=told):
        units_asked(asked, ("m", "rad/s", "N", "1"))


@pytest.mark.turns
def test_tables_are_practical_and_files_in_si_unless_asked(tmp_path, capsys):
    folder = synthetic(tmp_path / "out", grid_of(gap=[1e-4, 4e-4], speed=[60 * RPM]))

    def head(*words):
        assert main(["cases", str(folder), "--columns", "orbit_radius", *words]) == 0
        return capsys.readouterr().out

    assert "all 2 cases: speed = 6.28319 rad/s\n" in head()
    assert "0.4" in head().split()
    assert "mm" in head().split()
    assert head("--csv").startswith("case,gap [m],speed [rad/s],")
    mm = head("--csv", "--units", "rpm,mm").splitlines()
    assert mm[0].startswith("case,gap [mm],speed [rpm],")
    assert mm[2].startswith("1,0.4,60.0,")
    assert '"gap": "um"' in head("--json", "--units", "um")


@pytest.mark.parametrize(
    ("document", "units"),
    [
        ({"sweep": {"speed": {"start": "3000 rpm", "stop": 500.0}}}, ("rpm",)),
        ({"sweep": {"speed": ["60 Hz"]}, "scene": {"speed": "9 rpm"}}, ("Hz",)),
        ({"scene": {"gap": "128 um", "force": "3 N"}}, ("um", "N")),
        ({"cases": [{"gap": 1e-4}, {"gap": "5 mil"}]}, ("mil",)),
        ({"scene": {"pulse": "1 ms", "direction": "press"}}, ()),  # times stay in s
        ({"engine": {"rotor": {"radius": "0.9 m"}}, "scene": {"gap": 1e-4}}, ()),
        ({"scene": {"gap": "1 furlongg", "name": "3 words"}}, ()),
        ({"sample": {"gap": {"low": "0.1 mm"}}, "scene": {"friction": "5 %"}}, ("mm",)),
        ({"scene": 3, "sweep": [{"a": ["4 RPM"]}]}, ("RPM",)),
        ({"scene": {"acceleration": "9 rpm/s"}}, ("rpm/s",)),
    ],
)
def test_numbers_are_shown_in_the_units_of_the_file(document, units):
    assert units_of_document(document) == units
    with written_in(units):
        for unit in units:
            assert unit in {shown_in(si)[0] for si in ("rad/s", "m", "N", "rad/s^2")}
        assert shown_in("s") == ("s", 1.0)
        with showing(units_asked("si", ["m"])):
            assert shown_in("rad/s") == ("rad/s", 1.0)
        with showing(units_asked("cm", ["m"])):
            assert shown_in("m") == ("cm", 100.0)


@pytest.fixture(scope="module")
def in_rpm(tmp_path_factory):
    """Return a finished campaign of a file in rpm, and the file."""
    place = tmp_path_factory.mktemp("rpm")
    file = place / "rpm.toml"
    file.write_text(
        'scene = {duration = 2e-3, gap = "0.8 mm"}\nsolver = {time_step = 2e-6}\n'
        'output = {interval = 5e-5}\nsweep = {speed = ["3000 rpm", "4000 rpm"]}\n'
    )
    assert main(["campaign", str(file), "--out", str(place / "out")]) == 0
    return place / "out", file


@pytest.mark.turns
@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["cases", "OUT"], "rpm"),
        (["margin", "OUT"], "rpm"),
        (["run", "FILE", "--quiet"], "speed, rpm"),
        (["model", "FILE"], "(Eq. 13), rpm"),
        (["model", "FILE", "--explain"], "rpm"),
        (["model", "FILE", "--units", "rad/s"], "(Eq. 13), rad/s"),
        (["cases", "OUT", "--units", "Hz"], "Hz"),
    ],
)
def test_commands_show_the_units_of_the_file(in_rpm, words, told, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "200")
    places = {"OUT": str(in_rpm[0]), "FILE": str(in_rpm[1])}
    capsys.readouterr()
    assert main([places.get(word, word) for word in words]) == 0
    out = capsys.readouterr().out
    assert told in out
    assert ("rad/s" in out) == (told.endswith("rad/s"))


@pytest.mark.turns
def test_pictures_and_page_show_the_units_of_the_file(in_rpm, tmp_path):
    page = (in_rpm[0] / "report.html").read_text()
    assert '"rad/s": ["rpm", 9.5492' in page
    for name in ("map.svg",):
        assert "rpm" in (in_rpm[0] / name).read_text()
    assert main(["map", str(in_rpm[0]), "--out", str(tmp_path)]) == 0
    assert "rpm" in (tmp_path / "map.svg").read_text()


@pytest.mark.parametrize(
    ("text", "unit", "expected"),
    [
        ("3600 RPM", "rad/s", 120 * 3.141592653589793),
        ("4 oz in", "kg m", 0.0028803115495),
        ("20 cP", "Pa s", 0.02),
        ("100 rev", "1", 100.0),
        ("1 rev", "rad", 6.283185307179586),
        ("90 deg", "rad", 1.5707963267948966),
    ],
)
def test_units_as_people_write_them(text, unit, expected):
    assert in_si(text, unit) == pytest.approx(expected, rel=1e-14)


def test_an_angle_is_no_number_and_pounds_of_force_are_named():
    with pytest.raises(ValueError, match="must be a number, got 'deg'"):
        in_si("3 deg", "1")
    with pytest.raises(ValueError, match="pounds of force are lbf"):
        in_si("3 lb/in", "N/m")
