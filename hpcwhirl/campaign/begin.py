"""The start of a call: claim the campaign's directory, then make or continue it."""

from __future__ import annotations

from typing import NamedTuple

from hpcwhirl.campaign.log import say
from hpcwhirl.campaign.owning import asking_of, claim_of
from hpcwhirl.campaign.plan.design import Design
from hpcwhirl.campaign.policy import Policy
from hpcwhirl.campaign.resume import prepare
from hpcwhirl.campaign.stop import Stopping
from hpcwhirl.store.directory.campaign_directory import Directory
from hpcwhirl.store.directory.columns import told_by
from hpcwhirl.store.directory.journal import Journals
from hpcwhirl.store.directory.owner import CAMPAIGN, Claim

LIMITED = ("stopped", "overloaded")  # outcomes at the amplitude limit


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
    """Claim and prepare a campaign's directory; return the claim. Only rank 0 calls.

    stopping : handler of stop requests, which ends waiting for other processes

    Raises
    ------
    InputError
        if the directory belongs to another campaign, or another run computes there
    """
    design, directory, policy, fresh, extend = prepared
    asking = asking_of(stopping, take_over=policy.take_over)
    if fresh and directory.path.exists():
        with directory.claims.make(CAMPAIGN, asking) as old:  # until no shard uses it
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
    """Print how many cases ended at the amplitude limit, which no extension changes."""
    cases = {
        int(case)
        for _, told in told_by(journals, design.digests)
        for case, outcome in zip(told.case, told.outcome, strict=True)
        if case >= 0 and outcome in LIMITED
    }
    if cases:
        noun = "case" if len(cases) == 1 else "cases"
        say(f"{len(cases)} {noun} ended at the amplitude limit: more time cannot help")
