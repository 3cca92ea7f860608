"""Perturbed twins of cases, by which the certainty of a regime is estimated.

A twin is its case with uncertain inputs multiplied by 1 + spread u. The number u,
uniform in -1 .. 1, depends only on the case's inputs (`identity`), the number of the
twin, the name of the input and the seed, so that a twin is the same wherever and
whenever it is computed.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from typing import Any

from hpcwhirl.errors import InputError
from hpcwhirl.planner.kinds import LATE
from hpcwhirl.scene import Scene, apply_settings, digest, flatten
from hpcwhirl.scene.campaign_tables import TwinsTable
from hpcwhirl.scene.table import Table, listed

CHAOS = "output.chaos"
# {input: default} of inputs that do not affect how twins are drawn
ASIDE = {n: flatten(Scene())[n] for n in ("solver.until", "solver.longest")}
ASIDE |= {n: flatten(Scene())[n] for n in ("output.traces", "output.interval")}
ASIDE |= {CHAOS: flatten(Scene())[CHAOS]}
BITS = 53  # number of bits in the significand of a double


class Twins(TwinsTable):
    """The table [twins], and the twins that follow from it."""

    @property
    def is_late(self) -> bool:
        """Whether the twins of a grid are chosen by the regimes of all its cases."""
        return self.of in LATE

    def scene(self, scene: Scene, content: str, number: int) -> Scene:
        """Return the scene of a twin of a case; a twin keeps no traces.

        Parameters
        ----------
        scene : the case
        content : digest of the case's engine file, see `scene.digest`
        number : number of the twin, 1 .. count
        """
        values, motion = flatten(scene), identity(scene, content)
        changed: dict[str, Any] = {"output.traces": "summary", CHAOS: 0.0}
        for name, spread in self.spread.items():
            factor = 1.0 + spread * draw(motion, number, name, self.seed)
            changed[name] = float(str(values[name])) * factor
        return apply_settings(scene, changed)


def identity(scene: Scene, content: str) -> str:
    """Return the digest of a case from which the perturbations of its twins are drawn.

    Inputs that set how long undecided cases continue and which traces are kept have no
    influence, so that a case with other values of them has the same twins.

    content : digest of the case's engine file, see `scene.digest`
    """
    return digest(apply_settings(scene, ASIDE), content)


def draw(motion: str, number: int, name: str, seed: int = 0) -> float:
    """Return a number drawn uniformly from -1 .. 1 for one input of one twin.

    Parameters
    ----------
    motion : digest of the case, see `identity`
    number : number of the twin, 1 .. count
    name : dotted name of the input
    seed : seed of the table [twins]
    """
    told = f"{motion} {number} {name}" + (f" {seed}" if seed else "")
    found = hashlib.sha256(told.encode()).digest()
    whole = int.from_bytes(found[:8]) >> (64 - BITS)
    return float(2.0 * whole / (2**BITS - 1) - 1.0)


def twins_of(document: Mapping[str, Any]) -> Twins | None:
    """Return the table [twins] of a document; None if it has none.

    Raises
    ------
    InputError
        naming the key, its value and what is allowed
    """
    if "twins" not in document:
        return None
    twins = Twins.read(document["twins"], "[twins]")
    if twins.of == "speckle" and "refine" not in document:
        msg = "[twins] of must be all, boundary or even (speckle needs [refine]), got "
        raise InputError(msg + "'speckle'")
    return twins


def check_spread(twins: Twins, base: Scene, rows: Table) -> None:
    """Refuse a relative spread of an input whose value is 0: twins would equal cases.

    Parameters
    ----------
    rows : {dotted input: value} that each case sets
    """
    values = flatten(base)
    for name in twins.spread:
        column = rows.column(name, values[name])
        zero = [place for place, v in enumerate(listed(column.values)) if v == 0.0]
        if zero:
            case = column.case_of(zero[0])
            msg = f"[twins] spread {name}: {name} is 0 in case {case}, and a relative "
            raise InputError(msg + "change of 0 has no effect: spread another input")


def twins_of_plan(plan: Mapping[str, Any]) -> Twins | None:
    """Return the twins of a plan; None if it has none."""
    return Twins(**plan) if plan else None
