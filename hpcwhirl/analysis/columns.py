"""Evaluation of conditions and expressions over the variables of a results file.

A condition is checked before it is evaluated: operands must be numbers where numbers
are needed, names must exist, and a variable is compared only with words that it can
have.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Literal, NoReturn

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.analysis.expression import (
    Program,
    Step,
    is_text,
    names_in,
    parse,
    value_of,
)
from hpcwhirl.errors import SHOWN, InputError, nearest, one_line, unknown
from hpcwhirl.scene.words import ENUMS
from hpcwhirl.scene.words import SHOWN as WORDS
from hpcwhirl.store.reading.coded import combined
from hpcwhirl.store.reading.reader import coded
from hpcwhirl.store.reading.select import known_counts, variable_of
from hpcwhirl.store.reading.shares import words_of

if TYPE_CHECKING:
    import xarray

WORD = "word"  # variable with a case's regime or, without one, why it has none
AT_ONCE = 100_000  # number of texts read at a time
Kind = Literal["number", "text", "truth"]
ORDERED = {"<", "<=", ">", ">="}
LOGIC = {"and", "or", "not"}


@dataclass(frozen=True)
class Source:
    """Access to the columns that conditions name.

    Attributes
    ----------
    variable : function from a name as written to a variable of the file; raises
        InputError
    column : function from a variable to its values, (cases,), numbers or text
    words : {variable: words that it can have}
    cases : number of cases
    """

    variable: Callable[[str], str]
    column: Callable[[str], NDArray[Any]]
    words: dict[str, Sequence[str]]
    cases: int


def source_of(data: xarray.Dataset) -> Source:
    """Return access to the per-case variables of results, and to `word`, by name."""
    known = [str(n) for n, v in data.variables.items() if v.dims == ("case",)]

    def variable(name: str) -> str:
        if name == WORD or name in known:
            return name
        try:
            return variable_of(name, known, "variable")
        except InputError:
            hint = nearest(name, known) or "; `cases --columns '?'` lists all variables"
            msg = f"unknown variable '{one_line(name, SHOWN)}'{hint}"
            raise InputError(msg) from None

    def column(name: str) -> NDArray[Any]:
        if name == WORD:
            kinds = (coded(data[n]) for n in ("status", "outcome", "regime"))
            return np.asarray(combined(words_of, *kinds), dtype=object)
        if name in ENUMS and data[name].dtype.kind in "iu":
            return np.asarray(coded(data[name]), dtype=object)
        if data[name].dtype.kind == "O":
            return _texts(data[name])
        return known_counts(data[name].to_numpy())

    allowed: dict[str, Any] = {n: ENUMS[n] for n in ENUMS if n in known}
    return Source(variable, column, allowed | {WORD: tuple(WORDS)}, data.sizes["case"])


def _texts(variable: xarray.DataArray) -> NDArray[np.object_]:
    """Return the texts of all cases, (cases,), read in parts to save memory."""
    starts = range(0, max(len(variable), 1), AT_ONCE)
    parts = [variable[start : start + AT_ONCE].to_numpy() for start in starts]
    return np.concatenate(parts)


def matching(text: str, source: Source, option: str = "--where") -> NDArray[np.bool_]:
    """Return for each case whether a condition holds, (cases,).

    option : where the user wrote the condition, for messages

    Raises
    ------
    InputError
        if the text is no condition, or names an unknown variable
    """
    holds = _evaluated(text, source, "truth", option)
    return np.broadcast_to(np.asarray(holds, bool), source.cases).copy()


def numbers(text: str, source: Source, option: str) -> NDArray[np.float64]:
    """Return the value of a numeric expression for each case, (cases,).

    option : where the user wrote the expression, for messages

    Raises
    ------
    InputError
        if the text gives no number, or names an unknown variable
    """
    values = _evaluated(text, source, "number", option)
    return np.broadcast_to(np.asarray(values, float), source.cases).copy()


def _evaluated(text: str, source: Source, wanted: Kind, option: str) -> Any:
    try:
        program = _Check(parse(text), source).named(wanted)
    except InputError as failed:
        raise InputError(f"{option}: {failed}") from None
    columns = {name: _plain(source.column(name)) for name in names_in(program)}
    with np.errstate(all="ignore"):
        return value_of(program, columns)


def _plain(column: NDArray[Any]) -> NDArray[Any]:
    """Return a column as texts or as floats; integers could overflow in expressions."""
    return column if is_text(column) else column.astype(float)


@dataclass(frozen=True)
class _Part:
    """A subexpression, or a leaf: a number, a name or a quoted word.

    Attributes
    ----------
    kind : "number", "text" or "truth"
    text : the subexpression as it was written
    at : index of a leaf's step in the program; -1 if the part is no leaf
    variable : variable that a name stands for; "" for none
    bare : name that is no variable and may be an unquoted word; else ""
    word : name or word of a leaf
    """

    kind: Kind
    text: str
    at: int = -1
    variable: str = ""
    bare: str = ""
    word: str = ""


class _Check:
    """Check of a parsed condition, whose names become variables or words."""

    def __init__(self, program: Program, source: Source) -> None:
        self.steps = list(program)
        self.source = source

    def named(self, wanted: Kind) -> Program:
        """Return the program with each name resolved to a variable or a word.

        wanted : "truth" or "number", what the condition must give; else InputError
        """
        stack: list[_Part] = []
        for at, step in enumerate(tuple(self.steps)):
            parts = stack[len(stack) - step.parts :]
            del stack[len(stack) - step.parts :]
            stack.append(self._of(at, step, parts))
        if wanted == "truth":
            self._truth(stack[0])
        else:
            self._number(stack[0])
        return tuple(self.steps)

    def _of(self, at: int, step: Step, parts: list[_Part]) -> _Part:
        match step.does:
            case "number":
                return _Part("number", step.text)
            case "word":
                return _Part("text", step.text, at, word=str(step.value))
            case "name":
                return self._name(at, step)
            case "compare" | "in":
                self._compared(step, parts)
                return _Part("truth", step.text)
        for part in parts:
            if step.does in LOGIC:
                self._truth(part)
            else:
                self._number(part)
        return _Part("truth" if step.does in LOGIC else "number", step.text)

    def _name(self, at: int, step: Step) -> _Part:
        name = str(step.value)
        try:
            variable = self.source.variable(name)
        except InputError:
            self.steps[at] = replace(step, does="word")
            return _Part("text", step.text, at, bare=name, word=name)
        self.steps[at] = replace(step, value=variable)
        kind: Kind = "text" if is_text(self.source.column(variable)) else "number"
        return _Part(kind, step.text, at, variable, word=name)

    def _compared(self, step: Step, parts: list[_Part]) -> None:
        for sign, a, b in _pairs(step, parts):
            if sign in ORDERED:
                self._number(a)
                self._number(b)
            else:
                self._equal(a, b)

    def _equal(self, a: _Part, b: _Part) -> None:
        """Check operands of == or !=; turn a name into a word of the other operand."""
        a, b = self._as_word(a, b), self._as_word(b, a)
        texts = [part.kind == "text" for part in (a, b)]
        if texts[0] != texts[1] or (not a.variable and not b.variable and texts[0]):
            for part in (a, b):
                self._check_name(part)
            _refuse(b, f"cannot be equal to '{_short(a.text)}': one is text")
        for one, other in ((a, b), (b, a)):
            allowed = self.source.words.get(one.variable, ())
            if allowed and not other.variable and other.word not in allowed:
                raise unknown(one.variable, other.word, allowed)

    def _as_word(self, part: _Part, beside: _Part) -> _Part:
        """Return a name as a word if the variable on the other side can have it.

        part, beside : the name; the other side of the comparison
        """
        if not part.variable or part.word not in self.source.words.get(
            beside.variable, ()
        ):
            return part
        self.steps[part.at] = Step("word", 0, part.word, part.text)
        return _Part("text", part.text, part.at, word=part.word)

    def _check_name(self, part: _Part) -> None:
        if part.bare:
            self.source.variable(part.bare)  # raises, naming the nearest

    def _number(self, part: _Part) -> None:
        self._check_name(part)
        if part.kind == "text":
            _refuse(part, "is text: compare it by == or !=")

    def _truth(self, part: _Part) -> None:
        self._check_name(part)
        if part.kind != "truth":
            _refuse(part, "is no condition: compare it with a number or a word")


def _pairs(step: Step, parts: list[_Part]) -> Iterator[tuple[str, _Part, _Part]]:
    if step.does == "in":
        yield from (("==", parts[0], other) for other in parts[1:])
        return
    pairs = zip(str(step.value).split(), pairwise(parts), strict=True)
    yield from ((sign, a, b) for sign, (a, b) in pairs)


def _short(text: str) -> str:
    return one_line(text, SHOWN)


def _refuse(part: _Part, why: str) -> NoReturn:
    raise InputError(f"'{_short(part.text)}' {why}")
