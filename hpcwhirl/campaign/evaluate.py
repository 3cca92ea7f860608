"""Compute units of cases and keep them; a case that fails is a row."""

from __future__ import annotations

import socket
import sys
import time
import traceback
from collections.abc import Callable

from hpcwhirl.campaign.case import Result, result_of, simulate
from hpcwhirl.campaign.design import Design
from hpcwhirl.campaign.ranks import Stop
from hpcwhirl.campaign.units import Unit
from hpcwhirl.dynamics.batch import Batch
from hpcwhirl.dynamics.timestep import with_step
from hpcwhirl.errors import WhirlError
from hpcwhirl.reduction.model import model_of
from hpcwhirl.scene import digest
from hpcwhirl.store.journal import Journal, Record


def say(text: str) -> None:
    """Write a plain line on stderr at once."""
    sys.stderr.write(f"hpcwhirl: {text}\n")
    sys.stderr.flush()


class Evaluator:
    """Computes units of cases on this rank and keeps them in this rank's journal."""

    def __init__(
        self, design: Design, units: list[Unit], journal: Journal, rank: int
    ) -> None:
        self.design, self.units, self.journal = design, units, journal
        self.where = {"rank": rank, "host": socket.gethostname()}

    def __call__(self, unit: int, between_slices: Callable[[], None]) -> list[str]:
        """Compute a unit and return the status of each of its cases."""
        cases = self.units[unit]
        done = self._together(cases, between_slices) if len(cases) > 1 else {}
        for case in cases:
            if case not in done:
                done[case] = self._alone(case, between_slices)
        return [done[case] for case in cases]

    def _together(self, cases: Unit, between: Callable[[], None]) -> dict[int, str]:
        """Compute a batch; what it could not finish is left to be computed alone."""
        done: dict[int, str] = {}
        scenes = [self.design.cases[case] for case in cases]
        model = model_of(scenes[0])
        runs = Batch(scenes, len(scenes), model).run(between)
        while len(done) < len(cases):
            try:
                place, history = next(runs)
                result = result_of(with_step(scenes[place], model), history)
            except Stop:
                raise
            except Exception as failed:  # noqa: BLE001 - each case shows its own error
                say(f"batch of cases {cases} given up, they go on alone: {failed}")
                break
            done[cases[place]] = self._keep(cases[place], result)
        return done

    def _alone(self, case: int, between: Callable[[], None]) -> str:
        start = time.perf_counter()
        try:
            result = simulate(self.design.cases[case], between)
        except Stop:
            raise
        except Exception as failed:  # noqa: BLE001 - a failed case is a row
            message = f"{type(failed).__name__}: {failed}".splitlines()[0]
            if not isinstance(failed, WhirlError):
                traceback.print_exc()
        else:
            return self._keep(case, result)
        spent = {"seconds": time.perf_counter() - start}
        record = self._record(case) | {"status": "failed", "message": message}
        self.journal.append(record | {"performance": self.where | spent}, {})
        say(f"case {case} failed: {message}")
        return "failed"

    def _record(self, case: int) -> Record:
        key = digest(self.design.cases[case])
        return {"case": case, "digest": key, "ended": time.time()}

    def _keep(self, case: int, result: Result) -> str:
        record = self._record(case) | {"status": "ok", "message": "", "row": result.row}
        record["performance"] = self.where | result.performance
        self.journal.append(record, result.traces)
        return "ok"
