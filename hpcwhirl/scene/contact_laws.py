"""Tables of the laws of contact and friction of tips and casing.

A scheme that cannot integrate a law is refused; `modal` uses `general` for a layer.
`dynamics.layer` makes the kernels' arguments of a contact law.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from hpcwhirl.errors import shown
from hpcwhirl.scene.rule import Rule
from hpcwhirl.scene.schemes import NAMES as SCHEMES
from hpcwhirl.scene.schemes import STEPWISE, either

RIGID = "rigid"
MOST_RODS = 10**6  # largest number of rods around a casing


@dataclass(frozen=True)
class ContactLaw:
    """Properties of a contact law.

    Attributes
    ----------
    name : value of casing.contact_law
    meaning : explanation for users
    schemes : names of the schemes that can integrate the law
    """

    name: str
    meaning: str
    schemes: tuple[str, ...]


@dataclass(frozen=True)
class FrictionLaw:
    """Properties of a friction law.

    Attributes
    ----------
    name : value of friction_law
    meaning : explanation for users
    coefficient : function from mu, the coefficient at rest, the decay speed, m/s, and
        the sliding speed, m/s, to the coefficient
    """

    name: str
    meaning: str
    coefficient: Callable[[float, float, float, float], float]


def stribeck(kinetic: float, at_rest: float, decay: float, speed: float) -> float:
    """Return mu + (mu_s - mu) exp(-|v| / v_s), the law of Stribeck."""
    return kinetic + (at_rest - kinetic) * math.exp(-abs(speed) / decay)


_TABLE = (
    ContactLaw(RIGID, "tips do not penetrate the casing", SCHEMES),
    ContactLaw("abradable", "a layer of plastic rods on the casing wears", STEPWISE),
    ContactLaw(
        "archard",
        "the casing wears in proportion to normal force and sliding distance",
        STEPWISE,
    ),
)
_FRICTION = (
    FrictionLaw("constant", "mu", lambda kinetic, *_: kinetic),
    FrictionLaw(
        "stribeck",
        "mu + (friction_at_rest - mu) exp(-|Omega| R / friction_speed)",
        stribeck,
    ),
)
LAWS = {law.name: law for law in _TABLE}
NAMES = tuple(LAWS)
FRICTION = {law.name: law for law in _FRICTION}
FRICTION_NAMES = tuple(FRICTION)
if TYPE_CHECKING:
    LawName = str
    FrictionName = str
else:
    LawName = Literal[NAMES]  # computed: type checkers see `str`
    FrictionName = Literal[FRICTION_NAMES]
MEANINGS = "; ".join(f"{law.name}: {law.meaning}" for law in _TABLE)
FRICTIONS = "; ".join(f"{law.name}: {law.meaning}" for law in _FRICTION)


def rods_around(edge: Any, radius: Any, rods: Any) -> Any:
    """Return M, the number of rods around the casing; scalars or (cases,).

    edge, radius : m, length of a tip's edge; of the casing
    rods : rods under a tip
    """
    return (2 * math.pi * radius * rods / edge + 0.5) // 1


def is_known(law: Any, scheme: Any) -> Any:
    """Return whether a scheme can integrate a contact law; scalars or (cases,)."""
    found: Any = False
    for one in _TABLE:
        for name in one.schemes:
            found = found | ((law == one.name) & (scheme == name))
    return found


def refused(law: str, scheme: str) -> str:
    """Return why a scheme is refused with a contact law."""
    return (
        f"scheme must be {either(LAWS[law].schemes)} where casing.contact_law is "
        f"{law}, got '{scheme}'"
    )


def _unless_rigid(name: str, usual: Any, told: str) -> Rule:
    """Return the rule that an input must be `usual` if the casing has a layer.

    told : text for the value `usual` in the message
    """
    return Rule(
        ("engine.casing.contact_law", name),
        lambda law, value: (law == RIGID) | (value == usual),
        lambda law, value: (
            f"{name} must be {told} where casing.contact_law is {law}, got "
            f"{shown(value)}"
        ),
    )


LAYER = (
    "engine.casing.contact_law",
    "engine.casing.layer_edge",
    "engine.rotor.radius",
)
RULES = (
    Rule(("engine.casing.contact_law", "solver.scheme"), is_known, refused),
    Rule(
        (*LAYER, "engine.rotor.blades"),
        lambda law, edge, radius, blades: (
            (law == RIGID) | (edge * blades <= math.pi * radius)
        ),
        lambda _, edge, radius, blades: (
            f"layer_edge must be <= {math.pi * radius / blades:.4g} m, half the "
            f"distance of two tips, got {edge}"
        ),
    ),
    Rule(
        (*LAYER, "engine.casing.layer_rods"),
        lambda law, edge, radius, rods: (
            (law == RIGID) | (rods_around(edge, radius, rods) <= MOST_RODS)
        ),
        lambda _, edge, radius, rods: (
            f"layer_rods must be <= {int(MOST_RODS * edge / radius / 6.3)}"
            f" with a layer_edge of {edge} m, got {rods}"
        ),
    ),
    Rule(
        (*LAYER, "speed", "solver.time_step"),
        lambda law, edge, radius, speed, step: (
            (law == RIGID) | (radius * abs(speed) * step <= edge)
        ),
        lambda _, edge, radius, speed, step: (
            f"time_step must be <= {edge / (radius * abs(speed)):.4g} s, in which a "
            f"tip moves by layer_edge, got {step}"
        ),
    ),
    _unless_rigid("output.chaos", 0, "0"),
    _unless_rigid("history", "", "empty, so no [branch],"),
)
