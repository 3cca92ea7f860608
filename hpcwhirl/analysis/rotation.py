"""Effects of rotation on a rotor: frequencies, critical speeds, stability, growth."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from hpcwhirl.analysis.critical import critical_of_families, critical_of_waves
from hpcwhirl.case.resolve import Case, resolve
from hpcwhirl.case.unbalance import facts_of_unbalance
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.families import first_family, modal_table
from hpcwhirl.reduction.waves import (
    largest_growth,
    tip_growth,
    unbalance_speeds,
    unstable_from,
    wave_lines,
)
from hpcwhirl.scene import apply_settings

BESIDE = {"none": "full", "full": "none"}


def critical_of(case: Case, orders: int) -> list[dict[str, Any]]:
    """Return the critical speeds of Eq. (13), see `critical_of_families`.

    With full rotation, frequencies depend on the speed; a rotor of unequal sectors then
    has no waves of one nodal diameter, and no critical speeds are returned.
    """
    table = modal_table(case.model)
    if case.model.rotor.spin is None:
        return critical_of_families(table, orders)
    return critical_of_waves(case.model.rotor, first_family(table, "casing"), orders)


def lines_of(case: Case) -> list[dict[str, Any]]:
    """Return the rotor's frequencies at the case's speed, as records of `WaveLine`."""
    model = case.model
    return [
        asdict(line) for line in wave_lines(model.rotor, model.blades, case.given.speed)
    ]


def rotation_of_case(case: Case) -> dict[str, Any]:
    """Return the effects of rotation at the case's speed, as `model --json` shows them.

    Returns
    -------
    kind : engine.rotation
    growth : 1/s, growth rate of the least stable free motion
    unstable_from : rad/s, lowest speed where a free motion grows; None if none is found
    unbalance_speeds : rad/s, where an unbalance is in resonance with a wave of k = 1
    tip_growth : m, largest radial growth of a tip where rotation is full, else None;
        `gap` is the clearance that it leaves
    unbalance : the circle of the scene's unbalance, see `facts_of_unbalance`, or None
    """
    model, speed = case.model, case.given.speed
    turns = model.rotor.spin is not None
    growth = float(tip_growth(model.rotor, model.blades, speed).max())
    return {
        "kind": case.given.engine.rotation,
        "growth": largest_growth(model.rotor, model.blades, speed),
        "unstable_from": unstable_from(model.rotor, model.blades) if turns else None,
        "unbalance_speeds": unbalance_speeds(model.rotor),
        "tip_growth": growth if turns else None,
        "unbalance": facts_of_unbalance(model, case.given),
    }


def beside(case: Case) -> Case | None:
    """Return the case with the other choice of engine.rotation; None if not allowed."""
    other = BESIDE[case.given.engine.rotation]
    settings: dict[str, Any] = {"engine.rotation": other}
    if other == "none":
        settings |= {"engine.rotor.cross_coupling": 0.0, "unbalance": 0.0}
    try:
        return resolve(apply_settings(case.given, settings))
    except InputError:
        return None


def side_by_side(case: Case, orders: int) -> dict[str, Any]:
    """Return {"none": facts, "full": facts}, without and with the effects of rotation.

    Facts are those of `rotation_of_case`, `lines` and `critical_speeds`. An engine from
    file has only one of the two.
    """
    cases = [case, beside(case)]
    return {
        one.given.engine.rotation: {
            **rotation_of_case(one),
            "lines": lines_of(one),
            "critical_speeds": critical_of(one, orders),
        }
        for one in cases
        if one is not None
    }
