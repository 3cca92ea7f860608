"""Options of `hpcwhirl campaign`, and preparation of a campaign from them.

Many options may also be set in the table [campaign] of the campaign's file, as keys.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, get_args, get_origin

from hpcwhirl.campaign.plan.design import Design, load_design
from hpcwhirl.cli.command import add_option
from hpcwhirl.cli.options import (
    add_explain,
    add_json,
    add_set,
    add_take_over,
    parsed,
    print_notes,
    tell_preset,
)
from hpcwhirl.cluster.request import MOST_TASKS
from hpcwhirl.errors import InputError, WhirlError
from hpcwhirl.launch import parse_shard
from hpcwhirl.scene import load_document
from hpcwhirl.scene.campaign_tables import Campaign
from hpcwhirl.scene.table_model import key_of, kind_of

if TYPE_CHECKING:
    from hpcwhirl.campaign.begin import Policy, Prepared

FIELDS = Campaign.model_fields
SHAPES = {"out": "DIR", "retry": "STATUS", "walltime": "HH:MM:SS"}


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of `hpcwhirl campaign` on its parser."""
    # fmt: off
    parser.add_argument(
        "file", nargs="?", type=Path, metavar="FILE.toml",
        help="campaign file; without one, the built-in default campaign; with --extend "
        "also the directory of a campaign; its table [campaign] may set the options "
        f"{', '.join(FIELDS)}, which the command line overrides",
    )
    add_set(parser)
    before = parser.add_mutually_exclusive_group()
    add_option(before, "--dry-run",
        "compute nothing; print the number of cases and the predicted time, core-hours "
        "and disk space: nominal, or learned from the cases that have ended in the "
        "directory")
    add_option(before, "--pilot SECONDS",
        "compute for this number of seconds, keep the results, and predict the rest "
        "from them; the same command without --pilot computes the rest", type=float)
    add_option(parser, "--ranks N",
        "with --dry-run or --pilot: predict the wall time on N ranks (default: the "
        "number that runs this command)", type=int)
    fails = parser.add_mutually_exclusive_group()
    for name, field in FIELDS.items():
        _add_option(fails if name == "max_fails" else parser, name, field)
    add_option(fails, "--fail-fast",
        "end at the first case without a result, like --max-fails 1",
        const=1, dest="max_fails", action="store_const")
    add_option(parser, "--fresh",
        "start over; an existing directory is renamed to DIR.1, DIR.2, ...")
    add_take_over(parser)
    parser.add_argument(
        "--extend",
        choices=("undecided",),
        help="continue the undecided cases of the directory, up to the time --to",
    )
    add_option(parser, "--to SECONDS",
        "simulated time at which --extend ends a case, at the latest", type=float)
    add_option(parser, "--shard I/N",
        "compute only the I-th of N shares of the cases, as one element of an array "
        "job; the last share to finish gathers all results")
    add_option(parser, "--regimes-only",
        "keep no traces, and end each case as soon as its regime is certain")
    add_explain(parser)
    add_json(parser)


def option(name: str) -> str:
    """Return the option that sets a key of [campaign], such as --case-limit.

    name : the key, such as "case_limit"
    """
    return f"--{name.replace('_', '-')}"


def number(text: str) -> float:
    """Return the number that a text is; a whole one as an int, to be told as it is."""
    value = float(text)
    return int(text) if text.strip().lstrip("+-").isdigit() else value


def _add_option(parser: Any, name: str, field: Any) -> None:
    """Add the option that sets a key of [campaign]; its value is None if not used.

    name, field : the key; its field in the class `Campaign`, which has default and help
    """
    kind, key = kind_of(field), key_of(field)
    meaning = key.meaning
    if field.default and kind is not bool:
        meaning += f" (default {field.default})"
    how: dict[str, Any] = {"default": None, "help": meaning}
    if kind is bool:
        how["action"] = "store_true"
    elif get_origin(kind) is Literal:
        how["choices"] = get_args(kind)
    else:
        how["metavar"] = SHAPES.get(name, "N" if kind is int else "SECONDS")
        how |= {"action": "append"} if get_origin(kind) is frozenset else {}
        how |= {"type": {int: int, float: number}[kind]} if kind in {int, float} else {}
    parser.add_argument(option(name), **how)


def rules_of(args: argparse.Namespace, table: Campaign) -> Campaign:
    """Return the keys of [campaign] with the options of the command line applied.

    The option --out is not applied.

    table : the table in the campaign's file
    """
    options = {name: getattr(args, name) for name in FIELDS.keys() - {"out"}}
    given = {name: value for name, value in options.items() if value is not None}
    return table.with_options(Campaign.read(given, "options", option))


def _extension(args: argparse.Namespace) -> float | None:
    """Return the time, s, to which undecided cases are extended; None: no extension.

    Raises
    ------
    InputError
        if only one of --extend and --to is used, or the time is not positive and finite
    """
    if (args.extend is None) != (args.to is None):
        raise InputError("--extend undecided and --to SECONDS belong together")
    if args.to is not None and not 0.0 < args.to < math.inf:
        raise InputError(f"--to must be a number of seconds > 0, got {args.to:g}")
    return None if args.to is None else float(args.to)


