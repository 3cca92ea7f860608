"""Beginning, continuing and renaming a campaign's directory."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path

import numpy as np

from hpcwhirl.campaign.fingerprint import difference
from hpcwhirl.campaign.plan.branching import FIXED as OF_BRANCH
from hpcwhirl.campaign.plan.design import Design
from hpcwhirl.campaign.plan.sampling import check_scenes
from hpcwhirl.campaign.plan.twins import twins_of_plan
from hpcwhirl.campaign.stop import refuse_stop_file
from hpcwhirl.case.limits import check_step
from hpcwhirl.errors import InputError, MissingFileError, WhirlError
from hpcwhirl.scene import Scene, apply_settings, input_names
from hpcwhirl.scene.batch_validation import Many
from hpcwhirl.scene.table import is_begun_by
from hpcwhirl.store.atomic import Check, anyone, keep_names
from hpcwhirl.store.directory.manifest import (
    CONTENT,
    FINGERPRINT,
    MEASURE,
    NAME,
    SAMPLE,
    Manifest,
    check_same,
    read_manifest,
    write_manifest,
)
from hpcwhirl.store.results.sampled import drawn_axis

MOST_TRIED = 32  # models built to find a case that can be integrated
FIXED = (
    "--extend and [refine] exclude each other, since cases are added by words of one "
    'duration: use until = "decided" in [solver] instead'
)


def prepare(
    design: Design,
    folder: Path,
    extend: float | None = None,
    *,
    mends: bool = False,
    check: Check = anyone,
) -> None:
    """Begin a campaign directory, or check that it may be continued.

    Parameters
    ----------
    design : the campaign
    folder : its directory
    extend : end time to which undecided cases are extended, s; None: as before
    mends : whether the measure may differ, to compute cases that have no numbers of it
    check : raises if another process has taken over the directory; see
        `store.directory.owner.Claim.check`

    Raises
    ------
    InputError
        if an input differs from the one that the directory was begun with, if the time
        step of every case is above its limit, or if a file STOP keeps the campaign
        stopped
    """
    refuse_stop_file(folder)
    old, manifest = None, design.manifest()
    if (folder / NAME).exists():
        old = read_manifest(folder)
        check_same(old, manifest, folder)
        if not mends:
            _check_measure(old, manifest, folder)
    manifest = replace(manifest, extended=extended_by(design, folder, extend))
    if old == manifest:
        return
    check_steps(design)
    write_manifest(folder, manifest, check)


def _check_measure(old: Manifest, new: Manifest, folder: Path) -> None:
    """Refuse a measure other than the one whose numbers the directory holds."""
    was, now = (plan.base.get(FINGERPRINT, "") for plan in (old, new))
    changed = difference(was, now)
    if changed:
        msg = (
            f"{folder} has numbers of another measure: {changed} differs: use another "
            'out, or fresh=True to compute all anew; retry="failed" keeps the numbers '
            "that are there and computes only what has none"
        )
        raise InputError(msg)


def extended(
    design: Design, times: list[float], time: float, folder: Path
) -> list[float]:
    """Return the end times of a campaign's extensions with a further one, s.

    Parameters
    ----------
    design : the campaign
    times : end times so far, ascending
    time : the further end time, which may be equal to the last one
    folder : the campaign's directory, for messages

    Raises
    ------
    InputError
        if it is shorter than the last one, or no case would last longer
    """
    last = times[-1] if times else 0.0
    if time < last:
        msg = (
            f"--to must be >= {last:g} s, to which {folder} was extended, got {time:g}"
        )
        raise InputError(msg)
    least = float(min(last.min() for last in design.columns.last_ends()))
    if time <= least:
        msg = f"--to must be > {least:g} s, which all cases last anyway, got {time:g}"
        raise InputError(msg)
    return times if time == last else [*times, time]


def extended_by(design: Design, folder: Path, extend: float | None) -> list[float]:
    """Return the end times, s, to which undecided cases of a directory are extended.

    extend : a further end time, s; None for none
    """
    if extend is not None and (design.grows or design.is_branched):
        raise InputError(FIXED if design.grows else OF_BRANCH)
    times = read_manifest(folder).extended if (folder / NAME).exists() else []
    return times if extend is None else extended(design, times, extend, folder)


def as_begun(design: Design, folder: Path) -> Design:
    """Return the design with the draws stored in its directory, if there are any.

    Raises
    ------
    InputError
        if more draws are asked for, but this version of SciPy draws other numbers
    """
    sample = design.sample
    if sample is None or not (folder / NAME).exists():
        return design
    old = read_manifest(folder)
    if old.base.get(SAMPLE) != sample.plan():
        return design  # refused later, when the directory is prepared
    kept, own = drawn_axis(old), drawn_axis(design.manifest())
    if is_begun_by(kept, own) or is_begun_by(own, kept):
        return design
    if len(kept) < len(own):
        msg = (
            f"{folder} has other draws than this version of SciPy makes: it cannot be "
        )
        raise InputError(msg + f"continued beyond {len(kept)} draws a point")
    rows = design.settings.along_last(kept.until(len(own)))
    check_scenes(design.base, rows, sample)
    return replace(design, settings=rows)


def planned(folder: Path) -> Design:
    """Return the design of a campaign from the plan in its directory.

    Raises
    ------
    InputError
        for a refined campaign, and for one with a user's function, which no file has
    """
    plan = read_manifest(folder)
    if plan.refine:
        raise InputError(f"{folder}: {FIXED}")
    if MEASURE in plan.base:
        msg = f"{folder}: its cases have numbers of a user's function, which is in "
        raise InputError(msg + "no file: only campaigns without one can be extended")
    known = input_names()
    base = {name: value for name, value in plan.base.items() if name in known}
    scene = apply_settings(Scene(), base)
    contents = {scene.engine.file: str(plan.base.get(CONTENT, ""))}
    Many(scene, plan.table).check()
    return Design(
        scene, plan.table, tuple(plan.swept), contents=contents,
        twins=twins_of_plan(plan.twins), begun=plan.base,
    )  # fmt: skip


def check_steps(design: Design) -> None:
    """Refuse a campaign in which the time step is too large for every case.

    The limit of the time step depends only on the structures, eta and the gap, so one
    case of each is tried, smallest step first, until one is accepted. After
    `MOST_TRIED` models the campaign is accepted; invalid cases fail later.

    Raises
    ------
    InputError
        the error of the first case, with its limit, if every case is refused
    """
    distinct = _models(design)
    refusal = None
    for number in distinct[:MOST_TRIED]:
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


def _models(design: Design) -> list[int]:
    """Return, for each structure, eta and gap, the case with the smallest time step."""
    many, names = design.columns, design.settings.names
    own = [n for n in names if n.startswith("engine.") or n in ("solver.modes", "gap")]
    if "solver.time_step" not in names:
        return [int(case) for case in many.kinds(own)]
    order = np.argsort(many.values("solver.time_step"), kind="stable")
    first = np.sort(np.unique(many.labels(own)[order], return_index=True)[1])
    return [int(case) for case in order[first]]


def check_folder(folder: Path) -> None:
    """Raise InputError if a campaign directory cannot be made or written."""
    place = Path(os.path.realpath(folder))  # Path.resolve raises for circular links
    if place.exists() and not place.is_dir():
        msg = f"--out must be a directory, got the file {folder}"
        raise InputError(msg)
    while not os.path.lexists(place):
        place = place.parent
    if not place.is_dir() or not os.access(place, os.W_OK | os.X_OK):
        msg = f"--out {folder}: {place} cannot be written"
        raise InputError(msg)


def put_aside(folder: Path) -> Path | None:
    """Rename a campaign directory, with a number added; return the new path or None.

    Raises
    ------
    InputError, MissingFileError
        if it is the working directory, or cannot be renamed
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
        keep_names(place.parent)
    except OSError as failed:
        msg = f"--fresh: cannot rename {folder} to {aside}: {failed.strerror}"
        raise MissingFileError(msg) from None
    return aside
