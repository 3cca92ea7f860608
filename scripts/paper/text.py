"""A statement of the paper beside what was computed, and the page of them all."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

VERDICTS = ("differs", "cannot be judged", "agrees")  # misses first


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


@dataclass(frozen=True)
class Number:
    """A number of the paper: unit, and relative difference that still agrees."""

    where: str
    claim: str
    paper: float
    unit: str
    tolerance: float

    def beside(self, here: float) -> Statement:
        """Return the statement with what was computed; nan cannot be judged."""
        if not abs(here) < float("inf"):
            return Statement(self.where, self.claim, "nothing", VERDICTS[1])
        off = here / self.paper - 1
        told = f"{here:.5g} {self.unit} ({100 * off:+.2g} %; allowed "
        told += f"±{100 * self.tolerance:g} %)"
        return Statement(
            self.where, self.claim, told, judged(abs(off) <= self.tolerance)
        )


def judged(agrees: bool | None) -> str:  # noqa: FBT001
    """Return the verdict of yes, no or None."""
    return VERDICTS[1] if agrees is None else VERDICTS[2 if agrees else 0]


def ordered(found: Iterable[Statement]) -> list[Statement]:
    """Return the statements, misses first, else in the order of the paper."""
    return sorted(found, key=lambda statement: VERDICTS.index(statement.verdict))


def table(head: Sequence[str], rows: Iterable[Sequence[Any]]) -> list[str]:
    """Return a table in Markdown."""
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return lines + ["| " + " | ".join(str(c) for c in row) + " |" for row in rows]


def page(found: list[Statement], why: list[str], *, quick: bool) -> str:
    """Return `paper.md`."""
    counts = ", ".join(
        f"{sum(s.verdict == v for s in found)} {v.replace('differs', 'differ')}"
        for v in VERDICTS
    ).replace("agrees", "agree")
    lines = [
        "# The paper's statements and what was computed",
        "",
        "Salvat, Batailly, Legrand, *Two-dimensional modeling of shaft precessional",
        "motions*. Casing section, damping, support and pulse are not printed there:",
        "what depends on them is a comparison of engines, not of codes. Every verdict",
        "is worked out from the campaigns beside this page.",
        "",
        *(["**Quick: coarse steps and few speeds.**", ""] if quick else []),
        f"{len(found)} statements: {counts}.",
        "",
    ]
    rows = [(s.verdict, s.where, s.claim, s.computed) for s in ordered(found)]
    lines += table(("verdict", "where", "the paper", "computed"), rows)
    return "\n".join([*lines, "", *why, ""])
