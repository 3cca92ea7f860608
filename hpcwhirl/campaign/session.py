"""The steps of a campaign call in their order, for the command and for Python.

Rank 0 prepares the design, claims the directory, and makes or continues it; all ranks
receive what to run, or the error; all run; rank 0 finishes while it still holds the
claim. If one rank fails unexpectedly, all are ended, since they would wait for it.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple, TypeVar

from hpcwhirl.campaign.begin import StartOptions, begin
from hpcwhirl.campaign.finalize import Ending
from hpcwhirl.campaign.measure import Measure
from hpcwhirl.campaign.plan.design import Design
from hpcwhirl.campaign.policy import Policy
from hpcwhirl.campaign.run import run_campaign
from hpcwhirl.campaign.stop import Stopping
from hpcwhirl.campaign.watchdog import Watchdog
from hpcwhirl.errors import WhirlError
from hpcwhirl.launch import Communicator, end_all, rest_until_root
from hpcwhirl.store.directory.owner import Claim

T = TypeVar("T")


def nothing(_design: Design) -> None:
    """Do nothing; the default of `begun`."""


class Prepared(NamedTuple):
    """The campaign that rank 0 has prepared for all ranks.

    Attributes
    ----------
    design, folder, policy : design, directory and options of the campaign
    start : options for the start
    """

    design: Design
    folder: Path
    policy: Policy
    start: StartOptions


@dataclass
class Session:
    """A call of a campaign on all ranks.

    Attributes
    ----------
    comm : communicator of all ranks
    stopping : handler of stop requests and signals
    watchdog : ends ranks that hang after a stop request; None: no watchdog
    folder : the campaign's directory; None before this rank knows it
    claim : claim on the directory, which rank 0 holds while the campaign runs
    """

    comm: Communicator
    stopping: Stopping
    watchdog: Watchdog | None = None
    folder: Path | None = None
    claim: Claim | None = None

    def on_root(self, action: Callable[[], T]) -> T | WhirlError:
        """Return on every rank the value of rank 0's action, or its WhirlError."""
        done: T | WhirlError | None = None
        if self.comm.rank == 0:
            try:
                done = action()
            except WhirlError as failed:
                done = failed
        rest_until_root(self.comm)
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
        conclude : called on rank 0 with the outcome and the prepared campaign
        measure : the user's function on this rank
        begun : called on rank 0 when the directory is claimed and prepared

        Returns
        -------
        on every rank, the value of `conclude`, or the WhirlError that rank 0 raised
        before or after the run
        """
        with ExitStack() as stack:

            def opened() -> Prepared:
                design, folder, policy, start = prepared = prepare()
                own = replace(design, measure=measure)
                self.claim = begin(own, folder, policy, self.stopping, start)
                stack.callback(self.claim.release)
                begun(design)
                return prepared

            prepared = self.on_root(opened)
            if isinstance(prepared, WhirlError):
                return prepared
            ending = self._run(prepared, measure)
            return self.on_root(lambda: conclude(ending, prepared))

    def _run(self, prepared: Prepared, measure: Measure | None) -> Ending:
        """Integrate the cases and gather the results, on all ranks."""
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
    """Return the value of `call`; if it raises on one rank, end all ranks.

    Parameters
    ----------
    comm, stopping : see `Session`
    call : called on every rank
    tell : prints the exception and returns the exit code for all ranks
    """
    with Watchdog(stopping, Policy().patience, comm) as watchdog:
        session = Session(comm, stopping, watchdog)
        try:
            return call(session)
        except BaseException as failed:  # noqa: BLE001 - told; the others would wait
            code = tell(session, failed)
            end_all(comm, code)
            return code
