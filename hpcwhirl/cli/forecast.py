"""Printing of the cost of a campaign that --dry-run, --pilot and `job` predict.

The prediction itself is made by `campaign.foresight.forecast`.
"""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from hpcwhirl.cli.options import print_json
from hpcwhirl.errors import cases_told, number_told

if TYPE_CHECKING:
    from hpcwhirl.campaign.foresight.forecast import Forecast
    from hpcwhirl.campaign.plan.design import Design
    from hpcwhirl.cluster.request import Request


def tell(cost: Forecast, design: Design, ranks: int, *, as_json: bool) -> None:
    """Print the forecast of a campaign: cases, steps, core-hours, wall time, bytes.

    Parameters
    ----------
    cost, design : forecast and design of the campaign
    ranks : number of ranks for which the wall time is predicted
    as_json : whether to print one JSON object instead of lines
    """
    if as_json:
        print_json(facts_of(cost, design, ranks))
        return
    for line in _lines(cost, design, ranks):
        print(line)


def facts_of(cost: Forecast, design: Design, ranks: int) -> dict[str, Any]:
    """Return the forecast of a campaign as plain data for JSON.

    cost, design, ranks : parameters of `tell`
    """
    usual, wall = cost.wall(ranks)
    hours = [seconds / 3600 for seconds in cost.range]
    facts: dict[str, Any] = {
        "cases": cost.cases,
        "left": cost.left,
        "swept": list(design.swept),
        "steps": cost.steps,
        "microseconds_per_step": _step(cost, cost.seconds),
        "core_hours": cost.seconds / 3600,
        "core_hours_range": hours,
        "core_hours_most": cost.most / 3600,
        "wall_seconds": {"ranks": ranks, "usual": usual, "range": wall},
        "overhead_seconds_per_case": cost.overhead,
        "seconds_before": cost.before,
        "seconds_after": cost.after,
        "learned_from": {"finished": cost.finished},
        "bytes": {**asdict(cost.disk), "total": cost.disk.total},
    }
    if design.grows:
        more = {"usual": cost.more[0], "range": list(cost.more[1:])}
        facts |= {"coarse": len(design.settings), "at_most": design.most, "more": more}
        facts["beyond"] = cost.beyond
    return facts


def job_line(cost: Forecast, ranks: int, request: Request) -> str:
    """Return a line that compares a campaign's predicted time with a job's time limit.

    It tells core-hours, wall time, and whether one job may be enough.

    Parameters
    ----------
    cost : forecast of what the job computes
    ranks : number of ranks of the job, for an array of all its elements together
    request : options of the job
    """
    usual, span = cost.wall(ranks)
    hours = f"{cost.seconds / 3600:.3g} core-hours, {_duration(usual)}"
    on = number_told(ranks, "rank")
    text = f"predicted {hours} ({_between(span)}) on {on}"
    if not cost.finished:
        low, high = (seconds / 3600 for seconds in cost.range)
        text = (
            f"nominally {low:.3g} (no contact) to {high:.3g} core-hours (always in "
            f"contact), {_between(span)} on {on}, campaign --pilot 20 measures the cost"
        )
    text += f"; --time {request.time}"
    enough = request.seconds - request.warning
    if span[1] <= enough:
        return text
    whole = "may not be" if usual <= enough else "is not"
    again = f"the job is requeued up to {request.requeues} times (--requeues)"
    return f"{text} {whole} enough for all: " + (
        again if request.requeues else "submit it again"
    )


def _between(span: tuple[float, float]) -> str:
    return " to ".join(dict.fromkeys(map(_duration, span)))


def _step(cost: Forecast, seconds: float) -> float:
    """Return the mean time of a time step, us, in the cases left.

    cost, seconds : forecast of these cases; processor time of all of them together
    """
    return 1e6 * seconds / cost.steps if cost.steps else 0.0


