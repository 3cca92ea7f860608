"""`hpcwhirl.campaign(..., ranks=n)`: ranks that the call starts itself."""

import json
import signal
import subprocess
import sys
import time
import types
from contextlib import suppress
from pathlib import Path

import pytest
from launch import ENVIRONMENT, LIMIT, root_variables

import hpcwhirl
from hpcwhirl.campaign import started_ranks
from hpcwhirl.campaign.call import FLAGS, OPTIONS
from hpcwhirl.errors import InputError
from hpcwhirl.scene.campaign_tables import Campaign

TABLES = {
    "scene": {"duration": 2e-3},
    "solver": {"time_step": 2e-6},
    "output": {"interval": 5e-5},
    "sweep": {"speed": [300.0, 410.0]},
}
SLOW = {"scene": {"duration": 5.0}, "solver": {"scheme": "paper"}} | {
    "sweep": {"speed": {"start": 300, "stop": 420, "step": 10}}
}


def of_a_module(case):
    return {"one": float(case.speed)}


class Holder:
    def method(self, case):
        return {"one": float(case.speed), "self": self}


def test_options_are_those_of_the_table_and_the_flags():
    own = Campaign.model_fields.keys() - {"out", "map", "report"}
    assert set(OPTIONS) == own | {*FLAGS, "ranks"}


@pytest.mark.mpi
@pytest.mark.slow
def test_ranks_give_the_bits_of_one_process(tmp_path, monkeypatch, capsys):
    (tmp_path / "mine_of_ranks.py").write_text(
        "def widest(case):\n    return {'widest': float(abs(case.centre).max())}\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    measure = __import__("mine_of_ranks").widest
    own = {"measure": measure, "variables": {"widest": "m"}}
    with hpcwhirl.campaign(TABLES, tmp_path / "one", **own) as data:
        one = data.widest.to_numpy().tolist()
    with hpcwhirl.campaign(TABLES, tmp_path / "two", ranks=2, **own) as data:
        assert data.widest.to_numpy().tolist() == one
    assert root_variables(tmp_path / "one") == root_variables(tmp_path / "two")
    assert "on 2 ranks" in capsys.readouterr().err


@pytest.mark.mpi
@pytest.mark.slow
@pytest.mark.parametrize("how", ["interrupted", "gone"])
def test_ranks_stop_with_their_caller(how, tmp_path):
    """At Ctrl-C finished cases are kept; without their caller ranks end, too."""
    code = f"import hpcwhirl\nhpcwhirl.campaign({SLOW}, 'out', ranks=2)\n"
    child = subprocess.Popen(
        [sys.executable, "-c", code], cwd=tmp_path, env=ENVIRONMENT,
        stderr=subprocess.PIPE, text=True,
    )  # fmt: skip
    running, deadline = tmp_path / "out/running", time.monotonic() + LIMIT
    while not (running.is_dir() and any(running.iterdir())):
        assert child.poll() is None, child.stderr.read()
        assert time.monotonic() < deadline
        time.sleep(0.1)
    child.send_signal(signal.SIGINT if how == "interrupted" else signal.SIGKILL)
    told = child.communicate(timeout=LIMIT)[1]
    if how == "interrupted":
        assert (
            "StoppedError: stopped early: signal INT; finished cases are safe" in told
        )
    while at_work_in(tmp_path):
        assert time.monotonic() < deadline
        time.sleep(0.1)


def at_work_in(place):
    """Return the numbers of the processes whose working directory is a place."""
    found = []
    for process in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):
            if (process / "cwd").readlink() == place:
                found.append(process.name)
    return found


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"ranks": 0}, "ranks must be a whole number from 1 to 4096, got 0"),
        ({"ranks": True}, "ranks must be a whole number"),
        ({"ranks": 2, "measure": lambda _: {}}, "that other ranks can import, got"),
        ({"ranks": 2, "measure": Holder().method}, "from mine import NAME"),
        ({"ranks": 2, "measure": len}, "that other ranks can import"),
        ({"rank": 2}, "unknown option 'rank'; did you mean 'ranks'?"),
    ],
)
def test_what_other_ranks_cannot_get_is_told_before_any_starts(options, told, tmp_path):
    variables = {"variables": {"one": "1"}} if "measure" in options else {}
    with pytest.raises(InputError, match=told) as failed:
        hpcwhirl.campaign(TABLES, tmp_path / "out", **options, **variables)
    assert "\n" not in str(failed.value)
    assert not (tmp_path / "out").exists()


