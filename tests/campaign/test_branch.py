"""Sweeps in which each case begins where the one before has ended: [branch]."""

import json
import shutil
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import tomli_w
from common import on_engine
from launch import launch, records, root_variables

import hpcwhirl
from hpcwhirl.campaign.compute import computation
from hpcwhirl.campaign.plan.design import Design
from hpcwhirl.campaign.simulate import begun, simulate
from hpcwhirl.campaign.work import tidy_ends
from hpcwhirl.case.resolve import resolve
from hpcwhirl.cli import main
from hpcwhirl.errors import InputError
from hpcwhirl.planner.kinds import cases_before
from hpcwhirl.planner.planner import Job
from hpcwhirl.refinement.words import word_of
from hpcwhirl.report.figures.coexisting import draw_branches
from hpcwhirl.scene import Scene, apply_settings, case_before, digest
from hpcwhirl.scene.history import parsed
from hpcwhirl.scene.words import SHOWN
from hpcwhirl.store.directory.states import States
from hpcwhirl.store.reading.results_file import Results
from hpcwhirl.studies.branches import (
    Branch,
    branches_of,
    changes_of,
    count_differences,
)

TABLES = {
    "scene": {"duration": 0.02},
    "engine": {"rotor": {"blades": 7}},
    "output": {"traces": "summary"},
    "sweep": {"speed": [300.0, 320.0, 340.0], "friction": [0.0, 0.2]},
    "branch": {"over": "speed"},
}


ALONG = {"over": "speed", "levels": 3, "words": "branch"}
# At 500 rad/s the whirl ends after 1.2 to 2.3 s, at a time that round-off changes: in
# 2 s it is damped or not yet, which is no fold.
FOLDED = on_engine("mostly_damped", {
    "scene": {"duration": 4.0},
    "solver": {"preset": "draft"},
    "output": {"traces": "summary"},
    "sweep": {"speed": [420.0, 460.0, 500.0]},
    "branch": {"over": "speed", "directions": "up"},
    "refine": ALONG,
})  # fmt: skip


def tables(**changed):
    return TABLES | changed


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    out = tmp_path_factory.mktemp("branch") / "out"
    with hpcwhirl.campaign(TABLES, out):
        return out


def told(row):
    """Return a row without what no bit of a motion depends on."""
    return {n: float(v).hex() if isinstance(v, float) else v for n, v in row.items()}


def test_the_cases_are_branches_up_and_down_for_each_other_input():
    design = Design.of(TABLES)
    assert design.swept == ("friction", "speed", "branch")
    rows = [(s.friction, s.branch, s.speed, s.history) for s in design.scenes]
    assert rows[:3] == [
        (0.0, "up", 300.0, ""), (0.0, "up", 320.0, "speed = 300.0"),
        (0.0, "up", 340.0, "speed = 300.0, 320.0"),
    ]  # fmt: skip
    assert [row[1:3] for row in rows[3:6]] == [
        ("down", 340.0), ("down", 320.0), ("down", 300.0),
    ]  # fmt: skip
    assert {row[0] for row in rows[6:]} == {0.2}
    assert cases_before(design.settings) == [-1, 0, 1, -1, 3, 4, -1, 6, 7, -1, 9, 10]


def test_branches_begin_at_any_value_of_the_sweep():
    branch = {"over": "speed", "starts": [320], "directions": "up"}
    design = Design.of(tables(branch=branch))
    found = [(s.branch, s.speed) for s in design.scenes if s.friction == 0.0]
    assert found == [("up from 320", 320.0), ("up from 320", 340.0)]


def test_a_case_is_known_by_the_cases_before_it():
    design = Design.of(TABLES)
    other = Design.of(tables(sweep=TABLES["sweep"] | {"speed": [310.0, 320.0, 340.0]}))
    for case, before in enumerate(cases_before(design.settings)):
        scene, job = design.scene(case), Job(case)
        assert digest(scene) == design.digest(case)
        follows = computation(design, job).follows
        assert follows == (design.digest(before) if before >= 0 else "")
        found = case_before(scene)
        assert (digest(found) if found else "") == follows
    assert not {*design.digests[:3]} & {*other.digests[:3]}
    assert {*design.digests[3:5]} <= {*other.digests}


