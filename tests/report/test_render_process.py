"""The map in a process of its own: what it spares a rank, and how its end is told."""

import os
import shutil
import signal
import subprocess
import sys
from types import SimpleNamespace

import h5py
import pytest
from launch import python

from hpcwhirl.cli import main
from hpcwhirl.errors import InputError, MissingFileError, NoRoomError, StoreError
from hpcwhirl.launch import interpreter
from hpcwhirl.report import render_process

pytestmark = pytest.mark.turns

HEAVY = ("xarray", "pandas", "matplotlib")
CAMPAIGN = """
import os, signal, sys
from hpcwhirl.cli import main
from hpcwhirl.report import render_process
{before}
for file, out in {campaigns!r}:
    code = main(["campaign", file, "--out", out, "--report", "yes"])
    print("loaded:", [name for name in {heavy} if name in sys.modules])
    if code:
        sys.exit(code)
"""
DIES = "import os, signal; os.kill(os.getpid(), signal.SIGKILL)"


def begun(*campaigns, before=""):
    """Return a fresh process that has ended campaigns, and tells what each loaded.

    campaigns : (file, directory) of each
    """
    pairs = [(str(file), str(out)) for file, out in campaigns]
    return python(CAMPAIGN.format(campaigns=pairs, before=before, heavy=HEAVY))


@pytest.fixture
def undrawn(finished, tmp_path):
    """Return the directory of a finished campaign without its map."""
    folder = shutil.copytree(finished, tmp_path / "out")
    for name in ("map.png", "map.svg"):
        (folder / name).unlink()
    return folder


@pytest.fixture
def as_rank(monkeypatch):
    """Let this process be one that has not loaded what a map needs."""
    bare = {n: m for n, m in sys.modules.items() if n not in HEAVY}
    monkeypatch.setattr(render_process, "sys", SimpleNamespace(modules=bare))


@pytest.mark.slow
def test_a_campaign_loads_nothing_that_only_maps_need(finished, tmp_path):
    """Neither a plain one nor, after it in the same process, a refined one."""
    plain = finished.parent / "short.toml"
    refined = tmp_path / "refined.toml"
    refined.write_text(
        f'{plain.read_text()}\nrefine = {{over = ["speed"], levels = 1}}'
    )
    campaigns = [(file, tmp_path / file.stem) for file in (plain, refined)]
    done = begun(*campaigns)
    assert done.returncode == 0, done.stderr
    names = ("results.h5", "map.png", "map.svg", "report.html")
    wanted = [str(out / name) for _, out in campaigns for name in names]
    told = done.stdout.splitlines()
    assert told.count("loaded: []") == 2
    assert [line for line in told if line in wanted] == wanted
    assert all((out / name).stat().st_size for _, out in campaigns for name in names)


@pytest.mark.usefixtures("as_rank")
def test_a_map_drawn_apart_is_the_map(undrawn, finished):
    paths = render_process.draw_in_process(undrawn / "results.h5", undrawn)
    assert paths == [undrawn / "map.png", undrawn / "map.svg"]
    assert paths[0].read_bytes() == (finished / "map.png").read_bytes()
    with h5py.File(undrawn / "results.h5", "r+") as file:
        file.attrs["units"] = "rpm"  # of the campaign's file
    _, vectors = render_process.draw_in_process(undrawn / "results.h5", undrawn)
    assert "rpm" in vectors.read_text("utf-8")


def test_a_process_that_has_what_a_map_needs_draws_itself(undrawn, monkeypatch):
    monkeypatch.setattr(
        render_process, "interpreter", lambda *_: pytest.fail("another")
    )
    assert len(render_process.draw_in_process(undrawn / "results.h5", undrawn)) == 2


@pytest.mark.usefixtures("as_rank")
def test_where_no_process_can_begin_the_rank_draws(undrawn, monkeypatch):
    monkeypatch.setattr(render_process, "interpreter", lambda *_: ["/no/such/program"])
    assert len(render_process.draw_in_process(undrawn / "results.h5", undrawn)) == 2


@pytest.mark.usefixtures("as_rank")
@pytest.mark.parametrize(("kind", "error"), [
    ("InputError", InputError), ("NoRoomError", NoRoomError),
    ("MissingFileError", MissingFileError), ("StoreError", StoreError),
    ("MemoryError", MemoryError),
])  # fmt: skip
def test_what_is_raised_there_is_raised_here(undrawn, monkeypatch, kind, error):
    run = "import builtins; from hpcwhirl import errors; from hpcwhirl.report import "
    run += "render_process; from hpcwhirl.report.map import maps\ndef fails(*_):\n"
    run += "    kind = getattr(errors, "
    run += f"{kind!r}, None) or getattr(builtins, {kind!r})\n    raise kind('so it is')"
    run += "\nmaps.draw_map = fails; render_process.main()"
    python = [sys.executable, "-c", run]
    monkeypatch.setattr(
        render_process, "interpreter", lambda _, *words: [*python, *words]
    )
    with pytest.raises(error, match=r"^so it is$") as found:
        render_process.draw_in_process(undrawn / "results.h5", undrawn)
    assert type(found.value) is error


@pytest.mark.usefixtures("as_rank")
def test_a_results_file_that_is_missing_is_told_as_ever(tmp_path):
    with pytest.raises(MissingFileError, match="no results file"):
        render_process.draw_in_process(tmp_path / "results.h5", tmp_path)


def test_a_campaign_whose_map_is_killed_says_so_in_one_line(undrawn, finished):
    before = f"render_process.interpreter = lambda *_: [sys.executable, '-c', {DIES!r}]"
    done = begun((finished.parent / "short.toml", undrawn), before=before)
    assert done.returncode == 2
    told = [line for line in done.stderr.splitlines() if "error" in line]
    assert len(told) == 1
    assert "its process died of SIGKILL, perhaps for lack of memory" in told[0]
    assert (undrawn / "results.h5").exists()
    again = ["campaign", str(finished.parent / "short.toml"), "--out", str(undrawn)]
    assert main(again) == 0
    assert (undrawn / "map.png").exists()


def test_a_mistake_in_the_map_is_an_internal_error(undrawn, finished):
    before = "render_process.interpreter = lambda *_: [sys.executable, '-c', '1 / 0']"
    done = begun((finished.parent / "short.toml", undrawn), before=before)
    assert done.returncode == 70
    assert "ZeroDivisionError" in done.stderr


def test_signals_that_end_a_campaign_do_not_reach_its_map(undrawn):
    process = render_process._begun(undrawn / "results.h5", undrawn)
    for number in (signal.SIGTERM, signal.SIGINT, signal.SIGUSR1):
        os.kill(process.pid, number)
    assert render_process._drawn(process, undrawn) == [
        undrawn / "map.png",
        undrawn / "map.svg",
    ]
    assert not signal.pthread_sigmask(signal.SIG_BLOCK, [])


def test_a_map_ends_with_the_rank_that_wants_it(undrawn):
    words = interpreter(
        render_process.__name__, str(undrawn / "results.h5"), str(undrawn)
    )
    done = subprocess.run(words, check=False, stdin=subprocess.DEVNULL)
    assert done.returncode == 1
    assert not (undrawn / "map.png").exists()


def test_another_version_in_the_working_directory_is_not_taken(
    undrawn, tmp_path, monkeypatch
):
    (tmp_path / "hpcwhirl").mkdir()
    (tmp_path / "hpcwhirl/__init__.py").write_text("raise SystemExit(9)")
    monkeypatch.chdir(tmp_path)
    process = render_process._begun(undrawn / "results.h5", undrawn)
    assert len(render_process._drawn(process, undrawn)) == 2
