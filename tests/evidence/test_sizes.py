"""Times of steps by number of blades, against the rates of the machine."""

import json
import sys
from types import SimpleNamespace

import pytest
from cost import sizes

from hpcwhirl.benchmark import bench


def test_limits_that_a_step_exceeds_are_doubted():
    assert sizes.doubts([SimpleNamespace(peak=0.4, bandwidth=1.0)]) == []
    (line,) = sizes.doubts([SimpleNamespace(peak=0.2, bandwidth=4.98)])
    assert "the machine was busy" in line


@pytest.mark.evidence
def test_a_step_counts_more_where_more_blades_touch(monkeypatch, capsys):
    monkeypatch.setattr(bench, "STEPS", 1000)
    monkeypatch.setattr(bench, "SETTLE", 0.01)
    call = ["sizes.py", "--sizes", "7", "--json", "--repeats", "1"]
    monkeypatch.setattr(sys, "argv", call)
    assert sizes.main() == 0
    found = json.loads(capsys.readouterr().out)
    every = {
        (r["points"], r["sectors"], r["timing"]["scheme"], r["motion"]): r
        for r in found["rows"]
    }
    assert len(every) == len(found["rows"]) == 8 + 6  # of one point and of three
    rows = {tuple(rest): row for (points, *rest), row in every.items() if points == 1}
    for row in rows.values():
        assert row["timing"]["microseconds_per_step"] > 0.0
    for sectors in ("equal", "unequal"):
        flight, rubs = (rows[sectors, "modal", m] for m in ("in flight", "rubs"))
        assert flight["timing"]["contact"] == 0.0 < rubs["timing"]["contact"]
        for name in ("operations", "bytes"):
            assert 0.0 < flight["counts"][name] < rubs["counts"][name]
    assert rows["unequal", "modal", "all press"]["timing"]["touching"] == 7.0
