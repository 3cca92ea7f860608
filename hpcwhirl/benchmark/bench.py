"""Timing of one time step of each scheme, in flight (without contact) and in contact.

A request names a scene and a scheme; a march is the integration whose steps are timed.
"""

from __future__ import annotations

import math
import statistics
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from hpcwhirl.case.profile import is_round
from hpcwhirl.case.resolve import resolve
from hpcwhirl.case.speed import changes
from hpcwhirl.dynamics.kernels.contact import LAST, STEP, TOUCHED
from hpcwhirl.dynamics.march import March
from hpcwhirl.scene import Scene, apply_settings
from hpcwhirl.scene.schemes import DEFAULT, NAMES, SCHEMES

SETTLE = 0.02  # s, simulated before timing, until the pulse is over and blades touch
OWN = "as given"  # name of the scene's own engine
FULL = "rotation full"  # prefix of the names of variants with rotation
OPERATION: dict[str, dict[str, float | str]] = {  # {name of a variant: its inputs}
    "speed that changes": {"acceleration": 100.0},
    "gap that closes": {"gap_closure": 1e-6, "gap_time": 0.1},
    "casing not round": {"profile": "harmonic,amplitude,phase;2,1e-6,0;3,5e-7,1"},
    "layer that wears": {"contact_law": "archard"},
    "friction by slip": {"slip": "set-valued"},
    "tips that stick": {"slip": "set-valued", "speed": 1.0, "friction": 0.5},
}
UNEVEN = 0.03  # relative amplitude of the blades' Young's moduli, if mistuned
FAINT = 1e-150  # N, a pulse that leaves amplitudes below 1e-150
FAR = 1.0  # m, a gap that no blade closes
STEPS = 5_000  # steps timed in each repeat, always from the same state


@dataclass(frozen=True)
class Timing:
    """Measured time of a step of one scheme on one engine.

    Attributes
    ----------
    scheme : name of the integrator
    engine : name of the engine: `OWN` for the scene's, or that of a variant
    contact : share of the timed steps that have contact
    touching : mean number of blades in contact in a step with contact; of contact
        points if a tip has several
    microseconds_per_step : median over the repeats, us
    spread : (largest - smallest) / median of the repeats' times
    """

    scheme: str
    engine: str
    contact: float
    touching: float
    microseconds_per_step: float
    spread: float


def settled(scene: Scene, scheme: str, *, contact: bool) -> March:
    """Return the integration of a scene whose steps are to be timed.

    It has been advanced beyond the pulse, and stores no samples.

    scheme, contact : name of the integrator; whether blades may touch; otherwise the
        gap is `FAR`
    """
    step = scene.solver.time_step
    settings: dict[str, float | str] = {"scheme": scheme}
    settings |= {"duration": SETTLE + (STEPS + 1) * step, "revolutions": 0.0}
    far: dict[str, float | str] = {} if contact else {"gap": FAR}
    march = March(
        resolve(apply_settings(scene, settings | {"traces": "summary"} | far))
    )
    march.advance(int(SETTLE / step))
    march.beat = march.stride = march.total + 1  # no samples
    return march


@dataclass(frozen=True)
class Asked:
    """A request to time the steps of a scene by one scheme.

    Attributes
    ----------
    scene, scheme : the scene; name of the integrator
    contact : whether blades may touch; if not, the gap is `FAR`
    engine : name of the engine in the resulting `Timing`
    """

    scene: Scene
    scheme: str
    contact: bool
    engine: str = OWN


def time_steps(asked: Sequence[Asked], repeats: int) -> list[Timing]:
    """Make the integration for each request, time its steps, and return the timings.

    asked, repeats : the requests; number of times that the steps of each are timed
    """
    return time_marches(asked, settled_all(asked), repeats)


def settled_all(asked: Sequence[Asked]) -> list[March]:
    """Return for each request the integration whose steps are to be timed.

    Each has been advanced beyond the pulse, see `settled`.
    """
    return [settled(a.scene, a.scheme, contact=a.contact) for a in asked]


def time_marches(
    asked: Sequence[Asked], marches: Sequence[March], repeats: int
) -> list[Timing]:
    """Time the steps of each request's integration, and return the timings.

    All repeats take the same steps. Requests take turns and processor time is measured,
    so that other load of the machine affects all of them equally.

    asked, marches : the requests, and the integration of each by `settled_all`
    repeats : number of times that the steps of each are timed
    """
    saved = [m.state._make(array.copy() for array in m.state) for m in marches]
    spent: list[list[float]] = [[] for _ in marches]
    for _ in range(repeats):
        for march, state, times in zip(marches, saved, spent, strict=True):
            march.put(state)
            start = time.process_time()
            march.advance(STEPS)
            times.append(1e6 * (time.process_time() - start) / STEPS)
    every = zip(asked, marches, saved, spent, strict=True)
    return [_timing(a, march, state, times) for a, march, state, times in every]


def _timing(asked: Asked, march: March, before: Any, times: list[float]) -> Timing:
    share = float(march.counter[TOUCHED] - before.counter[TOUCHED]) / STEPS
    middle = statistics.median(times)
    spread = (max(times) - min(times)) / middle
    touching = _touching(march, before) if share > 0.0 else 0.0
    return Timing(asked.scheme, asked.engine, share, touching, middle, spread)


