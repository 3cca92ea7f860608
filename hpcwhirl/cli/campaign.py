"""`hpcwhirl campaign`: integrate all cases on all MPI ranks, write results and map."""

from __future__ import annotations

import argparse
import shlex
import time
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hpcwhirl.campaign.plan.design import Design
from hpcwhirl.campaign.stop import Stopping
from hpcwhirl.cli import options
from hpcwhirl.cli.campaign_options import arguments, prepared_of
from hpcwhirl.cli.command import tell_error, tell_failure
from hpcwhirl.errors import (
    COMPLETE,
    FAILED,
    STOPPED,
    WRONG_INPUT,
    InputError,
    NoRoomError,
    WhirlError,
    cases_told,
    say,
)
from hpcwhirl.launch import communicator
from hpcwhirl.scene.campaign_tables import MOST_ON_PAGE
from hpcwhirl.store.directory.manifest import NAME as PLAN

if TYPE_CHECKING:
    from hpcwhirl.campaign.begin import Prepared
    from hpcwhirl.campaign.run import Session
    from hpcwhirl.scene.campaign_tables import Campaign
    from hpcwhirl.store.directory.campaign_directory import Directory

__all__ = ["arguments", "run"]


def run(args: argparse.Namespace) -> int:
    """Run or continue a campaign on all MPI ranks; return the exit code.

    With --dry-run only rank 0 works, and prints a forecast; a signal ends it at once.
    """
    with Stopping() as stopping:  # until the end: a signal must not interrupt gathering
        from hpcwhirl.campaign.run import Session

        comm, code = communicator(), FAILED
        with Session(comm, stopping, partial(_broken, args)) as session:
            prepare = partial(prepared_of, args, comm.size)
            if args.dry_run:
                stopping.step_aside()
                found = session.on_root(lambda: _predict(args, session, prepare()))
            else:
                conclude = partial(_conclude, args, session)
                found = session.run(prepare, conclude, begun=_tell_inputs)
            if isinstance(found, WhirlError):
                found = _refused(args, found, root=comm.rank == 0)
            code = found
        if comm.size > 1:
            # When one rank exits with 75, srun may send TERM to the others: ignore it,
            # so that they exit with 75, too.
            stopping.ignore()
    return code if session.code is None else session.code


def _broken(args: argparse.Namespace, session: Session, failed: BaseException) -> int:
    """Print the error that broke off this rank's work; return the exit code.

    All ranks exit with this code.

    session, failed : this run of the command; the exception
    """
    if isinstance(failed, NoRoomError):
        _tell_stopped(session.directory or args.out, str(failed))
        return STOPPED
    if isinstance(failed, WhirlError):
        tell_error(failed)
        return WRONG_INPUT
    if isinstance(failed, Exception):
        return tell_failure(failed)
    raise failed


def _predict(args: argparse.Namespace, session: Session, prepared: Prepared) -> int:
    """Print the forecast of --dry-run, then warnings on inputs; return exit code 0.

    If the directory was begun with other inputs, a line says so, and the forecast is
    that of a new directory beside it.

    session, prepared : invocation of the campaign; the campaign and its options
    """
    from hpcwhirl.campaign.begin import check_begun
    from hpcwhirl.campaign.foresight.growth import foretold

    if not prepared.fresh:
        mends = "failed" in prepared.policy.retry
        try:
            check_begun(prepared.design, prepared.directory.plan, mends=mends)
        except InputError as failed:
            say(f"{failed}; the forecast is that of a new directory")
            prepared = prepared._replace(directory=_beside(prepared.directory))
    code = _foretell(args, session, prepared)
    _tell_inputs(prepared.design)
    for line in foretold(prepared.design):
        say(line)
    return code


def _beside(directory: Directory) -> Directory:
    """Return a directory that does not exist, on the same file system as another."""
    from hpcwhirl.store.directory.campaign_directory import Directory

    path, number = directory.path, 1
    while path.with_name(f"{path.name}.new-{number}").exists():
        number += 1
    return Directory(path.with_name(f"{path.name}.new-{number}"))


