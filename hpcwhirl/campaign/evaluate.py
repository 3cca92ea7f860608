"""Compute units of cases and keep them; a case that fails is a row."""

from __future__ import annotations

import socket
import time
import traceback
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.campaign.agenda import Unit, cases_of
from hpcwhirl.campaign.checkpoints import Checkpoints
from hpcwhirl.campaign.compute import (
    DiedError,
    LateError,
    compute,
    message_of,
)
from hpcwhirl.campaign.isolate import Child
from hpcwhirl.campaign.log import say
from hpcwhirl.campaign.plan.design import Design
from hpcwhirl.campaign.plan.refined import RefinedDesign
from hpcwhirl.campaign.plan.stages import Ended, Job, Stages, Todo, ended_of, resolved
from hpcwhirl.campaign.policy import Policy
from hpcwhirl.campaign.simulate import Result
from hpcwhirl.campaign.stop import Stop, Stopping, breakable
from hpcwhirl.case.plan import FOLDING, folds_of
from hpcwhirl.dynamics.march import March
from hpcwhirl.errors import MissingFileError, WhirlError
from hpcwhirl.store.directory.journal import Journal, Record
from hpcwhirl.store.directory.running import Running
from hpcwhirl.store.results.measured import WHY_NOT

MOST_TOLD = 5  # failures a rank tells one by one; the others are rows all the same


@dataclass
class Desk:
    """What one rank of one run works with.

    Attributes
    ----------
    journal, running : its own files of the campaign's directory
    checkpoints : states of cases on their way
    child : of its own interpreter, for isolated cases
    suspects : cases to be isolated: in flight when two processes died
    """

    rank: int
    journal: Journal
    running: Running
    checkpoints: Checkpoints
    child: Child
    policy: Policy = field(default_factory=Policy)
    stopping: Stopping = field(default_factory=Stopping)
    suspects: frozenset[int] = frozenset()


