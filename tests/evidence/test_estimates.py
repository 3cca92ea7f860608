"""What estimates state holds on engines at random; what is measured is kept."""

import json
from types import SimpleNamespace

import numpy as np
import pytest
from evidence import estimates, estimates_drawn
from evidence.estimates_drawn import of_accuracy, touched_engine

from hpcwhirl.case.resolve import resolve
from hpcwhirl.case.truncation import with_truncation
from hpcwhirl.scene import preset_bounds, preset_inputs, preset_loss, preset_names
from hpcwhirl.scene.named import ELSEWHERE

pytestmark = pytest.mark.evidence

SEED = 23


def record(index, ratio, **inputs):
    engine = {"blades": 22, "rotor.damping": 0.01} | inputs
    row = {"way": "as asked", "found": ratio * 0.1, "stated": 0.1}
    return {"index": index, "inputs": engine, "rows": [row]}


def test_the_frequencies_of_engines_at_random_are_as_accurate_as_asked():
    for index in range(12):
        (row,) = of_accuracy(SEED, index)["rows"]
        assert row["found"] <= row["stated"]
        assert row["way"] != "as asked" or row["found"] > 0.999 * row["stated"] - 1e-8


def test_an_engine_is_drawn_from_seed_and_index_alone():
    assert touched_engine(SEED, 7) == touched_engine(SEED, 7)
    assert touched_engine(SEED, 7) != touched_engine(SEED, 8)
    drawn = [touched_engine(SEED, i) for i in range(200)]
    assert {d["nodal_diameter"] for d in drawn} == set(range(5))
    assert {d["friction"] == 0.0 for d in drawn if d["nodal_diameter"] == 2} == {
        True, False,
    }  # fmt: skip
    assert min(d["blades"] for d in drawn) == 12
    assert max(d["blades"] for d in drawn) == 36
    for name, decades in (("rotor.damping", 1.9), ("casing.damping", 1.9)):
        assert max(d[name] for d in drawn) > 10**decades * min(d[name] for d in drawn)


def test_an_estimate_that_holds_too_seldom_in_a_class_of_any_size_is_told():
    rows = [record(i, 0.5, blades=14) for i in range(30)]
    rows += [record(i, 2.0 if i < 3 else 0.5, blades=30) for i in range(30)]
    found = estimates.of_errors("truncation", rows)
    by_class = {line.kind: line for line in found}
    assert by_class["all"].held == 57
    assert by_class["all"].share == pytest.approx(0.95)
    assert by_class["N 28-36"].worst == pytest.approx(2.0)
    assert [line.kind for line in estimates.failing(found)] == ["N 28-36"]
    told = estimates.section("truncation", 60, found)
    assert "| N 28-36 | 30 | 27 | 90 % | 0.5 | 2 |" in told


def turning(index, chosen, none, full):
    others = ("full", "terms", "twins", "detuned")
    words = {"none": none} | dict.fromkeys(others, full)
    inputs = {"centre": "clamped"}
    return {"index": index, "inputs": inputs, "chosen": chosen, "words": words}


def test_a_sure_word_that_changes_without_the_terms_left_out_is_told():
    same = [turning(0, "none", "damped", "damped"), turning(1, "full", "sus", "damped")]
    open_ = turning(2, "none", "undecided", "damped")
    found = {(x.estimate, x.kind): x for x in estimates.of_rotation([*same, open_])}
    assert found["rotation: left out, words", "all"].held == 1
    assert found["rotation: left out, words", "sure"].drawn == 1
    assert found["rotation: kept, clamped centre, words", "all"].held == 0
    assert not estimates.failing(list(found.values()))
    chance = turning(3, "none", "divergent", "damped")
    chance["words"]["twins"] = "divergent"
    assert not estimates.failing(estimates.of_rotation([*same, chance]))
    wrong = turning(3, "none", "divergent", "damped")
    (told,) = estimates.failing(estimates.of_rotation([*same, wrong]))
    assert (told.estimate, told.kind) == estimates.ALL_ASKED[0]


def test_words_of_twins_that_come_with_other_frequencies_are_told():
    """Among as many words drawn alike, one list in twenty is taken for another."""
    either, random = ["damped", "divergent"], np.random.default_rng(SEED)
    assert estimates.as_alike(either * 8, either * 8) == 1.0
    assert estimates.as_alike(either[:1] * 16, either[1:] * 16) < 1e-3
    drawn = [[list(random.choice(either, 16)) for _ in "ab"] for _ in range(100)]
    assert sum(estimates.as_alike(*pair) < estimates.DOUBT for pair in drawn) <= 10
    chance = turning(3, "none", "divergent", "damped")
    chance["spread"] = {"full": either * 8, "none": either * 8}
    found = {(x.estimate, x.kind): x for x in estimates.of_rotation([chance])}
    assert ("rotation: left out, words", "sure") not in found
    assert found[estimates.ALL_ASKED[1]].held == 1
    chance["spread"]["none"] = either[1:] * 16
    (told,) = estimates.failing(estimates.of_rotation([chance]))
    assert (told.estimate, told.kind) == estimates.ALL_ASKED[1]


