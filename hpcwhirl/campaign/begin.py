"""Start of a run: its options, the claim on the directory, and the plan stored in it.

A run is one start of a campaign by the command or from Python. It first claims the
campaign's directory, so that no other run computes in it, and then either writes the
plan or checks that the stored plan is the same.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import replace
from typing import NamedTuple, Self

import numpy as np

from hpcwhirl.campaign.fingerprint import difference
from hpcwhirl.campaign.machine import machine_facts
from hpcwhirl.campaign.plan.branching import FIXED as OF_BRANCH
from hpcwhirl.campaign.plan.design import Design
from hpcwhirl.campaign.plan.sampling import Twins, check_scenes
from hpcwhirl.campaign.stop import Stopping, time_left
from hpcwhirl.case.limits import check_step
from hpcwhirl.errors import InputError, WhirlError, cases_told, say
from hpcwhirl.launch import Communicator, Shard, from_root
from hpcwhirl.scene import Scene, apply_settings, input_names
from hpcwhirl.scene.batch_validation import Many
from hpcwhirl.scene.campaign_tables import Campaign, walltime_seconds
from hpcwhirl.scene.table import is_begun_by
from hpcwhirl.scene.units import written_units
from hpcwhirl.store.atomic import Check, anyone, sweep
from hpcwhirl.store.directory.campaign_directory import Directory
from hpcwhirl.store.directory.completions import told_by
from hpcwhirl.store.directory.journal import Journals
from hpcwhirl.store.directory.manifest import (
    CONTENT,
    FINGERPRINT,
    MEASURE,
    SAMPLE,
    Manifest,
    PlanFile,
)
from hpcwhirl.store.directory.owner import (
    CAMPAIGN,
    Asking,
    BrokenOffError,
    Claim,
    shard_claim,
)
from hpcwhirl.store.results.sampled import drawn_axis

LIMITED = ("stopped", "overloaded")  # outcomes at the amplitude limit
LONG_AGO = 3600.0  # s, age of an unfinished small file that nobody can still be writing
PICTURES = ("map.", "report.")  # beginnings of the names of maps and pages
MOST_TRIED = 32  # models built to find a case that can be integrated
FIXED = (
    "--extend and [refine] exclude each other, since [refine] compares words of runs "
    'of equal duration: use until = "decided" in [solver] instead'
)


class Policy(Campaign):
    """Options of one run of a campaign: the table [campaign], and those of the run.

    Attributes
    ----------
    seconds : wall time until this run stops, s; None: no limit
    shard : part of the cases that this run computes, see `launch.Shard`; None: all
        cases. The run that completes the last shard gathers the results
    take_over : whether a claim on the directory by a process on another machine is
        ignored, as if that process were dead
    pilot : computing time after which a pilot (a trial run for a forecast) stops, s;
        its cases are spread evenly over the campaign; None: no pilot
    """

    seconds: float | None = None
    shard: Shard | None = None
    take_over: bool = False
    pilot: float | None = None

    @classmethod
    def of(
        cls,
        rules: Campaign,
        shard: Shard | None = None,
        *,
        take_over: bool = False,
        pilot: float | None = None,
    ) -> Self:
        """Return the options of a run that begins now.

        The wall time that it has left is counted from this moment.

        Parameters
        ----------
        rules : table [campaign] of the TOML file
        shard, take_over, pilot : attributes of `Policy`
        """
        given = walltime_seconds(rules.walltime) if rules.walltime else None
        own = {"seconds": time_left(given), "shard": shard, "take_over": take_over}
        own["pilot"] = pilot
        return cls(**dict(rules) | own)

    @property
    def limit(self) -> float:
        """Longest computing time of one case, s; infinite without `case_limit`."""
        return math.inf if self.case_limit is None else self.case_limit

    @property
    def is_strict(self) -> bool:
        """Whether ranks of another kind of machine are refused."""
        return self.same == "strict"


class Prepared(NamedTuple):
    """A campaign as rank 0 has prepared it: cases, directory and options of the run.

    Rank 0 sends it to all ranks.

    Attributes
    ----------
    design : the campaign's cases
    directory : the campaign's directory
    policy : options of this run
    fresh : whether an existing directory is renamed, so that the campaign starts over
    extend : end time to which undecided cases are extended, s; None: no extension
    """

    design: Design
    directory: Directory
    policy: Policy
    fresh: bool = False
    extend: float | None = None


def begin(prepared: Prepared, stopping: Stopping) -> Claim:
    """Claim a campaign's directory for this run, store its plan, and return the claim.

    Only rank 0 calls this. With `fresh` an existing directory is renamed first.

    Parameters
    ----------
    prepared : the campaign and the options of this run
    stopping : handler of stop requests; a request ends the wait for another process

    Raises
    ------
    InputError
        if the directory belongs to another campaign, or another run computes in it
    """
    design, directory, policy, fresh, extend = prepared
    asking = asking_of(stopping, take_over=policy.take_over)
    if fresh and directory.path.exists():
        with directory.claims.make(CAMPAIGN, asking) as old:  # waits for its shards
            old.check()
            aside = directory.put_aside()
            if aside:
                old.moved(aside.claims)
                say(f"the former {directory} is now {aside}")
    own = directory.claims.make(claim_of(policy.shard), asking)
    try:
        mends = "failed" in policy.retry
        prepare(design, directory, extend, mends=mends, check=own.check)
        if extend is not None:
            _tell_stopped(directory.journals, design)
    except BaseException:
        own.release()
        raise
    return own


def _tell_stopped(journals: Journals, design: Design) -> None:
    """Print how many undecided cases an extension leaves out.

    These are cases that reached the amplitude limit, at which integration stops.
    """
    found = set[int]()
    for rows, cases in told_by(journals, design.digests):
        outcome = rows.words("row.outcome")
        ended = np.logical_or.reduce([outcome == word for word in LIMITED])
        found.update(cases[ended & (cases >= 0)].tolist())
    if found:
        say(f"{cases_told(len(found))} ended at the amplitude limit: none is extended")


def asking_of(stopping: Stopping, *, take_over: bool = False) -> Asking:
    """Return how to claim a directory: a stop request ends waiting for other processes.

    Parameters
    ----------
    stopping : handler of stop requests
    take_over : whether claims of processes on other machines are ignored, as if these
        were dead
    """

    def check() -> None:
        if stopping():
            msg = f"{stopping.reason} while waiting for another process"
            raise BrokenOffError(msg)

    return Asking(take_over, say, check)


def claim_of(shard: Shard | None) -> str:
    """Return the name of a run's claim: on the whole directory, or on one shard."""
    return shard_claim(shard.number, shard.of) if shard else CAMPAIGN


