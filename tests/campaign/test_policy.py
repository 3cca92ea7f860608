"""Limits, retries, starting over, and campaigns that get more cases."""

import re
from pathlib import Path

import pytest
from launch import BARE, launch, records, root_variables

from hpcwhirl.campaign.begin import Policy
from hpcwhirl.campaign.compute import Checkpoints, compute
from hpcwhirl.campaign.finalize import Ending
from hpcwhirl.campaign.plan.design import design_of, load_design
from hpcwhirl.campaign.simulate import simulate
from hpcwhirl.case.resolve import resolve
from hpcwhirl.cli import main
from hpcwhirl.dynamics import march as marching
from hpcwhirl.dynamics.march import March
from hpcwhirl.errors import InputError
from hpcwhirl.scene import Scene, apply_settings, engine_inputs, engine_names, flatten
from hpcwhirl.scene.campaign_tables import Campaign
from hpcwhirl.scene.table_model import key_of
from hpcwhirl.store.directory.states import States
from hpcwhirl.store.reading.results_file import Results

SHORT = """
scene = {duration = 4e-3}
solver = {time_step = 2e-6}
output = {interval = 5e-5}
"""
SPEEDS = "sweep = {speed = [300, 410]}\n"
COARSE = "sweep = {time_step = [2e-5, 1e-6, 3e-5, 2e-6]}\n"  # the first and third fail
LATE = """
scene = {duration = 1.0}
output = {interval = 1e-2}
sweep = {time_step = [1e-6, 8e-6]}
campaign = {case_limit = 1e-4}
"""


@pytest.fixture
def run(tmp_path, capsys):
    """Return a function: TOML, options -> (exit code, stderr), always in `out`."""

    def integrate(text, *options, bare=("--map=no", "--report=no")):
        (tmp_path / "c.toml").write_text(text)
        words = ["campaign", str(tmp_path / "c.toml"), "--out", str(tmp_path / "out")]
        return main([*words, *bare, *options]), capsys.readouterr().err

    return integrate


def statuses(folder):
    return [row["status"] for row in Results(folder).rows]


@pytest.mark.slow
def test_a_late_case_is_a_row_and_goes_on_when_it_may(run, tmp_path):
    out = tmp_path / "out"
    code, err = run(LATE)
    assert code == 1
    assert "case 0 timeout on " in err
    assert statuses(out) == ["timeout", "timeout"]
    message = Results(out).rows[0]["message"]
    assert message.startswith("more than 0.0001 s of computing, ")
    kept = records(out)
    assert all(record["performance"]["seconds"] > 1e-4 for record in kept)
    assert {"rank", "host"} <= kept[0]["performance"].keys()
    assert len(list(out.glob("states/*"))) == 2
    assert run(LATE)[0] == 1
    assert records(out) == kept
    assert run(LATE, "--retry", "failed")[0] == 1
    assert records(out) == kept
    assert run(LATE, "--retry", "timeout", "--case-limit", "1e6")[0] == 0
    assert statuses(out) == ["ok", "ok"]
    assert not list(out.glob("states/*"))
    cut = root_variables(out)
    code, err = run(LATE.partition("campaign")[0], "--fresh")
    assert code == 0
    assert f"is now {tmp_path}/out.1" in err
    assert root_variables(out) == cut
    assert root_variables(tmp_path / "out.1") == cut


class Clock:
    """A clock that only calls of a kernel move: by a day at the first of a run."""

    def __init__(self):
        self.now, self.calls = 0.0, []

    def perf_counter(self):
        return self.now

    @property
    def call_of(self):
        """`March._call`, which a patched class binds to a march."""
        own = March._call

        def call(march, steps):
            self.now += 1.0 if self.calls else 86400.0
            self.calls.append(steps)
            own(march, steps)

        return call


@pytest.mark.parametrize("history", ["", "speed = 320.0"])
def test_the_time_in_which_kernels_compile_is_not_that_of_a_case(
    tmp_path, monkeypatch, history
):
    case = resolve(
        apply_settings(Scene(), {"duration": 1e-3, "speed": 330.0, "history": history})
    )
    expected, clock = simulate(case.given), Clock()
    monkeypatch.setattr(marching, "_slices", {})  # as in a process that begins
    monkeypatch.setattr(marching, "time", clock)
    monkeypatch.setattr(March, "_call", clock.call_of)
    store = Checkpoints(States(tmp_path), 1e9, [].append)
    found = compute(case, "d", store, 3600.0, lambda: None)
    assert clock.calls[0] == 0
    assert found.row == expected.row
    assert 0.0 < found.performance["seconds"] < 3600.0


