"""Which cases of a campaign have a free motion that grows, without contact.

Their words tell of that growth as much as of contact: `--dry-run` says so beforehand.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from hpcwhirl.case.growth import stability_of
from hpcwhirl.case.speed import extremes
from hpcwhirl.errors import WhirlError

if TYPE_CHECKING:
    from hpcwhirl.campaign.plan.design import Design
    from hpcwhirl.case.resolve import Case

MOST_CASES = 200  # number of cases looked at, evenly chosen from all
MOST_MODELS = 8  # number of models searched


def fastest_of(design: Design) -> float:
    """Return the highest |speed| at which a case of a campaign begins, rad/s."""
    speeds = design.settings.column("speed", design.base.speed).values
    return float(np.abs(np.asarray(speeds, dtype=float)).max())


def growing_told(design: Design) -> str:
    """Return a line on the cases in which a free motion grows; "" if there are none.

    At most `MOST_CASES` cases of at most `MOST_MODELS` models are looked at.
    """
    count = len(design.settings)
    chosen = np.unique(np.linspace(0, count - 1, min(count, MOST_CASES)).astype(int))
    fastest, models = fastest_of(design), set[Any]()
    seen, speeds = 0, []
    for number in chosen.tolist():
        try:
            case = design.resolved(number)
            models.add(case.model)
            if len(models) > MOST_MODELS:
                break
            grows = _grows(case, fastest)
        except WhirlError:  # it gets a row with status failed
            continue
        seen += 1
        speeds += [abs(extremes(case.given)[1])] if grows else []
    if not speeds:
        return ""
    span = " to ".join(dict.fromkeys(f"{s:.4g}" for s in (min(speeds), max(speeds))))
    of = f"{seen} cases" if seen == count else f"{seen} cases looked at"
    return (
        f"free motion grows by itself, without contact, in {len(speeds)} of {of}, at "
        f"{span} rad/s: their words are not of contact alone; `hpcwhirl model` tells "
        "the bands of speed"
    )


def _grows(case: Case, fastest: float) -> bool:
    """Return whether a free motion grows at a speed of a case.

    fastest : rad/s, highest speed of the campaign
    """
    low, high = sorted(map(abs, extremes(case.given)))
    found = stability_of(case.model, max(fastest, high))
    bands = found.bands if found else ()
    return any(band.start <= high and low <= band.end for band in bands)
