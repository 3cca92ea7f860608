"""Signals in the first second: a campaign hears them before it is imported."""

import os
import signal

import pytest
from launch import LIMIT, launch, python
from test_jobs import noted, run_bash, tools  # noqa: F401 - a fixture

from hpcwhirl import early_signals
from hpcwhirl.campaign.stop import Stopping
from hpcwhirl.cli import main
from hpcwhirl.cluster.request import Request, job_script

pytestmark = pytest.mark.turns

# A process that sends itself a signal as it first imports a module.
SELF = """
import os, sys
module, number = sys.argv[1], int(sys.argv[2])
sys.argv[1:] = sys.argv[3:]
class Sender:
    def find_spec(self, name, path=None, target=None):
        if name == module and self in sys.meta_path:
            sys.meta_path.remove(self)
            os.kill(os.getpid(), number)
sys.meta_path.insert(0, Sender())
from hpcwhirl.cli import main
sys.exit(main())
"""
BLOCKED = """
import os, signal, sys
signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGTERM, signal.SIGUSR1])
os.kill(os.getpid(), int(sys.argv[1]))
os.execv(sys.executable, [sys.executable, "-m", "hpcwhirl", *sys.argv[2:]])
"""
SHORT = ("--set", "duration=1e-4", "--set", "time_step=2e-6")


@pytest.mark.parametrize(
    ("module", "name"),
    [("argparse", signal.SIGINT), ("pydantic", signal.SIGTERM),
     ("h5py", signal.SIGINT), ("numba", signal.SIGUSR1)],
)  # fmt: skip
def test_a_signal_while_a_campaign_is_imported_is_a_wish_to_stop(
    tmp_path, module, name
):
    done = python(SELF, module, int(name), "campaign", *SHORT, "--out", tmp_path / "o")
    assert done.returncode == 75, done.stderr
    assert f"stopped early: signal {name.name[3:]}" in done.stderr


def test_a_signal_that_came_before_python_waits_where_it_was_blocked(tmp_path):
    out = tmp_path / "o"
    done = python(BLOCKED, int(signal.SIGUSR1), "campaign", *SHORT, "--out", out)
    assert done.returncode == 75, done.stderr
    assert "stopped early: signal USR1" in done.stderr


@pytest.mark.slow
def test_a_campaign_stopped_before_it_began_goes_on(tmp_path):
    words = ("campaign", *SHORT, "--set", "traces=summary", "--out", tmp_path / "o")
    toml = tmp_path / "two.toml"
    toml.write_text("sweep = {speed = [300, 410]}")
    words += (toml,)
    assert python(SELF, "numpy", int(signal.SIGTERM), *words).returncode == 75
    assert launch(*words, "--map", "no").returncode == 0


def test_other_commands_die_of_a_signal_as_any_program():
    done = python(SELF, "pydantic", int(signal.SIGTERM), "model")
    assert done.returncode == -signal.SIGTERM


def test_wrong_input_stays_told_where_a_signal_came_too(tmp_path):
    done = python(SELF, "numpy", int(signal.SIGTERM), "campaign", tmp_path / "no.toml")
    assert done.returncode == 2
    assert "no.toml" in done.stderr


def test_the_handlers_are_given_back(tmp_path):
    before = [signal.getsignal(name) for name in early_signals.SIGNALS]
    assert main(["campaign", str(tmp_path / "no.toml")]) == 2
    assert [signal.getsignal(name) for name in early_signals.SIGNALS] == before


def test_what_was_heard_early_counts_once():
    early_signals.listen()
    os.kill(os.getpid(), signal.SIGUSR1)
    with Stopping() as stopping:
        assert stopping()
        assert stopping.reason == "signal USR1"
    with Stopping() as stopping:
        assert not stopping()
    early_signals.leave(program=False)


# Job scripts cover what Python cannot: its own start.


def scripted(**options):
    return job_script(Request("slurm", file="c.toml", **options))


@pytest.mark.parametrize("name", ["USR1", "TERM"])
def test_ranks_that_die_of_the_warning_come_again(tools, name):  # noqa: F811
    """The campaign is still deaf: the signal kills it, and mpirun says so."""
    # the warning comes while the rank starts; it dies of it, as Python would
    rank = f'#!/bin/bash\nkill -{name} "$PPID"\nexec sleep 60\n'
    (tools / "bin/hpcwhirl").write_text(rank)
    launcher = '#!/bin/bash\nwhile [ "$1" != hpcwhirl ]; do shift; done\nexec "$@"\n'
    (tools / "bin/mpirun").write_text(launcher)
    script = scripted().replace("exec mpirun", "mpirun")
    process = run_bash(script, tools, SLURM_JOB_ID="7")
    _, err = process.communicate(timeout=LIMIT)
    assert process.returncode == 75, err
    requeued = ["scontrol requeue 7"] if name == "USR1" else []
    assert noted(tools) == requeued


def test_a_job_told_before_it_launches_does_not_begin(tools):  # noqa: F811
    script = scripted(modules=("slow",))
    script = script.replace("module load slow", "kill -USR1 $$", 1)
    process = run_bash(script, tools, SLURM_JOB_ID="7")
    _, err = process.communicate(timeout=LIMIT)
    assert process.returncode == 75, err
    assert noted(tools) == ["scontrol requeue 7"]
    assert not (tools / "begun").exists()
