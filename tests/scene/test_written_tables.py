"""Tables as engineers have them: read as the same table, or refused in one line."""

import re
from pathlib import Path

import pytest

from hpcwhirl.campaign.plan.design import load_design
from hpcwhirl.errors import InputError
from hpcwhirl.scene.bearing_tables import bearing_table
from hpcwhirl.scene.case_list import listed_cases
from hpcwhirl.scene.kept_tables import profile_table, table_over_time

SHEETS = Path(__file__).with_name("tables")
RPM = 0.10471975511965977  # rad/s
BEARING = bearing_table(
    "frequency,kxx,kxy,kyx,kyy,cxx,cxy,cyx,cyy;"
    f"{1000 * RPM!r},2e7,2e5,-3e5,3e7,2e3,0,0,2e3;"
    f"{6000 * RPM!r},4e7,6e5,-5e5,4.5e7,1500.5,0,0,1500.5"
)
CASES = [
    {"speed": 3000 * RPM, "gap": 1e-4, "friction": 0.1},
    {"speed": 3100.5 * RPM, "gap": 1.5e-4, "friction": 0.2},
]
CONSTANT = bearing_table("frequency,kxx,kxy,kyx,kyy,cxx,cxy,cyx,cyy;"
                         "0,2e7,0,0,2e7,10,0,0,10")  # fmt: skip
SPEED = table_over_time(f"time,speed;0,{1000 * RPM!r};2.5,{6000 * RPM!r}", "speed")
GAP = table_over_time("time,gap;0,5e-4;2.5,1e-4", "gap")
PROFILE = profile_table("harmonic,amplitude,phase;2,1e-5,0.5;4,2e-6,0")
MEAN = "kyy = [3e7, 4.5e7]\nkxy = [2e5, 6e5]\nkyx = [-3e5, -5e5]\n"
ROSS_2 = f"""[BearingElement_a]
n = 0
frequency = [{1000 * RPM!r}, {6000 * RPM!r}]
kxx = [2e7, 4e7]
{MEAN}cxx = [2000.0, 1500.5]
tag = "left"
color = "#355d7a"
"""
ROSS_3 = f"""{{"BearingElement_0": {{"n": 0, "tag": "left", "n_link": null,
 "kxx": [2e7, 4e7], "kyy": [3e7, 4.5e7], "kxy": [2e5, 6e5], "kyx": [-3e5, -5e5],
 "cxx": [2000.0, 1500.5], "frequency": [{1000 * RPM!r}, {6000 * RPM!r}]}},
 "BearingElement_1": {{"n": 6, "tag": "right", "kxx": 1e7, "cxx": 1}}}}
"""
ROSS_31 = (
    ROSS_2.replace("frequency", "speed")
    + """interpolation = "pchip"
radial_clearance = 1e-4
mxx = [ 0.0, 0.0,]
kzz = [ 1.0, 1.0,]
scale_factor = 1
"""
)
WIDE = "kxx,kyy,kxy,kyx,cxx"
ROWS = "1000,2e7,3e7,2e5,-3e5,2e3\n6000,4e7,4.5e7,6e5,-5e5,1500.5\n"
IN_MM = "1000,20000,30000,200,-300,2000\n6000,40000,45000,600,-500,1500.5\n"
GERMAN = IN_MM.replace(",", ";").replace(".", ",")
UNITS = "speed [rpm],kxx [N/mm],kyy [N/mm],kxy [N/mm],kyx [N/mm],cxx [N s/m]\n"
LINE_OF_UNITS = f"speed,{WIDE}\nrpm,N/mm,N/mm,N/mm,N/mm,N*s/m\n"


def of(reader):
    return lambda path: reader(str(path))


def cases(path, **more):
    return [dict(row) for row in listed_cases({"file": str(path), **more})]


