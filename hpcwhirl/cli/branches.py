"""`hpcwhirl branches`: list where sweeps up and down change their words."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hpcwhirl.cli.command import add_option
from hpcwhirl.cli.options import OR_FILE
from hpcwhirl.cli.tables import add_format, in_units, print_data, print_table

if TYPE_CHECKING:
    from hpcwhirl.analysis.branches import Fold


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of `hpcwhirl branches` on its parser."""
    # fmt: off
    parser.add_argument("folder", type=Path, metavar="DIR", help=OR_FILE)
    add_option(parser, "--at NAME=V[,V]",
        "only branches with this value of another swept input", default=[])
    add_format(parser)


def run(args: argparse.Namespace) -> int:
    """Print the changes of word along all branches, a row for each.

    A line below says at how many points branches have different words. Returns the exit
    code
    """
    from hpcwhirl.analysis.branches import branches_of, folds_of, words_apart
    from hpcwhirl.report.figures.kinds import cases_at
    from hpcwhirl.scene.quantities import INPUTS, variable_name
    from hpcwhirl.store.reading.results_file import Results

    with Results(args.folder) as results:
        only = cases_at(results, args.at) if args.at else None
        over, branches = branches_of(results, only)
        folds = [fold for branch in branches for fold in folds_of(branch)]
        apart, several = words_apart(branches)
    unit = "" if INPUTS[over].unit == "1" else INPUTS[over].unit
    columns = _columns(folds, [variable_name(n) for n in branches[0].others])
    units = dict.fromkeys(columns, "") | {"last": unit, "first": unit, "radius": "m"}
    columns, units = in_units(args, columns, units)
    facts = {"over": over, "differ": apart, "points": several}
    if not print_data(args, columns, units, "folds", **facts):
        if folds:
            print_table(columns, units, len(folds))
        else:
            print("no word changes along any branch")
        share = f", {apart / several:.0%}" if several else ""
        print(f"words of branches differ at {apart} of {several} points{share}")
    return 0


def _columns(folds: list[Fold], others: list[str]) -> dict[str, Any]:
    """Return the printed table of changes of word along branches, {column: (folds,)}.

    folds : the changes, see `analysis.branches.Fold`
    others : names of the inputs that have one value along a branch
    """
    rows = [list(fold.branch.others.values()) for fold in folds]
    out = {name: np.array([row[n] for row in rows]) for n, name in enumerate(others)}
    out["branch"] = np.array([fold.branch.name for fold in folds], dtype=str)
    for name in ("last", "first"):
        out[name] = np.array([getattr(fold, name) for fold in folds], dtype=float)
    for name in ("word", "following"):
        out[name] = np.array([getattr(fold, name) for fold in folds], dtype=str)
    out["radius"] = np.array([fold.radius for fold in folds], dtype=float)
    return out
