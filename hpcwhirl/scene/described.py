"""The signature and the help of `Scene`, from the catalogue of its inputs."""

from __future__ import annotations

import inspect
import textwrap
from functools import cache
from typing import Any, Literal, get_origin

from hpcwhirl.scene.catalogue import InputFact, catalogue
from hpcwhirl.scene.inputs import Scene
from hpcwhirl.scene.units import with_unit

WIDE = 80
HEAD = """All inputs of one case: engine, operating point, load, solver and output.

A number is in the unit given, or a text with another one: gap = "0.8 mm". Inputs of a
table are nested, as in a TOML file: Scene(engine={"rotor": {"blades": 18}}).

Raises
------
InputError
    in one line, on the first input that is unknown, wrong or breaks a rule

Parameters
----------
"""


@cache
def signature() -> inspect.Signature:
    """Return the signature of `Scene`: each input by name, with its default."""
    keyword = inspect.Parameter.KEYWORD_ONLY
    return inspect.Signature(
        [
            inspect.Parameter(
                name, keyword, default=_default(field), annotation=_kind(field)
            )
            for name, field in Scene.model_fields.items()
        ]
    )


def _default(field: Any) -> Any:
    value = field.default
    return value if isinstance(value, bool | int | float | str) else {}


def _kind(field: Any) -> Any:
    own = field.annotation
    if own is float:
        return float | str
    if get_origin(own) is Literal:
        return str
    return own if own in {int, str, bool} else dict


@cache
def described() -> str:
    """Return the docstring of `Scene`: its inputs, and the names of those inside."""
    facts = catalogue()
    own = [_lines(fact) for name, fact in facts.items() if "." not in name]
    tables = dict.fromkeys(n.rpartition(".")[0] for n in facts if "." in n)
    return HEAD + "\n".join([*own, *map(_table, tables)])


def _lines(fact: InputFact) -> str:
    default = f"{fact.default!r}"
    head = f"{fact.name} : {with_unit(fact.allowed, fact.unit)}; default {default}"
    told = "; ".join(part for part in (fact.meaning, fact.rules) if part)
    return "\n".join([head, *_indented(told)])


def _table(table: str) -> str:
    names = (n.rpartition(".") for n in catalogue() if "." in n)
    inside = ", ".join(name for part, _, name in names if part == table)
    told = f"{inside} (`hpcwhirl inputs {table}` explains them)"
    return "\n".join([f"{table} : table", *_indented(told)])


def _indented(text: str) -> list[str]:
    return textwrap.wrap(text, WIDE, initial_indent="    ", subsequent_indent="    ")
