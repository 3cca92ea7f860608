"""Campaigns under a real Grid Engine of one node, started and ended by these tests.

`scripts/test_cluster.sh` installs what is missing and runs them. Signals are those that
Grid Engine sends: a notice to the job's process group, at its own time or from `qmod`.
"""

import os
import re
import subprocess
from pathlib import Path

import pytest
from cluster import (
    CAMPAIGN,
    CASES,
    MARKS,
    asking,
    is_whole,
    log,
    put_campaign,
    wait_until,
)  # fmt: skip
from launch import ENVIRONMENT, ROOT, records, root_variables

from hpcwhirl.cli import main

SCRIPT = ROOT / "scripts/cluster/sge.sh"
HANDED = ("OMPI_", "PRTE_", "MPI4PY_")
pytestmark = [*MARKS, pytest.mark.mpi]


@pytest.fixture(scope="module")
def engine(tmp_path_factory):
    """Start Grid Engine, return a function that runs its commands, and end it."""
    place = tmp_path_factory.mktemp("sge", numbered=True)
    subprocess.run(
        ["bash", SCRIPT, "up", place, "4", str(os.getpid())], check=True, timeout=90
    )

    yield asking("bash", SCRIPT, "in", place)
    subprocess.run(["bash", SCRIPT, "down", place], check=True, timeout=120)


@pytest.fixture
def submit(engine, tmp_path, capsys, kernels, monkeypatch):
    """Return a function: options of `job` -> number of the submitted job.

    Grid Engine starts the script as a login shell, whose profile sets PATH: what a job
    needs comes from the virtual environment that it activates.
    """
    put_campaign(tmp_path)
    own = {"PYTHONPATH": str(ROOT), "NUMBA_CACHE_DIR": str(kernels)}
    own["PATH"] = f"{tmp_path / 'bin'}:{ENVIRONMENT['PATH']}"
    given = {k: v for k, v in ENVIRONMENT.items() if k.startswith(HANDED)} | own
    lines = [f"export {name}='{value}'" for name, value in given.items()]
    (tmp_path / "bin/activate").write_text("\n".join(lines))

    def put(*options):
        monkeypatch.chdir(tmp_path)  # `job` reads the file that the job will read
        words = ["campaign.toml", "--out", "out", "--time", "00:10:00", *options]
        assert main(["job", "sge", *words, "--venv", str(tmp_path)]) == 0
        (tmp_path / "job.sh").write_text(capsys.readouterr().out)
        told = engine("qsub", "-o", "x.log", "job.sh", cwd=tmp_path)
        return re.search(r"Your job(?:-array)? (\d+)", told)[1]

    return put


def runs(engine, number):
    """Return what the accounting tells of each run of a job: {name: value}."""
    blocks = engine("qacct", "-j", number).split("=" * 62)[1:]
    return [dict(re.findall(r"^(\w+) +(\w+)", text, re.M)) for text in blocks]


def ended(engine, number, count):
    """Return the runs of a job, as many as are expected, once it has ended."""

    def gone():
        return not re.search(rf"^ *{number} ", engine("qstat"), re.M)

    def accounted():
        try:
            return len(runs(engine, number)) >= count
        except AssertionError:  # unknown until the accounting is written
            return False

    wait_until(gone, f"job {number}")
    wait_until(accounted, f"the accounting of job {number}")
    return runs(engine, number)


def codes(found):
    return [run["exit_status"] for run in found]


def signal_job(engine, number, name, task=1):
    """Send a signal as Grid Engine's shepherd does, to the job's process group."""
    place = Path(engine("qconf", "-sconf").partition("execd_spool_dir")[2].split()[0])
    (path,) = place.glob(f"*/active_jobs/{number}.{task}/job_pid")
    engine("kill", f"-{name}", "--", f"-{path.read_text().strip()}")


def test_a_submitted_campaign_completes_with_the_bits_of_one_process(
    engine, submit, alone, tmp_path
):
    found = ended(engine, submit("--ntasks", "2"), 1)
    assert codes(found) == ["0"], log(tmp_path)
    assert root_variables(tmp_path / "out") == alone
    ranks = {record["performance"]["rank"] for record in records(tmp_path / "out")}
    assert ranks == {0, 1}


def test_a_warned_campaign_stops_comes_again_and_completes(
    engine, submit, alone, tmp_path
):
    number = submit("--ntasks", "2")
    wait_until(lambda: records(tmp_path / "out"), "the first case")
    signal_job(engine, number, "USR1")
    assert codes(ended(engine, number, 2)) == ["99", "0"], log(tmp_path)
    told = log(tmp_path)
    assert "stopped early" in told
    assert f"{CASES} cases, " in told
    is_whole(tmp_path / "out", alone)


def test_every_run_of_a_job_is_warned_before_its_time_limit(engine, submit, tmp_path):
    (tmp_path / "campaign.toml").write_text(CAMPAIGN.replace("0.8}", "100.0}"))
    options = ["--time", "00:01:00", "--warning", "50", "--requeues", "2"]
    found = ended(engine, submit("--ntasks", "2", *options), 3)
    # with s_rt, the second run had 75: taken for ended by someone, not to come again
    assert codes(found) == ["99", "99", "1"], log(tmp_path)
    told = log(tmp_path)
    assert told.count("stopped early") == 3
    assert "started again 2 times, and there is more to do" in told


def test_a_suspended_campaign_gives_its_place_back_and_comes_again(
    engine, submit, alone, tmp_path
):
    number = submit("--ntasks", "2")
    wait_until(lambda: records(tmp_path / "out"), "the first case")
    engine("qmod", "-sj", number)  # USR1 by -notify, STOP a minute later
    assert codes(ended(engine, number, 2)) == ["99", "0"], log(tmp_path)
    assert root_variables(tmp_path / "out") == alone


def test_a_deleted_campaign_stays_deleted_and_keeps_its_cases(
    engine, submit, alone, tmp_path
):
    number = submit("--ntasks", "2")
    wait_until(lambda: records(tmp_path / "out"), "the first case")
    engine("qdel", number)  # USR2 by -notify, KILL a minute later
    assert codes(ended(engine, number, 1)) == ["75"], log(tmp_path)
    kept = records(tmp_path / "out")
    assert 0 < len(kept) < CASES
    assert codes(ended(engine, submit("--ntasks", "2"), 1)) == ["0"], log(tmp_path)
    is_whole(tmp_path / "out", alone, kept)


def test_elements_of_an_array_are_shards_and_come_again_alone(
    engine, submit, alone, tmp_path
):
    number = submit("--array", "2", "--ntasks", "2")
    wait_until(lambda: records(tmp_path / "out"), "the first case")
    signal_job(engine, number, "USR1", task=1)
    found = ended(engine, number, 3)
    told = sorted((run["taskid"], run["exit_status"]) for run in found)
    assert told == [("1", "0"), ("1", "99"), ("2", "0")], log(tmp_path)
    is_whole(tmp_path / "out", alone)
    assert "left to other shards" in log(tmp_path)
