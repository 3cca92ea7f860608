"""Scheme `modal`: central differences of the amplitudes of modes or waves."""

from __future__ import annotations

from hpcwhirl.case.plan import Marched
from hpcwhirl.case.speed import law_of
from hpcwhirl.case.unbalance import weighs
from hpcwhirl.dynamics.schemes import general
from hpcwhirl.dynamics.schemes.equal_sectors import equal_sectors
from hpcwhirl.dynamics.schemes.integrator import Integrator
from hpcwhirl.dynamics.schemes.several_points import points_apart
from hpcwhirl.reduction.model import Model, has_waves, is_cyclic
from hpcwhirl.scene import Scene


def build(model: Model, scene: Scene, beat: int) -> Integrator:
    """Return the integrator of a scene by scheme `modal`, chosen by rotor and casing.

    - Three or more equal sectors, in a rigid casing or a ring of harmonics: waves of
      both bodies by slot.
    - Other rotors in such a casing, and tips with several contact points: waves of
      rotor and casing.
    - Two waves that nearly coincide, a mode that does not oscillate, or a ring of
      elements: the integrator of scheme `general`.

    beat : number of time steps between two rows of evidence
    """
    equal = has_waves(model) or is_cyclic(model)
    one = None
    if equal and model.rotor.points is None and not _swings(scene):
        one = equal_sectors(model, scene, beat)
    return one or points_apart(model, scene) or general.build(model, scene, beat)


def _swings(scene: Scene) -> bool:
    """Return whether the sag by the rotor's weight is a wave of its own in the scene.

    At a changing speed it is part of the motion without contact.
    """
    return weighs(scene) and law_of(scene) is None


def before_and_after(
    before: Marched, after: Marched, beat: int
) -> tuple[Integrator, Integrator]:
    """Return the integrators of a rotor before and after it loses a blade.

    The whole rotor is integrated as one of unequal sectors, so that both are of one
    kind. Two waves of either that nearly coincide leave both to scheme `general`.

    Parameters are those of `schemes.before_and_after`.
    """
    first, second = (points_apart(part.model, part.scene) for part in (before, after))
    if first is None or second is None:
        first, second = (general.build(*part[::-1], beat) for part in (before, after))
    return first, second
