"""Recognition of equal sectors of a rotor from file, whose modes become waves.

A rotor whose sectors are equal is computed faster, by its waves, modes of one nodal
diameter each. The file has modes in any form; here combinations of modes of equal
frequency are searched that are such waves.

A rotation by one sector moves every tip to the next blade and turns the centre; its
effect on other coordinates is not in the file. But it maps modes of equal frequency to
one another, so that tips and centre of the modes suffice. With the unitary transform
F_k of sector coordinates (Eqs. 10, 11; the centre's x_o - i y_o belongs to k = 1, x_o +
i y_o to k = -1), modes of nodal diameter k are those combinations u that F_j, j /= k,
maps to 0. They come in pairs, sqrt(2) Re u and -sqrt(2) Im u, like those of the
built-in rotor.

Deviations from this form are measured as relative changes of frequency, of damping over
frequency, or of a shape, so that one tolerance limits their effect on a motion.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from hpcwhirl.arrays import Complexes, Floats, Indices
from hpcwhirl.reduction.cyclic_coordinates import (
    ROUND_OFF,
    SAME,
    diameters,
    is_simple,
    runs,
    spread,
    unmixed,
)
from hpcwhirl.reduction.modes import ModalModel, Symmetry, centre_rows, has_centre
from hpcwhirl.reduction.supports import planar

EQUAL = 2e-5  # relative deviation up to which sectors count as equal
CLOSE = (1e-6, 1e-5, 1e-4, 1e-3)  # relative differences of omega up to which modes may
# have been mixed by round-off: their nodal diameters are separated, close modes first
ROUNDED = 1e-11  # share of other diameters in a shape that round-off explains
ALREADY = 1e-9  # relative deviation of a shape up to which a mode already is a wave
HIDDEN = 1e-10  # motion of tips and centre that counts as 0, relative to the largest
SMALL = 1e-3  # least motion, relative to the largest, by which deviations are divided
FEWEST = 3  # least number of blades for which waves have a direction
TINY = float(np.finfo(float).tiny)


@dataclass(frozen=True)
class _Wave:
    """A wave of a rotor of equal sectors: a mode, or a pair of modes, of one diameter.

    Attributes
    ----------
    k : nodal diameter
    omega, rate : natural frequency, rad/s; damping rate 2 xi omega, 1/s
    zeta : (3,), complex amplitudes at k of radial and tangential tip motion and of the
        centre, see `transform`
    turn : (m, 1) or, for a pair, (m, 2), the wave's real modes as orthonormal
        combinations of the file's m modes
    """

    k: int
    omega: float
    rate: float
    zeta: Complexes
    turn: Floats

    @property
    def phases(self) -> int:
        """Number of real modes: 1 for a simple harmonic, else 2."""
        return int(self.turn.shape[1])


def transform(shapes: Floats, hub: Floats, blades: int) -> Complexes:
    """Return amplitudes of tips and centre on nodal diameters k of m modes, (N, 3, m).

    For each k = 0 .. N - 1 they are the discrete Fourier transform over blades of
    radial and of tangential tip motion, and the centre's part in k = 1 or -1: F_k of
    this module.

    Parameters
    ----------
    shapes : (n, m), the tips (radial, tangential of blade 0, 1, ...) first
    hub : (2, m), x_o and y_o in each mode
    blades : N >= 3
    """
    tips = shapes[: 2 * blades].reshape(blades, 2, -1)
    out = np.zeros((blades, 3, shapes.shape[1]), dtype=np.complex128)
    out[:, :2] = np.fft.fft(tips, axis=0) / np.sqrt(blades)
    out[1, 2] = (hub[0] - 1j * hub[1]) / np.sqrt(2.0)
    out[-1, 2] = out[1, 2].conj()
    return out


def equal_sectors(model: ModalModel, blades: int) -> ModalModel:
    """Return a rotor in the form of equal sectors if they are equal within `EQUAL`.

    Otherwise it is returned unchanged; in either case with its measured `Symmetry`. The
    modes of a rotor of equal sectors have the form of the built-in rotor's: each has
    one nodal diameter, pairs have one frequency and one damping ratio, and their tips
    and centre are the two phases of one wave. Modes that already have this form are
    returned bit for bit. Otherwise, modes that move neither tips nor centre are left
    out, since nothing excites them.

    Parameters
    ----------
    model : rotor from file, in general form: M, K and damping, or modes only
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
    regular, combination = _regular(model, waves, blades)
    symmetry = _deviation(model, regular, combination, blades)
    if not symmetry.deviation <= EQUAL:
        return replace(model, symmetry=symmetry)
    return replace(regular, symmetry=symmetry)


