"""Schemes: which kernel marches a scene, with which arrays, from which state.

A state is all that a resume needs, see `kernels.named`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.dynamics.casing_trace import (
    waves_of_coordinates,
    waves_of_modes,
    waves_of_rigid,
)
from hpcwhirl.dynamics.kernels import contact
from hpcwhirl.dynamics.kernels.named import Arrays, BodiesState, CyclicState
from hpcwhirl.dynamics.operators import friction_with_sign
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.model import Model
from hpcwhirl.scene import Scene
from hpcwhirl.structure import RingOperator

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Ended = tuple[Floats, Floats, Floats, Floats]


class Balance(NamedTuple):
    """Energy and damping loss of both bodies, and what is not yet entered, J."""

    energy: float
    damping: float
    rotation: float = 0.0
    friction: float = 0.0
    impact: float = 0.0


@dataclass(frozen=True)
class Scheme:
    """A kernel and what it is called with.

    Attributes
    ----------
    kernel : march `steps` steps; see `bodies.march_bodies` for its arguments
    arrays : of the kernel
    state : at rest, a `named.BodiesState` or `CyclicState`
    balance : state -> what the ledger needs beside its own entries
    displacements : (state, steps) -> rotor (n,) and casing (m,) in the coordinates of
        the model's matrices, m
    casing_width : coordinates of the casing that the kernel copies at a sample
    casing_waves : (copies (n, width), steps between them) -> `History.casing`
    ended : of the cyclic kernel: state -> copies of bodies and sums, the step that
        waits ended and booked
    """

    kernel: Callable[..., Any]
    arrays: Arrays
    state: Any
    balance: Callable[[Any], Balance]
    displacements: Callable[[Any, int], tuple[Floats, Floats]]
    casing_width: int
    casing_waves: Callable[[Floats, int], Floats]
    ended: Callable[[CyclicState], Ended] | None = None


def _common(blades: int) -> tuple[Integers, Integers, Floats, Floats]:
    """Return last contacts, counter, ledger, impulse at rest."""
    counter = np.zeros(contact.COUNTERS, dtype=np.int64)
    counter[[contact.LAST, contact.ENDED, contact.CERTIFIED]] = -1
    never = np.full(blades, -1, dtype=np.int64)
    return never, counter, np.zeros(contact.ENTRIES), np.zeros(blades)


def _bodies(model: Model, scene: Scene, arrays: Arrays) -> BodiesState:
    """Return a state at rest of two bodies."""
    rotor, casing = len(arrays.rotor.keep), len(arrays.casing.keep)
    gaps = np.full(model.blades, scene.gap)
    return BodiesState(
        np.zeros(rotor), np.zeros(rotor), np.zeros(casing), np.zeros(casing),
        np.zeros(rotor), np.zeros(max(casing, 1)), gaps, gaps.copy(),
        *_common(model.blades),
    )  # fmt: skip


def _unfold(model: Model, q_b: Floats, q_c: Floats) -> tuple[Floats, Floats]:
    """Return the displacements of modal amplitudes, lifted to all sectors."""
    lift = model.lifts[0] if model.lifts else model.rotor.shapes
    rotor = lift @ q_b[: len(model.rotor.omega)]
    if model.casing is None:
        return rotor, np.zeros(0)
    lift = model.lifts[1] if model.lifts else model.casing.shapes
    return rotor, lift @ q_c[: len(model.casing.omega)]


def _reader(
    model: Model, scene: Scene, of_ring: Callable[[Floats, int], Floats]
) -> Callable[[Floats, int], Floats]:
    """Return the reader of a casing's copies: `of_ring`, but of no rigid casing."""
    if model.casing is not None:
        return of_ring
    return lambda copies, stride: waves_of_rigid(scene, len(copies), stride)


def _two_bodies(model: Model, scene: Scene, arrays: Arrays) -> Scheme:
    """Return the march of two bodies as modes; a scheme changes what differs."""
    from hpcwhirl.dynamics.kernels.bodies import energies_of, march_bodies

    step = scene.solver.time_step

    def balance(state: BodiesState) -> Balance:
        energy = sum(energies_of(arrays.rotor, arrays.casing, state, step))
        return Balance(energy, float(state.loss_b.sum() + state.loss_c.sum()))

    return Scheme(
        kernel=march_bodies,
        arrays=arrays,
        state=_bodies(model, scene, arrays),
        balance=balance,
        displacements=lambda s, _: _unfold(model, s.q_b, s.q_c),
        casing_width=len(arrays.casing.keep),
        casing_waves=_reader(model, scene, lambda q, _: waves_of_modes(model, q)),
    )


def _general(model: Model, scene: Scene) -> Scheme:
    import hpcwhirl.dynamics.kernels.general  # noqa: F401 - what modes do
    from hpcwhirl.dynamics.operators import modal_arrays

    return _two_bodies(model, scene, modal_arrays(model, scene))


def _paper(model: Model, scene: Scene) -> Scheme:
    import hpcwhirl.dynamics.kernels.dense  # noqa: F401 - what matrices do
    from hpcwhirl.dynamics.operators import dense_arrays

    return replace(
        _two_bodies(model, scene, dense_arrays(model, scene)),
        displacements=lambda s, _: (s.q_b.copy(), s.q_c.copy()),
        casing_waves=_reader(model, scene, lambda x, _: waves_of_coordinates(model, x)),
    )


