"""`hpcwhirl campaign`: a whole design over MPI ranks, results and map."""

from __future__ import annotations

import argparse
import shlex
import sys
import time
from collections.abc import Mapping
from contextlib import ExitStack
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from hpcwhirl.campaign.patience import Patience
from hpcwhirl.campaign.plan.design import Design
from hpcwhirl.campaign.plan.sampling import as_begun
from hpcwhirl.campaign.policy import (
    MOST_ON_PAGE,
    PATIENCE,
    Policy,
)
from hpcwhirl.campaign.stop import Stopping
from hpcwhirl.cli.campaign_options import (
    arguments,
    design_of_call,
    extension,
    fill,
    policy_of,
)
from hpcwhirl.cli.command import (
    COMPLETE,
    FAILED,
    STOPPED,
    WRONG_INPUT,
    tell_error,
    tell_failure,
)
from hpcwhirl.cli.options import (
    UNTOUCHED,
    parsed,
    print_json,
    print_notes,
    tell_preset,
    tell_remarks,
)
from hpcwhirl.errors import InputError, NoRoomError, WhirlError
from hpcwhirl.launch import Communicator, communicator
from hpcwhirl.scene import load_document

__all__ = ["arguments", "run"]


def run(args: argparse.Namespace) -> int:
    """Run or continue a campaign on this process or on all ranks."""
    args.began = time.monotonic()
    with Stopping() as stopping:  # to the end: a warning must not kill the gathering
        comm = communicator()
        with Patience(stopping, PATIENCE, comm) as args.patience_of:
            code = _guarded(args, comm, stopping)
        if comm.size > 1:
            # Where a rank exits with 75, srun may send TERM to those that have not yet:
            # they are to end with 75, too.
            stopping.ignore()
    return code


def _guarded(args: argparse.Namespace, comm: Communicator, stopping: Stopping) -> int:
    """Run; where one of several ranks fails, end all of them."""
    try:
        return _run(args, comm, stopping)
    except NoRoomError as full:
        _tell_stopped(args, str(full))
        code = STOPPED
    except WhirlError as failed:
        tell_error(failed)
        code = WRONG_INPUT
    except Exception as failed:  # noqa: BLE001 - told, then ended below
        code = tell_failure(failed)
    sys.stderr.flush()
    comm.Abort(code)  # one rank's error must not hang the others
    return code


def _run(args: argparse.Namespace, comm: Communicator, stopping: Stopping) -> int:
    """Prepare on rank 0; share its error, so that one line is printed."""
    from hpcwhirl.campaign.run import run_campaign

    root = comm.rank == 0
    design, policy, failure, own = None, None, None, None
    with ExitStack() as stack:
        if root:
            try:
                design, policy = _prepared(args, comm.size, stopping)
                own = _owned(args, design, policy, stopping, stack)
            except WhirlError as failed:
                failure = failed
        told = (design, policy, failure, args.out)
        design, policy, failure, args.out = comm.bcast(told, root=0)
        if failure is not None:
            return _refused(args, failure, root=root)
        if args.dry_run or design is None or policy is None:
            return COMPLETE
        args.patience_of.seconds = policy.patience
        if own is not None:
            args.patience_of.last = own.release
        if policy.seconds is not None:  # the wall-time began with the command
            spent = time.monotonic() - args.began
            policy = replace(policy, seconds=policy.seconds - spent)
        ending = run_campaign(design, args.out, comm, policy, stopping, own)
        code = _conclude(args, ending) if root else COMPLETE
        return int(comm.bcast(code, root=0))


def _refused(args: argparse.Namespace, failure: WhirlError, *, root: bool) -> int:
    """Say on rank 0 why nothing is computed; return the exit code."""
    from hpcwhirl.store.directory.owner import BrokenOffError

    stopped = isinstance(failure, BrokenOffError | NoRoomError)
    if root and stopped:
        _tell_stopped(args, str(failure))
    elif root:
        tell_error(failure)
    return STOPPED if stopped else WRONG_INPUT


def _owned(
    args: argparse.Namespace,
    design: Design,
    policy: Policy,
    stopping: Stopping,
    stack: ExitStack,
) -> Any:
    """Claim the directory until the stack ends, and prepare it; None for a dry run."""
    from hpcwhirl.campaign.begin import Manner, begin

    own = None
    if not args.dry_run:
        manner = Manner(args.fresh, args.take_over, args.to)
        own = begin(design, args.out, policy, stopping, manner)
        stack.callback(own.release)
    tell_remarks(design.columns)  # of what is not refused: a mistake is one line
    return own


def _prepared(
    args: argparse.Namespace, ranks: int, stopping: Stopping
) -> tuple[Design, Policy]:
    from hpcwhirl.campaign.resume import check_folder, check_steps

    settings = parsed(args.settings)
    if args.regimes_only:
        settings |= _words_alone(args.file, settings)
    args.to = extension(args)
    design = design_of_call(args, settings)
    fill(args, design.rules)
    design = design if args.fresh else as_begun(design, args.out)
    policy = policy_of(args, design)
    if policy.shard and design.twins and design.twins.of == "boundary":
        msg = "[twins] of = boundary needs the words of all cases: no --shard"
        raise InputError(msg)
    check_folder(args.out)
    tell_preset(design.base)
    if args.explain:
        _explain(design)
    if args.dry_run:
        check_steps(design)
        from hpcwhirl.campaign.foresight.forecast import age, forecast
        from hpcwhirl.campaign.resume import extended_by
        from hpcwhirl.cli.dry_run import tell

        times = extended_by(design, args.out, args.to)
        loaded = age() - (time.monotonic() - args.began)
        found = forecast(design, args.out, policy.shard, times, stopping, loaded)
        tell(found, design, ranks, as_json=args.json)
    return design, policy