def _already_waves(model: ModalModel, blades: int) -> ModalModel | None:
    """Return a rotor from file with labels of its modes, if they already are waves.

    Each mode must then be one phase of an exact wave. The labels are nodal diameter,
    rank and phase; None if a mode has another form.
    """
    seen = transform(model.shapes, centre_rows(model, blades), blades)
    diameter = _power(seen).argmax(axis=0)
    rank, phase, worst = np.zeros_like(diameter), np.zeros_like(diameter), (0.0, 0)
    rows = 2 * blades + 2 * has_centre(model, blades)
    for k in diameters(blades):
        modes, width = np.flatnonzero(diameter == k), 1 if is_simple(k, blades) else 2
        if len(modes) % width:
            return None
        for place, pair in enumerate(modes.reshape(-1, width)):
            if np.ptp(model.omega[pair]) or np.ptp(model.ratios[pair]):
                return None
            zeta = np.sqrt(width) * seen[k, :, pair[0]]
            wave = _Wave(k, 0.0, 0.0, zeta, np.zeros((1, width)))
            want = np.vstack(_tips_and_centre(wave, blades))[:rows]
            shape = model.shapes[:rows, pair]
            size = max(float(np.abs(want).max()), TINY)
            miss = float(np.abs(shape - want).max()) / size
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
    """Return combinations of a rotor's modes that have one nodal diameter each.

    Returns (m, c), c orthonormal combinations of m modes, as far as they exist

    First, modes of equal frequency are separated, then modes of close frequencies,
    which the round-off of an eigensolver mixes, the more the closer they are.
    """
    squared, hub = model.omega**2, centre_rows(model, blades)
    turn = np.eye(len(squared))
    size = (model.shapes[: 2 * blades] ** 2).sum(axis=0) + (hub**2).sum(axis=0)
    kept = size > HIDDEN**2 * size.max()
    for run in runs(squared, SAME * squared + _floor(model)):
        if not kept[run].any():  # motions of round-off size have no diameter
            continue
        columns, moving = unmixed(model.shapes[:, run], blades, hub[:, run])
        turn[np.ix_(run, run)] = columns
        kept[run[:moving]], kept[run[moving:]] = True, False
    turn = turn[:, kept]
    for near in CLOSE:
        turn = _separated(model, turn, near, blades)
    return turn


def _floor(model: ModalModel) -> float:
    """Return the error of omega^2 that an eigensolver makes by round-off, (rad/s)^2.

    model : rotor whose modes are known
    """
    return ROUND_OFF * len(model.omega) * float(model.omega.max()) ** 2


def _separated(model: ModalModel, turn: Floats, near: float, blades: int) -> Floats:
    """Return combinations of modes in which close frequencies have separate diameters.

    Returns (m, c), `turn` sorted by frequency, in which modes of close frequencies are
    replaced by combinations of one nodal diameter each where that succeeds

    turn : (m, c), combinations of the rotor's m modes
    near : relative difference up to which frequencies count as close
    """
    squared = _squared(model, turn)
    order = np.argsort(squared, kind="stable")
    turn, squared = turn[:, order], squared[order]
    shapes, hub = model.shapes @ turn, centre_rows(model, blades) @ turn
    for run in runs(squared, 2 * near * squared):
        part = transform(shapes[:, run], hub[:, run], blades)
        before = float(_leaks(part).max())
        if before <= ROUNDED:
            continue
        columns, moving = unmixed(shapes[:, run], blades, hub[:, run])
        columns = _by_frequency(columns, np.tensordot(part, columns, 1), squared[run])
        part = np.tensordot(part, columns, axes=1)
        if moving == len(run) and _leaks(part).max() < before:
            turn[:, run] = turn[:, run] @ columns
    return turn


def _by_frequency(columns: Floats, seen: Complexes, squared: Floats) -> Floats:
    """Return combinations of modes that are uncoupled within each nodal diameter.

    The stiffness is diagonal in the combinations of each diameter.

    columns : (c, c), orthonormal combinations of the c modes, of one diameter each
    seen : (N, 3, c), `transform` of these combinations
    squared : (c,), omega^2 of the c modes
    """
    label, out = _power(seen).argmax(axis=0), columns.copy()
    for k in np.unique(label):
        same = columns[:, label == k]
        out[:, label == k] = same @ np.linalg.eigh((same.T * squared) @ same)[1]
    return out


