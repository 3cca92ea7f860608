"""Beginning, continuing and renaming a campaign's directory."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hpcwhirl.campaign.fingerprint import difference
from hpcwhirl.campaign.plan.branching import FIXED as OF_BRANCH
from hpcwhirl.campaign.plan.design import Design
from hpcwhirl.campaign.plan.sampling import check_scenes
from hpcwhirl.campaign.plan.twins import twins_of_plan
from hpcwhirl.case.limits import check_step
from hpcwhirl.errors import InputError, WhirlError
from hpcwhirl.scene import Scene, apply_settings, input_names
from hpcwhirl.scene.batch_validation import Many
from hpcwhirl.scene.table import is_begun_by
from hpcwhirl.store.atomic import Check, anyone
from hpcwhirl.store.directory.campaign_directory import Directory
from hpcwhirl.store.directory.manifest import (
    CONTENT,
    FINGERPRINT,
    MEASURE,
    SAMPLE,
    Manifest,
    PlanFile,
)
from hpcwhirl.store.results.sampled import drawn_axis

MOST_TRIED = 32  # models built to find a case that can be integrated
FIXED = (
    "--extend and [refine] exclude each other, since [refine] compares words of runs "
    'of equal duration: use until = "decided" in [solver] instead'
)


def prepare(
    design: Design,
    directory: Directory,
    extend: float | None = None,
    *,
    mends: bool = False,
    check: Check = anyone,
) -> None:
    """Begin a campaign directory, or check that it may be continued.

    Parameters
    ----------
    design, directory : the campaign
    extend : end time to which undecided cases are extended, s; None: no further one
    mends : whether a changed user's function is accepted, since only cases without
        numbers of the function will be computed
    check : raises if another process has taken over the directory; see
        `store.directory.owner.Claim.check`

    Raises
    ------
    InputError
        if an input differs from the one that the directory was begun with, if the time
        step of every case is above its limit, or if a file STOP keeps the campaign
        stopped
    """
    if directory.stop_file.exists():
        msg = (
            f"{directory.stop_file} keeps this campaign stopped: remove it to continue"
        )
        raise InputError(msg)
    old, manifest, plan = None, design.manifest(), directory.plan
    if plan.path.exists():
        old = plan.read()
        plan.check_same(old, manifest)
        if not mends:
            _check_measure(old, manifest, plan)
    manifest = replace(manifest, extended=extended_by(design, plan, extend))
    if old == manifest:
        return
    check_steps(design)
    plan.write(manifest, check)


def _check_measure(old: Manifest, new: Manifest, file: PlanFile) -> None:
    """Refuse a measure other than the one whose numbers the directory holds."""
    was, now = (plan.base.get(FINGERPRINT, "") for plan in (old, new))
    changed = difference(was, now)
    if changed:
        raise InputError(
            f"{file.folder} has numbers of another measure: {changed} differs: use "
            'another `out`, or fresh=True to compute all cases anew; retry="failed" '
            "keeps these numbers and computes only the cases without any"
        )


def extended_by(design: Design, plan: PlanFile, extend: float | None) -> list[float]:
    """Return the end times, s, to which undecided cases of a campaign are extended.

    extend : a further end time, s, which may be equal to the last one; None: no
        further one

    Raises
    ------
    InputError
        if `extend` is earlier than the last end time, or no case would last longer
    """
    if extend is not None and (design.grows or design.is_branched):
        raise InputError(FIXED if design.grows else OF_BRANCH)
    times = plan.read().extended if plan.path.exists() else []
    if extend is None:
        return times
    last = times[-1] if times else 0.0
    if extend < last:
        msg = f"--to must be >= {last:g} s, to which {plan.folder} was extended, got "
        raise InputError(f"{msg}{extend:g}")
    least = float(min(last.min() for last in design.columns.last_ends()))
    if extend <= least:
        msg = (
            f"--to must be > {least:g} s, the planned end of all cases, got {extend:g}"
        )
        raise InputError(msg)
    return times if extend == last else [*times, extend]


def as_begun(design: Design, plan: PlanFile) -> Design:
    """Return the design with the draws stored in the plan, if it stores draws.

    Raises
    ------
    InputError
        if more draws are asked for, but this version of SciPy draws other numbers
    """
    sample = design.sample
    if sample is None or not plan.path.exists():
        return design
    old = plan.read()
    if old.base.get(SAMPLE) != sample.plan():
        return design  # refused later, when the directory is prepared
    kept, own = drawn_axis(old), drawn_axis(design.manifest())
    if is_begun_by(kept, own) or is_begun_by(own, kept):
        return design
    if len(kept) < len(own):
        msg = f"{plan.folder} has other draws than this version of SciPy makes: the "
        msg += "campaign cannot be "
        raise InputError(msg + f"continued beyond {len(kept)} draws per point")
    rows = design.settings.along_last(kept.until(len(own)))
    check_scenes(design.base, rows, sample)
    return replace(design, settings=rows)


def planned(file: PlanFile) -> Design:
    """Return the design of a campaign from its plan.

    Raises
    ------
    InputError
        for a refined campaign, and for one with a user's function, which no file holds
    """
    plan = file.read()
    if plan.refine:
        raise InputError(f"{file.folder}: {FIXED}")
    if MEASURE in plan.base:
        msg = (
            f"{file.folder}: its cases have numbers of a user's function, which is in "
        )
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