@pytest.mark.turns
def test_a_case_goes_on_with_the_energy_that_the_one_before_has_ended_with(swept):
    rows = {record["case"]: record["row"] for record in records(swept)}
    begun = rows[1]["ledger_pulse"]
    assert 0.0 < begun < rows[0]["ledger_pulse"]
    assert begun == pytest.approx(rows[0]["ledger_energy"], rel=0.01)
    assert rows[1]["force"] == rows[0]["force"] > 0.0
    assert rows[1]["speed"] == 320.0


def test_a_case_alone_is_that_of_the_campaign(swept):
    rows = {record["case"]: record["row"] for record in records(swept)}
    design = Design.of(TABLES)
    for case in (2, 9):
        assert told(simulate(design.scene(case)).row) == told(rows[case])


def test_the_command_of_a_case_gives_its_result(swept, tmp_path, capsys):
    file = tmp_path / "scene.toml"
    given = {name: TABLES[name] for name in ("scene", "engine", "output")}
    file.write_text(tomli_w.dumps(given))
    sets = ["speed=320", "friction=0.2", "branch=up", "history=speed = 300.0"]
    words = [word for one in sets for word in ("--set", one)]
    assert main(["run", str(file), *words, "--json", "--quiet"]) == 0
    found = json.loads(capsys.readouterr().out)
    row = {record["case"]: record["row"] for record in records(swept)}[7]
    assert found["contacts"] == row["contacts"]
    assert found["orbit_radius"] == row["orbit_radius"]


def test_only_the_last_of_a_branch_leaves_its_motion(swept):
    design = Design.of(TABLES)
    lasts = {f"{design.digest(case)}-end" for case in (2, 5, 8, 11)}
    assert States(swept).names() == lasts


def test_motions_that_no_case_needs_any_more_are_removed(swept, tmp_path):
    """A kill between the record of a case and their removal leaves them."""
    out = Path(shutil.copytree(swept, tmp_path / "out"))
    states = States(out)
    last = states.names()
    source = out / "states" / f"{min(last)}.state"
    every = {f"{record['digest']}-end" for record in records(out)}
    for name in every - last:
        shutil.copyfile(source, out / "states" / f"{name}.state")
    assert len(states.names()) == 12
    with hpcwhirl.campaign(TABLES, out):
        pass  # nothing is left to compute
    assert states.names() == last


def test_a_motion_stays_while_a_case_that_begins_with_it_is_to_come(swept, tmp_path):
    out = Path(shutil.copytree(swept, tmp_path / "out"))
    design = Design.of(TABLES)
    second = next(n for n in range(12) if computation(design, Job(n, 0, 0)).follows)
    before = f"{computation(design, Job(second, 0, 0)).follows}-end"
    states = States(out)
    source = out / "states" / f"{min(states.names())}.state"
    shutil.copyfile(source, out / "states" / f"{before}.state")
    told = SimpleNamespace(open=np.arange(12) == second, failed=np.zeros(12, bool))
    tidy_ends(design, states, told)
    assert before in states.names()
    told.open, told.failed = told.failed, told.open
    tidy_ends(design, states, told)
    assert before in states.names()
    told.failed = told.open
    tidy_ends(design, states, told)
    assert before not in states.names()


@pytest.mark.turns
def test_what_is_lost_on_the_way_is_computed_again_with_the_same_bits(swept, tmp_path):
    out, rows = tmp_path / "out", records(swept)
    some = {"speed": TABLES["sweep"]["speed"][:2], "friction": [0.2]}
    up = {"over": "speed", "directions": "up"}
    with hpcwhirl.campaign(tables(sweep=some, branch=up), out):
        shutil.rmtree(out / "states")
    (out / "states").mkdir()
    whole = TABLES["sweep"] | {"friction": [0.2]}
    with hpcwhirl.campaign(tables(sweep=whole, branch=up), out):
        found = {record["digest"]: told(record["row"]) for record in records(out)}
    true = {record["digest"]: told(record["row"]) for record in rows}
    assert len(found) == 3
    assert all(true[name] == row for name, row in found.items())


class Kept(dict):
    """Last motions by digest."""

    def read(self, name):
        return name in self, self.get(name)

    def keep(self, name, motion):
        self[name] = motion