@pytest.mark.turns
@pytest.mark.parametrize(("option", "kept"), [("--fail-fast", 3), ("--max-fails=2", 4)])
def test_too_many_failures_end_a_campaign_and_keep_it(run, tmp_path, option, kept):
    text = SHORT.replace("time_step = 2e-6", "") + COARSE
    code, err = run(text, option)
    assert code == 1
    found = records(tmp_path / "out")
    assert [record["status"] for record in found].count("failed") == kept - 2
    assert "without a result" in err or kept == 4
    assert run(text)[0] == 1
    assert statuses(tmp_path / "out") == ["failed", "ok", "failed", "ok"]


@pytest.mark.turns
def test_starting_over_deletes_nothing(run, tmp_path, monkeypatch):
    out = tmp_path / "out"
    assert run(SHORT + SPEEDS, "--fresh")[0] == 0
    assert not (tmp_path / "out.1").exists()
    old = {p.relative_to(out): p.read_bytes() for p in out.rglob("*") if p.is_file()}
    (tmp_path / "out.1").touch()
    assert run(SHORT + SPEEDS, "--set", "gap=2e-4")[0] == 2
    code, err = run(SHORT + SPEEDS, "--set", "gap=2e-4", "--fresh")
    assert code == 0
    aside = tmp_path / "out.2"
    assert f"the former {out} is now {aside}" in err
    for path, content in old.items():
        assert (aside / path).read_bytes() == content
    assert len(records(out)) == 2
    monkeypatch.chdir(out / "journal")
    code, err = run(SHORT + SPEEDS, "--fresh")
    assert code == 2
    assert "must not be the working directory" in err
    assert (out / "campaign.json").exists()


@pytest.mark.slow
def test_a_campaign_may_get_more_cases_and_inputs_to_sweep(run, tmp_path):
    out = tmp_path / "out"
    assert run(SHORT + "sweep = {speed = [300]}")[0] == 0
    first = records(out)
    assert run(SHORT + "sweep = {speed = [410, 300]}")[0] == 0
    assert run(SHORT + "sweep = {speed = [410, 300], gap = [1.28e-4, 2e-4]}")[0] == 0
    assert records(out)[0] == first[0]
    assert len(records(out)) == 4
    assert statuses(out) == ["ok"] * 4
    code, err = run(SHORT + "sweep = {speed = [410], friction = [0.2, 0.3]}")
    assert code == 2
    assert "a sweep over" in err
    text = "sweep = {speed = [300], gap = [1.28e-4], friction = [0.2, 0.3, 0.4, 0.5]}"
    code, err = run(SHORT + text)
    assert code == 2
    assert "was begun with friction = 0.1, got 0.2 or 0.3 or 0.4 ...: " in err
    assert "--fresh" in err


@pytest.mark.turns
def test_what_the_command_refuses_its_forecast_tells_and_job_refuses(run, tmp_path):
    assert run(SHORT + "sweep = {speed = [300]}")[0] == 0
    other = SHORT.replace("4e-3", "4e-3, gap = 2e-4") + "sweep = {speed = [300]}"
    refused = run(other)
    assert refused[0] == 2
    assert "was begun with gap = 0.000128, got 0.0002" in refused[1]
    code, told = run(other, "--dry-run")
    assert code == 0
    assert refused[1].removeprefix("hpcwhirl: error: ").strip() in told
    file = str(next(tmp_path.glob("*.toml")))
    assert main(["job", "slurm", file, "--out", str(tmp_path / "out")]) == 2
    assert run(other, "--dry-run", "--fresh")[0] == 0


@pytest.mark.turns
def test_cases_that_a_list_has_no_more_are_told_and_come_back(run, tmp_path):
    out = tmp_path / "out"
    whole = SHORT + "sweep = {speed = [300, 410, 420]}"
    assert run(whole)[0] == 0
    code, err = run(SHORT + "sweep = {speed = [300, 430]}")
    assert code == 0
    assert f"2 cases of {out} left out" in err
    assert len(statuses(out)) == 2
    code, err = run(whole)
    assert "1 case of" in err
    assert "3 cases, 3 already computed" in err
    assert len(statuses(out)) == 3


