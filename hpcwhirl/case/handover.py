"""Where scheme `exact` hands over to `modal`, and why.

`exact` multiplies the amplitude of each wave by its factor e^{s dt} and jumps from
contact to contact. That needs one set of waves for the whole run, the same at every
angle, each with its own root s, and an impulse as the only force of contact. A scene
without these is integrated by `modal`, step by step.
"""

from __future__ import annotations

from hpcwhirl.case.speed import changes
from hpcwhirl.case.unbalance import weighs
from hpcwhirl.reduction.model import Model, has_waves, is_cyclic
from hpcwhirl.scene import Scene
from hpcwhirl.scene.contact_laws import RIGID

TOLD = "scheme exact hands over to modal: "


def handed_over(model: Model, scene: Scene) -> str:
    """Return why scheme `exact` hands a scene over to `modal`; "": it does not.

    model : the model of all sectors
    """
    if not scene.solver.flies:
        return ""
    casing, spin = scene.engine.casing, model.rotor.spin
    reasons = (
        (changes(scene), "speed or gap change in time"),
        (casing.profile_release > 0.0, "a casing is let go"),
        (casing.contact_law != RIGID, "the casing wears"),
        (
            spin is not None and not spin.is_plain,
            "supports differ by direction, have a film, or are stops",
        ),
        (weighs(scene), "the rotor's weight moves it in its own frame"),
        (model.rotor.points is not None, "tips have several contact points"),
        (
            not (is_cyclic(model) or has_waves(model)),
            "it needs three or more equal blades in a ring of harmonics or a rigid one",
        ),
        (_most_damped(model) >= 1.0, "it needs damping < 1 in every mode"),
    )
    return next((why for holds, why in reasons if holds), "")


def _most_damped(model: Model) -> float:
    bodies = [body for body in (model.rotor, model.casing) if body is not None]
    return max(float(body.ratios.max()) for body in bodies)
