"""Kinds of campaigns: which cases and twins must be computed after a case has ended.

Each class is a kind of design (grid, branches, refined), which the planner asks.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.planner.planner import Cases, Completion, Ends, Followers
from hpcwhirl.refinement.rule import Family
from hpcwhirl.scene.history import history_of, parsed
from hpcwhirl.scene.input_names import is_number
from hpcwhirl.scene.table import Table, distinct, labels, listed

LATE = ("boundary", "even")  # values of twins.of that need the words of all cases
Settings = Sequence[Mapping[str, Any]]


class Grid:
    """Campaign whose cases are all known beforehand: grid, zip, list or random sample.

    Parameters
    ----------
    settings : {swept input: value} of each case
    swept : names of the swept inputs
    digests : digest of each case
    twins : table [twins] of the plan; empty: no twins
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
        """Return the twins that must be computed because `case` has ended.

        Parameters
        ----------
        case : number of the case
        end : how it has ended
        """
        if not len(self._words):
            return Followers(twinned=[case] if self.twins and end.is_ok else ())
        self._words[case], self._given[case] = end.word, end.is_ok
        self._left -= 1
        return Followers(twinned=self._late().tolist())

    def after_all(
        self, over: NDArray[np.bool_], ends: NDArray[np.int32], known: Ends
    ) -> Cases:
        """Return the cases whose twins must be computed since some cases have ended.

        Parameters
        ----------
        over : (cases,), whether each case has ended, and has no further stage
        ends : (cases,), how it has ended, as an index in the table of `known`
        known : how jobs have ended
        """
        given = over & known.column("is_ok", ends)
        if not len(self._words):
            return np.flatnonzero(given & bool(self.twins))
        self._words[over] = known.column("word", ends[over])
        self._given, self._left = given, self._left - int(over.sum())
        return self._late()

    def _late(self) -> Cases:
        """Return the cases with twins, which are known once all cases have ended."""
        if self._left:
            return np.zeros(0, dtype=np.int64)
        return np.flatnonzero(self.twinned(self._words) & self._given)

    def twinned(self, words: Sequence[str] | NDArray[Any]) -> NDArray[np.bool_]:
        """Return for each case whether it has twins, (cases,).

        words : regime of each case; "": it has none
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


class Chains:
    """Campaign of branches: each case begins with the last state of the case before it.

    Parameters
    ----------
    before : number of the case before each case, -1 for the first of a branch
    """

    grows = True

    def __init__(self, before: Sequence[int]) -> None:
        self.first = len(before)
        waits = [case for case, last in enumerate(before) if last >= 0]
        self.waiting: Sequence[int] = waits
        self._next: dict[int, list[int]] = {}
        for case in waits:
            self._next.setdefault(before[case], []).append(case)

    def after(self, case: int, end: Completion) -> Followers:  # noqa: ARG002
        """Return the cases to compute that begin with the last state of `case`.

        They are computed even if `case` failed: then they begin anew.

        Parameters
        ----------
        case : number of the case that has ended
        end : how it has ended, which has no influence
        """
        return Followers(self._next.get(case, ()))


def cases_before(settings: Settings) -> list[int]:
    """Return, for each case of branches, the number of the case that it continues.

    It is -1 for the first case of a branch.

    settings : {input: value} of each case, including its `history`
    """

    def key(values: Mapping[str, Any]) -> str:
        return json.dumps(sorted(values.items()))

    places = {key(own): case for case, own in enumerate(settings)}
    found = []
    for own in settings:
        over, values = parsed(own["history"])
        if not values:
            found.append(-1)
            continue
        was = {over: values[-1], "history": history_of(over, values[:-1])}
        found.append(places.get(key({**own, **was}), -1))
    return found


class Refined:
    """Refined campaign: coarse cases (of [sweep]), and those that their words require.

    Parameters
    ----------
    family : all possible cases
    twins : table [twins] of the plan; empty: no twins
    digest : function from a case number to its digest
    """

    waiting: Sequence[int] = ()
    grows = True

    def __init__(
        self, family: Family, twins: Mapping[str, Any], digest: Callable[[int], str]
    ) -> None:
        self.family, self.twins, self.digest = family, twins, digest
        self.first = len(family.coarse)
        self.growth = family.growth(str(twins.get("of", "")))
        self._twinned = 0  # number of the growth's twinned cases already returned

    def after(self, case: int, end: Completion) -> Followers:
        """Return the cases and twins that must be computed because `case` has ended.

        Parameters
        ----------
        case : number of the case
        end : how it has ended
        """
        rule, known = self.family.rule, end._asdict()
        word = rule.word_of(known) if end.is_ok else None
        sure = end.is_ok and rule.is_sure(known)
        fresh = self.growth.learn(self.family.address(case), word, sure=sure)
        twinned = self.growth.twinned[self._twinned :]
        self._twinned += len(twinned)
        cases, with_twins = (
            list(map(self.family.number, addresses)) for addresses in (fresh, twinned)
        )
        return Followers(cases, with_twins + self._even())

    def _even(self) -> list[int]:
        """Return cases away from boundaries, drawn at random to have twins.

        They are asked for by `[twins] of = "even"`; none are returned until all cases
        have ended. Such a case is even: all cells around it have one word, see
        `refinement.growth.Growth`.
        """
        if self.twins.get("of") != "even" or self.growth.left:
            return []
        cases = map(self.family.number, self.growth.even())
        named = [(case, self.digest(case)) for case in cases]
        return sampled(named, self.twins["sample"], self.twins["seed"])


class Folds(Refined):
    """Campaign of branches that is refined: where the word changes on a branch.

    Such a change is a fold; it is bisected by further cases.

    Parameters
    ----------
    family : all possible cases
    before : number of the case before each coarse case, -1: it begins a branch
    digest : function from a case number to its digest
    """

    def __init__(
        self, family: Family, before: Sequence[int], digest: Callable[[int], str]
    ) -> None:
        super().__init__(family, {}, digest)
        self.chains = Chains(before)
        self.waiting = self.chains.waiting

    def after(self, case: int, end: Completion) -> Followers:
        """Return the next case of the branch, and cases that bisect towards a fold.

        Parameters
        ----------
        case : number of the case that has ended
        end : how it has ended
        """
        following = self.chains.after(case, end).cases
        return Followers([*following, *super().after(case, end).cases])


def sampled(named: Iterable[tuple[int, str]], count: int, seed: int) -> list[int]:
    """Return the numbers of some cases, drawn at random for twins, ascending.

    The sample depends on digests and seed only. If cases are added later, earlier cases
    stay in the sample unless new ones displace them.

    Parameters
    ----------
    named : (number of a case, its digest) of all cases
    count : largest size of the sample
    seed : seed of the sample
    """
    drawn = (
        (hashlib.sha256(f"{seed} {digest}".encode()).digest(), case)
        for case, digest in named
    )
    return sorted(case for _, case in sorted(drawn)[:count])


def along(settings: Settings, swept: Sequence[str]) -> list[str]:
    """Return the names of swept inputs that are numbers and differ between cases."""
    table = Table.of(settings)
    columns = {name: listed(table.column(name, None).values) for name in swept}
    return [
        name
        for name, values in columns.items()
        if all(map(is_number, values)) and len(set(values)) > 1
    ]


def at_boundary(
    settings: Settings, swept: Sequence[str], words: Sequence[str] | NDArray[Any]
) -> NDArray[np.bool_]:
    """Return for each case whether a neighbour has another regime, (cases,).

    Neighbours differ in only one numeric input, and their values of it are adjacent
    among the cases that agree in all other inputs. Cases without a regime are skipped.

    Parameters
    ----------
    settings : {swept input: value} of each case
    swept : names of the swept inputs
    words : (cases,), regime of each case; "": it has none
    """
    table = Table.of(settings)
    found = np.zeros(len(table), dtype=bool)
    word = np.asarray(words)
    known = word != ""
    columns = {name: table.column(name, None) for name in table.names}
    numbers = {n: distinct(column.values) for n, column in columns.items()}
    cases = np.arange(len(table))
    for name in along(table, swept):
        others = [(columns[n], numbers[n]) for n in columns if n != name]
        line, values = labels(others, cases), columns[name].values
        order = np.lexsort((columns[name].of(cases, np.array(values, float)), line))
        one, next_ = order[:-1], order[1:]
        apart = (line[one] == line[next_]) & (word[one] != word[next_])
        apart &= known[one] & known[next_]
        found[one[apart]] = found[next_[apart]] = True
    return found
