"""`hpcwhirl.campaign` and `hpcwhirl.Design`: what the command does, from Python."""

import inspect
import json
import os
import pydoc
import signal
import subprocess
import sys
from dataclasses import dataclass
from functools import partial

import numpy as np
import pytest
from launch import ENVIRONMENT, LIMIT, MPIRUN, ROOT, records, root_variables

import hpcwhirl
from hpcwhirl.campaign.mark import differ, mark_of
from hpcwhirl.campaign.measure import measure_of
from hpcwhirl.cli import main
from hpcwhirl.errors import InputError

TABLES = {
    "scene": {"duration": 2e-3},
    "solver": {"time_step": 2e-6},
    "output": {"interval": 5e-5},
    "sweep": {"speed": np.array([300.0, 410.0])},
}
UNITS = {"widest": ("m", "widest the centre goes"), "samples": "1"}


def widest(case):
    return {"widest": abs(case.centre).max(), "samples": case.sizes["time"]}


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    out = tmp_path_factory.mktemp("python") / "out"
    with hpcwhirl.campaign(TABLES, out, measure=widest, variables=UNITS):
        return out


def test_it_is_shown_and_explained():
    assert {"campaign", "Design"} <= set(dir(hpcwhirl))
    told = pydoc.plain(pydoc.render_doc(hpcwhirl.campaign))
    assert "campaign(design" in told
    assert "measure : your own function of a case" in told
    assert {"design", "out", "measure"} <= set(
        inspect.signature(hpcwhirl.campaign).parameters
    )
    assert "numpy.linspace" in pydoc.plain(pydoc.render_doc(hpcwhirl.Design.of))


def test_it_gives_the_bits_of_the_command(finished, tmp_path):
    with hpcwhirl.campaign(TABLES, tmp_path / "out") as data:
        assert data.sizes["case"] == 2
    assert root_variables(tmp_path / "out") == root_variables(finished)


def test_a_design_is_one_from_tables_a_file_or_a_scene(tmp_path):
    tables = hpcwhirl.Design.of(TABLES, {"gap": np.float64(2e-4)})
    assert tables.base.gap == 2e-4
    path = tmp_path / "speeds.toml"
    path.write_text("scene = {duration = 2e-3}\nsweep = {speed = [300.0, 410.0]}")
    assert len(hpcwhirl.Design.of(path).scenes) == 2
    assert hpcwhirl.Design.of(str(path)).digests == hpcwhirl.Design.of(path).digests
    assert hpcwhirl.Design.of(hpcwhirl.Scene(gap=1e-4)).scenes[0].gap == 1e-4
    assert hpcwhirl.Design.of(tables) is tables
    assert hpcwhirl.Design.of().swept == ("speed", "friction")


def test_a_function_sees_the_case_that_the_results_have(measured):
    with hpcwhirl.open_results(measured) as data:
        for case in range(2):
            own = widest(data.isel(case=case))
            assert float(own["widest"]) == float(data.widest[case])
        assert data.widest.attrs == {
            "units": "m", "long_name": "widest the centre goes"
        }  # fmt: skip
        assert data.samples.to_numpy().tolist() == [data.sizes["time"]] * 2
        assert data.measure_message.to_numpy().tolist() == ["", ""]


def test_it_is_told_the_inputs_of_its_case(tmp_path):
    def inputs(case):
        assert case.regime.item() in {"damped", "undecided", "sustained", "divergent"}
        return {"told": case.attrs["speed"] - case.speed}

    with hpcwhirl.campaign(
        TABLES, tmp_path / "out", measure=inputs, variables={"told": "rad/s"}
    ) as data:
        assert data.measure_message.to_numpy().tolist() == ["", ""]
        assert data.told.to_numpy().tolist() == [0.0, 0.0]


