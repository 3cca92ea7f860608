"""Chooses the presets from a measured trade-off and writes what each loses.

    hpcwhirl tradeoff --out DIR
    python scripts/evidence/presets.py DIR [--write]

Candidates are the combinations of accuracy and truncation. A preset is the cheapest of
them whose words are all those of the reference and whose median error, the worst number
of each scene, is at most that of `RULES`; `reference` is the most accurate. Prints the
choice, and with --write replaces hpcwhirl/scene/presets.toml, where a preset whose
inputs are others tells of the trade-off's engines alone: preset_map.py and
evidence/estimates.py, both with --write, add to it.
"""

from __future__ import annotations

import argparse
import json
import tomllib
from pathlib import Path
from typing import Any

import tomli_w

import hpcwhirl.scene
from hpcwhirl.errors import InputError
from hpcwhirl.report.figures.pareto import COLUMNS, percent

RULES = {"draft": 0.2, "standard": 0.008}  # largest median error
FIXED = {"plan": "lean", "scheme": "modal"}
PATH = Path(hpcwhirl.scene.__file__).parent / "presets.toml"
TOLD = ("orbit_radius", "contact_impulse", "blade_peak")
BOTH = {"accuracy", "truncation"}  # inputs of a candidate


Row = dict[str, Any]


def candidates(facts: dict[str, Any]) -> list[tuple[Row, dict[str, float]]]:
    """Return rows with all words right, and their inputs, the cheapest first."""
    rows = [row for row in facts["rows"] if row["inputs"].keys() >= BOTH]
    right = [row for row in rows if row["agree"] == row["runs"] and not row["refused"]]
    return [(row, {name: row["inputs"][name] for name in sorted(BOTH)})
            for row in sorted(right, key=lambda row: row["cost"])]  # fmt: skip


def chosen(facts: dict[str, Any]) -> dict[str, tuple[Row, dict[str, float]]]:
    """Return {preset: (what was measured, inputs)}."""
    found, out = candidates(facts), {}
    for name, most in RULES.items():
        fine = [pair for pair in found if pair[0]["score"] <= most]
        if not fine:
            msg = f"no combination is as accurate as {name} asks ({most:g})"
            raise InputError(msg)
        out[name] = fine[0]
    out["reference"] = min(found, key=lambda pair: pair[0]["score"])
    return out


def loss(row: Row, facts: dict[str, Any]) -> str:
    """Return what a preset costs and loses, in a sentence."""
    errors = ", ".join(
        f"{COLUMNS[n]} {percent(row['errors'][n]['median']['value'])} "
        f"({percent(row['errors'][n]['largest'])})"
        for n in TOLD
    )
    return (
        f"{row['cost']:.2g} times the time of the default inputs; on the engine "
        f"four_motions and one other words as a finer reference in {row['agree']} of "
        f"{row['runs']} runs; median (largest) error over {len(facts['cases'])} scenes "
        f"of it: {errors}"
    )


def write(table: dict[str, Any]) -> None:
    """Replace the presets of the package."""
    head = "# Written by scripts/evidence/presets.py from a measured trade-off.\n"
    PATH.write_text(head + tomli_w.dumps(table))


def main() -> int:
    """Choose, print, write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--write", action="store_true")
    args = parser.parse_args()
    facts = json.loads((args.folder / "tradeoff.json").read_text())
    table = tomllib.loads(PATH.read_text())
    for name, (row, own) in chosen(facts).items():
        print(f"{name}: {row['label']}: {loss(row, facts)}")
        anew = {"inputs": {**own, **FIXED}, "loses": loss(row, facts)}
        same = table[name]["inputs"] == anew["inputs"]
        table[name] = (table[name] if same else {}) | anew
    if args.write:
        write(table)
        print(PATH)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
