"""How a process was started: one rank without MPI is what one rank of MPI is."""

import json
import os
import select
import subprocess
import sys
import time
from pathlib import Path

import pytest
from launch import BARE, ENVIRONMENT, LIMIT, MPIRUN, ended, launch, python

from hpcwhirl.campaign.run import _warm
from hpcwhirl.campaign.work import work_of
from hpcwhirl.launch import alien_family, family, fate, from_root, launched_ranks

# What every communicator of one rank answers, by the words that campaigns use.
ANSWERS = """
def answers(comm):
    comm.Barrier()
    return [comm.rank, comm.size, comm.bcast("told", root=0), comm.scatter([[7]], 0),
            comm.gather("own", root=0), comm.allgather(("own", 1)), comm.Iprobe()]
"""
BOTH = """
import json
from mpi4py import MPI
from hpcwhirl.launch import ALONE, library_of, node_of
found = [answers(ALONE), answers(MPI.COMM_SELF)]
assert library_of(ALONE) == "none" != library_of(MPI.COMM_SELF)
assert node_of(ALONE) is ALONE and node_of(MPI.COMM_SELF).size == 1
print(json.dumps(found))
"""
SERIAL = """
import sys
from hpcwhirl.cli import main
toml, out = sys.argv[1:]
assert main(["campaign", toml, "--out", out]) == 0
assert main(["gather", out]) == 0
assert "hpcwhirl.campaign.ranks" in sys.modules
slow = {f"scipy.{name}" for name in ("optimize", "stats", "spatial", "special")}
assert not {"mpi4py", *slow} & sys.modules.keys()
"""

LAUNCHERS = ("PMI", "OMPI_COMM", "SLURM", "MPI_L", "PALS")
BATCH = {"SLURM_JOB_ID": "7", "SLURM_NTASKS": "2", "SLURM_PROCID": "0"}
STEP = BATCH | {"SLURM_STEP_ID": "0", "SLURM_STEP_NUM_TASKS": "2"}
STEP |= {"SLURM_JOBID": "7", "SLURM_STEPID": "0"}  # which Open MPI looks at
PMI2 = {"PMI_FD": "13", "PMI_RANK": "1", "PMI_SIZE": "2"}
PMIX = {"PMIX_RANK": "1", "PMIX_NAMESPACE": "slurm.pmix.7.0"}
# What launchers really set, as recorded under Slurm 22.05, MPICH 5.0 and Open MPI 4.1:
# name -> (variables, ranks, which MPI would give up there)
STARTS = {
    "nothing": ({}, 1, ""),
    "batch script": (BATCH, 1, ""),
    "srun of one task": (STEP | {"SLURM_STEP_NUM_TASKS": "1"}, 1, ""),
    "srun --mpi=none": (STEP | {"SLURM_PROCID": "1"}, 2, "Open MPI"),
    "srun --mpi=pmi2": (STEP | PMI2, 2, ""),
    "srun --mpi=pmix": (STEP | PMIX, 2, ""),
    "srun --mpi=cray_shasta": (STEP | {"PALS_RANKID": "1"}, 2, ""),
    "MPICH's mpirun": (PMI2 | {"MPI_LOCALNRANKS": "2"}, 2, ""),
    "MPICH's mpirun in a batch script": (BATCH | PMI2, 2, ""),
    "Open MPI's mpirun in a batch script": (
        BATCH | PMIX | {"OMPI_COMM_WORLD_SIZE": "2", "OMPI_COMM_WORLD_RANK": "1"},
        2, "MPICH",
    ),
    "Open MPI's mpirun in a step of one task": (
        STEP | PMIX | {"SLURM_STEP_NUM_TASKS": "1", "OMPI_COMM_WORLD_SIZE": "2"},
        2, "MPICH",
    ),
}  # fmt: skip


def without_launchers():
    return {k: v for k, v in ENVIRONMENT.items() if not k.startswith(LAUNCHERS)}


def open_mpi():
    """Return Debian's Open MPI, which the wheel of mpi4py can load, or None."""
    return next(Path("/usr/lib").glob("*/libmpi.so.40"), None)


@pytest.mark.parametrize(("variables", "ranks", "alien"), STARTS.values(), ids=STARTS)
def test_the_launcher_s_environment_tells_which_mpi_would_give_up(
    monkeypatch, variables, ranks, alien
):
    for name in [name for name in os.environ if name.startswith(LAUNCHERS)]:
        monkeypatch.delenv(name)
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    assert launched_ranks() == ranks
    assert alien_family() == alien


