"""How a case is integrated, in words: `hpcwhirl model --explain`.

The scheme `modal` takes waves where each mode, or pair of modes, is one; otherwise the
loop of bodies, in modes, integrates the case: this tells why, and which modes are none.
"""

from __future__ import annotations

from typing import Any, TypedDict

import numpy as np

from hpcwhirl.case.limits import beat_of
from hpcwhirl.case.plan import Marched
from hpcwhirl.case.resolve import Case
from hpcwhirl.case.speed import law_of
from hpcwhirl.dynamics.bodies.motion import BODIES
from hpcwhirl.dynamics.kernels.loop.wave_types import (
    FlowRows,
    PointRows,
    SectorRows,
    SlotRows,
)
from hpcwhirl.dynamics.schemes import before_and_after, scheme_of
from hpcwhirl.dynamics.schemes.by_sectors import folds_well
from hpcwhirl.dynamics.schemes.integrator import Integrator
from hpcwhirl.dynamics.waves.mode_waves import mode_waves
from hpcwhirl.reduction.model import Model
from hpcwhirl.scene import Scene
from hpcwhirl.scene.schemes import DEFAULT
from hpcwhirl.structure import RingOperator

WAYS = {  # {type of the rows of the loop of waves: what they are}
    SlotRows: "waves by nodal diameter",
    FlowRows: "waves by nodal diameter, with jumps over steps without contact",
    SectorRows: "waves, with rows for the contact points of one blade, as sectors are "
    "equal",
    PointRows: "waves, with a row for each contact point",
}
MODES, MATRICES = "modes of both bodies, slowly", "matrices of both bodies, slowly"
MOST = 6  # largest number of modes that the text names


class ModeAside(TypedDict):
    """A mode that is no wave.

    Attributes
    ----------
    body, frequency, damping_ratio : rotor or casing; Hz, undamped; 1 is critical
    """

    body: str
    frequency: float
    damping_ratio: float


class Integration(TypedDict):
    """How a case is integrated.

    Attributes
    ----------
    scheme, by : the scheme asked for; what it integrates
    why : why it does not integrate waves, "" if it does or none were asked for
    no_waves : modes that are no waves, since they do not oscillate in the time step
    until, before : if a blade is lost during the run, s, the time until which this
        holds, and what holds before; else None
    """

    scheme: str
    by: str
    why: str
    no_waves: list[ModeAside]
    until: float | None
    before: Integration | None


def integration_of(case: Case) -> Integration:
    """Return how a case is integrated, see `Integration`."""
    lean = case.lean
    if not folds_well(lean.model, lean.scene):
        lean = case.whole
    beat = beat_of(lean.model, lean.scene)
    if case.before is None:
        return _of(lean, scheme_of(lean.model, lean.scene, beat))
    pair = before_and_after(case.before, lean, beat)
    before, after = _of(case.before, pair[0]), _of(lean, pair[1])
    before["until"], after["before"] = case.reduced.lost_blade_time, before
    return after


def _of(marched: Marched, scheme: Integrator) -> Integration:
    """Return how a scene and its model are integrated by a scheme."""
    model, scene = marched.model, marched.scene
    rotor: Any = scheme.arrays.rotor
    by = WAYS.get(type(getattr(rotor, "rows", None)), MODES)
    if scene.solver.scheme == "paper":
        by = MATRICES
    asked = by == MODES and scene.solver.scheme == DEFAULT
    aside = modes_aside(model, scene.solver.time_step) if asked else []
    why = _why(model, scene, aside) if asked else ""
    return Integration(
        scheme=scene.solver.scheme, by=by, why=why, no_waves=aside, until=None,
        before=None,
    )  # fmt: skip


def modes_aside(model: Model, step: float) -> list[ModeAside]:
    """Return the modes of both bodies that do not oscillate in a time step.

    They have no stiffness, or damping at or above critical. Modes of a rotor with terms
    of rotation are not looked at: its waves are others.

    step : dt, s
    """
    found = []
    for name, body in zip(BODIES, (model.rotor, model.casing), strict=True):
        if body is None or body.spin is not None:
            continue
        ratios = np.broadcast_to(body.ratios, body.omega.shape)
        for m in np.flatnonzero(~mode_waves(body, step).oscillates):
            frequency = float(body.omega[m]) / (2 * np.pi)
            damping = float(ratios[m])
            found.append(
                ModeAside(body=name, frequency=frequency, damping_ratio=damping)
            )
    return found


def _why(model: Model, scene: Scene, aside: list[ModeAside]) -> str:
    """Return why scheme `modal` integrates no waves here."""
    if isinstance(model.ring, RingOperator):
        return "a ring of elements is not the same at every angle"
    if aside:
        named = [
            f"{one['body']} {one['frequency']:.4g} Hz, damping {one['damping_ratio']:g}"
            for one in aside[:MOST]
        ]
        more = f" and {len(aside) - MOST} more" if len(aside) > MOST else ""
        return f"modes that do not oscillate are no waves: {'; '.join(named)}{more}"
    if model.rotor.spin is not None and law_of(scene) is not None:
        return (
            "unequal sectors, or several points a tip, with terms of rotation at a "
            "changing speed"
        )
    return "two waves nearly coincide at this speed"


def told_of(found: Integration) -> str:
    """Return how a case is integrated, as a sentence for each part of the run."""
    before = found["before"]
    if before is None:
        return f"integrated {_way(found)}"
    after = "in the same way" if _way(before) == _way(found) else _way(found)
    return (
        f"until {before['until']:g} s the whole rotor is integrated {_way(before)}; "
        f"from then on the rotor without the lost blade, {after}"
    )


def _way(found: Integration) -> str:
    text = f"by scheme {found['scheme']}: {found['by']}"
    return f"{text} ({found['why']})" if found["why"] else text
