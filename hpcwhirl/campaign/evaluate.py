"""Compute units of cases and keep them; a case that fails is a row."""

from __future__ import annotations

import socket
import time
import traceback
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.campaign.agenda import Unit
from hpcwhirl.campaign.checkpoints import Checkpoints
from hpcwhirl.campaign.compute import (
    DiedError,
    LateError,
    compute,
    message_of,
)
from hpcwhirl.campaign.design import Design
from hpcwhirl.campaign.isolate import Child
from hpcwhirl.campaign.log import say
from hpcwhirl.campaign.policy import Policy
from hpcwhirl.campaign.simulate import Result
from hpcwhirl.campaign.stop import Stop, Stopping, breakable
from hpcwhirl.case.plan import folds_of
from hpcwhirl.dynamics.march import March
from hpcwhirl.errors import MissingFileError, WhirlError
from hpcwhirl.store.journal import Journal, Record
from hpcwhirl.store.running import Running

WORDS = ("outcome", "regime", "whirl")
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


class End(NamedTuple):
    """How a case ended: its status and, of a result, its words."""

    status: str
    outcome: str = "none"
    regime: str = "none"
    whirl: str = "none"


class Evaluator:
    """Computes units of cases on this rank and keeps them in this rank's journal."""

    def __init__(self, design: Design, units: list[Unit], desk: Desk) -> None:
        self.design, self.units, self.desk = design, units, desk
        self.limit = desk.policy.limit
        self.where = {"rank": desk.rank, "host": socket.gethostname()}
        self.told = 0
        self._digests: dict[int, str] = {}  # of the unit

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
                    March(self.design.resolved(case)).advance(1)
                except Stop:
                    raise
                except Exception:  # noqa: BLE001 - it will fail as a row
                    continue

    def _kinds(self) -> list[int]:
        """Return a case of each kernel that the units need, the first of its kind."""
        suspects = self.desk.suspects
        left = [case for unit in self.units for case in unit if case not in suspects]
        kinds = {}
        for case in reversed(left):
            scene = self.design.scene(case)
            folds = 1
            with suppress(WhirlError):  # a file that cannot be read fails as a row
                folds = folds_of(scene)
            kinds[scene.solver.scheme, folds] = case
        return list(kinds.values())

    def __call__(self, unit: int, between_slices: Callable[[], None]) -> list[End]:
        """Compute a unit and return how each of its cases ended."""
        cases = (unit,) if self.design.grows else self.units[unit]
        self._digests = {case: self.design.digest(case) for case in cases}
        self.desk.running.begin(self._digests.values())
        return [self._compute(case, between_slices) for case in cases]

    def _compute(self, case: int, between: Callable[[], None]) -> End:
        start = time.perf_counter()
        try:
            self.design.check_engine(case)
            if self.desk.policy.isolate or case in self.desk.suspects:
                result = self._isolated(case, between)
            else:
                name, checkpoints = self._digests[case], self.desk.checkpoints
                resolved = self.design.resolved(case)
                result = compute(resolved, name, checkpoints, self.limit, between)
        except Stop:
            raise
        except Exception as failed:  # noqa: BLE001 - a failed case is a row
            if not isinstance(failed, WhirlError):
                traceback.print_exc()
            cause = self._changed(case) or failed
            return self._fail(case, cause, time.perf_counter() - start)
        return self._keep(case, result)

    def _changed(self, case: int) -> WhirlError | None:
        """Return why a case's engine is not known to be the plan's, None if it is."""
        try:
            self.design.check_engine(case)
        except WhirlError as changed:
            return changed
        return None

    def _isolated(self, case: int, between: Callable[[], None]) -> Result:
        name = self._digests[case]
        self.desk.checkpoints.kept.add(name)  # the child may have kept a state
        scene = self.design.scene(case)
        return self.desk.child.compute(scene, name, self.limit, between)

    def _fail(self, case: int, failed: Exception, seconds: float) -> End:
        """Keep a row that tells why a case gave no result, and say the first few."""
        status = "failed"
        if isinstance(failed, LateError):
            status = "timeout"
        elif isinstance(failed, DiedError):
            status = "crashed"
        message = message_of(failed)
        record = self._record(case) | {"status": status, "message": message}
        record["performance"] = self.where | {"seconds": seconds}
        self._append(record, {})
        if status != "timeout":  # which may go on from its state
            self.desk.checkpoints.drop(self._digests[case])
        self.told += 1
        if self.told <= MOST_TOLD:
            where = f"{self.where['host']}, rank {self.where['rank']}"
            say(f"{self.design.name(case)} {status} on {where}: {message}")
        if self.told == MOST_TOLD:
            say("further cases of this rank without a result are counted only")
        return End(status)

    def _record(self, case: int) -> Record:
        return {"case": case, "digest": self._digests[case], "ended": time.time()}

    def _keep(self, case: int, result: Result) -> End:
        """Keep a result, unless its engine is no longer known to be the plan's."""
        if changed := self._changed(case):
            return self._fail(case, changed, float(result.performance["seconds"]))
        record = self._record(case) | {"status": "ok", "message": "", "row": result.row}
        record["performance"] = self.where | result.performance
        self._append(record, result.traces)
        self.desk.checkpoints.drop(self._digests[case])
        outcome, regime, whirl = (str(result.row[n]) for n in WORDS)
        return End("ok", outcome, regime, whirl)

    def _append(self, record: Record, traces: dict[str, NDArray[np.float64]]) -> None:
        """Journal a record; a disk that takes no more ends the campaign, cleanly."""
        try:
            self.desk.journal.append(record, traces)
        except MissingFileError as failed:
            say(f"{failed} ({self.where['host']}, rank {self.where['rank']})")
            self.desk.stopping.ask(str(failed))
            raise Stop from None