def test_what_the_function_raises_is_a_reason_and_no_failed_case(
    finished, tmp_path, capsys
):
    def broken(case):
        if case.speed < 400:
            raise KeyError("tips")
        return {"one": 1.0}

    def mended(case):
        return {"one": float(case.speed)}

    out, told = tmp_path / "out", {"one": "1"}
    with hpcwhirl.campaign(TABLES, out, measure=broken, variables=told) as data:
        assert data.status.to_numpy().tolist() == ["ok", "ok"]
        assert data.measure_message.to_numpy().tolist() == ["KeyError: 'tips'", ""]
        np.testing.assert_equal(data.one.to_numpy(), [np.nan, 1.0])
    err = capsys.readouterr().err
    assert "case 0: measure gave no numbers: KeyError: 'tips'" in err
    assert "no numbers in 1 of 2 cases, first KeyError: 'tips'" in err
    added = {"one", "measure_message"}
    own, other = root_variables(out), root_variables(finished)
    assert {n: v for n, v in own.items() if n not in added} == other  # the same words
    with hpcwhirl.campaign(
        TABLES, out, measure=mended, variables=told, retry="failed"
    ) as data:
        assert data.one.to_numpy().tolist() == [300.0, 1.0]  # the good one is kept
    assert len(records(out)) == 3


@pytest.mark.parametrize(
    ("given", "why"),
    [
        ({"a": 1.0, "b": 2.0}, "must return the declared variables one, got a, b"),
        (3.0, "must return {name: number}, got 3.0"),
        ({"one": "many"}, "could not convert string to float: 'many'"),
        ({"one": np.ones(2)}, "only"),
    ],
)
def test_what_is_no_number_is_a_reason(given, why, tmp_path):
    one = {**TABLES, "sweep": {"speed": [410.0]}}
    told = {"one": "1"}
    with hpcwhirl.campaign(
        one, tmp_path / "out", measure=lambda _: given, variables=told
    ) as data:
        assert why in data.measure_message.item()
        assert np.isnan(data.one.item())


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        ({"measure": 3}, "measure must be a function of one case, got 3"),
        ({"measure": widest}, "variables must tell what measure gives"),
        ({"measure": widest, "variables": {"speed": "m"}}, "is a name of the results"),
        ({"measure": widest, "variables": {"a b": "m"}}, "letters, digits and _"),
        ({"measure": widest, "variables": {"a": 3}}, "variables must be a mapping"),
        ({"case_limt": 3}, "unknown option 'case_limt'; did you mean 'case_limit'?"),
        ({"case_limit": -1}, "case_limit must be a number of seconds > 0, got -1"),
        ({"fresh": "yes"}, "fresh must be True or False, got 'yes'"),
        ({"design": 3}, "design must be a Design, a TOML file"),
        ({"design": {"sweep": {"sped": [1, 2]}}}, "did you mean 'speed'?"),
        ({"design": {"scene": {"gap": -1.0}}}, "gap must be >= 0.0, got -1.0"),
    ],
)
def test_wrong_input_is_one_line_and_nothing_is_made(arguments, told, tmp_path):
    with pytest.raises(InputError) as failed:
        hpcwhirl.campaign(**{"design": TABLES, "out": tmp_path / "out", **arguments})
    assert told in str(failed.value)
    assert not (tmp_path / "out").exists()


def test_other_variables_than_it_was_begun_with_are_refused(measured, tmp_path, capsys):
    before = (measured / "campaign.json").read_bytes()
    with pytest.raises(InputError, match=r"was begun with measure = .*got None"):
        hpcwhirl.campaign(TABLES, measured)
    with pytest.raises(InputError, match=r"got .*'widest': \['mm'"):
        hpcwhirl.campaign(
            TABLES, measured, measure=widest, variables={**UNITS, "widest": "mm"}
        )
    path = tmp_path / "plain.toml"
    path.write_text("sweep = {speed = [300.0, 410.0]}")
    plain = {n: v for n, v in TABLES.items() if n != "sweep"}
    sets = [f"--set={n}={v}" for table in plain.values() for n, v in table.items()]
    assert main(["campaign", str(path), *sets, "--out", str(measured)]) == 2
    assert "was begun with measure" in capsys.readouterr().err
    assert (measured / "campaign.json").read_bytes() == before


def test_another_function_is_refused_and_its_numbers_are_not_taken(tmp_path, capsys):
    """In a notebook a function is changed and the cell is run again."""

    def measure(factor):
        return lambda case: {"one": factor * float(case.speed)}

    told = {"out": tmp_path / "out", "variables": {"one": "1"}}
    with hpcwhirl.campaign(TABLES, measure=measure(1.0), **told):
        pass
    with pytest.raises(InputError, match=r"numbers of another measure.*fresh=True"):
        hpcwhirl.campaign(TABLES, measure=measure(1000.0), **told)
    with hpcwhirl.campaign(TABLES, measure=measure(1.0), **told) as same:
        assert same.one.to_numpy().tolist() == [300.0, 410.0]
    again = {"measure": measure(1000.0), "fresh": True}
    with hpcwhirl.campaign(TABLES, **again, **told) as fresh:
        assert fresh.one.to_numpy().tolist() == [300e3, 410e3]
    assert "gave no numbers" not in capsys.readouterr().err