def _foretell(args: argparse.Namespace, session: Session, prepared: Prepared) -> int:
    """Print a forecast of what the cases left will cost; return exit code 0.

    It is learned from the cases that have ended, if there are any.

    session, prepared : this run of the command; the campaign and its options
    """
    from hpcwhirl.campaign.begin import extended_by
    from hpcwhirl.campaign.foresight.forecast import age, forecast
    from hpcwhirl.cli.forecast import tell

    design, directory, policy, _, extend = prepared
    times = extended_by(design, directory.plan, extend)
    loaded = age() - (time.monotonic() - session.stopping.began)
    cost = forecast(design, directory, policy.shard, times, args.started, loaded)
    tell(cost, design, args.ranks, as_json=args.json)
    return COMPLETE


def _refused(args: argparse.Namespace, failure: WhirlError, *, root: bool) -> int:
    """Print on rank 0 why the campaign could not begin; return the exit code.

    failure, root : error of the preparation; whether this process is rank 0
    """
    from hpcwhirl.store.directory.owner import BrokenOffError

    stopped = isinstance(failure, BrokenOffError | NoRoomError)
    if root and stopped:
        _tell_stopped(args.out, str(failure))
    elif root:
        tell_error(failure)
    return STOPPED if stopped else WRONG_INPUT


def _tell_inputs(design: Design) -> None:
    """Print warnings on inputs that look wrong, such as a wrong unit.

    This comes after all checks, so that an error is the only line printed.
    """
    options.tell_remarks(design.columns, load=True)


def _conclude(
    args: argparse.Namespace, session: Session, ending: Any, prepared: Prepared
) -> int:
    """Print how a campaign's run ended, draw map and page; return the exit code.

    After a pilot, the forecast for the cases left is printed instead.

    session, ending : this run of the command; how it ended
    prepared : the campaign and its options
    """
    if ending.piloted and not ending.complete:
        return _foretell(args, session, prepared)
    if not ending.complete:
        return _conclude_early(args, ending)
    if ending.left:
        return _conclude_shard(args, ending)
    return _conclude_whole(args, ending, prepared)


def _conclude_early(args: argparse.Namespace, ending: Any) -> int:
    """Print why a campaign stopped before all cases had ended; return the exit code.

    ending : how the run ended
    """
    if ending.lasting:
        tell_error(f"{ending.reason}; finished cases are safe in {args.out}")
        return WRONG_INPUT
    _tell_stopped(args.out, ending.reason, moved=not Path(args.out, PLAN).exists())
    return FAILED if ending.gave_up else STOPPED


def _conclude_whole(args: argparse.Namespace, ending: Any, prepared: Prepared) -> int:
    """Draw map and page of a complete campaign, print paths; return the exit code.

    Failed cases are counted in a line on stderr.

    ending, prepared : how the run ended; the campaign and its options
    """
    from hpcwhirl.store.reading.results_file import has_contact

    if ending.failed:
        say(_failures(ending))
    if not has_contact(ending.results):
        say(options.UNTOUCHED)
    facts: dict[str, Any] = {"results": str(ending.results), "cases": ending.cases}
    facts["failed"] = ending.failed
    rules, directory = prepared.design.rules, prepared.directory
    maps = _maps(ending, directory, rules)
    facts["maps"] = [str(path) for path in maps]
    pages = _pages(ending, directory, rules)
    facts["report"] = str(pages[0]) if pages else None
    if args.json:
        options.print_json(facts)
    else:
        for path in (ending.results, *maps, *pages):
            print(path)
    return FAILED if ending.failed else COMPLETE


