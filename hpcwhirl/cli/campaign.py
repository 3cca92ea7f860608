"""`hpcwhirl campaign`: a whole design over MPI ranks, results and map."""

from __future__ import annotations

import argparse
import sys
import traceback
from dataclasses import asdict
from pathlib import Path
from typing import Any

from hpcwhirl.campaign.design import Design, load_design
from hpcwhirl.campaign.ranks import communicator
from hpcwhirl.cli.options import (
    add_explain,
    add_json,
    add_set,
    print_json,
    print_notes,
)
from hpcwhirl.errors import WhirlError
from hpcwhirl.scene import parse_setting

COMPLETE, FAILED, WRONG_INPUT, INTERNAL, STOPPED = 0, 1, 2, 70, 75


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument(
        "file", nargs="?", type=Path, metavar="FILE.toml",
        help="campaign; without one, the embedded default",
    )  # fmt: skip
    parser.add_argument(
        "--out", type=Path, default=Path("campaign"), metavar="DIR",
        help="directory of the campaign (default campaign); an old one is continued",
    )  # fmt: skip
    add_set(parser)
    parser.add_argument(
        "--dry-run", action="store_true", help="cases and predicted core-hours only"
    )
    parser.add_argument(
        "--retry",
        choices=["failed"],
        help="integrate failed cases again, and those whose traces are damaged",
    )
    parser.add_argument(
        "--lanes",
        choices=["auto", "yes", "no"],
        default="auto",
        help="batches of four cases to a kernel: auto where they pay",
    )
    parser.add_argument(
        "--regimes-only",
        action="store_true",
        help="words alone: traces = summary, and a case ends as its word is certain",
    )
    add_explain(parser)
    add_json(parser)


def run(args: argparse.Namespace) -> int:
    """Run or continue a campaign on this process or on all ranks."""
    comm = communicator()
    if comm is None:
        return _run(args, None)
    try:
        return _run(args, comm)
    except WhirlError as failed:
        print(f"hpcwhirl: error: {failed}", file=sys.stderr)
        code = WRONG_INPUT
    except Exception:  # noqa: BLE001 - told, then ended below
        traceback.print_exc()
        code = INTERNAL
    sys.stderr.flush()
    comm.Abort(code)  # one rank's error must not hang the others
    return code


def _run(args: argparse.Namespace, comm: Any) -> int:
    """Prepare on rank 0; share its error, so that one line is printed."""
    from hpcwhirl.campaign.run import run_campaign

    root = comm is None or comm.rank == 0
    design, failure = None, ""
    if root:
        try:
            design = _prepared(args)
        except WhirlError as failed:
            failure = str(failed)
    if comm is not None:
        design, failure = comm.bcast((design, failure), root=0)
    if failure:
        if root:
            print(f"hpcwhirl: error: {failure}", file=sys.stderr)
        return WRONG_INPUT
    if args.dry_run or design is None:
        return COMPLETE
    lanes = {"auto": None, "yes": True, "no": False}[args.lanes]
    ending = run_campaign(
        design, args.out, comm, retry=args.retry is not None, lanes=lanes
    )
    code = _conclude(args, ending) if root else COMPLETE
    return int(comm.bcast(code, root=0)) if comm is not None else code


def _prepared(args: argparse.Namespace) -> Design:
    from hpcwhirl.campaign.run import check_folder, prepare

    settings = dict(parse_setting(text) for text in args.settings)
    if args.regimes_only:
        settings |= {"output.traces": "summary", "solver.until": "certain"}
    design = load_design(args.file, settings)
    check_folder(args.out)
    if args.explain:
        _explain(design)
    if args.dry_run:
        _dry_run(args, design)
    else:
        prepare(design, args.out)
    return design


def _explain(design: Design) -> None:
    """Say on stderr what the plans of the cases leave out, each kind of plan once."""
    from hpcwhirl.reduction.explain import notes_of
    from hpcwhirl.reduction.model import model_of
    from hpcwhirl.reduction.plan import plan_of

    kinds: dict[tuple[int, bool], list[Any]] = {}
    for scene in design.cases:
        try:
            plan = plan_of(scene, model_of(scene))
        except WhirlError:  # it will fail as a row
            continue
        kinds.setdefault((plan.folds, plan.settles), []).append(scene)
    for scenes in kinds.values():
        print(f"{len(scenes)} cases, such as the first of them:", file=sys.stderr)
        notes = [asdict(note) for note in notes_of(scenes[0], model_of(scenes[0]))]
        print_notes(notes, sys.stderr)


def _dry_run(args: argparse.Namespace, design: Design) -> None:
    from hpcwhirl.campaign.run import predicted_steps, seconds_per_step

    steps = sum(predicted_steps(scene) for scene in design.cases)
    cost = seconds_per_step(design.cases[0]) if design.cases else 0.0
    facts = {
        "cases": len(design.cases),
        "swept": list(design.swept),
        "steps": steps,
        "microseconds_per_step": 1e6 * cost,
        "core_hours": steps * cost / 3600,
    }
    if args.json:
        print_json(facts)
        return
    print(f"{facts['cases']} cases over {', '.join(design.swept) or 'nothing'}")
    print(f"{steps:.4g} steps at {1e6 * cost:.2f} us (measured on the first case)")
    print(f"predicted: {facts['core_hours']:.3g} core-hours")


def _conclude(args: argparse.Namespace, ending: Any) -> int:
    from hpcwhirl.report.maps import draw_map

    if not ending.complete:
        print(
            f"hpcwhirl: stopped early; finished cases are safe in {args.out}; "
            "the same command continues",
            file=sys.stderr,
        )
        return STOPPED
    if ending.failed:
        print(
            f"hpcwhirl: {ending.failed} of {ending.cases} cases failed; see `message` "
            f"in {ending.results}",
            file=sys.stderr,
        )
    facts: dict[str, Any] = {"results": str(ending.results), "cases": ending.cases}
    facts["failed"] = ending.failed
    maps: list[Path] = []
    if ending.failed < ending.cases:
        maps = draw_map(ending.results, args.out)
    facts["maps"] = [str(path) for path in maps]
    if args.json:
        print_json(facts)
    else:
        for path in (ending.results, *maps):
            print(path)
    return FAILED if ending.failed else COMPLETE
