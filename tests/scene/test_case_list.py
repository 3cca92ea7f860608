"""Cases from a CSV file are those that [[cases]] would list."""

import csv

import pytest
from synthetic import grid_of, synthetic

from hpcwhirl.campaign.plan.design import design_of, load_design
from hpcwhirl.cli import main
from hpcwhirl.errors import InputError, MissingFileError
from hpcwhirl.scene import case_list
from hpcwhirl.scene.case_list import cases_in_file


def design(tmp_path, text, **more):
    (tmp_path / "cases.csv").write_text(text, encoding="utf-8")
    (tmp_path / "c.toml").write_text('cases = "cases.csv"\n[scene]\nfriction = 0.15\n')
    return load_design(tmp_path / "c.toml", more)


def rows(made):
    return [dict(row) for row in made.settings]


def test_a_table_with_units_is_the_list_in_si(tmp_path):
    text = "case,speed [rpm],gap [mm],friction,casing_thickness,nodal_diameter\n"
    text += "0,3000,0.128,,0.03,2\n\n1,4000,0.2,0.1,,1\n"
    listed = {
        "scene": {"friction": 0.15},
        "cases": [
            {"speed": "3000 rpm", "gap": "0.128 mm", "casing.thickness": 0.03,
             "nodal_diameter": 2},
            {"speed": "4000 rpm", "gap": 2e-4, "friction": 0.1, "nodal_diameter": 1},
        ],
    }  # fmt: skip
    made, want = design(tmp_path, text), design_of(listed)
    assert rows(made) == rows(want)
    assert [made.digest(i) for i in (0, 1)] == [want.digest(i) for i in (0, 1)]
    assert [scene.friction for scene in made.scenes] == [0.15, 0.1]


def test_semicolons_a_mark_of_order_and_lists_are_read(tmp_path):
    text = "\ufeffspeed [rad/s];mistuning\r\n300;" + str([0.01] * 22) + "\r\n310;\r\n"
    first, second = rows(design(tmp_path, text))
    assert first["speed"] == 300.0
    assert list(first["engine.rotor.mistuning"]) == [0.01] * 22
    assert second["speed"] == 310.0


@pytest.mark.parametrize(
    "text",
    [
        ",speed,gap\n0,300,1e-4\n1,310.5,1e-4\n",  # pandas
        "%eval_id interface speed gap\n1 NO_ID 300 1e-4\n2 NO_ID 310.5 1e-4\n",
        "speed\tgap [mm]\n300\t0,1\n310,5\t0,1\n",
        "# drawn by hand\n\nspeed;gap\n300;1e-4\n# and\n310,5;1e-4\n;\n",
    ],
    ids=["pandas", "Dakota", "tabs", "semicolons"],
)
def test_a_list_as_other_tools_write_it_is_the_list(tmp_path, text):
    assert rows(design(tmp_path, text)) == [
        {"speed": 300.0, "gap": 1e-4},
        {"speed": 310.5, "gap": 1e-4},
    ]


@pytest.mark.turns
def test_the_table_of_a_campaign_is_a_list_of_cases(tmp_path, capsys):
    place = synthetic(tmp_path / "out", grid_of(gap=[1e-4, 4e-4], speed=[300.0, 310.0]))
    for options in ([], ["--units", "mm,rpm"]):
        assert main(["cases", str(place), "--csv", *options]) == 0
        table = list(csv.reader(capsys.readouterr().out.splitlines()))
        text = "".join(",".join(line[:3]) + "\n" for line in table)
        found = [(row["gap"], row["speed"]) for row in rows(design(tmp_path, text))]
        assert found == [
            (pytest.approx(gap), pytest.approx(speed))
            for gap in (1e-4, 4e-4)
            for speed in (300.0, 310.0)
        ]


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("", "has no cases"),
        ("speed\n", "has no cases"),
        ("speedx\n300\n", "cases.csv: unknown scene input 'speedx'; did you mean"),
        ("speed,speed [rpm]\n1,2\n", "names speed twice"),
        ("speed [rpm\n1\n", "a column must be NAME or NAME \\[UNIT\\]"),
        ("gap,,speed\n1,2,3\n", "a column must be"),
        ("speed,gap\n300\n", "line 2: it must have 2 values as the head, got 1"),
        ("speed [mm]\n300\n", "line 2: speed must be in rad/s"),
        ("speed\n[3]\n", "line 2: speed takes one value"),
        ('speed\n"3\n', "line 2: "),
        ("speed\nfast\n", "speed"),
        ("gap\n-1\n", "gap must be >= 0"),
        ("speed\n300\n300\n", "have the same inputs"),
    ],
)
def test_what_is_wrong_is_told_in_a_line(tmp_path, text, told):
    with pytest.raises(InputError, match=told) as refused:
        design(tmp_path, text)
    assert "\n" not in str(refused.value)


def test_no_file_and_no_table_are_told(tmp_path):
    with pytest.raises(MissingFileError, match=r"cannot read .*never\.csv"):
        cases_in_file(tmp_path / "never.csv")
    with pytest.raises(InputError, match=r"must be tables of inputs, or cases ="):
        design_of({"cases": 3})


def test_a_list_that_takes_long_tells_how_far_it_is(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(case_list, "EVERY", 0.0)
    design(tmp_path, "speed\n300\n400\n")
    assert "cases.csv: 2 cases read" in capsys.readouterr().err
