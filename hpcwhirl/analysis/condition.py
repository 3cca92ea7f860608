"""The check of a condition before it is evaluated: kinds, names and units of its parts.

Operands must be numbers where numbers are needed, names must exist, and a variable is
compared only with words that it can have. Numbers are in SI; one with a unit, as in
``orbit_radius > 0.5 mm``, is converted to the unit of what it is compared with, or
added to. `report/page/assets/condition.js` checks the page's filter in the same way.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import Decimal
from itertools import pairwise
from typing import Any, Literal, NoReturn

from numpy.typing import NDArray

from hpcwhirl.analysis.expression import Program, Step, is_text
from hpcwhirl.errors import SHOWN, InputError, one_line, unknown
from hpcwhirl.scene.units import measure, written_factors

Kind = Literal["number", "text", "truth"]
ORDERED = {"<", "<=", ">", ">="}
LOGIC = {"and", "or", "not"}
ALIKE = {"+", "-", "min", "max", "negative", "abs"}  # operands and result have one unit
UNCLEAR = "?"  # unit of a product or a power, which is not worked out


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
    units : {variable: its unit}; without one it is compared with plain numbers only
    """

    variable: Callable[[str], str]
    column: Callable[[str], NDArray[Any]]
    words: dict[str, Sequence[str]]
    cases: int
    units: Mapping[str, str] = field(default_factory=dict)


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
    unit : SI unit of a number's quantity; "" for a plain number, or one whose quantity
        depends on what it is compared with; or `UNCLEAR`
    open : steps of numbers, with a unit or plain, whose quantity is not known yet
    """

    kind: Kind
    text: str
    at: int = -1
    variable: str = ""
    bare: str = ""
    word: str = ""
    unit: str = ""
    open: tuple[int, ...] = ()


class Check:
    """Check of a parsed condition, which resolves its names to variables or words.

    A name becomes the full name of a variable if there is one, else an unquoted word.
    """

    def __init__(self, program: Program, source: Source) -> None:
        self.steps = list(program)
        self.source = source
        self.plain: dict[int, str] = {}  # {step of a plain number: its quantity's unit}

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
            self._alone(stack[0])
        return tuple(self.steps)

    def _of(self, at: int, step: Step, parts: list[_Part]) -> _Part:
        match step.does:
            case "number":
                return _Part("number", step.text, open=(at,))
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
        if step.does in LOGIC:
            return _Part("truth", step.text)
        return replace(self._calculated(step.does, parts), text=step.text)

    def _calculated(self, does: str, parts: list[_Part]) -> _Part:
        """Return the part that an arithmetic step makes of its operands."""
        if does in ALIKE:
            return self._alike(*parts)
        scaled = [p for p in parts if p.unit or self._has_units(p)]
        if does in {"*", "/"} and (not scaled or scaled == parts[:1]):
            return _Part("number", "", unit=parts[0].unit, open=parts[0].open)
        if does == "*" and scaled == parts[1:]:
            return _Part("number", "", unit=parts[1].unit, open=parts[1].open)
        units = {part.unit for part in parts if part.unit}
        if does == "/" and len(units) == 1 and len(scaled) == 2:
            self._alike(*parts)
            return _Part("number", "", unit="1")
        for part in parts:
            self._alone(part)
        return _Part("number", "", unit=UNCLEAR if scaled else "")

    def _has_units(self, part: _Part) -> bool:
        return any(self.steps[at].unit for at in part.open)

    def _alike(self, *parts: _Part) -> _Part:
        """Return a part of operands that measure one quantity.

        Numbers with a unit among them are converted to SI once an operand has one.
        """
        known = next((part for part in parts if part.unit), None)
        if known is None:
            return _Part("number", "", open=sum((p.open for p in parts), ()))
        for part in parts:
            for at in part.open:
                self._convert(at, known)
        return _Part("number", "", unit=known.unit)

    def _convert(self, at: int, beside: _Part) -> None:
        """Convert a number to SI; at, beside : its step; what has the quantity's unit.

        A plain number is in SI already.
        """
        step = self.steps[at]
        if not step.unit:
            self.plain[at] = beside.unit
            return
        what = f"'{_short(beside.text)}'"
        if beside.unit == UNCLEAR:
            self._lost(step, f"the unit of {what} is not worked out")
        factor = written_factors(beside.unit).get(step.unit)
        if factor is None:
            unit = "has no unit" if beside.unit == "1" else f"is in {beside.unit}"
            self._lost(step, f"{what} {unit}")
        value = float(Decimal(repr(step.value)) * Decimal(str(factor)))
        self.steps[at] = replace(step, value=value, unit="")

    def _alone(self, part: _Part) -> None:
        """Refuse numbers with a unit that nothing with a unit stands beside."""
        for at in part.open:
            if self.steps[at].unit:
                self._lost(self.steps[at], "nothing with a unit is beside it")

    def _lost(self, step: Step, why: str) -> NoReturn:
        raise InputError(f"'{_short(step.text)}' cannot be converted: {why}")

    def _name(self, at: int, step: Step) -> _Part:
        name = str(step.value)
        try:
            variable = self.source.variable(name)
        except InputError:
            self.steps[at] = replace(step, does="word")
            return _Part("text", step.text, at, bare=name, word=name)
        self.steps[at] = replace(step, value=variable)
        kind: Kind = "text" if is_text(self.source.column(variable)) else "number"
        unit = self.source.units.get(variable, "1") if kind == "number" else ""
        return _Part(kind, step.text, at, variable, word=name, unit=unit)

    def _compared(self, step: Step, parts: list[_Part]) -> None:
        for sign, a, b in _pairs(step, parts):
            if sign in ORDERED:
                self._number(a)
                self._number(b)
            else:
                self._equal(a, b)
            if a.kind != "text":
                self._alone(self._alike(a, b))

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
            hint = _unquoted(a) or _unquoted(b)
            _refuse(b, f"cannot be equal to '{_short(a.text)}': one is text{hint}")
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
        if not part.bare:
            return
        for variable, words in self.source.words.items():
            if part.bare in words:
                _refuse(part, f"is a word: write {variable} == {part.bare}")
        self.source.variable(part.bare)  # raises, naming the nearest

    def _number(self, part: _Part) -> None:
        self._check_name(part)
        if part.kind == "text":
            hint = _unquoted(part) or ": compare it by == or !="
            _refuse(part, f"is text{hint}")

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


def _unquoted(part: _Part) -> str:
    """Return a hint where a word in quotation marks is a number with a unit."""
    if part.variable or measure(part.word) is None:
        return ""
    return f": write {part.word} without quotation marks"


def _short(text: str) -> str:
    return one_line(text, SHOWN)


def _refuse(part: _Part, why: str) -> NoReturn:
    raise InputError(f"'{_short(part.text)}' {why}")
