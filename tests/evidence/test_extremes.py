"""Scenes at the extremes, by the table of scripts/extremes/decide.py and its laws."""

import os

import pytest
from extremes import crossed, decide, drawn, laws, table, workers
from extremes.laws import Broken

pytestmark = pytest.mark.turns
QUICK = [extreme for extreme in table.TABLE if extreme.quick]
FOLDED = [e for e in table.TABLE if e.what == "lobes" and not e.quick]


@pytest.mark.parametrize("extreme", QUICK, ids=lambda e: f"{e.what}: {e.name}")
def test_an_extreme_is_decided_by_its_law(extreme):
    extreme.law(extreme.settings)


@pytest.mark.slow
@pytest.mark.parametrize("extreme", FOLDED, ids=lambda e: e.name)
def test_one_blade_and_two_of_twenty_two_swing_in_closed_form(extreme):
    extreme.law(extreme.settings)


@pytest.mark.slow
@pytest.mark.parametrize("name", table.NUMBERS)
def test_an_input_at_the_edge_of_numbers(name):
    own = [e for e in table.TABLE if e.what == "edge of numbers" and name in e.settings]
    assert len(own) == len(table.EDGES)
    for extreme in own:
        extreme.law(extreme.settings)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(40))
def test_a_random_scene_is_refused_or_lost_or_sound(seed):
    extreme = drawn.random_scene(seed)
    extreme.law(extreme.settings)


@pytest.mark.slow
@pytest.mark.parametrize("feature", table.FEATURES)
def test_a_number_of_a_feature_that_is_on_at_its_edges(feature):
    own = [e for e in table.TABLE if e.what == f"feature: {feature}"]
    assert len(own) == len(table.edges_of(feature))
    for extreme in own:
        extreme.law(extreme.settings)


FOREMOST = "gap 0", "denormal speed", "0.99 of the longest step"


@pytest.mark.parametrize("feature", crossed.FEATURES)
def test_a_feature_at_the_extremes_holds_or_is_refused_by_name(feature):
    for extreme in FOREMOST:
        pair = crossed.Pair(extreme, feature)
        assert pair.law(pair.settings)


@pytest.mark.slow
@pytest.mark.parametrize("extreme", sorted(set(crossed.EXTREMES) - {*FOREMOST}))
def test_every_feature_at_an_extreme_holds_or_is_refused_by_name(extreme):
    for pair in crossed.pairs():
        if pair.extreme == extreme and extreme != crossed.DEAR:
            assert pair.law(pair.settings)


def test_a_refusal_that_names_no_input_of_the_pair_is_broken():
    pair = crossed.Pair("gap 0", "none")
    wrong = pair.settings | {"friction": -1.0}
    with pytest.raises(Broken, match="names none of"):
        pair.law(wrong)


def test_a_tip_beyond_the_casing_is_broken(monkeypatch):
    monkeypatch.setattr(laws, "closure_at", lambda *_: 1e-7)
    with pytest.raises(Broken, match="beyond the casing"):
        laws.opened(crossed.Pair("gap 0", "none").settings)


def burning(_):
    while True:
        pass


def ending(_):
    os._exit(3)


def holding(_):
    return "completed"


SCENES = [
    table.Extreme(law.__name__, {}, law) for law in (burning, holding, ending, holding)
]
ANSWER = workers.Answer(holds=True, told="completed", seconds=1.0)


@pytest.mark.parametrize("count", [1, 2])
def test_a_scene_that_ends_its_process_or_takes_too_long_is_a_broken_row(count):
    found = dict(workers.apart(SCENES, count, limit=0.1))
    assert [found[number].holds for number in range(4)] == [False, True, False, True]
    assert found[0].told.startswith("OVER: more than 0.1 s of the processor")
    assert found[2].told == "DIED: 3"


def test_scenes_that_have_a_row_of_this_code_are_not_tried_again(tmp_path, monkeypatch):
    path, tried = tmp_path / "rows.jsonl", []

    def apart(extremes, *_):
        tried.append([each.what for each in extremes])
        return enumerate([ANSWER] * len(extremes))

    monkeypatch.setattr(decide, "apart", apart)
    for code, chosen in (("a", SCENES[:2]), ("a", SCENES[:3]), ("b", SCENES[:1])):
        monkeypatch.setattr(decide, "code_of", lambda _, code=code: code)
        assert len(decide.try_all(chosen, path, 1, 1.0)) == len(chosen)
    assert tried == [["burning", "holding"], ["ending"], ["burning"]]
