"""Kinds of designs: which cases there are, and which have twins, by how cases end."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.planner.jobs import Completion
from hpcwhirl.planner.neighbours import Settings, at_boundary
from hpcwhirl.refinement.rule import Family

LATE = ("boundary", "even")  # of a grid: who has twins follows from the words of all


class Followers(NamedTuple):
    """What follows when a case has ended.

    Attributes
    ----------
    cases : numbers of those that are wanted beside
    twinned : numbers of those that have ended and have twins
    """

    cases: Sequence[int] = ()
    twinned: Sequence[int] = ()


class Kind(Protocol):
    """A kind of design.

    Attributes
    ----------
    first : how many cases are known before any has ended: 0 .. first - 1
    waiting : those of them that are not computed before `after` names them
    grows : whether cases may follow from others
    """

    first: int
    waiting: Sequence[int]
    grows: bool

    def after(self, case: int, end: Completion) -> Followers:
        """Return what follows from how a case ended, after its last stage.

        Parameters
        ----------
        case : that was wanted and has not been told before
        end : of its last stage that gave a result; how it failed, where none did
        """


class Grid:
    """Cases that are all known beforehand: grids, zips, lists, samples.

    Parameters
    ----------
    settings : the swept inputs' values of each case
    swept : names of the swept inputs
    digests : of each case
    twins : what a plan keeps of them, empty for none
    """

    waiting: Sequence[int] = ()
    grows = False

    def __init__(
        self,
        settings: Settings,
        swept: Sequence[str],
        digests: Sequence[str],
        twins: Mapping[str, Any],
    ) -> None:
        self.settings, self.swept, self.digests = settings, swept, digests
        self.twins, self.first = twins, len(digests)
        self._left = self.first
        late = twins.get("of") in LATE
        self._words = np.full(self.first if late else 0, "", dtype="U16")
        self._given = np.zeros(len(self._words), dtype=bool)  # cases with a result

    def after(self, case: int, end: Completion) -> Followers:
        """Return what follows from how a case ended."""
        if not len(self._words):
            return Followers(twinned=[case] if self.twins and end.is_ok else ())
        self._words[case], self._given[case] = end.word, end.is_ok
        self._left -= 1
        if self._left:
            return Followers()
        return Followers(
            twinned=np.flatnonzero(self.twinned(self._words) & self._given).tolist()
        )

    def twinned(self, words: Sequence[str] | NDArray[Any]) -> NDArray[np.bool_]:
        """Return which cases have twins by the words of all, (cases,).

        words : of each case, "" for none
        """
        if self.twins.get("of") not in LATE:
            return np.full(self.first, bool(self.twins))
        edge = at_boundary(self.settings, self.swept, words)
        if self.twins["of"] == "boundary":
            return edge
        even = np.flatnonzero(~edge & (np.asarray(words) != ""))
        named = [(case, self.digests[case]) for case in even.tolist()]
        found = np.zeros(self.first, dtype=bool)
        found[sampled(named, self.twins["sample"], self.twins["seed"])] = True
        return found


class Refined:
    """Coarse cases, and those that follow from words.

    Parameters
    ----------
    family : of all cases that there may be
    twins : what a plan keeps of them, empty for none
    digest : of a case by its number
    """

    waiting: Sequence[int] = ()
    grows = True

    def __init__(
        self, family: Family, twins: Mapping[str, Any], digest: Callable[[int], str]
    ) -> None:
        self.family, self.twins, self.digest = family, twins, digest
        self.first = len(family.coarse)
        self.growth = family.growth(str(twins.get("of", "")))
        self._twinned = 0  # of those of the growth, that have been returned

    def after(self, case: int, end: Completion) -> Followers:
        """Return what follows from how a case ended."""
        word = self.family.rule.word_of(end._asdict()) if end.is_ok else None
        fresh = self.growth.learn(self.family.address(case), word)
        twinned = self.growth.twinned[self._twinned :]
        self._twinned += len(twinned)
        cases, with_twins = (
            list(map(self.family.number, addresses)) for addresses in (fresh, twinned)
        )
        return Followers(cases, with_twins + self._even())

    def _even(self) -> list[int]:
        """Return the even cases that have twins, once all have ended."""
        if self.twins.get("of") != "even" or self.growth.left:
            return []
        cases = map(self.family.number, self.growth.even())
        named = [(case, self.digest(case)) for case in cases]
        return sampled(named, self.twins["sample"], self.twins["seed"])


def sampled(named: Iterable[tuple[int, str]], count: int, seed: int) -> list[int]:
    """Return a random sample, each case as likely as any other, ascending.

    Which it is follows from digests and seed alone: of more cases, those of a sample
    before stay in it unless new ones take their places.

    Parameters
    ----------
    named : (case, its digest)
    count : how many, or all there are
    seed : of the sample
    """
    drawn = (
        (hashlib.sha256(f"{seed} {digest}".encode()).digest(), case)
        for case, digest in named
    )
    return sorted(case for _, case in sorted(drawn)[:count])
