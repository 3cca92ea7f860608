"""Catalogue of all inputs and campaign keys, which `hpcwhirl inputs` prints.

It has the default, unit, allowed values and meaning of each, derived from the fields of
`scene.inputs.Scene` and of the classes in `scene.campaign_tables`.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, Literal, get_args, get_origin

from pydantic_core import PydanticUndefined

from hpcwhirl.errors import InputError, unknown
from hpcwhirl.scene.campaign_tables import TABLES
from hpcwhirl.scene.input_names import OTHERWISE, Value, stands_for
from hpcwhirl.scene.quantities import INPUTS, LEAVES
from hpcwhirl.scene.swept import KEYS as SWEPT
from hpcwhirl.scene.table_model import Key, OwnRatio, key_of

SIGNS = (("gt", "> "), ("ge", ">= "), ("le", "<= "), ("lt", "< "))
KINDS = {"int": "whole number", "float": "number", "str": "text"}
INPUT = "<input>"  # key that stands for the name of any input
SHORTEST = 3  # smallest number of letters of a word searched for in meanings
OWN_RATIO = get_args(OwnRatio)[-1]  # validator that marks fields of this type


@dataclass(frozen=True)
class InputFact:
    """What users are told of one input of a scene, or key of a campaign's table.

    Attributes
    ----------
    name : name of the input or key in its table
    table : dotted name of that table in TOML files
    default : default value; None: no default
    unit : unit, "" for none
    meaning : explanation without the unit
    allowed : text on the allowed values
    rules : further explanation, such as rules between inputs, or ""
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
    """Return {dotted name: `InputFact`} of every input, in the order of the tables."""
    return {name: _fact(name, field) for name, field in LEAVES}


@cache
def design_tables() -> dict[str, list[InputFact]]:
    """Return {table: its keys} of tables that only a campaign's file has.

    In [sweep], [zip], [[cases]] and [sample], the key `<input>` is that of any input.
    """
    found = {table: [_told(table, INPUT, told)] for table, told in SWEPT.items()}
    for table, model in TABLES.items():
        found[table] = [
            _told(
                table, INPUT if name == "laws" else name, key_of(field), field.default
            )
            for name, field in model.model_fields.items()
        ]
    return found


def _told(table: str, name: str, told: Key, default: Any = None) -> InputFact:
    none = default in (PydanticUndefined, frozenset(), {})
    default = None if none else default
    return InputFact(name, table, default, "", told.meaning, told.allowed, "")


def find_inputs(word: str, besides: Iterable[str] = ()) -> list[InputFact]:
    """Return the inputs that `hpcwhirl inputs WORD` prints.

    They are those in a table, or with a name, `word`; if there is none, those whose
    meaning contains it.

    Parameters
    ----------
    word : name of a table or input, dotted or not, or a word of a meaning
    besides : further names that the error message may suggest

    Raises
    ------
    InputError
        if the word names no input, with an explanation or the nearest known name
    """
    facts = catalogue()
    inside = [f for f in facts.values() if word in _names_of_table(f.table)]
    named = [f for name, f in facts.items() if f".{name}".endswith(f".{word}")]
    if inside or named:
        return inside or named
    mentioned = _by_meaning(word)
    if mentioned:
        return mentioned
    if word.lower() in OTHERWISE:
        raise InputError(f"no input is named '{word}': {OTHERWISE[word.lower()]}")
    if hint := stands_for(word):
        raise InputError(f"no input is named '{word}'{hint}")
    tables = {n for f in facts.values() for n in _names_of_table(f.table)}
    known = {f.name for f in facts.values()} | tables | set(besides)
    raise unknown("input, table or preset", word, known)


def _by_meaning(word: str) -> list[InputFact]:
    """Return the inputs whose meaning contains a word, else those whose rules do."""
    if word.lower() in OTHERWISE or len(word) < SHORTEST:
        return []
    wanted = re.compile(rf"\b{re.escape(word)}s?\b", re.IGNORECASE)
    facts = catalogue().values()
    return [fact for fact in facts if wanted.search(fact.meaning)] or [
        fact for fact in facts if wanted.search(fact.rules)
    ]


def _names_of_table(table: str) -> tuple[str, str, str]:
    """Return the names by which a user may ask for a table of inputs.

    They are such as "engine.rotor", "rotor" and "[engine.rotor]".
    """
    return table, table.rpartition(".")[2], f"[{table}]"


def _fact(name: str, field: Any) -> InputFact:
    table, _, leaf = name.rpartition(".")
    quantity = INPUTS[name]
    default = list(field.default) if isinstance(field.default, tuple) else field.default
    unit = "" if quantity.unit == "1" else quantity.unit
    meaning, rules = quantity.meaning, quantity.rules
    return InputFact(
        leaf, table or "scene", default, unit, meaning, _allowed(field), rules
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
