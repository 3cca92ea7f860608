"""An extended campaign holds what one does that went on by itself."""

import json
from dataclasses import replace

import pytest
import tomli_w
from common import on_engine
from deaths import until_it_lives
from launch import launch, root_variables

import hpcwhirl
from hpcwhirl.campaign.begin import Policy, planned, prepare
from hpcwhirl.campaign.plan.design import design_of
from hpcwhirl.campaign.progress import progress_of
from hpcwhirl.campaign.run import run_campaign
from hpcwhirl.campaign.simulate import simulate
from hpcwhirl.cli import main
from hpcwhirl.launch import Shard
from hpcwhirl.scene import apply_settings
from hpcwhirl.store.directory.campaign_directory import Directory
from hpcwhirl.store.directory.journal import Journals
from hpcwhirl.store.directory.manifest import MEASURE, PlanFile
from hpcwhirl.store.directory.states import States

pytestmark = pytest.mark.turns

SPEEDS = [330.0, 400.0, 430.0]  # decided at 0.4 s, not by 0.8 s, at 0.8 s
TABLES = {
    "scene": {"duration": 0.1},
    "solver": {"time_step": 4e-6},
    "output": {"interval": 1e-3},
    "sweep": {"speed": SPEEDS},
    "cases": [{"speed": 330.0, "force": 0.0}],
}
FIRST = on_engine("mostly_damped", TABLES)
KEEP = Policy(keep_states=True)


def run(folder, extend=None, policy=KEEP, **solver):
    document = FIRST | {"solver": FIRST["solver"] | solver}
    design = design_of(document)
    prepare(design, Directory(folder), extend)
    ending = run_campaign(design, Directory(folder), policy=policy)
    assert ending.complete
    return root_variables(folder), ending


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """Return the variables of a campaign that went on to 0.8 s by itself."""
    found, ending = run(tmp_path_factory.mktemp("w"), until="decided", longest=0.8)
    assert ending.failed == 0
    return found


def test_the_campaign_has_words_of_each_stage(tmp_path):
    run(tmp_path, until="decided", longest=0.8)
    data = hpcwhirl.open_results(tmp_path)
    assert set(data.duration.values) >= {0.1, 0.4, 0.8}
    assert "undecided" in hpcwhirl.words(data.regime)


@pytest.mark.parametrize("keep", [True, False])
def test_an_extended_campaign_is_one_that_went_on_by_itself(
    whole, tmp_path, steps_of, keep
):
    policy = Policy(keep_states=keep)
    first, _ = run(tmp_path, policy=policy)
    assert set(hpcwhirl.open_results(tmp_path).duration.values) == {0.1}
    assert bool(States(tmp_path).names()) == keep
    made = steps_of()
    later, ending = run(tmp_path, 0.8, policy=policy)
    assert ending.failed == 0
    assert later == whole != first
    alone = sum(made)
    made.clear()
    # the command it was begun with neither computes anything again nor takes it back
    assert run(tmp_path, policy=policy)[0] == whole
    assert run(tmp_path, 0.8, policy=policy)[0] == whole
    assert made == []
    steps = sum(
        r["row"]["steps"] for r in Journals(tmp_path).newest().values() if "of" in r
    )
    opened = sum("of" in record for record in Journals(tmp_path).newest().values())
    assert (alone < steps - opened * 20_000) == keep


def test_a_campaign_extended_twice_goes_on_from_where_it_was(tmp_path):
    run(tmp_path)
    run(tmp_path, 0.3)
    run(tmp_path, 0.8)
    assert PlanFile(tmp_path).read().extended == [0.3, 0.8]
    # 0.3 s is no time that the other was asked at: what is decided then, stays
    rows = hpcwhirl.open_results(tmp_path)
    early = rows.duration.values == 0.3
    assert early.any()
    assert "undecided" not in set(hpcwhirl.words(rows.regime)[early])
    for case, record in enumerate(rows.duration.values):
        asked = {"duration": float(record), "speed": float(rows.speed[case])}
        asked |= {"force": float(rows.force[case])}
        scene = apply_settings(planned(PlanFile(tmp_path)).base, asked)
        row = simulate(scene).row
        for name, value in row.items():
            kept = rows[name].values[case]
            if isinstance(value, float | int):
                assert kept == value, name


@pytest.mark.slow
@pytest.mark.parametrize("after", [8, 20])
def test_a_kill_in_the_middle_of_an_extension_changes_no_bit(
    whole, tmp_path, monkeypatch, after
):
    run(tmp_path)
    often = Policy(save_every=1e-9)
    (found, _), deaths = until_it_lives(
        monkeypatch, after, lambda: run(tmp_path, 0.8, often)
    )
    assert deaths > 1
    assert found == whole


def test_one_that_fails_to_go_on_keeps_its_row_and_is_told(tmp_path):
    first, _ = run(tmp_path)
    told = Policy(keep_states=True, case_limit=1e-9)
    found, ending = run(tmp_path, 0.8, told)
    assert ending.failed > 0
    assert found == first
    progress = progress_of(Directory(tmp_path))
    assert (progress.failed, progress.left) == (ending.failed, 0)
    # and goes on, from its state, once it may
    retry = Policy(keep_states=True, retry=frozenset({"timeout"}))
    _, ending = run(tmp_path, 0.8, retry)
    assert ending.failed == 0
    assert progress_of(Directory(tmp_path)).failed == 0
    assert "undecided" in set(hpcwhirl.words(hpcwhirl.open_results(tmp_path).regime))


def test_progress_counts_what_is_still_to_go_on(tmp_path):
    run(tmp_path)
    assert progress_of(Directory(tmp_path)).left == 0
    prepare(design_of(FIRST), Directory(tmp_path), 0.8)
    before = progress_of(Directory(tmp_path))
    assert before.left == before.words["undecided"] > 0
    run(tmp_path)
    after = progress_of(Directory(tmp_path))
    assert after.left == 0
    assert after.words["undecided"] < before.words["undecided"]