def test_what_is_not_measured_stays_on_the_page(tmp_path, monkeypatch):
    path = tmp_path / "estimates.md"
    path.write_text(before := estimates.PAGE.read_text())
    _, *old = before.split("\n\n## ")
    assert [part.split("\n")[0] for part in old] == list(estimates.PLANS)
    assert all(part.count("\n| ") > 5 for part in old)
    monkeypatch.setattr(estimates, "PAGE", path)
    monkeypatch.setattr(estimates, "measured", lambda *_: [record(0, 0.5, blades=14)])
    words = ["estimates.py", "--only", "truncation", "--write"]
    monkeypatch.setattr("sys.argv", words)
    assert estimates.main() == 0
    _, *new = path.read_text().split("\n\n## ")
    assert new[0].startswith("truncation\n\n1 engines of seed 17.")
    assert new[0].count("\n| ") < old[0].count("\n| ")
    assert new[1:] == old[1:]


def test_what_was_measured_is_not_measured_again(tmp_path, monkeypatch):
    asked = []

    def measure(seed, index):
        asked.append((seed, index))
        return {"inputs": {}, "rows": []}

    monkeypatch.setitem(estimates.MEASURES, "accuracy", measure)
    for seed, count in ((SEED, 2), (SEED, 4), (SEED + 1, 4)):
        monkeypatch.setitem(estimates.PLANS, "accuracy", (seed, count))
        found = estimates.measured("accuracy", tmp_path)
        assert [r["index"] for r in found] == list(range(count))
    assert asked == [(seed, i) for seed in (SEED, SEED + 1) for i in range(4)]


def test_presets_are_held_against_a_run_finer_than_all_of_them(monkeypatch):
    ran = []

    def simulate(scene):
        ran.append(scene)
        solver = scene.solver
        row = {"outcome": "completed", "regime": "damped", "whirl": "forward"}
        row |= {"orbit_radius": 1e-4 * (1.0 + solver.accuracy), "contact_impulse": 2.0}
        return SimpleNamespace(row=row)

    monkeypatch.setattr(estimates_drawn, "simulate", simulate)
    found = estimates_drawn.of_presets(SEED, 0)
    finer = next(scene for scene in ran if scene.solver.scheme == "exact")
    for scene in ran:
        step = resolve(scene).scene.solver.time_step
        assert finer.solver.time_step <= step
        assert finer.engine.casing.harmonics >= with_truncation(
            scene
        ).engine.casing.harmonics  # fmt: skip
    (twin,) = (s.force for s in ran if s.force != finer.force)
    assert twin == pytest.approx(finer.force, rel=1e-6)
    assert set(found["words"].values()) == {"completed damped forward"}
    for name in preset_names():
        asked = preset_inputs(name)["solver.accuracy"]
        assert found["errors"][name]["orbit_radius"] == pytest.approx(asked)
        assert found["errors"][name]["contact_impulse"] == 0.0
    assert found["errors"]["twins"] == {"orbit_radius": 0.0, "contact_impulse": 0.0}


def test_what_presets_lose_is_the_median_and_what_nine_in_ten_stay_below():
    words = dict.fromkeys((*preset_names(), "finer", "twins"), "damped")
    records = [
        {
            "inputs": {},
            "words": words | {"draft": "damped" if i else "undecided"},
            "errors": {
                n: {"orbit_radius": 0.01 * i, "contact_impulse": 0.0}
                for n in (*preset_names(), "twins")
            },
        }
        for i in range(11)
    ]
    told = estimates.loses("draft", records)
    assert told["nine_in_ten"]["orbit_radius"] == pytest.approx(0.09)
    assert "words as a finer run in 10 (its twins in 11)" in told["engines"]
    assert "orbit radius 5 % (9 %, 10 %; twins 5 %, 9 %)" in told["engines"]
    assert json.dumps(told)


@pytest.mark.parametrize("name", preset_names())
def test_a_preset_tells_of_which_engines_its_numbers_are(name):
    told = preset_loss(name)
    assert "on the engine four_motions and one other words as" in told
    assert "of it: orbit radius" in told
    assert ("engines at random" in told) == bool(preset_bounds(name))
    assert (ELSEWHERE in told) != bool(preset_bounds(name))