def test_what_is_computed_again_is_kept_for_the_cases_after_it():
    scenes, ends, made = Design.of(TABLES).scenes, Kept(), []

    def march(case, _):
        made.append(digest(case.given))
        end = SimpleNamespace(motion=lambda name=made[-1]: f"end of {name}")
        return {"outcome": "completed", "regime": "damped"}, end

    before = [digest(scene) for scene in scenes[:2]]
    for _ in range(2):
        _, motion = begun(resolve(scenes[2]), march, ends)
        assert motion == f"end of {before[1]}"
        assert made == before  # once
    assert [*ends] == before


def test_after_a_case_that_leaves_no_motion_a_branch_begins_anew():
    sweep = {"force": [75e3, 8e7], "speed": [300.0]}
    given = tables(sweep=sweep, branch={"over": "force", "directions": "down"})
    design = Design.of(given)
    first, second = (simulate(scene) for scene in design.scenes)
    assert first.row["stop"] == "amplitude"
    alone = simulate(Scene.model_validate(design.scene(1).model_dump() | {
        "branch": "", "history": "",
    }))  # fmt: skip
    assert told(second.row) == told(alone.row)


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"branch": {"over": "gap"}}, "over must be a numeric input of [sweep], got"),
        ({"branch": {}}, "over"),
        ({"branch": {"over": "speed", "starts": [310]}}, "starts must be values of"),
        (
            {"branch": {"over": "speed", "starts": [320] * 9000}},
            "starts must be different values, got 320.0 9000 times",
        ),
        ({"branch": {"over": "speed", "directions": "left"}}, "both"),
        ({"refine": {"over": "speed", "levels": 1}}, "words must be 'branch' with"),
        ({"refine": ALONG | {"over": "friction"}}, "over must be speed, as in"),
        ({"refine": ALONG | {"confirm": "draft"}}, "confirm must not be set with"),
        ({"twins": {"count": 2}}, "not with [twins]"),
        ({"cases": [{"speed": 1.0}]}, "not with [cases]"),
        ({"sweep": {"speed": [300.0]}}, "speed needs 2 to 1000 different values"),
        ({"scene": {"history": "speed 300"}}, "must be an input and its values"),
    ],
)
def test_what_branches_cannot_do_is_refused(changed, words):
    with pytest.raises(InputError) as refused:
        Design.of(tables(**changed))
    assert words in str(refused.value)


def test_shards_and_extensions_are_refused(swept, tmp_path):
    with pytest.raises(InputError, match=r"\[branch\] begins each case where"):
        Design.of(TABLES).check_shards("no --shard")
    shutil.copytree(swept, tmp_path / "out")
    done = launch("campaign", tmp_path / "out", "--extend", "undecided", "--to", "1")
    assert done.returncode == 2
    assert "[branch]" in done.err


@pytest.fixture(scope="module")
def folded(tmp_path_factory):
    """Branches of an engine that is sustained up to some 500 rad/s, and their folds."""
    out = tmp_path_factory.mktemp("folded") / "out"
    with hpcwhirl.campaign(FOLDED, out):
        return out


@pytest.mark.turns
def test_a_fold_is_bisected_and_its_cases_go_on_from_the_last_before_it(folded):
    design = Design.of(FOLDED)
    with Results(folded) as results:
        _, (branch,) = branches_of(results)
        own = [results.plan.settings[case] for case in branch.cases]
    assert branch.values.tolist() == sorted({*branch.values})
    assert len(own) > len(design.settings) + 2
    fold = changes_of(branch)[0]
    assert (fold.word, fold.kind) == ("sustained", "fold")
    assert fold.first - fold.last == 40.0 / 2**3
    rows = {record["digest"]: record["row"] for record in records(folded)}
    within = [one for one in own if fold.last <= one["speed"] <= fold.first]
    for settings in within:  # the motion follows from the inputs alone
        scene = apply_settings(design.base, settings)
        assert told(simulate(scene).row) == told(rows[digest(scene)])
        _, before = parsed(settings["history"])
        assert before[-1] < settings["speed"]
        assert digest(case_before(scene)) in rows
    assert States(folded).names() == {f"{name}-end" for name in rows}  # others follow


