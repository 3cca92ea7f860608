"""The integrator that a scheme makes for a scene: a kernel and its arguments."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.case.speed import Interval, angle_at
from hpcwhirl.dynamics.casing_trace import waves_of_modes, waves_of_rigid
from hpcwhirl.dynamics.kernels import contact
from hpcwhirl.dynamics.kernels.cyclic import widths
from hpcwhirl.dynamics.kernels.keep_inverse import length_of_known
from hpcwhirl.dynamics.kernels.kernel_types import Arrays, CyclicState
from hpcwhirl.dynamics.kernels.vectors import all_aligned
from hpcwhirl.dynamics.kernels.wave_types import WaveRotor
from hpcwhirl.dynamics.motion import Amplitudes, Motion, amplitudes, lowering
from hpcwhirl.dynamics.operators import friction_with_sign
from hpcwhirl.dynamics.schemes.places import (
    Held,
    RingPlaces,
    nothing_booked,
    write_gaps,
)
from hpcwhirl.dynamics.slots import ring_amplitudes
from hpcwhirl.reduction.model import Model
from hpcwhirl.scene import Scene
from hpcwhirl.scene.schemes import SCHEMES

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Ended = tuple[Floats, Floats, Floats, Floats]


class Balance(NamedTuple):
    """Terms of the energy balance of a state, J.

    Attributes
    ----------
    energy : energy of both bodies
    damping : energy that damping has taken from them since the start
    rotation, friction, impact : amounts to add to these entries of the ledger; 0 for a
        kernel that enters them in each step
    """

    energy: float
    damping: float
    rotation: float = 0.0
    friction: float = 0.0
    impact: float = 0.0


@dataclass(frozen=True)
class Integrator:
    """A kernel, its arguments, and functions that read and set its state.

    Attributes
    ----------
    kernel : function that takes `steps` steps; `kernels.bodies.march_bodies` explains
        its arguments
    arrays : constant arrays, an argument of the kernel
    state : state at rest, a `kernels.kernel_types.BodiesState` or `CyclicState`
    balance : state -> `Balance`, the terms that complete the ledger in the state
    motion : (state, steps) -> `motion.Motion` of all sectors, at the angle of the
        step; with an unbalance that of x, not of y, see `case.unbalance`
    begin : `motion.Motion` at the angle 0 -> True; sets the state to it, at time 0, and
        enters its energy as work of the loading. If a model of one sector cannot
        represent the motion: False, and nothing changes
    casing_width : number of casing coordinates that the kernel stores per sample
    casing_waves : (stored casing coordinates (n, width), steps between samples) ->
        `history.History.casing`
    refresh : (state or None, `case.speed.Interval`) -> None; sets the arrays for an
        interval of a changing speed, and adapts the state; None if a changing speed
        changes only arguments of the kernel
    release : (state, displacement (n,), m, steps) -> None; adds the displacement that a
        casing has when it is let go; None if another scheme integrates such cases
    ended : state -> copies of the arrays of rotor, ring and their sums, in which the
        pending step is completed; None for kernels that leave no step pending
    """

    kernel: Callable[..., Any]
    arrays: Arrays
    state: Any
    balance: Callable[[Any], Balance]
    motion: Callable[[Any, int], Motion]
    begin: Callable[[Motion], bool]
    casing_width: int
    casing_waves: Callable[[Floats, int], Floats]
    release: Callable[[Any, Floats, int], None] | None = None
    ended: Callable[[CyclicState], Ended] | None = None
    refresh: Callable[[Any, Interval], None] | None = None


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
        np.zeros(length_of_known(blades), dtype=np.int64), *nothing_yet(blades),
    )  # fmt: skip
    return CyclicState(*all_aligned(own))


def with_space(march: Callable[..., None], space_of: Callable[[], Any]) -> Any:
    """Return a kernel with its work space as last argument, made at the first call."""
    space = cache(space_of)

    def kernel(*given: Any) -> None:
        march(*given, space())

    return kernel


def ended_by(
    settle: Callable[[CyclicState, Ended], None],
) -> Callable[[CyclicState], Ended]:
    """Return `Integrator.ended`: a function that completes a state's pending step.

    settle : function that completes the state's pending step in copies of rotor, ring
        and their sums
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
    """Return `Integrator.balance`: a function from a state to its energy balance.

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
        if isinstance(arrays.rotor, WaveRotor):  # including what contact has added
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


def unfold(model: Model, found: Amplitudes, places: Floats | None = None) -> Motion:
    """Return a motion of all sectors from the amplitudes of rotor and ring.

    found : amplitudes; those of one sector if only one is integrated
    places : (n,), m, displacement of the rotor at amplitudes 0; None: 0
    """
    lift = model.lifts[0] if model.lifts else model.rotor.shapes
    rotor, velocity = lift @ found.rotor, lift @ found.rotor_rate
    if places is not None:
        rotor = rotor + places
    if model.casing is None:
        return Motion(rotor, velocity, np.zeros(0), np.zeros(0))
    lift = model.lifts[1] if model.lifts else model.casing.shapes
    return Motion(rotor, velocity, lift @ found.casing, lift @ found.casing_rate)


def motions_in_slots(
    model: Model,
    scene: Scene,
    state: CyclicState,
    held: Held,
    ended: Callable[[CyclicState], Ended],
    balance: Callable[[CyclicState], Balance],
) -> tuple[Callable[[CyclicState, int], Motion], Callable[[Motion], bool]]:
    """Return `motion` and `begin` of an integrator in the rotating frame.

    Parameters
    ----------
    model, scene : model and scene that are integrated
    state : state of the kernel, at rest
    held : layout of rotor and ring in the state
    ended, balance : functions of the integrator
    """
    exact = SCHEMES[scene.solver.scheme].flies

    def motion(state: CyclicState, steps: int) -> Motion:
        s_b, s_c, _, _ = ended(state)
        now = *held.rotor.read(s_b, steps & 1), *held.ring.read(s_c, steps)
        return unfold(model, Amplitudes(*now), held.places)

    def begin(motion: Motion) -> bool:
        now = amplitudes(model, motion)
        if now is None:
            return False
        still = np.zeros(len(now.rotor))
        if held.places is not None:
            still = model.rotor.shapes.T @ (model.rotor.mass @ held.places)
        nothing_booked(state, exact=exact)
        rotor = held.rotor.write(state.rotor, now.rotor - still, now.rotor_rate)
        ring = held.ring.write(state.ring, now.casing, now.casing_rate)
        seen = [now, now._replace(rotor=rotor + still, casing=ring)]
        if held.beside:
            seen = [each._replace(rotor=0.0 * each.rotor) for each in seen]
        write_gaps(state, model, scene, *seen)
        begun = balance(state)
        state.ledger[contact.PULSE] = begun.energy
        # for waves: their loss is the energy given to them less the energy they have
        state.sums_b[2 * len(state.sums_b) // 3] -= begun.damping
        return True

    return motion, begin


def releaser(
    model: Model, ring: RingPlaces
) -> Callable[[CyclicState, Floats, int], None]:
    """Return `Integrator.release`, which adds a displacement to a ring's amplitudes."""

    def release(state: CyclicState, places: Floats, steps: int) -> None:
        body = model.casing
        if body is None:
            raise TypeError(body)
        lift = model.lifts[1] if model.lifts else body.shapes
        ring.add(state.ring, lowering(body, lift) @ places, steps)

    return release


def reader(
    model: Model, scene: Scene, of_ring: Callable[[Floats, int], Floats]
) -> Callable[[Floats, int], Floats]:
    """Return `Integrator.casing_waves`: from stored samples to the casing's harmonics.

    It is `of_ring` for an elastic casing; a rigid casing's shape depends on time alone.
    """
    if model.casing is not None:
        return of_ring
    return lambda copies, stride: waves_of_rigid(model, scene, len(copies), stride)


def ring_reader(model: Model, scene: Scene) -> Callable[[Floats, int], Floats]:
    """Return `Integrator.casing_waves` of a ring whose samples are its state.

    The samples have amplitudes in slots, rotating frame, see `dynamics.slots`.
    """

    def read(copies: Floats, stride: int) -> Floats:
        steps = stride * np.arange(1.0, len(copies) + 1)
        angles = np.asarray(angle_at(scene, steps, scene.solver.time_step))
        return waves_of_modes(model, ring_amplitudes(model, copies, angles))

    return read
