"""How sure the motions are: shares and profiles."""

import numpy as np
import pytest
from common import with_section
from identify import full, named, sure
from identify.full import Found
from identify.screen import MOTIONS
from identify.space import UNKNOWNS, engine_of_scene, scattered

from hpcwhirl.campaign.plan.design import design_of
from hpcwhirl.scene import Scene, engine_names, engine_shows

pytestmark = pytest.mark.evidence
DEFAULT = engine_of_scene(Scene())


def found(*wrong):
    rows = [{"kind": "table 2", "speed": speed, "whirl": whirl,
             "regime": "undecided" if speed in wrong else regime}
            for speed, (regime, whirl) in MOTIONS.items()]  # fmt: skip
    return Found(DEFAULT, rows)


def test_scatter_is_as_wide_as_told_and_every_draw_is_its_own():
    engine = DEFAULT
    drawn = scattered(engine, 0.05, 256)
    assert drawn[:8] == scattered(engine, 0.05, 8)  # more draws: the first the same
    off = np.log([[e[n] / engine[n] for n in UNKNOWNS] for e in drawn])
    assert off.std(axis=0) == pytest.approx(0.05, rel=0.2)
    assert np.abs(np.corrcoef(off.T) - np.eye(len(UNKNOWNS))).max() < 0.25
    assert drawn != scattered(engine, 0.05, 256, seed=2)


def test_shares_count_motions_one_by_one_and_all_at_once():
    lines = sure.scatter_lines({0.01: [found(), found(270.0), found(420.0), found()]})
    cells = [cell.strip() for cell in lines[2].split("|")[2:-1]]
    assert [cell.split(" (")[0] for cell in cells] == [
        "3 of 4", "4 of 4", "3 of 4", "4 of 4", "2 of 4",
    ]  # fmt: skip


def test_a_profile_ends_where_a_motion_is_first_lost():
    steps = dict.fromkeys((-0.1, -0.05, 0.0, 0.05), found())
    steps |= {0.1: found(410.0), 0.2: found(), -0.2: found(520.0)}
    assert sure.holds(steps) == "-10% to +5%"
    assert sure.holds(steps | {0.0: found(270.0)}) == "never"
    changed = sure.changed(DEFAULT)
    assert len(changed) == len(UNKNOWNS) * (1 + 2 * len(sure.CHANGES))
    for (name, step), engine in changed.items():
        other = {n for n in UNKNOWNS if engine[n] != DEFAULT[n]}
        assert other == ({name} if step else set())
        assert engine[name] == pytest.approx(DEFAULT[name] * (1 + step))


def test_an_engine_that_comes_twice_is_computed_once(monkeypatch, tmp_path):
    asked = []

    def compute(engines, stage, folder, ranks):
        del stage, folder, ranks
        asked.extend(engines)
        design_of(full.document(engines, sure.FOUR))  # accepted
        return [full.Found(engine) for engine in engines]

    monkeypatch.setattr(sure, "compute", compute)
    tried = list(sure.changed(DEFAULT, [0.01]).values())
    found = sure.computed(tried, tmp_path, 1, fast=False)
    assert [item.engine for item in found] == tried
    assert len(asked) == len(tried) - len(UNKNOWNS) + 1


def test_a_section_takes_the_place_of_what_it_was():
    page = with_section("# Title\n\ntext", "## one, fast\n\na")
    page = with_section(page, "## one, default\n\nb\n")
    again = with_section(page, "## one, fast\n\nc\n")
    assert again == page.replace("\n\na\n", "\n\nc\n")
    assert again.startswith("# Title\n\ntext\n\n## one, fast")
    assert again.endswith("## one, default\n\nb\n")


def test_a_line_of_speeds_is_told_in_ranges():
    def row(speed, regime, whirl="forward"):
        return {"speed": speed, "regime": regime, "whirl": whirl}

    words = "dVVVdSd"
    regimes = {"d": "damped", "V": "divergent", "S": "sustained"}
    sweep = {10.0 * i: row(10.0 * i, regimes[w]) for i, w in enumerate(words)}
    assert named.ranges(sweep, "divergent") == "10-30 (forward)"
    assert named.ranges(sweep, "sustained") == "50 (forward)"
    assert named.ranges(sweep, "undecided") == ""
    with pytest.raises(SystemExit, match="no line"):
        named.written("[one]\n", "one", "something")


def test_named_engines_say_what_they_show():
    for name in engine_names():
        assert all(f"{speed:g}" in engine_shows(name) for speed in MOTIONS)
