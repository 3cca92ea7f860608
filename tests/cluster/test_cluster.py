"""Campaigns under a real Slurm of one node, started and ended by these tests.

`scripts/test_cluster.sh` installs what is missing and runs them. No test asserts times:
Slurm may warn a minute early and takes its time to start a job again.
"""

import os
import re
import shutil
import subprocess
import sys

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

NEEDED = ("slurmctld", "slurmd", "sbatch", "munged")
MISSING = [name for name in NEEDED if shutil.which(name) is None]
pytestmark = [*MARKS, pytest.mark.mpi]
FLAVOUR = "from mpi4py import MPI; print(MPI.Get_library_version())"


def flavour():
    """Return the PMI with which this environment's MPI works under srun."""
    call = [sys.executable, "-c", FLAVOUR]
    told = subprocess.run(call, capture_output=True, text=True, check=True).stdout
    return "pmix" if "Open MPI" in told else "pmi2"


@pytest.fixture(scope="module")
def slurm(tmp_path_factory):
    """Start Slurm, return a function that runs its commands, and end it."""
    assert not MISSING, f"not installed: {', '.join(MISSING)}"
    place = tmp_path_factory.mktemp("slurm", numbered=True)
    script = ROOT / "scripts/cluster/slurm.sh"
    up = ["bash", script, "up", place, "4", str(os.getpid())]
    subprocess.run(up, check=True, timeout=60)
    environment = {"SLURM_CONF": str(place / "slurm.conf")}

    yield asking(**environment)
    subprocess.run(["bash", script, "down", place], check=True, timeout=120)


@pytest.fixture
def submit(slurm, tmp_path, capsys, kernels, monkeypatch):
    """Return a function: options of `job` -> number of the submitted job."""
    put_campaign(tmp_path)
    path = f"{tmp_path / 'bin'}:{ENVIRONMENT['PATH']}"

    def put(*options):
        monkeypatch.chdir(tmp_path)  # `job` reads the file that the job will read
        words = ["campaign.toml", "--out", "out", "--time", "00:10:00", *options]
        assert main(["job", "slurm", *words]) == 0
        (tmp_path / "job.sh").write_text(capsys.readouterr().out)
        export = f"--export=ALL,PATH={path},PYTHONPATH={ROOT},NUMBA_CACHE_DIR={kernels}"
        return slurm("sbatch", "--parsable", export, "job.sh", cwd=tmp_path)

    return put


def facts(slurm, job):
    """Return {name: value} of a job, of each element of an array."""
    lines = slurm("scontrol", "show", "job", "-o", job).splitlines()
    return [dict(re.findall(r"(\w+)=(\S*)", line)) for line in lines]


def ended(slurm, job):
    wait_until(lambda: not slurm("squeue", "-h", "-j", job), f"job {job}")
    return facts(slurm, job)


def launcher(name):
    return ["--launcher", "srun", "--mpi", flavour()] if name == "srun" else []


@pytest.mark.parametrize("starts_with", ["mpirun", "srun"])
def test_a_submitted_campaign_completes_with_the_bits_of_one_process(
    slurm, submit, alone, tmp_path, starts_with
):
    (job,) = ended(slurm, submit("--ntasks", "2", *launcher(starts_with)))
    assert job["JobState"] == "COMPLETED", log(tmp_path)
    assert job["Restarts"] == "0"
    assert root_variables(tmp_path / "out") == alone
    found = {record["performance"]["rank"] for record in records(tmp_path / "out")}
    assert found == {0, 1}


def test_singletons_under_srun_are_refused_and_named(slurm, tmp_path):
    (tmp_path / "campaign.toml").write_text(CAMPAIGN)
    tool, alone = f"{sys.executable} -m hpcwhirl", "srun --mpi=none -n 2"
    campaign = f"{tool} campaign {tmp_path}/campaign.toml"
    script = [
        "#!/bin/bash",
        f"cd {ROOT}",
        f"{campaign} --dry-run >/dev/null && echo alone",
        f"{alone} {campaign} --out {tmp_path}/o",
        f"{alone} --kill-on-bad-exit=0 {tool} doctor --dir {tmp_path}",
    ]
    (tmp_path / "job.sh").write_text("\n".join(script))
    number = slurm(
        "sbatch", "--parsable", "-n", "2", "-o", "x.log", "job.sh", cwd=tmp_path
    )
    (job,) = ended(slurm, number)
    told = log(tmp_path)
    assert job["ExitCode"] == "1:0", told
    assert told.startswith("alone\n")
    error = "the launcher started 2 ranks but MPI sees 1: srun offered them no PMI"
    assert error in told
    assert "MPI_Init" not in told
    assert "breaks  ranks: the launcher started 2, MPI sees 1" in told
    assert not (tmp_path / "o").exists()


