"""Table of the time-integration schemes and their properties.

The implementation of a scheme is in `dynamics.schemes`, in the file of its name.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from hpcwhirl.scene.contact_laws import PERMANENT

NOMINAL_BLADES = 22  # number of blades to which times of steps refer
USUAL = 0.55, 1 / 7  # assumed shares: steps with contact; blades that touch in these
MOST_POINTS = 3  # most contact points per tip for which times of steps were measured


@dataclass(frozen=True)
class StepTimes:
    """Computing time of a time step, us, fitted to `python scripts/cost/sizes.py`.

    The fields are coefficients. With N blades, a step without contact takes
    flight (N / 22)^grows; one with t blades in contact takes contact (N / 22)^rises +
    (blade + row N) t more. With n > 1 contact points per tip, of which t in all touch,
    a step without contact takes still[0] + still[1] n times as long, one with contact
    pressed[0] + pressed[1] n times; this was measured for n = 2 and 3. Only `modal` has
    these factors; without them, each point is assumed to cost as much as a blade.
    `scripts/cost/step_costs.py` compares these times with measured ones.
    """

    flight: float
    grows: float
    contact: float
    rises: float
    blade: float
    row: float
    still: tuple[float, float] | None = None
    pressed: tuple[float, float] | None = None

    def step(self, blades: Any, share: Any, touching: Any, points: Any = 1) -> Any:
        """Return the mean computing time of a time step, us: a scalar or (cases,).

        blades, share : number of blades N; share of steps with contact, 0 to 1
        touching : mean number of blades, or points, that touch in a step with contact
        points : contact points per tip, n, a scalar or (cases,)
        """
        still, pressed = (_factor(own, points) for own in (self.still, self.pressed))
        blades = blades if self.still else blades * points
        size = blades / NOMINAL_BLADES
        more = self.contact * size**self.rises
        more = more + (self.blade + self.row * blades) * touching
        flight = self.flight * size**self.grows
        return (1 - share) * still * flight + share * pressed * (flight + more)


def _factor(of: tuple[float, float] | None, points: Any) -> Any:
    """Return the factor a + b n on the time of a step with n contact points per tip.

    It is 1 for n = 1, or if `of` is None.

    of, points : (a, b); n, a scalar or (cases,)
    """
    first, each = of or (1.0, 0.0)
    several = points > 1
    return several * (first + each * points) + (1 - several)


EQUAL = StepTimes(0.14, 1.0, 0.12, 1.25, 0.03, 0.0, (0.57, 0.1), (2.7, 0.1))
UNEQUAL = StepTimes(0.133, 1.25, 0.25, 1.55, 0.0, 0.0029, (0.46, 0.09), (2.0, 0.0))
FLYING = StepTimes(0.028, 0.0, 0.3, 1.7, 0.03, 0.0)  # `exact`
BY_MODES = StepTimes(4.6, 1.06, 5.0, 1.2, 0.3, 0.0)  # `general`
DENSE = StepTimes(14.0, 2.0, 3.2, 2.0, 0.0, 0.0)  # `paper`


@dataclass(frozen=True)
class Scheme:
    """Properties of a time-integration scheme.

    Attributes
    ----------
    name : value of solver.scheme, and name of its file
    meaning : explanation for users
    order : order, in the time step, of the error of a free mode; infinite: no error
    nominal : s, computing time of a step with 22 blades and usual contact (`USUAL`)
        without effects of rotation, assumed before any measurement
    folds : whether the scheme may integrate one of several equal sectors alone; schemes
        that do not fold serve as reference for those that do
    settles : whether the rest of a run may be computed in closed form after a
        certificate that no contact can recur
    flies : whether the scheme jumps over steps in which no blade can touch
    cyclic : whether the scheme always uses the kernel for equal sectors, and hands
        other models over to `modal`
    matrices : whether it integrates coordinates with M, D and K instead of modes
    turns : s, like `nominal`, with engine.rotation = "full" or "auto"
    times : how the time of a step depends on contact and blades, for equal sectors
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
    turns: float = 0.0
    times: StepTimes = BY_MODES

    def step_seconds(
        self,
        rotation: str,
        blades: Any,
        *,
        uneven: bool,
        share: float = USUAL[0],
        touching: Any = None,
        points: Any = 1,
    ) -> Any:
        """Return the assumed computing time of a time step, s, a scalar or (cases,).

        rotation : value of engine.rotation
        blades : number of blades N, one number or (cases,)
        uneven : whether blades differ
        share : share of steps with contact, 0 to 1
        touching : mean number of blades, or points, that touch in a step with contact;
            None: a usual number (`USUAL`)
        points : contact points per tip, one number or (cases,); above `MOST_POINTS` the
            time is extrapolated
        """
        own = self.nominal if rotation == "none" else self.turns
        times, part = UNEQUAL if uneven and self.folds else self.times, USUAL[1]
        usual = self.times.step(NOMINAL_BLADES, USUAL[0], part * NOMINAL_BLADES)
        touching = part * blades if touching is None else touching
        return own * times.step(blades, share, touching, points) / usual


