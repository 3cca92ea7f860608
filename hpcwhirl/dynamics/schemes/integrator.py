"""The integrator that a scheme makes for a scene: a kernel and its arguments."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from hpcwhirl.arrays import Floats, Integers
from hpcwhirl.case.speed import Interval
from hpcwhirl.dynamics.casing import waves_of_rigid
from hpcwhirl.dynamics.kernels import contact
from hpcwhirl.dynamics.kernels.cyclic import widths
from hpcwhirl.dynamics.kernels.keep_inverse import length_of_known
from hpcwhirl.dynamics.kernels.kernel_types import Arrays, CyclicState
from hpcwhirl.dynamics.kernels.vectors import all_aligned
from hpcwhirl.dynamics.motion import Amplitudes, Motion
from hpcwhirl.reduction.model import Model
from hpcwhirl.scene import Scene

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
        step; with an unbalance it includes the circle, see `case.unbalance`
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
    jitter : energy, J, and squared distance of the centre from the circle, m^2, that
        round-off adds in a step to the motion of an unbalanced rotor, see
        `dynamics.turning`; 0 for states that have the motion about the circle
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
    jitter: tuple[float, float] = (0.0, 0.0)


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
    """Return the time loop `march` without its last argument, the work space.

    space_of : function that makes the work space; it is called once, at the first use
    """
    space = cache(space_of)

    def kernel(*given: Any) -> None:
        march(*given, space())

    return kernel


def nothing_yet(blades: int) -> tuple[Integers, Integers, Floats, Floats]:
    """Return the contacts, counters, ledger and impulses of a state at rest.

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
    own, beside = model.shapes
    rotor, velocity = own @ found.rotor, own @ found.rotor_rate
    if places is not None:
        rotor = rotor + places
    return Motion(rotor, velocity, beside @ found.casing, beside @ found.casing_rate)


def reader(
    model: Model, scene: Scene, of_ring: Callable[[Floats, int], Floats]
) -> Callable[[Floats, int], Floats]:
    """Return the function that gives a casing's harmonics, `Integrator.casing_waves`.

    of_ring : this function for an elastic casing. The shape of a rigid casing depends
        on time alone, so that the stored samples are not used.
    """
    if model.casing is not None:
        return of_ring
    return lambda copies, stride: waves_of_rigid(model, scene, len(copies), stride)
