"""What `hpcwhirl campaign --dry-run` tells: cases, time on these ranks, bytes."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from hpcwhirl.cli.options import print_json

if TYPE_CHECKING:
    from hpcwhirl.campaign.foresight.forecast import Forecast
    from hpcwhirl.campaign.plan.design import Design


def tell(found: Forecast, design: Design, ranks: int, *, as_json: bool) -> None:
    """Print a forecast.

    Parameters
    ----------
    found, design : of the campaign
    ranks : of this call, on which it is thought to run
    as_json : whether as one JSON object
    """
    if as_json:
        print_json(facts_of(found, design, ranks))
        return
    for line in _lines(found, design, ranks):
        print(line)


def facts_of(found: Forecast, design: Design, ranks: int) -> dict[str, Any]:
    """Return a forecast as plain data."""
    usual, low, high = found.wall(ranks)
    facts: dict[str, Any] = {
        "cases": found.cases,
        "left": found.left,
        "swept": list(design.swept),
        "steps": found.steps,
        "microseconds_per_step": _step(found),
        "core_hours": found.seconds / 3600,
        "core_hours_range": [seconds / 3600 for seconds in found.range],
        "core_hours_most": found.most / 3600,
        "wall_seconds": {"ranks": ranks, "usual": usual, "range": [low, high]},
        "overhead_seconds_per_case": found.overhead,
        "seconds_before": found.before,
        "seconds_after": found.after,
        "compiled_here": found.compiled,
        "learned_from": {
            "finished": found.finished,
            "rehearsed": found.rehearsed,
            "probed": found.probed,
        },
        "bytes": {**asdict(found.disk), "total": found.disk.total},
    }
    if design.grows:
        more = {"usual": found.more[0], "range": list(found.more[1:])}
        facts |= {"coarse": len(design.settings), "at_most": design.most, "more": more}
    return facts


def _step(found: Forecast) -> float:
    """Return microseconds a step, if all cases run to their end."""
    return 1e6 * found.seconds / found.steps if found.steps else 0.0


def _lines(found: Forecast, design: Design, ranks: int) -> list[str]:
    rest = f", {found.left} left" if found.left < found.cases else ""
    cases = "1 case" if found.cases == 1 else f"{found.cases} cases"
    over = f" over {', '.join(design.swept)}" if design.swept else ""
    told = [f"{cases}{over}{rest}"]
    if design.grows:
        more, least, most = found.more
        told.append(
            f"that is the coarse level; words may ask for some {more} more ({least} to "
            f"{most}, guessed from few words), with all of them {design.most} at most"
            f"{design.beside}"
        )
    told.append(f"{found.steps:.4g} steps, {_step(found):.2f} us each ({_how(found)})")
    low, high = (seconds / 3600 for seconds in found.range)
    told.append(
        f"predicted: {found.seconds / 3600:.3g} core-hours ({low:.3g} to {high:.3g}), "
        f"{found.most / 3600:.3g} if none ends early"
    )
    told.append(_wall(found, ranks))
    disk = found.disk
    told.append(
        f"on disk: {_size(disk.results)} results.h5, {_size(disk.traces)} traces, "
        f"{_size(disk.journal)} journal"
    )
    return told


def _how(found: Forecast) -> str:
    """Return what the time of a step was learned from."""
    if found.finished:
        return f"learned from {found.finished} finished cases"
    return f"{found.rehearsed} cases computed to their end, {found.probed} for a moment"


def _wall(found: Forecast, ranks: int) -> str:
    """Return the line of the wall time, and what of it further ranks do not shorten."""
    usual, low, high = found.wall(ranks)
    alone = sum(found.before.values()) + sum(found.after.values())
    on = f"{ranks} rank" + ("s" if ranks > 1 else "")
    beside = f"{1e3 * found.overhead:.2g} ms a case beside its steps"
    note = "; kernels were compiled here" if found.compiled else ""
    return (
        f"wall time on {on}: {_duration(usual)} ({_duration(low)} to "
        f"{_duration(high)}); {_duration(alone)} of it start, gather and map, "
        f"{beside}{note}"
    )


def _duration(seconds: float) -> str:
    """Return a duration: short ones to a tenth of a second."""
    from hpcwhirl.campaign.progress import duration_text

    return f"{seconds:.1f} s" if seconds < 10 else duration_text(seconds)


def _size(count: int) -> str:
    """Return a number of bytes in the unit that gives it one to three digits."""
    size, units = float(count), ["B", "kB", "MB", "GB", "TB"]
    while size >= 1000 and len(units) > 1:
        size, units = size / 1000, units[1:]
    return f"{size:.3g} {units[0]}"
