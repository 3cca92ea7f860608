"""A campaign from design to results: continue, distribute, keep, gather."""

from __future__ import annotations

import datetime as dt
import platform
import shlex
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager, suppress
from dataclasses import asdict, dataclass
from importlib import metadata
from pathlib import Path
from typing import Any

import hpcwhirl
from hpcwhirl.analysis.regimes import Thresholds
from hpcwhirl.campaign.agenda import Agenda
from hpcwhirl.campaign.cost import (
    Costs,
    costs_of,
    learn_from,
    nothing_known,
    predicted_steps,
)
from hpcwhirl.campaign.design import Design
from hpcwhirl.campaign.evaluate import Desk, Evaluator
from hpcwhirl.campaign.halfway import Halfway
from hpcwhirl.campaign.isolate import Child
from hpcwhirl.campaign.log import say
from hpcwhirl.campaign.policy import Policy
from hpcwhirl.campaign.progress import duration_text
from hpcwhirl.campaign.ranks import Stop, Tally, map_ranks, map_serial
from hpcwhirl.campaign.resume import suspects, to_do
from hpcwhirl.campaign.shards import Shard, share
from hpcwhirl.campaign.shares import keep_shares
from hpcwhirl.campaign.stop import Stopping, breakable
from hpcwhirl.campaign.units import Unit, units_of
from hpcwhirl.dynamics.lanes import Lanes
from hpcwhirl.dynamics.march import March
from hpcwhirl.errors import MissingFileError
from hpcwhirl.reduction.plan import folds_of
from hpcwhirl.scene import digest, loss_of, preset_inputs, preset_of, to_toml
from hpcwhirl.store.gather import RESULTS, gather
from hpcwhirl.store.journal import Journal, claim_run, read_records
from hpcwhirl.store.running import Running

PROGRESS_EVERY = 5.0  # s, at first
PROGRESS_SHARE = 0.02  # of the time spent so far, later
PROGRESS_RAREST = 300.0  # s
LIBRARIES = ("numpy", "scipy", "numba", "h5py", "mpi4py")


@dataclass(frozen=True)
class Ending:
    """How a campaign ended on this call.

    Attributes
    ----------
    complete : whether all cases have ended and results were written
    cases, failed : of the campaign; those without a result, once it is complete
    results : the file
    reason : why it stopped early
    gave_up : whether it was for too many failures
    left : cases of other shards that have no result yet
    """

    complete: bool
    cases: int
    failed: int
    results: Path | None
    reason: str = ""
    gave_up: bool = False
    left: int = 0


def run_campaign(
    design: Design,
    folder: Path,
    comm: Any = None,
    policy: Policy | None = None,
    stopping: Stopping | None = None,
) -> Ending:
    """Integrate what is left of a campaign and gather its results.

    Every rank of `comm` must call; `prepare` has been called by one.

    Parameters
    ----------
    design : the campaign
    folder : its directory
    comm : MPI communicator; None for one process
    policy : limits, retries, isolation; the same on every rank
    stopping : that has taken over the signals already; None: while this runs
    """
    policy = policy or Policy()
    node = _node_of(comm)
    with ExitStack() as stack:
        stopping = stopping or stack.enter_context(Stopping())
        first = node is None or node.rank == 0
        stopping.watch(folder if first else None, policy.seconds)
        costs = nothing_known()  # on other ranks: they hand nothing out
        if comm is None or comm.rank == 0:
            costs = costs_of(design)
            learn_from(folder, design, costs)
        work = _work(design, folder, comm, policy, costs)
        with _desk(folder, work, comm, policy, stopping) as desk:
            agenda = _agenda(work, costs, comm)
            complete, gave_up = _compute(design, work, desk, comm, node, agenda)
        if complete:  # a signal does not interrupt what is left to do
            return _conclude(design, folder, comm, policy.shard)
        reasons = [stopping.reason]
        reasons = comm.allgather(stopping.reason) if comm is not None else reasons
    return Ending(
        complete=False, cases=len(design.cases), failed=0, results=None,
        reason=next(filter(None, reasons), ""), gave_up=gave_up,
    )  # fmt: skip