def _touching(march: March, saved: Any) -> float:
    """Return the mean number of blades in contact in those timed steps that have any.

    If a tip has several contact points, these are counted instead of blades.

    march, saved : integration; its state at the first of the timed steps
    """
    march.put(saved)
    counter, counts = march.counter, []
    for _ in range(STEPS):
        march.advance(1)
        if counter[LAST] == counter[STEP]:
            counts.append(int((march.state.last == counter[STEP]).sum()))
    return statistics.mean(counts)


def tail_ratio(scene: Scene, repeats: int) -> float:
    """Return how much slower a step is once the motion has decayed: a ratio of times.

    Products of the amplitudes of a decayed motion would be denormal numbers, with which
    processors compute slowly; the ratio to the time of a large motion shows whether
    this happens.

    repeats : number of timings of each step, of which the median counts
    """
    faint = apply_settings(scene, {"force": FAINT})
    alive, tail = time_steps(
        [Asked(one, DEFAULT, contact=False) for one in (scene, faint)], repeats
    )
    return tail.microseconds_per_step / alive.microseconds_per_step


def rows_of(scene: Scene, engines: dict[str, Scene]) -> list[Asked]:
    """Return the requests for the timings that `hpcwhirl bench` prints.

    Each scene is timed in flight and in contact. All schemes are timed on the scene's
    engine, and the default scheme on the variants; on that with rotation also the
    scheme that jumps over steps without contact.

    engines : {name: scene with a variant of the engine}
    """
    schemes = [(scene, scheme, OWN) for scheme in NAMES]
    variants = [
        (other, scheme, name)
        for name, other in engines.items()
        for scheme in NAMES
        if scheme == DEFAULT or (name == FULL and SCHEMES[scheme].flies)
    ]
    return [
        Asked(one, scheme, contact, engine)
        for one, scheme, engine in schemes + variants
        for contact in (False, True)
    ]


def in_operation(scene: Scene) -> dict[str, Scene]:
    """Return variants of a scene with one more feature each, {name: scene}.

    The features are those in `OPERATION`, such as wear. {} if the scene has one of them
    already, or does not allow all of them.
    """
    spin = resolve(scene).model.rotor.spin
    plain = spin is None or (spin.is_plain and spin.released is None)
    alike = scene.solver.until == "end" and scene.engine.rotation != "auto"
    if not plain or not alike or changes(scene) or not is_round(scene):
        return {}
    return {name: apply_settings(scene, own) for name, own in OPERATION.items()}


def pattern(blades: int) -> list[float]:
    """Return the mistuning of an engine with unequal blades, for timings.

    They are relative changes of Young's modulus, one for each of N = `blades` blades.
    """
    return [UNEVEN * math.sin(7.0 * j) for j in range(blades)]


def over_none(timings: Sequence[Timing]) -> dict[str, dict[str, Any]]:
    """Return how much a feature, such as rotation, lengthens a step: ratios of times.

    Features are rotation, for each engine, and those of `OPERATION`. An engine is left
    out if no blade touches in the timed steps, with the feature or without it.

    Returns {engine: ratios}, of the default scheme:

    `in_flight` : ratio for steps without contact
    `in_contact` : ratio for steps in which blades touch; mean times of all steps are
        not compared, since the shares of such steps differ
    `shares` : share of timed steps with contact, with the feature and without
    `touching` : mean number of blades in contact in a step with contact, with and
        without
    timings : all timings, with and without these features
    """
    of = {(t.scheme, t.engine, t.contact > 0.0): t for t in timings}
    found = {}
    for name in dict.fromkeys(t.engine for t in timings):
        if not name.startswith(FULL) and name not in OPERATION:
            continue
        plain = name.removeprefix(FULL).removeprefix(", ") or OWN
        plain = OWN if name in OPERATION else plain
        if any((DEFAULT, engine, True) not in of for engine in (name, plain)):
            continue
        pairs = [
            (of[DEFAULT, engine, False], of[DEFAULT, engine, True])
            for engine in (name, plain)
        ]
        (flight, contact), (own_flight, own_contact) = [step_times(*p) for p in pairs]
        found[name] = {
            "in_flight": flight / own_flight,
            "in_contact": contact / own_contact,
            "shares": [mixed.contact for _, mixed in pairs],
            "touching": [mixed.touching for _, mixed in pairs],
        }
    return found


def step_times(flight: Timing, mixed: Timing) -> tuple[float, float]:
    """Return the times of a step without, and of a step with contact, us each.

    They are computed from two timings of the same engine.

    flight, mixed : timing without contact; timing in which some steps have contact
    """
    first = flight.microseconds_per_step
    return first, first + (mixed.microseconds_per_step - first) / mixed.contact


def bytes_of(scene: Scene, scheme: str) -> int:
    """Return how many bytes the arrays have with which a scheme integrates a scene.

    The arrays are the state of the motion and the scheme's operators.
    """
    short = apply_settings(scene, {"scheme": scheme, "duration": 1e-3})
    march = March(resolve(short))

    def size(item: object) -> int:
        if isinstance(item, tuple):
            return sum(size(part) for part in item)
        return item.nbytes if isinstance(item, np.ndarray) else 8

    return size(march.state) + size(march.scheme.arrays)
