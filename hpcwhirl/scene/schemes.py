"""Schemes as data: what the rooms know of each way to march a scene.

One row a scheme; who marches stands in `dynamics.schemes`, in the file of its name.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal


@dataclass(frozen=True)
class Scheme:
    """What is known of a scheme.

    Attributes
    ----------
    name : as in solver.scheme, and of its file
    meaning : for its users
    order : of a free mode's error in the step; infinite: none
    nominal : s a step, before anything is known of a case
    folds : whether one of many sectors may be marched alone; those that do not are
        what others are held against
    settles : whether it may be looked for a certificate, the rest in closed form
    flies : whether steps in which no blade can touch are jumped over
    cyclic : whether it refuses rotors and rings that are not the cyclic kernel's
    matrices : whether it marches coordinates, with M, D and K
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


_TABLE = (
    Scheme("modal", "cyclic amplitudes", 2, 0.2e-6, folds=True, settles=True),
    Scheme(
        "exact", "exact flow, flights and a certificate", math.inf, 0.25e-6, folds=True,
        flies=True, cyclic=True,
    ),
    Scheme(
        "general",
        "mode by mode, also takes over where modal cannot (unequal sectors, "
        "ring of elements, fewer than 3 blades)", 2, 0.8e-6,
    ),
    Scheme("paper", "the dense Algorithm 1, slow and obvious", 2, 14e-6, matrices=True),
)  # fmt: skip
SCHEMES = {scheme.name: scheme for scheme in _TABLE}
NAMES = tuple(SCHEMES)
if TYPE_CHECKING:
    SchemeName = str
else:
    SchemeName = Literal[NAMES]  # what a table gives a checker cannot know
DEFAULT = NAMES[0]
MEANINGS = "; ".join(f"{scheme.name}: {scheme.meaning}" for scheme in _TABLE)