def _lines(cost: Forecast, design: Design, ranks: int) -> list[str]:
    rest = f", {cost.left} left" if cost.left < cost.cases else ""
    cases = cases_told(cost.cases)
    over = f" over {', '.join(design.swept)}" if design.swept else ""
    twins = f", {design.twins.told}" if design.twins else ""
    lines = [f"{cases}{over}{twins}{rest}"]
    if design.grows:
        lines.append(_more(cost, design))
    low, high = cost.range
    if not cost.left and not design.grows:
        lines.append("no case is left to compute")
    elif cost.finished:
        each = f"{_step(cost, cost.seconds):.2f} us each"
        lines.append(
            f"{cost.steps:.4g} steps, {each} (learned from {cost.finished} finished "
            "cases)"
        )
        lines.append(
            f"predicted: {cost.seconds / 3600:.3g} core-hours ({low / 3600:.3g} to "
            f"{high / 3600:.3g}), {cost.most / 3600:.3g} if none ends early"
        )
    else:
        first, last = (_step(cost, seconds) for seconds in cost.range)
        lines.append(
            f"{cost.steps:.4g} steps, {first:.2g} us each where no blade touches to "
            f"{last:.2g} where blades always touch ({_source()}; --pilot SECONDS "
            "computes some of the cases and learns from them)"
        )
        lines.append(
            f"{_source()}: {low / 3600:.3g} to {high / 3600:.3g} core-hours, if none "
            f"ends early{_extrapolated(design)}"
        )
    lines.append(_wall(cost, ranks))
    disk = cost.disk
    lines.append(
        f"on disk: {_size(disk.results)} results.h5, {_size(disk.traces)} traces, "
        f"{_size(disk.journal)} journal"
    )
    return lines


def _source() -> str:
    """Return from where the times of steps are, before any case has ended."""
    from hpcwhirl.campaign.plan.learned import learned

    return "measured on this machine" if learned() else "nominal"


def _extrapolated(design: Design) -> str:
    """Return the end of a sentence on times: that they are extrapolated.

    "" unless tips have more contact points than those of which times were measured.
    """
    from hpcwhirl.campaign.plan.cost import most_points
    from hpcwhirl.scene.schemes import MOST_POINTS

    points = most_points(design)
    if points <= MOST_POINTS:
        return ""
    return f"; {points} contact points a tip, extrapolated from up to {MOST_POINTS}"


def _more(cost: Forecast, design: Design) -> str:
    """Return a line on how many cases a refined campaign may add to its coarse ones.

    cost, design : forecast of the coarse cases; design of the campaign
    """
    most = f"{design.most} cases at most{_twins(design)}"
    if not cost.finished:
        return f"these are the coarse level; their words may require more, {most}"
    more, least, last = cost.more
    beyond = f"{cost.beyond} beyond it have ended, " if cost.beyond else ""
    return (
        f"these are the coarse level; {beyond}words may require some {more} more "
        f"({least} to {last}, guessed from the nearest words known), {most}"
    )


def _twins(design: Design) -> str:
    """Return the end of a sentence: how many twins follow, which are not counted.

    "" for a campaign without twins.
    """
    twins = design.twins
    if twins is None:
        return ""
    where = {"boundary": " at a boundary", "speckle": " in speckle"}
    of = f"of each case{where.get(twins.of, '')}"
    if twins.of == "even":
        of = f"of each of {twins.sample} even cases"
    return f", and {twins.count} twins {of}, not counted here"


def _wall(cost: Forecast, ranks: int) -> str:
    """Return the line on the wall time, with the part spent before and after the cases.

    That part, for start, gather and map, does not get shorter with more ranks.

    cost, ranks : forecast of the cases left; number of ranks
    """
    usual, span = cost.wall(ranks)
    wall = f"{_duration(usual)} ({_between(span)})" if cost.finished else _between(span)
    serial = sum(cost.before.values()) + sum(cost.after.values())
    source = "" if cost.finished else f", {_source()}"
    text = f"wall time on {number_told(ranks, 'rank')}{source}: {wall}; "
    text += f"of this, {_duration(serial)} for start, gather and map"
    if not cost.left:
        return text
    return f"{text}, {_brief(cost.overhead)} a case in addition to its steps"


def _brief(seconds: float) -> str:
    """Return a short duration as text, below 0.1 s in ms: "4.8 ms", "1.2 s"."""
    return f"{1e3 * seconds:.2g} ms" if seconds < 0.0995 else f"{seconds:.2g} s"


def _duration(seconds: float) -> str:
    """Return a duration as text, below 10 s to a tenth of a second."""
    from hpcwhirl.campaign.progress import duration_text

    return f"{seconds:.1f} s" if seconds < 10 else duration_text(seconds)


def _size(count: int) -> str:
    """Return a number of bytes as text, such as "12.3 MB"."""
    size, units = float(count), ["B", "kB", "MB", "GB", "TB"]
    while size >= 1000 and len(units) > 1:
        size, units = size / 1000, units[1:]
    return f"{size:.3g} {units[0]}"
