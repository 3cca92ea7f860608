"""`hpcwhirl inputs`: list inputs with default, unit, allowed values and meaning."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from hpcwhirl.cli.options import add_json, print_json
from hpcwhirl.scene import named
from hpcwhirl.scene.catalogue import catalogue, design_tables, find_inputs
from hpcwhirl.scene.documents import DESIGN_TABLES
from hpcwhirl.scene.quantities import INPUTS

if TYPE_CHECKING:
    from hpcwhirl.scene.catalogue import InputFact

PRESET = "preset"
ENGINES = "engines"
TABLES = ("scene", "engine", "engine.casing", "engine.rotor", "solver", "output")
WIDE = 110  # characters in a line of a table if stdout is no terminal


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of `hpcwhirl inputs` on its parser."""
    parser.add_argument(
        "name", nargs="?", metavar="NAME",
        help="what to list (default: all inputs): an input, as gap or casing.damping; "
        f"a table, as solver or a campaign's table ({', '.join(DESIGN_TABLES)}); "
        "preset for all presets, or the name of one; engines for the built-in engines; "
        "or a word in the meanings of the inputs sought",
    )  # fmt: skip
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    """Print the inputs, presets or engines that the command's argument names."""
    if args.name == PRESET or args.name in named.preset_names():
        names = named.preset_names() if args.name == PRESET else [args.name]
        rows = [
            {"name": n, "inputs": named.preset_inputs(n), "loses": named.preset_loss(n)}
            for n in names
        ]
        lines = "--preset {name}\n  sets:  {inputs}\n  loses: {loses}"
        _tell_named("presets", rows, lines, as_json=args.json)
    elif args.name == ENGINES:
        names = named.engine_names()
        rows = [{"name": n, "inputs": named.engine_inputs(n),
                 "shows": named.engine_shows(n)} for n in names]  # fmt: skip
        lines = "hpcwhirl run {name}\n  shows: {shows}\n  is:    {inputs}"
        _tell_named("engines", rows, lines, as_json=args.json)
    else:
        _tell_inputs(_facts(args.name), as_json=args.json)
    return 0


def _facts(name: str | None) -> list[InputFact]:
    """Return default, unit, limits and meaning of inputs or keys of tables.

    name : name of an input or of a key; None: all inputs
    """
    if name is None:
        return sorted(catalogue().values(), key=lambda fact: TABLES.index(fact.table))
    designs = design_tables()
    if name.strip("[]") in designs and name not in INPUTS:
        return designs[name.strip("[]")]
    return find_inputs(name, (PRESET, *named.preset_names(), ENGINES, *designs))


def _tell_inputs(facts: Sequence[InputFact], *, as_json: bool) -> None:
    if as_json:
        print_json({"inputs": [asdict(fact) for fact in facts]})
    elif len(facts) == 1:
        _tell_one(facts[0])
    else:
        for table in (*TABLES, *design_tables()):
            _print_table(table, [fact for fact in facts if fact.table == table])


def _tell_one(fact: InputFact) -> None:
    print(f"{fact.name}, in [{fact.table}]: {fact.meaning}")
    if fact.rules:
        print(f"  {fact.rules}")
    unit = f" {fact.unit}" if fact.unit else ""
    if fact.default is not None:
        print(f"  default: {_plain(fact.default)}{unit}")
    print(f"  allowed: {fact.allowed}")


def _print_table(table: str, facts: Sequence[InputFact]) -> None:
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    if not facts:
        return
    shown = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0))
    for head in (f"[{table}]", "default", "unit", "allowed", "meaning"):
        shown.add_column(Text(head, style="bold"), overflow="fold")
    for fact in facts:
        meaning = "; ".join(part for part in (fact.meaning, fact.rules) if part)
        row = (fact.name, _plain(fact.default), fact.unit, fact.allowed, meaning)
        shown.add_row(*map(Text, row))
    console = Console(width=None if sys.stdout.isatty() else WIDE)
    console.print(shown)
    console.print()


def _plain(value: Any) -> str:
    """Return a default value as text in the form of a TOML file; "" for None."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, Mapping):
        pairs = (f"{name} = {_plain(item)}" for name, item in value.items())
        return f"{{{', '.join(pairs)}}}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(_plain, value))}]"
    if isinstance(value, str):
        return f'"{value}"'
    return f"{value:g}" if isinstance(value, float) else str(value)


def _tell_named(
    kind: str, rows: Sequence[dict[str, Any]], lines: str, *, as_json: bool
) -> None:
    """Print presets or engines: their names, and the inputs that each one sets.

    kind : "presets" or "engines", key of the list in JSON
    rows : {key: value} of each preset or engine
    lines : format of the text for each, with its keys in braces
    as_json : whether JSON is printed instead of text
    """
    if as_json:
        print_json({kind: rows})
        return
    for row in rows:
        inputs = ", ".join(f"{n} = {_plain(v)}" for n, v in row["inputs"].items())
        print(lines.format_map(row | {"inputs": inputs}))