@pytest.mark.turns
@pytest.mark.parametrize(
    ("named", "told"),
    [
        ("", "was begun with engine.name = 'mostly_damped', got 'four_motions'"),
        (
            "engine.name = 'mostly_damped'\n",
            "'mostly_damped' is a label and sets no inputs",
        ),
        (
            "engine.name = 'mostly-damped'\n",  # a slip
            "'mostly-damped' is a label and sets no inputs: the inputs of",
        ),
        (
            "engine.name = 'salvat2016'\n",
            "must be in the file, as in jobs/mostly_damped",
        ),
    ],
)
def test_another_default_engine_is_refused_by_name(run, tmp_path, named, told):
    given = "".join(
        f"{name} = {value!r}\n"
        for name, value in engine_inputs("mostly_damped").items()
        if name.startswith("engine.")
    )
    assert run(given + SHORT + SPEEDS)[0] == 0
    before = records(tmp_path / "out")
    code, err = run(named + SHORT + SPEEDS)
    assert code == 2
    assert told in err
    assert run(given + SHORT + SPEEDS)[0] == 0
    assert records(tmp_path / "out") == before


@pytest.mark.parametrize("name", [n for n in engine_names() if n != "four_motions"])
def test_the_refusal_of_a_bare_label_points_to_a_file_that_has_the_inputs(name):
    with pytest.raises(InputError) as refused:
        design_of({"engine": {"name": name}, "sweep": {"speed": [300.0]}})
    job = re.search(
        r"as in (jobs/\S+toml); hpcwhirl inputs engines", str(refused.value)
    )
    base = load_design(Path(__file__).parents[2] / job[1], {}).base
    own = flatten(base)
    assert all(own[n] == value for n, value in engine_inputs(name).items())


def test_another_model_version_is_refused_by_name(run, monkeypatch):
    assert run(SHORT + SPEEDS)[0] == 0
    monkeypatch.setattr("hpcwhirl.campaign.plan.design.PHYSICS_VERSION", 99)
    code, err = run(SHORT + SPEEDS)
    assert code == 2
    assert "was begun with physics version = " in err
    assert ", got 99" in err


def test_a_case_without_a_result_has_the_time_that_its_revolutions_take(run, tmp_path):
    text = "scene = {revolutions = 1}\n[sweep]\ntime_step = [2e-5, 5e-6]\n"
    assert run(text)[0] == 1
    failed, ok = Results(tmp_path / "out").rows
    assert failed["status"] == "failed"
    assert failed["duration"] == ok["duration"] == pytest.approx(0.0153248, rel=1e-5)


@pytest.mark.parametrize(
    ("rules", "told"),
    [
        ({"case_limit": 0}, "case_limit must be a number of seconds > 0, got 0"),
        ({"case_limit": "1 h"}, "got '1 h'"),
        ({"case_limit": float("inf")}, "got inf"),
        ({"case_limit": float("nan")}, "got nan"),
        ({"max_fails": 0}, "max_fails must be a whole number > 0, got 0"),
        ({"max_fails": True}, "got True"),
        ({"max_fails": 1.5}, "got 1.5"),
        ({"isolate": 1}, "isolate must be true or false, got 1"),
        ({"save_every": -1}, "save_every must be a number of seconds > 0"),
        ({"out": ""}, r"\[campaign\] out must be the path of a directory, got ''"),
        ({"out": 3}, "got 3"),
        ({"walltime": "1 h"}, r"\[campaign\] walltime must be HH:MM:SS, .*got '1 h'"),
        ({"walltime": 60}, 'walltime must be a text such as "01:50:00", got 60'),
        ({"retry": "fail"}, r"\[campaign\] retry 'fail'; did you mean 'failed'"),
        ({"retry": [1]}, "retry must be failed, timeout, crashed, or a list"),
        ({"report": "yess"}, r"\[campaign\] report 'yess'; did you mean 'yes'"),
        ({"report": True}, "report must be one of auto, yes, no, got True"),
        ({"map": "auto"}, "map must be one of yes, no, got 'auto'"),
        ({"wall_time": "1:00:00"}, "'wall_time'; did you mean 'walltime'"),
        ({"limit": 1}, "unknown key in .campaign. 'limit'; did you mean 'case_limit'"),
    ],
)
def test_rules_that_mean_nothing_are_refused(rules, told):
    with pytest.raises(InputError, match=told):
        Campaign.read(rules, "[campaign]")


IN_FILE = """
[campaign]
out = "there"
walltime = "00:00:50"
retry = ["failed,timeout", "crashed"]
report = "no"
max_fails = 7
"""


