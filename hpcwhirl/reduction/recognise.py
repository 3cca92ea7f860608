"""Whether a rotor from elsewhere has equal sectors, and its modes as waves if so.

A turn by one sector moves every tip to the next blade and turns the centre; what it
does to all other coordinates no file tells. But it maps modes of one frequency to one
another, so that tips and centre of the modes suffice. With the unitary transform F_k of
sector coordinates (Eqs. 10, 11; the centre's x_o - i y_o belongs to k = 1, x_o + i y_o
to k = -1), modes of nodal diameter k are those combinations u that F_j, j /= k, maps to
0. They come in pairs, sqrt(2) Re u and -sqrt(2) Im u, as those of the built-in rotor.

What differs from that is measured as a relative change of frequency, of damping over
frequency, or of a shape, so that one tolerance tells what it does to a motion.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.reduction.cyclic import diameters, is_simple, spread
from hpcwhirl.reduction.degenerate import ROUND_OFF, SAME, runs, unmixed
from hpcwhirl.reduction.modes import ModalModel, Symmetry, centre_rows, has_centre

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]
Complexes = NDArray[np.complex128]
EQUAL = 2e-5  # relative deviation up to which sectors are taken for equal
CLOSE = (1e-6, 1e-5, 1e-4, 1e-3)  # of omega: what an eigensolver may mix by round-off
ROUNDED = 1e-11  # share of other diameters in a shape that is one but for round-off
ALREADY = 1e-9  # of a shape: modes that are waves as they come
HIDDEN = 1e-10  # of the largest motion of tips and centre: a mode that has none
SMALL = 1e-3  # of the largest motion: smaller ones are held against this
FEWEST = 3  # blades of a wheel whose waves have a direction
TINY = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class _Wave:
    """A mode of a rotor of equal sectors.

    Attributes
    ----------
    k : nodal diameter
    omega, rate : rad/s; 2 xi omega, 1/s
    zeta : (3,), F_k of it: radial, tangential, centre
    turn : (m, 1) or, of a pair, (m, 2): of the file's modes, orthonormal
    """

    k: int
    omega: float
    rate: float
    zeta: Complexes
    turn: Floats

    @property
    def phases(self) -> int:
        """One of a simple harmonic, else two."""
        return int(self.turn.shape[1])


def transform(shapes: Floats, hub: Floats, blades: int) -> Complexes:
    """Return F_k of tips and centre, (N, 3, m), k = 0 .. N - 1.

    Parameters
    ----------
    shapes : (n, m), the tips (radial, tangential of blade 0, 1, ...) first
    hub : (2, m), x_o and y_o
    blades : N >= 3
    """
    tips = shapes[: 2 * blades].reshape(blades, 2, -1)
    out = np.zeros((blades, 3, shapes.shape[1]), dtype=np.complex128)
    out[:, :2] = np.fft.fft(tips, axis=0) / np.sqrt(blades)
    out[1, 2] = (hub[0] - 1j * hub[1]) / np.sqrt(2.0)
    out[-1, 2] = out[1, 2].conj()
    return out


def equal_sectors(model: ModalModel, blades: int) -> ModalModel:
    """Return a rotor as one of equal sectors, where it is to `EQUAL`; else as it came.

    Either bears what was found, `Symmetry`. The modes of a rotor of equal sectors look
    as those of the built-in one: each has one nodal diameter, pairs have one frequency
    and one damping ratio, their tips and centre are the two phases of one wave. Modes
    that are so already keep every bit. Modes that neither tips nor centre see are left
    out: nothing excites them.

    Parameters
    ----------
    model : from file, in general form: M, K and damping, or modes alone
    blades : N
    """
    if blades < FEWEST:
        return model
    kept = _already_waves(model, blades)
    if kept is not None:
        return kept
    turn = _unmixed(model, blades)
    try:
        waves = _waves(model, turn, blades)
    except _NoTwinError as alone:
        return replace(model, symmetry=Symmetry(np.inf, EQUAL, str(alone)))
    regular, own = _regular(model, waves, blades)
    found = _deviation(model, regular, own, blades)
    if not found.deviation <= EQUAL:
        return replace(model, symmetry=found)
    return replace(regular, symmetry=found)


def _already_waves(model: ModalModel, blades: int) -> ModalModel | None:
    """Return a rotor whose modes are waves as they come, with their labels; or None."""
    seen = transform(model.shapes, centre_rows(model, blades), blades)
    diameter = _power(seen).argmax(axis=0)
    rank, phase, worst = np.zeros_like(diameter), np.zeros_like(diameter), (0.0, 0)
    rows = 2 * blades + 2 * has_centre(model, blades)
    for k in diameters(blades):
        own, width = np.flatnonzero(diameter == k), 1 if is_simple(k, blades) else 2
        if len(own) % width:
            return None
        for place, pair in enumerate(own.reshape(-1, width)):
            if np.ptp(model.omega[pair]) or np.ptp(model.ratios[pair]):
                return None
            zeta = np.sqrt(width) * seen[k, :, pair[0]]
            wave = _Wave(k, 0.0, 0.0, zeta, np.zeros((1, width)))
            want = np.vstack(_tips_and_centre(wave, blades))[:rows]
            found = model.shapes[:rows, pair]
            size = max(float(np.abs(want).max()), TINY)
            miss = float(np.abs(found - want).max()) / size
            if not miss <= ALREADY:
                return None
            rank[pair], phase[pair] = place, np.arange(width)
            worst = max(worst, (miss, int(pair[0])))
    hertz, k = model.omega[worst[1]] / (2 * np.pi), diameter[worst[1]]
    where = f"shapes at {hertz:.4g} Hz, nodal diameter {k}"
    return replace(
        model,
        diameter=diameter,
        rank=rank,
        phase=phase,
        cyclic=True,
        symmetry=Symmetry(worst[0], EQUAL, where),
    )


def _unmixed(model: ModalModel, blades: int) -> Floats:
    """Return combinations of modes (m, c) that have one diameter each, if there are.

    First of modes of one frequency. Then of close ones where an eigensolver's
    round-off, divided by what they are apart, has mixed them.
    """
    squared, hub = model.omega**2, centre_rows(model, blades)
    turn = np.eye(len(squared))
    size = (model.shapes[: 2 * blades] ** 2).sum(axis=0) + (hub**2).sum(axis=0)
    kept = size > HIDDEN**2 * size.max()
    for own in runs(squared, SAME * squared + _floor(model)):
        if not kept[own].any():  # their round-off has no diameter
            continue
        columns, moving = unmixed(model.shapes[:, own], blades, hub[:, own])
        turn[np.ix_(own, own)] = columns
        kept[own[:moving]], kept[own[moving:]] = True, False
    turn = turn[:, kept]
    for near in CLOSE:
        turn = _apart(model, turn, near, blades)
    return turn


def _floor(model: ModalModel) -> float:
    """Return what omega^2 is told no better than, (rad/s)^2."""
    return ROUND_OFF * len(model.omega) * float(model.omega.max()) ** 2


def _apart(model: ModalModel, turn: Floats, near: float, blades: int) -> Floats:
    """Return `turn` with modes taken apart that lie within `near` of one another."""
    squared = _squared(model, turn)
    order = np.argsort(squared, kind="stable")
    turn, squared = turn[:, order], squared[order]
    shapes, hub = model.shapes @ turn, centre_rows(model, blades) @ turn
    for own in runs(squared, 2 * near * squared):
        part = transform(shapes[:, own], hub[:, own], blades)
        before = float(_leaks(part).max())
        if before <= ROUNDED:
            continue
        columns, moving = unmixed(shapes[:, own], blades, hub[:, own])
        columns = _by_frequency(columns, np.tensordot(part, columns, 1), squared[own])
        part = np.tensordot(part, columns, axes=1)
        if moving == len(own) and _leaks(part).max() < before:
            turn[:, own] = turn[:, own] @ columns  # else frequency alone parts them
    return turn


def _by_frequency(columns: Floats, seen: Complexes, squared: Floats) -> Floats:
    """Return columns (c, c) of which those of one diameter part by frequency again."""
    label, out = _power(seen).argmax(axis=0), columns.copy()
    for k in np.unique(label):
        own = columns[:, label == k]
        out[:, label == k] = own @ np.linalg.eigh((own.T * squared) @ own)[1]
    return out


def _squared(model: ModalModel, turn: Floats) -> Floats:
    """Return omega^2 of combinations (m, c) of modes, (c,)."""
    return np.asarray(model.omega**2 @ turn**2)


def _power(seen: Complexes) -> Floats:
    """Return what each nodal diameter 0 .. N // 2 has of combinations, (K, c)."""
    whole = (np.abs(seen) ** 2).sum(axis=1)
    count = len(whole)
    folded = whole[: count // 2 + 1].copy()
    for k in range(1, (count + 1) // 2):
        folded[k] += whole[count - k]
    return np.asarray(folded)


def _leaks(seen: Complexes) -> Floats:
    """Return what of the motion of each combination is off its own diameter, (c,)."""
    power = _power(seen)
    whole = power.sum(axis=0)
    power[power.argmax(axis=0), np.arange(power.shape[1])] = 0.0
    return np.asarray(np.sqrt(power.sum(axis=0) / np.maximum(whole, TINY)))


class _NoTwinError(Exception):
    """A nodal diameter has an odd number of modes."""


def _waves(model: ModalModel, turn: Floats, blades: int) -> list[_Wave]:
    """Return all waves; pairs are made of modes of one diameter as they follow."""
    seen = transform(model.shapes @ turn, centre_rows(model, blades) @ turn, blades)
    squared, out = _squared(model, turn), []
    label = _power(seen).argmax(axis=0)
    for k in diameters(blades):
        own = np.flatnonzero(label == k)
        own = own[np.argsort(squared[own], kind="stable")]
        if is_simple(k, blades):
            out += [_standing(model, turn[:, [m]], seen[k][:, m], k) for m in own]
        elif len(own) % 2:
            hertz = np.sqrt(squared[own[-1]]) / (2 * np.pi)
            msg = f"{len(own)} modes of nodal diameter {k}, the last at {hertz:.4g} Hz"
            raise _NoTwinError(f"{msg}, are no pairs")
        else:
            for group in _groups(own, squared):
                out += _running(model, turn[:, group], seen[k][:, group], k)
    return out


def _groups(own: NDArray[np.intp], squared: Floats) -> list[NDArray[np.intp]]:
    """Return pairs of ascending modes; pairs that are close together as one group."""
    pairs = own.reshape(-1, 2)
    gaps = squared[pairs[1:, 0]] - squared[pairs[:-1, 1]]
    cuts = np.flatnonzero(gaps > 2 * EQUAL * squared[pairs[1:, 0]]) + 1
    return [part.ravel() for part in np.split(pairs, cuts) if len(part)]


def _standing(model: ModalModel, turn: Floats, seen: Complexes, k: int) -> _Wave:
    """Return the mode of a simple harmonic, k = 0 or N / 2."""
    zeta = seen.real
    sign = 1.0 if zeta[np.argmax(np.abs(zeta))] > 0.0 else -1.0
    rate = float(_rates(model) @ turn[:, 0] ** 2)
    omega = float(np.sqrt(_squared(model, turn)[0]))
    return _Wave(k, omega, rate, (sign * zeta).astype(np.complex128), sign * turn)


def _rates(model: ModalModel) -> Floats:
    """Return 2 xi omega, (m,), 1/s."""
    return np.asarray(2 * model.ratios * model.omega)


def _running(model: ModalModel, turn: Floats, seen: Complexes, k: int) -> list[_Wave]:
    """Return the pairs of 2 p combinations (m, 2 p) of nodal diameter k.

    seen : (3, 2 p), F_k of the combinations. It maps the twins of u to 0, so that the
    u are its right singular vectors.
    """
    count = turn.shape[1] // 2
    u = turn @ np.linalg.svd(seen)[2][:count].conj().T
    squared, mix = np.linalg.eigh((u.conj().T * model.omega**2) @ u)
    u = u @ mix
    pairs = np.sqrt(2.0) * np.stack([u.real, -u.imag], axis=2).reshape(len(u), -1)
    left, _, right = np.linalg.svd(pairs, full_matrices=False)
    pairs = left @ right  # orthonormal; as before where u and its twin are
    zeta = seen @ (turn.T @ u)
    out = []
    for p in range(count):
        top = zeta[np.argmax(np.abs(zeta[:2, p])), p]
        phase = np.abs(top) / top if top else 1.0  # the larger one is a cosine
        own = pairs[:, 2 * p : 2 * p + 2] @ _rotation(phase)
        rate = float(_rates(model) @ np.abs(u[:, p]) ** 2)
        omega = float(np.sqrt(max(squared[p], 0.0)))
        out.append(_Wave(k, omega, rate, zeta[:, p] * phase, own))
    return out


def _rotation(phase: complex) -> Floats:
    """Return (2, 2): the pair of u phase for that of u."""
    c, s = phase.real, phase.imag
    return np.array([[c, -s], [s, c]])


def _tips_and_centre(wave: _Wave, blades: int) -> tuple[Floats, Floats]:
    """Return tips (2 N, p) and centre (2, p) of a wave, exactly periodic."""
    columns = spread(wave.k, blades)
    z = np.array([[wave.zeta.real, -wave.zeta.imag], [wave.zeta.imag, wave.zeta.real]])
    tips = np.einsum("ja,apd->jdp", columns, z[: wave.phases, : wave.phases, :2])
    hub = np.array([z[0, :, 2], -z[1, :, 2]])[:, : wave.phases]
    return tips.reshape(2 * blades, -1), hub


def _regular(
    model: ModalModel, waves: list[_Wave], blades: int
) -> tuple[ModalModel, Floats]:
    """Return the model of these waves, in the built-in's order, and its turn (m, c)."""
    records = []
    for k in diameters(blades):
        own = sorted((w for w in waves if w.k == k), key=lambda w: w.omega)
        records += [(w.omega, k, rank, w) for rank, w in enumerate(own)]
    records.sort(key=lambda record: record[:3])
    turn = np.hstack([w.turn for *_, w in records])
    tips, hubs = zip(*(_tips_and_centre(w, blades) for *_, w in records), strict=True)
    shapes, seen = model.shapes @ turn, 2 * blades
    shapes[:seen] = np.hstack(tips)
    if has_centre(model, blades):
        shapes[seen : seen + 2] = np.hstack(hubs)
    labels = [
        (*record[:3], phase, record[3].rate)
        for record in records
        for phase in range(record[3].phases)
    ]
    omega, diameter, rank, phase, rate = map(np.array, zip(*labels, strict=True))
    uneven = np.ndim(model.damping) > 0
    regular = replace(
        model,
        shapes=np.ascontiguousarray(shapes),
        omega=omega,
        diameter=diameter,
        rank=rank,
        phase=phase,
        centre_share=np.zeros(len(omega)),
        damping=rate / np.maximum(2 * omega, TINY) if uneven else model.damping,
        cyclic=True,
    )
    return regular, turn


def _deviation(
    model: ModalModel, regular: ModalModel, turn: Floats, blades: int
) -> Symmetry:
    """Return the largest deviation of a rotor from the regular one made of it."""
    omega, rows = regular.omega, 2 * blades + 2 * has_centre(model, blades)
    stiffness = np.abs((turn.T * model.omega**2) @ turn - np.diag(omega**2))
    stiffness = np.maximum(stiffness - _floor(model), 0.0)
    damping = np.abs((turn.T * _rates(model)) @ turn - np.diag(_rates(regular)))
    size = np.linalg.norm(regular.shapes[:rows], axis=0)
    miss = np.linalg.norm(model.shapes[:rows] @ turn - regular.shapes[:rows], axis=0)
    both = np.maximum(np.outer(omega, omega), TINY)
    found = {
        "frequencies": (stiffness / (2 * both)).max(axis=0),
        "damping": (damping / (2 * np.sqrt(both))).max(axis=0),
        "shapes": miss / np.maximum(size, SMALL * size.max()),
    }
    what = max(found, key=lambda name: float(found[name].max()))
    worst = int(np.argmax(found[what]))
    hertz, k = omega[worst] / (2 * np.pi), regular.diameter[worst]
    where = f"{what} at {hertz:.4g} Hz, nodal diameter {k}"
    return Symmetry(float(found[what][worst]), EQUAL, where)
