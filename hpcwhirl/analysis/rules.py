"""The words of one case, or of many, by the rules of `scene.words`.

A rule has a word and conditions on evidence and thresholds; the first rule of a table
whose conditions all hold gives the word.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.analysis.expression import Known, asker, holds, names_in, parse, value_of
from hpcwhirl.scene.quantities import CHAOS
from hpcwhirl.scene.words import DEFINED, MOTION_RULES, NO_REGIME, RULES, Rule

Words = NDArray[np.str_]
MOTION_NUMBERS = ("speed", *(name for name in CHAOS if name != "motion"))


def first_words(rules: tuple[Rule, ...], known: Mapping[str, Any]) -> Words:
    """Return for each of many cases the word of the first rule that holds, (cases,).

    "" where no rule holds.

    known : {name in the rules' conditions: its value in each case, (cases,)}
    """
    held = [
        np.logical_and.reduce([holds(parse(need), known) for need in rule.needs])
        for rule in rules
    ]
    shape = np.broadcast_shapes(*map(np.shape, held))
    conditions = [np.broadcast_to(np.asarray(each, bool), shape) for each in held]
    return np.select(conditions, [rule.word for rule in rules], default="")


def _first_word(rules: tuple[Rule, ...], known: Known) -> str:
    """Return the word of the first rule that holds in one case; "" if none does.

    known : {name in the rules' conditions: its value in the case}
    """
    for rule in rules:
        for need in rule.needs:
            if asker(need)(known) != 1:  # false, or missing
                break
        else:
            return rule.word
    return ""


def words_of_one(
    numbers: Mapping[str, Any], limits: Mapping[str, float]
) -> tuple[str, str, str]:
    """Return the words (outcome, regime, whirl) of one case.

    Regime and whirl are "none" if the outcome, such as unstable, allows no regime.

    numbers : {name of evidence: number}, and `stop`, why the run ended
    limits : {name of threshold: number}
    """
    known = Known({**numbers, **limits}, DEFINED)
    with np.errstate(all="ignore"):  # numbers of a run that blew up
        outcome, regime, whirl = (_first_word(rules, known) for rules in RULES.values())
    lost = outcome in NO_REGIME
    return outcome, "none" if lost else regime, "none" if lost else whirl


def words_by_table(
    numbers: Mapping[str, Any], limits: Mapping[str, float]
) -> tuple[Words, Words, Words]:
    """Return the words (outcome, regime, whirl) of many cases, three arrays (cases,).

    Regime and whirl are "none" if the outcome, such as unstable, allows no regime.

    Parameters
    ----------
    numbers : {name of evidence: (cases,)}, and `stop`, why each case's run ended
    limits : {name of threshold: number}
    """
    known = {**numbers, **limits}
    with np.errstate(all="ignore"):  # numbers of a run that blew up
        for name, text in DEFINED.items():
            known[name] = value_of(parse(text), known)
        outcome, regime, whirl = (
            np.broadcast_to(first_words(rules, known), np.shape(numbers["stop"]))
            for rules in RULES.values()
        )
    lost = np.isin(outcome, NO_REGIME)
    return outcome, np.where(lost, "none", regime), np.where(lost, "none", whirl)


def motions_by_table(
    regime: Words, numbers: Mapping[str, Any], limits: Mapping[str, float]
) -> Words:
    """Return the word `motion`, such as "periodic", of many cases, (cases,).

    Parameters
    ----------
    regime : (cases,), regime of each case
    numbers : {name: (cases,)} of the measured numbers of `scene.quantities.CHAOS`, such
        as exponent and period, NaN if not measured; and of `speed`, rad/s
    limits : {name of threshold: number}
    """
    with np.errstate(all="ignore"):
        turn = 2 * np.pi / np.abs(numbers["speed"])
        known = {**numbers, **limits, "regime": regime, "turn": turn}
        return np.broadcast_to(first_words(MOTION_RULES, known), np.shape(regime))


def motion_of(row: Mapping[str, Any], limits: Mapping[str, float]) -> str:
    """Return the word `motion`, such as "periodic", of one case.

    row, limits : {name of result: value in the case}; {name of threshold: number}
    """
    numbers = {name: np.array([row.get(name, np.nan)]) for name in MOTION_NUMBERS}
    word = motions_by_table(np.array([row["regime"]]), numbers, limits)
    return str(word[0])


def evidence_names() -> list[str]:
    """Return the names of the evidence that results must hold to derive all words."""
    texts = [*DEFINED.values()]
    texts += [need for rules in RULES.values() for rule in rules for need in rule.needs]
    names = set().union(*(names_in(parse(text)) for text in texts))
    return sorted(names - DEFINED.keys())


def as_data() -> dict[str, Any]:
    """Return all rules as plain data, which the report's page gets as JSON.

    Returns {"defined": {name: expression}, "tables": {"regime", ...: [{"word",
    "needs": conditions}]}}
    """
    tables = {
        name: [{"word": rule.word, "needs": list(rule.needs)} for rule in rules]
        for name, rules in RULES.items()
    }
    return {"defined": DEFINED, "tables": tables}
