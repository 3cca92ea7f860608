"""The words of a case as a table of conditions, which the page reads, too.

`regimes.name_regime` is the same rule in Python, twenty times as fast; a test holds the
two together on a thousand rows, another one the page.

Conditions are texts of `analysis.expression`. Names are evidence (see `evidence`),
thresholds (see `Thresholds`) and, before both, what `DEFINED` makes of them.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from hpcwhirl.analysis.expression import names_in, parse, value_of


@dataclass(frozen=True)
class Rule:
    """A word, and the conditions that must all hold for it."""

    word: str
    needs: tuple[str, ...] = ()


# In this order: a later one may use an earlier one. A centre that does not move has no
# growth: where all sectors move alike, round-off is all that moves it.
DEFINED = {
    "begin": "end_time - window",
    "clear": "abs(growth_rate) > significance * growth_error",
    "growth_shaft": "growth_centre * (orbit_radius >= whirl_floor * gap_scale)",
    "rise_of_both": "min(growth_rate, growth_rotor) * window",
    "largest_change": "max(max(abs(growth_rate), abs(growth_rotor)),"
    " abs(growth_shaft)) * window",
}
KEPT_UP = (
    "late_lost >= turnover * late_energy",
    "late_fed >= replaced * late_lost",
    "late_lost >= replaced * late_fed",
)
# Of each list the first rule counts whose conditions all hold.
OUTCOMES = (
    Rule("unstable", ("stop == 'nonfinite'",)),
    Rule("unstable", ("stop == 'complementarity'",)),
    Rule("unstable", ("ledger_error > ledger",)),
    Rule("unstable", ("gap_error > opening",)),
    Rule("unstable", ("step_share >= 1",)),
    Rule("stopped", ("stop == 'amplitude'",)),
    Rule("completed"),
)
REGIMES = (
    Rule("undecided", ("begin < load_end",)),
    Rule("damped", ("certificate >= 0",)),
    Rule("damped", ("late_energy == 0",)),
    Rule(
        "damped",
        (
            "late_contacts == 0",
            "clear",
            "growth_rate < 0",
            "growth_rotor <= 0",
            "growth_casing <= 0",
            "growth_shaft <= 0",
        ),
    ),
    Rule("undecided", ("late_contacts == 0",)),
    Rule("divergent", ("stop == 'amplitude'", "late_fed > 0")),
    Rule(
        "divergent",
        (
            "clear",
            "rise_of_both > rise",
            "growth_last >= onward * growth_rate",
            "summit > above",
            "late_fed > 0",
        ),
    ),
    Rule("sustained", ("clear", "largest_change <= drift", *KEPT_UP)),
    Rule("sustained", ("not clear", "largest_change <= unclear", *KEPT_UP)),
    Rule("undecided"),
)
WHIRLS = (
    Rule("none", ("orbit_radius < whirl_floor * gap_scale",)),
    Rule("forward", ("whirl_ratio > direction",)),
    Rule("backward", ("whirl_ratio < -direction",)),
    Rule("mixed"),
)
TABLES = {"outcome": OUTCOMES, "regime": REGIMES, "whirl": WHIRLS}


def first_word(rules: tuple[Rule, ...], known: Mapping[str, Any]) -> str:
    """Return the word of the first rule whose conditions all hold."""
    return next(
        rule.word
        for rule in rules
        if all(value_of(parse(need), known) for need in rule.needs)
    )


def words_by_table(
    numbers: Mapping[str, Any], limits: Mapping[str, float]
) -> tuple[str, str, str]:
    """Return (outcome, regime, whirl) of evidence by the tables."""
    known = {**numbers, **limits}
    for name, text in DEFINED.items():
        known[name] = value_of(parse(text), known)
    outcome = first_word(OUTCOMES, known)
    if outcome == "unstable":
        return outcome, "none", "none"
    return outcome, first_word(REGIMES, known), first_word(WHIRLS, known)


def evidence_names() -> list[str]:
    """Return the names that the tables ask for, but those that `DEFINED` makes."""
    texts = [*DEFINED.values()]
    texts += [
        need for rules in TABLES.values() for rule in rules for need in rule.needs
    ]
    names = set().union(*(names_in(parse(text)) for text in texts))
    return sorted(names - DEFINED.keys())


def as_data() -> dict[str, Any]:
    """Return definitions and tables as plain data, for the page."""
    tables = {
        name: [{"word": rule.word, "needs": list(rule.needs)} for rule in rules]
        for name, rules in TABLES.items()
    }
    return {"defined": DEFINED, "tables": tables}
