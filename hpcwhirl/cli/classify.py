"""`hpcwhirl classify`: classify the stored cases again with other thresholds."""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

from hpcwhirl.analysis.regimes import MotionThresholds, Thresholds, all_thresholds
from hpcwhirl.analysis.rules import motions_by_table, words_by_table
from hpcwhirl.cli.command import add_option
from hpcwhirl.cli.options import OF_CAMPAIGN, add_json, add_take_over, print_json
from hpcwhirl.errors import InputError, say, unknown
from hpcwhirl.planner.planner import OK
from hpcwhirl.scene.words import word_of

Words = tuple[str, ...]
Changes = Mapping[tuple[Words, Words], int]


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of `hpcwhirl classify` on its parser."""
    # fmt: off
    parser.add_argument("folder", type=Path, metavar="DIR", help=OF_CAMPAIGN)
    known = "; ".join(
        f"{f.name}={f.default:g}, {f.metadata['meaning']}"
        for kind in (Thresholds, MotionThresholds)
        for f in fields(kind)
    )
    add_option(parser, "--set NAME=VALUE",
        f"set a threshold; may be repeated; defaults and meanings: {known}",
        default=[], dest="settings")
    add_option(parser, "--write",
        "with --set: write the new words into results.h5 and draw its map again; "
        "without --write they are only shown")
    add_take_over(parser)
    add_json(parser)


def thresholds_of(settings: list[str]) -> dict[str, float]:
    """Return all thresholds by name, with those that --set changes.

    settings : texts ``NAME=VALUE`` of --set; other thresholds have their defaults

    Raises
    ------
    InputError
        for an unknown name, or a value that is no finite number >= 0
    """
    changes = all_thresholds()
    known = [*changes]
    for text in settings:
        name, _, raw = text.partition("=")
        if name not in known:
            raise unknown("threshold", name, known)
        try:
            changes[name] = float(raw)
        except ValueError:
            msg = f"threshold {name} must be a number >= 0, got '{raw}'"
            raise InputError(msg) from None
        if not 0.0 <= changes[name] < float("inf"):
            raise InputError(f"threshold {name} must be a number >= 0, got '{raw}'")
    return changes


def run(args: argparse.Namespace) -> int:
    """Derive the words of every case again from stored evidence; print the changes.

    They are written, unless other thresholds are given without --write. Returns the
    exit code
    """
    from hpcwhirl.report.map.maps import refresh
    from hpcwhirl.store.directory.campaign_directory import Directory
    from hpcwhirl.store.directory.owner import Asking
    from hpcwhirl.store.reading.results_file import count_statuses
    from hpcwhirl.store.results.relabel import compared, relabel

    words = thresholds_of(args.settings)
    directory = Directory(args.folder)
    asking = Asking(args.take_over, say)

    def named(numbers: dict[str, Any]) -> tuple[Any, ...]:
        found = words_by_table(numbers, words)
        if "exponent" not in numbers:
            return found
        return *found, motions_by_table(found[1], numbers, words)

    if args.settings and not args.write:
        changes, told = compared(directory, named), ["nothing is written: --write does"]
        drawn = list[Path]()
    else:
        changes = relabel(directory, named, words, asking)
        drawn, told = refresh(directory, changed=any(o != n for o, n in changes))
    facts = _facts(changes, count_statuses(directory.results))
    facts |= {"thresholds": words, "drawn again": [str(path) for path in drawn]}
    for line in told:
        say(line)
    if args.json:
        print_json(facts)
        return 0
    for name, value in facts.items():
        print(f"{name}: {_told(value)}")
    return 0


def _facts(changes: Changes, statuses: Mapping[str, int]) -> dict[str, Any]:
    """Return numbers of cases by their new words, and of those that have changed.

    Parameters
    ----------
    changes : {(old words, new words): number of cases}, of the cases with a result
    statuses : {status: number of cases}; cases without a result keep their word
    """
    counts, whirls, motions = (Counter[str]() for _ in range(3))
    moved, turned = Counter[str](), Counter[str]()
    for (old, new), count in changes.items():
        was, now = (word_of(OK, outcome, regime) for outcome, regime, *_ in (old, new))
        counts[now] += count
        whirls[new[2]] += count
        moved[f"{was} -> {now}"] += count * (was != now)
        turned[f"{old[2]} -> {new[2]}"] += count * (old[2] != new[2])
        for before, after in zip(old[3:], new[3:], strict=True):
            motions[after] += count
            turned[f"{before} -> {after}"] += count * (before != after)
    for status, count in statuses.items():
        counts[word_of(status, "none", "none")] += count * (status != OK)
    return {
        "cases": sum(statuses.values()),
        "words": dict(+counts),
        "whirls": dict(whirls),
        **({"motions": dict(motions)} if motions else {}),
        "changed": dict(moved + turned),
    }


def _told(value: Any) -> str:
    """Return a fact as text: the entries of a table or list are joined by commas."""
    if isinstance(value, dict):
        value = [f"{name} {number}" for name, number in value.items()]
    return (", ".join(value) or "none") if isinstance(value, list) else str(value)