def _pages(ending: Any, directory: Directory, rules: Campaign) -> list[Path]:
    """Write a campaign's report.html if it is wanted, and missing or outdated.

    ending, rules : how the run ended; table [campaign], which may turn the page off

    Returns
    -------
    list of the page's path, also if it was not written again; empty if no page is
    wanted and none shows these results
    """
    from hpcwhirl.report.page.build import is_stale, write_page

    page, wanted = directory.page, "page" in rules.pictures(ending.cases)
    if not (wanted and ending.gathered) and page.exists() and not is_stale(directory):
        return [page]
    if wanted:
        if not ending.gathered:
            say("writing report.html, which is missing or of earlier results")
        return [write_page(directory)]
    how = shlex.join(["hpcwhirl", "report", str(directory)])
    if page.exists():
        say(f"report.html is of earlier results: {how}")
    elif rules.report == "auto":
        say(f"no report.html: {ending.cases} cases, more than {MOST_ON_PAGE}: {how}")
    return []


def _maps(ending: Any, directory: Directory, rules: Campaign) -> list[Path]:
    """Draw a campaign's map.png and map.svg if they are wanted; return their paths.

    They are not drawn again if they are newer than the results. One line on stderr says
    if no map is wanted but an older one is there, or if it cannot be drawn without
    options.

    ending, rules : how the run ended; table [campaign], which may turn the map off
    """
    out = directory.path
    files = [out / "map.png", out / "map.svg"]
    how = shlex.join(["hpcwhirl", "map", str(out)])
    if not ending.gathered and _is_after(ending.results, files):
        return files
    if "map" not in rules.pictures(ending.cases):
        if any(path.exists() for path in files):
            say(f"map.png and map.svg are of earlier results: {how}")
        return []
    if not ending.gathered:
        say("drawing map.png and map.svg, which are missing or of earlier results")
    from hpcwhirl.report.render_process import draw_in_process

    try:
        return draw_in_process(ending.results, out)
    except InputError as refused:
        say(f"no map: {refused}: {how} ...")
        return []


def _is_after(results: Path, paths: list[Path]) -> bool:
    """Return whether all given files exist and are no older than the results file.

    results, paths : results.h5; the files, such as map.png
    """
    try:
        oldest = min(path.stat().st_mtime_ns for path in paths)
        return oldest >= results.stat().st_mtime_ns
    except OSError:
        return False


def _tell_stopped(out: Directory | Path, reason: str, *, moved: bool = False) -> None:
    """Print that a campaign has stopped early, and what to do.

    out, reason : its directory; why it stopped, "" if that is not known
    moved : whether the directory is no longer there
    """
    why = f": {reason}" if reason else ""
    safe = f"finished cases are safe in {out}"
    then = "" if moved else f"; {safe}; the same command continues the campaign"
    say(f"stopped early{why}{then}")


def _failures(ending: Any) -> str:
    """Return a sentence on how many cases failed, and where the reasons are stored.

    ending : how the campaign's run ended
    """
    of = f"of {cases_told(ending.cases)}"
    alone = ending.failed - ending.of_twins
    parts = [f"{alone} {of} failed"] if alone else []
    if ending.of_twins:
        parts.append(f"twins of {ending.of_twins} {of} have no result")
    text = ", ".join(parts)
    if ending.missing:
        text += f", {ending.missing} of them without a row: the same command "
        text += "computes these"
    where = f"; see `message` in {ending.results}" if alone and ending.results else ""
    return text + where


def _conclude_shard(args: argparse.Namespace, ending: Any) -> int:
    """Print that this job's shard of the campaign is complete; return the exit code.

    A shard is the part of the cases that one of several jobs computes; others are not
    complete yet. The code is 0 unless a case of this shard has no result.

    ending : how the run ended
    """
    if ending.failed:
        say(_failures(ending))
    facts = {"shard": args.shard, "cases": ending.cases, "left": ending.left}
    if args.json:
        options.print_json(facts | {"failed": ending.failed, "results": None})
    else:
        print(
            f"shard {args.shard} is complete; {ending.left} of {ending.cases} cases "
            "are left to other shards, the last of which gathers"
        )
    return FAILED if ending.failed else COMPLETE
