"""Write the pages of the site that are made from the program itself.

    python scripts/docs/reference.py DIR

DIR/reference gets: a page of all inputs and one for each; a page of all commands with
their options; one of the public Python names, which mkdocstrings fills from their
docstrings; and the gallery of the files of jobs/, with the pictures and times that
scripts/pictures/gallery.py has made.
"""

from __future__ import annotations

import importlib
import json
import sys
from argparse import ArgumentParser
from pathlib import Path
from typing import Any

import hpcwhirl
from hpcwhirl.cli import COMMANDS
from hpcwhirl.scene.catalogue import InputFact, catalogue, design_tables

sys.path.insert(0, str(Path(__file__).parents[1]))
from common import TOP, parser_of, table

MANUAL = TOP / "hpcwhirl/manual"
MADE = TOP / ".pictures/gallery/made.json"
WIDE = 100  # characters in a line of a command's help
LONGEST = 40  # lines of a job's file that the gallery shows


def main() -> None:
    """Write all pages into the directory that the command line names."""
    parser = parser_of(__doc__)
    parser.add_argument("folder", type=Path, metavar="DIR")
    place = parser.parse_args().folder / "reference"
    for name, text in (*inputs(), commands(), python(), gallery()):
        page = place / f"{name}.md"
        page.parent.mkdir(parents=True, exist_ok=True)
        page.write_text(text, "utf-8")


def inputs() -> list[tuple[str, str]]:
    """Return (name, text) of the page of all inputs, and of one for each of them."""
    by_table: dict[str, list[tuple[str, InputFact]]] = {}
    for name, fact in catalogue().items():
        by_table.setdefault(fact.table, []).append((name, fact))
    lines = ["# Inputs", "", "The tables of a scene, then those of a campaign's file."]
    for name, facts in by_table.items():
        rows = [
            (f"[{f.name}](inputs/{full}.md)", _default(f), f.unit, f.meaning)
            for full, f in facts
        ]
        lines += ["", f"## [{name}]", "", *_table(rows)]
    for name, keys in design_tables().items():
        rows = [(f"`{k.name}`", _default(k), k.unit, k.meaning) for k in keys]
        lines += ["", f"## [{name}] of a campaign", "", *_table(rows)]
    pages = [(f"inputs/{full}", _input(full, f)) for full, f in catalogue().items()]
    return [("inputs", "\n".join(lines) + "\n"), *pages]


def _table(rows: list[tuple[str, ...]]) -> list[str]:
    cells = [[cell.replace("|", "\\|") for cell in row] for row in rows]
    return table(("name", "default", "unit", "meaning"), cells)


def _default(fact: InputFact) -> str:
    return "" if fact.default is None else f"`{json.dumps(fact.default)}`"


def _input(full: str, fact: InputFact) -> str:
    """Return the page of one input."""
    value = json.dumps(fact.default) if fact.default is not None else '"…"'
    lines = [f"# {full}", "", _sentence(fact.meaning), ""]
    rows = [("table", f"`[{fact.table}]`"), ("default", _default(fact) or "none"),
            ("unit", fact.unit or "none"), ("allowed", fact.allowed)]  # fmt: skip
    head, *rest = ([a, b.replace("|", "\\|")] for a, b in rows if b)
    lines += table(head, rest)
    if fact.rules:
        lines += ["", _sentence(fact.rules)]
    unit = f"  # {fact.unit}" if fact.unit not in ("", "1") else ""
    lines += ["", "```toml", f"[{fact.table}]", f"{fact.name} = {value}{unit}", "```"]
    pages = _explained(fact.name)
    if pages:
        links = ", ".join(f"[{p}](../../hpcwhirl/manual/{p}.md)" for p in pages)
        lines += ["", f"Explained in: {links}."]
    return "\n".join(lines) + "\n"


def _sentence(text: str) -> str:
    """Return a text that begins with a capital and ends with a full stop."""
    text = text[:1].upper() + text[1:]
    return text if text.endswith(".") else f"{text}."


def _explained(name: str) -> list[str]:
    """Return the pages of the manual that name an input as code, up to four."""
    counts = {
        path.stem: path.read_text("utf-8").count(f"`{name}")
        for path in sorted(MANUAL.glob("*.md"))
        if not path.stem.startswith("changes")
    }
    return sorted((p for p in counts if counts[p]), key=lambda p: -counts[p])[:4]


def commands() -> tuple[str, str]:
    """Return name and text of the page of all commands, from their arguments."""
    lines = ["# Commands", ""]
    lines += table(
        ("command", "does"),
        [[f"[{n}](#{n})", told] for n, told in COMMANDS.items()],
    )
    for name, told in COMMANDS.items():
        module: Any = importlib.import_module(f"hpcwhirl.cli.{name.replace('-', '_')}")
        parser = ArgumentParser(prog=f"hpcwhirl {name}")
        module.arguments(parser)
        lines += ["", f"## {name}", "", _sentence(told), ""]
        lines += ["```text", parser.format_help().rstrip(), "```"]
    return "commands", "\n".join(lines) + "\n"


def python() -> tuple[str, str]:
    """Return name and text of the page of public names, as mkdocstrings reads it."""
    lines = ["# Python", ""]
    for name in hpcwhirl.__all__:
        if not name.startswith("_"):
            thing = getattr(hpcwhirl, name)
            home = getattr(thing, "__module__", None) or f"hpcwhirl.{name}"
            lines += [f"::: {home}.{name}", "    options:",
                      f"        heading: hpcwhirl.{name}", ""]  # fmt: skip
    return "python", "\n".join(lines) + "\n"


def gallery() -> tuple[str, str]:
    """Return name and text of the gallery: each file of jobs/ with picture and time."""
    made = json.loads(MADE.read_text("utf-8")) if MADE.is_file() else {}
    lines = ["# Gallery", "", "The campaigns of `jobs/`, each with its command."]
    for path in sorted((TOP / "jobs").glob("*.toml")):
        lines += ["", f"## {path.stem}", ""]
        known = made.get(path.stem)
        if known:
            lines += [f"![{path.stem}](../.pictures/gallery/{path.stem}.png)", ""]
        command = known["command"] if known else f"hpcwhirl campaign jobs/{path.name}"
        took = f", {known['seconds']:.0f} s of one core" if known else ""
        lines += [f"`{command}`{took}: [file](../jobs/{path.name})", ""]
        shown = path.read_text("utf-8").rstrip().splitlines()
        more = (
            [f"# … {len(shown) - LONGEST} more lines"] if len(shown) > LONGEST else []
        )
        lines += ["```toml", *shown[:LONGEST], *more, "```"]
    return "gallery", "\n".join(lines) + "\n"


if __name__ == "__main__":
    main()
