"""What of the paper no engine was found to have at once: the counting of it."""

from types import SimpleNamespace

import numpy as np
import pytest
from identify import beyond
from identify.space import default_engine

from hpcwhirl.scene import engine_names

PAPER = {speed: (regime, whirl) for speed, regime, whirl in beyond.WORDS}
PAPER |= dict.fromkeys(beyond.LOW, ("damped", "backward"))
RADII = {270.0: 1e-4, 250.0: 1e-4, 420.0: 4e-4}


def played(words, waves=1e-6, radii=RADII, stop="end"):
    """Return what stands for `moved`: words and radii by speed, waves of the casing."""

    def moved(_engine, _own, speed, **_kept):
        regime, whirl = words[speed]
        row = {"regime": regime, "whirl": whirl, "stop": stop}
        row["orbit_radius"] = radii.get(speed, 1e-4)
        casing = np.zeros((10, 4, 2))
        casing[-1, :2], casing[-1, 2:, 0] = 1.0, waves / 2  # translation is no wave
        return SimpleNamespace(
            row=row, traces={"time": np.arange(10), "casing": casing}
        )

    return moved


@pytest.mark.parametrize(
    ("lost", "changes"),
    [
        ([], {}),
        ([0, 6], {"words": PAPER | {270.0: ("divergent", "forward")}}),
        ([1, 5], {"words": PAPER | {410.0: ("damped", "forward")}}),
        ([2, 6], {"words": PAPER | {420.0: ("sustained", "forward")}}),
        ([3], {"words": PAPER | {520.0: ("damped", "mixed")}}),
        (
            [4],
            {"words": PAPER | dict.fromkeys((60.0, 240.0), ("divergent", "backward"))},
        ),
        ([5], {"waves": 1.1e-5}),
        ([6], {"radii": RADII | {420.0: 6e-4}}),
        ([6], {"stop": "amplitude"}),
    ],
)
def test_each_statement_is_lost_by_what_speaks_against_it(monkeypatch, lost, changes):
    monkeypatch.setattr(beyond, "moved", played(**{"words": PAPER} | changes))
    found = beyond.judged(beyond.FREEDOMS[0], 0, default_engine(), {})
    assert [i for i, kept in enumerate(found["kept"]) if not kept] == lost
    assert len(found["kept"]) == len(beyond.STATEMENTS)
    assert found["grows"]["270"] > 0.0  # of the default engine, as in why.md


def test_engines_are_the_named_ones_and_others_about_each():
    drawn = beyond.population(13, 1)
    named = beyond.population(len(engine_names()), 1)
    assert drawn[: len(named)] == named
    assert beyond.population(13, 1) == drawn
    assert len({str(engine) for engine in drawn}) == 13


def test_friction_and_force_of_a_freedom_count(tmp_path):
    random, engine = np.random.default_rng(1), default_engine()
    still = beyond.moved(engine, {"force": 1e-3, "duration": 0.01}, 410.0)
    assert still.row["contacts"] == 0
    for freedom in beyond.FREEDOMS:
        own = freedom.change(random, engine, tmp_path) | {"duration": 0.01}
        found = beyond.moved(engine, own, 410.0).row
        assert found["friction"] == own.get("friction", 0.1)
