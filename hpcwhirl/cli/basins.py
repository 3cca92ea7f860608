"""`hpcwhirl basins`: share of starts that end on each motion, by point of the sweep."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hpcwhirl.cli.command import add_option
from hpcwhirl.cli.options import OR_FILE
from hpcwhirl.cli.tables import add_format, in_units, print_data, print_table, unit_of
from hpcwhirl.errors import cases_told
from hpcwhirl.scene.words import NO_END

if TYPE_CHECKING:
    import xarray

NUMBERS = (
    "count", "share", "share_low", "share_high", "orbit_radius", "line_frequency",
)  # fmt: skip
COUNTS = ("count", "cases", "lost")  # numbers of starts; results have energies `lost`


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of `hpcwhirl basins` on its parser."""
    # fmt: off
    parser.add_argument("folder", type=Path, metavar="DIR", help=OR_FILE)
    add_option(parser, "--by WHAT",
        "what distinguishes motions: regime (default), or attractor: sustained and "
        "divergent motions also by orbit radius, line, whirl, energy and growth rate",
        default="regime")
    add_option(parser, "--at NAME=V[,V]",
        "only cases with this value of a swept input", default=[])
    add_option(parser, "--box N",
        "starts along each side of a box, for the basin entropy of a grid of starts "
        "(default 5)", default=5)
    add_option(parser, "--out DIR",
        "directory for the figures (default: directory of the results)", type=Path)
    add_format(parser)


def run(args: argparse.Namespace) -> int:
    """Print the share of starts that end on each motion, and draw these shares.

    The table has a row for each point of the sweep and motion; returns the exit code.
    """
    from hpcwhirl.report.figures.coexisting import draw_fractions
    from hpcwhirl.store.hdf5 import reading
    from hpcwhirl.store.reading.reader import open_results
    from hpcwhirl.store.reading.results_file import results_of
    from hpcwhirl.store.reading.select import chosen
    from hpcwhirl.studies.basins import basins

    place = results_of(args.folder)
    with open_results(place) as results, reading(place):
        data = chosen(results, args.at)
        found = basins(data, args.by, args.box)
        paths = draw_fractions(data, found, args.out or place.parent)
        columns = columns_of(found)
        units = {n: "" if n in COUNTS else unit_of(data, n) for n in columns}
    columns, units = in_units(args, columns, units)
    figures = [str(path) for path in paths]
    facts = {"starts": found.attrs["starts"].split(), "figures": figures}
    if not print_data(args, columns, units, "basins", **facts):
        print_table(columns, units, len(columns["count"]))
        print(summary(found))
        if lost := int(found["lost"].sum()):
            print(f"lost: {cases_told(lost)} without a result, failed or unstable, "
                  "which no share includes")  # fmt: skip
        print(*figures, sep="\n")
    return 0


def columns_of(found: xarray.Dataset) -> dict[str, Any]:
    """Return the printed table of shares of starts, {column: (rows,)}.

    It has a row for each point of the sweep and motion.

    A point has rows only for the attractors that occur there, but for every regime that
    occurs at any point, since a share of zero is a result, too.

    found : result of the analysis `basins`
    """
    from hpcwhirl.studies.shares import swept_in

    by = "regime" if "regime" in found.dims else "attractor"
    table = found.drop_dims("case").to_dataframe(dim_order=["point", by]).reset_index()
    occurs = table["count"] > 0
    if by == "regime":
        occurs = occurs.groupby(table[by]).transform("any")
    rest = [str(n) for n, v in found.data_vars.items() if v.dims == ("point",)]
    names = [*swept_in(found), by, *(n for n in NUMBERS if n in found), *rest]
    return {name: table.loc[occurs, name].to_numpy() for name in names}


def summary(found: xarray.Dataset) -> str:
    """Return a sentence on how many points of the sweep have several motions.

    At such a point some starts end on one motion, some on another; where an undecided
    or an overloaded one would have ended is not known.

    found : result of the analysis `basins`
    """
    from hpcwhirl.store.reading.shares import interval

    along = str(found["count"].dims[1])
    motions = found["count"].where(~found[along].isin(NO_END), 0)
    several = int(((motions > 0).sum(along) > 1).sum())
    points = found.sizes["point"]
    share, low, high = interval(several, points)
    by = "regimes" if "regime" in found.dims else "attractors"
    text = f"starts: {found.attrs['starts'].replace(' ', ', ')}; points with several "
    return f"{text}{by}: {several} of {points}, {share:.2f} [{low:.2f}, {high:.2f}]"
