"""Which figures a campaign directory can give, and what traces each needs."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from hpcwhirl.errors import InputError, unknown
from hpcwhirl.report import campbell, growth, motions, shapes, sweeps
from hpcwhirl.report.saving import save
from hpcwhirl.store.reading.cases import Cases
from hpcwhirl.store.reading.select import where

LONGEST = 80  # characters of the inputs in a file's name
MOST_CASES = 12  # of a campaign, drawn one by one without being asked for


@dataclass(frozen=True)
class Kind:
    """A kind of figure.

    Attributes
    ----------
    draw : (cases, line or case, transient) -> figure
    needs : traces without which there is none
    sweep : whether it is one figure of all speeds, not one a case
    model : whether it shows the engine alone, once
    """

    draw: Callable[[Cases, Any, bool], Any]
    needs: tuple[str, ...]
    sweep: bool
    model: bool = False


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
    "shapes": Kind(
        lambda c, i, _: shapes.draw_shapes_of(c.scene(i[0])), (), sweep=True, model=True
    ),
    "campbell": Kind(
        lambda c, i, _: campbell.draw_campbell(
            c.scene(i[0]), np.array([c.rows[j]["speed"] for j in i])
        ),
        (), sweep=True, model=True,
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
) -> Iterator[Path | str]:
    """Draw figures of a campaign; yield the path of each, or why there is none.

    Parameters
    ----------
    folder : directory of a finished campaign
    out : directory of the figures
    kinds : names of `KINDS`; all if None
    only : cases of the figures that show one case
    transient : show what is before the window of the words, too
    """
    for name in kinds or []:
        if name not in KINDS:
            raise unknown("kind of figure", name, KINDS)
    cases = Cases(folder)
    _check(cases, only)
    for name in kinds or KINDS:
        lacking = [n for n in KINDS[name].needs if n not in cases.kept]
        if lacking:
            level = "full" if {"tips", "blade_impulse"} & {*lacking} else "orbit"
            yield (
                f"{name}: needs traces = {level}, the campaign kept none of "
                f"{', '.join(lacking)}"
            )
        else:
            yield from _of_kind(name, cases, only, out, transient)


def _of_kind(
    name: str,
    cases: Cases,
    only: list[int] | None,
    out: Path,
    transient: bool,  # noqa: FBT001
) -> Iterator[Path | str]:
    """Draw a kind: once, for each line of speeds, or for each case."""
    kind, wanted = KINDS[name], only or cases.finished()
    if kind.model:
        yield _drawn(name, cases, wanted, out / f"{name}.png")
    elif kind.sweep:
        yield from _sweeps(name, cases, _lines(cases, only), out, transient)
    elif only is None and len(wanted) > MOST_CASES:
        yield (
            f"{name}: one figure a case, of {len(wanted)}: say which with --case or "
            "--at"
        )
    else:
        for case in wanted:
            path = out / f"{name}-{case:04d}.png"
            yield _drawn(name, cases, case, path, transient)


def cases_at(folder: Path, settings: list[str]) -> list[int]:
    """Return the finished cases that have the values of ``NAME=V`` settings."""
    cases = Cases(folder)
    found = where(settings, cases.inputs())
    chosen = set(np.flatnonzero(found).tolist()) if found is not None else set()
    finished = sorted(chosen & set(cases.finished()))
    if chosen and not finished:
        row = cases.rows[min(chosen)]
        told = row["message"].decode() or "no message"
        msg = (
            f"--at {' '.join(settings)}: case {min(chosen)} is {row['status']}: {told}"
        )
        raise InputError(msg)
    return finished


def _check(cases: Cases, only: list[int] | None) -> None:
    """Raise one line where there is nothing to draw, or not the case asked for."""
    whole = cases.finished()
    if not whole:
        msg = f"{cases.path} has no finished case: nothing to draw"
        raise InputError(msg)
    bad = [i for i in only or [] if i not in whole]
    if bad:
        msg = f"--case must be a finished case, 0 to {len(cases) - 1}, got {bad[0]}"
        raise InputError(msg)


def _lines(cases: Cases, only: list[int] | None) -> dict[str, list[int]]:
    """Return {part of a file's name: cases}, those alike but for speed together.

    Parameters
    ----------
    cases : of a campaign
    only : cases whose lines are wanted; all if None
    """
    every = cases.slices()
    lines = [line for line in every if only is None or set(only) & {*line}]
    if len(every) == 1:
        return {"": lines[0]}
    return {_name_of(cases.others(line[0], "=")): line for line in lines}


def _name_of(inputs: str) -> str:
    """Return inputs as a part of a file's name, of bounded length and one's own."""
    plain = re.sub(r"[^A-Za-z0-9._=+-]+", "-", inputs).strip("-")
    if len(plain) <= LONGEST:
        return f"-{plain}"
    return f"-{plain[:LONGEST]}-{hashlib.sha256(inputs.encode()).hexdigest()[:8]}"


def _sweeps(
    name: str,
    cases: Cases,
    lines: dict[str, list[int]],
    out: Path,
    transient: bool,  # noqa: FBT001
) -> Iterator[Path | str]:
    """Draw a figure of each line of cases that differ in speed alone."""
    if len(lines) > MOST_CASES:
        yield (
            f"{name}: one figure for each of {len(lines)} combinations of the other "
            f"inputs, at most {MOST_CASES}: say which with --at or --case"
        )
        return
    for part, line in lines.items():
        path = out / f"{name}{part}.png"
        yield _drawn(name, cases, line, path, transient)


def _drawn(
    name: str,
    cases: Cases,
    of: Any,
    path: Path,
    transient: bool = False,  # noqa: FBT001, FBT002
) -> Path | str:
    """Return the path of the figure of a line or a case, or why there is none."""
    try:
        return save(KINDS[name].draw(cases, of, transient), path)
    except InputError as refused:
        which = f"{name}, case {of}" if isinstance(of, int) else name
        return f"{which}: {refused}"
