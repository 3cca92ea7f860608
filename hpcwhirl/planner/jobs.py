"""Jobs, the computations of a campaign, and their completions."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from hpcwhirl.refinement.words import NUMBERS, features_of
from hpcwhirl.scene.words import REGIMES, is_open, word_of

OK = "ok"  # status of a job that gave a result


class Job(NamedTuple):
    """One computation of a campaign.

    Attributes
    ----------
    case : number of the case, which for a refined campaign includes its fidelity, see
        `refinement.rule.Family.number`
    twin : number of the twin, from 1; 0 for the case itself
    stage : 0: run to the planned duration; n: to the n-th end time of an extension
    """

    case: int
    twin: int = 0
    stage: int = 0


class Completion(NamedTuple):
    """How a job has ended: its status and the words and numbers of its result.

    Attributes
    ----------
    status : status of the job's record, such as "ok" or "failed"
    outcome, regime, whirl : words of the result; "none" if there is none
    features : numbers of its motion, see `refinement.words.features_of`
    is_open : whether the regime may change in a longer run
    """

    status: str
    outcome: str = "none"
    regime: str = "none"
    whirl: str = "none"
    is_open: bool = False
    features: tuple[float, ...] = ()

    @property
    def is_ok(self) -> bool:
        """Whether the job gave a result."""
        return self.status == OK

    @property
    def word(self) -> str:
        """The regime, by which neighbouring cases are compared; "" for none."""
        word = word_of(self.status, self.outcome, self.regime)
        return word if word in REGIMES else ""


def completion_of(record: Mapping[str, Any]) -> Completion:
    """Return the completion of a job: what its journal record says of how it ended."""
    row = record.get("row") or {}
    status = str(record["status"])
    outcome, regime, whirl = (
        str(row.get(name, "none")) for name in ("outcome", "regime", "whirl")
    )
    told = row.keys() >= {*NUMBERS}
    features = features_of(row) if status == OK and told else ()
    still = status == OK and is_open(row)
    return Completion(status, outcome, regime, whirl, still, features)


class JobCode(NamedTuple):
    """Numbering of jobs: ranks receive a number instead of a `Job`.

    Attributes
    ----------
    cases : upper bound of case numbers, exclusive
    twins : number of twins of a case
    """

    cases: int
    twins: int

    def encode(self, job: Job) -> int:
        """Return the number of a job."""
        return (job.stage * (1 + self.twins) + job.twin) * self.cases + job.case

    def decode(self, number: int) -> Job:
        """Return the job with a number, see `encode`."""
        rest, case = divmod(number, self.cases)
        stage, twin = divmod(rest, 1 + self.twins)
        return Job(case, twin, stage)
