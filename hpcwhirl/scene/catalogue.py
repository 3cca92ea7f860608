"""Every input as a reader looks it up: where it stands, default, unit, what is allowed.

All of it is read off the fields of `hpcwhirl.scene.inputs`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, Literal, get_args, get_origin

from hpcwhirl.errors import unknown
from hpcwhirl.scene.files import Value
from hpcwhirl.scene.inputs import OwnRatio
from hpcwhirl.scene.quantities import INPUTS, LEAVES

SIGNS = (("gt", "> "), ("ge", ">= "), ("le", "<= "), ("lt", "< "))
KINDS = {"int": "whole number", "float": "number", "str": "text"}
OWN_RATIO = get_args(OwnRatio)[-1]  # the check that such fields share


@dataclass(frozen=True)
class InputFact:
    """One input of a scene.

    Attributes
    ----------
    name : in its table
    table : of the TOML
    default : where a file does not say; None: there is none
    unit : "" for none
    meaning : without the unit
    allowed : values, each alone; rules between inputs are in `rules`
    rules : what else is to be known, or ""
    """

    name: str
    table: str
    default: Value | Mapping[str, float] | None
    unit: str
    meaning: str
    allowed: str
    rules: str


@cache
def catalogue() -> dict[str, InputFact]:
    """Return {dotted name: input} of every input, as the tables of a file have them."""
    return {name: _fact(name, field) for name, field in LEAVES}


def find_inputs(word: str, besides: Iterable[str] = ()) -> list[InputFact]:
    """Return the inputs that a word names: a whole table, or all with such an ending.

    Parameters
    ----------
    word : a name, dotted or not, of an input or a table
    besides : further names that may be meant where there is none

    Raises
    ------
    InputError
        where there is none, with the nearest known name
    """
    facts = catalogue()
    inside = [f for f in facts.values() if word in _names_of_table(f.table)]
    found = [f for name, f in facts.items() if f".{name}".endswith(f".{word}")]
    if inside or found:
        return inside or found
    tables = {n for f in facts.values() for n in _names_of_table(f.table)}
    known = {f.name for f in facts.values()} | tables | set(besides)
    raise unknown("input, table or preset", word, known)


def _names_of_table(table: str) -> tuple[str, str, str]:
    """Return what a table may be called: whole, its last part, in brackets."""
    return table, table.rpartition(".")[2], f"[{table}]"


def _fact(name: str, field: Any) -> InputFact:
    table, _, own = name.rpartition(".")
    told = INPUTS[name]
    default = list(field.default) if isinstance(field.default, tuple) else field.default
    unit = "" if told.unit == "1" else told.unit
    return InputFact(
        own, table or "scene", default, unit, told.meaning, _allowed(field), told.rules
    )


def _allowed(field: Any) -> str:
    kind = field.annotation
    if get_origin(kind) is Literal:
        return " | ".join(get_args(kind))
    if get_origin(kind) is tuple:
        return "[], or N numbers > -1"
    if OWN_RATIO in field.metadata:
        return ">= 0, or -1"
    limits = [
        f"{sign}{getattr(limit, name)}"
        for name, sign in SIGNS
        for limit in field.metadata
        if getattr(limit, name, None) is not None
    ]
    what = KINDS[kind.__name__]
    return f"{what} {' and '.join(limits)}".strip()
