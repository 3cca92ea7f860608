"""The table [refine] of a campaign: what it may hold, and the rule that it makes."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from decimal import Decimal
from itertools import pairwise
from typing import Any

from hpcwhirl.campaign.plan.design import Design
from hpcwhirl.campaign.plan.refined import mean_seconds, of_rule
from hpcwhirl.errors import InputError, as_table, shown
from hpcwhirl.refinement.lattice import EXACT
from hpcwhirl.refinement.rule import SCALES, WORDS, Rule
from hpcwhirl.scene import apply_settings, preset_inputs, preset_names
from hpcwhirl.scene.files import check_kept, full_name, is_number, is_whole
from hpcwhirl.scene.quantities import WHOLE

KEYS = (
    "over", "resolution", "levels", "words", "scale", "speckle", "budget", "first",
    "confirm",
)  # fmt: skip
MOST_LEVELS = 16
MOST_OVER = 3
SPECKLE = 2  # levels
SAME = 1e-9  # relative: a resolution that is reached but for round-off is reached
CLOSEST = 1e-9  # relative difference of two values of an input
Listed = Mapping[str, Sequence[Any]]


def first_inputs(
    document: Mapping[str, Any], settings: Mapping[str, Any]
) -> dict[str, Any]:
    """Return {dotted name: value} that `first` of a document's [refine] sets.

    Parameters
    ----------
    document : of the campaign
    settings : {input: value}, of options, none of which may be lost unsaid
    """
    table = document.get("refine", {})
    name = table.get("first") if isinstance(table, Mapping) else None
    if name is None:
        return {}
    if isinstance(document.get("solver"), Mapping) and "preset" in document["solver"]:
        msg = "[refine] first and [solver] preset: the same thing twice, say one"
        raise InputError(msg)
    inputs = preset_inputs(_preset("first", name))
    clash = inputs.keys() & map(full_name, settings)
    if clash:
        msg = f"--set or --preset {min(clash)}: [refine] first sets this input"
        raise InputError(msg)
    check_kept(inputs | {full_name(n): value for n, value in settings.items()})
    return inputs


def refined(design: Design, table: Any, grid: Listed, listed: Sequence[Any]) -> Design:
    """Return the design that refines a coarse one.

    Parameters
    ----------
    design : of the coarse level
    table : [refine]
    grid : {dotted input: values} of [sweep]
    listed : cases of [[cases]]

    Raises
    ------
    InputError
        naming the key, what it got and what is allowed
    """
    as_table("[refine]", table, KEYS)
    if listed:
        msg = "[refine] has no cells between the cases of [[cases]]: use [sweep]"
        raise InputError(msg)
    over = _over(table, grid)
    _check_twins(design, table, {name: grid[name] for name in over})
    scales = _scales(table, over, grid)
    depths = _depths(table, over, grid, scales)
    confirm = _preset("confirm", table["confirm"]) if "confirm" in table else ""
    inputs = preset_inputs(confirm) if confirm else {}
    clash = set(inputs) & set(design.swept)
    if clash:
        msg = f"[refine] confirm {min(clash)}: the campaign sweeps this input"
        raise InputError(msg)
    if inputs and apply_settings(design.base, inputs) == design.base:
        msg = f"[refine] confirm = {shown(confirm)} is what the first cases have: "
        raise InputError(msg + 'say first = "draft", for example')
    rule = Rule(
        over, depths, scales, _word(table, "words", WORDS, WORDS[0]), _speckle(table),
        confirm, inputs,
    )  # fmt: skip
    budget = _budget(table.get("budget"), design, rule)
    return of_rule(design, replace(rule, budget=budget))


def _check_twins(design: Design, table: Mapping[str, Any], over: Listed) -> None:
    """Refuse twins beside a budget, and those that refining may lead to their case.

    over : {refined input: its values}
    """
    if design.twins is None:
        return
    if "budget" in table:
        msg = "[twins] and [refine] budget: it counts no twins, whose number follows "
        raise InputError(msg + "from words: say one of both")
    for name in over.keys() & design.twins.spread.keys():
        if min(over[name]) < 0 < max(over[name]):
            msg = f"[twins] spread {name}: refining may lead to 0, and a relative "
            raise InputError(msg + "change of 0 is none: spread another input")


def _over(table: Mapping[str, Any], grid: Listed) -> tuple[str, ...]:
    given = table.get("over")
    names = [given] if isinstance(given, str) else given
    allowed = f"one to {MOST_OVER} numeric inputs of [sweep]"
    if not isinstance(names, list) or not 0 < len(names) <= MOST_OVER:
        msg = f"[refine] over must be {allowed}, got {shown(given)}"
        raise InputError(msg)
    if not all(isinstance(name, str) for name in names):
        msg = f"[refine] over must be {allowed}, got {shown(given)}"
        raise InputError(msg)
    over = tuple(full_name(name) for name in names)
    for name in over:
        _check_side(name, grid)
    if len(set(over)) < len(over):
        msg = f"[refine] over names an input twice: {', '.join(over)}"
        raise InputError(msg)
    return over


def _check_side(name: str, grid: Listed) -> None:
    """Refuse what has no cells between its values."""
    if name not in grid:
        msg = f"[refine] over {name}: not in [sweep], which has {', '.join(grid)}"
        raise InputError(msg if grid else f"[refine] over {name}: there is no [sweep]")
    values = grid[name]
    numbers = [v for v in values if is_number(v) and math.isfinite(v)]
    if len(numbers) < len(values) or len(set(values)) < 2:
        msg = f"[refine] over {name}: two or more different numbers of [sweep] are "
        raise InputError(msg + f"wanted, got {shown(list(values))}")


def _each(table: Mapping[str, Any], key: str, over: Sequence[str]) -> dict[str, Any]:
    """Return {input: value} of a key that has one value, or one for each input."""
    given = table.get(key)
    if given is None:
        return {}
    if not isinstance(given, Mapping):
        return dict.fromkeys(over, given)
    out = {}
    for name, value in given.items():
        full = full_name(name)
        if full not in over:
            msg = f"[refine] {key} {full}: not among over = {', '.join(over)}"
            raise InputError(msg)
        out[full] = value
    return out


def _scales(
    table: Mapping[str, Any], over: Sequence[str], grid: Listed
) -> tuple[str, ...]:
    given = _each(table, "scale", over)
    for name, word in given.items():
        if word not in SCALES:
            msg = f"[refine] scale of {name} must be one of {', '.join(SCALES)}, "
            raise InputError(msg + f"got {shown(word)}")
        if word == "log" and min(grid[name]) <= 0:
            msg = f"[refine] scale of {name}: log needs values > 0, got "
            raise InputError(msg + shown(min(grid[name])))
        if word == "log" and name in WHOLE:
            msg = f"[refine] scale of {name}: an input of whole numbers is linear"
            raise InputError(msg)
    return tuple(given.get(name, "linear") for name in over)


def _depths(
    table: Mapping[str, Any], over: Sequence[str], grid: Listed, scales: Sequence[str]
) -> tuple[tuple[int, ...], ...]:
    levels, resolution = (_each(table, k, over) for k in ("levels", "resolution"))
    out = []
    for name, scale in zip(over, scales, strict=True):
        if (name in levels) == (name in resolution):
            msg = f"[refine] wants either levels or resolution of {name}"
            raise InputError(msg)
        values = sorted({Decimal(str(v)) for v in grid[name]})
        if name in levels:
            depths = [_level(name, levels[name])] * (len(values) - 1)
        else:
            finest = _resolution(name, resolution[name])
            depths = [
                _bisections(name, *pair, finest, scale) for pair in pairwise(values)
            ]
        _check_values(name, values, depths)
        out.append(tuple(depths))
    if not any(map(any, out)):
        msg = "[refine] refines nothing: its resolution is that of [sweep]"
        raise InputError(msg)
    return tuple(out)


def _level(name: str, given: Any) -> int:
    if not is_whole(given) or not 0 <= given <= MOST_LEVELS:
        msg = f"[refine] levels of {name} must be a whole number from 0 to "
        raise InputError(msg + f"{MOST_LEVELS}, got {shown(given)}")
    return int(given)


def _resolution(name: str, given: Any) -> Decimal:
    if not is_number(given) or not 0 < given < math.inf:
        msg = f"[refine] resolution of {name} must be a number > 0, got {shown(given)}"
        raise InputError(msg)
    return Decimal(str(given))


def _bisections(
    name: str, low: Decimal, high: Decimal, finest: Decimal, scale: str
) -> int:
    """Return how often an interval is bisected down to a resolution.

    On a logarithmic scale that is the relative step: 0.01 is one percent.
    """
    width = high - low
    if scale == "log":
        width, finest = EXACT.ln(high / low), EXACT.ln(1 + finest)
    for depth in range(MOST_LEVELS + 1):
        if width <= finest * Decimal(1 + SAME) * 2**depth:
            return depth
    msg = f"[refine] resolution of {name} takes more than {MOST_LEVELS} levels from "
    raise InputError(msg + f"{low} to {high}, got {finest}")


def _check_values(name: str, values: Sequence[Decimal], depths: Sequence[int]) -> None:
    """Refuse levels that lead to no whole number, or to values that are one."""
    for (low, high), depth in zip(pairwise(values), depths, strict=True):
        step = (high - low) / 2**depth
        if name in WHOLE and step != step.to_integral_value():
            most = max(d for d in range(depth) if (high - low) % 2**d == 0)
            msg = f"[refine] over {name}: {depth} levels from {low} to {high} lead to "
            raise InputError(msg + f"no whole numbers, at most {most} do")
        if step < Decimal(CLOSEST) * max(abs(low), abs(high)):
            msg = f"[refine] over {name}: {depth} levels from {low} to {high} lead to "
            raise InputError(msg + "values that are the same but for round-off")


def _word(
    table: Mapping[str, Any], key: str, known: Sequence[str], default: str
) -> str:
    word = table.get(key, default)
    if word not in known:
        msg = f"[refine] {key} must be one of {', '.join(known)}, got {shown(word)}"
        raise InputError(msg)
    return str(word)


def _preset(key: str, name: Any) -> str:
    return _word({key: name}, key, preset_names(), "")


def _speckle(table: Mapping[str, Any]) -> int:
    given = table.get("speckle", SPECKLE)
    if not is_whole(given) or not 0 <= given <= MOST_LEVELS:
        msg = "[refine] speckle must be a whole number of levels, 0 for never, got "
        raise InputError(msg + shown(given))
    return int(given)


def _budget(given: Any, design: Design, rule: Rule) -> tuple[float, ...]:
    """Return (total, of a case of each fidelity); empty for no limit.

    Parameters
    ----------
    given : {cases = N} or {core_hours = H}
    design, rule : of the campaign
    """
    if given is None:
        return ()
    kinds = ("cases", "core_hours")
    if not isinstance(given, Mapping) or len(given) != 1 or not {*given} <= {*kinds}:
        msg = "[refine] budget must be {cases = N} or {core_hours = H}, got "
        raise InputError(msg + shown(given))
    ((kind, amount),) = given.items()
    if not is_number(amount) or not 0 < amount < math.inf:
        msg = f"[refine] budget: {kind} must be a number > 0, got {shown(amount)}"
        raise InputError(msg)
    each = (1.0, 1.0)
    if kind == "core_hours":
        seconds = mean_seconds(of_rule(design, rule))
        each = (seconds[0] / 3600.0, seconds[1] / 3600.0)
    need = len(design.settings) * each[0]
    if amount < need:
        msg = f"[refine] budget: the coarse level alone takes {kind} = {need:.4g}, got "
        raise InputError(msg + shown(amount))
    return float(amount), *each
