"""Conditions on named numbers and words, such as ``late_fed >= 0.8 * late_lost``.

One small language serves the rules that define regimes (`scene.words`), the filters of
cases (`cases --where`, and on the page) and the colours of maps (`map --colour`).

    or, and, not      == != < <= > >= (may be chained)      in (a, b), not in (a, b)
    + - * /   abs(x) sqrt(x) exp(x) log(x) log10(x) min(x, y, ...) max(x, y, ...)
    numbers, names, 'words'

A name that is no variable is a word: ``regime == sustained``. Numbers are equal if they
agree to nine digits. A condition used as a number is 1 or 0. `grammar` parses a text;
nothing is executed as code. `report/page/assets/expression.js` implements the same
language.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping
from functools import cache, reduce
from itertools import pairwise
from typing import Any

import numpy as np

from hpcwhirl.analysis.grammar import Step, parse
from hpcwhirl.store.reading.select import SAME

Program = tuple[Step, ...]


def _quotient(over: Any, under: Any) -> Any:
    with np.errstate(divide="ignore", invalid="ignore"):  # inf and nan are results
        return np.divide(over, under)


def is_text(value: Any) -> bool:
    """Return whether a value is a word, or an array of words."""
    return isinstance(value, str) or np.asarray(value).dtype.kind in "OUS"


def equal(a: Any, b: Any) -> Any:
    """Return whether words are the same, or numbers agree to nine digits."""
    if is_text(a) or is_text(b):
        return a == b
    return np.equal(a, b) | (abs(a - b) <= SAME * abs(b)) & np.isfinite(b)


def _unequal(a: Any, b: Any) -> Any:
    return np.logical_not(equal(a, b))


def _any_of(one: Any, *others: Any) -> Any:
    return reduce(np.logical_or, [equal(one, other) for other in others])


def _least(*parts: Any) -> Any:
    return reduce(np.minimum, parts)


def _most(*parts: Any) -> Any:
    return reduce(np.maximum, parts)


ORDER: dict[str, Callable[[Any, Any], Any]] = {
    "==": equal, "!=": _unequal, "<": operator.lt, "<=": operator.le,
    ">": operator.gt, ">=": operator.ge,
}  # fmt: skip
MEANING: dict[str, Callable[..., Any]] = {
    "+": operator.add, "-": operator.sub, "*": operator.mul, "/": _quotient,
    "negative": operator.neg, "in": _any_of,
    "not": np.logical_not, "and": np.logical_and, "or": np.logical_or,
    "abs": np.abs, "sqrt": np.sqrt, "exp": np.exp, "log": np.log, "log10": np.log10,
    "min": _least, "max": _most,
}  # fmt: skip


def names_in(program: Program) -> set[str]:
    """Return the names that occur in a program."""
    return {str(step.value) for step in program if step.does == "name"}


def value_of(program: Program, known: Mapping[str, Any]) -> Any:
    """Return the value of a program: a number, a truth value, or an array of either.

    Parameters
    ----------
    program : result of `grammar.parse`
    known : {name: number, word or truth value, or an array of these}; a name that is
        missing stands for itself as a word
    """
    stack: list[Any] = []
    for step in program:
        if step.does == "name":
            stack.append(known.get(str(step.value), step.value))
        elif not step.parts:
            stack.append(step.value)
        else:
            parts = stack[-step.parts :]
            del stack[-step.parts :]
            stack.append(_apply(step, parts))
    return stack[0]


def _apply(step: Step, parts: list[Any]) -> Any:
    if step.does != "compare":
        return MEANING[step.does](*parts)
    signs = str(step.value).split()
    pairs = zip(signs, pairwise(parts), strict=True)
    return reduce(np.logical_and, (ORDER[sign](*pair) for sign, pair in pairs))


@cache
def asker(text: str) -> Callable[[Mapping[str, Any]], Any]:
    """Return the function from {name: value} to the value of a condition."""
    program = parse(text)
    return lambda known: value_of(program, known)