READ = {  # {name: (reader, table, file, content)}
    "csv": (of(bearing_table), BEARING, "b.csv", f"speed [rpm],{WIDE}\n{ROWS}"),
    "units": (of(bearing_table), BEARING, "b.csv", UNITS + IN_MM),
    "brackets": (of(bearing_table), BEARING, "b.csv",
                 UNITS.replace("[", "(").replace("]", ")") + IN_MM),
    "row of units": (of(bearing_table), BEARING, "b.csv", LINE_OF_UNITS + IN_MM),
    "units in brackets": (of(bearing_table), BEARING, "b.csv",
                          f"speed,{WIDE}\n[rpm],,,,,\n{ROWS}"),
    "column rpm": (of(bearing_table), BEARING, "b.csv", f"RPM,{WIDE}\n{ROWS}"),
    "capitals": (of(bearing_table), BEARING, "b.csv",
                 f"Speed [rpm],{WIDE.upper()}\n{ROWS}"),
    "semicolons": (of(bearing_table), BEARING, "b.csv",
                   UNITS.replace(",", ";") + GERMAN),
    "tabs": (of(bearing_table), BEARING, "b.txt",
             (UNITS + IN_MM).replace(",", "\t")),
    "blanks": (of(bearing_table), BEARING, "b.dat",
               f"speed [rpm],{WIDE}\n{ROWS}".replace(",", "   ")),
    "blanks before": (of(bearing_table), BEARING, "b.dat",
                      "".join(f"  {line}\n" for line in
                              f"frequency [rpm],{WIDE}\n{ROWS}".split("\n"))),
    "comments": (of(bearing_table), BEARING, "b.csv",
                 f"# of the maker\n\n% 2024\n{UNITS}# warm\n{IN_MM}\n\n"),
    "Windows": (of(bearing_table), BEARING, "b.csv",
                "\ufeff" + (UNITS + IN_MM).replace("\n", "\r\n")),
    "UTF-16": (of(bearing_table), BEARING, "b.txt",
               (UNITS + IN_MM).replace(",", "\t").encode("utf-16")),
    "empty columns": (of(bearing_table), BEARING, "b.csv",
                      (UNITS + IN_MM).replace("\n", ",,\n")),
    "pandas": (of(bearing_table), BEARING, "b.csv",
               "," + UNITS + "".join(f"{i},{line}\n" for i, line in
                                     enumerate(IN_MM.splitlines()))),
    "axial ones": (of(bearing_table), BEARING, "b.csv",
                   UNITS.replace("\n", ",kzz,czz\n") + IN_MM.replace("\n", ",1,2\n")),
    "xlsx": (of(bearing_table), BEARING, "bearing.xlsx", None),
    "xls": (of(bearing_table), BEARING, "bearing.xls", None),
    "ROSS 2": (of(bearing_table), BEARING, "b.toml", ROSS_2),
    "ROSS 2, one of two": (of(bearing_table), BEARING, "b.toml#left",
                           ROSS_2 + ROSS_2.replace("_a", "_b").replace("left", "x")),
    "ROSS 3.1": (of(bearing_table), BEARING, "b.toml", ROSS_31),
    "ROSS, JSON": (of(bearing_table), BEARING, "b.json#left", ROSS_3),
    "ROSS, JSON by its key": (of(bearing_table), BEARING, "b.json#BearingElement_0",
                              ROSS_3),
    "list in JSON": (of(bearing_table), CONSTANT, "b.json",
                     '[{"kind": "shaft"}, {"KXX": 2e7, "cxx": 10}]'),
    "one row": (of(bearing_table), CONSTANT, "b.csv", "kxx,cxx\n2e7,10\n"),
    "6 DoF": (of(bearing_table), CONSTANT, "b.toml",
              "[BearingElement6DoF_1]\nkxx = 2e7\ncxx = 10\nkzz = 3.0\n"),
    "speed": (lambda path: table_over_time(str(path), "speed"), SPEED, "s.csv",
              "time [s];speed [rpm]\n0;1000\n2,5;6000\n"),
    "speed, turned": (lambda path: table_over_time(str(path), "speed"), SPEED, "s.csv",
                      "Speed [rpm]\tTime [ms]\n1000\t0\n6000\t2500\n"),
    "gap": (lambda path: table_over_time(str(path), "gap"), GAP, "g.dat",
            "# closing\ntime gap\ns mm\n0 0.5\n2.5 0.1\n"),
    "profile": (of(profile_table), PROFILE, "p.csv",
                "phase [rad],harmonic,amplitude [um]\n0.5,2,10\n0,4,2\n"),
    "cases": (cases, CASES, "c.csv",
              "speed [rpm],gap [mm],friction\n3000,0.1,0.1\n3100.5,0.15,0.2\n"),
    "cases, row of units": (cases, CASES, "c.csv",
                            ("speed;gap;friction\nrpm;mm;\n3000;0,1;0,1\n"
                            "3100,5;0,15;0,2\n")),
    "cases, capitals": (cases, CASES, "c.txt",
                        ("Speed [rpm]\tGAP [mm]\tFriction\n3000\t0.1\t0.1\n"
                        "3100.5\t0.15\t0.2\n")),
    "cases of pandas": (cases, CASES, "c.csv",
                        (",speed [rpm],gap,friction\n0,3000,1e-4,0.1\n"
                        "1,3100.5,1.5e-4,0.2\n")),
    "cases of to_string": (cases, CASES, "c.txt",
                           ("   speed [rpm]  gap  friction\n0  3000.0  0.00010  0.1\n"
                           "1  3100.5  0.00015  0.2\n")),
    "cases of R": (cases, CASES, "c.txt",
                   ('"rpm" "gap" "friction"\n"1" 3000 1e-4 0.1\n'
                   '"2" 3100.5 1.5e-4 0.2\n')),
    "Dakota, annotated": (
        lambda path: cases(path, skip=["response_fn_1"]), CASES, "c.dat",
        ("%eval_id interface rpm gap friction response_fn_1\n"
        "1 NO_ID 3000 1e-4 0.1 0.7\n2 NO_ID 3100.5 1.5e-4 0.2 -3e-5\n")),
    "Dakota, free": (
        lambda path: cases(path, columns=["rpm", "gap [mm]", "friction", "-"]), CASES,
        "c.dat", "3000 0.1 0.1 0.7\n3100.5 0.15 0.2 -3e-5\n"),
    "cases in units of cells": (cases, CASES, "c.csv",
                                ("speed,gap,friction\n3000 rpm,0.1 mm,0.1\n"
                                "3100.5 rpm,0.15 mm,0.2\n")),
}  # fmt: skip

