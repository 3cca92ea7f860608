"""Campaigns as processes: any number of ranks, killed, stopped, continued."""

import json
import shutil
import signal

import h5py
import pytest
from launch import (
    BARE,
    LIMIT,
    SIX,
    SLOW,
    finish,
    held,
    inputs,
    kill,
    launch,
    records,
    root_variables,
    start,
    wait_for,
)

from hpcwhirl.cli import main

SHORT = (
    BARE
    + """
scene = {duration = 4e-3}
solver = {time_step = 2e-6}
output = {interval = 5e-5}
sweep = {speed = [300, 410], gap = [1e-4, 2e-4, 3e-4]}
"""
)
ONE_TOO_COARSE = (
    BARE
    + """
scene = {duration = 4e-3}
output = {interval = 5e-5}
sweep = {time_step = [2e-5, 1e-6, 2e-6]}
"""
)


def completed(place, text, ranks):
    """Run a campaign to its end and return its directory."""
    out = place / "out"
    done = launch("campaign", inputs(place, text), "--out", out, ranks=ranks)
    assert done.returncode == 0, done.err
    return out


def status(folder):
    done = launch("status", folder, "--json")
    assert done.returncode == 0, done.err
    return json.loads(done.out)


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    return completed(tmp_path_factory.mktemp("alone"), SHORT, ranks=0)


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    return completed(tmp_path_factory.mktemp("undisturbed"), SIX, ranks=0)


@pytest.mark.mpi
@pytest.mark.parametrize(
    "ranks",
    [
        pytest.param(2, marks=pytest.mark.mpiio),
        pytest.param(1, marks=pytest.mark.slow),
        pytest.param(3, marks=pytest.mark.slow),
    ],
)
def test_any_number_of_ranks_gives_the_bits_of_one_process(alone, tmp_path, ranks):
    together = completed(tmp_path, SHORT, ranks)
    assert root_variables(together) == root_variables(alone)
    found = records(together)
    assert sorted(record["case"] for record in found) == list(range(6))
    with h5py.File(together / "results.h5") as file:
        assert file.attrs["ranks"].decode() == str(ranks)
        by_rank = {record["case"]: record["performance"]["rank"] for record in found}
        assert file["performance/rank"][:].tolist() == [by_rank[i] for i in range(6)]


@pytest.mark.mpi
@pytest.mark.slow
def test_every_rank_computes_rank_0_too(tmp_path):
    out = tmp_path / "out"
    words = ["campaign", inputs(tmp_path, SHORT), "--out", out]
    assert finish(start(words, ranks=2, first=SLOW)).returncode == 0
    assert {record["performance"]["rank"] for record in records(out)} == {0, 1}


@pytest.mark.mpi
@pytest.mark.slow
@pytest.mark.parametrize("ranks", [0, 2])
def test_a_killed_campaign_continues_to_the_same_bits(undisturbed, tmp_path, ranks):
    out = tmp_path / "out"
    words = ["campaign", inputs(tmp_path, SIX), "--out", out]
    process = start(words, ranks, first=held(out, 1))
    wait_for(lambda: records(out), process)
    kill(process)
    kept = records(out)
    assert 0 < len(kept) < 6
    assert not (out / "results.h5").exists()

    found = status(out)
    assert (found["cases"], found["done"], found["left"]) == (
        6,
        len(kept),
        6 - len(kept),
    )
    assert launch("gather", out, ranks=ranks).returncode == 1  # some are missing
    with h5py.File(out / "results.h5") as file:
        missing = [i for i, word in enumerate(file["status"][:]) if word == 2]
    assert sorted(missing + [record["case"] for record in kept]) == list(range(6))

    done = launch(*words, ranks=ranks)
    assert done.returncode == 0, done.err
    assert root_variables(out) == root_variables(undisturbed)
    after = records(out)
    assert sorted(record["case"] for record in after) == list(range(6))
    assert all(record in after for record in kept)


# A launcher tells the other ranks to end as soon as one has exited with a code.
TERMINATED = """
import os, signal, sys
from hpcwhirl.cli import main
code = main(sys.argv[1:])
os.kill(os.getpid(), signal.SIGTERM)
sys.exit(code)
"""


@pytest.mark.mpi
def test_a_signal_after_the_end_does_not_change_the_exit_code(tmp_path):
    words = ("campaign", inputs(tmp_path, SHORT), "--out", tmp_path / "out")
    done = launch(*words, ranks=2, first=TERMINATED, real=False)
    assert done.returncode == 0, done.err


@pytest.mark.mpi
@pytest.mark.slow
@pytest.mark.parametrize(("ranks", "wish"), [(0, signal.SIGTERM), (2, signal.SIGUSR1)])
def test_a_stopped_campaign_says_75_and_continues(undisturbed, tmp_path, ranks, wish):
    out = tmp_path / "out"
    words = ["campaign", inputs(tmp_path, SIX), "--out", out]
    process = start(words, ranks, held(out, 1, pause=0.01))
    wait_for(lambda: records(out), process)
    process.send_signal(wish)
    _, told = process.communicate(timeout=LIMIT)
    assert process.returncode == 75
    assert "stopped early" in told
    assert 0 < len(records(out)) < 6
    assert launch(*words).returncode == 0
    assert root_variables(out) == root_variables(undisturbed)
    assert len(records(out)) == 6


