"""The table [refine] of a campaign: check it, and make its rule of refinement."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence, Sized
from dataclasses import replace
from decimal import Decimal
from itertools import pairwise
from typing import Any, Protocol

from hpcwhirl.campaign.plan.sampling import Twins
from hpcwhirl.errors import InputError, shown
from hpcwhirl.refinement.lattice import EXACT
from hpcwhirl.refinement.rule import Rule
from hpcwhirl.refinement.words import BRANCH
from hpcwhirl.scene import Scene, apply_settings, preset_inputs
from hpcwhirl.scene.campaign_tables import MOST_LEVELS, Refine
from hpcwhirl.scene.input_names import full_name, is_number
from hpcwhirl.scene.plain_data import check_kept
from hpcwhirl.scene.quantities import WHOLE

SAME = 1e-9  # relative excess of a cell over the resolution that counts as round-off
CLOSEST = 1e-9  # least relative difference of two values of an input
Listed = Mapping[str, Sequence[Any]]


def first_inputs(
    document: Mapping[str, Any], refine: Refine | None, settings: Mapping[str, Any]
) -> dict[str, Any]:
    """Return {dotted name: value} of the inputs set by the preset `first` of [refine].

    These are the inputs of all first computations.

    Parameters
    ----------
    document : the campaign's TOML
    refine : its table [refine]
    settings : {input: value} of --set and --preset

    Raises
    ------
    InputError
        if `first` would override one of `settings` or a preset of [solver]
    """
    if refine is None or refine.first is None:
        return {}
    if isinstance(document.get("solver"), Mapping) and "preset" in document["solver"]:
        msg = (
            "`first` of [refine] and `preset` of [solver] both set the preset: give one"
        )
        raise InputError(msg)
    inputs = preset_inputs(refine.first)
    clash = inputs.keys() & map(full_name, settings)
    if clash:
        msg = (
            f"--set or --preset: {min(clash)} is set by `first` of [refine] already: "
            "change `first` in the file, or leave the option out"
        )
        raise InputError(msg)
    check_kept(inputs | {full_name(n): value for n, value in settings.items()})
    return inputs


class Coarse(Protocol):
    """What refinement needs to know of a campaign's coarse cases, those of [sweep].

    A `Design` has these attributes.
    """

    @property
    def base(self) -> Scene:
        """Scene with the inputs that no case changes."""

    @property
    def settings(self) -> Sized:
        """The inputs that each coarse case sets, {dotted input: value}."""

    @property
    def swept(self) -> Sequence[str]:
        """Dotted names of the swept inputs."""

    @property
    def twins(self) -> Twins | None:
        """The table [twins] of the campaign; None: there is no such table."""

    def mean_seconds(self, rule: Rule) -> tuple[float, float]:
        """Return the mean predicted kernel time of a coarse case, s.

        There are two: for its first computation (fidelity 0), and for the repetition
        with the preset `confirm` of the rule (fidelity 1).
        """


def refined(
    design: Coarse, table: Refine, grid: Listed, listed: Sequence[Any], branch: str = ""
) -> Rule:
    """Return the rule by which a campaign is refined, from its table [refine].

    Parameters
    ----------
    design : the coarse cases, those of [sweep]
    table : table [refine]
    grid : {dotted input: values} of [sweep]
    listed : cases of [[cases]], which are refused
    branch : input along which branches lead, "" without [branch]

    Raises
    ------
    InputError
        naming the key, its value and what is allowed
    """
    if listed:
        msg = "[refine] has no cells between the cases of [[cases]]: use [sweep]"
        raise InputError(msg)
    over = table.over
    _check_branch(table, branch)
    for name in over:
        _check_side(name, grid)
    _check_twins(design, table, {name: grid[name] for name in over})
    scales = tuple(table.scale.get(name, "linear") for name in over)
    for name, scale in zip(over, scales, strict=True):
        if scale == "log" and min(grid[name]) <= 0:
            msg = f"[refine] scale of {name}: log needs values > 0, got "
            raise InputError(msg + shown(min(grid[name])))
    depths = _depths(table, grid, scales)
    inputs = preset_inputs(table.confirm) if table.confirm else {}
    clash = set(inputs) & set(design.swept)
    if clash:
        msg = f"[refine] confirm {min(clash)}: the campaign sweeps this input"
        raise InputError(msg)
    if inputs and apply_settings(design.base, inputs) == design.base:
        msg = f"[refine] confirm = {shown(table.confirm)} sets nothing that the first "
        raise InputError(msg + 'cases do not have: set first = "draft", for example')
    if inputs and design.base.solver.estimate != "none":
        inputs["solver.estimate"] = "none"  # of the first cases, which it judges
    rule = Rule(  # along a branch a word changes once
        over,
        depths,
        scales,
        table.words,
        0 if branch else table.speckle,
        table.confirm or "",
        inputs,
    )
    budget = _budget(table.budget, design, rule)
    return replace(rule, budget=budget)


def _check_branch(table: Refine, branch: str) -> None:
    """Raise InputError if [refine] and [branch] do not go together.

    The words "branch" need the table [branch], which excludes other keys.

    Parameters
    ----------
    table : table [refine]
    branch : input along which branches lead, "" without [branch]
    """
    if not branch:
        if table.words == BRANCH:
            msg = f"[refine] words = {shown(BRANCH)} compares cases of [branch], which "
            raise InputError(msg + "this campaign does not have")
        return
    if table.words != BRANCH:
        msg = f"[refine] words must be {shown(BRANCH)} with [branch], got "
        raise InputError(msg + shown(table.words))
    if table.over != (branch,):
        msg = f"[refine] over must be {branch}, as in [branch], got "
        raise InputError(msg + ", ".join(table.over))
    for name in ("confirm", "budget"):
        if getattr(table, name) is not None:
            msg = f"[refine] {name} must not be set with [branch]: each case begins "
            raise InputError(msg + "where another case of its branch has ended")


def _check_twins(design: Coarse, table: Refine, over: Listed) -> None:
    """Raise InputError for twins with a budget, or of inputs that refining may make 0.

    Twins change inputs by a relative amount, which has no effect on 0.

    Parameters
    ----------
    design : the coarse cases
    table : table [refine]
    over : {refined input: its values}
    """
    if design.twins is None:
        return
    if table.budget:
        msg = "[twins] and [refine] budget exclude each other: the number of twins "
        raise InputError(msg + "depends on words, so that no budget can count them")
    for name in over.keys() & design.twins.spread.keys():
        if min(over[name]) < 0 < max(over[name]):
            msg = f"[twins] spread {name}: refining may lead to 0, and a relative "
            raise InputError(msg + "change of 0 has no effect: spread another input")


def _check_side(name: str, grid: Listed) -> None:
    """Raise InputError unless a refined input has two different numbers in [sweep].

    Parameters
    ----------
    name : the input
    grid : {dotted input: values} of [sweep]
    """
    if name not in grid:
        msg = f"[refine] over {name}: not in [sweep], which has {', '.join(grid)}"
        raise InputError(msg if grid else f"[refine] over {name}: there is no [sweep]")
    values = grid[name]
    numbers = [v for v in values if is_number(v) and math.isfinite(v)]
    if len(numbers) < len(values) or len(set(values)) < 2:
        msg = f"[refine] over {name}: [sweep] must have two or more different numbers "
        raise InputError(msg + f"of {name}, got {shown(list(values))}")


def _depths(
    table: Refine, grid: Listed, scales: Sequence[str]
) -> tuple[tuple[int, ...], ...]:
    out = []
    for name, scale in zip(table.over, scales, strict=True):
        values = sorted({Decimal(str(v)) for v in grid[name]})
        if name in table.levels:
            depths = [table.levels[name]] * (len(values) - 1)
        else:
            finest = Decimal(str(table.resolution[name]))
            depths = [
                _bisections(name, *pair, finest, scale) for pair in pairwise(values)
            ]
        _check_values(name, values, depths)
        out.append(tuple(depths))
    if not any(map(any, out)):
        raise InputError("[refine] refines nothing: its resolution is that of [sweep]")
    return tuple(out)


def _bisections(
    name: str, low: Decimal, high: Decimal, finest: Decimal, scale: str
) -> int:
    """Return how often an interval must be bisected to reach the resolution.

    Parameters
    ----------
    name : the input, for the message
    low, high : ends of the interval, in the input's unit
    finest : the resolution: a difference of values, or on a scale "log" a relative
        step: 0.01 is one percent
    scale : "linear" or "log"
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
    """Raise InputError if bisection gives fractions of whole numbers, or equal values.

    Parameters
    ----------
    name : the input
    values : its coarse values, ascending
    depths : number of bisections of each interval between them
    """
    for (low, high), depth in zip(pairwise(values), depths, strict=True):
        step = (high - low) / 2**depth
        if name in WHOLE and step != step.to_integral_value():
            most = max(d for d in range(depth) if (high - low) % 2**d == 0)
            msg = f"[refine] over {name}: {depth} levels from {low} to {high} lead to "
            raise InputError(msg + f"fractions; use at most {most} for whole numbers")
        if step < Decimal(CLOSEST) * max(abs(low), abs(high)):
            msg = f"[refine] over {name}: {depth} levels from {low} to {high} lead to "
            raise InputError(msg + "values that are the same but for round-off")


def _budget(
    given: Mapping[str, float] | None, design: Coarse, rule: Rule
) -> tuple[float, ...]:
    """Return the budget of a refined campaign, for `Rule`; () if there is none.

    Parameters
    ----------
    given : {cases = N} or {core_hours = H}; None: no budget
    design : the coarse cases
    rule : rule by which they are refined

    Returns
    -------
    (largest total cost, cost of a first computation, cost of its repetition with the
    preset `confirm`), in cases or core hours
    """
    if not given:
        return ()
    ((kind, amount),) = given.items()
    each = (1.0, 1.0)
    if kind == "core_hours":
        seconds = design.mean_seconds(rule)
        each = (seconds[0] / 3600.0, seconds[1] / 3600.0)
    need = len(design.settings) * each[0]
    if amount < need:
        msg = f"[refine] budget: the coarse level alone takes {kind} = {need:.4g}, got "
        raise InputError(msg + f"{amount:g}")
    return amount, *each