REFUSED = {  # {name: (reader, file, content, what is told)}
    "no head": (of(bearing_table), "b.csv", ROWS, "line 1: it must name the columns"),
    "US units": (of(bearing_table), "b.csv", "speed [rpm],kxx [lb/in],cxx\n1,2,3\n",
                 "line 2, column kxx: its unit .*pounds of force are lbf"),
    "title": (of(bearing_table), "b.csv", f"Bearing A\n{UNITS}{IN_MM}",
              "line 3: it must have 2 values as the head, got 1"),
    "no number": (of(bearing_table), "b.csv", f"{UNITS}1000,n/a,1,1,1,1\n",
                  "line 2, column kxx: it must be a number, got 'n/a'"),
    "whirl": (of(bearing_table), "b.csv", "speed,frequency,kxx,cxx\n1,1,2,3\n",
              "over the frequency of the whirl are modelled of bearings of a shaft"),
    "two in JSON": (of(bearing_table), "b.json", ROSS_3, "got 2: name one, as file"),
    "no JSON": (of(bearing_table), "b.json", "{", "it is no JSON"),
    "no tag": (of(bearing_table), "b.json#lefd", ROSS_3, "did you mean 'left'"),
    "Dakota, responses": (cases, "c.dat", "%eval_id speed drag\n1 300 0.7\n",
                          r"'drag'.*leave a column out: .*skip = \['drag'\]"),
    "free": (cases, "c.dat", "300 0.7\n310 0.8\n", "line 1: it must name the columns"),
    "skipped": (lambda path: cases(path, skip=["drg"]), "c.csv", "speed\n3\n",
                "has no column 'drg', which skip names"),
    "columns": (lambda path: cases(path, columns=["speed"]), "c.csv", "3 4\n",
                "line 1: it must have 1 values"),
    "key": (lambda path: cases(path, skips=["x"]), "c.csv", "speed\n3\n",
            "unknown key in cases 'skips'; did you mean 'skip'"),
}  # fmt: skip