class Evaluator:
    """Computes units of cases on this rank and keeps them in this rank's journal."""

    def __init__(
        self,
        design: Design,
        units: Sequence[Unit],
        desk: Desk,
        stages: Stages | None = None,
        begun: Mapping[int, Todo] | None = None,
    ) -> None:
        self.design, self.units, self.desk = design, units, desk
        self.stages, self.begun = stages or Stages(design), begun or {}
        self.limit = desk.policy.limit
        self.where = {"rank": desk.rank, "host": socket.gethostname()}
        self.told = 0
        self.lost = False  # whether what was computed could not be kept

    def warm(self) -> None:
        """Take a step of a case of each kernel that the units need."""
        cases = self._kinds()
        self.desk.running.begin(self.design.digest(case) for case in cases)
        if self.desk.policy.isolate:
            scenes = [self.design.scene(case) for case in cases]
            self.desk.child.warm(scenes, self.desk.stopping.check)
            return
        with breakable(self.desk.stopping.check):
            for case in cases:
                try:
                    March(self.design.resolved(case)).warm()
                except Stop:
                    raise
                except Exception:  # noqa: BLE001 - it will fail as a row
                    continue

    def _kinds(self) -> list[int]:
        """Return a case of each kernel that the units need, the first of its kind."""
        left = cases_of(self.units)
        left = left[~np.isin(left, list(self.desk.suspects))]
        kinds: dict[tuple[str, int], int] = {}
        for case in self.design.columns.first_of(left, FOLDING):
            scene = self.design.scene(case)
            folds = 1
            with suppress(WhirlError):  # a file that cannot be read fails as a row
                folds = folds_of(scene)
            kinds.setdefault((scene.solver.scheme, folds), case)
        return list(kinds.values())

    def __call__(self, unit: int, between_slices: Callable[[], None]) -> list[Ended]:
        """Compute a unit and return how each of its cases ended."""

        def between() -> None:
            self._writing(self.desk.journal.keep_due)
            between_slices()

        if isinstance(self.design, RefinedDesign):
            return [self._grown(self.design, unit, between)]
        return [self._case(case, between) for case in self.units[unit]]

    def keep_due(self) -> None:
        """Keep what has been computed, while this rank waits."""
        with suppress(Stop):  # which everyone sees
            self._writing(self.desk.journal.keep_due)

    def keep(self) -> bool:
        """Keep what has been computed; return whether all of it could be."""
        with suppress(Stop):
            self._writing(self.desk.journal.keep)
        return not self.lost

    def _grown(
        self, design: RefinedDesign, number: int, between: Callable[[], None]
    ) -> Ended:
        """Compute a case of a refined campaign, or a twin, by its number."""
        case, twin = design.split(number)
        if not twin:
            return self._case(case, between)
        job = design.twin(number)
        self.desk.running.begin([job.digest])
        return self._compute(job, between)

    def _case(self, case: int, between: Callable[[], None]) -> Ended:
        """Compute what is left of a case: itself, then its twins.

        Returns
        -------
        how the first of them ended, but with the worst status of all
        """
        ends: list[Ended] = []
        for twin, stage in self.begun.get(case) or self.stages.whole():
            ends.append(self._through(case, twin, stage, between))
            if twin == 0 and ends[-1].status != "ok":
                break
        bad = (end.status for end in ends if end.status != "ok")
        return ends[0]._replace(status=next(bad, "ok"))

    def _through(
        self, case: int, twin: int, stage: int, between: Callable[[], None]
    ) -> Ended:
        """Compute a case or a twin, and go on as long as it is open and may."""
        end = Ended("ok", "", is_open=True, of="", twin=twin, longest=0.0)
        for job in self.stages.jobs(case, stage, twin):
            self.desk.running.begin([job.digest])
            end = self._compute(job, between)
            if not end.is_open:
                break
        return end

    def _compute(self, job: Job, between: Callable[[], None]) -> Ended:
        start, checkpoints = time.perf_counter(), self.desk.checkpoints
        try:
            self.design.check_engine(job.case)
            checkpoints.hand_over(job.before, job.digest)
            keep = job.lasts or self.desk.policy.keep_states
            if self.desk.policy.isolate or job.case in self.desk.suspects:
                result = self._isolated(job, between, keep=keep)
            else:
                case = resolved(self.design, job)
                result = compute(
                    case, job.digest, checkpoints, self.limit, between, keep=keep
                )
        except Stop:
            raise
        except Exception as failed:  # noqa: BLE001 - a failed case is a row
            if not isinstance(failed, WhirlError):
                traceback.print_exc()
            cause = self._changed(job.case) or failed
            return self._fail(job, cause, time.perf_counter() - start)
        return self._keep(job, result, keep=keep)

    def _changed(self, case: int) -> WhirlError | None:
        """Return why a case's engine is not known to be the plan's, None if it is."""
        try:
            self.design.check_engine(case)
        except WhirlError as changed:
            return changed
        return None

    def _isolated(self, job: Job, between: Callable[[], None], *, keep: bool) -> Result:
        self.desk.checkpoints.kept.add(job.digest)  # the child may have kept a state
        return self.desk.child.compute(
            job.scene, job.digest, self.limit, between, keep=keep
        )

    def _fail(self, job: Job, failed: Exception, seconds: float) -> Ended:
        """Keep a row that tells why a case gave no result, and say the first few."""
        status = "failed"
        if isinstance(failed, LateError):
            status = "timeout"
        elif isinstance(failed, DiedError):
            status = "crashed"
        message = message_of(failed)
        record = self._record(job) | {"status": status, "message": message}
        record["performance"] = self.where | {"seconds": seconds}
        self._append(record, {})
        if status != "timeout":  # which may go on from its state
            self._drop(job.digest)
        where = f"{self.where['host']}, rank {self.where['rank']}"
        name = told(job, self.design.name(job.case))
        self._tell(f"{name} {status} on {where}: {message}")
        return ended_of(record)

    def _record(self, job: Job) -> Record:
        head: Record = {"case": job.case, "digest": job.digest, "ended": time.time()}
        return head | job.facts

    def _keep(self, job: Job, result: Result, *, keep: bool) -> Ended:
        """Keep a result, unless its engine is no longer known to be the plan's."""
        if changed := self._changed(job.case):
            return self._fail(job, changed, float(result.performance["seconds"]))
        record = self._record(job) | {"status": "ok", "message": "", "row": result.row}
        record["performance"] = self.where | result.performance
        record |= self._measured(job, result)
        self._append(record, result.traces)
        end = ended_of(record)
        self._drop(job.before, *([] if keep and end.is_open else [job.digest]))
        return end

    def _drop(self, *names: str) -> None:
        """Forget states of what has ended: not before that is kept."""
        if self.desk.checkpoints.kept.intersection(names):
            self._writing(self.desk.journal.keep)
        for name in names:
            self.desk.checkpoints.drop(name)

    def _measured(self, job: Job, result: Result) -> Record:
        """Return what the user's own function makes of a case, or why it does not."""
        if self.design.measure is None or "twin" in job.facts:
            return {}
        found = self.design.measure(job.scene, result)
        if WHY_NOT in found:
            self._tell(f"case {job.case}: measure gave no numbers: {found[WHY_NOT]}")
        return found

    def _tell(self, text: str) -> None:
        """Say the first of what went wrong on this rank."""
        self.told += 1
        if self.told <= MOST_TOLD:
            say(text)
        if self.told == MOST_TOLD:
            say("further cases of this rank without a result are counted only")

    def _append(self, record: Record, traces: dict[str, NDArray[np.float64]]) -> None:
        self._writing(lambda: self.desk.journal.append(record, traces))

    def _writing(self, write: Callable[[], None]) -> None:
        """Write; a disk that takes no more ends the campaign, cleanly."""
        try:
            write()
        except MissingFileError as failed:
            say(f"{failed} ({self.where['host']}, rank {self.where['rank']})")
            self.desk.stopping.ask(str(failed))
            self.lost = True
            raise Stop from None


def told(job: Job, case: str) -> str:
    """Return what a computation is called in messages, by the name of its case."""
    twin = job.facts.get("twin")
    return f"twin {twin} of {case}" if twin else case
