"""A campaign called from Python: prepared by rank 0, run by all, opened by all."""

from __future__ import annotations

import sys
import traceback
from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hpcwhirl.campaign.begin import Manner, begin
from hpcwhirl.campaign.ending import Ending
from hpcwhirl.campaign.log import say
from hpcwhirl.campaign.measure import Measure, measure_of
from hpcwhirl.campaign.patience import Patience
from hpcwhirl.campaign.plan.design import Design
from hpcwhirl.campaign.plan.sampling import as_begun
from hpcwhirl.campaign.policy import CHECKS, Policy, options_of, retries, with_rules
from hpcwhirl.campaign.resume import check_folder
from hpcwhirl.campaign.run import run_campaign
from hpcwhirl.campaign.stop import Stopping, parse_walltime, time_left
from hpcwhirl.errors import (
    InputError,
    StoppedError,
    WhirlError,
    shown,
    unknown,
)
from hpcwhirl.launch import ALONE, Communicator, communicator
from hpcwhirl.store.directory.owner import Claim
from hpcwhirl.store.reading.reader import open_results
from hpcwhirl.store.results.measured import WHY_NOT

if TYPE_CHECKING:
    import xarray

INTERNAL = 70
FOLDER = "campaign"
FLAGS = ("fresh", "take_over")
OPTIONS = (*CHECKS, *FLAGS, "retry", "walltime")


@dataclass(frozen=True)
class Call:
    """The arguments of `hpcwhirl.campaign`."""

    design: Any
    out: Any
    function: Any
    variables: Any
    options: Mapping[str, Any]

    def run(self, comm: Communicator | None) -> xarray.Dataset:
        """Run on all ranks; where one of several breaks, end them all."""
        comm = communicator() if comm is None else comm
        with Stopping() as stopping:
            if comm.size == 1:  # nobody waits for it: the caller's process lives on
                found = self._run(ALONE, stopping)
            else:
                found = self._together(comm, stopping)
        if not isinstance(found, Path):
            raise found
        data = open_results(found)
        if comm.rank == 0 and self.function is not None:
            _tell_unmeasured(data)
        return data

    def _together(self, comm: Communicator, stopping: Stopping) -> Path | WhirlError:
        """Run as one rank of several; where it breaks, end all: others would wait."""
        try:
            with Patience(stopping, Policy().patience, comm) as patience:
                return self._run(comm, stopping, patience)
        except Exception:
            traceback.print_exc()
            sys.stderr.flush()
            comm.Abort(INTERNAL)
            raise

    def _run(
        self, comm: Communicator, stopping: Stopping, patience: Patience | None = None
    ) -> Path | WhirlError:
        """Return the directory, or why there are no results: the same on every rank."""
        with ExitStack() as stack:
            found, own = self._found(comm, stopping)
            design, policy, folder, failure = comm.bcast(found, root=0)
            if own is not None:
                stack.callback(own.release)
            failures = comm.allgather(self._wrong_measure())
            failure = failure or next(filter(None, failures), None)
            if failure is not None:
                refused: WhirlError = failure
                return refused
            if patience is not None:
                patience.seconds = policy.patience
                patience.last = own.release if own else patience.last
            design = replace(design, measure=self._measure())
            ending = run_campaign(design, folder, comm, policy, stopping, own)
        ending = comm.bcast(ending, root=0)
        return _why_not(ending, folder) or folder

    def _measure(self) -> Measure | None:
        return measure_of(self.function, self.variables)

    def _wrong_measure(self) -> WhirlError | None:
        """Return what is wrong with this rank's measure."""
        try:
            self._measure()
        except InputError as wrong:
            return wrong
        return None

    def _found(
        self, comm: Communicator, stopping: Stopping
    ) -> tuple[tuple[Any, ...], Claim | None]:
        """Return (design, policy, folder, failure) and the claim; of rank 0 alone."""
        if comm.rank:
            return (), None
        try:
            design = Design.of(self.design)
            rules = design.rules | self._options()
            own = options_of(rules)
            folder = Path(self.out if self.out is not None else own.get("out", FOLDER))
            policy = with_rules(_policy(own), rules)
            check_folder(folder)
            manner = Manner(*(bool(self.options.get(name)) for name in FLAGS))
            design = design if manner.fresh else as_begun(design, folder)
            design = replace(design, measure=self._measure())
            claim = begin(design, folder, policy, stopping, manner)
        except WhirlError as failed:
            return (None, None, None, failed), None
        return (design, policy, folder, None), claim

    def _options(self) -> dict[str, Any]:
        """Return the options that may stand in [campaign], too."""
        for name, value in self.options.items():
            if name not in OPTIONS:
                raise unknown("option", name, OPTIONS)
            if name in FLAGS and not isinstance(value, bool):
                msg = f"{name} must be True or False, got {shown(value)}"
                raise InputError(msg)
        return {n: value for n, value in self.options.items() if n not in FLAGS}


def _tell_unmeasured(data: xarray.Dataset) -> None:
    """Say how many cases the user's function gave no numbers of."""
    reasons = data[WHY_NOT].to_numpy()
    missing = reasons != ""
    if missing.any():
        count = f"{missing.sum()} of {len(reasons)} cases"
        say(
            f"measure gave no numbers in {count}, first {reasons[missing][0]}; once it "
            'is mended, retry="failed" computes them'
        )


def _policy(own: Mapping[str, Any]) -> Policy:
    walltime = parse_walltime(own["walltime"]) if "walltime" in own else None
    return Policy(retry=retries(own.get("retry", [])), seconds=time_left(walltime))


def _why_not(ending: Ending, folder: Path) -> WhirlError | None:
    """Return why a campaign has no results yet, None where it has."""
    safe = f"finished cases are safe in {folder}"
    if ending.lasting:
        return InputError(f"{ending.reason}; {safe}")
    if ending.complete:
        return None
    why = f": {ending.reason}" if ending.reason else ""
    return StoppedError(f"stopped early{why}; {safe}; the same call continues")
