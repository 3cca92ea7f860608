"""Results that are replaced while they are read: what is read is of one file."""

import pickle
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray
from synthetic import grid_of, synthetic

import hpcwhirl
from hpcwhirl.store.reading import results_file, xarray_store
from hpcwhirl.store.reading.results_file import Results

pytestmark = pytest.mark.turns

SPEEDS = [300.0, 310.0, 320.0, 330.0]


@pytest.fixture
def two(tmp_path):
    """Return (directory, what puts a file of another number of cases in place)."""
    fewer = synthetic(tmp_path / "a", grid_of(speed=SPEEDS[:2]), samples=500)
    more = synthetic(tmp_path / "b", grid_of(speed=SPEEDS), samples=500)

    def replace():
        (more / "results.h5").replace(fewer / "results.h5")

    return fewer, replace


def after(monkeypatch, place, name, act):
    """Act once, as soon as a function has been called for the first time."""
    real, done = getattr(place, name), []

    def called(*args, **named):
        found = real(*args, **named)
        if not done:
            done.append(True)
            act()
        return found

    monkeypatch.setattr(place, name, called)
    return done


@pytest.mark.parametrize(
    "moment",
    [
        (xarray_store, "opened"),
        (xarray_store, "attributes_of"),
        (xarray, "open_dataset"),
    ],
)
def test_results_replaced_while_they_are_opened_are_those_of_one_file(
    two, monkeypatch, moment
):
    folder, replace = two
    first = hpcwhirl.open_results(folder).load()
    done = after(monkeypatch, *moment, replace)
    with hpcwhirl.open_results(folder) as data:
        assert done
        xarray.testing.assert_identical(data.load(), first)
    assert len(hpcwhirl.open_results(folder).case) == 4


def test_traces_are_of_the_file_that_the_rows_are_of(two):
    folder, replace = two
    first, opened = Results(folder).traces(1), Results(folder)
    replace()
    found = opened.traces(1)
    assert all(np.array_equal(found[name], first[name]) for name in first)


def test_rows_are_of_the_file_that_was_looked_at(two, monkeypatch):
    folder, replace = two
    digest = Results(folder).digest()
    after(monkeypatch, results_file, "opened", replace)
    assert Results(folder).digest() == digest


def test_a_file_is_opened_once_however_many_groups_it_has(two, monkeypatch):
    folder, count = two[0], []
    real = results_file.h5py.File

    class Counted(real):
        def __init__(self, *args, **named):
            count.append(args)
            super().__init__(*args, **named)

    monkeypatch.setattr("h5py.File", Counted)
    for reader in (hpcwhirl.open_results, Results):
        count.clear()
        reader(folder)
        assert len(count) == 1, reader


def test_results_that_are_sent_to_another_process_are_opened_there(two):
    data = hpcwhirl.open_results(two[0])
    there = pickle.loads(pickle.dumps(data))
    xarray.testing.assert_identical(there.load(), data.load())
    data.close()


def test_results_that_are_closed_hold_no_file(two):
    def held():
        links = Path("/proc/self/fd").glob("*")
        return [n for n in links if n.exists() and n.samefile(two[0] / "results.h5")]

    with hpcwhirl.open_results(two[0]) as data:
        assert held()
    assert not held(), data  # which is still there


@pytest.mark.parametrize(
    "ranks", ["hpcwhirl.campaign", "hpcwhirl; hpcwhirl.campaign", "hpcwhirl.cli.status"]
)
def test_who_opens_no_results_imports_no_xarray(ranks):
    run = f"import {ranks}, sys; assert 'xarray' not in sys.modules"
    run = run if ";" not in ranks else run.replace(", sys", "; import sys")
    subprocess.run([sys.executable, "-c", run], check=True)


def test_status_imports_no_xarray(two):
    hpcwhirl_status = "import sys; from hpcwhirl.cli import main; "
    words = ["status", str(two[0])]
    run = f"{hpcwhirl_status}main({words!r}); assert 'xarray' not in sys.modules"
    (two[0] / "report.html").write_text("of another day")
    done = subprocess.run([sys.executable, "-c", run], check=True, capture_output=True)
    assert b"hpcwhirl report" in done.stdout