def _squared(model: ModalModel, turn: Floats) -> Floats:
    """Return omega^2 of combinations of a rotor's modes, (c,), (rad/s)^2.

    It is the Rayleigh quotient; turn : (m, c), combinations of m modes
    """
    return np.asarray(model.omega**2 @ turn**2)


def _power(seen: Complexes) -> Floats:
    """Return the squared motion of tips and centre on each nodal diameter k.

    Returns (N // 2 + 1, c), of c combinations of modes; k and N - k are added up

    seen : (N, 3, c), discrete Fourier transform over the blades of radial and
        tangential tip motion and of the centre's motion, see `transform`
    """
    whole = (np.abs(seen) ** 2).sum(axis=1)
    count = len(whole)
    folded = whole[: count // 2 + 1].copy()
    for k in range(1, (count + 1) // 2):
        folded[k] += whole[count - k]
    return np.asarray(folded)


def _leaks(seen: Complexes) -> Floats:
    """Return how much each of c modes moves on other diameters than its main one, (c,).

    It is the ratio of the amplitude on these diameters to that on all, 0 to 1.

    seen : (N, 3, c), `transform` of the modes, combinations of a rotor's
    """
    power = _power(seen)
    whole = power.sum(axis=0)
    power[power.argmax(axis=0), np.arange(power.shape[1])] = 0.0
    return np.asarray(np.sqrt(power.sum(axis=0) / np.maximum(whole, TINY)))


class _NoTwinError(Exception):
    """A nodal diameter, whose modes must form pairs, has an odd number of them."""


def _waves(model: ModalModel, turn: Floats, blades: int) -> list[_Wave]:
    """Return the waves that a rotor's modes form: modes or pairs of one diameter.

    Two successive modes of a nodal diameter are a pair.

    turn : (m, c), combinations of the rotor's m modes, of one diameter each
    """
    seen = transform(model.shapes @ turn, centre_rows(model, blades) @ turn, blades)
    squared, out = _squared(model, turn), []
    label = _power(seen).argmax(axis=0)
    for k in diameters(blades):
        modes = np.flatnonzero(label == k)
        modes = modes[np.argsort(squared[modes], kind="stable")]
        if is_simple(k, blades):
            out += [_standing(model, turn[:, [m]], seen[k][:, m], k) for m in modes]
        elif len(modes) % 2:
            hertz = np.sqrt(squared[modes[-1]]) / (2 * np.pi)
            msg = (
                f"{len(modes)} modes of nodal diameter {k}, the last at {hertz:.4g} Hz"
            )
            raise _NoTwinError(f"{msg}, cannot all be paired")
        else:
            for group in _groups(modes, squared):
                out += _running(model, turn[:, group], seen[k][:, group], k)
    return out


def _groups(modes: Indices, squared: Floats) -> list[Indices]:
    """Divide the modes of a nodal diameter into pairs, or groups of pairs.

    Pairs whose frequencies are close, so that it is not clear which modes belong
    together, form one group.

    modes : (2 p,), indices of the diameter's modes by ascending frequency
    squared : omega^2 of all modes of the rotor
    """
    pairs = modes.reshape(-1, 2)
    gaps = squared[pairs[1:, 0]] - squared[pairs[:-1, 1]]
    cuts = np.flatnonzero(gaps > 2 * EQUAL * squared[pairs[1:, 0]]) + 1
    return [part.ravel() for part in np.split(pairs, cuts) if len(part)]


def _standing(model: ModalModel, turn: Floats, seen: Complexes, k: int) -> _Wave:
    """Return the wave of one mode of a simple harmonic, k = 0 or N / 2.

    Its sign is such that its largest amplitude is positive.

    turn : (m, 1), the mode as a combination of the rotor's m modes
    seen : (3,), its amplitudes of tips and centre at k, see `transform`
    """
    zeta = seen.real
    sign = 1.0 if zeta[np.argmax(np.abs(zeta))] > 0.0 else -1.0
    rate = float(_rates(model) @ turn[:, 0] ** 2)
    omega = float(np.sqrt(_squared(model, turn)[0]))
    return _Wave(k, omega, rate, (sign * zeta).astype(np.complex128), sign * turn)


def _rates(model: ModalModel) -> Floats:
    """Return the damping rate 2 xi omega of each of a rotor's m modes, (m,), 1/s."""
    return np.asarray(2 * model.ratios * model.omega)


def _running(model: ModalModel, turn: Floats, seen: Complexes, k: int) -> list[_Wave]:
    """Return the p travelling waves that 2 p real modes of nodal diameter k form.

    Conjugates of the waves have no amplitude at k, so that the waves, as combinations
    of the modes, are the first p right singular vectors of `seen`.

    Parameters
    ----------
    model : the rotor, with m modes
    turn : (m, 2 p), the 2 p modes as orthonormal combinations of the rotor's
    seen : (3, 2 p), amplitudes of the 2 p modes' tips and centre at k, see `transform`
    k : nodal diameter
    """
    count = turn.shape[1] // 2
    u = turn @ np.linalg.svd(seen)[2][:count].conj().T
    squared, mix = np.linalg.eigh((u.conj().T * model.omega**2) @ u)
    u = u @ mix
    pairs = np.sqrt(2.0) * np.stack([u.real, -u.imag], axis=2).reshape(len(u), -1)
    left, _, right = np.linalg.svd(pairs, full_matrices=False)
    pairs = left @ right  # orthonormal; unchanged if u and its conjugate already are
    zeta = seen @ (turn.T @ u)
    out = []
    for p in range(count):
        top = zeta[np.argmax(np.abs(zeta[:2, p])), p]
        phase = np.abs(top) / top if top else 1.0  # makes the largest entry real
        turned = pairs[:, 2 * p : 2 * p + 2] @ planar(phase)
        rate = float(_rates(model) @ np.abs(u[:, p]) ** 2)
        omega = float(np.sqrt(max(squared[p], 0.0)))
        out.append(_Wave(k, omega, rate, zeta[:, p] * phase, turned))
    return out


def _tips_and_centre(wave: _Wave, blades: int) -> tuple[Floats, Floats]:
    """Return displacements of tips, (2 N, p), and centre, (2, p), in a wave's p modes.

    wave : wave with p = 1 or 2 real modes; tips are radial, tangential of each blade
    """
    columns = spread(wave.k, blades)
    z = np.array([[wave.zeta.real, -wave.zeta.imag], [wave.zeta.imag, wave.zeta.real]])
    tips = np.einsum("ja,apd->jdp", columns, z[: wave.phases, : wave.phases, :2])
    hub = np.array([z[0, :, 2], -z[1, :, 2]])[:, : wave.phases]
    return tips.reshape(2 * blades, -1), hub


def _regular(
    model: ModalModel, waves: list[_Wave], blades: int
) -> tuple[ModalModel, Floats]:
    """Return a rotor whose modes are exact waves, and these modes by those of the file.

    Returns the rotor, its c modes in the order of the built-in rotor's; and (m, c),
    these modes as combinations of the file's m modes

    model, waves : rotor as in the file; waves found in its modes
    """
    records = []
    for k in diameters(blades):
        ordered = sorted((w for w in waves if w.k == k), key=lambda w: w.omega)
        records += [(w.omega, k, rank, w) for rank, w in enumerate(ordered)]
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
    """Return how much the sectors of a rotor from file differ from equal ones.

    model : rotor as in the file
    regular, turn : result of `_regular`: the rotor whose modes are exact waves, and
        these modes as combinations of those of `model`
    """
    omega, rows = regular.omega, 2 * blades + 2 * has_centre(model, blades)
    stiffness = np.abs((turn.T * model.omega**2) @ turn - np.diag(omega**2))
    stiffness = np.maximum(stiffness - _floor(model), 0.0)
    damping = np.abs((turn.T * _rates(model)) @ turn - np.diag(_rates(regular)))
    size = np.linalg.norm(regular.shapes[:rows], axis=0)
    miss = np.linalg.norm(model.shapes[:rows] @ turn - regular.shapes[:rows], axis=0)
    both = np.maximum(np.outer(omega, omega), TINY)
    deviations = {
        "frequencies": (stiffness / (2 * both)).max(axis=0),
        "damping": (damping / (2 * np.sqrt(both))).max(axis=0),
        "shapes": miss / np.maximum(size, SMALL * size.max()),
    }
    what = max(deviations, key=lambda name: float(deviations[name].max()))
    worst = int(np.argmax(deviations[what]))
    hertz, k = omega[worst] / (2 * np.pi), regular.diameter[worst]
    where = f"{what} at {hertz:.4g} Hz, nodal diameter {k}"
    return Symmetry(float(deviations[what][worst]), EQUAL, where)
