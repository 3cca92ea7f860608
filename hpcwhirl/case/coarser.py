"""The same case computed coarser, by which its error is estimated.

The difference of two runs tells an error only of what both differ by. With the same
modes, a motion that too few waves of the ring have wrong has the same wrong radius
with any step.
"""

from __future__ import annotations

import math
from dataclasses import replace

from hpcwhirl.case.limits import shortest_limits
from hpcwhirl.case.profile import shape_of
from hpcwhirl.case.resolve import Case
from hpcwhirl.scene import apply_settings
from hpcwhirl.scene.input_names import Value

TIMES = 2.0  # largest ratio of the longer step to the case's
BELOW = 0.95  # largest ratio of the longer step to the limit of stability
LEAST = 1.1  # least ratio of steps by which an error can be estimated
WAVES = 2 / 3  # harmonics of the ring that are kept, relative to the case's
COARSER = 4.0  # truncation of a rotor from file, relative to the case's
ALONE: dict[str, Value] = {"until": "end", "estimate": "none", "chaos": 0.0}


def coarser(case: Case) -> Case | None:
    """Return the case that `solver.estimate` compares a case with; None: there is none.

    Its step is up to twice as long, as far as that is stable. With estimate "all" it
    also has fewer modes and waves, see `with_less`. All other inputs are the same.
    """
    less = with_less(case) if case.given.solver.estimate == "all" else {}
    alone = apply_settings(case.pinned(case.step), ALONE | less)
    other = replace(case, given=alone)
    longest = BELOW * min(shortest_limits(other.model, other.scene).values())
    step = min(TIMES * case.step, longest)
    if step < LEAST * case.step:
        if not less:
            return None
        step = case.step
    return replace(case, given=apply_settings(alone, {"time_step": step}))


def with_less(case: Case) -> dict[str, Value]:
    """Return inputs by which a case has fewer modes and waves; {}: it cannot.

    The rotor loses a family of modes, the ring a third of its harmonics, but not those
    of the load and of its shape. A rotor from file has fewer by `truncation` alone, a
    casing from file or of elements keeps all.
    """
    scene, asked = case.reduced, case.given.solver.truncation
    if scene.engine.file and asked > 0.0:
        return {"truncation": COARSER * asked}
    casing, modes, rotor = scene.engine.casing, scene.solver.modes, scene.engine.rotor
    less: dict[str, Value] = {}
    if not scene.engine.file and modes >= rotor.blades:
        less["modes"] = modes - rotor.blades
    if casing.kind == "ring" and casing.discretization in ("fourier", "shell"):
        orders = [o for o in shape_of(scene).orders.tolist() if o <= casing.harmonics]
        fewer = max(math.ceil(WAVES * casing.harmonics), scene.nodal_diameter, *orders)
        if fewer < casing.harmonics:
            less["casing.harmonics"] = fewer
    return less
