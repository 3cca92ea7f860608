"""End of a run: count cases without a result and gather results into results.h5.

`write_case` writes the results of a single case as such a file, too.
"""

from __future__ import annotations

import datetime as dt
import platform
import shlex
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from importlib import metadata
from pathlib import Path

import numpy as np

import hpcwhirl
from hpcwhirl.analysis.regimes import threshold_facts
from hpcwhirl.campaign.machine import machine_facts
from hpcwhirl.campaign.plan.design import Design
from hpcwhirl.campaign.simulate import Result, notes_on
from hpcwhirl.campaign.work import Work
from hpcwhirl.errors import MissingFileError, NoRoomError, StoreError, say
from hpcwhirl.launch import ALONE, Communicator, from_root, library_of
from hpcwhirl.planner.planner import Planner
from hpcwhirl.scene import loss_of, preset_inputs, preset_of, to_toml
from hpcwhirl.scene.units import written_units
from hpcwhirl.store.atomic import make_folders, publish, telling
from hpcwhirl.store.directory.campaign_directory import Directory
from hpcwhirl.store.directory.completions import ended_in
from hpcwhirl.store.directory.journal import Journal
from hpcwhirl.store.directory.owner import Asking, BrokenOffError
from hpcwhirl.store.directory.refined import dropped_of, full_plan
from hpcwhirl.store.reading.results_file import count_statuses
from hpcwhirl.store.results.contents import is_current
from hpcwhirl.store.results.gather import gather

LIBRARIES = ("numpy", "scipy", "numba", "h5py", "mpi4py")


@dataclass(frozen=True)
class Ending:
    """How one run of a campaign has ended.

    Attributes
    ----------
    complete : whether all cases (of this shard) have ended and results are written,
        unless other shards are not complete
    cases : number of cases of the campaign
    failed : number of cases without a result, their own or that of a twin, for any
        reason: of the campaign when it is complete, of this shard while other shards
        are not complete
    missing : number of failed cases that have no record at all
    of_twins : number of failed cases that have a result, but not all of their twins
    results : path of results.h5; None: there are no results yet
    reason : reason for an early stop
    gave_up : whether the run stopped after `max_fails` failures
    piloted : whether the run was a pilot and stopped when its time was up
    left : number of cases of other shards without a result so far
    lasting : whether the same command would stop again at once for the same reason
    gathered : whether this run wrote results.h5; False if the file was up to date
    """

    complete: bool
    cases: int
    failed: int = 0
    results: Path | None = None
    reason: str = ""
    gave_up: bool = False
    piloted: bool = False
    left: int = 0
    missing: int = 0
    of_twins: int = 0
    lasting: bool = False
    gathered: bool = True


def conclude(
    design: Design, directory: Directory, comm: Communicator, work: Work, asking: Asking
) -> Ending:
    """Gather the results of a complete campaign; return how the run ended.

    If gathering fails, the run counts as stopped early. Only the run that completes the
    last shard gathers; runs of other shards count only failures among their own cases.

    Parameters
    ----------
    design, directory : the campaign's cases and its directory
    comm : communicator of all ranks, each of which must call
    work : what this run had to compute
    asking : how to claim the right to write results.h5
    """
    cases, found, planner = len(design.settings), None, None
    shard = len(work.mine) < cases
    more = bool(work.extended or design.twins)  # such cases may still have a row
    if comm.rank == 0 and (more or shard):
        plan = replace(design.manifest(), extended=list(work.extended))
        planner = ended_in(directory.journals, plan).planner()
        found = _ending_of(work.mine, planner) if shard else None
    of_shard: Ending | None = from_root(comm, found)
    if of_shard is not None and of_shard.left:
        return of_shard
    try:
        fresh = _gathered(design, directory, comm, work, asking)
    except (BrokenOffError, NoRoomError) as error:  # raised on every rank
        return _stopped(cases, error)
    except (MissingFileError, StoreError) as error:
        return replace(_stopped(cases, error), lasting=True)
    # failures are counted in the results file that was published
    count: dict[str, int] = {}
    if comm.rank == 0:
        count = count_statuses(directory.results)
        cases = sum(count.values())
        _tell_budget(design, directory)
        _forget_the_dead(directory)
    failed, missing = cases - count.get("ok", 0), count.get("missing", 0)
    of_twins = 0
    if planner is not None:
        alone = planner.open | planner.failed_alone
        failed = max(failed, int(alone.sum()))
        of_twins = max(int((alone | planner.failed).sum()) - failed, 0)
    return Ending(
        complete=True, cases=cases, failed=failed + of_twins, of_twins=of_twins,
        results=directory.results, missing=missing, gathered=fresh,
    )  # fmt: skip


