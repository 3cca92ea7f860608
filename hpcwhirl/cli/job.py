"""`hpcwhirl job`: print or write a job script; predict the time that the job needs."""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hpcwhirl.cli.command import add_option
from hpcwhirl.cluster.request import PRINTED, Request, job_script, option_of
from hpcwhirl.cluster.schedulers import SCHEDULERS
from hpcwhirl.errors import InputError, MissingFileError, say
from hpcwhirl.safe_open import read_regular

if TYPE_CHECKING:
    from hpcwhirl.campaign.plan.design import Design

FIELDS = Request.__dataclass_fields__  # {name of an option: its field}
IN_FILE = {"out": "out", "time": "walltime"}  # option: key of [campaign], its default
PLACES = ("file", "out", "venv", "script")  # where ~ is the home directory


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of `hpcwhirl job` on its parser."""
    parser.add_argument(
        "scheduler", metavar="SCHEDULER", help=f"one of {', '.join(SCHEDULERS)}"
    )
    parser.add_argument("file", metavar="FILE.toml", help="campaign file")
    for name, field in FIELDS.items():
        if field.metadata:
            shape, meaning = field.metadata.values()
            usual: Any = [] if field.default == () else field.default
            default = None if name in IN_FILE else usual
            usage = f"{option_of(name)} {shape}"
            add_option(parser, usage, meaning, default=default, dest=name)
    parser.add_argument("--set", "--preset", dest="inputs", help=argparse.SUPPRESS)


def run(args: argparse.Namespace) -> int:
    """Print a job script, or write it to --script and print how to submit it.

    Returns the exit code
    """
    from hpcwhirl.campaign.plan.design import load_design
    from hpcwhirl.store.atomic import write_whole

    if args.inputs:
        msg = "job has no --set and --preset: write inputs in the file's [scene], "
        raise InputError(msg + "a preset in its [solver]")
    values = {name: getattr(args, name) for name in FIELDS}
    for name in PLACES:
        values[name] = values[name] and os.path.expanduser(values[name])  # noqa: PTH111
    # the job itself would fail for a wrong file only after waiting in the queue
    design = load_design(Path(values["file"]), {})
    if args.array or args.shard:
        design.check_shards("neither --array nor --shard")
    rules = design.rules
    for name, key in IN_FILE.items():
        if values[name] is None:
            place = rules.place(Path(values["file"]))
            default = place if name == "out" else FIELDS[name].default
            in_file = key in rules.model_fields_set
            values[name] = getattr(rules, key) if in_file else default
    values |= {name: tuple(getattr(args, name)) for name in ("modules", "constraint")}
    request = Request(**values)
    text = job_script(request)
    if request.script:
        _check_kept(Path(request.script))
    _predict(design, request)
    if not request.script:
        sys.stdout.write(text)
        return 0
    write_whole(Path(request.script), text.encode())
    print(f"{SCHEDULERS[request.scheduler].submit} {request.script}")
    return 0


def _predict(design: Design, request: Request) -> None:
    """Print on stderr the time that the campaign still needs, and the job's time limit.

    If no case has ended in the directory yet, not even in a pilot, the time is nominal:
    computed from the number of steps, not learned from cases.

    Raises
    ------
    InputError
        if no case of the campaign could be integrated, or its directory was begun with
        other inputs
    """
    from hpcwhirl.campaign.begin import as_begun, check_begun, check_steps
    from hpcwhirl.campaign.foresight.forecast import forecast
    from hpcwhirl.cli.forecast import job_line
    from hpcwhirl.launch import parse_shard
    from hpcwhirl.store.directory.campaign_directory import Directory

    directory = Directory(Path(request.out))
    check_steps(design)
    design = as_begun(design, directory.plan)
    check_begun(design, directory.plan)
    shard = parse_shard(request.shard) if request.shard else None
    cost = forecast(design, directory, shard)
    ranks = request.ntasks * (request.array or 1)
    say(job_line(cost, ranks, request))


def _check_kept(path: Path) -> None:
    """Raise InputError if --script names a file that must not be replaced.

    Only a job script of this command may be; path : the file
    """
    try:
        old = read_regular(path).decode() if path.exists() else PRINTED
    except (OSError, UnicodeDecodeError):
        old = ""
    if path.is_dir():
        raise MissingFileError(f"cannot write {path}: it is a directory")
    if PRINTED not in old:
        msg = f"--script {path}: this file exists, is no job script, and is kept"
        raise InputError(msg)