def written(tmp_path, name, content):
    """Write a file, unless it is a stored one; return its name, with a tag."""
    if content is None:
        pytest.importorskip("python_calamine", reason="needs the extra sheets")
        return SHEETS / name
    file = tmp_path / name.partition("#")[0]
    file.write_bytes(content if isinstance(content, bytes) else content.encode())
    return tmp_path / name


@pytest.mark.parametrize("name", READ)
def test_a_table_as_people_have_it_is_the_table(name, tmp_path):
    reader, want, file, content = READ[name]
    found = reader(written(tmp_path, file, content))
    if isinstance(want, str):
        assert found.partition(";")[0] == want.partition(";")[0]
        numbers = [re.split("[;,]", one.partition(";")[2]) for one in (found, want)]
        found, want = (list(map(float, one)) for one in numbers)
        assert found == pytest.approx(want, rel=1e-14)
    else:
        assert found == [pytest.approx(row, rel=1e-14) for row in want]


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_not_understood_is_refused_in_one_line(name, tmp_path):
    reader, file, content, told = REFUSED[name]
    with pytest.raises((ValueError, InputError), match=told) as refused:
        reader(written(tmp_path, file, content))
    assert "\n" not in str(refused.value)


def test_forty_tables_are_tried():
    assert len(READ) + len(REFUSED) >= 40


def test_one_list_in_several_spellings_has_the_same_digests(tmp_path):
    """And is planned alike, whatever the length of the parts that are read."""
    texts = [
        "speed [rpm],gap [mm]\n3000,0.1\n3100.5,0.1\n",
        "gap [mm];Speed [rpm]\n0,1;3000\n0,10;3100,5\n",
        "%eval_id interface speed gap\n1 A 3000rpm 0.1mm\n2 A 3100.5rpm 1e-4\n",
    ]
    digests = []
    for number, text in enumerate(texts):
        (tmp_path / f"{number}.csv").write_text(text)
        (tmp_path / f"{number}.toml").write_text(f'cases = "{number}.csv"\n')
        design = load_design(tmp_path / f"{number}.toml", {})
        digests.append(list(design.digests))
    assert digests[0] == digests[1] == digests[2]


@pytest.mark.parametrize("at_once", [1, 2, 3, 1000])
def test_a_list_read_in_parts_is_the_list(at_once, tmp_path, monkeypatch):
    text = "speed,gap,scheme\n300,1e-4,\n310,,exact\n320,,exact\n330,2e-4,\n,,\n"
    monkeypatch.setattr("hpcwhirl.scene.columns.AT_ONCE", at_once)
    (tmp_path / "c.csv").write_text(text)
    table = listed_cases(str(tmp_path / "c.csv"))
    names = [block[0].names for block in table.blocks]
    assert names == [
        ("speed", "gap"),
        ("speed", "solver.scheme"),
        ("speed", "gap"),
    ]
    assert [row["speed"] for row in table] == [300.0, 310.0, 320.0, 330.0]


def test_a_spreadsheet_of_cases_is_a_campaign(tmp_path):
    pytest.importorskip("python_calamine", reason="needs the extra sheets")
    (tmp_path / "c.toml").write_text(f'cases = "{SHEETS / "cases.xlsx"}"\n')
    rows = [dict(row) for row in load_design(tmp_path / "c.toml", {}).settings]
    assert rows == [
        {"speed": pytest.approx(3000 * RPM), "gap": 1e-4, "solver.scheme": "exact"},
        {"speed": pytest.approx(3100.5 * RPM), "gap": 1e-4, "solver.scheme": "modal"},
    ]
