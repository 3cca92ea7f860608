"""A campaign from design to results: continue, distribute, keep, gather."""

from __future__ import annotations

import datetime as dt
import os
import platform
import shlex
import signal
import socket
import subprocess
import sys
import time
from dataclasses import asdict, dataclass
from importlib import metadata
from pathlib import Path
from types import FrameType
from typing import Any

import hpcwhirl
from hpcwhirl.analysis.regimes import Thresholds
from hpcwhirl.campaign.design import Design
from hpcwhirl.campaign.evaluate import Evaluator, say
from hpcwhirl.campaign.ranks import map_ranks, map_serial
from hpcwhirl.campaign.units import Unit, units_of
from hpcwhirl.dynamics.lanes import Lanes
from hpcwhirl.dynamics.march import March
from hpcwhirl.dynamics.timestep import check_step, with_step
from hpcwhirl.errors import InputError, WhirlError
from hpcwhirl.reduction.model import model_of
from hpcwhirl.reduction.plan import folds_of
from hpcwhirl.scene import Scene, apply_settings, digest, to_toml
from hpcwhirl.store.gather import gather
from hpcwhirl.store.journal import (
    Journal,
    is_whole,
    next_run,
    read_records,
)
from hpcwhirl.store.plan import NAME, check_same, read_plan, write_plan

PROGRESS_EVERY = 5.0  # s
MOST_TRIED = 32  # models built to find a case that can be integrated
LIBRARIES = ("numpy", "scipy", "numba", "h5py", "mpi4py")


@dataclass(frozen=True)
class Ending:
    """How a campaign ended on this call."""

    complete: bool
    cases: int
    failed: int
    results: Path | None


class StopFlag:
    """Set by TERM, INT or USR1; looked at between slices."""

    def __init__(self) -> None:
        self.wanted = False
        for name in (signal.SIGTERM, signal.SIGUSR1, signal.SIGINT):
            signal.signal(name, self._set)

    def _set(self, number: int, frame: FrameType | None) -> None:
        del number, frame
        self.wanted = True

    def __call__(self) -> bool:
        """Return whether this process has been asked to end."""
        return self.wanted


def prepare(design: Design, folder: Path) -> None:
    """Begin a campaign directory, or check that it may be continued.

    Raises
    ------
    InputError
        naming the value that differs from the one the directory was begun with, or
        the limit that the time step of every case is above
    """
    plan = design.plan()
    if (folder / NAME).exists():
        check_same(read_plan(folder), plan, folder)
    check_steps(design)
    write_plan(folder, plan)


def check_steps(design: Design) -> None:
    """Refuse a campaign that could not integrate any of its cases.

    The limit of the time step depends on the structures, eta and the gap alone, so
    one case is tried for each of those, smallest step first, until one is accepted;
    after `MOST_TRIED` models a campaign is let through, and its cases fail as rows.

    Raises
    ------
    InputError
        the first refusal, with its limit, where every case is refused
    """
    distinct: dict[Any, Scene] = {}
    for scene in sorted(design.cases, key=lambda s: s.solver.time_step):
        distinct.setdefault((scene.engine, scene.solver.modes, scene.gap), scene)
    refusal = None
    for scene in list(distinct.values())[:MOST_TRIED]:
        try:
            model = model_of(scene)
            check_step(model, with_step(scene, model).solver.time_step)
        except InputError as failed:
            refusal = refusal or failed
        except WhirlError:
            return
        else:
            return
    if refusal is not None and len(distinct) <= MOST_TRIED:
        raise refusal


def predicted_steps(scene: Scene) -> float:
    """Return the steps of a case, the measure of its cost."""
    if scene.solver.accuracy > 0.0:
        try:
            scene = with_step(scene, model_of(scene))
        except WhirlError:  # it will fail as a row
            return 0.0
    return scene.end_time / scene.solver.time_step


def to_do(design: Design, folder: Path, *, retry: bool) -> list[int]:
    """Return the cases without a result, the longest first."""
    kept = {
        name
        for name, record in read_records(folder).items()
        if not retry or (record["status"] == "ok" and is_whole(folder, record))
    }
    left = [i for i, s in enumerate(design.cases) if digest(s) not in kept]
    return sorted(left, key=lambda i: (-predicted_steps(design.cases[i]), i))


def seconds_per_step(scene: Scene, steps: int = 4000) -> float:
    """Return the measured cost of a step of a scene, s, compilation left out."""
    scene = with_step(scene, model_of(scene))
    short = apply_settings(scene, {"duration": steps * scene.solver.time_step})
    march = March(apply_settings(short, {"revolutions": 0.0}))
    march.advance(1)
    march.seconds = 0.0
    march.advance(steps)
    return march.seconds / (steps - 1)


