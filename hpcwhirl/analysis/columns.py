"""Evaluation of a user's conditions and expressions over the variables of results.

An example is ``cases --where "regime == divergent and speed > 400"``. A condition is
checked before it is evaluated: operands must be numbers where numbers are needed, names
must exist, and a variable is compared only with words that it can have.
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
AT_ONCE = 100_000  # number of cases whose texts are read from the file at a time
Kind = Literal["number", "text", "truth"]
ORDERED = {"<", "<=", ">", ">="}
LOGIC = {"and", "or", "not"}


@dataclass(frozen=True)
class Source:
    """The variables of results that a condition may name, and how they are read.

    Attributes
    ----------
    variable : function from a name as the user wrote it to the full name of a variable
        of the results; raises InputError if there is none
    column : function from a variable's full name to its values, (cases,), numbers or
        text
    words : {variable: words that it can have}
    cases : number of cases in the results
    """

    variable: Callable[[str], str]
    column: Callable[[str], NDArray[Any]]
    words: dict[str, Sequence[str]]
    cases: int


def source_of(data: xarray.Dataset) -> Source:
    """Return access to all variables with a value per case, and to each case's word.

    data : results from `open_results`; the word has the name `word`
    """
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
    """Return a variable of texts as an array, (cases,), read in parts to save memory.

    variable : variable of the results that has a text for each case
    """
    starts = range(0, max(len(variable), 1), AT_ONCE)
    parts = [variable[start : start + AT_ONCE].to_numpy() for start in starts]
    return np.concatenate(parts)


def matching(text: str, source: Source, option: str = "--where") -> NDArray[np.bool_]:
    """Return for each case whether a condition holds, (cases,).

    It does not where a number that decides it is missing, as without a result.

    text : the condition, such as "regime == divergent"
    source : variables of the results
    option : option with which the user wrote the condition, for messages

    Raises
    ------
    InputError
        if the text is no condition, or names an unknown variable
    """
    found = _evaluated(text, source, "truth", option)
    return np.broadcast_to(np.asarray(found) == 1, source.cases).copy()


def numbers(text: str, source: Source, option: str) -> NDArray[np.float64]:
    """Return the value of a numeric expression for each case, (cases,).

    text : the expression, such as "orbit_radius/gap"
    source : variables of the results
    option : option with which the user wrote the expression, for messages

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
    """Return a variable's values as they are if texts, else as floats.

    Integers could overflow in expressions; column : (cases,)
    """
    return column if is_text(column) else column.astype(float)


@dataclass(frozen=True)
class _Part:
    """A subexpression of a condition, and the kind of value that it gives.

    A leaf is a subexpression without operands: a number, a name or a quoted word.

    Attributes
    ----------
    kind : kind of its value: "number", "text" or "truth"
    text : the subexpression as the user wrote it
    at : index of a leaf's step in the program; -1 if it is no leaf
    variable : variable of the results that a name stands for; "" for none
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
    """Check of a parsed condition, which resolves its names to variables or words.

    A name becomes the full name of a variable if there is one, else an unquoted word.
    """

    def __init__(self, program: Program, source: Source) -> None:
        self.steps = list(program)
        self.source = source

    def named(self, wanted: Kind) -> Program:
        """Return the program with each name resolved to a variable or a word.

        InputError if it gives another kind of value than `wanted`: "truth" or "number".
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
        """Check that the operands of == or != are both numbers or both texts.

        A name that is a word of the other operand, as in ``regime == damped``, becomes
        that word; a word that the other operand cannot have is refused.
        """
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
        """Return a name as a quoted word if the variable compared with it can have it.

        part, beside : operand that may be a name; operand on the other side of == or !=
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
