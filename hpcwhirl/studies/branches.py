"""Branches of a campaign with [branch]: where words change, and where branches differ.

Along a branch one input, such as the speed, rises or falls from case to case, and each
case begins with the last state of the case before. Where the word changes between two
cases, the motion that was followed ends, at a fold or where it becomes unstable. If two
branches have different words at one point, two motions coexist there: hysteresis. A
change from or to an undecided case, or one without a regime, is open: a longer run may
give that case its neighbour's word, so it is neither a fold nor hysteresis. A bundle is
the set of branches over the same values of all other inputs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.errors import InputError
from hpcwhirl.scene.history import parsed
from hpcwhirl.scene.input_names import full_name
from hpcwhirl.scene.quantities import variable_name
from hpcwhirl.scene.words import NO_END, word_of
from hpcwhirl.store.reading.results_file import Results

ASIDE = ("branch", "history")  # inputs in which the branches of a bundle differ


@dataclass(frozen=True)
class Branch:
    """Cases of one branch, in the order in which they were integrated.

    Attributes
    ----------
    name : up or down, and the value at which the branch begins
    others : {other swept input: its value in all cases of the branch}
    cases : numbers of the cases in the campaign
    values : (cases,), value of the input that varies along the branch, SI
    words : word of each case
    radii : orbit radius of each case, m
    """

    name: str
    others: dict[str, Any]
    cases: list[int]
    values: NDArray[np.float64]
    words: list[str]
    radii: NDArray[np.float64]


class Change(NamedTuple):
    """A change of word along a branch, from one case to the next.

    Attributes
    ----------
    branch : branch on which the word changes
    last, first : values of the varied input in the last case before the change and in
        the first case after it, SI; of a fold cases may lie between whose end is not
        known
    word, following : words of these two cases
    kind : "fold", or "open" if it is not known where one of them ends
    radius : orbit radius of the case before the change, m
    """

    branch: Branch
    last: float
    first: float
    word: str
    following: str
    kind: str
    radius: float


def varied_by(results: Results) -> str:
    """Return the full name of the input that varies along branches, such as "speed".

    results : results of a campaign with [branch]

    Raises
    ------
    InputError
        for a campaign without [branch]
    """
    settings = results.plan.settings
    inputs = (parsed(own.get("history", "")) for own in settings)
    over = next((name for name, values in inputs if values), "")
    if not over:
        msg = f"{results.path}: its campaign has no table [branch]"
        raise InputError(f"{msg}, see hpcwhirl manual branches")
    return full_name(over)


def aside_of(results: Results) -> tuple[str, str]:
    """Return "branch" and the short name of the input that varies along branches.

    The name of a figure of a bundle of branches leaves these two inputs out, since they
    differ between the cases that the figure shows.
    """
    return "branch", varied_by(results).rsplit(".", 1)[-1]


def bundles_of(results: Results) -> list[list[int]]:
    """Return the numbers of the finished cases of each bundle of branches.

    The branches of a bundle have the same values of all other inputs: they differ only
    in direction and in the value at which they begin.
    """
    done, bundles = {*results.finished()}, dict[str, list[int]]()
    for branch in branches_of(results)[1]:
        cases = [case for case in branch.cases if case in done]
        bundles.setdefault(repr(branch.others), []).extend(cases)
    return [cases for cases in bundles.values() if cases]


def branches_of(
    results: Results, only: Sequence[int] | None = None
) -> tuple[str, list[Branch]]:
    """Return (full name of the input that varies along branches, the branches).

    only : numbers of cases: only branches that contain one of them; None: all branches

    Raises
    ------
    InputError
        for a campaign without [branch]
    """
    over, chosen = varied_by(results), None if only is None else set(only)
    settings = results.plan.settings
    lines: dict[str, list[int]] = {}
    for case, own in enumerate(settings):
        rest = {n: v for n, v in own.items() if n not in (over, "history")}
        lines.setdefault(repr(sorted(rest.items())), []).append(case)
    found = [_branch(results, over, cases) for cases in lines.values()]
    return over, [one for one in found if chosen is None or chosen & {*one.cases}]


def _branch(results: Results, over: str, cases: list[int]) -> Branch:
    own = results.plan.settings[cases[0]]
    falls = own["branch"].startswith("down")
    cases = sorted(cases, key=lambda n: results.plan.settings[n][over], reverse=falls)
    others = {n: v for n, v in own.items() if n not in (over, *ASIDE)}
    keys = "status", "outcome", "regime"
    words = [word_of(*(str(results[name][case]) for name in keys)) for case in cases]
    values = [float(results.plan.settings[case][over]) for case in cases]
    radii = np.asarray(results["orbit_radius"], dtype=float)[cases]
    return Branch(own["branch"], others, cases, np.array(values), words, radii)


def changes_of(branch: Branch) -> list[Change]:
    """Return the changes of word along a branch, in the order of its cases.

    A fold lies between a case and the next one that ends on another known motion; cases
    between both of which the end is not known belong to it.
    """
    known = [i for i, word in enumerate(branch.words) if word not in NO_END]
    folds = [(i, j) for i, j in pairwise(known) if branch.words[i] != branch.words[j]]
    inside = {i for first, end in folds for i in range(first, end)}
    steps = pairwise(range(len(branch.words)))
    opened = [(i, j) for i, j in steps if branch.words[i] != branch.words[j]]
    rest = [pair for pair in opened if pair[0] not in inside]
    found = dict.fromkeys(folds, "fold") | dict.fromkeys(rest, "open")
    return [_change(branch, *pair, found[pair]) for pair in sorted(found)]


def _change(branch: Branch, before: int, after: int, kind: str) -> Change:
    last, first = branch.values[[before, after]].tolist()
    words = branch.words[before], branch.words[after]
    return Change(branch, last, first, *words, kind, float(branch.radii[before]))


def changes_along(branches: Sequence[Branch]) -> dict[str, list[Any]]:
    """Return the changes of word along branches as a table, {column: (changes,)}.

    Columns are the inputs that have one value along a branch, by the names of their
    variables in results, then `branch`, its name, and the other attributes of `Change`.
    """
    found = [change for branch in branches for change in changes_of(branch)]
    table: dict[str, list[Any]] = {
        variable_name(name): [change.branch.others[name] for change in found]
        for name in branches[0].others
    }
    table["branch"] = [change.branch.name for change in found]
    return table | {n: [getattr(c, n) for c in found] for n in Change._fields[1:]}


def count_differences(branches: Sequence[Branch]) -> tuple[int, int]:
    """Return at how many points branches have different words, and how many they share.

    A point is one combination of all swept inputs, including the one that varies along
    branches; the second number counts the points that lie on two branches or more. Only
    cases count of which it is known where they end.
    """
    points: dict[tuple[str, float], list[str]] = {}
    for branch in branches:
        for value, word in zip(branch.values.tolist(), branch.words, strict=True):
            if word not in NO_END:
                points.setdefault((repr(branch.others), value), []).append(word)
    several = [words for words in points.values() if len(words) > 1]
    return sum(len(set(words)) > 1 for words in several), len(several)
