"""Texts of `--explain`: what the plan of a case leaves out, and why that is safe."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any, TypedDict

import numpy as np

from hpcwhirl.case.bounds import bounds_of
from hpcwhirl.case.plan import Plan
from hpcwhirl.case.resolve import Case, resolve
from hpcwhirl.case.truncation import truncation_error
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.model import Model, has_families
from hpcwhirl.reduction.modes import ModalModel, has_centre
from hpcwhirl.scene import Scene, apply_settings
from hpcwhirl.scene.units import ANGULAR, in_shown
from hpcwhirl.structure.shaft import line_of, name_of


class Note(TypedDict):
    """Texts on a part of the model that a case's plan leaves out.

    Attributes
    ----------
    left_out, why, saves : which part, why that is safe, and how much work it saves
    """

    left_out: str
    why: str
    saves: str


def amplitudes(model: Model) -> int:
    """Return the number of modal amplitudes of rotor and casing together."""
    bodies = [body for body in (model.rotor, model.casing) if body is not None]
    return sum(len(body.omega) for body in bodies)


def _truncation(case: Case) -> Note:
    scene = case.reduced
    casing, solver = scene.engine.casing, scene.solver
    ring = ""
    if casing.kind == "ring":
        stretch = " and its stretching modes" if casing.families == "bending" else ""
        ring = f", harmonics of the ring above {casing.harmonics}{stretch}"
    error, asked = truncation_error(scene), solver.truncation
    return Note(
        left_out=f"fixed-interface modes above {solver.modes}{ring}",
        why=f"without them motions are wrong by an estimated {error:.2g}, at most "
        f"{asked:g} being allowed: not a bound, but an estimate that held for 19 of 20 "
        "random engines in their first contacts",
        saves=_spared(case),
    )


def _spared(case: Case) -> str:
    """Return a text: how many modal amplitudes remain, and the longest stable step.

    Both are also given for the model without truncation, if it can be computed.
    """
    scene = case.given
    few, limit = amplitudes(case.model), min(case.model.limits(scene.speed).values())
    kept = f"{few} modal amplitudes are left, and steps up to {limit:.3g} s"
    try:
        whole = resolve(apply_settings(case.given, {"truncation": 0.0})).model
    except InputError:  # the model cannot have these modes
        return kept
    many, usual = amplitudes(whole), min(whole.limits(scene.speed).values())
    return f"{kept}; without truncation, {many} and up to {usual:.3g} s"


def _folding(case: Case) -> Note:
    few, many = amplitudes(case.lean.model), amplitudes(case.model)
    k, blades, folds = case.given.nodal_diameter, case.model.blades, case.plan.folds
    return Note(
        left_out="nodal diameters and ring harmonics that are no multiples of "
        f"{folds}, and with them {blades - blades // folds} of {blades} blades and the "
        "shaft's centre, which stays at rest",
        why=f"{blades} equal blades and a load on {k} lobes are the same after a turn "
        f"by 360/{folds} degrees, and so is every motion from rest: exact, to "
        "round-off. All free motion decays at this speed, so that a motion without "
        "this symmetry could only grow out of round-off from contact to contact: after "
        "more than 12 touchdowns of a blade, or contact for longer than the rotor's "
        "slowest period, the case begins anew with the whole model (folds in the "
        "results is 1 then)",
        saves=f"{few} of {many} modal amplitudes are integrated",
    )


def _growing(plan: Plan) -> Note:
    return Note(
        left_out="nothing of the motion: all sectors are integrated, in all steps",
        why=f"a free motion of the engine grows by {plan.growth:.3g} 1/s without "
        "contact: any disturbance grows into it, also where the load would move all "
        "sectors alike, and no blade can be proved to touch no more",
        saves="nothing",
    )


def _settling(scene: Scene, plan: Plan) -> Note:
    certain = scene.solver.until == "certain"
    rest = "the rest of the run" if certain else "stepping through the rest of the run"
    ways = "it ends there, damped" if certain else "samples come from closed form"
    return Note(
        left_out=f"{rest}, once the amplitudes of all modes together are below the gap",
        why="all waves of rotor and casing decay, and the sum of their amplitudes "
        "bounds every gap for all time: no contact can recur (certificate in the "
        f"results); {ways}",
        saves=f"at best all steps after {plan.settling:.3g} s, when a ring that no "
        "blade touches swings by less than the gap, of "
        f"{scene.end_time:.3g} s",
    )


def _handing_over(why: str) -> Note:
    return Note(
        left_out="the jumps of scheme exact from contact to contact: scheme modal "
        "integrates all steps",
        why=why,
        saves="nothing",
    )


def notes_of(case: Case) -> list[Note]:
    """Return a `Note` on each part of the model that a case's plan leaves out."""
    scene, plan, notes = case.given, case.plan, []
    if scene.solver.truncation > 0.0 and has_families(scene):
        notes.append(_truncation(case))
    if case.handed_over:
        notes.append(_handing_over(case.handed_over))
    if plan.growth > 0.0 and scene.solver.plan == "lean":
        notes.append(_growing(plan))
    if plan.folds > 1:
        notes.append(_folding(case))
    elif scene.engine.rotor.centre == "clamped" and not scene.engine.file:
        notes.append(
            Note(
                left_out="the shaft's centre",
                why="it is clamped and has no coordinates",
                saves="one mode of k = 1",
            )
        )
    if plan.settles:
        notes.append(_settling(scene, plan))
    return notes