def _conclude(design: Design, folder: Path, comm: Any, shard: Shard | None) -> Ending:
    """Gather a campaign that has been computed; a full disk stops it here."""
    cases, failed, others, results, told = len(design.cases), 0, 0, None, ""
    if comm is None or comm.rank == 0:
        failed = _count_failed(design, folder, shard)
        others = len(to_do(design, folder)) if shard else 0
    others = comm.bcast(others, root=0) if comm is not None else others
    if others:
        return Ending(
            complete=True, cases=cases, failed=failed, results=None, left=others
        )
    # Two shards that end at once both gather, each under a name of its own.
    part = f"{RESULTS}.part-{shard.number}" if shard else f"{RESULTS}.part"
    try:
        results = gather(folder, facts_of(design, comm), comm, part)
    except MissingFileError as error:  # the same on every rank
        told = str(error)
    return Ending(results is not None, cases, failed, results, told)


def cases_of(design: Design, shard: Shard | None) -> frozenset[int]:
    """Return the cases that a shard computes; without one, all."""
    if shard is None:
        return frozenset(range(len(design.cases)))
    return share([predicted_steps(scene) for scene in design.cases], shard)


@dataclass(frozen=True)
class _Work:
    """What is left of a campaign, and the number of the run that does it."""

    units: list[Unit]
    suspects: frozenset[int]
    run: int


def _node_of(comm: Any) -> Any:
    """Return the communicator of this node's ranks, None for one process."""
    if comm is None:
        return None
    from mpi4py import MPI

    return comm.Split_type(MPI.COMM_TYPE_SHARED)


def _work(
    design: Design, folder: Path, comm: Any, policy: Policy, costs: Costs
) -> _Work:
    """Return the work of all ranks, as rank 0 finds it in the directory."""
    work = None
    if comm is None or comm.rank == 0:
        mine = cases_of(design, policy.shard)
        left = [case for case in to_do(design, folder, policy.retry) if case in mine]
        alone = suspects(design, folder, left)
        seconds = dict(zip(left, costs.predict(left), strict=True))
        order = sorted(set(left) - alone, key=lambda i: (-seconds[i], i))
        units = _units(design, order, comm.size if comm is not None else 1, policy)
        units += [(case,) for case in sorted(alone)]
        work = _Work(units, alone, claim_run(folder))
    shared = comm.bcast(work, root=0) if comm is not None else work
    if shared is None:
        msg = "rank 0 has shared no work"
        raise RuntimeError(msg)
    return shared


def _units(design: Design, order: list[int], ranks: int, policy: Policy) -> list[Unit]:
    steps = sum(predicted_steps(design.cases[case]) for case in order)
    lanes = False if policy.isolate else policy.lanes
    if lanes is not None:
        steps = float("inf") if lanes else 0.0
    return units_of(order, design.cases, steps, ranks)


@contextmanager
def _desk(
    folder: Path, work: _Work, comm: Any, policy: Policy, stopping: Stopping
) -> Iterator[Desk]:
    """Open what this rank works with."""
    rank = comm.rank if comm is not None else 0
    halfway = Halfway(folder, policy.save_every, say)
    child = Child(folder, policy.save_every)
    with (
        Journal(folder, work.run, rank) as journal,
        Running(folder, work.run, rank) as running,
        closing(child),
    ):
        yield Desk(
            rank, journal, running, halfway, child, policy, stopping, work.suspects
        )


def _agenda(work: _Work, costs: Costs, comm: Any) -> Agenda:
    """Return what this rank hands out: all units on rank 0, nothing elsewhere."""
    if comm is not None and comm.rank > 0:
        return Agenda([], costs)
    alone = {u for u, cases in enumerate(work.units) if set(cases) & work.suspects}
    return Agenda(work.units, costs, comm.size if comm is not None else 1, last=alone)


def _compute(
    design: Design, work: _Work, desk: Desk, comm: Any, node: Any, agenda: Agenda
) -> tuple[bool, bool]:
    """Do the work on all ranks; return whether all is done and whether it gave up."""
    if work.units:
        _warm(design, work, desk, node)
    report = _Report(design, agenda, desk) if desk.rank == 0 else None
    evaluate = Evaluator(design, work.units, desk)
    notice, tally = report if report else _ignore, Tally()
    if comm is None:
        complete = map_serial(agenda, evaluate, notice, desk.stopping, tally)
    else:
        complete = map_ranks(agenda, evaluate, notice, desk.stopping, comm, tally)
    if work.units:
        keep_shares(desk.journal.folder, work.run, tally, comm)
    return complete, report is not None and report.gave_up


