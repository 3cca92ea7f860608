"""Which cases of a campaign are refused, and which have a free motion that grows.

A case that its model forbids fails when its turn comes; the words of one whose free
motion grows tell of that growth as much as of contact: `--dry-run` says so beforehand.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from hpcwhirl.case.growth import stability_of
from hpcwhirl.case.speed import extremes
from hpcwhirl.errors import WhirlError, cases_told

if TYPE_CHECKING:
    from hpcwhirl.campaign.plan.design import Design
    from hpcwhirl.case.resolve import Case

MOST_CASES = 200  # number of cases looked at, evenly chosen from all
MOST_MODELS = 8  # number of models searched
MOST_CHECKED = 20  # number of cases checked, which take up to 0.6 s


def fastest_of(design: Design) -> float:
    """Return the highest |speed| at which a case of a campaign begins, rad/s."""
    speeds = design.settings.column("speed", design.base.speed).values
    return float(np.abs(np.asarray(speeds, dtype=float)).max())


def foretold(design: Design) -> list[str]:
    """Return lines on cases that are refused, and on those whose free motion grows."""
    return [*_refused_told(design), *_growing_told(design)]


def _refused_told(design: Design) -> list[str]:
    """Return a line on the cases that fail since their model forbids an input.

    It is [] if there is none among the at most `MOST_CHECKED` cases looked at.
    """
    count = len(design.settings)
    chosen = _evenly(count, MOST_CHECKED)
    reasons = list[str]()
    for number in chosen:
        try:
            design.resolved(number).check()
        except WhirlError as failed:
            reasons.append(f"case {number}: {failed}")
    if not reasons:
        return []
    of = _of(len(chosen), count)
    return [f"{len(reasons)} of {of} will be refused, the first {reasons[0]}"]


def _growing_told(design: Design) -> list[str]:
    """Return a line on the cases in which a free motion grows; [] if there are none.

    At most `MOST_CASES` cases of at most `MOST_MODELS` models are looked at.
    """
    count = len(design.settings)
    fastest, models = fastest_of(design), set[Any]()
    seen, speeds = 0, list[float]()
    for number in _evenly(count, MOST_CASES):
        try:
            case = design.resolved(number)
            models.add(case.model)
            if len(models) > MOST_MODELS:
                break
            grows = _grows(case, fastest)
        except WhirlError:
            continue
        seen += 1
        speeds += [abs(extremes(case.given)[1])] if grows else []
    if not speeds:
        return []
    span = " to ".join(dict.fromkeys(f"{s:.4g}" for s in (min(speeds), max(speeds))))
    line = (
        f"free motion grows by itself, without contact, in {len(speeds)} of "
        f"{_of(seen, count)}, at {span} rad/s: their words are not of contact alone; "
        "`hpcwhirl model` tells the bands of speed"
    )
    return [line]


def _evenly(count: int, most: int) -> list[int]:
    """Return at most `most` numbers of cases, the first and the last included."""
    chosen = np.linspace(0, count - 1, min(count, most)).astype(int)
    return [int(number) for number in np.unique(chosen)]


def _of(seen: int, count: int) -> str:
    return cases_told(seen) if seen == count else f"{seen} cases looked at"


def _grows(case: Case, fastest: float) -> bool:
    """Return whether a free motion grows at a speed of a case.

    fastest : rad/s, highest speed of the campaign
    """
    low, high = sorted(map(abs, extremes(case.given)))
    found = stability_of(case.model, max(fastest, high))
    bands = found.bands if found else ()
    return any(band.start <= high and low <= band.end for band in bands)
