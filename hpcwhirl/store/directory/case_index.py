"""Index of a plan's cases by digest, to find the case of a record."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.scene.digests import CaseDigests
from hpcwhirl.store.directory.reader import Rows

Cases = NDArray[np.int64]


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

        If the journal's case numbers refer to this plan, these are returned, and no
        digests are compared.
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