def test_states_are_left_of_what_is_undecided_alone(tmp_path):
    run(tmp_path, 0.8)
    rows = Journals(tmp_path).newest()
    kept = States(tmp_path).names()
    assert {rows[name]["row"]["regime"] for name in kept} == {"undecided"}
    assert all(rows[name]["longest"] == 0.8 for name in kept)


LINES = {
    "--extend undecided": "--extend undecided and --to SECONDS belong together",
    "--to 3": "--extend undecided and --to SECONDS belong together",
    "--extend undecided --to -1": "--to must be a number of seconds > 0, got -1",
    "--extend undecided --to 0.1": "--to must be > 0.1 s, the planned end of all cases",
    "--extend undecided --to 0.2": "--to must be >= 0.3 s, to which",
    "--extend undecided --to 1 --set speed=3": "cannot go with the directory",
    "--extend undecided --to 1 --out other": "--out cannot go with the directory",
    "": "without --extend, name the campaign's file",
}


@pytest.fixture(scope="module")
def begun(tmp_path_factory):
    place = tmp_path_factory.mktemp("begun")
    prepare(design_of(FIRST), Directory(place))
    return place


@pytest.mark.parametrize("words", LINES)
def test_a_wrong_extension_is_one_line_and_changes_nothing(words, begun, capsys):
    if "0.2" in words:
        prepare(design_of(FIRST), Directory(begun), 0.3)
    plan = (begun / "campaign.json").read_bytes()
    assert main(["campaign", str(begun), *words.split()]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert LINES[words] in line
    assert (begun / "campaign.json").read_bytes() == plan


def test_a_dry_run_tells_what_the_extension_costs(tmp_path, capsys):
    run(tmp_path)
    words = ("--extend", "undecided", "--to", "0.8", "--json", "--dry-run")
    assert main(["campaign", str(tmp_path), *words]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["left"] == progress_of(Directory(tmp_path)).words["undecided"]
    # from 0.1 s to 0.2 s at least, to 0.8 s at most
    assert told["core_hours_most"] == pytest.approx(7 * told["core_hours"], rel=1e-2)
    assert PlanFile(tmp_path).read().extended == []


def test_the_last_shard_to_go_on_has_the_results_of_all(whole, tmp_path):
    run(tmp_path)
    design, ends = design_of(FIRST), []
    prepare(design, Directory(tmp_path), 0.8)
    for number in (1, 2):
        policy = Policy(shard=Shard(number, 2))
        ends.append(run_campaign(design, Directory(tmp_path), policy=policy))
    assert ends[0].left > 0
    assert (ends[1].left, ends[1].failed) == (0, 0)
    assert root_variables(tmp_path) == whole


@pytest.mark.slow
@pytest.mark.mpi
@pytest.mark.parametrize("words", [(), ("--isolate",)])
def test_two_ranks_extend_to_the_same_bits(whole, tmp_path, words):
    run(tmp_path)
    done = launch(
        *("campaign", tmp_path, "--extend", "undecided", "--to", "0.8"),
        *("--map=no", "--report=no", *words),
        ranks=2,
    )
    assert done.returncode == 0, done.err
    assert root_variables(tmp_path) == whole


def test_the_directory_alone_is_enough(whole, tmp_path, capsys):
    run(tmp_path)
    words = ["--extend", "undecided", "--to", "0.8", "--json", "--report=no"]
    assert main(["campaign", str(tmp_path), *words, "--map=no"]) == 0
    assert json.loads(capsys.readouterr().out)["failed"] == 0
    assert root_variables(tmp_path) == whole


def test_a_sampled_campaign_goes_on_by_its_directory(tmp_path):
    law = {"distribution": "uniform", "low": 7e4, "high": 8e4}
    tables = {n: t for n, t in FIRST.items() if n != "cases"}
    tables |= {"sweep": {"speed": [330.0]}, "sample": {"count": 2, "force": law}}
    design = design_of(tables)
    prepare(design, Directory(tmp_path))
    run_campaign(design, Directory(tmp_path))
    before = PlanFile(tmp_path).read()
    words = ("--extend", "undecided", "--to", "0.2", "--report", "no", "--map=no")
    assert main(["campaign", str(tmp_path), *words]) == 0
    after = PlanFile(tmp_path).read()
    assert after == replace(before, extended=[0.2])
    prepare(design, Directory(tmp_path))
    assert PlanFile(tmp_path).read() == after


def test_a_measured_campaign_is_not_extended_without_its_function(tmp_path, capsys):
    plan = design_of(FIRST).manifest()
    PlanFile(tmp_path).write(replace(plan, base=plan.base | {MEASURE: {"a": ["", ""]}}))
    words = ("--extend", "undecided", "--to", "0.2")
    assert main(["campaign", str(tmp_path), *words]) == 2
    assert "numbers of a user's function" in capsys.readouterr().err


def test_cases_of_words_alone_go_on_until_they_have_one(tmp_path):
    file, out = tmp_path / "c.toml", tmp_path / "out"
    solver = FIRST["solver"] | {"until": "decided", "longest": 0.8}
    tables = FIRST | {"sweep": {"speed": [330.0, 430.0]}, "solver": solver}
    file.write_text(tomli_w.dumps({n: t for n, t in tables.items() if n != "cases"}))
    words = ("--regimes-only", "--out", str(out), "--report", "no", "--map=no")
    assert main(["campaign", str(file), *words]) == 0
    data = hpcwhirl.open_results(out)
    assert "centre" not in data
    assert list(data.duration.values) == [0.4, 0.8]
