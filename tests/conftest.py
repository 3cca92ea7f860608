"""What several test files share: campaigns of a few milliseconds, strict JSON."""

import gc
import importlib
import json
import os
import re
import subprocess
from pathlib import Path

import pytest
import threadpoolctl
from cluster import in_one_process
from hypothesis import settings
from launch import spent
from turns import MARKS, TURNS, Turn

from hpcwhirl.campaign.plan import learned
from hpcwhirl.cli import main
from hpcwhirl.dynamics import march as marching

for name in ("matplotlib.figure", "xarray"):  # with them, maps are drawn in here
    importlib.import_module(name)

BEGUN = pytest.StashKey()
SPENT, MARK = {}, {}  # {test: s}, {test: what keeps it out of most runs, or -}
RARE = "evidence", *MARKS
LONG, BUDGET = 5, 360  # s of the processor; told, for a busy machine takes longer

# threads of BLAS spin as they wait: small problems took 30 times the processor's time
threadpoolctl.threadpool_limits(1, user_api="blas")
settings.register_profile("no clock", deadline=None)  # a busy machine is no failure
settings.load_profile("no clock")

SHORT = """
scene = {duration = 2e-3}
solver = {time_step = 2e-6}
output = {interval = 5e-5}
"""


@pytest.fixture(autouse=True)
def _nominal(monkeypatch):
    """Let predictions not depend on what `bench --learn` has kept on this machine."""
    monkeypatch.setattr(learned, "place", lambda: Path("/no/such/steps.json"))
    learned.learned.cache_clear()


def pytest_addoption(parser):
    told = """tell the N tests that took most of the processor, with what they
        started, and which mark keeps them out of most runs"""
    parser.addoption("--processor", type=int, default=0, metavar="N", help=told)
    told = f"""ask one of {TURNS} parts of the tests that take turns: N, or that of the
        commit; `all`: of all these and what is marked `evidence`, and of no other"""
    parser.addoption("--turn", metavar="N|commit|all", help=told)


def pytest_configure(config):
    if turn := config.getoption("turn"):
        config.pluginmanager.register(Turn.of(turn))


def pytest_collection_modifyitems(items):
    """Check that a file spells the marks by which scripts/test.sh finds it."""
    marks = {}
    for item in items:
        marks.setdefault(item.path, set()).update(m.name for m in item.iter_markers())
    for path, names in marks.items():
        for name in {"mpi", "mpiio"} & names:
            if not re.search(rf"mark\.{name}\b", path.read_text()):
                msg = f"{path} must spell mark.{name}, by which test.sh finds it"
                raise pytest.UsageError(msg)


def pytest_collection_finish():
    """Let collections of garbage pass over a million objects of modules and tests."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(20_000)  # 4 % of the processor's time otherwise


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item):
    item.stash[BEGUN] = spent()
    return (yield)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item, call):
    report = yield
    if call.when == "teardown":
        marks = [name for name in RARE if item.get_closest_marker(name)]
        told = {"spent": spent() - item.stash[BEGUN], "mark": [*marks, "-"][0]}
        report.user_properties += told.items()
    return report


def pytest_runtest_logreport(report):
    if report.when == "teardown":
        told = dict(report.user_properties)
        SPENT[report.nodeid], MARK[report.nodeid] = told["spent"], told["mark"]


def pytest_terminal_summary(terminalreporter, config):
    if count := config.getoption("processor"):
        terminalreporter.section(f"slowest {count}, s of the processor")
        for name in sorted(SPENT, key=SPENT.get, reverse=True)[:count]:
            told = f"{SPENT[name]:8.2f} {MARK[name]:8} {name}"
            terminalreporter.write_line(told)
        total = f"{sum(SPENT.values()):8.2f} all tests (budget of a turn: {BUDGET})"
        terminalreporter.write_line(total)
    for name in (n for n, s in SPENT.items() if s > LONG and MARK[n] == "-"):
        told = f"warning: {name}: more than {LONG} s of the processor, not marked slow"
        terminalreporter.write_line(told, yellow=True)


@pytest.fixture(scope="session")
def campaign(tmp_path_factory):
    """Return a function: TOML of what is swept -> (exit code, directory)."""

    def integrate(swept):
        place = tmp_path_factory.mktemp("campaign")
        (place / "short.toml").write_text(SHORT + swept)
        code = main(
            ["campaign", str(place / "short.toml"), "--out", str(place / "out")]
        )
        return code, place / "out"

    return integrate


@pytest.fixture(scope="session")
def finished(campaign):
    """Return the directory of a finished campaign of two speeds; do not write there."""
    code, folder = campaign("sweep = {speed = [300, 410]}")
    assert code == 0
    return folder


@pytest.fixture
def facts(capsys):
    """Return a function: words of a command -> its facts, from strict JSON."""

    def refuse(word):
        pytest.fail(f"{word} is not JSON")

    def ask(*words):
        assert main(words) == 0
        return json.loads(capsys.readouterr().out, parse_constant=refuse)

    return ask


@pytest.fixture
def steps_of(monkeypatch):
    """Return a function that returns a list, which gets the steps of every slice."""

    def count():
        made, advance = [], marching.March.advance

        def counted(march, steps):
            before = march.steps
            advance(march, steps)
            made.append(march.steps - before)

        monkeypatch.setattr(marching.March, "advance", counted)
        return made

    return count


@pytest.fixture(scope="session")
def alone(tmp_path_factory):
    """Return the root variables of the schedulers' campaign, computed without one."""
    return in_one_process(tmp_path_factory.mktemp("alone"))


@pytest.fixture(scope="session")
def kernels(tmp_path_factory):
    """Return where compiled kernels are kept, for one job to compile them for all."""
    return os.environ.get("NUMBA_CACHE_DIR") or tmp_path_factory.mktemp("numba")


@pytest.fixture
def disk(tmp_path):
    """Return a small file system of its own and a function that sets its size."""
    place = tmp_path / "disk"
    place.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=3M", "tmpfs", place]
    try:
        subprocess.run(mount, check=True, capture_output=True)
    except (OSError, subprocess.CalledProcessError):
        pytest.skip("a file system may not be mounted here")

    def resize(size):
        grow = ["mount", "-o", f"remount,size={size}", place]
        subprocess.run(grow, check=True, capture_output=True)

    yield place, resize
    subprocess.run(["umount", place], check=True)
