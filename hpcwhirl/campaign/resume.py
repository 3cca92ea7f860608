"""What a campaign directory has, what is left to do in it, and starting over."""

from __future__ import annotations

import os
from collections.abc import Collection
from pathlib import Path
from typing import Any

from hpcwhirl.campaign.design import Design
from hpcwhirl.campaign.stop import refuse_stop_file
from hpcwhirl.case.limits import check_step
from hpcwhirl.errors import InputError, MissingFileError, WhirlError
from hpcwhirl.scene import Scene
from hpcwhirl.store.journal import Record, is_whole, scan
from hpcwhirl.store.manifest import (
    NAME,
    check_same,
    is_sealed,
    read_manifest,
    write_manifest,
)
from hpcwhirl.store.running import crashes, forget_crashes
from hpcwhirl.store.states import drop_state, stored_states

MOST_TRIED = 32  # models built to find a case that can be integrated
CRASHES = 2  # of processes that a case was in flight at, from when on it is isolated


def prepare(design: Design, folder: Path) -> None:
    """Begin a campaign directory, or check that it may be continued.

    Raises
    ------
    InputError
        naming the value that differs from the one the directory was begun with, or
        the limit that the time step of every case is above; or where a file STOP
        keeps the campaign stopped
    """
    refuse_stop_file(folder)
    plan = design.plan()
    if (folder / NAME).exists():
        old = read_manifest(folder)
        check_same(old, plan, folder)
        if old == plan and is_sealed(folder):
            return
    check_steps(design)
    write_manifest(folder, plan)


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
    distinct: dict[Any, int] = {}
    for number, scene in sorted(enumerate(design.scenes), key=_step_of):
        distinct.setdefault((scene.engine, scene.solver.modes, scene.gap), number)
    refusal = None
    for number in list(distinct.values())[:MOST_TRIED]:
        try:
            case = design.resolved(number)
            check_step(case.model, case.scene)
        except InputError as failed:
            refusal = refusal or failed
        except WhirlError:
            return
        else:
            return
    if refusal is not None and len(distinct) <= MOST_TRIED:
        raise refusal


def _step_of(numbered: tuple[int, Scene]) -> float:
    return numbered[1].solver.time_step


def check_folder(folder: Path) -> None:
    """Raise InputError where a campaign directory cannot be made or written."""
    place = Path(os.path.realpath(folder))  # Path.resolve raises where links go around
    if place.exists() and not place.is_dir():
        msg = f"--out must be a directory, got the file {folder}"
        raise InputError(msg)
    while not os.path.lexists(place):
        place = place.parent
    if not place.is_dir() or not os.access(place, os.W_OK | os.X_OK):
        msg = f"--out {folder}: {place} cannot be written"
        raise InputError(msg)


def put_aside(folder: Path) -> Path | None:
    """Rename a campaign directory to a numbered sibling; return that, if there is one.

    Raises
    ------
    InputError, MissingFileError
        where it is the working directory, or cannot be renamed
    """
    if not (folder / NAME).exists():
        return None
    place = folder.resolve()
    if Path.cwd().is_relative_to(place):
        msg = f"--fresh: --out must not be the working directory, got {folder}"
        raise InputError(msg)
    number = 1
    while os.path.lexists(aside := place.with_name(f"{place.name}.{number}")):
        number += 1
    try:
        place.rename(aside)
    except OSError as failed:
        msg = f"--fresh: cannot rename {folder} to {aside}: {failed.strerror}"
        raise MissingFileError(msg) from None
    return aside


def to_do(design: Design, folder: Path, retry: Collection[str] = ()) -> list[int]:
    """Return the cases without a result, in the order of the design.

    Parameters
    ----------
    design, folder : the campaign
    retry : statuses to be computed again; if any, damaged traces are, too
    """

    def brief(record: Record) -> str | None:
        status = str(record["status"])
        damaged = retry and status == "ok" and not is_whole(folder, record)
        return None if status in retry or damaged else status

    ended = {name: end for name, end in scan(folder, brief).items() if end}
    for name in stored_states(folder) & ended.keys():  # killed before tidying
        if ended[name] != "timeout":
            drop_state(folder, name)
    forget_crashes(folder, set(ended))
    return [i for i, name in enumerate(design.digests) if name not in ended]


def suspects(design: Design, folder: Path, left: Collection[int]) -> frozenset[int]:
    """Return the cases of `left` that were in flight when processes died, twice.

    One of them may have killed its process. They are computed last, each in a process
    of its own: those that do it again are rows, the others were only bystanders.
    """
    count = crashes(folder)
    if max(count.values(), default=0) < CRASHES:
        return frozenset()
    return frozenset(i for i in left if count[design.digests[i]] >= CRASHES)
