"""The same case with a longer time step, by which its error is estimated."""

from __future__ import annotations

from dataclasses import replace

from hpcwhirl.case.limits import shortest_limits
from hpcwhirl.case.resolve import Case
from hpcwhirl.scene import apply_settings
from hpcwhirl.scene.input_names import Value

TIMES = 2.0  # largest ratio of the longer step to the case's
BELOW = 0.95  # largest ratio of the longer step to the limit of stability
LEAST = 1.1  # least ratio of steps by which an error can be estimated


def longer_step(case: Case) -> Case | None:
    """Return a case with up to twice the time step; None if no longer one is stable.

    Modes, duration and all other inputs are the same.
    """
    longest = BELOW * min(shortest_limits(case.model, case.scene).values())
    step = min(TIMES * case.step, longest)
    if step < LEAST * case.step:
        return None
    alone: dict[str, Value] = {"until": "end", "estimate": "none", "chaos": 0.0}
    return replace(case, given=apply_settings(case.pinned(step), alone))
