"""The search for the engine: its sequence, what is kept of it."""

from dataclasses import replace
from itertools import islice

import numpy as np
import pytest
from identify import engine as engines
from identify.engine import Plan, Screen, descend, next_start, search

pytestmark = pytest.mark.evidence
PLAN = Plan(drawn=32, screened=16, population=8, patience=5, generations=6)


@pytest.fixture
def bowl(monkeypatch):
    """Let an engine cost its distance from another, and count; may be halted."""
    computed, most = [], [10**9]

    def judged(engine):
        if len(computed) == most[0]:
            raise KeyboardInterrupt
        computed.append(engine)
        away = float(np.log([v / 0.05 for v in engine.values()]).var())
        return {"engine": engine, "cost": away, "right": [0, 0], "rows": [],
                "seconds": 0.1}  # fmt: skip

    monkeypatch.setattr(engines, "judged", judged)
    return computed, most


def sequence(path, batches=12):
    screen = Screen(path, 1, {})
    told = list(islice(search(screen, PLAN), batches))
    return told, [row["cost"] for row in screen.asked]


def test_the_search_goes_down_and_starts_again_elsewhere():
    def costs(points):
        return ((points - 0.3) ** 2).sum(axis=1)

    plan = replace(PLAN, generations=40, patience=15)
    found = [f.min() for _, f in descend(np.full(8, 0.8), costs, plan, 0)]
    assert found[-1] < 0.02 * found[0]
    points, cost = np.array([[0.1] * 8, [0.12] * 8, [0.9] * 8]), np.array([1, 2, 3.0])
    starts = next_start(points, cost, points[:0])[None]
    assert (starts[0] == points[0]).all()
    assert (next_start(points, cost, starts) == points[2]).all()


def test_a_search_that_was_killed_asks_the_same_questions(tmp_path, bowl):
    computed, most = bowl
    told, costs = sequence(tmp_path / "whole")
    assert min(costs) < min(costs[:8])
    count = len(computed)
    computed.clear()
    most[0] = 37
    with pytest.raises(KeyboardInterrupt):
        sequence(tmp_path / "halted")
    most[0] = 10**9
    lines = (tmp_path / "halted").read_bytes()
    (tmp_path / "halted").write_bytes(lines + b'{"engine": {"a')  # cut by the kill
    assert sequence(tmp_path / "halted") == (told, costs)
    assert len(computed) == count
    assert (tmp_path / "halted").read_bytes() == (tmp_path / "whole").read_bytes()


def test_another_screening_does_not_go_on_in_it(tmp_path):
    path = tmp_path / "screened"
    Screen(path, 1, {})
    before = path.read_bytes()
    with pytest.raises(SystemExit, match="begun with another box"):
        Screen(path, 1, {"engine.rotation": "full"})
    assert path.read_bytes() == before
