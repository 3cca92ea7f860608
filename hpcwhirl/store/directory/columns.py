"""Journals as columns of their records, and the case to which each record belongs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.scene.digests import CaseDigests
from hpcwhirl.scene.words import OPEN
from hpcwhirl.store.directory.journal import Journals
from hpcwhirl.store.directory.reader import Rows

SECONDS = "performance.seconds"
MARCHED = ("row.steps", "row.certificate", "row.duration")
Cases = NDArray[np.int64]


def marched(steps: Any, certificate: Any, duration: Any) -> NDArray[np.float64]:
    """Return the number of steps integrated, all or those before the certificate.

    Parameters
    ----------
    steps : (rows,), number of steps that the whole duration has
    certificate : (rows,), s, time from which the run is known in closed form; -1: never
    duration : (rows,), s
    """
    with np.errstate(all="ignore"):  # a record may hold any numbers
        share = np.where(certificate < 0.0, 1.0, np.divide(certificate, duration))
        return np.asarray(steps * share)


def marched_in(rows: Rows) -> NDArray[np.float64]:
    """Return `marched` of each record, (records,); NaN if unknown."""
    return marched(*(rows.numbers(name, np.nan) for name in MARCHED))


def open_in(rows: Rows) -> NDArray[np.bool_]:
    """Return whether the regime of each record may change in a longer run."""
    status, regime, stop = map(rows.words, ("status", "row.regime", "row.stop"))
    still = np.logical_or.reduce([regime == word for word in OPEN])
    return np.asarray(still & (status == "ok") & (stop == "end"))


def told_by(journals: Journals, digests: Sequence[str]) -> Iterator[tuple[Rows, Cases]]:
    """Yield (a batch of records, the case of each), the oldest first.

    The case is its number in the plan; -1 for twins, later stages, other plans' cases.

    Parameters
    ----------
    journals : journals of a campaign
    digests : digests of the planned cases
    """
    known = CaseIndex(digests)
    for rows in journals.rows():
        planned = (rows.numbers("twin", 0) == 0) & (rows.numbers("longest", 0.0) == 0)
        yield rows, np.where(planned, known.cases_of(rows), -1)


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
        """Return the case with a digest, -1 for none.

        hint : number of the case to try first
        """
        place = hint if isinstance(hint, int) else -1
        if isinstance(self.digests, CaseDigests):
            return self.digests.find(name, place)
        if 0 <= place < len(self.digests) and self.digests[place] == name:
            return place
        return self._case_of.get(name, -1)

    def find_all(self, words: NDArray[Any], hints: Cases) -> Cases:
        """Return the cases of m digests of 32 bytes, (m,), -1 for none.

        hints : (m,), number of the case to try first for each digest
        """
        if isinstance(self.digests, CaseDigests):
            return self.digests.find_all(words, hints)
        names = [bytes(word).hex() for word in words]
        both = zip(names, hints.tolist(), strict=True)
        return np.array([self.find(*pair) for pair in both], np.int64)

    def cases_of(self, rows: Rows) -> Cases:
        """Return the case to which each record belongs, (m,), -1 for none.

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
