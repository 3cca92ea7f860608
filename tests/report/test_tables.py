"""Tables of the page: they are those of the commands that they name."""

import json
import re

import made_up
import pytest

from hpcwhirl.cli import main
from hpcwhirl.report.page.build import page_data, write_page
from hpcwhirl.store.directory.campaign_directory import Directory
from hpcwhirl.store.reading.results_file import Results

pytestmark = pytest.mark.turns

FORCES = [float(force) for force in range(10_000, 90_000, 10_000)]
BRANCHED = {
    "sweep": {"speed": [300.0, 320.0, 340.0, 360.0], "friction": [0.1, 0.2]},
    "branch": {"over": "speed"},
}
STARTS = {"sweep": {"speed": [300.0, 400.0], "force": FORCES}}
DRAWN = {
    "scene": {"force": 0.0},
    "sweep": {"speed": [300.0, 400.0]},
    "sample": {
        "count": 8,
        "start_energy": {"distribution": "uniform", "low": 0.0, "high": 9.0},
        "start_draw": {"distribution": "uniform", "low": 0.0, "high": 1.0},
    },
}


@pytest.fixture
def made(tmp_path):
    def make(document):
        return made_up.campaign(tmp_path / "out", document)

    return make


def tables_in(folder):
    page = write_page(Directory(folder)).read_text()
    block = re.search(r'id="facts">(.*?)</script>', page, re.DOTALL)
    return json.loads(block[1])["tables"]


def printed(capsys, *words):
    capsys.readouterr()
    assert main([*words, "--json"]) == 0
    return json.loads(capsys.readouterr().out)


def test_folds_are_those_of_the_command(made, capsys):
    folder = made(BRANCHED)
    (table,) = tables_in(folder)
    found = printed(capsys, "branches", str(folder))
    assert f"{found['differ']} of {found['points']} points" in table["title"]
    assert len(table["rows"]) == len(found["changes"]) > 0
    for row, fold in zip(table["rows"], found["changes"], strict=True):
        assert row[1] == fold["branch"]
        assert [float(row[n]) for n in (2, 3)] == [fold["last"], fold["first"]]
        assert row[4:7] == [fold["word"], fold["following"], fold["kind"]]
        assert float(row[7]) == pytest.approx(1e3 * fold["radius"], rel=1e-5)  # mm


def test_shares_and_limits_of_a_grid_of_pulses_are_those_of_the_commands(made, capsys):
    folder = made(STARTS)
    limit, shares = tables_in(folder)
    found = printed(capsys, "basins", str(folder))["basins"]
    known = {(f"{own['speed']:g}", own["regime"]): own["share"] for own in found}
    for row in shares["rows"]:
        for word, share in zip(shares["head"][1:], row[1:], strict=True):
            own = float(share.partition(" [")[0])
            assert own == pytest.approx(known.pop((row[0], word)), rel=1e-2)
    assert not known
    first = printed(capsys, "margin", str(folder), "--over", "force", "--first")
    assert len(limit["rows"]) == 2
    assert "force F, kN" in limit["head"][1]
    (lines,) = (value for value in first.values() if isinstance(value, list))
    for row, own in zip(limit["rows"], lines, strict=True):
        assert row[3] == (own["word"] or "none met")
        if row[2]:
            assert 1e3 * float(row[2]) == pytest.approx(own["unsafe"])


def test_drawn_starts_of_a_given_energy_have_shares_and_no_limit(made):
    (table,) = tables_in(made(DRAWN))
    assert table["title"].endswith("(start energy, start draw)")
    assert table["command"] == "hpcwhirl basins DIR"


def test_a_plain_map_has_no_table(made):
    plain = {"sweep": {"speed": [300.0, 320.0], "gap": [1e-4, 2e-4]}}
    with Results(made(plain)) as results:
        assert page_data(results).facts["tables"] == []
