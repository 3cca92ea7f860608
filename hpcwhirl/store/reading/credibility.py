"""Share of a campaign's cases whose twins all have the word of their case."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from hpcwhirl.errors import InputError
from hpcwhirl.store.reading.results_file import Results
from hpcwhirl.store.reading.shares import COUNT, interval

if TYPE_CHECKING:
    import xarray

TWINS_OF = "twins_of"  # root attribute
SHARED = "word_share"
WHICH = {
    "all": "cases", "boundary": "cases at a boundary", "speckle": "cases in speckle",
    "even": "even cases",
}  # fmt: skip


@dataclass(frozen=True)
class Credibility:
    """Number of cases whose twins all have the same word as the case.

    For a random sample of the even cases of a map, it shows how reliable the map is
    away from its boundaries.

    Attributes
    ----------
    of : which cases have twins, as in [twins]: "all", "boundary", "speckle", "even"
    cases : number of cases that have twins with a result
    kept : number of these cases whose twins all have the word of their case
    twins : largest number of twins of a case
    """

    of: str
    cases: int
    kept: int
    twins: int

    @property
    def share(self) -> tuple[float, float, float]:
        """The share `kept` / `cases`, and the ends of its 95 % interval (Wilson)."""
        return interval(self.kept, self.cases)

    def __str__(self) -> str:
        """Return the numbers as one line of text."""
        if not self.cases:
            return f"no {WHICH[self.of]} with twins"
        share, low, high = self.share
        return (
            f"of {self.cases} {WHICH[self.of]} {self.kept} keep their word in "
            f"{self.twins} twins: {share:.1%} ({low:.1%} to {high:.1%})"
        )


def credibility(data: xarray.Dataset) -> Credibility:
    """Return the number of cases whose twins all have the word of their case.

    Parameters
    ----------
    data : results from `open_results`

    Raises
    ------
    InputError
        where no case of the campaign has twins
    """
    found = find_credibility(data)
    if found is None:
        msg = "no case has twins: the campaign has no table [twins]"
        raise InputError(msg)
    return found


def find_credibility(data: xarray.Dataset | Results) -> Credibility | None:
    """Return the `Credibility` of results; None if no case has twins."""
    if COUNT not in data or TWINS_OF not in data.attrs:
        return None
    count, share = (np.asarray(data[name]) for name in (COUNT, SHARED))
    has = (count > 0) & np.isfinite(share)
    of, most = str(data.attrs[TWINS_OF]), int(count.max(initial=0))
    return Credibility(of, int(has.sum()), int((share[has] == 1.0).sum()), most)


def credibility_in(path: Path) -> Credibility | None:
    """Return `find_credibility` of a results file."""
    with Results(path) as results:
        return find_credibility(results)
