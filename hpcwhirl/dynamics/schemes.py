"""Schemes: which kernel marches a scene, with which arrays, from which state.

A state is a tuple of arrays, all that a resume needs; for every scheme it ends with
the steps of last contacts (N,), counter, ledger and impulse (N,).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.dynamics.casing_trace import (
    waves_of_coordinates,
    waves_of_modes,
    waves_of_rigid,
)
from hpcwhirl.dynamics.kernels import contact
from hpcwhirl.dynamics.operators import friction_with_sign
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.model import Model
from hpcwhirl.scene import Scene
from hpcwhirl.structure import RingOperator

Floats = NDArray[np.float64]
State = tuple[Any, ...]


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
    kernel : march `steps` steps; see `general.march_general` for its arguments
    arrays : (load, rotor, casing, contact) of the kernel
    state : at rest
    balance : state -> what the ledger needs beside its own entries
    displacements : (state, steps) -> rotor (n,) and casing (m,) in the coordinates of
        the model's matrices, m
    casing_width : coordinates of the casing that the kernel copies at a sample
    casing_waves : (copies (n, width), steps between them) -> `History.casing`
    ended : of the cyclic kernel: state -> copies of bodies and sums, the step that
        waits ended and booked
    """

    kernel: Callable[..., Any]
    arrays: tuple[Any, ...]
    state: State
    balance: Callable[[State], Balance]
    displacements: Callable[[State, int], tuple[Floats, Floats]]
    casing_width: int
    casing_waves: Callable[[Floats, int], Floats]
    ended: Callable[[State], State] | None = None


def _common(blades: int) -> State:
    """Return last contacts, counter, ledger, impulse at rest."""
    counter = np.zeros(contact.COUNTERS, dtype=np.int64)
    counter[[contact.LAST, contact.ENDED, contact.CERTIFIED]] = -1
    never = np.full(blades, -1, dtype=np.int64)
    return never, counter, np.zeros(contact.ENTRIES), np.zeros(blades)


def _two_bodies(model: Model, scene: Scene, rotor: int, casing: int) -> State:
    """Return a state at rest of the general and the dense kernel."""
    gaps = np.full(model.blades, scene.gap)
    bodies = (np.zeros(n) for n in (rotor, rotor, casing, casing))
    losses = np.zeros(rotor), np.zeros(max(casing, 1))
    return (*bodies, *losses, gaps, gaps.copy(), *_common(model.blades))


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


def _general(model: Model, scene: Scene) -> Scheme:
    from hpcwhirl.dynamics.kernels.general import march_general, modal_energy
    from hpcwhirl.dynamics.operators import contact_operators, modal_arrays

    rotor, casing, load = modal_arrays(model, scene)
    step = scene.solver.time_step

    def balance(state: State) -> Balance:
        energy = modal_energy(state[0], state[1], rotor[4], step)
        energy += modal_energy(state[2], state[3], casing[4], step)
        return Balance(energy, float(state[4].sum() + state[5].sum()))

    state = _two_bodies(model, scene, len(rotor[0]), len(casing[0]))
    arrays = (load, rotor, casing, contact_operators(model, scene))
    return Scheme(
        kernel=march_general,
        arrays=arrays,
        state=state,
        balance=balance,
        displacements=lambda s, _: _unfold(model, s[0], s[2]),
        casing_width=len(casing[0]),
        casing_waves=_reader(model, scene, lambda q, _: waves_of_modes(model, q)),
    )


def _paper(model: Model, scene: Scene) -> Scheme:
    from hpcwhirl.dynamics.kernels.dense import dense_energy, march_paper
    from hpcwhirl.dynamics.operators import contact_operators, dense_arrays

    rotor, casing, load = dense_arrays(model, scene)
    step = scene.solver.time_step

    def balance(state: State) -> Balance:
        energy = dense_energy(state[0], state[1], rotor[3], rotor[4], step)
        energy += dense_energy(state[2], state[3], casing[3], casing[4], step)
        return Balance(energy, float(state[4].sum() + state[5].sum()))

    state = _two_bodies(model, scene, len(rotor[0]), len(casing[0]))
    arrays = (load, rotor, casing, contact_operators(model, scene))
    return Scheme(
        kernel=march_paper,
        arrays=arrays,
        state=state,
        balance=balance,
        displacements=lambda s, _: (s[0].copy(), s[2].copy()),
        casing_width=len(casing[0]),
        casing_waves=_reader(model, scene, lambda x, _: waves_of_coordinates(model, x)),
    )


def _at_rest(model: Model, scene: Scene, rows: int, ring_rows: int) -> State:
    """Return a state at rest of the cyclic kernel."""
    from hpcwhirl.dynamics.flights import can_fly
    from hpcwhirl.dynamics.kernels import cyclic, passes

    k, wide = cyclic.widths(model.blades)
    rotor = np.zeros(passes.ROTOR_STATE * rows * 2 * k)
    ring = np.zeros(passes.RING_STATE * ring_rows * k)
    gaps, lam = np.full(3 * 2 * wide, scene.gap), np.zeros(4 * k)
    sums = np.zeros(3 * 2 * k), np.zeros(4 * k)
    known = np.zeros(model.blades + 2, dtype=np.int64)
    common = _common(model.blades)
    if not can_fly(scene):
        common[1][contact.NEXT_TRY] = np.iinfo(np.int64).max
    return rotor, ring, lam, gaps, *sums, known, *common


def _cyclic(model: Model, scene: Scene, beat: int) -> Scheme:
    from hpcwhirl.dynamics.kernels import cyclic, samples
    from hpcwhirl.dynamics.slots import (
        cyclic_arrays,
        modal_amplitudes,
        ring_amplitudes,
    )

    load, rotor, casing, touch, rows, ring_rows = cyclic_arrays(model, scene, beat)
    step = scene.solver.time_step
    exact = scene.solver.scheme == "exact"
    kernel = cyclic.cyclic_kernel(model.blades, rows, ring_rows, exact)
    sizes = rows, ring_rows, 2 * cyclic.widths(model.blades)[0], exact

    def ended(state: State) -> State:
        out = tuple(np.zeros_like(state[i]) for i in (0, 1, 4, 5))
        samples.settle(rotor[0], casing[0], state, out, *sizes)
        return out

    def balance(state: State) -> Balance:
        s_b, s_c, sums_b, sums_c = ended(state)
        odd = int(state[-3][contact.STEP] & 1)
        energy = sum(
            samples.energies_of(s_b, rotor[0], s_c, casing[0], odd, step, exact)
        )
        works = samples.column_sums(sums_b, sums_c, step, exact)
        rotation, impact, drag, loss = works
        friction = friction_with_sign(scene) * drag
        return Balance(energy, loss, rotation, friction, impact)

    def displacements(state: State, steps: int) -> tuple[Floats, Floats]:
        q_b, q_c = modal_amplitudes(model, scene, ended(state)[:2], steps)
        return _unfold(model, q_b, q_c)

    def casing_waves(copies: Floats, stride: int) -> Floats:
        steps = stride * np.arange(1.0, len(copies) + 1)
        angles = np.asarray(scene.speed * steps * step)
        return waves_of_modes(model, ring_amplitudes(model, copies, angles))

    return Scheme(
        kernel=kernel,
        arrays=(load, rotor, casing, touch),
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