@pytest.mark.turns
@pytest.mark.mpi
@pytest.mark.parametrize("library", ["of the environment", "Open MPI"])
def test_tasks_of_srun_without_pmi_are_refused_in_one_line(tmp_path, library):
    given = without_launchers() | STEP
    if library == "Open MPI":
        if (path := open_mpi()) is None:
            pytest.skip("no Debian Open MPI here")
        given["MPI4PY_LIBMPI"] = str(path)
    file = tmp_path / "short.toml"
    file.write_text("sweep = {speed = [300]}\n")
    done = launch("campaign", file, "--out", tmp_path / "out", env=given)
    assert (done.returncode, done.out) == (2, "")
    assert done.err.count("\n") == 1
    assert (
        "the launcher started 2 ranks but MPI sees 1: srun offered them no PMI"
        in done.err
    )
    assert not (tmp_path / "out").exists()


@pytest.mark.turns
@pytest.mark.mpi
def test_mpich_under_open_mpi_s_mpirun_is_refused_in_one_line(tmp_path):
    told = python("from hpcwhirl.launch import library; print(library())").stdout
    if family(told) != "MPICH":
        pytest.skip("the MPI of this environment is not MPICH")
    given = without_launchers() | STARTS["Open MPI's mpirun in a batch script"][0]
    done = launch("campaign", "--out", tmp_path / "out", env=given)
    assert (done.returncode, done.out) == (2, "")
    assert done.err.count("\n") == 1
    assert "do not belong together" in done.err


@pytest.mark.mpi
def test_one_rank_without_mpi_answers_as_one_rank_of_mpi():
    alone, of_mpi = json.loads(python(ANSWERS + BOTH, check=True).stdout)
    assert alone == of_mpi


@pytest.mark.turns
def test_a_serial_campaign_begins_no_mpi(tmp_path):
    file = tmp_path / "short.toml"
    text = "scene = {duration = 1e-3}\nsweep = {speed = [300, 310]}\n"
    file.write_text(BARE + text)
    python(SERIAL, file, tmp_path / "out", check=True)


def test_no_rank_ends_the_others_before_its_last_line_is_read(tmp_path):
    """MPICH's mpirun drops what is left in the pipes of ranks after an abort."""
    told = tmp_path / "left"
    code = (
        "import sys; from pathlib import Path; from hpcwhirl import launch\n"
        "class Two:\n"
        "    size = 2\n"
        "    def Abort(self, code):\n"
        f"        Path({str(told)!r}).write_text(str(launch._unread(2)))\n"
        "print('why it ended', file=sys.stderr)\n"
        "launch.end_all(Two(), 75)\n"
    )
    call = [sys.executable, "-c", code]
    with subprocess.Popen(call, stderr=subprocess.PIPE, text=True) as process:
        select.select([process.stderr], [], [], LIMIT)  # the line is there, unread
        time.sleep(0.3)
        assert not told.exists()
        assert process.stderr.read() == "why it ended\n"
    assert told.read_text() == "0"


class Later:
    """What rank 1 sees of a communicator: rank 0 arrives at the third look."""

    rank, size = 1, 2

    def __init__(self):
        self.looks, self.woken = 0, False

    def Iprobe(self, source, tag):  # noqa: ARG002
        self.looks += 1
        return self.looks > 2

    def recv(self, source, tag):  # noqa: ARG002
        assert self.looks > 2
        self.woken = True

    def bcast(self, value=None, root=0):  # noqa: ARG002
        assert self.woken, "rank 1 is in a collective call before rank 0"
        return "told"

    Barrier = allgather = scatter = gather = bcast


@pytest.mark.parametrize(
    "wait",
    [
        lambda comm: from_root(comm, None),
        lambda comm: _warm(None, None, comm),
        lambda comm: work_of(None, None, None, comm),
    ],
    ids=["a value", "compiling", "planning"],
)
def test_a_rank_enters_no_collective_call_before_rank_0(wait):
    wait(later := Later())
    assert later.woken


WAITING = r"""
import time
from mpi4py import MPI
from hpcwhirl.launch import from_root
comm, begun = MPI.COMM_WORLD, time.process_time()
while comm.rank == 0 and time.process_time() - begun < 0.5:
    pass
value = from_root(comm, comm.rank + 7)
print(f"{comm.rank} {value} {time.process_time() - begun}\n", end="")
"""


@pytest.mark.mpi
def test_a_rank_that_waits_for_rank_0_sleeps():
    done = ended(*MPIRUN, "-n", "2", sys.executable, "-c", WAITING, check=True)
    told = sorted(line.split() for line in done.stdout.splitlines())
    assert [line[:2] for line in told] == [["0", "7"], ["1", "7"]]
    assert float(told[0][2]) >= 0.5 > 2 * float(told[1][2])


def test_the_fate_of_a_process_is_its_code_or_its_signal():
    assert fate(0) == "ended with exit code 0"
    assert fate(75) == "ended with exit code 75"
    assert fate(-1) == "died of SIGHUP"
    assert fate(-9) == "died of SIGKILL, perhaps for lack of memory"
