"""Integrators of a rotor before and after it loses a blade, one after the other.

Both must be of one kind, so that the state, its works and the samples of the first go
on in the second: the whole rotor is integrated as one of unequal sectors.
"""

from __future__ import annotations

from hpcwhirl.case.plan import Marched
from hpcwhirl.dynamics.schemes import general, scheme_of
from hpcwhirl.dynamics.schemes.integrator import Integrator
from hpcwhirl.dynamics.schemes.several_points import points_apart


def before_and_after(
    before: Marched, after: Marched, beat: int
) -> tuple[Integrator, Integrator]:
    """Return the integrators of the rotor with all its blades, and without one.

    before, after : scene and model until and from the loss of a blade
    beat : number of time steps between two rows of evidence
    """
    if after.scene.solver.scheme == "modal":
        waves = [points_apart(part.model, part.scene) for part in (before, after)]
        if waves[0] and waves[1]:
            return waves[0], waves[1]
        # two waves of one rotor nearly coincide
        first, second = (general.build(*part[::-1], beat) for part in (before, after))
        return first, second
    first, second = (scheme_of(*part[::-1], beat) for part in (before, after))
    return first, second