def _ignore(unit: int, statuses: list[str]) -> None:
    del unit, statuses


def _count_failed(design: Design, folder: Path, shard: Shard | None) -> int:
    records = read_records(folder)
    own = (records.get(design.digests[case]) for case in cases_of(design, shard))
    return sum(r is not None and r["status"] != "ok" for r in own)


def _warm(design: Design, work: _Work, desk: Desk, node: Any) -> None:
    """Fill numba's cache on one rank a node, then let the others read it."""
    if node is None or node.rank == 0:
        with suppress(Stop):  # the ranks will see it, too
            _compile(design, work, desk)
    if node is not None:
        node.Barrier()


def _compile(design: Design, work: _Work, desk: Desk) -> None:
    """Take a step of a case of each scheme, and of a batch if there is one."""

    def between() -> None:
        if desk.stopping():
            raise Stop

    left = [c for unit in work.units for c in unit if c not in work.suspects]
    scenes = [design.cases[case] for case in reversed(left)]
    first = {(s.solver.scheme, folds_of(s)): s for s in scenes}
    desk.running.begin(digest(scene) for scene in first.values())
    if desk.policy.isolate:
        desk.child.warm(list(first.values()), between)
        return
    batch = next((unit for unit in work.units if len(unit) > 1), None)
    with breakable(between):
        for scene in first.values():
            try:
                March(scene).advance(1)
            except Stop:
                raise
            except Exception:  # noqa: BLE001 - it will fail as a row
                continue
        if batch is not None:
            march = March(design.cases[batch[0]])
            group = Lanes(march)
            group.load(0, march)
            group.advance(1)


class _Report:
    """Plain progress lines on rank 0's stderr."""

    def __init__(self, design: Design, agenda: Agenda, desk: Desk) -> None:
        self.desk, self.agenda = desk, agenda
        self.total = sum(map(len, agenda.units))
        self.finished = self.failed = 0
        self.start = self.last = time.monotonic()
        shard = desk.policy.shard
        mine = len(cases_of(design, shard))
        of = f" of {len(design.cases)} in shard {shard}" if shard else ""
        kept = mine - self.total
        already = f", {kept} already there" if kept else ""
        alone = len(desk.suspects)
        apart = f", {alone} of two crashes apart" if alone else ""
        say(f"{mine} cases{of}{already}{apart}")

    @property
    def gave_up(self) -> bool:
        """Whether there were more failures on this call than allowed."""
        most = self.desk.policy.max_fails
        return most is not None and self.failed >= most

    def __call__(self, unit: int, statuses: list[str]) -> None:
        del unit
        self.finished += len(statuses)
        self.failed += sum(status != "ok" for status in statuses)
        if self.gave_up:
            self.desk.stopping.ask(f"{self.failed} cases without a result")
        now = time.monotonic()
        spent = now - self.start
        every = min(max(PROGRESS_EVERY, PROGRESS_SHARE * spent), PROGRESS_RAREST)
        if now - self.last < every and self.finished < self.total:
            return
        self.last = now
        left = self.agenda.seconds_left() / self.agenda.ranks
        bad = f", {self.failed} failed" if self.failed else ""
        rate = f"{3600 * self.finished / max(spent, 1e-9):.4g} cases/h"
        progress = f"{self.finished} of {self.total} cases{bad}, {rate}"
        say(f"{progress}, {duration_text(left)} left")


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


def facts_of(design: Design, comm: Any = None) -> dict[str, str | float]:
    """Return the root attributes that tell where results came from."""
    library = "none"
    hosts = [socket.gethostname()]
    if comm is not None:
        from mpi4py import MPI

        library = MPI.Get_library_version().splitlines()[0].strip("\x00 ")
        hosts = sorted(set(comm.allgather(hosts[0])))
    now = dt.datetime.now(tz=dt.UTC).isoformat(timespec="seconds")
    return {
        "version": hpcwhirl.__version__,
        "git": _git_state(),
        "command": shlex.join(sys.argv),
        "scene": to_toml(design.base),
        **_preset_facts(design),
        "hosts": " ".join(hosts),
        "ranks": str(comm.size if comm is not None else 1),
        "mpi": library,
        "python": platform.python_version(),
        "libraries": " ".join(f"{n} {metadata.version(n)}" for n in LIBRARIES),
        "created": now,
        **{f"threshold_{n}": v for n, v in asdict(Thresholds()).items()},
    }
