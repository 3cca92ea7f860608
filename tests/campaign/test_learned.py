"""Times of steps measured once a machine, by which costs are predicted from then on."""

import json

import pytest

from hpcwhirl.benchmark import learn
from hpcwhirl.campaign.plan import cost, learned
from hpcwhirl.campaign.plan.design import design_of
from hpcwhirl.campaign.plan.learned import Measured, keep
from hpcwhirl.cli import main

ROWS = [Measured("modal", "none", False, 6, 4.0, 3.0),
        Measured("modal", "none", False, 24, 1.0, 0.75)]  # fmt: skip


@pytest.fixture
def kept(tmp_path, monkeypatch):
    """Keep times in a folder of the test."""
    path = tmp_path / "steps.json"
    monkeypatch.setattr(learned, "place", lambda: path)
    learned.learned.cache_clear()
    yield path
    learned.learned.cache_clear()


def seconds(blades, share, **engine):
    tables = {"scene": {"duration": 1e-3}, "engine": {"rotor": {"blades": blades}}}
    tables["engine"] |= engine
    return float(cost.costs_of(design_of(tables), share=share).nominal[0])


@pytest.mark.parametrize(
    ("blades", "factor"), [(5, 4.0), (6, 4.0), (12, 2.0), (24, 1.0), (40, 1.0)]
)
def test_a_measured_ratio_is_interpolated_and_held_beyond(kept, blades, factor):
    before = [seconds(blades, share) for share in (0.0, 1.0)]
    assert keep(ROWS) == kept
    flight, contact = (seconds(blades, share) for share in (0.0, 1.0))
    assert flight == pytest.approx(factor * before[0])
    assert contact == pytest.approx(0.75 * factor * before[1])
    half = seconds(blades, 0.5)
    assert half == pytest.approx(0.5 * (flight + contact))


@pytest.mark.usefixtures("kept")
def test_what_was_not_measured_stays_nominal():
    before = seconds(12, 0.5, rotation="full")
    keep(ROWS)
    assert seconds(12, 0.5, rotation="full") == before


@pytest.mark.parametrize(
    "text", ["", "[", "{}", "[1]", '[{"scheme": "modal"}]',
             json.dumps([{**vars(ROWS[0]), "flight": float("nan")}]),
             json.dumps([{**vars(ROWS[0]), "contact": "3"}])],
)  # fmt: skip
def test_a_damaged_file_counts_as_none(kept, text):
    before = seconds(12, 0.5)
    kept.write_text(text)
    learned.learned.cache_clear()
    assert seconds(12, 0.5) == before


@pytest.mark.turns
def test_bench_keeps_what_it_measures_and_a_dry_run_tells_it(
    kept, tmp_path, monkeypatch, capsys
):
    monkeypatch.setattr(learn, "SIZES", (5,))
    monkeypatch.setattr(learn, "SCHEMES", {"modal": learn.SCHEMES["modal"]})
    file = tmp_path / "c.toml"
    file.write_text("scene = {duration = 1e-3}\nsweep = {speed = [100, 200]}\n")
    words = ["campaign", str(file), "--out", str(tmp_path / "out"), "--dry-run"]
    assert main(words) == 0
    assert "nominal: " in capsys.readouterr().out
    assert main(["bench", "--learn", "--repeats", "1"]) == 0
    assert str(kept) in capsys.readouterr().out
    assert len(learned.learned()) == 4  # rotation or none, equal or unequal blades
    assert main(words) == 0
    told = capsys.readouterr().out
    assert "measured on this machine: " in told
    assert "wall time on 1 rank, measured on this machine: " in told
