"""How a process was started: one rank without MPI is what one rank of MPI is."""

import json
import subprocess
import sys

import pytest
from launch import ENVIRONMENT, LIMIT, ROOT

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
assert "mpi4py" not in sys.modules
"""


def python(script, *words):
    call = [sys.executable, "-c", script, *map(str, words)]
    done = subprocess.run(
        call, capture_output=True, text=True, timeout=LIMIT, env=ENVIRONMENT, cwd=ROOT,
        check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.mpi
def test_one_rank_without_mpi_answers_as_one_rank_of_mpi():
    alone, of_mpi = json.loads(python(ANSWERS + BOTH))
    assert alone == of_mpi


def test_a_serial_campaign_begins_no_mpi(tmp_path):
    file = tmp_path / "short.toml"
    file.write_text("scene = {duration = 1e-3}\nsweep = {speed = [300, 310]}\n")
    python(SERIAL, file, tmp_path / "out")
