"""How long a step takes: schemes beside one another, in flight and in contact."""

from __future__ import annotations

import statistics
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

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


def time_step(
    scene: Scene, scheme: str, repeats: int, *, contact: bool, engine: str = OWN
) -> Timing:
    """Return what a step costs, from the same state and steps in every repeat.

    Parameters
    ----------
    scene : the case; its duration is replaced
    scheme : integrator
    repeats : timed runs
    contact : whether blades touch; if not, the gap is `FAR`
    engine : its name
    """
    march = settled(scene, scheme, contact=contact)
    saved: list[object] = [array.copy() for array in march.state]
    spent, share = [], 0.0
    for _ in range(repeats):
        restore(march, saved)
        march.seconds = 0.0
        before = march.counter[TOUCHED]
        march.advance(STEPS)
        share = float(march.counter[TOUCHED] - before) / STEPS
        spent.append(1e6 * march.seconds / STEPS)
    middle = statistics.median(spent)
    spread = (max(spent) - min(spent)) / middle
    return Timing(scheme, engine, share, middle, spread)


def tail_ratio(scene: Scene, repeats: int) -> float:
    """Return what a step in a damped tail costs, over one that is alive.

    The tail's amplitudes have decayed to where their products would be denormal.
    """
    alive = time_step(scene, DEFAULT, repeats, contact=False)
    faint = apply_settings(scene, {"force": FAINT})
    tail = time_step(faint, DEFAULT, repeats, contact=False)
    return tail.microseconds_per_step / alive.microseconds_per_step


def time_schemes(scene: Scene, repeats: int) -> Iterator[Timing]:
    """Yield the cost of every scheme, in flight and in contact."""
    for scheme in NAMES:
        for contact in (False, True):
            yield time_step(scene, scheme, repeats, contact=contact)


def time_engines(engines: dict[str, Scene], repeats: int) -> Iterator[Timing]:
    """Yield the cost of the default scheme on engines by name, as `time_schemes`."""
    for name, scene in engines.items():
        for contact in (False, True):
            yield time_step(scene, DEFAULT, repeats, contact=contact, engine=name)


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
