"""What the tests of every real scheduler share: a campaign, and what becomes of it."""

import os
import subprocess
import sys
import time

import pytest
from launch import ENVIRONMENT, MPIRUN, launch, records, root_variables

LIMIT = 600  # s, of any job, on a busy machine where kernels are compiled first
CASES = 40
CAMPAIGN = """
scene = {duration = 0.8}
solver = {time_step = 2e-6}
output = {traces = "summary"}
sweep = {speed = {start = 300, stop = 495, step = 5}}
"""
MARKS = [
    pytest.mark.cluster,
    pytest.mark.slow,
    pytest.mark.skipif(
        os.environ.get("HPCWHIRL_CLUSTER") != "1",
        reason="scripts/test_cluster.sh runs them",
    ),
]


def in_one_process(place):
    """Return the root variables of the campaign, computed without a scheduler."""
    (place / "campaign.toml").write_text(CAMPAIGN)
    done = launch("campaign", place / "campaign.toml", "--out", place / "out")
    assert done.returncode == 0, done.err
    return root_variables(place / "out")


def asking(*front, **more):
    """Return a function: words of a scheduler's command -> what it prints.

    front : words before them; more : {variable: value} of the environment
    """

    def ask(*words, cwd=None):
        call = [str(word) for word in (*front, *words)]
        pipes = {"capture_output": True, "text": True, "timeout": 60}
        own = ENVIRONMENT | more
        done = subprocess.run(call, env=own, cwd=cwd, check=False, **pipes)
        assert done.returncode == 0, (call, done.stderr)
        return done.stdout.strip()

    return ask


def put_tools(place, **tools):
    """Make `place`/bin hold {name: words to run}, whatever the shell would find."""
    (place / "bin").mkdir()
    for name, words in tools.items():
        tool = place / "bin" / name
        tool.write_text(f'#!/bin/bash\nexec {" ".join(words)} "$@"\n')
        tool.chmod(0o755)


def put_campaign(place):
    """Write a campaign's file, and the commands with which a job runs it."""
    (place / "campaign.toml").write_text(CAMPAIGN)
    tool = [sys.executable, "-m", "hpcwhirl"]
    put_tools(place, mpirun=MPIRUN, hpcwhirl=tool)


def is_whole(out, alone, kept=()):
    """Check that each case was computed once, with the bits of one process.

    alone : root variables of that; kept : records that must still be there
    """
    after = records(out)
    assert all(record in after for record in kept)
    assert sorted(record["case"] for record in after) == list(range(CASES))
    assert root_variables(out) == alone


def wait_until(reached, what):
    end = time.monotonic() + LIMIT
    while not reached():
        assert time.monotonic() < end, f"waited {LIMIT} s for {what}"
        time.sleep(0.1)


def log(folder):
    return "\n".join(path.read_text() for path in folder.glob("*.log"))
