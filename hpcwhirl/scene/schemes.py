"""Table of the time-integration schemes and their properties.

The implementation of a scheme is in `dynamics.schemes`, in the file of its name.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

NOMINAL_BLADES = 22
GROWTH = 1.6  # exponent of the time of a step over blades: `hpcwhirl bench --sizes`


@dataclass(frozen=True)
class Scheme:
    """Properties of a scheme.

    Attributes
    ----------
    name : value of solver.scheme, and name of its file
    meaning : explanation for users
    order : order, in the time step, of the error of a free mode; infinite: no error
    nominal : computing time of a step of 22 blades, s, assumed before any measurement
    folds : whether one of many equal sectors may be computed alone; schemes that do
        not fold serve as reference for those that do
    settles : whether the rest of a run may be computed in closed form after a
        certificate that no contact can recur
    flies : whether it jumps over steps in which no blade can touch
    cyclic : whether it uses the cyclic kernel, and so refuses other rotors and rings
    matrices : whether it integrates coordinates with M, D and K instead of modes
    stands : whether supports in the static frame may differ by direction
    points : whether tips may have several contact points
    turns : `nominal` with engine.rotation = "full", s, assumed for "auto", too
    uneven : factor by which a step of unequal sectors takes longer
    """

    name: str
    meaning: str
    order: float
    nominal: float
    folds: bool = False
    settles: bool = False
    flies: bool = False
    cyclic: bool = False
    matrices: bool = False
    stands: bool = True
    points: bool = True
    turns: float = 0.0
    uneven: float = 1.0

    def step_seconds(self, rotation: str, blades: Any, *, uneven: bool) -> Any:
        """Return the assumed computing time of a step, s, as `blades` one or (cases,).

        rotation, blades : engine.rotation, N
        uneven : whether blades differ
        """
        own = self.nominal if rotation == "none" else self.turns
        more = self.uneven if uneven else 1.0
        return own * more * (blades / NOMINAL_BLADES) ** GROWTH


_TABLE = (
    Scheme(
        "modal", "cyclic amplitudes", 2, 0.2e-6, folds=True, settles=True, turns=0.3e-6,
        uneven=1.7,
    ),
    Scheme(
        "exact", "exact flow, flights and a certificate", math.inf, 0.25e-6, folds=True,
        flies=True, cyclic=True, stands=False, points=False, turns=0.35e-6,
    ),
    Scheme(
        "general",
        "mode by mode, also takes over where modal cannot (several contact points a "
        "tip, a ring of elements, supports that differ by direction)",
        2, 0.8e-6, turns=25e-6,
    ),
    Scheme(
        "paper", "the dense Algorithm 1, slow and obvious", 2, 14e-6, matrices=True,
        turns=50e-6,
    ),
)  # fmt: skip
SCHEMES = {scheme.name: scheme for scheme in _TABLE}
NAMES = tuple(SCHEMES)
if TYPE_CHECKING:
    SchemeName = str
else:
    SchemeName = Literal[NAMES]  # computed, so that type checkers see `str`
DEFAULT = NAMES[0]
MEANINGS = "; ".join(f"{scheme.name}: {scheme.meaning}" for scheme in _TABLE)