@pytest.fixture
def called(tmp_path, monkeypatch):
    """Return a function: words -> (design, directory, policy) of a campaign's call."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "c.toml").write_text(SHORT + SPEEDS + IN_FILE)
    seen = []

    def instead(design, directory, _, policy, *__):
        seen.append((design, directory.path, policy))
        return Ending(complete=True, cases=2, failed=0, results=None, left=1)

    monkeypatch.setattr("hpcwhirl.campaign.run.run_campaign", instead)

    def call(*words):
        assert main(["campaign", "c.toml", "--shard", "1/2", *words]) == 0
        return seen[-1]

    return call


def test_options_of_a_campaign_may_stand_in_its_file_and_are_no_inputs(called):
    design, folder, policy = called()
    assert folder.name == "there"
    assert policy.retry == {"failed", "timeout", "crashed"}
    assert 0 < policy.seconds <= 45.0  # a tenth is kept free
    assert policy.max_fails == 7
    bare = load_design(None, {}).base
    assert set(flatten(design.base)) == set(flatten(bare))
    (folder.parent / "bare.toml").write_text(SHORT + SPEEDS)
    assert load_design(folder.parent / "bare.toml", {}).digests == design.digests


def test_options_count_over_those_of_the_file(called):
    words = ["--out", "here", "--walltime", "01:00:00", "--retry", "crashed"]
    _, folder, policy = called(*words, "--max-fails", "2")
    assert folder.name == "here"
    assert policy.retry == {"crashed"}
    assert policy.seconds > 3000.0
    assert policy.max_fails == 2


@pytest.mark.turns
def test_map_and_page_are_written_as_the_file_wants_it(run, tmp_path):
    text = SHORT + "sweep = {speed = [300]}\n" + BARE
    pictures, page = {"map.png", "map.svg"}, {"report.html"}
    for words, made in (
        ([], set()), (["--report=yes"], page), (["--map=yes"], page | pictures),
    ):  # fmt: skip
        assert run(text, *words, bare=())[0] == 0
        there = {path.name for path in (tmp_path / "out").iterdir()}
        assert there & (pictures | page) == made


@pytest.mark.mpi
@pytest.mark.parametrize("words", [[], ["--map=no", "--report=no"]], ids=len)
def test_two_ranks_draw_no_more_than_the_file_or_the_command_wants(words, tmp_path):
    file = tmp_path / "c.toml"
    bare = "" if words else BARE
    file.write_text(SHORT + "sweep = {speed = [300, 310]}\n" + bare)
    done = launch("campaign", file, "--out", tmp_path / "out", *words, ranks=2)
    assert done.returncode == 0, done.err
    there = {path.name for path in (tmp_path / "out").iterdir()}
    assert "results.h5" in there
    assert not there & {"map.png", "map.svg", "report.html"}


@pytest.mark.turns
def test_a_map_of_earlier_results_is_told_of(run):
    one, two = (
        f"{SHORT}sweep = {{speed = {speeds}}}\n" for speeds in ([300], [300, 410])
    )
    code, err = run(one, bare=["--report=no"])
    assert code == 0
    assert "earlier results" not in err  # the map is of those just gathered
    for text, told in ((one, False), (two, True)):
        code, err = run(text)
        assert code == 0
        assert ("are of earlier results" in err) == told


@pytest.mark.parametrize("given", ["2", 2.5, 2.0, True])
def test_a_number_of_a_table_is_no_text_and_no_truth(given):
    refused = "must be a whole number"
    with pytest.raises(InputError, match=f"max_fails {refused} > 0, got"):
        Campaign.read({"max_fails": given}, "campaign")
    table = {"sample": {"count": given, "speed": {"from": 300.0, "to": 400.0}}}
    with pytest.raises(InputError, match=f"count {refused} from 1 to"):
        design_of(table)


def test_what_is_tried_again_is_a_list():
    words = {"failed", "timeout", "crashed"}
    assert Campaign().retry == set()
    assert Campaign(retry=["failed,timeout", "crashed"]).retry == words
    assert Policy(retry=frozenset(words)).retry == words


def test_the_options_are_those_of_the_table(capsys):
    with pytest.raises(SystemExit):
        main(["campaign", "--help"])
    told = " ".join(capsys.readouterr().out.split())
    for name, field in Campaign.model_fields.items():
        assert f"--{name.replace('_', '-')}" in told
        assert key_of(field).meaning in told


@pytest.mark.parametrize(
    ("words", "told"),
    [(["--walltime", "90"], ""), (["--case-limit", "-1"], "> 0, got -1\n"),
     (["--max-fails", "0"], ", got 0\n"), (["--retry", "ok"], ""),
     (["--max-fails", "2", "--fail-fast"], "")],
)  # fmt: skip
def test_options_that_mean_nothing_are_one_line(run, tmp_path, words, told):
    code, err = run(SHORT + SPEEDS, *words)
    assert code == 2
    assert err.startswith("hpcwhirl: error: ")
    assert err.endswith(told)
    assert err.count("\n") == 1
    assert not (tmp_path / "out").exists()
