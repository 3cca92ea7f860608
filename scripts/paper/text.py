"""A statement of the paper beside what was computed, and the page of them all."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from common import table

VERDICTS = ("differs", "cannot be judged", "agrees")  # misses first
REASONS: dict[str, str] = tomllib.loads(
    Path(__file__).with_name("reasons.toml").read_text("utf-8")
)
PLURAL = dict(zip(VERDICTS, ("differ", "cannot be judged", "agree"), strict=True))


@dataclass(frozen=True)
class Statement:
    """What the paper says, what came out, and whether they agree."""

    where: str
    claim: str
    computed: str
    verdict: str

    def __post_init__(self) -> None:
        if self.verdict not in VERDICTS:
            msg = f"verdict must be one of {VERDICTS}, got '{self.verdict}'"
            raise ValueError(msg)


Engines = Mapping[str, Sequence[Statement]]


def judged(agrees: bool | None) -> str:  # noqa: FBT001
    """Return the verdict of yes, no or None."""
    return VERDICTS[1] if agrees is None else VERDICTS[2 if agrees else 0]


def said(where: str, claim: str, computed: str, agrees: Any) -> Statement:
    """Return a statement that agrees, differs, or (None) cannot be judged."""
    return Statement(
        where, claim, computed, judged(agrees if agrees is None else bool(agrees))
    )


def number(
    where: str, claim: str, paper: float, here: float, unit: str, tolerance: float
) -> Statement:
    """Return a statement on a number of the paper; nan cannot be judged.

    tolerance : relative difference that still agrees
    """
    if not abs(here) < float("inf"):
        return said(where, claim, "nothing", None)
    off = here / paper - 1
    told = f"{here:.5g} {unit} ({100 * off:+.2g} %; allowed ±{100 * tolerance:g} %)"
    return said(where, claim, told, abs(off) <= tolerance)


def with_reason(statement: Statement) -> Statement:
    """Return a statement, with the reason why it does not agree where one is known."""
    reason = REASONS.get(statement.claim)
    if statement.verdict == VERDICTS[2] or reason is None:
        return statement
    return replace(statement, computed=f"{statement.computed}. Why: {reason}")


def ordered(found: Iterable[Statement]) -> list[Statement]:
    """Return the statements, misses first, else in the order of the paper."""
    return sorted(found, key=lambda statement: VERDICTS.index(statement.verdict))


def page(engines: Engines, *, quick: bool) -> str:
    """Return `paper.md` of engines by name."""
    lines = [
        "# The paper's statements and what was computed",
        "",
        "Salvat, Batailly, Legrand, *Two-dimensional modeling of shaft precessional",
        "motions*. Casing section, damping, support and pulse are not printed there:",
        "what depends on them is a comparison of engines, not of codes. Every verdict",
        "is worked out from the campaigns beside this page.",
        "",
        *(["**Quick: coarse steps and few speeds.**", ""] if quick else []),
    ]
    for name, found in engines.items():
        lines += [f"{name}: {counts(found)}.", ""]
    lines += alone(engines) if len(engines) == 1 else beside(engines)
    return "\n".join([*lines, ""])


def counts(found: Sequence[Statement]) -> str:
    """Return how many statements have which verdict."""
    each = (f"{sum(s.verdict == v for s in found)} {PLURAL[v]}" for v in VERDICTS)
    return f"{len(found)} statements: {', '.join(each)}"


def alone(engines: Engines) -> list[str]:
    """Return the table of one engine, misses first."""
    (found,) = engines.values()
    rows = [(s.verdict, s.where, s.claim, s.computed) for s in ordered(found)]
    return table(("verdict", "where", "the paper", "computed"), rows)


def beside(engines: Engines) -> list[str]:
    """Return the table of several engines: first what agrees on the fewest."""
    rows = list(zip(*engines.values(), strict=True))
    for row in rows:
        if len({(s.where, s.claim) for s in row}) > 1:
            msg = f"engines are asked different questions: {row}"
            raise ValueError(msg)
    rows.sort(key=lambda row: sum(VERDICTS.index(s.verdict) for s in row))
    best = sum(any(s.verdict == VERDICTS[2] for s in row) for row in rows)
    cells = [
        (row[0].where, row[0].claim, *(f"*{s.verdict}*: {s.computed}" for s in row))
        for row in rows
    ]
    told = f"On at least one of them {best} of {len(rows)} agree."
    return [told, "", *table(("where", "the paper", *engines), cells)]
