"""What a scheme makes of a scene: a kernel and what it is called with."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.dynamics.casing_trace import waves_of_modes, waves_of_rigid
from hpcwhirl.dynamics.kernels import contact
from hpcwhirl.dynamics.kernels.cyclic import widths
from hpcwhirl.dynamics.kernels.kernel_types import Arrays, CyclicState, WaveRotor
from hpcwhirl.dynamics.kernels.vectors import all_aligned
from hpcwhirl.dynamics.operators import friction_with_sign
from hpcwhirl.dynamics.slots import ring_amplitudes
from hpcwhirl.reduction.model import Model
from hpcwhirl.scene import Scene

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Ended = tuple[Floats, Floats, Floats, Floats]


class Balance(NamedTuple):
    """Terms of the energy balance of a state, J.

    Attributes
    ----------
    energy : energy of both bodies
    damping : energy that damping has taken from them since the start
    rotation, friction, impact : what must be added to these entries of the ledger; 0
        for a kernel that enters them at each step
    """

    energy: float
    damping: float
    rotation: float = 0.0
    friction: float = 0.0
    impact: float = 0.0


@dataclass(frozen=True)
class Integrator:
    """A kernel and what it is called with.

    Attributes
    ----------
    kernel : march `steps` steps; see `kernels.bodies.march_bodies` for its arguments
    arrays : constant arrays, an argument of the kernel
    state : state at rest, a `kernels.kernel_types.BodiesState` or `CyclicState`
    balance : state -> terms that complete the entries of the state's ledger
    displacements : (state, steps) -> rotor (n,) and casing (m,) in the coordinates of
        the model's matrices, m
    casing_width : number of coordinates of the casing that the kernel stores a sample
    casing_waves : (copies (n, width), steps between them) -> `history.History.casing`
    ended : state -> copies of the arrays of rotor, ring and their sums, with the step
        completed that the kernel has left pending; None for kernels that leave none
    """

    kernel: Callable[..., Any]
    arrays: Arrays
    state: Any
    balance: Callable[[Any], Balance]
    displacements: Callable[[Any, int], tuple[Floats, Floats]]
    casing_width: int
    casing_waves: Callable[[Floats, int], Floats]
    ended: Callable[[CyclicState], Ended] | None = None


def at_rest(blades: int, gap: float, sizes: tuple[int, int, int, int]) -> CyclicState:
    """Return a state at rest of a kernel in the rotating frame.

    Parameters
    ----------
    blades : N
    gap : m
    sizes : lengths of the state's arrays `rotor`, `ring`, `lam` and `sums_b`
    """
    k, wide = widths(blades)
    rotor, ring, lam, sums_b = map(np.zeros, sizes)
    own = (
        rotor, ring, lam, np.full(3 * 2 * wide, gap), sums_b, np.zeros(4 * k),
        np.zeros(blades + 2, dtype=np.int64), *nothing_yet(blades),
    )  # fmt: skip
    return CyclicState(*all_aligned(own))


def with_space(march: Callable[..., None], space_of: Callable[[], Any]) -> Any:
    """Return a kernel that is given its work space, which is made at its first call."""
    space = cache(space_of)

    def kernel(*given: Any) -> None:
        march(*given, space())

    return kernel


def ended_by(
    settle: Callable[[CyclicState, Ended], None],
) -> Callable[[CyclicState], Ended]:
    """Return the function `Integrator.ended` of a kernel.

    settle : sets copies of rotor, ring and their sums to what they are with the state's
        pending step completed
    """

    def ended(state: CyclicState) -> Ended:
        parts = state.rotor, state.ring, state.sums_b, state.sums_c
        rotor, ring, sums_b, sums_c = (np.zeros_like(part) for part in parts)
        settle(state, (rotor, ring, sums_b, sums_c))
        return rotor, ring, sums_b, sums_c

    return ended


def balance_of(
    passes: Any, arrays: Arrays, scene: Scene, ended: Callable[[CyclicState], Ended]
) -> Callable[[CyclicState], Balance]:
    """Return the function `Integrator.balance` of a kernel in the rotating frame.

    Parameters
    ----------
    passes : module with the kernel's passes, `differences` or `flow`
    arrays : constant arrays of the kernel
    scene : scene to integrate
    ended : see `Integrator`
    """
    step, friction = scene.solver.time_step, friction_with_sign(scene)

    def balance(state: CyclicState) -> Balance:
        s_b, s_c, sums_b, sums_c = ended(state)
        odd, c_c = int(state.counter[contact.STEP] & 1), arrays.casing.items
        energies = passes.energies_of(arrays.rotor, s_b, s_c, c_c, odd, step)
        rotation, impact, drag, loss = passes.column_sums(sums_b, sums_c, step)
        if isinstance(arrays.rotor, WaveRotor):  # what contact has added to it, too
            loss -= energies[0]
        return Balance(sum(energies), loss, rotation, friction * drag, impact)

    return balance


def nothing_yet(blades: int) -> tuple[Integers, Integers, Floats, Floats]:
    """Return the bookkeeping of a state at rest: no contact, no energy.

    Returns
    -------
    (step of the last contact of each blade, counters, ledger, impulse of each blade) as
    in `kernels.kernel_types.CyclicState`
    """
    counter = np.zeros(contact.COUNTERS, dtype=np.int64)
    counter[[contact.LAST, contact.ENDED, contact.CERTIFIED]] = -1
    never = np.full(blades, -1, dtype=np.int64)
    return never, counter, np.zeros(contact.ENTRIES), np.zeros(blades)


def unfold(model: Model, q_b: Floats, q_c: Floats) -> tuple[Floats, Floats]:
    """Return the displacements of rotor and casing, all sectors, from amplitudes.

    q_b, q_c : modal amplitudes of rotor and ring, of one sector if the model is folded
    """
    lift = model.lifts[0] if model.lifts else model.rotor.shapes
    rotor = lift @ q_b[: len(model.rotor.omega)]
    if model.casing is None:
        return rotor, np.zeros(0)
    lift = model.lifts[1] if model.lifts else model.casing.shapes
    return rotor, lift @ q_c[: len(model.casing.omega)]


def reader(
    model: Model, scene: Scene, of_ring: Callable[[Floats, int], Floats]
) -> Callable[[Floats, int], Floats]:
    """Return the function `Integrator.casing_waves`: `of_ring` for an elastic casing.

    For a rigid one, the harmonics follow from the time alone.
    """
    if model.casing is not None:
        return of_ring
    return lambda copies, stride: waves_of_rigid(scene, len(copies), stride)


def ring_reader(model: Model, scene: Scene) -> Callable[[Floats, int], Floats]:
    """Return the function `Integrator.casing_waves` of a ring in the rotating frame.

    Its coordinates are those of `slots`.
    """

    def read(copies: Floats, stride: int) -> Floats:
        steps = stride * np.arange(1.0, len(copies) + 1)
        angles = np.asarray(scene.speed * steps * scene.solver.time_step)
        return waves_of_modes(model, ring_amplitudes(model, copies, angles))

    return read
