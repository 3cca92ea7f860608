"""Modes of a rotor of equal sectors and of the ring, by nodal diameter.

A slot is a nodal diameter of the N blades, 0 .. N // 2, padded to k slots. Row f of an
array has the f-th mode of each slot, whose cosine and sine phases are one complex
amplitude. The items of a mode, named below, are the coefficients of its time step and
its displacements. They do not depend on speed and friction, and are cached for each
model and step; `slot_waves` makes waves of them.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Any, NamedTuple

import numpy as np

from hpcwhirl.arrays import Complexes, Floats, Integers
from hpcwhirl.dynamics.bodies.pulse import lobe_load
from hpcwhirl.dynamics.bodies.timestep import Recursion, central_differences, exact_flow
from hpcwhirl.dynamics.kernels.loop.transform import BEHIND, BLADES, SPAN, span_of
from hpcwhirl.dynamics.kernels.vectors import aligned, widths
from hpcwhirl.reduction.bodies import centre_rows, tip_rows
from hpcwhirl.reduction.model import MOST_KEPT, Model
from hpcwhirl.reduction.modes import ModalModel
from hpcwhirl.scene import Scene
from hpcwhirl.structure import FourierOperator

MOST_RUBBED = 128  # cached pairs of model and friction: 10 to 100 kB each
# items of a mode: coefficients keep and give of a step (`timestep`); radial and re, im
# of tangential displacement for unit amplitude, of a rotor times -1; omega; xi
KEEP, GIVE, RADIAL, SR, SI, OMEGA, DAMPING = range(7)
ITEMS = 7


def fold(harmonic: int, blades: int) -> tuple[int, float]:
    """Return the nodal diameter that a ring's harmonic has at N blades, and a sign.

    Several harmonics have the same values at the blades (aliasing) and so the same
    nodal diameter, 0 .. N // 2, or slot; the sign is -1 if the amplitude in the slot is
    the complex conjugate of the harmonic's, else 1.

    harmonic, blades : h; N
    """
    rest = harmonic % blades
    return (rest, 1.0) if 2 * rest <= blades else (blades - rest, -1.0)


@lru_cache(maxsize=MOST_KEPT)
def blade_waves(blades: int) -> Complexes:
    """Return the factors e^{2 pi i kappa j / N} of nodal diameters at the blades.

    Their shape is (N, N // 2 + 1), for blades j and nodal diameters kappa = 0 .. N //
    2.
    """
    steps = np.outer(np.arange(blades), np.arange(blades // 2 + 1)) % blades
    return np.asarray(np.exp(2j * np.pi * steps / blades))


@lru_cache(maxsize=MOST_KEPT)
def transforms(blades: int) -> tuple[Floats, Floats]:
    """Return the tables of the real transforms between nodal diameters and blades.

    Returns
    -------
    turns : (N, 2 k) flat, cos and -sin of the k slots (nodal diameters, padded) at each
        blade
    wave : (2 k, wide) flat, cos and sin of each slot at blades j = 0 .. N // 2, for
        half sum and half difference of blades j and N - j; padding columns repeat blade
        0. The last entries are N and the split in two factors, see
        `kernels.loop.transform`
    """
    waves, half = blade_waves(blades), blades // 2 + 1
    k, wide = widths(blades)
    turns = np.zeros((blades, 2 * k))
    turns[:, :half], turns[:, k : k + half] = waves.real, -waves.imag
    simple = [0] + ([blades // 2] if blades % 2 == 0 else [])
    turns[:, [k + s for s in simple]] = 0.0
    turns[simple, k:] = 0.0  # sin(pi kappa): exactly 0, as folding assumes
    columns = np.zeros(wide, dtype=int)
    columns[:half] = np.arange(half)
    wave = np.vstack([turns[columns, :k].T, -turns[columns, k:].T])
    behind = np.zeros(BEHIND)
    behind[[BLADES, SPAN]] = blades, span_of(blades)
    return aligned(turns.ravel()), aligned(np.append(wave.ravel(), behind))


@dataclass(frozen=True)
class _RotorMode:
    """A mode of a rotor of equal sectors as one complex amplitude a.

    Attributes
    ----------
    slot, row : nodal diameter, and the mode's number among the modes of it, from 0
    members : columns in the model of the mode's cosine and sine phases, or of the only
        one
    omega : rad/s
    gamma : minus the radial displacement of blade 0's tip for a = 1, real
    sigma : minus the tangential displacement of this tip for a = 1
    centre : (2,), x_o and y_o for a = 1
    turn : factor with q_0 + i q_1 = turn a, where q_0 and q_1 are the amplitudes of the
        cosine and the sine phase; it makes gamma real
    """

    slot: int
    row: int
    members: tuple[int, ...]
    omega: float
    gamma: float
    sigma: complex
    centre: Complexes
    turn: complex


@lru_cache(maxsize=MOST_KEPT)
def _rotor_modes(model: Model) -> list[_RotorMode]:
    body, blades = model.rotor, model.blades
    radial, tangential = tip_rows(body, blades)
    hub, waves = centre_rows(body, blades), blade_waves(blades)
    out = []
    for m in np.flatnonzero(body.phase == 0):
        k, row = int(body.diameter[m]), int(body.rank[m])
        same = (body.diameter == k) & (body.rank == row)
        members = tuple(np.flatnonzero(same)[np.argsort(body.phase[same])])
        scale = len(members) / blades
        a = scale * (waves[:, k].conj() @ radial[:, m])
        b = scale * (waves[:, k].conj() @ tangential[:, m])
        twin = hub[:, members[1]] if len(members) == 2 else np.zeros(2)
        turn = complex(abs(a) / a) if len(members) == 2 and abs(a) > 0.0 else 1.0
        gamma, centre = -float((a * turn).real), (hub[:, m] - 1j * twin) * turn
        sigma, omega = complex(-b * turn), float(body.omega[m])
        out.append(_RotorMode(k, row, members, omega, gamma, sigma, centre, turn))
    return out


def _items(flow: Recursion, gamma: float, sigma: complex) -> Floats:
    """Return the items (ITEMS,) of a mode: coefficients of its step, and its shape.

    flow : coefficients of the mode's step by central differences or the exact flow
    gamma, sigma : radial and tangential displacement at blade 0 for unit amplitude; of
        a rotor, times -1
    """
    out = np.zeros(ITEMS)
    out[[KEEP, GIVE, OMEGA, DAMPING]] = flow.keep, flow.give, flow.omega, flow.damping
    out[[RADIAL, SR, SI]] = gamma, sigma.real, sigma.imag
    return out


@lru_cache(maxsize=MOST_KEPT)
def _rotor(model: Model, step: float, *, flies: bool) -> tuple[Floats, Floats]:
    """Return those coefficients of a rotor's modes that do not depend on friction.

    Nor do they depend on speed, so that they are cached.

    step : dt, s
    flies : whether the scheme is `exact`, see `kernels.loop.flight`, else central
        differences

    Returns
    -------
    items : (ITEMS, rows, 2, slots), coefficients of a step for re and im of each mode
    hub : (2, rows 2 slots), x_o and y_o for unit amplitudes
    """
    modes, flow_of = _rotor_modes(model), exact_flow if flies else central_differences
    slots, _ = widths(model.blades)
    rows = 1 + max(mode.row for mode in modes)
    items = np.zeros((ITEMS, rows, 2, slots))
    hub = np.zeros((2, rows, 2, slots))
    ratios = model.rotor.ratios
    for mode in modes:
        flow = flow_of(mode.omega, float(ratios[mode.members[0]]), step)
        values, parts = _items(flow, mode.gamma, mode.sigma), len(mode.members)
        items[:, mode.row, :parts, mode.slot] = values[:, None]
        hub[:, mode.row, 0, mode.slot] = mode.centre.real
        if parts == 2:
            hub[:, mode.row, 1, mode.slot] = -mode.centre.imag
    return items, hub.reshape(2, -1)


class _Ring(NamedTuple):
    """Coefficients of a ring's modes by slot (nodal diameter), at speed 0, no friction.

    Attributes
    ----------
    items : (ITEMS, rows, slots), coefficients of a time step of each mode
    row, slot : (modes,), indices of each mode in `items`
    column : (modes,), column of the first phase of each mode in the model
    turns : (modes,), h or -h, the mode's harmonic: turns of the amplitude per
        revolution
    modes : (modes,), indices of each mode in (rows, slots), flat
    """

    items: Floats
    row: Integers
    slot: Integers
    column: Integers
    turns: Floats
    modes: Integers


class _Round(NamedTuple):
    """A ring of harmonics and the number of blades: the key by which arrays are cached.

    body, operator, blades : modes of the ring, its contact operator, N
    """

    body: ModalModel
    operator: FourierOperator
    blades: int


def _round(model: Model) -> _Round:
    """Return a model's casing ring and number of blades, the key of cached arrays."""
    body, operator = model.casing, model.ring
    if body is None or not isinstance(operator, FourierOperator):
        raise TypeError("only a ring of harmonics has slots")
    return _Round(body, operator, model.blades)


@lru_cache(maxsize=MOST_KEPT)
def _ring(given: _Round, step: float, *, flies: bool) -> _Ring:
    """Return those coefficients of a ring's modes that do not depend on friction.

    They are those in the static frame (speed 0).

    given, step : ring and number of blades; dt, s
    flies : whether the scheme is `exact`, else central differences
    """
    body, operator, blades = given
    (slots, _), flow_of = widths(blades), exact_flow if flies else central_differences
    places, ratios = _modes_in_slots(body, blades), body.ratios
    rows = 1 + max(place.row for place in places)
    items = np.zeros((ITEMS, rows, slots))
    for place in places:
        h, m = place.harmonic, place.members[0]
        w_row = operator.radial[max(2 * h - 1, 0)]
        u_row = operator.tangential[2 * h]  # the sine; for h = 0 the rotation
        psi, chi = float(body.shapes[w_row, m]), body.shapes[u_row, m]
        sigma = complex(chi) if h == 0 else -1j * place.sign * chi
        flow = flow_of(float(body.omega[m]), float(ratios[m]), step)
        items[:, place.row, place.slot] = _items(flow, psi, sigma)
    labels = [(p.row, p.slot, p.members[0], p.sign * p.harmonic) for p in places]
    row, slot, column, turns = map(np.array, zip(*labels, strict=True))
    modes = row * slots + slot
    return _Ring(items, row, slot, column, turns.astype(float), modes)


def rotor_table(model: Model, step: float, *, flies: bool) -> tuple[Floats, Floats]:
    """Return coefficients of a rotor's modes by slot, without friction, not flat.

    step, flies : dt, s; whether the scheme is `exact`, else central differences

    Returns
    -------
    items : (ITEMS, rows, k)
    hub : (2, rows, 2, k), x_o and y_o for unit re and im of the amplitudes
    """
    items, hub = _rotor(model, step, flies=flies)
    return items[:, :, 0], hub.reshape(2, len(items[0]), 2, -1)


def ring_table(model: Model, step: float, *, flies: bool) -> tuple[Floats, Floats]:
    """Return coefficients of a ring's modes by slot, at speed 0 without friction.

    step, flies : dt, s; whether the scheme is `exact`, else central differences

    Returns
    -------
    items : (ITEMS, rows, k)
    turns : (rows, k), turns of the amplitude per revolution, signed
    """
    ring = _ring(_round(model), step, flies=flies)
    turns = np.zeros(ring.items[0].shape)
    turns[ring.row, ring.slot] = ring.turns
    return ring.items, turns


def lobe_table(model: Model, scene: Scene) -> Floats:
    """Return the modal forces of a unit force on the pulse's lobes, (rows, k)."""
    force = _lobes(
        _round(model), scene.solver.time_step, scene.nodal_diameter, scene.direction,
        flies=scene.solver.flies,
    )  # fmt: skip
    return force.reshape(-1, widths(model.blades)[0])


@lru_cache(maxsize=MOST_KEPT)
def _lobes(
    given: _Round, step: float, diameter: int, direction: str, *, flies: bool
) -> Floats:
    """Return the modal forces of a unit force on k lobes of a ring, 1/sqrt(kg).

    They are flat, (rows, slots), with row f for the f-th mode of each slot (nodal
    diameter).

    given, step, flies : as for `_ring`
    diameter : k
    direction : "squeeze", inward where cos k theta = 1, or "stretch"
    """
    ring = _ring(given, step, flies=flies)
    force = lobe_load(given.operator, diameter, direction) @ given.body.shapes
    out = np.zeros(ring.items[0].size)
    out[ring.modes] = force[ring.column]
    return out


@dataclass(frozen=True)
class RingMode:
    """A mode of the ring as one complex amplitude, (q_c - i q_s) e^{i h Omega t}.

    q_c and q_s are the amplitudes of its cosine and sine phase in the static frame; the
    complex amplitude is that in the rotating frame.

    Attributes
    ----------
    slot, row : nodal diameter that it has at the blades, and its row in the arrays
    sign : -1 if the slot holds the complex conjugate of the amplitude, else 1
    harmonic : h
    members : columns in the model of its cosine and sine phases, or of the only one
    """

    slot: int
    row: int
    sign: float
    harmonic: int
    members: tuple[int, ...]


def ring_modes(model: Model) -> list[RingMode]:
    """Return the modes of a model's ring of harmonics; none for a rigid casing."""
    return [] if model.casing is None else _modes_in_slots(model.casing, model.blades)


@lru_cache(maxsize=MOST_KEPT)
def _modes_in_slots(body: ModalModel, blades: int) -> list[RingMode]:
    used, out = dict[int, int](), []
    for h in range(int(body.diameter.max()) + 1):
        slot, sign = fold(h, blades)
        for rank in np.unique(body.rank[body.diameter == h]):
            same = (body.diameter == h) & (body.rank == rank)
            members = tuple(np.flatnonzero(same)[np.argsort(body.phase[same])])
            row = used.get(slot, 0)
            used[slot] = row + 1
            out.append(RingMode(slot, row, sign, h, members))
    return out


class _Places(NamedTuple):
    """Where the modes of a body lie in slots, as arrays over its modes.

    row, slot : (modes,), as in `RingMode`
    first, second, paired : columns in the model of the first members, and of the second
        ones of those modes that have two; which have
    turn, harmonic : (modes,), factor of the amplitude: `_RotorMode.turn` or, of a ring,
        `RingMode.sign`; h of a ring
    """

    row: Integers
    slot: Integers
    first: Integers
    second: Integers
    paired: Integers
    turn: Any
    harmonic: Integers


def _places(modes: list[Any], turns: list[Any], harmonics: list[int]) -> _Places:
    """Return the places of modes; turns, harmonics : one of each mode."""
    members, whole = [mode.members for mode in modes], partial(np.array, dtype=np.int64)
    paired = [i for i, both in enumerate(members) if len(both) > 1]
    return _Places(
        whole([mode.row for mode in modes]),
        whole([mode.slot for mode in modes]),
        whole([both[0] for both in members]),
        whole([members[i][1] for i in paired]),
        whole(paired),
        np.array(turns),
        whole(harmonics),
    )


@lru_cache(maxsize=MOST_KEPT)
def _ring_places(body: ModalModel, blades: int) -> _Places:
    modes = _modes_in_slots(body, blades)
    return _places(modes, [m.sign for m in modes], [m.harmonic for m in modes])


@lru_cache(maxsize=MOST_KEPT)
def _rotor_places(model: Model) -> _Places:
    modes = _rotor_modes(model)
    return _places(modes, [m.turn for m in modes], [])


def rotor_amplitudes(model: Model, values: Floats) -> Floats:
    """Return the rotor's modal amplitudes, (m,), from the kernel's complex ones.

    values : (2 rows slots,), re and im of these: row f has the f-th mode of each slot
        (nodal diameter)
    """
    slots, at = widths(model.blades)[0], _rotor_places(model)
    rotor = values.reshape(-1, 2, slots)
    q_b = np.zeros(len(model.rotor.omega))
    value = at.turn * (rotor[at.row, 0, at.slot] + 1j * rotor[at.row, 1, at.slot])
    q_b[at.first], q_b[at.second] = value.real, value.imag[at.paired]
    return q_b


def rotor_slots(model: Model, q_b: Floats) -> Floats:
    """Return the kernel's complex amplitudes of a rotor from its modal amplitudes.

    Their shape is (2 rows slots,), re and im, with row f for the f-th mode of each slot
    (nodal diameter).

    q_b : (m,), amplitudes of the m modes
    """
    modes, (slots, _) = _rotor_modes(model), widths(model.blades)
    out = np.zeros((1 + max(mode.row for mode in modes), 2, slots))
    for mode in modes:
        value = complex(*q_b[list(mode.members)]) / mode.turn
        out[mode.row, :, mode.slot] = value.real, value.imag
    return out.ravel()


def ring_slots(model: Model, q_c: Floats, rows: int) -> Floats:
    """Return the kernel's complex amplitudes of a ring from its modal amplitudes.

    They are those at angle 0 of the rotor, where static and rotating frame coincide.
    Their shape is (2 rows slots,), re and im, with row f for the f-th mode of each slot
    (nodal diameter).

    q_c, rows : (m,), amplitudes in the static frame; number of rows
    """
    out = np.zeros((2, rows, widths(model.blades)[0]))
    for place in ring_modes(model):
        value = complex(*q_c[list(place.members)])
        out[:, place.row, place.slot] = value.real, -place.sign * value.imag
    return out.ravel()


def ring_amplitudes(model: Model, states: Floats, angles: Floats) -> Floats:
    """Return a ring's modal amplitudes (n, m), static frame, from the kernel's.

    Parameters
    ----------
    model : a model with a ring of harmonics
    states : (n, 2 ring_size), re and im of the kernel's complex amplitudes at n
        instants, rotating frame, with the contact forces of the last step applied
    angles : (n,), rad, Omega t, of the rotor at these instants
    """
    q = np.zeros((len(states), len(model.casing.omega) if model.casing else 0))
    if model.casing is None or not len(states):
        return q
    slots, at = widths(model.blades)[0], _ring_places(model.casing, model.blades)
    ring = states.reshape(len(states), 2, states.shape[1] // (2 * slots), slots)
    re, im = ring[:, 0, at.row, at.slot], ring[:, 1, at.row, at.slot]
    value = (re + 1j * at.turn * im) * np.exp(-1j * np.outer(angles, at.harmonic))
    q[:, at.first], q[:, at.second] = value.real, -value.imag[:, at.paired]
    return q


def ring_turned(model: Model, q: Floats, angle: float | Floats) -> Floats:
    """Return a casing's modal amplitudes in frames turned by given angles.

    q : (..., m), amplitudes in the static frame
    angle : (...,), rad, of each frame from the static one
    """
    out = q.copy()
    if model.casing is None:
        return out
    at = _ring_places(model.casing, model.blades)
    value = q[..., at.first] + 0j
    value[..., at.paired] -= 1j * q[..., at.second]
    value *= np.exp(1j * at.harmonic * np.asarray(angle)[..., None])
    out[..., at.first], out[..., at.second] = value.real, -value.imag[..., at.paired]
    return out
