"""Journals as columns: what their records tell of many cases, oldest first."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.scene.words import OPEN
from hpcwhirl.store.directory.case_index import CaseIndex
from hpcwhirl.store.directory.reader import Rows, rows_of

Words = NDArray[np.object_]


class Told(NamedTuple):
    """What some records of a journal tell, (records,) each, in their order.

    Attributes
    ----------
    case : in the plan, of a case as planned; -1: of another one, a twin, a later stage
    status, outcome, regime : words
    open : whether a longer run may tell what it does not
    ended : s since 1970; NaN where it is not told
    seconds : s, computing; NaN alike
    """

    case: NDArray[np.int64]
    status: Words
    outcome: Words
    regime: Words
    open: NDArray[np.bool_]
    ended: NDArray[np.float64]
    seconds: NDArray[np.float64]


def planned_cases(rows: Rows, known: CaseIndex) -> NDArray[np.int64]:
    """Return the case of each record, (records,); -1: of a twin, or a later stage.

    Records of cases that the plan does not have give -1, too.
    """
    planned = (rows.numbers("twin", 0) == 0) & (rows.numbers("longest", 0.0) == 0)
    return np.where(planned, known.cases_of(rows), -1)


def told_by(folder: Path, digests: Sequence[str]) -> Iterator[tuple[str, Told]]:
    """Yield (journal, what some of its records tell), the oldest first.

    Parameters
    ----------
    folder : of a campaign
    digests : of its plan's cases
    """
    known = CaseIndex(digests)
    for rows in rows_of(folder):
        status, outcome, regime, stop = map(
            rows.words, ("status", "row.outcome", "row.regime", "row.stop")
        )
        still = np.logical_or.reduce([regime == word for word in OPEN])
        yield (
            rows.journal.stem,
            Told(
                planned_cases(rows, known),
                status,
                outcome,
                regime,
                still & (status == "ok") & (stop == "end"),
                rows.numbers("ended", np.nan),
                rows.numbers("performance.seconds", np.nan),
            ),
        )
