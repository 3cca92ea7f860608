"""A campaign with nothing left to do gathers and draws again only what has changed."""

import json
import os
import shutil

import h5py
import pytest

from hpcwhirl.analysis.regimes import threshold_facts
from hpcwhirl.campaign.begin import prepare
from hpcwhirl.campaign.plan.design import design_of
from hpcwhirl.campaign.run import run_campaign
from hpcwhirl.cli import main
from hpcwhirl.store.directory.campaign_directory import Directory
from hpcwhirl.store.directory.journal import Journal, Journals
from hpcwhirl.store.reading.reader import open_results
from hpcwhirl.store.results.contents import is_current

pytestmark = pytest.mark.turns

DOCUMENT = {
    "scene": {"duration": 2e-3},
    "output": {"interval": 1e-4},
    "solver": {"time_step": 2e-6},
    "sweep": {"speed": [300.0, 410.0], "friction": [0.0, 0.1]},
}


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    import tomli_w

    place = tmp_path_factory.mktemp("current") / "out"
    file = place.parent / "c.toml"
    file.write_text(tomli_w.dumps(DOCUMENT))
    assert main(["campaign", str(file), "--out", str(place)]) == 0
    return place


@pytest.fixture
def again(finished, tmp_path):
    """Return a copy, with the times of its files, and what runs it again."""
    place = tmp_path / "out"
    shutil.copytree(finished, place, copy_function=shutil.copy2)
    file = finished.parent / "c.toml"
    return place, lambda: main(["campaign", str(file), "--out", str(place)])


def times(folder):
    names = ("results.h5", "map.png", "map.svg", "report.html")
    return {name: (folder / name).stat().st_mtime_ns for name in names}


def test_nothing_is_written_again_where_nothing_has_changed(again):
    place, run = again
    before = times(place)
    assert run() == 0
    assert run() == 0  # the first of both has left an empty journal
    assert times(place) == before


def _journal(place):
    case = next(iter(Journals(place).newest().values()))
    with Journal(Journals(place), 7, 0) as journal:
        row = case["row"] | {"orbit_radius": 1.25}
        journal.append({n: v for n, v in case.items() if n != "traces"} | {"row": row},
                       {})  # fmt: skip


def _touched(place):
    (log,) = [p for p in (place / "journal").iterdir() if p.stat().st_size]
    os.utime(log, ns=(1, 1))


def _classified(place):
    assert main(["classify", str(place), "--set", "drift=0.2", "--write"]) == 0


def _cut(place):
    with (place / "results.h5").open("r+b") as file:
        file.truncate(5000)


def _edited(place):
    with h5py.File(place / "results.h5", "r+") as file:
        file["orbit_radius"][1] = 1.25


@pytest.mark.parametrize(
    "change",
    [
        _edited,
        _journal,
        _touched,
        _classified,
        _cut,
        lambda place: (place / "results.h5").unlink(),
    ],
)
def test_what_has_changed_is_gathered_again(again, change):
    place, run = again
    change(place)
    assert not is_current(Directory(place), threshold_facts())
    assert run() == 0
    assert is_current(Directory(place), threshold_facts())
    with open_results(place) as data:
        assert data.attrs["threshold_drift"] == threshold_facts()["threshold_drift"]
        assert (1.25 in data["orbit_radius"].to_numpy()) == (change is _journal)


def test_a_lost_map_and_page_are_made_again(again):
    place, run = again
    before = times(place)
    (place / "map.svg").unlink()
    (place / "report.html").unlink()
    assert run() == 0
    after = times(place)
    assert after["results.h5"] == before["results.h5"]
    assert after["map.svg"] > before["map.svg"]
    assert after["report.html"] > before["report.html"]


def test_a_plan_that_has_got_more_cases_is_gathered_again(tmp_path):
    first = design_of(DOCUMENT | {"output": {"traces": "summary"}})
    prepare(first, Directory(tmp_path))
    assert run_campaign(first, Directory(tmp_path)).gathered
    assert not run_campaign(first, Directory(tmp_path)).gathered
    sweep = DOCUMENT["sweep"] | {"speed": [300.0, 350.0, 410.0]}
    more = design_of(DOCUMENT | {"output": {"traces": "summary"}, "sweep": sweep})
    prepare(more, Directory(tmp_path))
    assert not is_current(Directory(tmp_path), threshold_facts())
    assert run_campaign(more, Directory(tmp_path)).gathered
    plan = json.loads((tmp_path / "campaign.json").read_text())
    assert plan["swept"] == ["speed", "friction"]
