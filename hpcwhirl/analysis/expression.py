"""Conditions on named numbers and words, such as ``late_fed >= 0.8 * late_lost``.

One small language serves the rules that define regimes (`scene.words`), the filters of
cases (`cases --where`, and on the page) and the colours of maps (`map --colour`).

    or, and, not      == != < <= > >= (may be chained)      in (a, b), not in (a, b)
    + - * /   abs(x) sqrt(x) exp(x) log(x) log10(x) min(x, y, ...) max(x, y, ...)
    numbers, numbers with a unit such as 0.5 mm, names, 'words'

A name that is no variable is a word: ``regime == sustained``. A number is in SI unless
a unit of `units.WRITTEN` follows it. Numbers are equal if they agree to nine digits. A
condition used as a number is 1 or 0. A comparison with a number that is missing (NaN)
is itself missing, NaN, neither true nor false, and remains so under ``not``; ``and`` is
false if one side is false, ``or`` true if one side is true, whatever the other is
(Kleene's three-valued logic). A text is parsed into a program of steps; nothing is
executed as code. The grammar:

    either   = both {"or" both}
    both     = negated {"and" negated}
    negated  = {"not"} compared
    compared = sum {("==" | "!=" | "<" | "<=" | ">" | ">=") sum}
             | sum ["not"] "in" "(" sum {"," sum} ")"
    sum      = product {("+" | "-") product}
    product  = signed {("*" | "/") signed}
    signed   = {"-"} atom
    atom     = number [unit] | name | 'word' | "(" either ")"
             | function "(" either {"," either} ")"

`report/page/assets/expression.js` implements the same language, and refuses the same
texts: tests/analysis/conditions.toml has examples, which a test asks of both.
"""

from __future__ import annotations

import math
import operator
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache, partial, reduce
from itertools import pairwise
from typing import Any, NoReturn

import numpy as np

from hpcwhirl.errors import SHOWN, InputError, one_line
from hpcwhirl.scene.units import WRITTEN
from hpcwhirl.store.reading.select import SAME

LONGEST = 2000  # largest number of characters of a condition
DEEPEST = 30  # largest number of nested brackets
COMPARED = ("==", "!=", "<=", ">=", "<", ">")
# {function: (least, largest) number of arguments}
FUNCTIONS = {
    "abs": (1, 1), "sqrt": (1, 1), "exp": (1, 1), "log": (1, 1), "log10": (1, 1),
    "min": (2, 99), "max": (2, 99),
}  # fmt: skip
RESERVED = ("and", "or", "not", "in")
CLOSING = {"(": ")", "[": "]", "{": "}"}
INSTEAD = {
    "=": "write == for 'is equal to'", "&": "write and", "&&": "write and",
    "|": "write or", "||": "write or", "!": "write not", "<>": "write !=",
    "**": "there are no powers: write x * x", "^": "there are no powers: write x * x",
    "%": "there is no remainder",
}  # fmt: skip
# "%" before a number is no unit, nor is "in" before a list
UNIT = re.compile(
    r"\s*(?:("
    + "|".join(map(re.escape, sorted({*WRITTEN} - {"%"}, key=len, reverse=True)))
    + r")(?![\w.]|\s*[(\[{])|(%)(?!\s*[\d(.]))"
)
TOKEN = re.compile(
    r"""\s*(?:
    (?P<number>(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)
    |(?P<name>[^\W\d][\w.]*)
    |'(?P<single>[^']*)'|"(?P<double>[^"]*)"
    |(?P<instead>&&?|\|\|?|\*\*|<>|\^|%|=(?!=)|!(?!=))
    |(?P<sign>==|!=|<=|>=|[<>()\[\]{}+\-*/,])
    )""",
    re.VERBOSE,
)


@dataclass(frozen=True)
class Step:
    """One step of a postfix program: it pops operands off a stack and pushes a value.

    Attributes
    ----------
    does : what is pushed: "number", "word" or "name" (a leaf); or the operation applied
        to operands: "negative", "not", "and", "or", "compare", "in", "+", "-", "*", "/"
        or a function
    parts : number of operands; 0 for a leaf
    value : number, word or name of a leaf; for a comparison its signs, one fewer than
        operands, separated by spaces
    text : the subexpression of the condition that this step completes
    unit : unit of a number, "" for none; a number is evaluated once it is in SI
    """

    does: str
    parts: int
    value: float | str
    text: str
    unit: str = ""


@dataclass(frozen=True)
class _Token:
    kind: str
    value: str
    start: int
    end: int
    unit: str = ""


