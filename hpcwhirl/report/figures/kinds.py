"""The kinds of figures of a campaign, and the traces that each needs."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np

from hpcwhirl.analysis.wheel_motion import NEEDED
from hpcwhirl.errors import InputError, unknown
from hpcwhirl.report.canvas import in_defaults, part_of_name, save, tell_in_units
from hpcwhirl.report.figures import (
    coexisting,
    frequencies,
    loads,
    motions,
    shapes,
    sweeps,
    tips,
    wheel,
)
from hpcwhirl.scene.units import showing
from hpcwhirl.store.reading.results_file import Results
from hpcwhirl.store.reading.select import swept_of, where
from hpcwhirl.store.results.variables import DETAIL, changes_in_time
from hpcwhirl.studies.branches import aside_of, bundles_of

# Largest number of figures of a kind; all cases that the user names get their figures.
MOST_CASES = 12
# traces that only `traces = "full"` keeps
FULL = {"casing", "tips", "blade_impulse", "point_impulse", "stress", "worn"}
SPECIAL = {  # {trace: message on what the trace needs in addition to `traces`}
    "point_impulse": "needs an engine.file with several contact points per tip",
    "support_force": "needs output.forces = supports",
    "stress": "needs an engine.file with rotor/stress",
    "worn": "needs a layer that wears: engine.casing.contact_law",
}


@dataclass(frozen=True)
class Kind:
    """A kind of figure of a campaign, such as an orbit.

    Attributes
    ----------
    draw : function that returns a figure from results and the number of a case, or the
        numbers of several cases
    needs : names of the traces that the figure requires
    of : what one figure shows: "case"; "speeds", cases that differ only in speed;
        "branches", all branches that share the other inputs; "engine", the campaign
    asked : whether figures of this kind are drawn only if the user names the kind
    speed : whether speed and gap of a case must be "constant" or "changing" in time; or
        "any"
    film : ending of the file of a film that is written, too; "" for none
    """

    draw: Callable[..., Any]
    needs: tuple[str, ...]
    of: Literal["case", "speeds", "branches", "engine"]
    asked: bool = False
    speed: Literal["any", "constant", "changing"] = "any"
    film: str = ""

    @property
    def transient(self) -> bool:
        """Whether the figure can also show the time before the window."""
        return "transient" in inspect.signature(self.draw).parameters


def _shapes(results: Results, line: list[int]) -> Any:
    return shapes.draw_shapes_of(results.scene(line[0]))


def _over_speed(draw: Callable[..., Any]) -> Callable[..., Any]:
    """Make a `Kind.draw` from a function of a scene and speeds, such as a Campbell one.

    draw : function from a scene and the campaign's speeds, rad/s, to a figure
    """

    def drawn(results: Results, line: list[int]) -> Any:
        return draw(results.scene(line[0]), results["speed"][results.finished()])

    return drawn


KINDS = {
    "frequency": Kind(
        sweeps.draw_frequency, ("centre", "tips"), "speeds", speed="constant"
    ),
    "cascade": Kind(sweeps.draw_cascade, ("centre",), "speeds", speed="constant"),
    "bifurcation": Kind(
        sweeps.draw_bifurcation, ("centre",), "speeds", speed="constant"
    ),
    "interaction": Kind(frequencies.draw_interaction, (), "speeds", speed="constant"),
    "growth": Kind(sweeps.draw_growth, (), "speeds", speed="constant"),
    "branches": Kind(coexisting.draw_branches, (), "branches"),
    "orbit": Kind(motions.draw_orbits, ("centre",), "case"),
    "section": Kind(motions.draw_section, ("centre",), "case", speed="constant"),
    "contributions": Kind(
        motions.draw_contributions, ("centre", "tips"), "case", speed="constant"
    ),
    "contacts": Kind(tips.draw_contacts, ("blade_impulse",), "case", speed="constant"),
    "chord": Kind(tips.draw_chord, ("point_impulse",), "case", asked=True),
    "tips": Kind(tips.draw_tips, ("tips",), "case"),
    "stress": Kind(tips.draw_stress, ("stress",), "case", asked=True),
    "loads": Kind(loads.draw_loads, ("support_force",), "case", asked=True),
    "waterfall": Kind(sweeps.draw_waterfall, ("centre",), "case", speed="changing"),
    "wear": Kind(tips.draw_wear, ("worn",), "case", asked=True),
    "motion": Kind(wheel.draw_strip, NEEDED, "case", asked=True, film=".gif"),
    "movie": Kind(wheel.draw_strip, NEEDED, "case", asked=True, film=".mp4"),
    "basins": Kind(coexisting.draw_basins, (), "engine", asked=True),
    "shapes": Kind(_shapes, (), "engine"),
    "campbell": Kind(_over_speed(frequencies.draw_campbell), (), "engine"),
    "stability": Kind(_over_speed(frequencies.draw_stability), (), "engine"),
    "ledger": Kind(motions.draw_ledger, ("energy", "fed", "rubbed", "lost"), "case"),
}


def draw_figures(
    results: Results,
    out: Path,
    kinds: list[str] | None = None,
    only: list[int] | None = None,
    *,
    transient: bool = False,
    units: Sequence[str] = ("practical",),
) -> Iterator[Path | str]:
    """Draw figures of a campaign; yield the path of each, or why it is not drawn.

    Parameters
    ----------
    results : results of a campaign
    out : directory of the figures
    kinds : names of kinds of figures, keys of `KINDS`; None: all that suit the campaign
        and are drawn without being named
    only : numbers of the cases to show; None: all finished cases
    transient : also show the time before the window
    units : units in titles and on axes, see `scene.units.showing`
    """
    for name in kinds or []:
        if name not in KINDS:
            raise unknown("kind of figure", name, KINDS)
    _check(results, only)
    for name in kinds or _default_kinds(results):
        found = _lacking(results, KINDS[name]) or _wanted(results, KINDS[name], only)
        if isinstance(found, str):
            yield f"{name}: {found}"
            continue
        for part, of in found.items():
            path = out / f"{name}{part}.png"
            with showing(units):
                made = _drawn(name, results, of, path, transient=transient)
                yield made
                if KINDS[name].film and isinstance(made, Path):
                    yield _filmed(name, results, of, path)


def cases_at(results: Results, settings: list[str]) -> list[int]:
    """Return the numbers of the finished cases that --at selects.

    settings : texts ``NAME=V`` of the option, such as "friction=0.1"
    """
    found = where(settings, {name: results[name] for name in swept_of(results)})
    chosen = set(np.flatnonzero(found).tolist()) if found is not None else set()
    finished = sorted(chosen & set(results.finished()))
    if chosen and not finished:
        row = results.rows[min(chosen)]
        why = f"{row['status']}: {row['message'] or 'no message'}"
        raise InputError(f"--at {' '.join(settings)}: case {min(chosen)} is {why}")
    return finished


def _default_kinds(results: Results) -> list[str]:
    """Return the names of the kinds of figures to draw if the user names none."""
    return [
        name
        for name, kind in KINDS.items()
        if not kind.asked
        and (kind.of != "branches" or _has_branches(results))
        and (kind.speed != "changing" or changes_in_time(results.plan))
    ]


def _has_branches(results: Results) -> bool:
    return "history" in results.plan.table.names


def _check(results: Results, only: list[int] | None) -> None:
    """Raise InputError if no case is finished, or a case that the user named is not.

    only : numbers of the cases that the user named; None: none
    """
    whole = results.finished()
    if not whole:
        raise InputError(f"{results.path} has no finished case: nothing to draw")
    bad = [i for i in only or [] if i not in whole]
    if bad:
        msg = f"--case must be a finished case, 0 to {len(results) - 1}, got {bad[0]}"
        raise InputError(msg)


def _lacking(results: Results, kind: Kind) -> str:
    """Return why a campaign cannot have a kind of figure, as text; "" if it can."""
    if kind.of == "branches" and not _has_branches(results):
        return "needs a campaign with a table [branch]"
    if kind.speed == "constant" and changes_in_time(results.plan):
        return "needs a constant speed and gap: see waterfall"
    if kind.speed == "changing" and not changes_in_time(results.plan):
        return "needs a campaign whose speed, gap or rotor changes in time"
    lacking = [name for name in kind.needs if name not in results.kept]
    if not lacking:
        return ""
    level = _level(lacking)
    if len(lacking) == 1 and lacking[0] in SPECIAL:
        sign = "tips" if level == "full" else "centre"
        more = "" if sign in results.kept else f"; and traces = {level}"
        return SPECIAL[lacking[0]] + more
    return f"needs traces = {level}; the campaign did not keep {', '.join(lacking)}"


def _level(needs: Sequence[str]) -> str:
    """Return the least value of `output.traces` that keeps the traces `needs`."""
    return "full" if FULL & {*needs} else "orbit"


def _with_traces(results: Results, kind: Kind, cases: list[int]) -> list[int]:
    """Return those of some cases whose traces a kind of figure needs were kept."""
    if not kind.needs:
        return cases
    keep = {"full", _level(kind.needs)}
    usual, settings = results.plan.base[DETAIL], results.plan.settings
    return [case for case in cases if settings[case].get(DETAIL, usual) in keep]


def _wanted(
    results: Results, kind: Kind, only: list[int] | None
) -> dict[str, Any] | str:
    """Return the figures of a kind that are to be drawn, or why none is, for the user.

    Returns {end of the figure's file name: number of the case, or numbers of the cases,
    that it shows}

    only : numbers of the cases that the user named; None: all
    """
    finished = only or results.finished()
    if kind.of == "engine":
        return {"": finished}
    if kind.of == "case":
        if only is None and len(finished) > MOST_CASES:
            which = "choose cases with --case or --at"
            return f"one figure for each of {len(finished)} cases: {which}"
        return {f"-{case:04d}": case for case in finished}
    every = bundles_of(results) if kind.of == "branches" else results.slices()
    if len(every) == 1:
        return {"": every[0]}
    lines = [line for line in every if only is None or set(only) & {*line}]
    if len(lines) > MOST_CASES:
        return (
            f"one figure for each of {len(lines)} combinations of the other inputs, "
            f"at most {MOST_CASES}: choose some with --at or --case"
        )
    aside = aside_of(results) if kind.of == "branches" else ()
    return {
        f"-{part_of_name(results.others(line[0], '=', aside))}": line for line in lines
    }


@in_defaults
def _filmed(name: str, results: Results, case: int, path: Path) -> Path | str:
    """Write the film of a kind of figure; return its path, or why it was not written.

    name, path : key of `KINDS`, of a kind that has a film; path of the figure
    """
    try:
        return wheel.write_film(results, case, path.with_suffix(KINDS[name].film))
    except InputError as refused:
        return f"{name}, case {case}: {refused}"


@in_defaults
def _drawn(
    name: str, results: Results, of: Any, path: Path, *, transient: bool
) -> Path | str:
    """Draw a figure of the kind `name`; return its path, or why it was not drawn.

    name, of : key of `KINDS`; number of the case, or numbers of the cases, to show
    """
    kind = KINDS[name]
    if kind.of != "engine":
        kept = _with_traces(results, kind, [of] if kind.of == "case" else of)
        if not kept:
            which = f"case {of}" if kind.of == "case" else path.stem
            return (
                f"{name}, {which}: needs traces = {_level(kind.needs)}, not kept here"
            )
        of = of if kind.of == "case" else kept
    try:
        more = {"transient": transient} if kind.transient else {}
        figure = kind.draw(results, of, **more)
        tell_in_units(figure)
        return save(figure, path)
    except InputError as refused:
        case = f", case {of}" if kind.of == "case" else ""
        return f"{name}{case}: {refused}"