def test_a_function_of_a_notebook_is_told_where_to_go():
    of_cell = types.FunctionType(of_a_module.__code__, {}, "f")
    of_cell.__module__ = "__main__"
    with pytest.raises(InputError, match=r"got __main__\.\w+: put it into a file"):
        started_ranks.named(of_cell)
    assert started_ranks.named(of_a_module) == [__name__, "of_a_module"]


def test_a_design_and_ranks_of_ranks_are_refused(tmp_path, monkeypatch):
    with pytest.raises(InputError, match="must be a TOML file, a mapping"):
        hpcwhirl.campaign(hpcwhirl.Design.of(TABLES), tmp_path / "o", ranks=2)
    monkeypatch.setenv("PMI_SIZE", "3")
    with pytest.raises(InputError, match="this process is one of 3 ranks: leave ranks"):
        hpcwhirl.campaign(TABLES, tmp_path / "o", ranks=2)


@pytest.mark.turns
def test_without_mpirun_one_process_computes_and_says_so(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(started_ranks, "mpirun", lambda: "")
    with hpcwhirl.campaign(TABLES, tmp_path / "out", ranks=2) as data:
        assert data.sizes["case"] == 2
    assert "there is no mpirun on the path" in capsys.readouterr().err


def test_a_scene_is_the_same_case_on_started_ranks():
    scene = hpcwhirl.Scene(speed=330.0, engine={"rotor": {"mistuning": [0.01] * 22}})
    call = types.SimpleNamespace(
        design=scene, out=None, function=None, variables=None, version=None, options={}
    )
    sent = json.loads(json.dumps(started_ranks._task(call)))["design"]
    own, other = hpcwhirl.Design.of(scene), hpcwhirl.Design.of(sent)
    assert list(own.digests) == list(other.digests)


def test_a_notebook_is_shown_a_bar(monkeypatch, capsys):
    drawn = []
    display = types.ModuleType("IPython.display")
    display.HTML = str
    display.display = lambda *_, **__: types.SimpleNamespace(update=drawn.append)
    shell = types.ModuleType("IPython")
    shell.get_ipython = lambda: types.SimpleNamespace(kernel=1)
    monkeypatch.setitem(sys.modules, "IPython", shell)
    monkeypatch.setitem(sys.modules, "IPython.display", display)
    show = started_ranks.progress_bar()
    show("hpcwhirl: 7 of 22 cases, 9507 cases/h, 1 s left\n")
    show("hpcwhirl: case 3: <failed>\n")
    assert 'value="7" max="22"' in drawn[0]
    assert "case 3: <failed>" in capsys.readouterr().out
    shell.get_ipython = types.SimpleNamespace
    assert started_ranks.progress_bar() is None


def test_what_ended_mpirun_is_told(tmp_path, monkeypatch):
    fake = tmp_path / "mpirun"
    fake.write_text("#!/bin/sh\necho there are not enough slots\nexit 3\n")
    fake.chmod(0o700)
    monkeypatch.setattr(started_ranks, "mpirun", lambda: str(fake))
    told = "mpirun ended with exit code 3 before the campaign: there are not enough"
    with pytest.raises(hpcwhirl.StoppedError, match=told):
        hpcwhirl.campaign(TABLES, tmp_path / "out", ranks=2)
