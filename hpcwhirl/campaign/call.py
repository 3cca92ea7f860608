"""The function `hpcwhirl.campaign`: check its arguments, run it, open its results."""

from __future__ import annotations

import sys
import traceback
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import hpcwhirl
from hpcwhirl.campaign.begin import Policy, Prepared, as_begun
from hpcwhirl.campaign.finalize import Ending
from hpcwhirl.campaign.fingerprint import difference
from hpcwhirl.campaign.measure import Measure, measure_of
from hpcwhirl.campaign.options import Options
from hpcwhirl.campaign.plan.design import Design
from hpcwhirl.campaign.run import Session
from hpcwhirl.campaign.stop import Stopping
from hpcwhirl.errors import (
    INTERNAL,
    InputError,
    StoppedError,
    StoreError,
    WhirlError,
    cases_told,
    say,
    shown,
    unknown,
)
from hpcwhirl.launch import ALONE, Communicator, communicator
from hpcwhirl.reduction.numbers import one_thread
from hpcwhirl.scene.campaign_tables import Campaign
from hpcwhirl.scene.documents import load_document, units_of_document
from hpcwhirl.scene.units import written_in
from hpcwhirl.store.directory.campaign_directory import Directory
from hpcwhirl.store.results.variables import WHY_NOT

if TYPE_CHECKING:
    import xarray

FLAGS = ("fresh", "take_over")
OPTIONS = tuple(Options.__annotations__)


@dataclass(frozen=True)
class Call:
    """The arguments of a call `hpcwhirl.campaign(...)`, kept as given, not yet checked.

    The attributes are those arguments; `function` is the argument `measure`.
    """

    design: Any
    out: Any
    function: Any
    variables: Any
    version: Any
    options: Mapping[str, Any]

    def run(self, comm: Communicator | None) -> xarray.Dataset:
        """Run the campaign on all ranks and return its results as a dataset.

        comm : communicator of all ranks; None: all ranks that were started
        """
        comm = communicator() if comm is None else comm
        with written_in(_units_of(self.design)):
            return self.opened(self.place(comm), tells=comm.rank == 0)

    def opened(self, place: Path, *, tells: bool = True) -> xarray.Dataset:
        """Return the results in a directory.

        tells : whether to print for how many cases `measure` gave no numbers
        """
        data = hpcwhirl.open_results(place)  # also registers `data.hpcwhirl`
        if tells and self.function is not None:
            _tell_unmeasured(data)
        return data

    def place(self, comm: Communicator) -> Path:
        """Run the campaign on all ranks and return its directory.

        An exception on one of several ranks ends all ranks.
        """
        with Stopping() as stopping, one_thread():
            alone = comm.size == 1  # no other rank waits: raise in the caller's process
            own, tell = (ALONE, None) if alone else (comm, _tell_broken)
            with Session(own, stopping, tell) as session:
                measure, failure = self._agreed(own)
                found: Path | WhirlError
                if failure is not None:
                    found = failure
                else:
                    found = session.run(self._prepared, _concluded, measure)
        if session.code is not None:  # MPI is ending all ranks
            sys.exit(session.code)
        if not isinstance(found, Path):
            raise found
        return found

    def _agreed(self, comm: Communicator) -> tuple[Measure | None, WhirlError | None]:
        """Check that all ranks were given the same function `measure`; return it.

        Ranks with different functions would mix their numbers in one campaign, so all
        ranks call this before a directory is made.

        Returns
        -------
        the user's function on this rank, None without `measure`; and the first error
        found on any rank, None if all ranks agree
        """
        measure, wrong = None, None
        try:
            measure = measure_of(self.function, self.variables, self.version)
        except InputError as failed:
            wrong = failed
        told = (measure.fingerprint, measure.plan()) if measure else None
        every = comm.allgather((told, wrong))
        failure = next((failed for _, failed in every if failed), None)
        other = [rank for rank, (its, _) in enumerate(every) if its != every[0][0]]
        if failure is None and other:
            failure = InputError(_unlike(other[0], every[0][0], every[other[0]][0]))
        return measure, failure

    def _prepared(self) -> Prepared:
        """Return the campaign that the call's arguments describe; only on rank 0."""
        design = Design.of(self.design)
        rules = design.rules.with_options(self._options())
        file = self.design if isinstance(self.design, str | Path) else None
        out = rules.place(Path(file) if file else None)
        given = self.out if self.out is not None else out
        directory = Directory(Path(given).absolute())  # a measure may change directory
        policy = Policy.of(rules, take_over=bool(self.options.get("take_over")))
        directory.check_usable()
        fresh = bool(self.options.get("fresh"))
        design = design if fresh else as_begun(design, directory.plan)
        return Prepared(design, directory, policy, fresh)

    def _options(self) -> Campaign:
        """Return the keyword options of the call as a checked table [campaign]."""
        for name, value in self.options.items():
            if name not in OPTIONS:
                raise unknown("option", name, OPTIONS)
            if name in FLAGS and not isinstance(value, bool):
                raise InputError(f"{name} must be True or False, got {shown(value)}")
        given = {n: value for n, value in self.options.items() if n not in FLAGS}
        return Campaign.read(given, "options", str)


def _units_of(design: Any) -> tuple[str, ...]:
    """Return the units in which the design of a campaign gives its inputs.

    () where it is no file or mapping, or a file that `Design.of` will refuse.
    """
    try:
        if isinstance(design, str | Path):
            design = load_document(Path(design))
    except WhirlError:
        return ()
    return units_of_document(design) if isinstance(design, Mapping) else ()


def _tell_unmeasured(data: xarray.Dataset) -> None:
    """Print for how many cases the user's function `measure` returned no numbers."""
    reasons = data[WHY_NOT].to_numpy()
    missing = reasons != ""
    if missing.any():
        count = f"{missing.sum()} of {len(reasons)} cases"
        say(
            f"measure gave no numbers in {count}, the first because of "
            f'{reasons[missing][0]}; correct measure, then retry="failed" adds them'
        )


def _unlike(rank: int, first: Any, other: Any) -> str:
    """Return the message for a function `measure` that is not the same on all ranks.

    Parameters
    ----------
    rank : a rank whose function differs from that of rank 0
    first, other : (fingerprint, variables) of the function on rank 0 and on `rank`;
        None: no `measure` was given there
    """
    what = "one of these ranks has no measure"
    if first and other:
        what = "their variables differ"
        if changed := difference(first[0], other[0]):
            what = f"{changed} differs"
    return (
        f"measure must be the same on all ranks, got another one on rank {rank} than "
        f"on rank 0: {what}"
    )


def _tell_broken(_session: Session, failed: BaseException) -> int:
    """Print the traceback of an exception on this rank; return all ranks' exit code.

    failed : the exception
    """
    traceback.print_exception(failed)
    return INTERNAL


def _concluded(ending: Ending, prepared: Prepared) -> Path | WhirlError:
    """Return the directory of a complete campaign, else the error for the user.

    Parameters
    ----------
    ending : how the run ended
    prepared : the campaign that was run
    """
    safe = f"finished cases are safe in {prepared.directory}"
    if ending.lasting:
        return InputError(f"{ending.reason}; {safe}")
    if ending.missing:
        count = f"{ending.missing} of {cases_told(ending.cases)}"
        return StoreError(
            f"{count} have ended, but have no row in {ending.results}: the same call "
            "computes these again"
        )
    if ending.complete:
        return prepared.directory.path
    why = f": {ending.reason}" if ending.reason else ""
    return StoppedError(
        f"stopped early{why}; {safe}; the same call continues the campaign"
    )