@pytest.mark.mpi
@pytest.mark.slow
def test_a_case_that_fails_is_a_row_and_the_others_go_on(tmp_path):
    out = tmp_path / "out"
    words = ["campaign", inputs(tmp_path, ONE_TOO_COARSE), "--out", out]
    done = launch(*words, ranks=2)
    assert done.returncode == 1
    assert "1 of 3 cases failed" in done.err
    with h5py.File(out / "results.h5") as file:
        assert file["status"][:].tolist() == [1, 0, 0]
        first, *others = file["message"][:].tolist()
        assert first.startswith(b"InputError: time_step must be <")
        assert others == [b"", b""]
        assert file["time_step"][:].tolist() == [2e-5, 1e-6, 2e-6]
    assert {k: status(out)[k] for k in ("done", "failed", "left")} == {
        "done": 2, "failed": 1, "left": 0,
    }  # fmt: skip
    assert launch(*words).returncode == 1
    assert len(records(out)) == 3
    assert launch(*words, "--retry", "failed").returncode == 1
    assert sorted(record["case"] for record in records(out)) == [0, 0, 1, 2]


@pytest.mark.mpi
@pytest.mark.parametrize("ranks", [0, 2])
def test_a_directory_begun_with_other_inputs_is_refused(alone, tmp_path, ranks):
    before = {p: p.read_bytes() for p in alone.rglob("*") if p.is_file()}
    file = inputs(tmp_path, SHORT)
    done = launch(
        "campaign", file, "--out", alone, "--set", "friction=0.2", ranks=ranks
    )  # fmt: skip
    assert done.returncode == 2
    (line,) = [li for li in done.err.splitlines() if li.startswith("hpcwhirl")]
    assert line.startswith("hpcwhirl: error: ")
    assert done.err.count("hpcwhirl: error: ") == 1
    assert "friction = 0.1, got 0.2" in line
    assert "Traceback" not in done.err
    assert {p: p.read_bytes() for p in alone.rglob("*") if p.is_file()} == before


@pytest.mark.slow
def test_more_cases_of_the_same_inputs_may_be_added(tmp_path, capsys):
    file, out = inputs(tmp_path, SHORT), tmp_path / "out"
    assert main(["campaign", str(file), "--out", str(out)]) == 0
    first = records(out)
    file.write_text(SHORT.replace("410]", "410, 350]"))
    assert main(["campaign", str(file), "--out", str(out)]) == 0
    assert "9 cases, 6 already computed" in capsys.readouterr().err
    assert len(records(out)) == 9
    assert all(record in records(out) for record in first)


@pytest.mark.turns
def test_the_default_s_dry_run_names_cases_and_core_hours(tmp_path, capsys):
    call = ["campaign", "--dry-run", "--out", str(tmp_path / "out")]
    assert main(call) == 0
    out = capsys.readouterr().out
    assert "78 cases" in out
    assert "core-hours" in out
    assert main([*call, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["cases"] == 78
    assert 0 < found["core_hours"] < 1
    assert found["core_hours"] * 3.6e9 == pytest.approx(
        found["steps"] * found["microseconds_per_step"]
    )
    assert not list(tmp_path.iterdir())


@pytest.mark.turns
def test_status_reads_no_results_file(alone, tmp_path):
    shutil.copytree(alone, tmp_path / "out")
    (tmp_path / "out/results.h5").write_text("not HDF5")
    found = status(tmp_path / "out")
    assert (found["cases"], found["done"], found["left"]) == (6, 6, 0)
    assert sum(found["words"].values()) == 6


@pytest.mark.turns
@pytest.mark.parametrize(("gap", "told"), [(0.05, True), (1e-4, False)])
def test_a_campaign_in_which_no_blade_touches_says_so(campaign, gap, told, capsys):
    code, _ = campaign(f"sweep = {{speed = [300, 410], gap = [{gap}]}}")
    assert code == 0
    assert ("no blade touched the casing" in capsys.readouterr().err) == told


@pytest.mark.slow
def test_damaged_traces_are_computed_again_on_retry(alone, tmp_path):
    out = tmp_path / "out"
    shutil.copytree(alone, out)
    (out / "results.h5").unlink()
    (traces,) = (out / "traces").iterdir()
    spoilt = bytearray(traces.read_bytes())
    spoilt[100] ^= 1
    traces.write_bytes(spoilt)
    words = ["campaign", inputs(tmp_path, SHORT), "--out", out]
    refused = launch(*words)
    assert refused.returncode == 2
    assert "--retry failed" in refused.err
    assert launch(*words, "--retry", "failed").returncode == 0
    assert len(records(out)) == 7
    assert root_variables(out) == root_variables(alone)
