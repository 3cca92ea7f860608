"""Variables of results that only some inputs, or a user's function, ask for."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any

from hpcwhirl.scene.contact_laws import PERMANENT, RIGID
from hpcwhirl.scene.input_names import MISTUNING
from hpcwhirl.scene.quantities import (
    BLADES,
    CHAOS,
    ESTIMATED,
    LOADS,
    LOST,
    OVER_SPEED,
    SLIPPED,
    TUNED,
    WORN,
)
from hpcwhirl.scene.rules import CHANGING, NO_BLADE
from hpcwhirl.scene.units import Quantity
from hpcwhirl.store.directory.manifest import MEASURE, Manifest
from hpcwhirl.store.directory.record import Record

DETAIL = "output.traces"
MEASURED = "output.chaos"
ESTIMATE, NO_ESTIMATE = "solver.estimate", "none"
SLIP = "slip"
LAW = "engine.casing.contact_law"
BLADE = "engine.rotor.lost_blade"
FORCES = "output.forces"
# Entries of a row that mistuning leaves unchanged.
MODEL = ("modes", "time_step", "scheme")
LOOKED_AT = {"blades", "full"}
VALUES, WHY_NOT = "measured", "measure_message"  # entries of a record
REASON = Quantity("1", "why the user's function gave no numbers", kind="S240")


def measured_of(plan: Manifest) -> dict[str, Quantity]:
    """Return the variables of the user's function `measure`, {variable: unit, meaning}.

    `WHY_NOT`, the reason why a case has no numbers, is included; {} for a plan without
    such a function.
    """
    declared = plan.base.get(MEASURE) or {}
    if not declared:
        return {}
    found = {name: Quantity(*told) for name, told in declared.items()}
    return found | {WHY_NOT: REASON}


def asked_quantities(plan: Manifest) -> dict[str, Quantity]:
    """Return the variables that a plan's inputs ask for, {variable: unit, meaning}.

    These are numbers of blades, chaos, estimates, changing speed, loads of the shaft, a
    lost blade, wear.
    """
    found: dict[str, Quantity] = {}
    if details_of(plan) & LOOKED_AT:
        found |= BLADES | (TUNED if tuned_cases(plan) else {})
    found |= CHAOS if any(plan.values(MEASURED, 0.0)) else {}
    found |= ESTIMATED if {*plan.values(ESTIMATE, NO_ESTIMATE)} - {NO_ESTIMATE} else {}
    found |= OVER_SPEED if changes_in_time(plan) else {}
    loses = {*plan.values(BLADE, NO_BLADE)} - {NO_BLADE}
    found |= LOADS if loses or {*plan.values(FORCES, "none")} - {"none"} else {}
    found |= LOST if loses else {}
    found |= SLIPPED if {*plan.values(SLIP, PERMANENT)} - {PERMANENT} else {}
    return found | (WORN if {*plan.values(LAW, RIGID)} - {RIGID} else {})


def changes_in_time(plan: Manifest) -> bool:
    """Return whether speed, gap or rotor change in time in any case of a plan."""
    usual = CHANGING | {"lost_blade_time": 0.0}
    return any(any(plan.values(name, value)) for name, value in usual.items())


def details_of(plan: Manifest) -> set[str]:
    """Return all values that the input `output.traces` has in the cases of a plan."""
    return {*map(str, plan.values(DETAIL))}


def tuned_cases(plan: Manifest) -> dict[int, int]:
    """Return, for each mistuned case of a plan, the case with equal blades.

    The two have the same other inputs. Cases without such a partner are left out.

    plan : plan of the campaign

    Returns
    -------
    {number of a case: number of the case with equal blades}
    """
    if MISTUNING not in plan.swept:
        return {}
    keys = [_others(row) for row in plan.settings]
    patterns = [row.get(MISTUNING, plan.base[MISTUNING]) for row in plan.settings]
    tuned = {key: case for case, key in enumerate(keys) if not any(patterns[case])}
    return {case: tuned[key] for case, key in enumerate(keys) if key in tuned}


def _others(row: Mapping[str, Any]) -> str:
    own = {name: value for name, value in row.items() if name != MISTUNING}
    return json.dumps(own, sort_keys=True)


def amplification(record: Record | None, twin: Record | None) -> dict[str, float]:
    """Return the blade amplitude of a mistuned case over that with equal blades.

    Parameters
    ----------
    record, twin : records of the case, and of the case with equal blades and the same
        other inputs; None: not computed

    Returns
    -------
    {"amplification": ratio}; {} if either case has no blade amplitude or reached the
    amplitude limit, if the case with equal blades is at rest, or if entries `MODEL` of
    the two differ, as by `truncation`
    """
    own, tuned = ((one or {}).get("row") or {} for one in (record, twin))
    if any(own.get(name) != tuned.get(name) for name in MODEL):
        return {}
    if "amplitude" in {own.get("stop"), tuned.get("stop")}:
        return {}
    mine, size = (float(r.get("blade_amplitude", math.nan)) for r in (own, tuned))
    return {"amplification": mine / size} if size > 0.0 and mine >= 0.0 else {}