def _ranks_foreseen(args: argparse.Namespace, ranks: int) -> int:
    """Return the number of ranks for which the time is predicted.

    It is that of --ranks, or else `ranks`, the number of this run.

    Raises
    ------
    InputError
        for --ranks without a prediction, or less than 1
    """
    if args.ranks is None:
        return ranks
    if not args.dry_run and args.pilot is None:
        raise InputError(
            f"--ranks needs --dry-run or --pilot; mpirun -n {args.ranks} starts ranks"
        )
    if not 1 <= args.ranks <= MOST_TASKS:
        raise InputError(f"--ranks must be >= 1 and <= {MOST_TASKS}, got {args.ranks}")
    return int(args.ranks)


def _design_of_call(args: argparse.Namespace, settings: Mapping[str, Any]) -> Design:
    """Return the campaign's design: all that determines its cases.

    It is read from the campaign's file, or from the directory that --extend continues;
    without either it is the default design.

    settings : {input: value} of --set and --preset

    Raises
    ------
    InputError
        for a directory without --extend, or with options that only a file allows
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
        msg = f"{clash[0]} cannot go with the directory {args.file}: inputs stay"
        raise InputError(msg)
    from hpcwhirl.campaign.begin import planned
    from hpcwhirl.store.directory.manifest import PlanFile

    args.out = args.file
    return planned(PlanFile(args.file))


def _policy_of(args: argparse.Namespace, design: Design, rules: Campaign) -> Policy:
    """Return how this run computes the cases: time limits, shard, pilot.

    Parameters
    ----------
    args, design : options of the command line; design of the campaign
    rules : keys of [campaign] with the options applied

    Raises
    ------
    InputError
        for a shard of a campaign whose cases depend on words of other shards, or a
        pilot of a time that is not positive and finite
    """
    from hpcwhirl.campaign.begin import Policy

    shard = parse_shard(args.shard) if args.shard is not None else None
    if shard:
        design.check_shards("no --shard")
    if args.pilot is not None and not 0.0 < args.pilot < math.inf:
        raise InputError(f"--pilot must be a number of seconds > 0, got {args.pilot:g}")
    return Policy.of(rules, shard, take_over=args.take_over, pilot=args.pilot)


def prepared_of(args: argparse.Namespace, ranks: int) -> Prepared:
    """Return a campaign that is ready to run: design, directory and options, checked.

    Rank 0 calls it, and sends the result to all ranks.

    ranks : number of ranks of this run
    """
    from hpcwhirl.campaign.begin import Prepared, as_begun, check_steps
    from hpcwhirl.store.directory.campaign_directory import Directory

    settings = parsed(args.settings)
    if args.regimes_only:
        settings |= _words_alone(args.file, settings)
    args.to = _extension(args)
    args.ranks = _ranks_foreseen(args, ranks)
    design = _design_of_call(args, settings)
    rules = rules_of(args, design.rules)
    args.out = Path(args.out or rules.place(args.file))
    directory = Directory(args.out)
    design = design if args.fresh else as_begun(design, directory.plan)
    design = replace(design, rules=rules)
    policy = _policy_of(args, design, rules)
    directory.check_usable()
    tell_preset(design.base)
    if args.explain:
        _explain(design)
    if args.dry_run:
        check_steps(design)
    args.started = None
    if args.pilot is not None:
        from hpcwhirl.campaign.foresight.forecast import age

        args.started = age()
    return Prepared(design, directory, policy, args.fresh, args.to)


def _words_alone(file: Path | None, settings: Mapping[str, Any]) -> dict[str, str]:
    """Return the inputs that --regimes-only sets, {input: value}.

    No traces are kept, and a case ends when its word is certain; ``until = decided`` is
    kept if the campaign sets it.

    file, settings : campaign file, None for the default; {input: value} of --set
    """
    file = None if file is None or file.is_dir() else file
    solver = load_document(file).get("solver") if file else {}
    asked = solver.get("until") if isinstance(solver, Mapping) else None
    until = "solver.until"
    decided = settings.get(until, asked) == "decided"
    return {"output.traces": "summary", until: "decided" if decided else "certain"}


def _explain(design: Design) -> None:
    """Print on stderr what the integration of the cases leaves out, each kind once.

    Such are sectors that move alike, or steps without contact.
    """
    from hpcwhirl.case.explain import notes_of

    kinds: dict[tuple[int, bool], list[int]] = {}
    for case in range(len(design.settings)):
        try:
            plan = design.resolved(case).plan
        except WhirlError:  # this case gets a row with status failed
            continue
        kinds.setdefault((plan.folds, plan.settles), []).append(case)
    for cases in kinds.values():
        print(f"{len(cases)} cases like case {cases[0]}:", file=sys.stderr)
        print_notes(notes_of(design.resolved(cases[0])), sys.stderr)
