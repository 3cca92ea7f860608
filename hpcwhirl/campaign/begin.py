"""The start of a run: claim the campaign's directory, then make or continue it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from typing import NamedTuple

from hpcwhirl.campaign.log import say
from hpcwhirl.campaign.plan.design import Design
from hpcwhirl.campaign.policy import Policy
from hpcwhirl.campaign.resume import prepare
from hpcwhirl.campaign.stop import Stopping
from hpcwhirl.errors import WhirlError
from hpcwhirl.launch import Communicator, Shard, from_root
from hpcwhirl.store.atomic import sweep
from hpcwhirl.store.directory.campaign_directory import Directory
from hpcwhirl.store.directory.columns import told_by
from hpcwhirl.store.directory.journal import Journals
from hpcwhirl.store.directory.owner import (
    CAMPAIGN,
    Asking,
    BrokenOffError,
    Claim,
    shard_claim,
)

LIMITED = ("stopped", "overloaded")  # outcomes at the amplitude limit
LONG_AGO = 3600.0  # s, age of an unfinished small file that nobody can still be writing
PICTURES = ("map.", "report.")  # beginnings of the names of maps and pages


class Prepared(NamedTuple):
    """The campaign that rank 0 has prepared for all ranks.

    Attributes
    ----------
    design, directory, policy : design, directory and options of the campaign
    fresh : whether an existing directory is renamed, so that the campaign starts over
    extend : s, end time to which undecided cases are extended; None: no extension
    """

    design: Design
    directory: Directory
    policy: Policy
    fresh: bool = False
    extend: float | None = None


def begin(prepared: Prepared, stopping: Stopping) -> Claim:
    """Claim and prepare a campaign's directory on rank 0; return the claim.

    stopping : handler of stop requests, which ends waiting for other processes

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
    """Print how many cases are not extended since they reached the amplitude limit."""
    cases = {
        int(case)
        for _, told in told_by(journals, design.digests)
        for case, outcome in zip(told.case, told.outcome, strict=True)
        if case >= 0 and outcome in LIMITED
    }
    if cases:
        noun = "case" if len(cases) == 1 else "cases"
        say(f"{len(cases)} {noun} ended at the amplitude limit: none is extended")


def asking_of(stopping: Stopping, *, take_over: bool = False) -> Asking:
    """Return options for making a claim, whose waiting a stop request interrupts.

    take_over : whether claims of processes on other machines count as dead
    """

    def check() -> None:
        if stopping():
            msg = f"{stopping.reason} while waiting for another process"
            raise BrokenOffError(msg)

    return Asking(take_over, say, check)


def claim_of(shard: Shard | None) -> str:
    """Return the kind of claim that a run needs: on the whole directory or a shard."""
    return shard_claim(shard.number, shard.of) if shard else CAMPAIGN


@contextmanager
def owned(
    directory: Directory,
    shard: Shard | None,
    comm: Communicator,
    stopping: Stopping,
    own: Claim | None,
) -> Iterator[None]:
    """Hold rank 0's claim on a directory in the block; request a stop if it is lost.

    Parameters
    ----------
    directory : that of the campaign
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
    """Remove incomplete files that killed runs have left in a directory.

    shared : whether other shards may be writing in the directory now
    """
    # Other shards may be writing now, but a small file never takes that long.
    own.check()
    begun = own.path.stat().st_mtime
    older = begun - LONG_AGO if shared else math.inf
    directory.sweep(older)
    for stem in PICTURES:  # commands `map` and `report` may be writing these now
        sweep(directory.path, stem, min(older, begun))
