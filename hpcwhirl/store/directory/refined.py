"""Plans of refined campaigns with all cases that were added, for gathering and maps.

The stored plan has the coarse cases only, those of [sweep]; the others follow from the
journals, or are listed in a results file.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from hpcwhirl.errors import StoreError
from hpcwhirl.planner.kinds import Grid, Refined
from hpcwhirl.planner.planner import Planner
from hpcwhirl.refinement.growth import Address, Growth
from hpcwhirl.refinement.rule import Family, rule_of
from hpcwhirl.refinement.tree import CONFIRM
from hpcwhirl.scene import preset_of
from hpcwhirl.scene.quantities import REFINED, variable_name
from hpcwhirl.scene.units import Quantity
from hpcwhirl.store.directory.campaign_directory import Directory
from hpcwhirl.store.directory.completions import digest_of, ended_in, family_of
from hpcwhirl.store.directory.manifest import Manifest, PlanFile, digests_of
from hpcwhirl.store.hdf5 import dtype

PLACE = "place_"  # prefix of the variable with a case's position along an input


@dataclass(frozen=True, kw_only=True)
class RefinedPlan(Manifest):
    """The plan of a refined campaign with all cases added so far.

    Attributes
    ----------
    addresses : address of each case (fidelity, level, panel, point)
    family : all cases that refinement could add
    growth : cases added so far, and their cells; None in a plan read from results
    twinned : addresses of the cases with twins; empty in a plan read from results
    """

    addresses: list[Address]
    family: Family
    growth: Growth | None = None
    twinned: frozenset[Address] = frozenset()


def full_plan(directory: Directory) -> Manifest:
    """Return the plan of a campaign with the refined cases that its journals require.

    The plan is unchanged if the campaign is not refined.

    Raises
    ------
    MissingFileError, StoreError
        where the directory has no plan, or the plan is damaged
    """
    plan = directory.plan.read()
    if not plan.refine:
        return plan
    return grown_plan(plan, ended_in(directory.journals, plan).planner())


def grown_plan(plan: Manifest, planner: Planner) -> Manifest:
    """Return a plan with all refined cases that a planner has added, in results' order.

    plan, planner : stored plan of a campaign; planner that knows which jobs have ended
    """
    kind = planner.kind
    if not isinstance(kind, Refined):
        return plan
    whole = _extended(plan, kind.family, kind.growth.ordered(), kind.digest)
    with_twins = np.flatnonzero(planner.twinned).tolist()
    twinned = {kind.family.address(planner.number(row)) for row in with_twins}
    return replace(whole, growth=kind.growth, twinned=frozenset(twinned))


def _extended(
    plan: Manifest,
    family: Family,
    more: Sequence[Address],
    digest: Callable[[int], str],
) -> RefinedPlan:
    whole = {field.name: getattr(plan, field.name) for field in fields(Manifest)}
    names = (digest(family.number(address)) for address in more)
    whole["digests"] = [*plan.digests, *names]
    whole["settings"] = [*plan.settings, *map(family.settings, more)]
    return RefinedPlan(**whole, addresses=[*family.coarse, *more], family=family)


def rows_of(plan: Manifest, planner: Planner) -> NDArray[np.int64]:
    """Return the row that each case of a plan has in a planner's arrays, (cases,).

    Parameters
    ----------
    plan : plan with all refined cases, from `grown_plan`
    planner : planner of the campaign, which lists refined cases in another order
    """
    if not isinstance(plan, RefinedPlan):
        return np.arange(len(planner))
    numbers = map(plan.family.number, plan.addresses)
    return np.array([planner.row(case) for case in numbers], dtype=np.int64)


def with_twins(plan: Manifest, words: Sequence[str]) -> NDArray[np.bool_]:
    """Return for each case of a plan whether it has twins, (cases,).

    words : regime of each case; "": it has none
    """
    if isinstance(plan, RefinedPlan):
        return np.array([a in plan.twinned for a in plan.addresses], dtype=bool)
    kind = Grid(plan.settings, plan.swept, plan.digests, plan.twins)
    return kind.twinned(words)


def dropped_of(plan: Manifest) -> int:
    """Return the number of refined cases that the budget of a plan has excluded."""
    growth = plan.growth if isinstance(plan, RefinedPlan) else None
    return growth.dropped if growth else 0


def plan_of_results(path: Path, file: h5py.File) -> Manifest:
    """Return the plan of a results file, with its cases in the order of the file.

    Parameters
    ----------
    path, file : results file, and the same file opened

    Raises
    ------
    MissingFileError, StoreError
        if the file's directory has no plan, or plan and file do not belong together
    """
    plan = PlanFile(path.parent).read()
    if not plan.refine:
        return plan
    family, coarse = family_of(plan), len(plan.digests)
    places = [PLACE + variable_name(name) for name in family.rule.over]
    if any(name not in file for name in ("fidelity", "panel", *places)):
        return plan  # gathered before the campaign was refined
    fidelity, panel = (file[n][coarse:] for n in ("fidelity", "panel"))
    at = np.stack([file[name][coarse:] for name in places], axis=-1)
    more = []
    for fid, number, row in zip(fidelity, panel, at, strict=True):
        sides = zip(family.lattice.sides, row.tolist(), strict=True)
        point = tuple(side.place(place) for side, place in sides)
        if not 0 <= number < len(family.panels) or not 0 <= fid <= 1:
            msg = f"{path} and its campaign.json differ: gather the campaign again"
            raise StoreError(msg)
        level = family.lattice.level(point)
        more.append(Address(int(fid), level, int(number), point))
    return _extended(plan, family, more, digest_of(plan, family))


def superseded(plan: Manifest) -> NDArray[np.bool_]:
    """Return for each case of a plan whether its word no longer counts, (cases,).

    It does not where the confirming preset has given a word at the same point; nor does
    the repetition where it has given none.
    """
    if not isinstance(plan, RefinedPlan) or plan.growth is None:
        return np.zeros(len(plan.digests), dtype=bool)
    words = [tree.words[CONFIRM] for tree in plan.growth.trees]
    second = (words[a.panel].get(a.point) is not None for a in plan.addresses)
    pairs = zip(plan.addresses, second, strict=True)
    return np.array([a.fidelity != int(s) for a, s in pairs], dtype=bool)


def columns_of(plan: Manifest) -> dict[str, NDArray[Any]]:
    """Return the variables that refinement adds to results, {variable: (cases,)}.

    They say how each case was added: fidelity, level, panel, place along each input; {}
    for a plan that is not refined.
    """
    if not isinstance(plan, RefinedPlan) or plan.growth is None:
        return {}
    family, rows = plan.family, plan.addresses
    names = preset_of(digests_of(plan).base), family.rule.confirm
    columns: dict[str, list[Any]] = {
        "preset": [names[a.fidelity].encode() for a in rows],
        "final": (~superseded(plan)).tolist(),
    }
    for name in ("fidelity", "level", "panel"):
        columns[name] = [getattr(a, name) for a in rows]
    out = {n: np.array(v, dtype(REFINED[n])) for n, v in columns.items()}
    for number, side in enumerate(family.lattice.sides):
        name = PLACE + variable_name(side.name)
        out[name] = np.array([side.position(a.point[number]) for a in rows])
    return out


def refined_quantities(plan: Manifest) -> dict[str, Quantity]:
    """Return {variable: unit and meaning} of the variables that refinement adds."""
    if not plan.refine:
        return {}
    told = "position along its coarse values, from 0: 3.25 is a quarter past the fourth"
    names = [PLACE + variable_name(name) for name in rule_of(plan.refine).over]
    return REFINED | {name: Quantity("1", told, kind="f8") for name in names}
