"""The interface between a march and a scheme: a kernel, its arguments and its state.

A scheme makes an `Integrator`; the march calls its kernel with its arrays and state,
and asks it for the motion and the energies in the state.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from hpcwhirl.arrays import Floats, Integers
from hpcwhirl.case.profile import HeldShape
from hpcwhirl.case.speed import Interval
from hpcwhirl.dynamics.bodies.motion import Amplitudes, Motion, gaps_of
from hpcwhirl.dynamics.bodies.operators import friction_with_sign, unworn, wears
from hpcwhirl.dynamics.kernels import contact
from hpcwhirl.dynamics.kernels.keep_inverse import length_of_known
from hpcwhirl.dynamics.kernels.kernel_types import Arrays, CyclicState
from hpcwhirl.dynamics.kernels.loop.circulant import folded
from hpcwhirl.dynamics.kernels.vectors import aligned_zeros, all_aligned, widths
from hpcwhirl.dynamics.waves.casing import waves_of_rigid, waves_of_ring
from hpcwhirl.dynamics.waves.free_motion import FreeMotion
from hpcwhirl.reduction.model import Model
from hpcwhirl.scene import Scene


class Balance(NamedTuple):
    """Energies of a state that complete the ledger, the energy balance of a run, J.

    Attributes
    ----------
    energy : kinetic and strain energy of rotor and casing
    damping : energy that damping has taken from them since the start
    rotation, friction, impact, loading : works of rotation and friction, loss by
        impact, and work of loading, to add to these entries of the ledger; 0 for a
        kernel that enters them in each step
    """

    energy: float
    damping: float
    rotation: float = 0.0
    friction: float = 0.0
    impact: float = 0.0
    loading: float = 0.0


class Integrator(ABC):
    """A compiled kernel for one scene, its arguments, and access to its state.

    Attributes
    ----------
    model, scene : model and scene that are integrated
    kernel : function that takes `steps` time steps;
        `kernels.oracle.bodies.march_bodies` explains its arguments
    arrays : constant arrays, arguments of the kernel
    state : motion of rotor and casing, ledger and counters, which the kernel changes;
        at rest when created; a `kernels.kernel_types.BodiesState` or `CyclicState`
    casing_width : number of casing coordinates that the kernel stores per sample
    of_modes : whether these coordinates are modal amplitudes, else displacements
    jitter : energy, J, and squared distance of the centre from the circle, m^2, that
        round-off adds in a step to the motion of an unbalanced rotor, see
        `dynamics.bodies.turning`; 0 if the state has the displacement from the circle
    drives : whether the state has a motion without contact, as rotors with terms of
        rotation do whose speed changes; then rows of evidence have it, too
    jumps : whether the kernel takes many steps at once, within which it keeps no states
    """

    kernel: Callable[..., Any]
    casing_width: int
    of_modes = True
    jitter = (0.0, 0.0)
    drives = False
    jumps = False

    def __init__(self, model: Model, scene: Scene, arrays: Arrays, state: Any) -> None:
        self.model, self.scene, self.arrays, self.state = model, scene, arrays, state

    def friction(self, _: float) -> float:
        """Return the kernel's coefficient of friction at a speed, rad/s, with its sign.

        Waves have one for the whole run: the speed keeps its sign, or each step only
        tries this friction first, see `kernels.coulomb`.
        """
        return friction_with_sign(self.scene)

    @abstractmethod
    def balance(self, state: Any) -> Balance:
        """Return energies, losses and works in a state, which complete the ledger."""

    @abstractmethod
    def motion(self, state: Any, steps: int) -> Motion:
        """Return displacements and velocities of rotor and casing in a given state.

        They are those of all sectors, and include the circle of an unbalanced rotor,
        see `case.unbalance`.

        steps : number of time steps taken so far, from which the angle of the rotor
            follows
        """

    def rotors(self, kept: Floats, steps: Integers) -> tuple[Floats, Floats]:
        """Return displacements and velocities of the rotor in kept states, (n, ...).

        How many rows are read at once changes no bit.

        kept : (n, width), the rotor's part of n states, see `tracks`
        steps : (n,), numbers of steps taken until each
        """
        both = [
            self.motion(self.with_rotor(row), step)[:2]
            for row, step in zip(kept, steps.tolist(), strict=True)
        ]
        x, v = zip(*both, strict=True)
        return np.array(x), np.array(v)

    def with_rotor(self, row: Floats) -> Any:
        """Return a state with the rotor's part of a kept one; row : (width,)."""
        rotor, ring = np.split(row, [len(self.state.rotor)])
        return self.state._replace(rotor=rotor, ring=ring)

    @property
    def kept_width(self) -> int:
        """Number of values of the rotor's part of a state."""
        return len(self.state.rotor) + len(self.state.ring)

    @abstractmethod
    def begin(self, motion: Motion) -> bool:
        """Start from a given motion; return whether the state can represent it.

        The motion is written into the state at time 0, with the rotor at angle 0. Its
        energy is entered in the ledger as work of the loading. If a model of one sector
        cannot represent the motion, nothing changes.
        """

    def carry(self, old: Integrator, steps: int) -> None:
        """Continue the motion of another integrator of the same casing.

        Displacements and velocities of both bodies are those in its state, in
        coordinates that both models share; contacts, works and counters go on. The
        change of the energy is entered in the ledger as work of the loading.

        A scheme without this method integrates no such cases.

        old, steps : integrator, such as that of the rotor before it loses a blade; the
            number of time steps taken so far
        """
        raise NotImplementedError

    def casing_waves(self, copies: Floats, stride: int) -> Floats:
        """Return the harmonics of the casing's displacement at samples of a run.

        They are shaped as `history.History.casing`: radial, m, in the static frame.

        copies : (n, casing_width), the casing's coordinates as the kernel stored them;
            unused for a rigid casing, whose shape depends on time alone
        stride : number of time steps between samples
        """
        if self.model.casing is None:
            return waves_of_rigid(self.model, self.scene, len(copies), stride)
        values = self._static(copies, stride)
        return waves_of_ring(self.model, values, of_modes=self.of_modes)

    def _static(self, copies: Floats, _: int) -> Floats:
        """Return samples of an elastic casing's coordinates in the static frame.

        Here the kernel has stored them in that frame, so that they are returned
        unchanged.

        copies, _ : as for `casing_waves`
        """
        return copies

    def refresh(self, state: Any, now: Interval) -> None:  # noqa: B027 - often nothing
        """Compute the kernel's arrays for a new interval of a changing speed.

        Nothing is to be done if the speed changes only arguments of the kernel.

        state : state of the run, adapted to the new arrays; None: only these are
            computed
        now : interval that begins, in which the speed is taken as constant
        """

    def free(self) -> FreeMotion | None:
        """Return the motion without contact in closed form; None if there is none."""
        return None

    def release(self, state: Any, shape: HeldShape, steps: int) -> None:
        """Let go of a casing held in a shape: add the shape to a state's motion.

        A scheme without this method integrates no such cases.

        state : state after `steps` steps, changed in place
        shape : in which the casing has been held
        """
        raise NotImplementedError