@pytest.mark.parametrize("starts_with", ["mpirun", "srun"])
def test_a_warned_campaign_stops_with_75_comes_again_and_completes(
    slurm, submit, alone, tmp_path, starts_with
):
    number = submit("--ntasks", "2", *launcher(starts_with))
    wait_until(lambda: records(tmp_path / "out"), "the first case")
    slurm("scancel", "-b", "-s", "USR1", number)
    (job,) = ended(slurm, number)
    assert job["JobState"] == "COMPLETED", log(tmp_path)
    assert job["Restarts"] == "1"
    told = log(tmp_path)
    assert "stopped early" in told
    assert f"{CASES} cases, " in told
    is_whole(tmp_path / "out", alone)


def test_the_warning_comes_by_itself_before_the_time_limit(slurm, submit, tmp_path):
    (tmp_path / "campaign.toml").write_text(CAMPAIGN.replace("0.8}", "100.0}"))
    options = ["--time", "00:01:00", "--warning", "50", "--requeues", "0"]
    (job,) = ended(slurm, submit("--ntasks", "2", *options))
    assert (job["JobState"], job["ExitCode"]) == ("FAILED", "75:0"), log(tmp_path)
    assert "stopped early" in log(tmp_path)


def test_a_campaign_comes_again_no_more_often_than_it_may(slurm, submit, tmp_path):
    number = submit("--ntasks", "2", "--requeues", "1")
    for restarts in ("0", "1"):
        before = len(records(tmp_path / "out"))

        def goes_on(restarts=restarts, before=before):
            (job,) = facts(slurm, number)
            begun = len(records(tmp_path / "out")) > before
            return begun and (job["JobState"], job["Restarts"]) == ("RUNNING", restarts)

        wait_until(goes_on, "a further case")
        slurm("scancel", "-b", "-s", "USR1", number)
        if restarts == "0":
            wait_until(
                lambda: facts(slurm, number)[0]["Restarts"] == "1", "the requeue"
            )
    (job,) = ended(slurm, number)
    assert (job["JobState"], job["ExitCode"]) == ("FAILED", "75:0"), log(tmp_path)
    assert "started again 1 times, and there is more to do" in log(tmp_path)


def test_a_cancelled_campaign_stays_cancelled_and_keeps_its_cases(
    slurm, submit, alone, tmp_path
):
    number = submit("--ntasks", "2")
    wait_until(lambda: records(tmp_path / "out"), "the first case")
    slurm("scancel", number)
    (job,) = ended(slurm, number)
    assert (job["JobState"], job["Restarts"]) == ("CANCELLED", "0")
    kept = records(tmp_path / "out")
    assert 0 < len(kept) < CASES
    (again,) = ended(slurm, submit("--ntasks", "2"))
    assert again["JobState"] == "COMPLETED", log(tmp_path)
    is_whole(tmp_path / "out", alone, kept)


@pytest.mark.parametrize("starts_with", ["mpirun", "srun"])
def test_elements_of_an_array_are_shards_and_come_again_alone(
    slurm, submit, alone, tmp_path, starts_with
):
    options = ["--array", "2", "--ntasks", "2", *launcher(starts_with)]
    number = submit(*options)
    wait_until(lambda: records(tmp_path / "out"), "the first case")
    slurm("scancel", "-b", "-s", "USR1", f"{number}_1")
    jobs = {job["ArrayTaskId"]: job for job in ended(slurm, number)}
    assert {job["JobState"] for job in jobs.values()} == {"COMPLETED"}, log(tmp_path)
    assert {task: job["Restarts"] for task, job in jobs.items()} == {"1": "1", "2": "0"}
    is_whole(tmp_path / "out", alone)
    assert "left to other shards" in log(tmp_path)
