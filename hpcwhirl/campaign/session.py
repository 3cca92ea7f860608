"""A call of a campaign, by the command or from Python: its steps in their order.

Rank 0 prepares the design, claims the directory and makes or continues it; all ranks
learn what they are to run, or why nothing is run; all run; rank 0 concludes while it
still holds the claim. If one rank breaks, all are ended: they would wait for it.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple, TypeVar

from hpcwhirl.campaign.begin import Manner, begin
from hpcwhirl.campaign.finalize import Ending
from hpcwhirl.campaign.measure import Measure
from hpcwhirl.campaign.plan.design import Design
from hpcwhirl.campaign.policy import Policy
from hpcwhirl.campaign.run import run_campaign
from hpcwhirl.campaign.stop import Stopping
from hpcwhirl.campaign.watchdog import Watchdog
from hpcwhirl.errors import WhirlError
from hpcwhirl.launch import Communicator
from hpcwhirl.store.directory.owner import Claim

T = TypeVar("T")


def nothing(_design: Design) -> None:
    """Do nothing with a campaign that was begun."""


class Prepared(NamedTuple):
    """What rank 0 has prepared for all ranks.

    Attributes
    ----------
    design, folder, policy : the campaign
    manner : how the call begins
    """

    design: Design
    folder: Path
    policy: Policy
    manner: Manner


@dataclass
class Session:
    """A call of a campaign on all ranks.

    Attributes
    ----------
    comm : of all ranks
    stopping : the wish to stop, which has taken over the signals
    watchdog : ends ranks that hang after a wish to stop; None: nothing does
    folder : the campaign's directory, once this rank knows it
    claim : on the directory, which rank 0 holds while the campaign runs
    """

    comm: Communicator
    stopping: Stopping
    watchdog: Watchdog | None = None
    folder: Path | None = None
    claim: Claim | None = None

    def on_root(self, action: Callable[[], T]) -> T | WhirlError:
        """Return on every rank what rank 0's action returns, or its WhirlError."""
        done: T | WhirlError | None = None
        if self.comm.rank == 0:
            try:
                done = action()
            except WhirlError as failed:
                done = failed
        told: T | WhirlError = self.comm.bcast(done, root=0)
        return told

    def run(
        self,
        prepare: Callable[[], Prepared],
        conclude: Callable[[Ending, Prepared], T],
        measure: Measure | None = None,
        begun: Callable[[Design], None] = nothing,
    ) -> T | WhirlError:
        """Run a campaign; every rank must call.

        Parameters
        ----------
        prepare : called on rank 0
        conclude : called on rank 0 with how the campaign ended, and what was prepared
        measure : this rank's function of the user
        begun : called on rank 0 once the directory is claimed and prepared

        Returns
        -------
        on every rank what `conclude` returns, or the WhirlError that rank 0 met before
        or after the run
        """
        with ExitStack() as stack:

            def opened() -> Prepared:
                design, folder, policy, manner = prepared = prepare()
                own = replace(design, measure=measure)
                self.claim = begin(own, folder, policy, self.stopping, manner)
                stack.callback(self.claim.release)
                begun(design)
                return prepared

            prepared = self.on_root(opened)
            if isinstance(prepared, WhirlError):
                return prepared
            ending = self._run(prepared, measure)
            return self.on_root(lambda: conclude(ending, prepared))

    def _run(self, prepared: Prepared, measure: Measure | None) -> Ending:
        """Integrate and gather on all ranks."""
        design, self.folder, policy, _ = prepared
        if self.watchdog is not None:
            self.watchdog.seconds = policy.patience
            if self.claim is not None:
                self.watchdog.last = self.claim.release
        own = replace(design, measure=measure)
        return run_campaign(
            own, self.folder, self.comm, policy, self.stopping, self.claim
        )


def together(
    comm: Communicator,
    stopping: Stopping,
    call: Callable[[Session], T],
    tell: Callable[[Session, BaseException], int],
) -> T | int:
    """Return what `call` returns; if it breaks on one rank, end all ranks.

    Parameters
    ----------
    comm, stopping : see `Session`
    call : every rank calls it
    tell : prints what broke; returns the exit code of all ranks, which a process alone
        returns
    """
    with Watchdog(stopping, Policy().patience, comm) as watchdog:
        session = Session(comm, stopping, watchdog)
        try:
            return call(session)
        except BaseException as failed:  # noqa: BLE001 - told; the others would wait
            code = tell(session, failed)
            sys.stderr.flush()
            comm.Abort(code)
            return code