@cache
def parse(text: str) -> tuple[Step, ...]:
    """Return a condition or numeric expression as a program, the steps that compute it.

    Raises
    ------
    InputError
        if the text does not follow this module's grammar, or is too long or nested too
        deeply
    """
    if len(text) > LONGEST:
        msg = f"a condition has at most {LONGEST} characters, got {len(text)}"
        raise InputError(msg)
    parser = _Parser(text.rstrip())
    try:
        parser.either()
        parser.end()
    except _NoneError as failed:
        shown = one_line(text.strip(), SHOWN)
        raise InputError(f"cannot read the condition '{shown}': {failed}") from None
    return tuple(parser.steps)


class _NoneError(Exception):
    """The text of a condition does not follow the grammar; the message tells why."""


def _refuse(why: str) -> NoReturn:
    raise _NoneError(why)


def _tokens(text: str) -> list[_Token]:
    tokens, at = [], 0
    while at < len(text):
        part = TOKEN.match(text, at)
        if part is None:
            _refuse(f"'{text[at:].strip()[:12]}' is not expected there")
        kind, value = str(part.lastgroup), part[str(part.lastgroup)]
        if kind == "instead":
            _refuse(f"'{value}' is not known here, {INSTEAD[value]}")
        kind = "word" if kind in {"single", "double"} else kind
        at = part.end()
        start = at - len(value) - 2 * (kind == "word")  # including quotation marks
        unit = UNIT.match(text, at) if kind == "number" else None
        at = unit.end() if unit else at
        name = str(unit[unit.lastindex or 0]) if unit else ""
        tokens.append(_Token(kind, value, start, at, name))
    return tokens


class _Parser:
    """Recursive-descent parser of a condition, with a method for each grammar rule.

    The method of a rule reads tokens that follow the rule, and appends the steps that
    compute them to the program.
    """

    def __init__(self, text: str) -> None:
        self.text = text
        self.steps: list[Step] = []
        self.tokens: list[_Token] | None = None
        self.at = self.depth = 0

    @property
    def _next(self) -> _Token:
        if self.tokens is None:
            self.tokens = _tokens(self.text)
        last = len(self.text)
        more = self.at < len(self.tokens)
        return self.tokens[self.at] if more else _Token("end", "", last, last)

    def _is(self, kind: str, *values: str) -> bool:
        token = self._next
        return token.kind == kind and token.value in values

    def _take(self) -> _Token:
        token = self._next
        self.at += 1
        return token

    def _expect(self, sign: str) -> None:
        if not self._is("sign", sign):
            if self._unit():
                self.end()
            _refuse(f"'{sign}' is missing{self._before()}")
        self.at += 1

    def _before(self) -> str:
        return f" before '{self._next.value}'" if self._next.kind != "end" else ""

    def _unit(self) -> str:
        """Return a hint where a name follows a number, as in "300 rmp"; else ""."""
        last = self.tokens[self.at - 1] if self.tokens and self.at else None
        if last is None or last.unit or (last.kind, self._next.kind) != (
            "number", "name",
        ):  # fmt: skip
            return ""
        return ", and is no unit of conditions, such as mm, rpm, kN"

    def _leaf(self, token: _Token) -> None:
        value = _number(token.value) if token.kind == "number" else token.value
        text = self.text[token.start : token.end]
        self.steps.append(Step(token.kind, 0, value, text, token.unit))

    def _step(self, does: str, parts: int, start: int, value: float | str = "") -> None:
        end = self.tokens[self.at - 1].end if self.tokens else 0
        self.steps.append(Step(does, parts, value, self.text[start:end]))

    def end(self) -> None:
        """Raise an error if the condition's text goes on after it is complete."""
        if self._next.kind != "end":
            _refuse(f"'{self._next.value}' is not expected there{self._unit()}")

    def either(self) -> None:
        self._joined(self.both, "name", "or")

    def both(self) -> None:
        self._joined(self.negated, "name", "and")

    def _joined(self, part: Callable[[], None], kind: str, *signs: str) -> None:
        start = self._next.start
        part()
        while self._is(kind, *signs):
            does = self._take().value
            part()
            self._step(does, 2, start)

    def _repeated(
        self, part: Callable[[], None], sign: tuple[str, str], does: str
    ) -> None:
        starts = []
        while self._is(*sign):
            starts.append(self._take().start)
        part()
        for start in reversed(starts):
            self._step(does, 1, start)

    def negated(self) -> None:
        self._repeated(self.compared, ("name", "not"), "not")

    def compared(self) -> None:
        start = self._next.start
        self.sum()
        if self._is("name", "not", "in"):
            self._member(start)
            return
        signs = []
        while self._is("sign", *COMPARED):
            signs.append(self._take().value)
            self.sum()
        if signs:
            self._step("compare", len(signs) + 1, start, " ".join(signs))

    def _member(self, start: int) -> None:
        away = self._take().value == "not"
        if away and not self._is("name", "in"):
            _refuse("'in' is missing after 'not'")
        self.at += away
        opening = self._next.value if self._next.kind == "sign" else ""
        if opening not in CLOSING:
            _refuse("a list such as (damped, sustained) is missing after 'in'")
        count = self._list(self.sum, CLOSING[opening])
        self._step("in", count + 1, start)
        if away:
            self._step("not", 1, start)

    def _list(self, part: Callable[[], None], closing: str) -> int:
        """Read a bracketed list separated by commas; return the number of its elements.

        part, closing : method that reads an element; bracket that must end the list
        """
        self.depth += 1
        if self.depth > DEEPEST:
            _refuse(f"it has more than {DEEPEST} brackets within each other")
        self.at += 1
        part()
        count = 1
        while self._is("sign", ","):
            self.at += 1
            if self._is("sign", closing):
                break
            part()
            count += 1
        self._expect(closing)
        self.depth -= 1
        return count

    def sum(self) -> None:
        self._joined(self.product, "sign", "+", "-")

    def product(self) -> None:
        self._joined(self.signed, "sign", "*", "/")

    def signed(self) -> None:
        self._repeated(self.atom, ("sign", "-"), "negative")

    def atom(self) -> None:
        token = self._next
        if self._is("sign", "("):
            if self._list(self.either, ")") > 1:
                _refuse("a list may stand only after 'in'")
            return
        if token.kind == "end":
            _refuse("something is missing at its end")
        if token.kind == "sign" or (token.value in RESERVED and token.kind == "name"):
            _refuse(f"'{token.value}' stands where a number or a name should")
        self.at += 1
        if token.kind == "name" and self._is("sign", "("):
            self._call(token)
            return
        self._leaf(token)

    def _call(self, token: _Token) -> None:
        name = token.value
        if name not in FUNCTIONS:
            _refuse(f"there is no function '{name}'; there are {', '.join(FUNCTIONS)}")
        least, most = FUNCTIONS[name]
        count = self._list(self.either, ")")
        if not least <= count <= most:
            wanted = f"{least}" if least == most else f"{least} to {most}"
            _refuse(f"the number of arguments of {name} must be {wanted}, got {count}")
        self._step(name, count, token.start)