@pytest.mark.slow
def test_a_branch_is_refined_further_without_computing_a_case_again(folded, tmp_path):
    out = Path(shutil.copytree(folded, tmp_path / "out"))
    finer = FOLDED | {"refine": FOLDED["refine"] | {"levels": 4}}
    with hpcwhirl.campaign(finer, out):
        digests = [record["digest"] for record in records(out)]
    assert len(digests) == len({*digests}) > len(records(folded))
    assert main(["map", str(out), "--out", str(tmp_path)]) == 0
    assert main(["figures", str(out), "--kind", "branches"]) == 0
    shutil.rmtree(out / "states")  # motions that are lost are computed again
    (out / "states").mkdir()
    finest = FOLDED | {"refine": FOLDED["refine"] | {"levels": 5}}
    fresh = tmp_path / "fresh"
    for place in (out, fresh):
        with hpcwhirl.campaign(finest, place):
            pass
    assert root_variables(out) == root_variables(fresh)


MADE_UP = {  # words of a branch up and of one down over speed
    "up": ["damped", "damped", "sustained"],
    "down": ["sustained", "sustained", "damped"],
}


def test_folds_are_where_words_change_and_differ_where_branches_do():
    lines = [made_up(*line) for line in MADE_UP.items()]
    found = [changes_of(line) for line in lines]
    assert [[fold[1:6] for fold in folds] for folds in found] == [
        [(2.0, 3.0, "damped", "sustained", "fold")],
        [(2.0, 1.0, "sustained", "damped", "fold")],
    ]
    assert count_differences(lines) == (1, 3)
    assert count_differences(lines[:1]) == (0, 0)


def made_up(name, words):
    values = np.arange(1.0, 1.0 + len(words))
    values = values if name == "up" else values[::-1]
    return Branch(name, {}, [*range(len(words))], values, words, np.full(len(words), 1))


@pytest.mark.parametrize(
    ("letters", "told"),
    [
        ("dd?SS", ["2 4 fold"]),  # the fold lies somewhere in the undecided ones
        ("dd??SX", ["2 5 fold", "5 6 fold"]),
        ("??SS", ["2 3 open"]),  # a matter of the duration
        ("SS?SS", ["2 3 open", "3 4 open"]),
        ("SLLS", ["1 2 open", "3 4 open"]),
        ("?L", ["1 2 open"]),
    ],
)
def test_a_change_from_or_to_an_open_case_is_no_fold(letters, told):
    known = {look.letter: word for word, look in SHOWN.items()}
    branch = made_up("up", [known[letter] for letter in letters])
    found = [f"{c.last:g} {c.first:g} {c.kind}" for c in changes_of(branch)]
    assert found == told


def test_an_open_case_beside_a_damped_one_is_no_hysteresis():
    lines = [made_up("up", ["damped", "undecided", "sustained"]),
             made_up("down", ["undecided", "damped", "damped"])]  # fmt: skip
    assert count_differences(lines) == (0, 1)


def test_refinement_of_branches_leaves_open_changes_alone():
    rows = [{"regime": w, "whirl": "mixed"} for w in ("undecided", "sustained")]
    assert [word_of("branch", row) for row in rows] == ["sustained", "sustained"]
    assert [word_of("regime", row) for row in rows] == ["undecided", "sustained"]


@pytest.mark.turns
def test_the_table_and_the_figure_of_branches_are_those_of_the_campaign(swept, capsys):
    assert main(["branches", str(swept), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["over"] == "speed"
    assert told["points"] == 0  # all are undecided after 20 ms
    assert {change["kind"] for change in told["changes"]} <= {"open"}
    assert main(["figures", str(swept), "--kind", "branches"]) == 0
    drawn = capsys.readouterr().out.split()
    assert [Path(path).name for path in drawn] == [
        "branches-friction=0.0.png", "branches-friction=0.2.png",
    ]  # fmt: skip
    with Results(swept / "results.h5") as results:
        figure = draw_branches(results, [*np.flatnonzero(results["friction"] == 0.2)])
    assert figure.axes[0].get_title() == "Branches: μ = 0.2"
    assert main(["branches", str(swept), "--at", "friction=0.2"]) == 0
    assert "of 0 points" in capsys.readouterr().out
