"""How a campaign ends: cases without a result are counted, results are gathered."""

from __future__ import annotations

import datetime as dt
import platform
import shlex
import socket
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from importlib import metadata
from pathlib import Path

import numpy as np

import hpcwhirl
from hpcwhirl.analysis.regimes import threshold_facts
from hpcwhirl.campaign.log import say
from hpcwhirl.campaign.plan.design import Design
from hpcwhirl.campaign.work import Work
from hpcwhirl.errors import MissingFileError, NoRoomError, StoreError
from hpcwhirl.launch import ALONE, Communicator, library_of
from hpcwhirl.planner.planner import Planner
from hpcwhirl.scene import loss_of, preset_inputs, preset_of, to_toml
from hpcwhirl.store.directory.completions import planner_of
from hpcwhirl.store.directory.heartbeats import forget_crashes, notes
from hpcwhirl.store.directory.journal import scan
from hpcwhirl.store.directory.owner import Asking, BrokenOffError
from hpcwhirl.store.directory.refined import dropped_of, full_plan
from hpcwhirl.store.reading.results_file import count_statuses
from hpcwhirl.store.results.freshness import is_current
from hpcwhirl.store.results.gather import RESULTS, gather

LIBRARIES = ("numpy", "scipy", "numba", "h5py", "mpi4py")


@dataclass(frozen=True)
class Ending:
    """How a campaign ended on this call.

    Attributes
    ----------
    complete : whether all cases have ended and results were written
    cases : of the campaign
    failed : those without a result once it is complete, for whatever reason; where
        other shards are not complete, of this shard
    missing : those of them that have no row at all
    results : the file
    reason : why it stopped early
    gave_up : whether it was for too many failures
    piloted : whether it was a pilot that had its time
    left : cases of other shards that have no result yet
    lasting : whether the same command would end for the same reason
    gathered : whether the results are new: those of before held all there was
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
    lasting: bool = False
    gathered: bool = True


def conclude(
    design: Design, folder: Path, comm: Communicator, work: Work, asking: Asking
) -> Ending:
    """Gather a campaign that has been computed; a full disk stops it here.

    A shard that is not the last leaves that to others: it has failed where one of its
    own cases has no result, not where others are still to come.
    """
    cases, found, planner = len(design.settings), None, None
    shard = len(work.mine) < cases
    more = bool(work.extended or design.twins)  # a row may be there nevertheless
    if comm.rank == 0 and (more or shard):
        plan = replace(design.manifest(), extended=list(work.extended))
        planner = planner_of(folder, plan)
        found = _ending_of(work.mine, planner) if shard else None
    of_shard: Ending | None = comm.bcast(found, root=0)
    if of_shard is not None and of_shard.left:
        return of_shard
    try:
        results, fresh = _gathered(design, folder, comm, work, asking)
    except (BrokenOffError, NoRoomError) as error:  # the same on every rank
        return _stopped(cases, error)
    except (MissingFileError, StoreError) as error:
        return replace(_stopped(cases, error), lasting=True)
    # of the file: what was published is what is told
    count: dict[str, int] = {}
    if comm.rank == 0:
        count = count_statuses(results)
        cases = sum(count.values())
        _tell_budget(design, folder)
        _forget_the_dead(folder)
    failed, missing = cases - count.get("ok", 0), count.get("missing", 0)
    if planner is not None:
        failed = max(failed, int((planner.open | planner.failed).sum()))
    return Ending(
        complete=True, cases=cases, failed=failed, results=results, missing=missing,
        gathered=fresh,
    )  # fmt: skip


def _gathered(
    design: Design, folder: Path, comm: Communicator, work: Work, asking: Asking
) -> tuple[Path, bool]:
    """Return the results, gathered anew where they do not hold all there is."""
    results, fresh = folder / RESULTS, work.jobs > 0
    if comm.rank == 0:
        fresh = fresh or not is_current(results, threshold_facts())
    fresh = bool(comm.bcast(fresh, root=0))
    if fresh:
        gather(folder, facts_of(design, comm), comm, asking=asking)
    return results, fresh


def _tell_budget(design: Design, folder: Path) -> None:
    """Say that a budget has ended a refinement, if one has."""
    dropped = dropped_of(full_plan(folder)) if design.grows else 0
    if dropped:
        say(f"the budget ended the refinement: it left out {dropped} cases that words "
            "ask for, and what theirs might have asked for")  # fmt: skip


def _forget_the_dead(folder: Path) -> None:
    """Remove what processes that died have noted of cases that gave a result since."""
    if notes(folder):
        ended = scan(folder, lambda record: record["status"])
        forget_crashes(folder, {name for name in ended if ended[name] == "ok"})


def _stopped(cases: int, error: Exception) -> Ending:
    return Ending(complete=False, cases=cases, reason=str(error))


def _ending_of(mine: Sequence[int], planner: Planner) -> Ending:
    """Return how a shard ended: its cases without a result, and what others leave."""
    own = np.asarray(mine)
    missing = int(planner.open[own].sum())
    failed = int((planner.open | planner.failed)[own].sum())
    left = int(planner.open.sum()) - missing
    return Ending(
        complete=True, cases=len(planner), failed=failed, left=left, missing=missing
    )


def _as_text(given: str) -> str:
    """Return what may hold bytes of a path that are no UTF-8, as a file keeps it."""
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
    """Return the preset whose inputs all cases have, and what it loses, if any."""
    name = preset_of(design.base)
    if not name or set(design.swept) & preset_inputs(name).keys():
        return {}
    return {"preset": name, "preset_loses": loss_of(design.base)}


def facts_of(design: Design, comm: Communicator = ALONE) -> dict[str, str | float]:
    """Return the root attributes that tell where results came from."""
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