def _at_rest(model: Model, scene: Scene, rows: int, ring_rows: int) -> CyclicState:
    """Return a state at rest of the cyclic kernel."""
    from hpcwhirl.dynamics.flights import can_fly
    from hpcwhirl.dynamics.kernels import cyclic, passes

    k, wide = cyclic.widths(model.blades)
    rotor = np.zeros(passes.ROTOR_STATE * rows * 2 * k)
    ring = np.zeros(passes.RING_STATE * ring_rows * k)
    gaps, lam = np.full(3 * 2 * wide, scene.gap), np.zeros(4 * k)
    state = CyclicState(
        rotor, ring, lam, gaps, np.zeros(3 * 2 * k), np.zeros(4 * k),
        np.zeros(model.blades + 2, dtype=np.int64), *_common(model.blades),
    )  # fmt: skip
    if not can_fly(scene):
        state.counter[contact.NEXT_TRY] = np.iinfo(np.int64).max
    return state


def _cyclic(model: Model, scene: Scene, beat: int) -> Scheme:
    from hpcwhirl.dynamics.kernels import cyclic, samples
    from hpcwhirl.dynamics.slots import (
        cyclic_arrays,
        modal_amplitudes,
        ring_amplitudes,
    )

    arrays, rows, ring_rows = cyclic_arrays(model, scene, beat)
    c_b, c_c = arrays.rotor.items, arrays.casing.items
    step = scene.solver.time_step
    exact = scene.solver.scheme == "exact"
    kernel = cyclic.cyclic_kernel(model.blades, rows, ring_rows, exact)
    sizes = rows, ring_rows, 2 * cyclic.widths(model.blades)[0], exact

    def ended(state: CyclicState) -> Ended:
        parts = state.rotor, state.ring, state.sums_b, state.sums_c
        s_b, s_c, sums_b, sums_c = (np.zeros_like(part) for part in parts)
        samples.settle(c_b, c_c, state, (s_b, s_c, sums_b, sums_c), *sizes)
        return s_b, s_c, sums_b, sums_c

    def balance(state: CyclicState) -> Balance:
        s_b, s_c, sums_b, sums_c = ended(state)
        odd = int(state.counter[contact.STEP] & 1)
        energy = sum(samples.energies_of(s_b, c_b, s_c, c_c, odd, step, exact))
        works = samples.column_sums(sums_b, sums_c, step, exact)
        rotation, impact, drag, loss = works
        friction = friction_with_sign(scene) * drag
        return Balance(energy, loss, rotation, friction, impact)

    def displacements(state: CyclicState, steps: int) -> tuple[Floats, Floats]:
        s_b, s_c, _, _ = ended(state)
        q_b, q_c = modal_amplitudes(model, scene, (s_b, s_c), steps)
        return _unfold(model, q_b, q_c)

    def casing_waves(copies: Floats, stride: int) -> Floats:
        steps = stride * np.arange(1.0, len(copies) + 1)
        angles = np.asarray(scene.speed * steps * step)
        return waves_of_modes(model, ring_amplitudes(model, copies, angles))

    return Scheme(
        kernel=kernel,
        arrays=arrays,
        state=_at_rest(model, scene, rows, ring_rows),
        balance=balance,
        displacements=displacements,
        casing_width=2 * ring_rows * cyclic.widths(model.blades)[0],
        casing_waves=_reader(model, scene, casing_waves),
        ended=ended,
    )


def _is_cyclic(model: Model) -> bool:
    """Return whether the cyclic kernel can march a model.

    With one or two blades k = 1 is a simple harmonic that has both of the centre's
    coordinates, which the kernel has no place for; one of many sectors has no centre.
    """
    plain = isinstance(model.ring, RingOperator) or not model.rotor.cyclic
    return not plain and (model.blades > 2 or model.folds > 1)


def _check_exact(model: Model) -> None:
    """Raise InputError where the exact flow is not that of the cyclic kernel."""
    if not _is_cyclic(model):
        msg = (
            "scheme exact needs three or more equal blades and a ring of harmonics or "
            "a rigid casing: scheme must be 'modal', 'general' or 'paper' here, got "
            "'exact'"
        )
        raise InputError(msg)
    bodies = [body for body in (model.rotor, model.casing) if body is not None]
    worst = max(float(body.ratios.max()) for body in bodies)
    if not worst < 1.0:
        msg = f"scheme exact needs damping < 1 in every mode, got {worst:g}"
        raise InputError(msg)


def scheme_of(model: Model, scene: Scene, beat: int) -> Scheme:
    """Return the scheme that marches a scene; `beat`: steps between its evidence.

    `modal` is the cyclic kernel, or the general one where the rotor is not cyclic
    (from file, mistuned), the ring is the paper's elements or there are fewer than
    three blades.
    """
    if scene.solver.scheme == "exact":
        _check_exact(model)
    if scene.solver.scheme == "paper":
        return _paper(model, scene)
    if scene.solver.scheme == "general" or not _is_cyclic(model):
        return _general(model, scene)
    return _cyclic(model, scene, beat)
