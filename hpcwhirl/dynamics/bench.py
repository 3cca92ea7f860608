"""How long a step takes: schemes beside one another, in flight and in contact."""

from __future__ import annotations

import statistics
from collections.abc import Iterator
from dataclasses import dataclass

from hpcwhirl.dynamics.kernels.contact import TOUCHED
from hpcwhirl.dynamics.march import March
from hpcwhirl.scene import Scene, apply_settings

SETTLE = 0.02  # s of engine time before the clock: pulse over, blades touching
FAR = 1.0  # m, a gap that no blade crosses
SCHEMES = ("paper", "general", "modal")
STEPS = 5_000  # a repeat; the same steps for all, so the same contacts


@dataclass(frozen=True)
class Timing:
    """Cost of a step.

    Attributes
    ----------
    scheme : integrator
    lanes : cases marched together
    contact : share of the timed steps with at least one contact
    microseconds_per_step : median over the repeats, us a case-step
    spread : (largest - smallest) over median of the repeats
    """

    scheme: str
    lanes: int
    contact: float
    microseconds_per_step: float
    spread: float


def _settled(scene: Scene, scheme: str, *, contact: bool) -> March:
    settings: dict[str, float | str] = {"scheme": scheme, "duration": SETTLE}
    far: dict[str, float | str] = {} if contact else {"gap": FAR}
    march = March(apply_settings(scene, settings | {"traces": "summary"} | far))
    march.run()
    return march


def _state(march: March) -> list[object]:
    return [array.copy() for array in march.state]


def _restore(march: March, saved: list[object]) -> None:
    for array, value in zip(march.state, saved, strict=True):
        array[...] = value


def time_step(scene: Scene, scheme: str, repeats: int, *, contact: bool) -> Timing:
    """Return what a step costs, from the same state and steps in every repeat.

    Parameters
    ----------
    scene : the case; its duration is replaced
    scheme : integrator
    repeats : timed runs
    contact : whether blades touch; if not, the gap is `FAR`
    """
    march = _settled(scene, scheme, contact=contact)
    saved, steps = _state(march), STEPS
    march.total += steps
    march.stride = march.total + 1  # no samples
    spent, share = [], 0.0
    for _ in range(repeats):
        _restore(march, saved)
        march.seconds = 0.0
        before = march.counter[TOUCHED]
        march.advance(steps)
        share = float(march.counter[TOUCHED] - before) / steps
        spent.append(1e6 * march.seconds / steps)
    middle = statistics.median(spent)
    return Timing(scheme, 1, share, middle, (max(spent) - min(spent)) / middle)


def time_schemes(scene: Scene, repeats: int) -> Iterator[Timing]:
    """Yield the cost of every scheme, in flight and in contact."""
    for scheme in SCHEMES:
        for contact in (False, True):
            yield time_step(scene, scheme, repeats, contact=contact)
