"""`hpcwhirl branches`: list where sweeps up and down change their words."""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

from hpcwhirl.cli.command import add_option
from hpcwhirl.cli.options import OR_FILE
from hpcwhirl.cli.tables import add_format, in_units, print_data, print_table
from hpcwhirl.errors import number_told


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of `hpcwhirl branches` on its parser."""
    # fmt: off
    parser.add_argument("folder", type=Path, metavar="DIR", help=OR_FILE)
    add_option(parser, "--at NAME=V[,V]",
        "only branches with this value of another swept input", default=[])
    add_format(parser)


def run(args: argparse.Namespace) -> int:
    """Print the changes of word along all branches, a row for each.

    Lines below say how many of them are open, and at how many points branches have
    different words. Returns the exit code
    """
    from hpcwhirl.report.figures.kinds import cases_at
    from hpcwhirl.scene.quantities import INPUTS
    from hpcwhirl.store.reading.results_file import Results
    from hpcwhirl.studies.branches import branches_of, changes_along, count_differences

    with Results(args.folder) as results:
        only = cases_at(results, args.at) if args.at else None
        over, branches = branches_of(results, only)
        differ, several = count_differences(branches)
    unit = "" if INPUTS[over].unit == "1" else INPUTS[over].unit
    changes = changes_along(branches)
    columns = {name: np.array(values) for name, values in changes.items()}
    units = dict.fromkeys(columns, "") | {"last": unit, "first": unit, "radius": "m"}
    columns, units = in_units(args, columns, units)
    facts = {"over": over, "differ": differ, "points": several}
    if not print_data(args, columns, units, "changes", **facts):
        if changes["word"]:
            print_table(columns, units, len(changes["word"]))
        else:
            print("no word changes along any branch")
        if opened := changes["kind"].count("open"):
            told = f"{opened} of {number_told(len(changes['kind']), 'change')} open"
            print(f"{told}: a longer run decides whether the word changes there")
        share = f", {differ / several:.0%}" if several else ""
        print(f"words of branches differ at {differ} of {several} points{share}")
    return 0