@contextmanager
def owned(
    directory: Directory,
    shard: Shard | None,
    comm: Communicator,
    stopping: Stopping,
    own: Claim | None,
) -> Iterator[None]:
    """Hold rank 0's claim on a campaign's directory while the block runs.

    If another process takes the directory over meanwhile, a stop is requested.
    Incomplete files that killed runs have left are removed at the start.

    Parameters
    ----------
    directory : directory of the campaign
    shard : shard that this run computes; None: all cases
    comm : communicator of all ranks, each of which must call
    stopping : handler of stop requests of this process
    own : claim that rank 0 already holds and keeps afterwards; None: a claim is made
        and released here

    Raises
    ------
    InputError
        on every rank, if another run computes in the directory
    """
    new, error = None, None
    if own is None and comm.rank == 0:
        try:
            own = new = directory.claims.make(claim_of(shard), asking_of(stopping))
        except WhirlError as failed:
            error = failed
    error = from_root(comm, error)
    if error is not None:
        raise error
    with new or nullcontext():
        if own is not None:
            own.when_lost = stopping.ask
            _tidy(directory, own, shared=shard is not None)
        yield


def _tidy(directory: Directory, own: Claim, *, shared: bool) -> None:
    """Remove incomplete files that killed runs have left in a campaign's directory.

    Parameters
    ----------
    directory : directory of the campaign
    own : this process's claim on it
    shared : whether runs of other shards may be writing in it now; then only files of
        more than `LONG_AGO` seconds are removed
    """
    # Other shards may be writing now, but a small file never takes that long.
    own.check()
    begun = own.path.stat().st_mtime
    older = begun - LONG_AGO if shared else math.inf
    directory.sweep(older)
    for stem in PICTURES:  # commands `map` and `report` may be writing these now
        sweep(directory.path, stem, min(older, begun))


def prepare(
    design: Design,
    directory: Directory,
    extend: float | None = None,
    *,
    mends: bool = False,
    check: Check = anyone,
) -> None:
    """Write a new campaign's plan into its directory, or check the plan stored there.

    A stored plan must be that of the same campaign, except for further cases and a
    later end time of undecided cases, which are added.

    Parameters
    ----------
    design : the campaign's cases
    directory : the campaign's directory
    extend : end time to which undecided cases are extended, s; None: no further one
    mends : whether a changed `measure` (the user's function) is accepted, since only
        cases without numbers of the function will be computed
    check : called before the plan is written; raises if another process has taken over
        the directory, see `store.directory.owner.Claim.check`

    Raises
    ------
    InputError
        if an input differs from the stored plan, if the time step of every case is
        above its limit, or if a file STOP keeps the campaign stopped
    """
    if directory.stop_file.exists():
        stop = directory.stop_file
        raise InputError(f"{stop} keeps this campaign stopped: remove it to continue")
    plan = directory.plan
    old, manifest = check_begun(design, plan, mends=mends)
    machines = old.machines if old else [machine_facts()]
    extended = extended_by(design, plan, extend)
    units = list(written_units()) or (old.units if old else [])
    manifest = replace(manifest, extended=extended, machines=machines, units=units)
    if old == manifest:
        if old.units != units:
            plan.write(manifest, check)
        return
    check_steps(design)
    if old:
        _tell_left_out(old, manifest, directory)
    plan.write(manifest, check)


