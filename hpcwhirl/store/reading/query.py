"""Conditions on cases, such as ``regime == sustained and speed > 400``.

Python's grammar is parsed and a few of its nodes are worked out over columns; nothing
is evaluated as code.
"""

from __future__ import annotations

import ast
import operator
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.errors import InputError, unknown
from hpcwhirl.store.reading.select import SAME

Mask = NDArray[np.bool_]
LONGEST = 2000  # characters of a condition
DEEPEST = 50  # levels of its tree
ALLOWED = "and, or, not, comparisons, in, + - * /, numbers, words and names of the file"
ARITHMETIC: dict[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add, ast.Sub: operator.sub,
    ast.Mult: operator.mul, ast.Div: operator.truediv,
}  # fmt: skip
ORDER: dict[type[ast.cmpop], Callable[[Any, Any], Any]] = {
    ast.Lt: operator.lt, ast.LtE: operator.le,
    ast.Gt: operator.gt, ast.GtE: operator.ge,
}  # fmt: skip


@dataclass(frozen=True)
class Source:
    """Where the columns of a condition come from.

    Attributes
    ----------
    variable : name as written -> variable of the file, or raises InputError
    column : variable -> (cases,) of numbers or of text
    words : {variable: words that it may be}
    cases : how many there are
    """

    variable: Callable[[str], str]
    column: Callable[[str], NDArray[Any]]
    words: dict[str, Sequence[str]]
    cases: int


@dataclass(frozen=True)
class _Value:
    """A number, a column, or a word that is no name of the file."""

    data: Any
    name: str = ""
    word: bool = False

    @property
    def text(self) -> bool:
        return self.word or np.asarray(self.data).dtype.kind in "OUS"


def matching(text: str, source: Source) -> Mask:
    """Return which cases a condition holds for, (cases,).

    Raises
    ------
    InputError
        where it is no condition, or names something that there is not
    """
    if len(text) > LONGEST:
        msg = f"--where takes at most {LONGEST} characters, got {len(text)}"
        raise InputError(msg)
    try:
        tree = ast.parse(text.strip(), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError) as failed:
        msg = f"--where: cannot read '{text}': {getattr(failed, 'msg', failed)}"
        raise InputError(msg) from None
    with np.errstate(all="ignore"):
        return _truth(tree, source, 0)


def _refuse(node: ast.AST, why: str = "") -> InputError:
    part = ast.unparse(node)
    return InputError(
        f"--where: '{part}' {why or f'is not allowed; allowed: {ALLOWED}'}"
    )


def _truth(node: ast.expr, source: Source, depth: int) -> Mask:
    """Return what a condition or a part of one is in each case."""
    if depth > DEEPEST:
        raise _refuse(node, "is nested too deep")
    match node:
        case ast.BoolOp(op=ast.And(), values=parts):
            return _joined(np.logical_and, parts, source, depth)
        case ast.BoolOp(values=parts):
            return _joined(np.logical_or, parts, source, depth)
        case ast.UnaryOp(op=ast.Not(), operand=part):
            return np.asarray(~_truth(part, source, depth + 1))
        case ast.Compare(left=left, ops=ops, comparators=others):
            found = np.ones(source.cases, dtype=bool)
            for op, a, b in zip(ops, [left, *others], others, strict=False):
                found &= _compared(op, a, b, source)
            return found
    raise _refuse(node, "is no condition: compare it with something")


def _joined(join: np.ufunc, parts: list[ast.expr], source: Source, depth: int) -> Mask:
    """Return and or or of conditions."""
    found = np.stack([_truth(part, source, depth + 1) for part in parts])
    return np.asarray(join.reduce(found, axis=0))


def _compared(op: ast.cmpop, a: ast.expr, b: ast.expr, source: Source) -> Any:
    match op:
        case ast.In() | ast.NotIn():
            if not isinstance(b, ast.Tuple | ast.List | ast.Set):
                raise _refuse(b, "must be a list such as (damped, sustained)")
            each = [_equal(a, item, source) for item in b.elts]
            any_of = np.zeros(source.cases, dtype=bool)
            for one in each:
                any_of |= one
            return any_of if isinstance(op, ast.In) else ~any_of
        case ast.Eq():
            return _equal(a, b, source)
        case ast.NotEq():
            return ~_equal(a, b, source)
    if type(op) not in ORDER:
        raise _refuse(a, "cannot be compared so")
    left, right = (_value(side, source, 0) for side in (a, b))
    for side, node in ((left, a), (right, b)):
        _check_number(side, node, source)
    return ORDER[type(op)](left.data, right.data)


def _check_number(value: _Value, node: ast.expr, source: Source) -> None:
    if value.word:
        source.variable(str(value.data))  # raises, naming the nearest
    if value.text:
        raise _refuse(node, "is text: compare it by == or !=")


def _equal(a: ast.expr, b: ast.expr, source: Source) -> Any:
    left, right = _pair(a, b, source)
    if left.text != right.text or (left.word and right.word):
        for side in (left, right):
            if side.word:
                source.variable(str(side.data))  # raises, naming the nearest
        raise _refuse(b, f"cannot be equal to '{ast.unparse(a)}': one is text")
    for side, other in ((left, right), (right, left)):
        known = source.words.get(side.name, ())
        if known and other.word and other.data not in known:
            raise unknown(side.name, str(other.data), known)
    if left.text:
        return np.asarray(left.data == right.data)
    return np.isclose(left.data, right.data, rtol=SAME, atol=0.0)


def _pair(a: ast.expr, b: ast.expr, source: Source) -> tuple[_Value, _Value]:
    """Return both sides; beside an enumeration, its words are no variables."""
    left, right = _value(a, source, 0), _value(b, source, 0)
    if isinstance(b, ast.Name) and b.id in source.words.get(left.name, ()):
        right = _Value(b.id, word=True)
    elif isinstance(a, ast.Name) and a.id in source.words.get(right.name, ()):
        left = _Value(a.id, word=True)
    return left, right


def _value(node: ast.expr, source: Source, depth: int) -> _Value:
    """Return a number, a column or a word."""
    if depth > DEEPEST:
        raise _refuse(node, "is nested too deep")
    match node:
        case ast.Constant(value=bool()):
            raise _refuse(node)
        case ast.Constant(value=int() | float() as number):
            return _Value(float(number))
        case ast.Constant(value=str() as text):
            return _Value(text, word=True)
        case ast.Name() | ast.Attribute():
            return _named(ast.unparse(node), node, source)
        case ast.UnaryOp(op=ast.USub(), operand=part):
            return _Value(-_number(part, source, depth))
        case ast.BinOp(left=left, op=op, right=right) if type(op) in ARITHMETIC:
            a, b = (_number(side, source, depth) for side in (left, right))
            return _Value(ARITHMETIC[type(op)](a, b))
    raise _refuse(node)


def _number(node: ast.expr, source: Source, depth: int) -> Any:
    value = _value(node, source, depth + 1)
    _check_number(value, node, source)
    return np.asarray(value.data, dtype=float)


def _named(name: str, node: ast.expr, source: Source) -> _Value:
    """Return the column of a name, else the name as a word."""
    if any(not isinstance(n, ast.Name | ast.Attribute | ast.expr_context)
           for n in ast.walk(node)):  # fmt: skip
        raise _refuse(node)
    try:
        variable = source.variable(name)
    except InputError:
        return _Value(name, word=True)
    return _Value(source.column(variable), variable)
