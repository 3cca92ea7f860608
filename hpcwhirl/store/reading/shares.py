"""How many twins of a case share its word, and how far words can be trusted."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.errors import InputError
from hpcwhirl.scene.quantities import ROW, STATUS
from hpcwhirl.scene.units import Quantity
from hpcwhirl.scene.words import ENUMS, NO_REGIME, REGIMES
from hpcwhirl.store.reading.select import counting

if TYPE_CHECKING:
    import xarray

    from hpcwhirl.store.reading.results_file import Results

CONFIDENCE = 0.95
TWIN = "twin"  # a dimension; the group of the twins' rows is `twins`
GROUP = f"{TWIN}s"
COUNT = "twin_count"
MAJORITY = "word_majority"
SURE = "word_share_sure"  # root attribute: least `word_share` of a sure case
WITHOUT = ("failed", "missing")  # words of computations without a result
ENDS = ("", "_low", "_high")
TOLD = {"": "", "_low": ", lower end (Wilson, 95 %)", "_high": ", upper end (Wilson)"}
# variables stored for each twin: those that determine its words, and its status
TWIN_ROW = {n: q for n, q in (ROW | STATUS).items() if not q.kind.startswith("S")}
Words = NDArray[np.str_]
TWINS_OF = "twins_of"  # root attribute
SHARED = "word_share"
WHICH = {
    "all": "cases", "boundary": "cases at a boundary", "speckle": "cases in speckle",
    "even": "even cases",
}  # fmt: skip


def _quantities(name: str, meaning: str) -> dict[str, Quantity]:
    return {name + end: Quantity("1", meaning + TOLD[end], kind="f8") for end in ENDS}


SHARE: dict[str, Quantity] = {
    COUNT: Quantity("1", "twins that gave a result", kind="i8"),
    **_quantities("word_share", "share of twins with the word of the case"),
}
SHARE[MAJORITY] = Quantity(
    "1", "most frequent word of case and twins; in a tie the case's word", kind="enum"
)
for _word in REGIMES:
    SHARE |= _quantities(f"share_{_word}", f"share of twins that are {_word}")


def words_of(
    status: NDArray[Any], outcome: NDArray[Any], regime: NDArray[Any]
) -> NDArray[Any]:
    """Return the word by which maps and tables show each case, (cases,).

    It is the regime or, for a case without one, outcome or status.
    `scene.words.word_of` is the same for a single case.

    status, outcome, regime : (cases,), words of each case, as text or as objects
    """
    named = np.where(regime == "none", "unstable", regime)
    named = np.where(np.isin(outcome, NO_REGIME), outcome, named)
    without = np.where(status == "missing", "missing", "failed")
    return np.asarray(np.where(status == "ok", named, without))


@lru_cache(maxsize=65536)
def interval(count: int, total: int) -> tuple[float, float, float]:
    """Return a share, and the lower and upper end of its 95 % interval (Wilson).

    All are NaN if `total` is 0.

    Parameters
    ----------
    count, total : number of successes, and of independent trials
    """
    from scipy.stats import binomtest

    if total == 0:
        return np.nan, np.nan, np.nan
    found = binomtest(count, total).proportion_ci(CONFIDENCE, method="wilson")
    return count / total, float(found.low), float(found.high)


def shares(own: Words, twins: Words) -> dict[str, NDArray[Any]]:
    """Return, for each case, which share of its twins has which word.

    Parameters
    ----------
    own : (cases,), the word of each case, see `words_of`
    twins : (cases, twins), the words of each case's twins

    Returns
    -------
    {variable: (cases,)} of the variables of `SHARE`
    """
    given = ~np.isin(twins, WITHOUT)
    total = given.sum(axis=1)
    counted = {"word_share": ((twins == own[:, None]) & given).sum(axis=1)}
    counted |= {f"share_{word}": (twins == word).sum(axis=1) for word in REGIMES}
    out: dict[str, NDArray[Any]] = {COUNT: total}
    for name, counts in counted.items():
        of = total * ~np.isin(own, WITHOUT) if name == "word_share" else total
        pairs = zip(counts.tolist(), of.tolist(), strict=True)
        found = np.array([interval(*pair) for pair in pairs]).reshape(-1, 3)
        out |= {name + end: found[:, i] for i, end in enumerate(ENDS)}
    return out | {MAJORITY: _majority(own, twins, total)}


def _majority(own: Words, twins: Words, total: NDArray[Any]) -> NDArray[np.int8]:
    """Return the code of the most frequent word of each case and its twins, (cases,).

    In a tie the case's own word wins if it is among the most frequent ones, else the
    first of these in the order of `ENUMS`.

    Parameters
    ----------
    own : (cases,), the word of each case
    twins : (cases, twins), the words of its twins
    total : (cases,), number of its twins with a result
    """
    known = ENUMS[MAJORITY]
    votes = np.column_stack([(twins == w).sum(axis=1) + (own == w) for w in known])
    votes[:, 0] = 0
    first = votes.argmax(axis=1)
    mine = np.array([known.index(w) if w in known else 0 for w in own.tolist()])
    rows = np.arange(len(own))
    found = np.where(votes[rows, mine] == votes[rows, first], mine, first)
    return np.where((total > 0) & (mine > 0), found, 0).astype(np.int8)


@dataclass(frozen=True)
class Credibility:
    """How many cases keep their word in all their twins.

    For a random sample of the cases away from boundaries (even cases), this share shows
    how reliable the map is there.

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
        """Share of cases that keep their word, and the ends of its 95 % interval."""
        return interval(self.kept, self.cases)

    def __str__(self) -> str:
        """Return the numbers of cases and the share as one line of text."""
        if not self.cases:
            return f"no {WHICH[self.of]} with twins"
        share, low, high = self.share
        return (
            f"of {self.cases} {WHICH[self.of]} {self.kept} keep their word in "
            f"{self.twins} twins: {share:.1%} ({low:.1%} to {high:.1%})"
        )


def credibility(data: xarray.Dataset) -> Credibility:
    """Return how many cases keep their word in all their twins.

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
        raise InputError("no case has twins: the campaign has no table [twins]")
    return found


def find_credibility(data: xarray.Dataset | Results) -> Credibility | None:
    """Return how many cases keep their word in all their twins; None without twins."""
    if COUNT not in data or TWINS_OF not in data.attrs:
        return None
    count, share = (np.asarray(data[name]) for name in (COUNT, SHARED))
    has = counting(data) & (count > 0) & np.isfinite(share)
    of, most = str(data.attrs[TWINS_OF]), int(count.max(initial=0))
    return Credibility(of, int(has.sum()), int((share[has] == 1.0).sum()), most)