_TABLE = (
    Scheme(
        "modal", "central differences of modes or waves", 2, 0.25e-6, folds=True,
        settles=True, turns=0.3e-6, times=EQUAL,
    ),
    Scheme(
        "exact", "exact motion of modes without contact, jumps to the next contact",
        math.inf, 0.24e-6, folds=True, flies=True, cyclic=True,
        turns=0.35e-6, times=FLYING,
    ),
    Scheme(
        "general",
        "central differences mode by mode, slow, also used where modal cannot be (a "
        "ring of elements; rotation at a changing speed if sectors differ)",
        2, 8e-6, turns=25e-6, times=BY_MODES,
    ),
    Scheme(
        "paper", "the paper's Algorithm 1 on full matrices, slow but simple", 2, 16e-6,
        matrices=True, turns=50e-6, times=DENSE,
    ),
)  # fmt: skip
SCHEMES = {scheme.name: scheme for scheme in _TABLE}
NAMES = tuple(SCHEMES)
MODAL = tuple(scheme.name for scheme in _TABLE if not scheme.matrices)
if TYPE_CHECKING:
    SchemeName = str
else:
    SchemeName = Literal[NAMES]  # computed, so that type checkers see `str`
DEFAULT = NAMES[0]
MEANINGS = "; ".join(f"{scheme.name}: {scheme.meaning}" for scheme in _TABLE)


def _speed_changes(get: Callable[[str], Any]) -> Any:
    rate, table = get("acceleration"), get("speed_table")
    return np.not_equal(rate, 0.0) | np.not_equal(table, "")


def follows_speed(get: Callable[[str], Any]) -> Any:
    """Return whether the friction of all tips changes with the speed in the run.

    Coefficients of waves hold for one friction, so that `general` takes over from
    `modal`. The result is a scalar or (cases,).

    get : function from an input's name to its value, a scalar or (cases,)
    """
    varies = np.not_equal(get("friction_law"), "constant")
    return _speed_changes(get) & varies & np.equal(get("slip"), PERMANENT)


def marched_by(get: Callable[[str], Any], uneven: Any) -> Any:
    """Return the name of the scheme whose times of steps hold: a scalar or (cases,).

    It is the one that [solver] names, or `general` where this takes over from `modal`.

    get : function from an input's name to its value, a scalar or (cases,)
    uneven : whether sectors differ or tips have several points; a scalar or (cases,)
    """
    turns = np.not_equal(get("engine.rotation"), "none")
    alone = _speed_changes(get) & turns & uneven
    asked = np.asarray(get("solver.scheme"))
    waves = np.isin(asked, MODAL)
    return np.where(waves & (follows_speed(get) | alone), "general", asked)


def either(names: Sequence[str]) -> str:
    """Return names of schemes as an enumeration for a message: 'a', 'b' or 'c'."""
    *most, last = map(repr, names)
    return f"{', '.join(most)} or {last}"
