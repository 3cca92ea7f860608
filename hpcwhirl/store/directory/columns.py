"""Journals as columns of their records, and the case to which each record belongs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.scene.digests import CaseDigests
from hpcwhirl.scene.words import OPEN
from hpcwhirl.store.directory.journal import Journals
from hpcwhirl.store.directory.reader import Rows

Words = NDArray[np.object_]
MARCHED = ("row.steps", "row.certificate", "row.duration")
Cases = NDArray[np.int64]


class Told(NamedTuple):
    """Some records of a journal as columns, (records,) each.

    Attributes
    ----------
    case : number in the plan; -1 for twins, later stages and cases of other plans
    status, outcome, regime : words
    open : whether the regime may change in a longer run
    ended : time at which the computation ended, s since 1970; NaN if unknown
    seconds : computing time, s; NaN if unknown
    marched : steps, see `marched`; NaN if unknown
    """

    case: NDArray[np.int64]
    status: Words
    outcome: Words
    regime: Words
    open: NDArray[np.bool_]
    ended: NDArray[np.float64]
    seconds: NDArray[np.float64]
    marched: NDArray[np.float64]


def marched(steps: Any, certificate: Any, duration: Any) -> NDArray[np.float64]:
    """Return the number of steps integrated in each run, (rows,): up to a certificate.

    Parameters
    ----------
    steps : (rows,), number of steps that the whole duration has
    certificate : (rows,), s, time from which the run is known in closed form; -1: never
    duration : (rows,), s
    """
    with np.errstate(all="ignore"):  # a record may hold any numbers
        share = np.where(certificate < 0.0, 1.0, np.divide(certificate, duration))
        return np.asarray(steps * share)


def told_by(journals: Journals, digests: Sequence[str]) -> Iterator[tuple[str, Told]]:
    """Yield (name of the journal, columns of a batch of its records), the oldest first.

    Parameters
    ----------
    journals : journals of a campaign
    digests : digests of the planned cases
    """
    known = CaseIndex(digests)
    for rows in journals.rows():
        status, outcome, regime, stop = map(
            rows.words, ("status", "row.outcome", "row.regime", "row.stop")
        )
        still = np.logical_or.reduce([regime == word for word in OPEN])
        planned = (rows.numbers("twin", 0) == 0) & (rows.numbers("longest", 0.0) == 0)
        yield (
            rows.journal.stem,
            Told(
                np.where(planned, known.cases_of(rows), -1),
                status,
                outcome,
                regime,
                still & (status == "ok") & (stop == "end"),
                rows.numbers("ended", np.nan),
                rows.numbers("performance.seconds", np.nan),
                marched(*(rows.numbers(name, np.nan) for name in MARCHED)),
            ),
        )


class CaseIndex:
    """Index of cases by digest.

    Parameters
    ----------
    digests : digest of each case of a plan, in the order of its cases
    """

    def __init__(self, digests: Sequence[str]) -> None:
        self.digests, self._case_of = digests, dict[str, int]()
        if not isinstance(digests, CaseDigests):
            self._case_of = {name: case for case, name in enumerate(digests)}

    def find(self, name: str, hint: Any = -1) -> int:
        """Return the number of the case whose digest is `name`; -1 for none.

        hint : number of the case to try first
        """
        place = hint if isinstance(hint, int) else -1
        if isinstance(self.digests, CaseDigests):
            return self.digests.find(name, place)
        if 0 <= place < len(self.digests) and self.digests[place] == name:
            return place
        return self._case_of.get(name, -1)

    def find_all(self, words: NDArray[Any], hints: Cases) -> Cases:
        """Return the case number of each of m digests of 32 bytes, (m,); -1 for none.

        hints : (m,), number of the case to try first for each digest
        """
        if isinstance(self.digests, CaseDigests):
            return self.digests.find_all(words, hints)
        names = [bytes(word).hex() for word in words]
        both = zip(names, hints.tolist(), strict=True)
        return np.array([self.find(*pair) for pair in both], np.int64)

    def cases_of(self, rows: Rows) -> Cases:
        """Return the number of the case to which each record belongs, (m,); -1: none.

        The record of a twin belongs to the case that is perturbed.

        If the journal's case numbers refer to this plan, these numbers are returned,
        and no digests are compared.
        """
        case, plan = rows.numbers("case", -1), rows.header.plan
        if isinstance(self.digests, CaseDigests) and plan == self.digests.identity:
            inside = (case >= 0) & (case < len(self.digests))
            return np.where(inside, case, -1)
        of, found = rows.has("of"), np.full(len(rows), -1)
        for name, has in (("digest", rows.has("digest") & ~of), ("of", of)):
            if has.any():
                found[has] = self.find_all(rows.slots[name][has], case[has])
        for name in ("digest", "of"):
            for record, value in rows.others.get(name, {}).items():
                found[record] = self.find(str(value), int(case[record]))
        return found
