"""`hpcwhirl export`: one case as CSV, for MATLAB, or as a moving wheel for ParaView."""

from __future__ import annotations

import argparse
from pathlib import Path

from hpcwhirl.cli.options import OR_FILE, check_writable
from hpcwhirl.errors import InputError, say, shown

ENDINGS = ".csv", ".mat", ".pvd"


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of `hpcwhirl export` on its parser."""
    parser.add_argument("folder", type=Path, metavar="DIR", help=OR_FILE)
    parser.add_argument("case", type=int, metavar="CASE", help="number of the case")
    told = (
        "file to write; .csv: traces, a line a sample; .mat: traces, results and "
        "inputs for MATLAB; .pvd: the wheel over time for ParaView, from full traces"
    )
    parser.add_argument("out", type=Path, metavar="FILE", help=told)


def run(args: argparse.Namespace) -> int:
    """Write one case to a file, and return the exit code."""
    from hpcwhirl.report.export import WRITERS
    from hpcwhirl.store.reading.results_file import Results, results_of

    if args.out.suffix not in ENDINGS:
        msg = f"FILE must end in {', '.join(ENDINGS)}, got {shown(args.out.name)}"
        raise InputError(msg)
    check_writable(args.out, folder=False)
    with Results(results_of(args.folder)) as results:
        if not 0 <= args.case < len(results):
            msg = f"CASE must be >= 0 and <= {len(results) - 1}, got {args.case}"
            raise InputError(msg)
        say(str(WRITERS[args.out.suffix](results, args.case, args.out)))
    return 0
