"""Compute jobs on one rank, and append a record of each to the rank's journal.

A case that fails has a record, too, which says why.
"""

from __future__ import annotations

import socket
import time
import traceback
from array import array
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.campaign.begin import Policy
from hpcwhirl.campaign.compute import (
    Checkpoints,
    Computation,
    DiedError,
    LateError,
    computation,
    compute,
    message_of,
    resolved,
)
from hpcwhirl.campaign.measure import Measure
from hpcwhirl.campaign.plan.design import Design
from hpcwhirl.campaign.simulate import Result, notes_on
from hpcwhirl.campaign.stop import Stop, Stopping, breakable
from hpcwhirl.campaign.worker_process import Child
from hpcwhirl.case.plan import kernel_of
from hpcwhirl.dynamics.march import March
from hpcwhirl.errors import MissingFileError, WhirlError, say
from hpcwhirl.planner.planner import Completion, completion_of
from hpcwhirl.reduction.numbers import one_thread
from hpcwhirl.store.directory.heartbeats import Running
from hpcwhirl.store.directory.journal import Journal
from hpcwhirl.store.directory.record import Record
from hpcwhirl.store.results.variables import WHY_NOT

MOST_TOLD = 5  # largest number of failures that a rank prints; all have records


@dataclass
class Evaluator:
    """Computes jobs on this rank and appends their records to this rank's journal.

    Attributes
    ----------
    design : the campaign's cases
    rank : number of this rank
    journal : this rank's journal
    running : this rank's note of the cases being computed, which remains if it dies
    checkpoints : saved states of unfinished cases
    child : separate process that computes isolated cases
    policy : options of the run
    stopping : handler of stop requests
    suspects : numbers of cases to isolate, since they were being computed when two
        processes died
    extended : end times to which undecided cases are continued, s
    told : number of problems of cases on this rank so far, printed or not
    lost : whether a result could not be written to disk
    beside : computing time outside the kernel, s, of each computation with a result
    """

    design: Design
    rank: int
    journal: Journal
    running: Running
    checkpoints: Checkpoints
    child: Child
    policy: Policy
    stopping: Stopping
    suspects: frozenset[int] = frozenset()
    extended: Sequence[float] = ()
    told: int = 0
    lost: bool = False
    beside: array[float] = field(default_factory=lambda: array("d"))

    def __post_init__(self) -> None:
        self.where = {"rank": self.rank, "host": socket.gethostname()}

    def warm(self, cases: Sequence[int]) -> None:
        """Compile the kernels that some cases need, before these cases are computed.

        cases : numbers of the cases
        """
        cases = one_of_each(self.design, cases)
        self.running.begin(self.design.digest(case) for case in cases)
        if self.policy.isolate:
            scenes = [self.design.scene(case) for case in cases]
            self.child.warm(scenes, self.stopping.check)
            return
        with breakable(self.stopping.check):
            for case in cases:
                try:
                    March(self.design.resolved(case)).warm()
                except Stop:
                    raise
                except Exception:  # noqa: BLE001 - the case will fail with a record
                    continue

    def __call__(self, task: int, between_slices: Callable[[], None]) -> Completion:
        """Compute one job, append its record to the journal; return how it ended.

        Parameters
        ----------
        task : number of the job, as `JobCode` encodes it
        between_slices : called between slices of the integration; may raise Stop
        """

        def between() -> None:
            self._writing(self.journal.keep_due)
            between_slices()

        start = time.perf_counter()
        computed = computation(
            self.design, self.design.code.decode(task), self.extended
        )
        self.running.begin([computed.digest])
        end, seconds = self._compute(computed, between)
        if end.is_ok:
            self.beside.append(time.perf_counter() - start - seconds)
        return end

    def costs_beside(self) -> tuple[float, float]:
        """Return the computing time per job outside the kernel, for the forecast, s.

        Returns
        -------
        median of that time over the jobs with a result; and by how much the first job
        exceeded it, since the first builds models and tables that later jobs share
        """
        if not self.beside:
            return 0.0, 0.0
        usual = float(np.median(self.beside))
        return usual, max(self.beside[0] - usual, 0.0)

    def keep_due(self) -> None:
        """Write waiting records to the journal, if due, while this rank idles."""
        with suppress(Stop):  # other code sees the request, too
            self._writing(self.journal.keep_due)

    def keep(self) -> bool:
        """Write all waiting records to the journal; return whether all are safe.

        False if any result of this rank could not be written to disk.
        """
        with suppress(Stop):
            self._writing(self.journal.keep)
        return not self.lost

    def _compute(
        self, computed: Computation, between: Callable[[], None]
    ) -> tuple[Completion, float]:
        """Compute a job and append its record to the journal.

        between : called between slices of the integration; may raise Stop

        Returns
        -------
        how the job ended; and the time spent in the kernel, s, 0 for a failure
        """
        start, checkpoints = time.perf_counter(), self.checkpoints
        case, digest = computed.job.case, computed.digest
        try:
            self.design.check_engine(case)
            checkpoints.hand_over(computed.before, digest)
            keep = computed.lasts or self.policy.keep_states
            if self.policy.isolate or case in self.suspects:
                checkpoints.kept.add(digest)  # the child may save it
                result = self.child.compute(
                    computed.scene, digest, self.policy.limit, between, keep=keep
                )
            else:
                own = resolved(self.design, computed)
                result = compute(
                    own, digest, checkpoints, self.policy.limit, between, keep=keep
                )
        except Stop:
            raise
        except Exception as failed:  # noqa: BLE001 - recorded as a failed case
            if not isinstance(failed, WhirlError):
                traceback.print_exc()
            cause = self._changed(case) or failed
            return self._fail(computed, cause, time.perf_counter() - start), 0.0
        seconds = float(result.performance["seconds"])
        return self._keep(computed, result, keep=keep), seconds

    def _changed(self, case: int) -> WhirlError | None:
        """Return an error if the engine file of a case has changed, else None.

        A result computed with another engine must not be stored in the campaign.

        case : number of the case
        """
        try:
            self.design.check_engine(case)
        except WhirlError as changed:
            return changed
        return None

    def _fail(
        self, computed: Computation, failed: Exception, seconds: float
    ) -> Completion:
        """Append a record that a job failed, and why; print the reason, too.

        Only the first `MOST_TOLD` reasons on this rank are printed.

        Parameters
        ----------
        computed : what the job required
        failed : the exception that ended it
        seconds : computing time until then, s
        """
        status = "failed"
        if isinstance(failed, LateError):
            status = "timeout"
        elif isinstance(failed, DiedError):
            status = "crashed"
        message = message_of(failed)
        record = self._record(computed) | {"status": status, "message": message}
        record["performance"] = self.where | {"seconds": seconds}
        self._append(record, {})
        if status != "timeout":  # a timeout may continue from its state
            self._drop(computed.digest)
        where = f"{self.where['host']}, rank {self.where['rank']}"
        name = told(computed, self.design.name(computed.job.case))
        self._tell(f"{name} {status} on {where}: {message}")
        return completion_of(record)

    def _record(self, computed: Computation) -> Record:
        head: Record = {"case": computed.job.case, "digest": computed.digest}
        return head | {"ended": time.time()} | computed.facts

    def _keep(self, computed: Computation, result: Result, *, keep: bool) -> Completion:
        """Append the record of a job's result, or of a failure if its engine changed.

        Parameters
        ----------
        computed : what the job required
        result : its result
        keep : whether the saved state stays if a longer run may decide the case
        """
        if changed := self._changed(computed.job.case):
            return self._fail(computed, changed, float(result.performance["seconds"]))
        notes = "; ".join(notes_on(computed.scene, result.row))
        record = self._record(computed) | {"status": "ok", "message": notes}
        record["row"] = result.row
        record["performance"] = self.where | result.performance
        if self.design.measure is not None and "twin" not in computed.facts:
            record |= self._measured(self.design.measure, computed, result)
        self._append(record, result.traces)
        end = completion_of(record)
        kept = keep and end.is_open
        self._drop(computed.before, *([] if kept else [computed.digest]))
        if not self.design.grows:  # otherwise further cases may begin with it
            self.checkpoints.drop_end(computed.follows)
        return end

    def _drop(self, *names: str) -> None:
        """Remove saved states of cases from which no run will continue any more.

        Records that wait are written first, so that no result is lost with its state.

        names : digests of the computations whose states are removed
        """
        if self.checkpoints.kept.intersection(names):
            self._writing(self.journal.keep)
        for name in names:
            self.checkpoints.drop(name)

    @one_thread(anew=True)
    def _measured(
        self, measure: Measure, computed: Computation, result: Result
    ) -> Record:
        """Return record entries with the numbers of the user's function `measure`.

        They say why there are none if the function raised.
        """
        found = measure(computed.scene, result)
        if WHY_NOT in found:
            case = self.design.name(computed.job.case)
            self._tell(f"{case}: measure gave no numbers: {found[WHY_NOT]}")
        return found

    def _tell(self, text: str) -> None:
        """Print a problem of a case, one of the first `MOST_TOLD` on this rank."""
        self.told += 1
        if self.told <= MOST_TOLD:
            say(text)
        if self.told == MOST_TOLD:
            say("further cases of this rank without a result are not printed")

    def _append(self, record: Record, traces: dict[str, NDArray[np.float64]]) -> None:
        self._writing(lambda: self.journal.append(record, traces))

    def _writing(self, write: Callable[[], None]) -> None:
        """Call `write` to write to the journal; if it fails, request a stop."""
        try:
            write()
        except MissingFileError as failed:
            say(f"{failed} ({self.where['host']}, rank {self.where['rank']})")
            self.stopping.ask(str(failed))
            self.lost = True
            raise Stop from None


def one_of_each(design: Design, cases: Sequence[int]) -> list[int]:
    """Return some of `cases`: one for each compiled kernel that these cases need.

    design : the campaign's cases
    """
    kinds: dict[tuple[Any, ...], int] = {}
    for case in cases:
        with suppress(WhirlError):  # such a case fails later, with a record
            kinds.setdefault(kernel_of(design.scene(case)), case)
    return list(kinds.values())


def told(computed: Computation, case: str) -> str:
    """Return how a job is named in messages: by its case, and its twin if it is one.

    Parameters
    ----------
    computed : what the job requires
    case : name of its case
    """
    twin = computed.facts.get("twin")
    return f"twin {twin} of {case}" if twin else case