def _words_alone(file: Path | None, settings: Mapping[str, Any]) -> dict[str, str]:
    """Return what --regimes-only sets: cases that are to be decided go on to be."""
    file = None if file is None or file.is_dir() else file
    solver = load_document(file).get("solver") if file else {}
    asked = solver.get("until") if isinstance(solver, Mapping) else None
    until = "solver.until"
    decided = settings.get(until, asked) == "decided"
    return {"output.traces": "summary", until: "decided" if decided else "certain"}


def _explain(design: Design) -> None:
    """Say on stderr what the plans of the cases leave out, each kind of plan once."""
    from hpcwhirl.case.explain import notes_of

    kinds: dict[tuple[int, bool], list[int]] = {}
    for case in range(len(design.settings)):
        try:
            plan = design.resolved(case).plan
        except WhirlError:  # it will fail as a row
            continue
        kinds.setdefault((plan.folds, plan.settles), []).append(case)
    for cases in kinds.values():
        print(f"{len(cases)} cases, such as the first of them:", file=sys.stderr)
        notes = [asdict(note) for note in notes_of(design.resolved(cases[0]))]
        print_notes(notes, sys.stderr)


def _conclude(args: argparse.Namespace, ending: Any) -> int:
    from hpcwhirl.store.reading.reader import has_contact

    if ending.lasting:
        tell_error(f"{ending.reason}; finished cases are safe in {args.out}")
        return WRONG_INPUT
    if not ending.complete:
        _tell_stopped(args, ending.reason)
        return FAILED if ending.gave_up else STOPPED
    if ending.left:
        return _conclude_shard(args, ending)
    if ending.failed:
        print(f"hpcwhirl: {_told(ending)}", file=sys.stderr)
    if not has_contact(ending.results):
        print(f"hpcwhirl: {UNTOUCHED}", file=sys.stderr)
    facts: dict[str, Any] = {"results": str(ending.results), "cases": ending.cases}
    facts["failed"] = ending.failed
    maps = _maps(ending, args.out)
    facts["maps"] = [str(path) for path in maps]
    pages = _pages(args, ending)
    facts["report"] = str(pages[0]) if pages else None
    if args.json:
        print_json(facts)
    else:
        for path in (ending.results, *maps, *pages):
            print(path)
    return FAILED if ending.failed else COMPLETE


def _pages(args: argparse.Namespace, ending: Any) -> list[Path]:
    """Return the page of a campaign that wants one, written if it is not there."""
    from hpcwhirl.report.page.build import NAME, is_stale, write_page

    wanted = {"auto": ending.cases <= MOST_ON_PAGE, "yes": True, "no": False}
    if args.report == "auto" and not wanted["auto"]:
        why = f"{ending.cases} cases, more than {MOST_ON_PAGE}"
        how = shlex.join(["hpcwhirl", "report", str(args.out)])
        print(f"hpcwhirl: no report.html: {why}: {how}", file=sys.stderr)
    if not wanted[args.report]:
        return []
    page = args.out / NAME
    if not ending.gathered and page.exists() and not is_stale(args.out):
        return [page]
    return [write_page(args.out)]


def _maps(ending: Any, out: Path) -> list[Path]:
    """Draw the map; where it must be told what to show, say so in one line.

    One that is there and no older than results which nothing has changed stays.
    """
    known = [out / "map.png", out / "map.svg"]
    if not ending.gathered and _is_after(ending.results, known):
        return known
    from hpcwhirl.report.apart import draw_apart

    try:
        return draw_apart(ending.results, out)
    except InputError as refused:
        print(f"hpcwhirl: no map: {refused}: hpcwhirl map {out} ...", file=sys.stderr)
        return []


def _is_after(results: Path, paths: list[Path]) -> bool:
    """Return whether all of these are there and no older than results."""
    try:
        made = min(path.stat().st_mtime_ns for path in paths)
        return made >= results.stat().st_mtime_ns
    except OSError:
        return False


def _tell_stopped(args: argparse.Namespace, reason: str) -> None:
    why = f": {reason}" if reason else ""
    print(
        f"hpcwhirl: stopped early{why}; finished cases are safe in {args.out}; "
        "the same command continues",
        file=sys.stderr,
    )


def _told(ending: Any) -> str:
    """Return how many cases failed, and how to find out why."""
    text = f"{ending.failed} of {ending.cases} cases failed"
    if ending.missing:
        text += f", {ending.missing} of them without a row: the same command "
        text += "computes those"
    return text + (f"; see `message` in {ending.results}" if ending.results else "")


def _conclude_shard(args: argparse.Namespace, ending: Any) -> int:
    """Tell that a shard is complete and others are not: they will gather.

    Cases that are left to others are no failure: an element of an array ends with 0
    unless one of its own has no result. The last one ends with 1 where any has none.
    """
    if ending.failed:
        print(f"hpcwhirl: {_told(ending)}", file=sys.stderr)
    facts = {"shard": args.shard, "cases": ending.cases, "left": ending.left}
    if args.json:
        print_json(facts | {"failed": ending.failed, "results": None})
    else:
        print(
            f"shard {args.shard} is complete; {ending.left} of {ending.cases} cases "
            "are left to other shards, the last of which gathers"
        )
    return FAILED if ending.failed else COMPLETE