@dataclass
class Called:
    """What is called as a function."""

    scale: float

    def __call__(self, case):
        return {"one": self.scale * (case in {"a", "b"})}


SCALE, OFFSET = 2.0, np.arange(3.0)


def helped(case):
    return SCALE * case + OFFSET.sum()


def of_helper(case):
    return helped(case)


def test_a_mark_is_of_what_a_function_does(monkeypatch):
    def named(case, scale=1.0):  # a comment and another name count for nothing
        return {"one": scale * case}

    def renamed(case, scale=1.0):
        return {"one": scale * case}

    def scaled(case, scale=2.0):
        return {"one": scale * case}

    def other(case, scale=1.0):
        return {"one": scale + case}

    assert mark_of(named) == mark_of(renamed)
    others = [scaled, other, partial(named, scale=3.0), Called(1.0), Called(2.0)]
    marks = [mark_of(one) for one in (named, *others)]
    assert len(set(marks)) == len(marks)
    assert "" not in marks
    before = mark_of(of_helper)
    monkeypatch.setitem(globals(), "SCALE", 3.0)  # that the helper reads
    assert mark_of(of_helper) != before
    monkeypatch.setitem(globals(), "SCALE", 2.0)
    assert mark_of(of_helper) == before
    monkeypatch.setitem(globals(), "OFFSET", np.arange(4.0))
    assert mark_of(of_helper) != before
    assert not differ(before, "pypy39:0")  # of another interpreter: nothing is known
    assert mark_of(len) == ""


def test_a_stop_is_an_error_that_says_how_to_go_on(measured, tmp_path, monkeypatch):
    def stops(case):
        if os.environ.get("STOP_HERE"):
            os.kill(os.getpid(), signal.SIGTERM)
        return widest(case)

    told = {"out": tmp_path / "out", "variables": UNITS, "measure": stops}
    monkeypatch.setenv("STOP_HERE", "yes")
    with pytest.raises(hpcwhirl.StoppedError, match=r"TERM.*the same call continues"):
        hpcwhirl.campaign(TABLES, **told)
    assert len(records(tmp_path / "out")) == 1
    monkeypatch.delenv("STOP_HERE")
    with hpcwhirl.campaign(TABLES, **told):
        assert root_variables(tmp_path / "out") == root_variables(measured)


SCRIPT = """
import json, sys
import hpcwhirl
sys.path.insert(0, "tests")
from test_python import TABLES, UNITS, widest
with hpcwhirl.campaign(TABLES, sys.argv[1], measure=widest, variables=UNITS) as data:
    sys.stdout.write(json.dumps(data.widest.to_numpy().tolist()) + "\\n")
try:
    hpcwhirl.campaign(TABLES, sys.argv[1])
except ValueError as failed:
    sys.stdout.write(f"{failed}\\n")
"""


@pytest.mark.mpi
def test_a_script_of_two_ranks_gives_the_bits_of_one(measured, tmp_path):
    out, script = tmp_path / "out", tmp_path / "script.py"
    script.write_text(SCRIPT)
    done = subprocess.run(
        [*MPIRUN, "-n", "2", sys.executable, script, out],
        capture_output=True, text=True, timeout=LIMIT, check=True, env=ENVIRONMENT,
        cwd=ROOT,
    )  # fmt: skip
    assert root_variables(out) == root_variables(measured)
    lines = done.stdout.splitlines()
    with hpcwhirl.open_results(measured) as data:
        values = data.widest.to_numpy().tolist()
    assert [json.loads(line) for line in lines if line[0] == "["] == [values] * 2
    assert sum("was begun with measure" in line for line in lines) == 2


@pytest.mark.parametrize("name", ["word_share", "twins", "cells", "boundaries"])
def test_a_variable_may_not_have_a_name_of_the_results(name):
    with pytest.raises(InputError, match=f"{name} is a name of the results"):
        measure_of(dict, {name: "1"})
