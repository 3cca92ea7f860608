"""The options of `hpcwhirl campaign`, which a file's table [campaign] may hold, too."""

from __future__ import annotations

import argparse
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hpcwhirl.campaign.plan.design import Design, load_design
from hpcwhirl.campaign.policy import (
    CHECKS,
    MOST_ON_PAGE,
    OPTIONS,
    WAYS,
    Policy,
    options_of,
    retries,
    with_rules,
)
from hpcwhirl.campaign.stop import parse_walltime, time_left
from hpcwhirl.cli.options import add_explain, add_json, add_set
from hpcwhirl.errors import InputError
from hpcwhirl.launch import parse_shard


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument(
        "file", nargs="?", type=Path, metavar="FILE.toml",
        help="campaign; without one, the embedded default; with --extend also the "
        "directory of one",
    )  # fmt: skip
    parser.add_argument(
        "--out", type=Path, metavar="DIR",
        help="directory of the campaign (default campaign); an old one is continued. "
        f"In a file's [campaign], too: {', '.join([*OPTIONS, *CHECKS])}",
    )  # fmt: skip
    add_set(parser)
    parser.add_argument(
        "--dry-run", action="store_true", help="cases and predicted core-hours only"
    )
    _add_ends(parser)
    parser.add_argument(
        "--extend",
        choices=("undecided",),
        help="let cases that are undecided go on, in DIR or in the campaign of FILE",
    )
    parser.add_argument(
        "--to", type=float, metavar="SECONDS", help="engine time of --extend, at most"
    )
    parser.add_argument(
        "--shard",
        metavar="I/N",
        help="only the I-th of N shares, as an element of an array job; the last ends "
        "with the results of all",
    )
    parser.add_argument(
        "--regimes-only",
        action="store_true",
        help="words alone: traces = summary, and a case ends as its word is certain",
    )
    parser.add_argument(
        "--report",
        choices=WAYS,
        help=f"report.html beside the map: auto up to {MOST_ON_PAGE} cases",
    )
    add_explain(parser)
    add_json(parser)


def _add_ends(parser: argparse.ArgumentParser) -> None:
    """Declare what ends a campaign or a case, and what begins again."""
    parser.add_argument(
        "--retry", action="append", default=[], metavar="STATUS",
        help="compute cases of this status again: failed, timeout, crashed, or several "
        "by commas; also those whose traces are damaged",
    )  # fmt: skip
    parser.add_argument(
        "--fresh", action="store_true",
        help="start over; an old directory is renamed to DIR.1, DIR.2, ...",
    )  # fmt: skip
    parser.add_argument(
        "--take-over", action="store_true",
        help="take DIR from a run on another machine that is dead for certain; without "
        "it, that counts as dead 2 minutes after its last sign of life",
    )  # fmt: skip
    parser.add_argument(
        "--walltime", metavar="HH:MM:SS",
        help="stop, resumable, shortly before this call has taken so long",
    )  # fmt: skip
    parser.add_argument(
        "--patience", type=float, metavar="SECONDS",
        help="time for all ranks to stop once asked to (default 30); then the job ends "
        "with exit code 75 without those that hang, and all that was finished is kept",
    )  # fmt: skip
    parser.add_argument(
        "--case-limit", type=float, metavar="SECONDS",
        help="computing time after which a case is given up, status timeout",
    )  # fmt: skip
    fails = parser.add_mutually_exclusive_group()
    fails.add_argument(
        "--max-fails", type=int, metavar="N",
        help="end, exit code 1, once N cases gave no result on this call",
    )  # fmt: skip
    fails.add_argument(
        "--fail-fast", dest="max_fails", action="store_const", const=1,
        help="end at the first case without a result",
    )  # fmt: skip
    parser.add_argument(
        "--keep-states", action="store_true", default=None,
        help="keep the last states of undecided cases, from which --extend goes on",
    )  # fmt: skip
    parser.add_argument(
        "--isolate", action="store_true", default=None,
        help="each case in a process of its own: what crashes is a row",
    )  # fmt: skip


DEFAULTS = {"out": "campaign", "report": "auto"}


def fill(args: argparse.Namespace, rules: Mapping[str, Any]) -> None:
    """Take options that were not given from the table [campaign], or their defaults."""
    for name, value in (DEFAULTS | options_of(rules)).items():
        if getattr(args, name) in (None, []):
            setattr(args, name, value)
    args.out = Path(args.out)


def extension(args: argparse.Namespace) -> float | None:
    """Return to what undecided cases are to go on, s; None: no longer than they do.

    Raises
    ------
    InputError
        where one of --extend and --to stands alone, or the time is none
    """
    if (args.extend is None) != (args.to is None):
        msg = "--extend undecided and --to SECONDS belong together"
        raise InputError(msg)
    if args.to is not None and not 0.0 < args.to < math.inf:
        msg = f"--to must be a number of seconds > 0, got {args.to}"
        raise InputError(msg)
    return None if args.to is None else float(args.to)


def design_of_call(args: argparse.Namespace, settings: Mapping[str, Any]) -> Design:
    """Return the design of the file, of the directory to extend, or the embedded one.

    Raises
    ------
    InputError
        where a directory comes with what only a file may
    """
    if args.file is None or not args.file.is_dir():
        return load_design(args.file, settings)
    if args.extend is None:
        msg = f"cannot read {args.file}, a directory: without --extend, name the "
        msg += "campaign's file"
        raise InputError(msg)
    clash = [name for name, value in (("--set, --preset or --regimes-only", settings),
             ("--out", args.out), ("--fresh", args.fresh)) if value]  # fmt: skip
    if clash:
        msg = f"{clash[0]} cannot stand with the directory {args.file}: its inputs stay"
        raise InputError(msg)
    from hpcwhirl.campaign.resume import planned

    args.out = args.file
    return planned(args.file)


def policy_of(args: argparse.Namespace, design: Design) -> Policy:
    """Return the rules of this call; options count before the table [campaign]."""
    walltime = parse_walltime(args.walltime) if args.walltime else None
    policy = Policy(
        retry=retries(args.retry),
        seconds=time_left(walltime),
        shard=parse_shard(args.shard) if args.shard is not None else None,
    )
    if design.grows and policy.shard:
        msg = "--shard and [refine]: what a shard is to compute follows from the words "
        raise InputError(msg + "of all cases; one job of more ranks does the same")
    names = ("case_limit", "max_fails", "isolate", "patience", "keep_states")
    given = {n: getattr(args, n) for n in names if getattr(args, n) is not None}
    return with_rules(with_rules(policy, design.rules), given)
