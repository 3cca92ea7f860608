"""The integrator that a scheme makes for a scene: a kernel and its arguments."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from hpcwhirl.arrays import Floats, Integers
from hpcwhirl.case.speed import Interval
from hpcwhirl.dynamics.casing import waves_of_rigid, waves_of_ring
from hpcwhirl.dynamics.kernels import contact
from hpcwhirl.dynamics.kernels.cyclic import widths
from hpcwhirl.dynamics.kernels.keep_inverse import length_of_known
from hpcwhirl.dynamics.kernels.kernel_types import Arrays, CyclicState
from hpcwhirl.dynamics.kernels.vectors import all_aligned
from hpcwhirl.dynamics.motion import Amplitudes, Motion
from hpcwhirl.reduction.model import Model
from hpcwhirl.scene import Scene


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


class Integrator(ABC):
    """A kernel, its arguments, and methods that read and set its state.

    Attributes
    ----------
    model, scene : model and scene that are integrated
    kernel : function that takes `steps` steps; `kernels.bodies.march_bodies` explains
        its arguments
    arrays : constant arrays, an argument of the kernel
    state : state at rest, a `kernels.kernel_types.BodiesState` or `CyclicState`
    casing_width : number of casing coordinates that the kernel stores per sample
    of_modes : whether these are amplitudes of modes, else displacements
    jitter : energy, J, and squared distance of the centre from the circle, m^2, that
        round-off adds in a step to the motion of an unbalanced rotor, see
        `dynamics.turning`; 0 for states that have the motion about the circle
    """

    kernel: Callable[..., Any]
    casing_width: int
    of_modes = True
    jitter = (0.0, 0.0)

    def __init__(self, model: Model, scene: Scene, arrays: Arrays, state: Any) -> None:
        self.model, self.scene, self.arrays, self.state = model, scene, arrays, state

    @abstractmethod
    def balance(self, state: Any) -> Balance:
        """Return the terms that complete the ledger in a state."""

    @abstractmethod
    def motion(self, state: Any, steps: int) -> Motion:
        """Return the motion of all sectors in a state, at the angle of step `steps`.

        With an unbalance it includes the circle, see `case.unbalance`.
        """

    @abstractmethod
    def begin(self, motion: Motion) -> bool:
        """Set the state to a motion at angle 0 and time 0; return whether it could be.

        The energy of the motion is entered as work of the loading. If a model of one
        sector cannot represent the motion, nothing changes.
        """

    def casing_waves(self, copies: Floats, stride: int) -> Floats:
        """Return the casing's harmonics, as in `history.History.casing`, from samples.

        copies : (n, casing_width), stored casing coordinates. The shape of a rigid
            casing depends on time alone, so that they are not used
        stride : steps between samples
        """
        if self.model.casing is None:
            return waves_of_rigid(self.model, self.scene, len(copies), stride)
        values = self._static(copies, stride)
        return waves_of_ring(self.model, values, of_modes=self.of_modes)

    def _static(self, copies: Floats, _: int) -> Floats:
        """Return the samples of an elastic casing in the static frame, as given here.

        copies, _ : as for `casing_waves`
        """
        return copies

    def refresh(self, state: Any, now: Interval) -> None:  # noqa: B027 - often nothing
        """Set the arrays for an interval of a changing speed, and adapt the state.

        Nothing is to be done here if the speed changes only arguments of the kernel.

        state : state that is adapted, or None
        """

    def release(self, state: Any, places: Floats, steps: int) -> None:
        """Add to a state at step `steps` the displacement of a casing that is let go.

        A scheme without this method integrates no such cases.

        places : (n,), m, in the casing's coordinates
        """
        raise NotImplementedError


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
