"""Tables of the laws of contact and of friction between blade tips and casing.

The kernels' arguments of a contact law are made in `dynamics.bodies.operators`.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

from hpcwhirl.scene.kept_tables import kept_rows

RIGID = "rigid"


@dataclass(frozen=True)
class ContactLaw:
    """A law of contact between tips and casing: rigid, or with a layer that wears.

    Attributes
    ----------
    name : value of casing.contact_law
    meaning : explanation for users
    """

    name: str
    meaning: str


@dataclass(frozen=True)
class FrictionLaw:
    """A law of friction: how Coulomb's coefficient depends on the sliding speed.

    Attributes
    ----------
    name : value of friction_law
    meaning : explanation for users
    coefficient : function from mu, the coefficient at rest, the decay speed, m/s, the
        table of mu over speed and the sliding speed, m/s, to the coefficient
    """

    name: str
    meaning: str
    coefficient: Callable[[float, float, float, str, float], float]


def stribeck(
    kinetic: float, at_rest: float, decay: float, _: str, speed: float
) -> float:
    """Return Stribeck's friction coefficient, mu + (mu_s - mu) exp(-|v| / v_s).

    kinetic, at_rest : mu, mu_s; decay, speed : v_s, and sliding speed v, m/s
    """
    return kinetic + (at_rest - kinetic) * math.exp(-abs(speed) / decay)


def tabled(*given: Any) -> float:
    """Return the coefficient of a table: linear between its rows, then held.

    given : arguments of `FrictionLaw.coefficient`; of the last two, the kept text of a
        table that begins at speed 0, and the sliding speed, m/s
    """
    rows, speed = kept_rows(given[-2]), abs(float(given[-1]))
    for (slow, low), (fast, high) in itertools.pairwise(rows):
        if speed < fast:
            share = (speed - slow) / (fast - slow)
            return (1.0 - share) * low + share * high
    return rows[-1][1]


_TABLE = (
    ContactLaw(RIGID, "tips do not penetrate the casing"),
    ContactLaw("abradable", "a layer of plastic rods on the casing wears"),
    ContactLaw(
        "archard",
        "the casing wears in proportion to normal force and sliding distance",
    ),
)
_FRICTION = (
    FrictionLaw("constant", "mu", lambda kinetic, *_: kinetic),
    FrictionLaw(
        "stribeck",
        "mu + (friction_at_rest - mu) exp(-|Omega| R / friction_speed)",
        stribeck,
    ),
    FrictionLaw("table", "friction_table at |Omega| R", tabled),
)
PERMANENT, SET_VALUED = "permanent", "set-valued"
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
    """Return M, the number of rods into which the layer on the casing is divided.

    edge, radius : m, length of a tip's edge along the casing; radius of the casing
    rods : number of rods under one edge. All are scalars or (cases,), as M is
    """
    return (2 * math.pi * radius * rods / edge + 0.5) // 1
