"""Conditions on named numbers and words, such as ``late_fed >= 0.8 * late_lost``.

One small language for rules and filters. A text is parsed into a tree and the tree is
walked; nothing is run as code. `report/page/expression.js` reads the same texts.

    or, and, not      == != < <= > >= (may be chained)      + - * /
    abs(x) min(x, y) max(x, y)      numbers, names, 'words'

A name that stands for no number or word is itself a word: ``regime == sustained``.
"""

from __future__ import annotations

import ast
import operator
from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

import numpy as np

from hpcwhirl.errors import InputError

Tree = tuple[Any, ...]
Asker = Callable[[Mapping[str, Any]], Any]
BINARY: dict[type, str] = {
    ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/",
    ast.Eq: "==", ast.NotEq: "!=", ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">",
    ast.GtE: ">=",
}  # fmt: skip


def _quotient(over: Any, under: Any) -> Any:
    with np.errstate(divide="ignore", invalid="ignore"):  # inf and nan, as elsewhere
        return np.divide(over, under)


MEANING: dict[str, Callable[..., Any]] = {
    "+": operator.add, "-": operator.sub, "*": operator.mul, "/": _quotient,
    "==": operator.eq, "!=": operator.ne, "<": operator.lt, "<=": operator.le,
    ">": operator.gt, ">=": operator.ge, "negative": operator.neg,
    "not": np.logical_not, "and": np.logical_and, "or": np.logical_or,
    "abs": np.abs, "min": np.minimum, "max": np.maximum,
}  # fmt: skip
FUNCTIONS = {"abs": 1, "min": 2, "max": 2}


@cache
def parse(text: str) -> Tree:
    """Return the tree of a condition: (operation, part, ...).

    Leaves are ("number", value), ("name", text) and ("word", text).

    Raises
    ------
    InputError
        where the text is no condition of this language
    """
    try:
        return _tree(ast.parse(text.strip(), mode="eval").body)
    except (SyntaxError, ValueError, RecursionError) as failed:
        msg = f"cannot read the condition {text!r}: {failed}"
        raise InputError(msg) from None


def _tree(node: ast.AST) -> Tree:
    leaf = _leaf(node)
    if leaf:
        return leaf
    match node:
        case ast.UnaryOp(ast.USub(), part):
            return "negative", _tree(part)
        case ast.UnaryOp(ast.Not(), part):
            return "not", _tree(part)
        case ast.BinOp(left, sign, right) if type(sign) in BINARY:
            return BINARY[type(sign)], _tree(left), _tree(right)
        case ast.Call(ast.Name(name), parts, []) if FUNCTIONS.get(name) == len(parts):
            return name, *map(_tree, parts)
    return _joined(node)


def _leaf(node: ast.AST) -> Tree | None:
    match node:
        case ast.Constant(int() | float() as value) if not isinstance(value, bool):
            return "number", float(value)
        case ast.Constant(str() as word):
            return "word", word
        case ast.Name(name):
            return "name", name
    return None


def _joined(node: ast.AST) -> Tree:
    match node:
        case ast.BoolOp(sign, parts):
            name = "and" if isinstance(sign, ast.And) else "or"
            return _fold(name, [_tree(part) for part in parts])
        case ast.Compare(left, signs, rights) if all(type(s) in BINARY for s in signs):
            sides = [_tree(left), *map(_tree, rights)]
            pairs = zip(signs, sides, sides[1:], strict=False)
            return _fold("and", [(BINARY[type(s)], a, b) for s, a, b in pairs])
    raise ValueError(_no_part(node))


def _no_part(node: ast.AST) -> str:
    return f"{ast.unparse(node)} is none of comparison, sum, product, abs, min, max"


def _fold(name: str, parts: list[Tree]) -> Tree:
    tree = parts[0]
    for part in parts[1:]:
        tree = (name, tree, part)
    return tree


def names_in(tree: Tree) -> set[str]:
    """Return the names that a tree asks for."""
    if tree[0] == "name":
        return {str(tree[1])}
    if tree[0] in {"number", "word"}:
        return set()
    return set().union(*(names_in(part) for part in tree[1:]))


def value_of(tree: Tree, known: Mapping[str, Any]) -> Any:
    """Return what a tree gives: a number or truth, or an array of them.

    Parameters
    ----------
    tree : of `parse`
    known : {name: number, word, truth, or array of one of them}
    """
    return _reader(tree)(known)


@cache
def asker(text: str) -> Asker:
    """Return what gives the value of a condition, see `value_of`, again and again."""
    return _reader(parse(text))


def _reader(tree: Tree) -> Asker:
    kind, first = tree[0], tree[1]
    if kind in {"number", "word"}:
        return lambda _: first
    if kind == "name":
        return lambda known: known.get(first, first)
    meaning, parts = MEANING[kind], [_reader(part) for part in tree[1:]]
    if len(parts) == 1:
        only = parts[0]
        return lambda known: meaning(only(known))
    left, right = parts
    return lambda known: meaning(left(known), right(known))
