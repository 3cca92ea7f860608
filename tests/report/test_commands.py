"""Commands on the page give the case that they stand beside."""

import shlex

import made_up
import pytest

from hpcwhirl.cli.options import scene_of
from hpcwhirl.report.page.commands import commands_of, file_of, setting
from hpcwhirl.report.page.run_ups import run_ups_of
from hpcwhirl.scene import digest
from hpcwhirl.scene.documents import parsed_toml
from hpcwhirl.scene.units import showing
from hpcwhirl.store.reading.results_file import Results

TEXT = """
[scene]
duration = 0.5
[engine.rotor]
blades = 9
[output]
traces = "full"
[sweep]
speed = ["3000 rpm", "3333.3 rpm"]
gap = ["0.1 mm", 0.00023]
"""


@pytest.fixture
def made(tmp_path):
    """Return results of a campaign from a file, and the file."""
    file = tmp_path / "my whirl.toml"
    file.write_text(TEXT)
    results = Results(made_up.campaign(tmp_path / "out", parsed_toml(TEXT)))
    results.attrs["command"] = f"hpcwhirl campaign {shlex.quote(str(file))} --out out"
    return results, file


def scenes(results, start):
    """Return the digest of each case as its command gives it."""
    for case in range(len(results)):
        own = [setting(n, v) for n, v in results.settings(case).items()
               if n in results.plan.swept]  # fmt: skip
        words = shlex.split(" ".join([start, *own]))
        assert words[:2] == ["hpcwhirl", "run"]
        named = [w for w in words[2:] if w.endswith(".toml")]
        given = words[3 + len(named) :: 2]
        yield digest(scene_of((named or ["table2"])[0], given))


@pytest.mark.turns
@pytest.mark.parametrize("units", [("si",), ("rpm", "mm"), ("rpm", "um")])
def test_the_file_and_what_is_swept_give_the_case(made, units):
    results, file = made
    with showing(units):
        told = commands_of(results)
        assert told["file"] == f"hpcwhirl run {shlex.quote(str(file))}"
        assert list(scenes(results, told["file"])) == results.plan.digests
        if units != ("si",):
            assert setting("speed", results.plan.settings[0]["speed"]) == (
                "--set 'speed=3000 rpm'"
            )


def test_a_file_that_has_changed_gives_the_case_by_what_differs(made):
    results, file = made
    file.write_text(TEXT.replace("0.5", "0.4").replace("full", "summary"))
    told = commands_of(results)["file"]
    assert "--set duration=0.5" in told
    assert list(scenes(results, told)) == results.plan.digests


ANOTHER = """[engine.rotor]
modulus = 1e11
density = 4e3
radius = 0.4
blade_width = 0.1
root_thickness = 0.02
taper = 0.5
"""


@pytest.mark.turns
@pytest.mark.parametrize(
    "change",
    [lambda f: f.unlink(), lambda f: f.write_text("["),
     lambda f: f.write_text(ANOTHER)],
)  # fmt: skip
def test_a_file_that_is_gone_or_another_is_not_named(made, change):
    results, file = made
    change(file)
    assert commands_of(results)["file"] == ""


@pytest.mark.parametrize(
    ("command", "file"),
    [("hpcwhirl campaign a.toml --out b", "a.toml"), ("python x.py", None),
     ("hpcwhirl campaign --out b 'c d.toml'", "c d.toml"), ("hpcwhirl 'campaign", None),
     ("", None)],
)  # fmt: skip
def test_the_file_of_a_command_line(command, file):
    found = file_of(command)
    assert (found and str(found)) == file


def test_constant_speeds_are_no_run_ups(made):
    assert run_ups_of(made[0]) == {}