def _number(text: str) -> float:
    value = float(text)
    if value == float("inf"):
        _refuse(f"a number is below 1.8e308, got one of {len(text)} characters")
    return value


Program = tuple[Step, ...]
# types of a number, and of a number or word, of one case; a union takes twice as long
NUMBER, ONE, BOTH = (float, int), (float, int, str), (bool, np.bool_)


def _quotient(over: Any, under: Any) -> Any:
    with np.errstate(divide="ignore", invalid="ignore"):  # inf and nan are results
        return np.divide(over, under)


def is_text(value: Any) -> bool:
    """Return whether an operand of a condition is a text, or an array of texts."""
    if isinstance(value, ONE):  # as in the rules of one case
        return isinstance(value, str)
    return np.asarray(value).dtype.kind in "OUS"


def equal(a: Any, b: Any) -> Any:
    """Return whether a equals b: a truth value, or an array of them.

    Words must be the same; numbers must agree to nine digits.
    """
    if is_text(a) or is_text(b):
        return a == b
    return np.equal(a, b) | (abs(a - b) <= SAME * abs(b)) & np.isfinite(b)


def _select(condition: Any, one: Any, other: Any) -> Any:
    """Return `one` where a condition holds, else `other`; a number for a truth value.

    numpy.where does the same for arrays, but takes long for a single number.
    """
    if isinstance(condition, BOTH):
        return one if condition else other
    return np.where(condition, one, other)


def _compared(holds: Callable[[Any, Any], Any], a: Any, b: Any) -> Any:
    """Return the value of a comparison: 1 or 0; NaN where a number is missing.

    holds : the comparison of two known operands
    """
    if isinstance(a, NUMBER) and isinstance(b, NUMBER):
        return math.nan if a != a or b != b else float(holds(a, b))  # noqa: PLR0124
    found = holds(a, b) * 1.0
    if is_text(a) or is_text(b):
        return found
    return _select(np.isnan(a) | np.isnan(b), np.nan, found)


def _greater(a: Any, b: Any) -> Any:
    """Return the greater of two numbers, element by element; NaN if one is NaN."""
    if isinstance(a, NUMBER) and isinstance(b, NUMBER):
        return a if a > b or a != a else b  # noqa: PLR0124
    return np.maximum(a, b)


def _either(a: Any, b: Any) -> Any:
    """Return ``a or b``: 1 if one of both is, 0 if both are, else NaN."""
    return _select((a == 1) | (b == 1), 1.0, a + b)


