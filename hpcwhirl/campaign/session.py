"""The steps of one invocation of a campaign, by the command or from Python, in order.

Rank 0 prepares the design, claims the directory, and makes or continues it; all ranks
receive what to run, or the error; all run; rank 0 finishes while it still holds the
claim. If a rank fails unexpectedly, all are ended, since the others would wait for it.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from typing import Self, TypeVar

from hpcwhirl.campaign.begin import Prepared, begin
from hpcwhirl.campaign.finalize import Ending
from hpcwhirl.campaign.measure import Measure
from hpcwhirl.campaign.plan.design import Design
from hpcwhirl.campaign.policy import Policy
from hpcwhirl.campaign.run import run_campaign
from hpcwhirl.campaign.stop import Stopping, Watchdog
from hpcwhirl.errors import WhirlError
from hpcwhirl.launch import Communicator, end_all, from_root
from hpcwhirl.store.directory.campaign_directory import Directory
from hpcwhirl.store.directory.owner import Claim

T = TypeVar("T")


@dataclass
class Session:
    """One invocation of a campaign; as a context, it ends all ranks if one fails.

    Attributes
    ----------
    comm : communicator of all ranks
    stopping : handler of stop requests and signals
    tell : prints an exception of this rank, which ends all ranks; returns their exit
        code. None: exceptions pass, since no other rank waits
    code : exit code after an exception; None: there was none
    watchdog : ends ranks that hang after a stop request; None: no watchdog
    directory : the campaign's directory; None before this rank knows it
    claim : claim on the directory, which rank 0 holds while the campaign runs
    """

    comm: Communicator
    stopping: Stopping
    tell: Callable[[Session, BaseException], int] | None = None
    code: int | None = None
    watchdog: Watchdog | None = None
    directory: Directory | None = None
    claim: Claim | None = None
    _after: ExitStack = field(default_factory=ExitStack)

    def on_root(self, action: Callable[[], T]) -> T | WhirlError:
        """Return on every rank the value of rank 0's action, or its WhirlError."""
        done: T | WhirlError | None = None
        if self.comm.rank == 0:
            try:
                done = action()
            except WhirlError as failed:
                done = failed
        told: T | WhirlError = from_root(self.comm, done)
        return told

    def run(
        self,
        prepare: Callable[[], Prepared],
        conclude: Callable[[Ending, Prepared], T],
        measure: Measure | None = None,
        begun: Callable[[Design], None] = lambda _: None,
    ) -> T | WhirlError:
        """Run a campaign; every rank must call this.

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
                prepared = prepare()
                own = replace(prepared.design, measure=measure)
                self.claim = begin(prepared._replace(design=own), self.stopping)
                stack.enter_context(self.claim)
                begun(prepared.design)
                return prepared

            prepared = self.on_root(opened)
            if isinstance(prepared, WhirlError):
                return prepared
            design, self.directory, policy, *_ = prepared
            if self.watchdog is not None:
                self.watchdog.seconds = policy.patience
                if self.claim is not None:
                    self.watchdog.last = self.claim.release
            ending = run_campaign(
                replace(design, measure=measure),
                self.directory, self.comm, policy, self.stopping, self.claim,
            )  # fmt: skip
            return self.on_root(lambda: conclude(ending, prepared))

    def __enter__(self) -> Self:
        """Start the watchdog, if `tell` is set: other ranks may wait for this one."""
        if self.tell is not None:
            dog = Watchdog(self.stopping, Policy().patience, self.comm)
            self.watchdog = self._after.enter_context(dog)
        return self

    def __exit__(self, _: object, failed: BaseException | None, trace: object) -> bool:
        """Print an exception of this rank by `tell`, and end all ranks."""
        with self._after:
            if failed is None or self.tell is None:
                return False
            self.code = self.tell(self, failed)
            end_all(self.comm, self.code)
            return True