def facts_of_bounds(
    case: Case, row: Mapping[str, Any] | None = None
) -> list[dict[str, object]]:
    """Return facts on the bounds by which parts of a case are left out, see `Bound`.

    row : results of the case; None: before its run
    """
    found = bounds_of(case, row)
    return [bound._asdict() | {"told": bound.told} for bound in found]


def facts_of_plan(case: Case) -> dict[str, object]:
    """Return what `model --json` shows under `plan`: {name: fact on a case's plan}."""
    scene, model, plan, lean = case.reduced, case.model, case.plan, case.lean.model
    coordinates = {"rotor": len(model.rotor.omega)}
    further = 2 * model.blades * (model.each - 1)  # coordinates of contact points
    marched = {"rotor": len(lean.rotor.omega)}
    if model.casing and lean.casing:
        coordinates["casing"] = len(model.casing.omega)
        marched["casing"] = len(lean.casing.omega)
    return {
        "kind": scene.solver.plan,
        "modes": scene.solver.modes,
        "harmonics": scene.engine.casing.harmonics,
        "families": scene.engine.casing.families,
        "coordinates": coordinates,
        "marched": marched,
        "fixed_interface_modes": model.rotor.kept - further,
        "folds": plan.folds,
        "blades": lean.blades,
        "nodal_diameters": sorted({int(k) * lean.folds for k in lean.rotor.diameter}),
        "centre": plan.folds == 1 and has_centre(model.rotor, model.blades),
        "settles": plan.settles,
        "settling_time": plan.settling,
        "truncation_error": truncation_error(scene) if has_families(scene) else None,
        "left_out": notes_of(case),
        "fits": facts_of_fits(case.given),
        "bounds": facts_of_bounds(case),
    }


def facts_of_fits(scene: Scene) -> list[dict[str, object]]:
    """Return facts on each bearing over the whirl's frequency, with a sentence `told`.

    They are those of `structure.shaft.OverWhirl`.
    """
    rotor = scene.engine.rotor
    if not rotor.has_line:
        return []
    line, out = line_of(rotor.shaft), list[dict[str, object]]()
    for fit in line.over_whirl:
        name = name_of(line, line.supports[fit.support])
        low, high = (in_shown(x, ANGULAR) for x in (fit.low, fit.high))
        told = (
            f"{name}: coefficients over the whirl's frequency, {low} to {high}, by "
            f"branches of springs, dampers and masses ({fit.branches}): wrong by "
            f"{fit.error:.2g} of the dynamic stiffness at most, and beside a monotone "
            f"cubic between the table's rows by {fit.between:.2g}"
        )
        out.append({"name": name} | asdict(fit) | {"told": told})
    return out


def facts_of_file(rotor: ModalModel) -> dict[str, object]:
    """Return {name: fact} on whether the sectors of a rotor from file are equal.

    `told` is a sentence with the other facts; `deviation`, of the sectors, is None if
    modes cannot be paired, or if there are fewer than 3 blades.
    """
    symmetry = rotor.symmetry
    facts: dict[str, object] = {
        "equal_sectors": rotor.cyclic,
        "suspension_known": not np.isnan(rotor.centre_share).any(),
        "told": "rotor from file: fewer than 3 blades, without nodal diameters",
    }
    if rotor.points is not None:
        facts["told"] = (
            f"rotor from file: {rotor.points.count} contact points a tip, whose "
            "sectors are all integrated"
        )
    if symmetry is None:
        return facts | {"deviation": None, "tolerance": None, "where": None}
    size = symmetry.deviation if np.isfinite(symmetry.deviation) else None
    differ = "" if size is None else f" by {size:.2g} at most"
    way = "like those of the built-in one" if rotor.cyclic else "each by itself"
    sentence = (
        f"rotor from file: sectors differ{differ} ({symmetry.where}); up to "
        f"{symmetry.tolerance:g} they are taken for equal; they are integrated {way}"
    )
    where = {"tolerance": symmetry.tolerance, "where": symmetry.where}
    return facts | {"deviation": size, "told": sentence} | where