def at_rest(blades: int, scene: Scene, sizes: tuple[int, int, int, int]) -> CyclicState:
    """Return the state of rotor and ring at rest, for kernels in the rotating frame.

    Parameters
    ----------
    blades : N, number of blades or, with several a tip, of contact points
    scene : scene with the gap of all tips, m, and the layer, not yet worn
    sizes : lengths of the state's arrays `rotor`, `ring`, `lam` and `sums_b`
    """
    k, wide = widths(blades)
    rotor, ring, lam, sums_b = sizes
    reals = aligned_zeros(rotor, ring, lam, 3 * 2 * wide, sums_b, 4 * k)
    reals[3][:] = scene.gap
    known = np.zeros(length_of_known(blades), dtype=np.int64)
    own = *reals, *all_aligned([known, *nothing_yet(blades)])
    layer = unworn(scene), np.zeros(blades * wears(scene))
    return CyclicState._make([*own, *layer])


def with_space(
    march: Callable[..., None],
    space_of: Callable[[], Any],
    made: list[Any] | None = None,
) -> Any:
    """Return a kernel that calls a compiled time loop with work arrays of its own.

    march : the time loop, which takes the work arrays as its last argument
    space_of : function that makes the work arrays; called once, at the kernel's first
        use
    made : out: the work arrays, once they are made
    """
    made = [] if made is None else made

    def kernel(*given: Any) -> None:
        if not made:
            made.append(space_of())
        march(*given, *made)

    return kernel


def nothing_yet(blades: int) -> tuple[Integers, Integers, Floats, Floats]:
    """Return the contacts, counters, ledger and impulses with which a run starts.

    Returns
    -------
    (step of the last contact of each blade, -1; counters; ledger, 0; impulse of each
    blade, 0), as in `kernels.kernel_types.CyclicState`
    """
    counter = np.zeros(contact.COUNTERS, dtype=np.int64)
    counter[[contact.LAST, contact.ENDED, contact.CERTIFIED]] = -1
    never = np.full(blades, -1, dtype=np.int64)
    return never, counter, np.zeros(contact.ENTRIES), np.zeros(blades)


def unfold(model: Model, found: Amplitudes, places: Floats | None = None) -> Motion:
    """Return displacements and velocities of all sectors from modal amplitudes.

    found : modal amplitudes of rotor and casing, perhaps of the model of one sector
    places : (n,), m, added to the rotor's displacement, the circle of an unbalanced
        rotor; None: nothing is added
    """
    own, beside = model.shapes
    rotor, velocity = own @ found.rotor, own @ found.rotor_rate
    if places is not None:
        rotor = rotor + places
    return Motion(rotor, velocity, beside @ found.casing, beside @ found.casing_rate)


def write_gaps(
    state: CyclicState, model: Model, scene: Scene, now: Amplitudes, before: Amplitudes
) -> None:
    """Compute the gaps at time 0 and a step earlier, and write them into a state.

    now, before : modal amplitudes of both bodies at time 0 and at time -dt, for the
        model of all sectors or of one
    """
    rows = state.gaps.reshape(3, -1)
    chosen = folded(model.blades, widths(model.blades)[1])
    back = -scene.speed * scene.solver.time_step
    rows[:] = scene.gap
    for row, found, angle in ((0, now, 0.0), (2, before, back)):
        rotor, casing = model.rotor.shapes @ found.rotor, found.casing
        if model.casing is not None:
            casing = model.casing.shapes @ casing
        rows[row] = gaps_of(model, scene.gap, rotor, casing, angle)[chosen]


def nothing_booked(state: CyclicState, *, exact: bool) -> None:
    """Set multipliers, works, losses and impulses in a state to 0, for a new start.

    exact : whether the kernel is that of the exact flow: its state is then marked as
        one without pending step
    """
    for part in (state.lam, state.sums_b, state.sums_c, state.ledger, state.impulse):
        part[:] = 0.0
    if exact:
        state.counter[contact.ENDED] = 0
