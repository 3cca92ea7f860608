"""Schemes: which kernel marches a scene, with which arrays, from which state.

A state is a tuple of arrays, all that a resume needs; it ends with touching (N,),
counter, ledger and impulse (N,) for every scheme.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.dynamics.kernels import contact
from hpcwhirl.dynamics.operators import friction_with_sign
from hpcwhirl.reduction.model import Model
from hpcwhirl.scene import Scene
from hpcwhirl.structure import RingOperator

Floats = NDArray[np.float64]
State = tuple[Any, ...]


class Balance(NamedTuple):
    """Energy of both bodies and loss in modal damping, J; works not yet entered, J."""

    energy: float
    damping: float
    rotation: float = 0.0
    friction: float = 0.0


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
    """

    kernel: Callable[..., Any]
    arrays: tuple[Any, ...]
    state: State
    balance: Callable[[State], Balance]
    displacements: Callable[[State, int], tuple[Floats, Floats]]


def _common(blades: int) -> State:
    """Return touching, counter, ledger, impulse at rest."""
    counter = np.zeros(contact.COUNTERS, dtype=np.int64)
    counter[contact.LAST] = -1
    return np.zeros(blades, dtype=np.int64), counter, np.zeros(5), np.zeros(blades)


def _two_bodies(model: Model, scene: Scene, rotor: int, casing: int) -> State:
    """Return a state at rest of the general and the dense kernel."""
    gaps = np.full(model.blades, scene.gap)
    bodies = (np.zeros(n) for n in (rotor, rotor, casing, casing))
    losses = np.zeros(rotor), np.zeros(max(casing, 1))
    return (*bodies, *losses, gaps, gaps.copy(), *_common(model.blades))


def _unfold(model: Model, q_b: Floats, q_c: Floats) -> tuple[Floats, Floats]:
    """Return the displacements of modal amplitudes."""
    rotor = model.rotor.shapes @ q_b[: len(model.rotor.omega)]
    if model.casing is None:
        return rotor, np.zeros(0)
    return rotor, model.casing.shapes @ q_c[: len(model.casing.omega)]


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
        march_general, arrays, state, balance, lambda s, _: _unfold(model, s[0], s[2])
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
        march_paper, arrays, state, balance, lambda s, _: (s[0].copy(), s[2].copy())
    )


def _cyclic(model: Model, scene: Scene) -> Scheme:
    from hpcwhirl.dynamics.kernels import cyclic
    from hpcwhirl.dynamics.slots import cyclic_arrays, modal_amplitudes

    load, rotor, casing, touch, rows, ring_rows = cyclic_arrays(model, scene)
    (k, k_ring, _), step = cyclic.widths(model.blades), scene.solver.time_step

    def balance(state: State) -> Balance:
        energy = cyclic.total_energy(state[0], rotor[0], state[1], casing[0], step)
        normal, drag, loss = cyclic.column_sums(state[4], state[5])
        friction = 0.5 * friction_with_sign(scene) * drag
        return Balance(energy, loss, 0.5 * normal, friction)

    bodies = np.zeros(cyclic.ROTOR_STATE * rows * 2 * k)
    ring = np.zeros(cyclic.RING_STATE * ring_rows * k_ring)
    spectra = np.zeros(2 * k), np.zeros(2 * k)
    sums = np.zeros(3 * 2 * k), np.zeros(3 * k_ring)
    state = (bodies, ring, *spectra, *sums, *_common(model.blades))
    kernel = cyclic.cyclic_kernel(model.blades, rows, ring_rows)
    return Scheme(
        kernel,
        (load, rotor, casing, touch),
        state,
        balance,
        lambda s, n: _unfold(model, *modal_amplitudes(model, scene, s, n)),
    )


def scheme_of(model: Model, scene: Scene) -> Scheme:
    """Return the scheme that marches a scene.

    `modal` is the cyclic kernel, or the general one where the rotor is not cyclic
    (from file, mistuned), the ring is the paper's elements or there are fewer than
    three blades.
    """
    if scene.solver.scheme == "paper":
        return _paper(model, scene)
    plain = isinstance(model.ring, RingOperator) or not model.rotor.cyclic
    if scene.solver.scheme == "general" or plain or model.blades < 3:
        return _general(model, scene)
    return _cyclic(model, scene)
