"""How long a step takes: schemes beside one another, in flight and in contact."""

from __future__ import annotations

import statistics
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from hpcwhirl.case.resolve import resolve
from hpcwhirl.dynamics.kernels import cyclic, passes
from hpcwhirl.dynamics.kernels.contact import TOUCHED
from hpcwhirl.dynamics.kernels.named import CyclicState, GeneralRotor
from hpcwhirl.dynamics.kernels.peak import CHAINS, multiply_add
from hpcwhirl.dynamics.march import March
from hpcwhirl.errors import InputError
from hpcwhirl.scene import Scene, apply_settings
from hpcwhirl.scene.schemes import DEFAULT, NAMES

SETTLE = 0.02  # s of engine time before the clock: pulse over, blades touching
OWN = "as given"  # the scene's engine
FAINT = 1e-150  # N, a pulse that leaves amplitudes below 1e-150
FAR = 1.0  # m, a gap that no blade crosses
STEPS = 5_000  # a repeat; the same steps for all, so the same contacts
ROUNDS = 200_000  # of the peak; some 10 ms


@dataclass(frozen=True)
class Timing:
    """Cost of a step.

    Attributes
    ----------
    scheme : integrator
    engine : the scene's own, or what has been made of it
    contact : share of the timed steps with at least one contact
    microseconds_per_step : median over the repeats, us a case-step
    spread : (largest - smallest) over median of the repeats
    """

    scheme: str
    engine: str
    contact: float
    microseconds_per_step: float
    spread: float


def settled(scene: Scene, scheme: str, *, contact: bool) -> March:
    """Return a march past the pulse that samples nothing, in contact or far from it."""
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


def restore(march: March, saved: Sequence[object]) -> None:
    """Set the state to arrays that were saved."""
    for array, value in zip(march.state, saved, strict=True):
        array[...] = value


@dataclass(frozen=True)
class Asked:
    """What is to be timed: a case by a scheme, with blades that touch or `FAR` off."""

    scene: Scene
    scheme: str
    contact: bool
    engine: str = OWN


def time_steps(asked: Sequence[Asked], repeats: int) -> list[Timing]:
    """Return what a step of each costs, from the same state and steps in every repeat.

    They take turns, and the processor's time counts: what else the machine does is
    spread over all of them.
    """
    marches = [settled(a.scene, a.scheme, contact=a.contact) for a in asked]
    saved = [m.state._make(array.copy() for array in m.state) for m in marches]
    spent: list[list[float]] = [[] for _ in marches]
    for _ in range(repeats):
        for march, state, times in zip(marches, saved, spent, strict=True):
            restore(march, state)
            start = time.process_time()
            march.advance(STEPS)
            times.append(1e6 * (time.process_time() - start) / STEPS)
    every = zip(asked, marches, saved, spent, strict=True)
    return [_timing(a, march, state, times) for a, march, state, times in every]


def _timing(asked: Asked, march: March, before: Any, times: list[float]) -> Timing:
    share = float(march.counter[TOUCHED] - before.counter[TOUCHED]) / STEPS
    middle = statistics.median(times)
    spread = (max(times) - min(times)) / middle
    return Timing(asked.scheme, asked.engine, share, middle, spread)


def tail_ratio(scene: Scene, repeats: int) -> float:
    """Return what a step in a damped tail costs, over one that is alive.

    The tail's amplitudes have decayed to where their products would be denormal.
    """
    faint = apply_settings(scene, {"force": FAINT})
    alive, tail = time_steps(
        [Asked(own, DEFAULT, contact=False) for own in (scene, faint)], repeats
    )
    return tail.microseconds_per_step / alive.microseconds_per_step


def rows_of(scene: Scene, engines: dict[str, Scene]) -> list[Asked]:
    """Return every scheme, and the default one on engines by name; flight, contact."""
    own = [(scene, scheme, OWN) for scheme in NAMES]
    made = [(other, DEFAULT, name) for name, other in engines.items()]
    return [
        Asked(one, scheme, contact, engine)
        for one, scheme, engine in own + made
        for contact in (False, True)
    ]


def fma_peak(repeats: int) -> float:
    """Return the core's measured peak of fused multiply-adds, GFLOP/s, both counted."""
    values = np.linspace(0.0, 1.0, CHAINS)
    multiply_add(1, values, 0.5, 0.5)
    spent = []
    for _ in range(repeats):
        start = time.perf_counter()
        multiply_add(ROUNDS, values, 0.5, 0.5)
        spent.append(time.perf_counter() - start)
    return 2e-9 * CHAINS * ROUNDS / min(spent)


def flight_operations(scene: Scene, scheme: str) -> int:
    """Return the floating-point operations of a contact-free step.

    Counted from `kernels.passes`, padding included: 11 a real amplitude of the rotor,
    36 a complex one of the ring, 2 an entry of the transform, 4 a gap; in `general`
    also 2 an entry of the tips by modes.

    Raises
    ------
    InputError
        where neither the cyclic nor the general kernel marches the scene so
    """
    march = March(resolve(apply_settings(scene, {"scheme": scheme})))
    k, wide = cyclic.widths(march.lean.model.blades)
    if not isinstance(march.state, CyclicState):
        msg = "the operations are counted for rings of harmonics and rigid casings only"
        raise InputError(msg)
    rotor, ring = march.state.rotor, march.state.ring
    step = 11 * len(rotor) // passes.ROTOR_STATE + 36 * len(ring) // passes.RING_STATE
    step += 2 * (2 * k * wide) + 4 * wide
    tips = march.scheme.arrays.rotor
    return step + (2 * len(tips.read) if isinstance(tips, GeneralRotor) else 2 * k)


def bytes_of(scene: Scene, scheme: str) -> int:
    """Return the bytes of a scheme's state and operators."""
    short = apply_settings(scene, {"scheme": scheme, "duration": 1e-3})
    march = March(resolve(short))

    def size(item: object) -> int:
        if isinstance(item, tuple):
            return sum(size(part) for part in item)
        return item.nbytes if isinstance(item, np.ndarray) else 8

    return size(march.state) + size(march.scheme.arrays)
