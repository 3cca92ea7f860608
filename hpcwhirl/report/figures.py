"""Which figures a campaign directory can give, and what traces each needs."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hpcwhirl.errors import InputError, unknown
from hpcwhirl.report import growth, motions, sweeps
from hpcwhirl.report.saving import save
from hpcwhirl.store.cases import Cases

MOST_CASES = 12  # of a campaign, drawn one by one without being asked for


@dataclass(frozen=True)
class Kind:
    """A kind of figure.

    Attributes
    ----------
    draw : (cases, line or case, transient) -> figure
    needs : traces without which there is none
    sweep : whether it is one figure of all speeds, not one a case
    """

    draw: Callable[[Cases, Any, bool], Any]
    needs: tuple[str, ...]
    sweep: bool


KINDS = {
    "frequency": Kind(
        lambda c, i, _: sweeps.draw_frequency(c, i), ("centre", "tips"), sweep=True
    ),
    "cascade": Kind(
        lambda c, i, t: sweeps.draw_cascade(c, i, transient=t), ("centre",), sweep=True
    ),
    "bifurcation": Kind(
        lambda c, i, t: sweeps.draw_bifurcation(c, i, transient=t),
        ("centre",), sweep=True,
    ),
    "interaction": Kind(lambda c, i, _: sweeps.draw_interaction(c, i), (), sweep=True),
    "growth": Kind(lambda c, i, _: growth.draw_growth(c, i), (), sweep=True),
    "orbit": Kind(
        lambda c, i, t: motions.draw_orbits(c, i, transient=t), ("centre",), sweep=False
    ),
    "section": Kind(
        lambda c, i, t: motions.draw_section(c, i, transient=t), ("centre",),
        sweep=False,
    ),
    "contributions": Kind(
        lambda c, i, _: motions.draw_contributions(c, i), ("centre", "tips"),
        sweep=False,
    ),
    "contacts": Kind(
        lambda c, i, t: motions.draw_contacts(c, i, transient=t), ("blade_impulse",),
        sweep=False,
    ),
    "ledger": Kind(
        lambda c, i, _: motions.draw_ledger(c, i), ("energy", "fed", "rubbed", "lost"),
        sweep=False,
    ),
}  # fmt: skip


def draw_figures(
    folder: Path,
    out: Path,
    kinds: list[str] | None = None,
    only: list[int] | None = None,
    *,
    transient: bool = False,
) -> Iterator[str]:
    """Draw figures of a campaign; yield for each its path, or why there is none.

    Parameters
    ----------
    folder : directory of a finished campaign
    out : directory of the figures
    kinds : names of `KINDS`; all if None
    only : cases of the figures that show one case
    transient : show what is before the steady part, too
    """
    for name in kinds or []:
        if name not in KINDS:
            raise unknown("kind of figure", name, KINDS)
    cases = Cases(folder)
    whole = [i for i, row in enumerate(cases.rows) if row["status"] == "ok"]
    wanted = _wanted(cases, whole, only)
    for name in kinds or KINDS:
        kind = KINDS[name]
        lacking = [n for n in kind.needs if n not in cases.kept]
        if lacking:
            level = "full" if {"tips", "blade_impulse"} & {*lacking} else "orbit"
            yield (
                f"{name}: needs traces = {level}, the campaign kept none of "
                f"{', '.join(lacking)}"
            )
        elif kind.sweep:
            yield from _sweep(name, kind, cases, wanted, out, transient)
        elif only is None and len(whole) > MOST_CASES:
            yield f"{name}: one figure a case, of {len(whole)}: say which with --case"
        else:
            yield from _one_by_one(name, kind, cases, wanted, out, transient)


def _wanted(cases: Cases, whole: list[int], only: list[int] | None) -> list[int]:
    if not whole:
        msg = f"{cases.path} has no finished case: nothing to draw"
        raise InputError(msg)
    bad = [i for i in only or [] if i not in whole]
    if bad:
        msg = f"--case must be a finished case, 0 to {len(cases) - 1}, got {bad[0]}"
        raise InputError(msg)
    return only or whole


def _sweep(
    name: str,
    kind: Kind,
    cases: Cases,
    wanted: list[int],
    out: Path,
    transient: bool,  # noqa: FBT001
) -> Iterator[str]:
    """Draw one figure of the cases that differ from the first wanted in speed alone."""
    line = cases.like(wanted[0])
    try:
        yield str(save(kind.draw(cases, line, transient), out / f"{name}.png"))
    except InputError as refused:
        yield f"{name}: {refused}"


def _one_by_one(
    name: str,
    kind: Kind,
    cases: Cases,
    wanted: list[int],
    out: Path,
    transient: bool,  # noqa: FBT001
) -> Iterator[str]:
    for case in wanted:
        try:
            figure = kind.draw(cases, case, transient)
        except InputError as refused:
            yield f"{name}, case {case}: {refused}"
            continue
        yield str(save(figure, out / f"{name}-{case:04d}.png"))