def _both(a: Any, b: Any) -> Any:
    """Return ``a and b``: 0 if one of both is, 1 if both are, else NaN."""
    return _select((a == 0) | (b == 0), 0.0, a * b)


ORDER: dict[str, Callable[[Any, Any], Any]] = {
    "==": equal, "!=": lambda a, b: np.logical_not(equal(a, b)),
    "<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge,
}  # fmt: skip
MEANING: dict[str, Callable[..., Any]] = {
    "+": operator.add, "-": operator.sub, "*": operator.mul, "/": _quotient,
    "negative": operator.neg,
    "in": lambda a, *of: reduce(_either, [_compared(equal, a, b) for b in of]),
    "not": lambda a: 1.0 - a, "and": _both, "or": _either,
    "abs": abs, "sqrt": np.sqrt, "exp": np.exp, "log": np.log, "log10": np.log10,
    "min": lambda *of: reduce(np.minimum, of),
    "max": lambda *of: reduce(_greater, of),
}  # fmt: skip


def names_in(program: Program) -> set[str]:
    """Return the names of variables, and unquoted words, in a parsed condition."""
    return {str(step.value) for step in program if step.does == "name"}


def value_of(program: Program, known: Mapping[str, Any]) -> Any:
    """Return the value of a condition or expression, a number or an array of numbers.

    That of a condition is 1 or 0, or NaN where it is missing: see `holds`.

    Parameters
    ----------
    program : the parsed condition, result of `parse`
    known : {name of a variable: its number, word or truth value, or an array of these};
        a name that is missing counts as a word, as `damped` in ``regime == damped``
    """
    stack: list[Any] = []
    for step in program:
        if step.does == "name":
            stack.append(known.get(str(step.value), step.value))
        elif not step.parts:
            stack.append(_constant(step))
        else:
            parts = stack[-step.parts :]
            del stack[-step.parts :]
            stack.append(_meaning(step.does, step.value)(*parts))
    return stack[0]


def _constant(step: Step) -> float | str:
    """Return the number or word of a leaf; InputError for a number not yet in SI."""
    if step.unit:
        raise InputError(f"'{step.text}': a number with a unit is not known here")
    return step.value


@cache
def _meaning(does: str, value: Any) -> Callable[..., Any]:
    """Return the function of a step's operands, by the step's fields."""
    if does != "compare":
        return MEANING[does]
    each = [partial(_compared, ORDER[sign]) for sign in str(value).split()]
    if len(each) == 1:
        return each[0]

    def compare(*parts: Any) -> Any:
        pairs = zip(each, pairwise(parts), strict=True)
        return reduce(_both, (one(*pair) for one, pair in pairs))

    return compare


def holds(program: Program, known: Mapping[str, Any]) -> Any:
    """Return whether a condition is true: a truth value, or an array of them.

    It is not where it is false or missing; program, known : as for `value_of`
    """
    return value_of(program, known) == 1


class Known(dict[str, Any]):
    """What is known of one case, {name of a variable: value}, for `asker`.

    Some variables are defined by an expression, evaluated where one is first asked for;
    any other name is a word.

    Parameters
    ----------
    values : {name: value}
    defined : {name: expression}
    """

    def __init__(
        self, values: Mapping[str, Any], defined: Mapping[str, str] | None = None
    ) -> None:
        super().__init__(values)
        self.defined = defined or {}

    def __missing__(self, name: str) -> Any:
        """Return the value of a variable that is defined, or the name, a word."""
        if name not in self.defined:
            return name
        self[name] = asker(self.defined[name])(self)
        return self[name]


@cache
def asker(text: str) -> Callable[[Known], Any]:
    """Return a function that evaluates a condition in one case.

    Its value is that of `value_of`, sooner; it calls itself as deep as the condition is
    nested, and is meant for the rules of words.
    """
    stack: list[Callable[[Known], Any]] = []
    for step in parse(text):
        parts = tuple(stack[len(stack) - step.parts :])
        del stack[len(stack) - step.parts :]
        stack.append(_asker(step, parts))
    return stack[0]


def _asker(step: Step, parts: tuple[Callable[..., Any], ...]) -> Callable[..., Any]:
    """Return the function of a step of a condition, given those of its operands."""
    value = step.value
    if step.does == "name":
        return operator.itemgetter(value)
    if not parts:
        value = _constant(step)
        return lambda _: value
    do = _meaning(step.does, value)
    if len(parts) == 1:
        (one,) = parts
        return lambda known: do(one(known))
    if len(parts) == 2:
        one, two = parts
        return lambda known: do(one(known), two(known))
    return lambda known: do(*(part(known) for part in parts))
