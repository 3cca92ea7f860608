"""A word that a confirming preset has superseded counts nowhere.

The draft calls pulses damped up to twice the force at which the standard stops to do
so; both rows of a confirmed point are kept.
"""

import json
from itertools import pairwise

import numpy as np
import pytest
from made_up import refined_campaign

import hpcwhirl
from hpcwhirl.campaign.progress import progress_of
from hpcwhirl.cli import main
from hpcwhirl.cli.edge import _of_campaign
from hpcwhirl.report.map.data import Wish, picture_of
from hpcwhirl.report.page.build import page_data
from hpcwhirl.report.page.tables import tables_of
from hpcwhirl.scene import preset_inputs
from hpcwhirl.store.directory.campaign_directory import Directory
from hpcwhirl.store.reading.results_file import Results
from hpcwhirl.studies.margins import lines_of, working_point

pytestmark = pytest.mark.turns

ACCURACY = "solver.accuracy"
FORCES = [1e4, 2e4, 3e4, 4e4, 5e4, 6e4]
DOCUMENT = {
    "output": {"traces": "summary"},
    "sweep": {"speed": [300.0, 320.0, 340.0], "force": FORCES},
    "refine": {
        "over": ["force"], "levels": 2, "first": "draft", "confirm": "standard",
    },
}  # fmt: skip


def limit(settings):
    """Return the force above which a pulse leads to a sustained motion, N."""
    second = settings.get(ACCURACY) == preset_inputs("standard")[ACCURACY]
    return (1.2e4 if second else 2.4e4) * settings["speed"] / 300.0


def word(settings):
    return "sustained" if settings["force"] > limit(settings) else "damped"


def coin(settings):
    """Twins of the draft differ, those of the standard do not."""
    odd = settings.get("twin", 0) % 2 and ACCURACY not in settings
    return "sustained" if odd else word(settings)


@pytest.fixture(scope="module")
def confirmed(tmp_path_factory):
    place = tmp_path_factory.mktemp("superseded") / "out"
    return refined_campaign(place, DOCUMENT, word)


@pytest.fixture(scope="module")
def data(confirmed):
    with hpcwhirl.open_results(confirmed) as found:
        yield found.load()


@pytest.fixture(scope="module")
def final(data):
    return data.isel(case=np.flatnonzero(data["final"].to_numpy() == 1))


def test_no_value_is_both_safe_and_not(data, final):
    for found in hpcwhirl.first_changes(data, "force"):
        assert found.safe < found.unsafe
        assert found.safe <= 1.2e4 * found.fixed["speed"] / 300.0 <= found.unsafe
    both = (hpcwhirl.safe_ranges(one, "force") for one in (data, final))
    assert len(set(map(str, both))) == 1
    for one in lines_of(data, "force", 0.0):
        assert all(low < high for low, high in pairwise(one.values.tolist()))


def test_a_working_point_and_an_edge_take_the_confirmed_word(confirmed, data):
    for value in np.unique(data["force"].to_numpy()).tolist():
        at = {"force": value, "speed": 300.0}
        (along, _) = working_point(data, at)
        if value > 1.2e4:
            assert along.found.distance(value) < 0.0
    for asked in _of_campaign(confirmed / "results.h5", []):
        fine = preset_inputs("standard")[ACCURACY]
        assert asked.scene.solver.accuracy == fine
        assert asked.low < 1.2e4 * asked.scene.speed / 300.0 < asked.high


def test_all_tables_and_counts_of_words_agree(confirmed, data, final, capsys):
    regime, count = np.unique(final["regime"].to_numpy(), return_counts=True)
    words = dict(zip(regime.tolist(), count.tolist(), strict=True))
    assert final.sizes["case"] < data.sizes["case"]
    assert picture_of(data, Wish()).counts() == words
    assert progress_of(Directory(confirmed)).words == words
    with Results(confirmed) as results:
        (limits,) = tables_of(results)
        facts = page_data(results).facts
    told = [float(row[1]) for row in limits["rows"]]
    safe = [1e-3 * f.safe for f in hpcwhirl.first_changes(final, "force")]
    unit = 1.0 if "kN" in limits["head"][1] else 1e3
    assert told == pytest.approx(np.multiply(unit, safe))
    assert facts["cases"] - len(facts["superseded"]) == final.sizes["case"]
    capsys.readouterr()
    assert main(["cases", str(confirmed), "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)["cases"]
    assert sum(row["final"] for row in rows) == final.sizes["case"]


def test_twins_of_a_superseded_case_do_not_count(tmp_path):
    twins = {"count": 4, "of": "all", "spread": {"gap": 1e-6}}
    place = refined_campaign(tmp_path / "out", DOCUMENT | {"twins": twins}, coin)
    with hpcwhirl.open_results(place) as data:
        final = data.isel(case=np.flatnonzero(data["final"].to_numpy() == 1))
        assert hpcwhirl.credibility(data) == hpcwhirl.credibility(final)
        assert hpcwhirl.credibility(data).cases < data.sizes["case"]