def run_campaign(
    design: Design,
    folder: Path,
    comm: Any = None,
    *,
    retry: bool = False,
    lanes: bool | None = None,
) -> Ending:
    """Integrate what is left of a campaign and gather its results.

    Every rank of `comm` must call; `prepare` has been called by one.

    Parameters
    ----------
    design : the campaign
    folder : its directory
    comm : MPI communicator; None for one process
    retry : integrate failed cases again, and those whose traces are damaged
    lanes : whether cases ride in batches; None: where they pay, see `units_of`
    """
    rank = comm.rank if comm is not None else 0
    stopping = StopFlag()
    start = None
    if rank == 0:
        ranks = comm.size if comm is not None else 1
        todo = to_do(design, folder, retry=retry)
        start = (_units(design, todo, ranks, lanes=lanes), next_run(folder))
    units, run = comm.bcast(start, root=0) if comm is not None else start  # type: ignore[misc]
    order = list(range(len(units)))
    if order:
        _warm(design, units, comm)
    report = _Report(design, units) if rank == 0 else None
    with Journal(folder, run, rank) as journal:
        evaluate = Evaluator(design, units, journal, rank)
        notice = report if report else _ignore
        if comm is None:
            complete = map_serial(order, evaluate, notice, stopping)
        else:
            complete = map_ranks(order, evaluate, notice, stopping, comm)
    if not complete:
        return Ending(complete=False, cases=len(design.cases), failed=0, results=None)
    results = gather(folder, facts_of(design, comm), comm)
    failed = _count_failed(design, folder) if rank == 0 else 0
    return Ending(complete, len(design.cases), failed, results)


def _ignore(unit: int, statuses: list[str]) -> None:
    del unit, statuses


def _units(
    design: Design, order: list[int], ranks: int, *, lanes: bool | None
) -> list[Unit]:
    steps = sum(predicted_steps(design.cases[case]) for case in order)
    if lanes is not None:
        steps = float("inf") if lanes else 0.0
    return units_of(order, design.cases, steps, ranks)


def _count_failed(design: Design, folder: Path) -> int:
    records = read_records(folder)
    own = (records.get(digest(scene)) for scene in design.cases)
    return sum(r is not None and r["status"] != "ok" for r in own)


def _warm(design: Design, units: list[Unit], comm: Any) -> None:
    """Fill numba's cache on one rank a node, then let the others read it."""
    batch = next((unit for unit in units if len(unit) > 1), None)
    first = {(s.solver.scheme, folds_of(s)): s for s in reversed(design.cases)}
    local = None
    if comm is not None:
        from mpi4py import MPI

        local = comm.Split_type(MPI.COMM_TYPE_SHARED)
    if local is None or local.rank == 0:
        for scene in first.values():
            try:
                March(scene).advance(1)
            except Exception:  # noqa: BLE001 - it will fail as a row
                continue
        if batch is not None:
            march = March(design.cases[batch[0]])
            group = Lanes(march)
            group.load(0, march)
            group.advance(1)
    if local is not None:
        local.Barrier()
        local.Free()


class _Report:
    """Plain progress lines on rank 0's stderr."""

    def __init__(self, design: Design, units: list[Unit]) -> None:
        order = [case for unit in units for case in unit]
        self.design, self.units, self.total = design, units, len(order)
        self.finished = self.failed = 0
        self.work = sum(predicted_steps(design.cases[i]) for i in order)
        self.done = 0.0
        self.start = self.last = time.monotonic()
        kept = len(design.cases) - len(order)
        already = f", {kept} already there" if kept else ""
        say(f"{len(design.cases)} cases{already}")

    def __call__(self, unit: int, statuses: list[str]) -> None:
        cases = [self.design.cases[case] for case in self.units[unit]]
        self.finished += len(statuses)
        self.failed += sum(status != "ok" for status in statuses)
        self.done += sum(predicted_steps(scene) for scene in cases)
        now = time.monotonic()
        if now - self.last < PROGRESS_EVERY and self.finished < self.total:
            return
        self.last = now
        left = (now - self.start) * (self.work - self.done) / self.done
        bad = f", {self.failed} failed" if self.failed else ""
        say(f"{self.finished} of {self.total} cases{bad}, {left:.0f} s left")


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
        "hosts": " ".join(hosts),
        "ranks": str(comm.size if comm is not None else 1),
        "mpi": library,
        "python": platform.python_version(),
        "libraries": " ".join(f"{n} {metadata.version(n)}" for n in LIBRARIES),
        "created": now,
        **{f"threshold_{n}": v for n, v in asdict(Thresholds()).items()},
    }


def check_folder(folder: Path) -> None:
    """Raise InputError where a campaign directory cannot be made or written."""
    place = folder.resolve()
    if place.exists() and not place.is_dir():
        msg = f"--out must be a directory, got the file {folder}"
        raise InputError(msg)
    while not place.exists():
        place = place.parent
    if not place.is_dir() or not os.access(place, os.W_OK | os.X_OK):
        msg = f"--out {folder}: {place} cannot be written"
        raise InputError(msg)