def check_begun(
    design: Design, plan: PlanFile, *, mends: bool = False
) -> tuple[Manifest | None, Manifest]:
    """Return the plan in a directory, None without one, and that of the campaign.

    design, plan, mends : as for `prepare`; the file of the plan

    Raises
    ------
    InputError
        if the directory was begun with other inputs
    """
    manifest = design.manifest()
    if not plan.path.exists():
        return None, manifest
    old = plan.read()
    plan.check_same(old, manifest)
    if not mends:
        _check_measure(old, manifest, plan)
    return old, manifest


def _tell_left_out(old: Manifest, new: Manifest, directory: Directory) -> None:
    """Print how many cases of the plan in a directory the new plan has no more."""
    count = len(set(old.digests).difference(new.digests))
    if count:
        say(
            f"{cases_told(count)} of {directory} left out, which the campaign has no "
            "more: the former lists bring them back"
        )


def _check_measure(old: Manifest, new: Manifest, file: PlanFile) -> None:
    """Raise InputError if the user's function has changed since it gave stored numbers.

    Parameters
    ----------
    old, new : plan in the directory, and plan of this call, each with the fingerprint
        of its function `measure`
    file : file of the old plan, for the message
    """
    was, now = (plan.base.get(FINGERPRINT, "") for plan in (old, new))
    changed = difference(was, now)
    if changed:
        raise InputError(
            f"{file.folder} has numbers of another measure: {changed} differs: use "
            'another `out`, or fresh=True to compute all cases anew; retry="failed" '
            "keeps these numbers and computes only the cases without any"
        )


def extended_by(design: Design, plan: PlanFile, extend: float | None) -> list[float]:
    """Return all end times to which undecided cases are extended, s, ascending.

    These are the end times in the stored plan and, if `extend` is later, `extend`.

    Parameters
    ----------
    design : the campaign's cases
    plan : file of the stored plan
    extend : end time that the user asks for, s; None: no further one

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
        msg = f"--to must be > {least:g} s, the planned end of all cases, got "
        raise InputError(f"{msg}{extend:g}")
    return times if extend == last else [*times, extend]


def as_begun(design: Design, plan: PlanFile) -> Design:
    """Return the design with the random inputs that were drawn when the campaign began.

    Inputs drawn by [sample] are stored in the plan, since another version of SciPy may
    draw other numbers; the stored ones are used again. A design without [sample] is
    returned unchanged.

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
    """Return the cases of a stored campaign, from the plan in its directory alone.

    It is used for an extension, for which the user names only the directory.

    Raises
    ------
    InputError
        for a refined campaign, and for one with a user's function, which no file holds
    """
    plan = file.read()
    if plan.refine:
        raise InputError(f"{file.folder}: {FIXED}")
    if MEASURE in plan.base:
        msg = f"{file.folder}: its cases have numbers of a user's function, which is "
        raise InputError(msg + "in no file: only campaigns without one can be extended")
    known = input_names()
    base = {name: value for name, value in plan.base.items() if name in known}
    scene = apply_settings(Scene(), base)
    contents = {scene.engine.file: str(plan.base.get(CONTENT, ""))}
    Many(scene, plan.table).check()
    return Design(
        scene, plan.table, tuple(plan.swept), contents=contents,
        twins=Twins(**plan.twins) if plan.twins else None, begun=plan.base,
    )  # fmt: skip


def check_steps(design: Design) -> None:
    """Raise InputError if the time step is above its limit in every case of a campaign.

    The limit of the time step depends only on engine, modes and gap, so one case for
    each combination of these is tried, smallest step first, until one is accepted.
    After `MOST_TRIED` models the campaign is accepted; cases with too large a step then
    fail one by one.

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
    """Return the number of one case for each combination of engine, modes and gap.

    It is the case with the smallest time step of the combination; these steps ascend.
    """
    many, names = design.columns, design.settings.names
    own = [n for n in names if n.startswith("engine.") or n in ("solver.modes", "gap")]
    if "solver.time_step" not in names:
        return [int(case) for case in many.kinds(own)]
    order = np.argsort(many.values("solver.time_step"), kind="stable")
    first = np.sort(np.unique(many.labels(own)[order], return_index=True)[1])
    return [int(case) for case in order[first]]