def _gathered(
    design: Design, directory: Directory, comm: Communicator, work: Work, asking: Asking
) -> bool:
    """Write results.h5 again if it is out of date; return whether it was written.

    Parameters
    ----------
    design, directory : the campaign's cases and its directory
    comm : communicator of all ranks, each of which must call
    work : what this run had to compute
    asking : how to claim the right to write results.h5
    """
    fresh = work.jobs > 0
    if comm.rank == 0:
        fresh = fresh or not is_current(directory, threshold_facts())
    fresh = bool(from_root(comm, fresh))
    if fresh:
        gather(directory, facts_of(design, comm), comm, asking=asking)
    return fresh


def _tell_budget(design: Design, directory: Directory) -> None:
    """Print how many cases the budget of [refine] left out, if it left out any."""
    dropped = dropped_of(full_plan(directory)) if design.grows else 0
    if dropped:
        say(f"the budget of [refine] is spent: {dropped} refined cases are left out, "
            "and others that would follow from their words")  # fmt: skip


def _forget_the_dead(directory: Directory) -> None:
    """Remove the notes of dead processes on cases that have got a result meanwhile."""
    if directory.notes.all():
        ended = {r["digest"]: r["status"] for r in directory.journals.records()}
        directory.notes.forget({name for name in ended if ended[name] == "ok"})


def _stopped(cases: int, error: Exception) -> Ending:
    return Ending(complete=False, cases=cases, reason=str(error))


def _ending_of(mine: Sequence[int], planner: Planner) -> Ending:
    """Return how the run of a shard ended, and how many cases are left in other shards.

    Parameters
    ----------
    mine : numbers of the shard's cases
    planner : planner of the whole campaign, which knows the jobs left
    """
    own = np.asarray(mine)
    missing = int(planner.open[own].sum())
    failed = int((planner.open | planner.failed)[own].sum())
    left = int(planner.open.sum()) - missing
    return Ending(
        complete=True, cases=len(planner), failed=failed, left=left, missing=missing
    )


def _as_text(given: str) -> str:
    """Return a command line as text in UTF-8; bytes that are not UTF-8 are escaped."""
    return given.encode("utf-8", "backslashreplace").decode()


def _git_state() -> str:
    folder = Path(__file__).parent
    call = ["git", "-C", str(folder), "describe", "--always", "--dirty", "--abbrev=12"]
    try:
        done = subprocess.run(
            call, capture_output=True, text=True, timeout=5, check=True
        )
    except (OSError, subprocess.SubprocessError):
        return "not a git checkout"
    return done.stdout.strip()


def _preset_facts(design: Design) -> dict[str, str | float]:
    """Return attributes of results.h5: the preset of all cases, and its accuracy loss.

    {} without a preset, or if an input of the preset is swept.
    """
    name = preset_of(design.base)
    if not name or set(design.swept) & preset_inputs(name).keys():
        return {}
    return {"preset": name, "preset_loses": loss_of(design.base)}


def facts_of(design: Design, comm: Communicator = ALONE) -> dict[str, str | float]:
    """Return the attributes of results.h5 that say how the results were made.

    These are version, command, scene, hosts, ranks, libraries, time and thresholds.

    comm : communicator of all ranks, each of which must call
    """
    hosts = sorted(set(comm.allgather(socket.gethostname())))
    now = dt.datetime.now(tz=dt.UTC).isoformat(timespec="seconds")
    return {
        "version": hpcwhirl.__version__,
        "git": _git_state(),
        "command": _as_text(shlex.join(sys.argv)),
        "scene": to_toml(design.base),
        **_preset_facts(design),
        "hosts": " ".join(hosts),
        "ranks": str(comm.size),
        "mpi": library_of(comm),
        "python": platform.python_version(),
        "libraries": " ".join(f"{n} {metadata.version(n)}" for n in LIBRARIES),
        "created": now,
        **threshold_facts(),
    }


def write_case(path: Path, design: Design, result: Result) -> None:
    """Write the results of a single case as a results file like that of a campaign.

    The file is written under a temporary name in the same folder, then renamed.

    Parameters
    ----------
    path : file to write or replace
    design : design of one case
    result : result of the case

    Raises
    ------
    MissingFileError, StoreError
        if the file cannot be written; an older one stays
    """
    name = design.digest(0)
    performance = {"rank": 0, "host": socket.gethostname(), **result.performance}
    record = {"case": 0, "digest": name, "ended": time.time(), "status": "ok",
              "message": "; ".join(notes_on(design.scene(0), result.row)),
              "row": result.row, "performance": performance}  # fmt: skip
    with telling(path):
        make_folders(path.parent)
        with tempfile.TemporaryDirectory(prefix=".hpcwhirl-", dir=path.parent) as place:
            directory = Directory(Path(place))
            units = list(written_units())
            plan = replace(design.manifest(), machines=[machine_facts()], units=units)
            directory.plan.write(plan)
            with Journal(directory.journals, 1, 0) as journal:
                journal.append(record, result.traces)
            publish(gather(directory, facts_of(design)), path)
