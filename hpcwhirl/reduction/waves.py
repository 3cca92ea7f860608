"""Waves of a rotating rotor: natural frequencies, growth, response to an unbalance.

Waves are the free motions; they solve a quadratic eigenproblem on each nodal diameter.
On nodal diameter k, u = Re(Y e^{i k theta + s t}) in the rotating frame,

[s^2 M + s (D + D_s + 2 Omega C) + K(Omega) + S] Y = 0,

K(Omega) = K_0 + Omega^2 K_1 + Omega^4 K_2, with M, K Hermitian and C skew-Hermitian.
Each root s is one wave. At Omega > 0 it turns with the rotation (forward) if Im s < 0,
with frequency -Im s in the rotating frame and -Im s + k Omega in the static one; at
Omega < 0 if Im s > 0, with frequencies Im s and Im s - k Omega. The sorted 2 m
frequencies of m coordinates keep their order at all speeds, so each wave is named
after the mode at rest from which it comes. With unequal sectors a wave has no single
diameter and is named after the mode at rest of which it contains most.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from scipy.linalg import eigh

from hpcwhirl.arrays import Complexes, Floats
from hpcwhirl.reduction.cyclic_coordinates import is_simple
from hpcwhirl.reduction.families import family_ranks
from hpcwhirl.reduction.modes import (
    ModalModel,
    Spin,
    SpinBlock,
    has_centre,
    stiffening_at,
    unheld_rates,
    unlike_waves,
)
from hpcwhirl.reduction.numbers import zero_between
from hpcwhirl.reduction.supports import Bearing, Support, planar

WATCHED = 4.0  # highest speed of a search / first natural frequency, without a table
SPEEDS = 101  # number of speeds of a bearing's table at which resonances are searched
REAL = 1e-9  # imaginary part, relative to the largest root, of a root taken as real
ALIKE = 1e-6  # relative difference up to which frequencies count as equal
Unlike = list[tuple[Complexes, Support | Bearing]]  # see `unlike_waves`
ROUND_OFF = 1e-11  # growth rate, relative to the highest frequency, that counts as 0


@dataclass(frozen=True)
class WaveLine:
    """A travelling wave of the rotor, a free motion, at one speed.

    Attributes
    ----------
    nodal_diameter, family : labels of the mode at rest from which it comes
    rotating, static : damped frequency in the rotating and in the static frame, rad/s;
        > 0: turns with Omega
    growth : growth rate, 1/s, < 0 if it decays
    """

    nodal_diameter: int
    family: str
    rotating: float
    static: float
    growth: float


def wave_lines(model: ModalModel, blades: int, speed: float) -> list[WaveLine]:
    """Return all waves of a rotor at a speed, sorted by diameter and frequency.

    A standing wave (k = N / 2, or a single mode of a mistuned rotor without terms of
    rotation) is returned as two waves of opposite sense; a mode of k = 0 as one.
    """
    if model.spin is None:
        lines = _at_rest(model, speed)
    elif model.spin.waves:
        lines = _by_diameter(model, model.spin, speed)
    else:
        lines = _of_whole(model, blades, speed)
    return sorted(lines, key=lambda line: (line.nodal_diameter, line.rotating))


def _line(k: int, family: str, root: complex, speed: float) -> WaveLine:
    """Return the wave e^{i k theta + s t} with frequencies and growth from a root s.

    k, family : nodal diameter; family of the mode at rest from which it comes
    root, speed : s, 1/s; Omega, rad/s
    """
    sense = -1.0 if speed < 0.0 and k > 0 else 1.0
    turning = -sense * float(root.imag)
    return WaveLine(k, family, turning, turning + k * abs(speed), float(root.real))


def _at_rest(model: ModalModel, speed: float) -> list[WaveLine]:
    """Return the waves of a rotor without terms of rotation, by nodal diameter.

    Their frequencies in the rotating frame are those at rest.

    speed : Omega, rad/s, for frequencies in the static frame
    """
    lines = []
    for k in np.unique(model.diameter).tolist():
        names = family_ranks(model, k)
        chosen = model.diameter == k
        if model.cyclic:
            chosen &= model.phase == 0
        for m in np.flatnonzero(chosen):
            omega, ratio = model.omega[m], model.ratios[m]
            swing = omega * np.sqrt(max(1.0 - ratio**2, 0.0))
            roots = -ratio * omega + 1j * swing * np.array([-1.0, 1.0])
            name = names[int(model.rank[m])]
            used = roots[:1] if k == 0 else roots
            lines += [_line(k, name, complex(root), speed) for root in used]
    return lines


def _by_diameter(model: ModalModel, spin: Spin, speed: float) -> list[WaveLine]:
    """Return the waves of a rotor of equal sectors with terms of rotation, by diameter.

    spin, speed : terms of rotation; Omega, rad/s
    """
    lines = []
    for piece in spin.waves:
        names = family_ranks(model, piece.k)
        roots = _by_orbits(model, piece, speed, wave_roots(model, piece, speed))
        if piece.k == 0:
            roots = roots[: len(roots) // 2]  # s and its conjugate are one motion
        for place, root in enumerate(roots):
            rank = rank_of(place, len(piece.omega))
            lines.append(_line(piece.k, names[rank], complex(root), speed))
    return lines


def rank_of(place: int, modes: int) -> int:
    """Return the rank of the mode at rest from which a wave comes.

    place : index of the wave's root among the roots of its nodal diameter, sorted from
        forward to backward
    modes : number m of the diameter's modes, which have 2 m roots
    """
    return modes - 1 - place if place < modes else place - modes


def wave_roots(model: ModalModel, piece: SpinBlock, speed: float) -> Complexes:
    """Return the 2 m roots s, 1/s, of waves e^{s t} of one nodal diameter.

    They are sorted by Im s: forward waves first, from the highest frequency down, then
    backward waves upward.

    model, piece : rotor; m modes of the diameter at rest and their terms of rotation
    speed : Omega, rad/s
    """
    gyro, damping, stiffness, push = diameter_matrices(model, piece, speed)
    roots = quadratic_roots(damping + gyro, stiffness + push)
    roots, own = roots[np.argsort(roots.imag, kind="stable")], model.spin
    if own is None or own.is_round or not piece.hub.any():
        return roots
    pair = damping + gyro, stiffness + push
    return _apart(pair, unlike_waves(own, piece), speed, roots)


def _by_orbits(
    model: ModalModel, piece: SpinBlock, speed: float, roots: Complexes
) -> Complexes:
    """Return roots s, each of the wave in whose sense the motion mostly turns.

    On supports that differ by direction a free motion is elliptic: two waves, Y e^{s t}
    and conj(X e^{s t}) in the static frame. The larger one by mass is meant; `roots`
    stay where both are alike, as without rotation and damping, or do not turn.

    model, piece, speed, roots : as for `wave_roots`, and its result
    """
    own = model.spin
    if own is None or own.is_round or not piece.hub.any():
        return roots
    gyro, damping, stiffness, push = diameter_matrices(model, piece, speed)
    pair = damping + gyro, stiffness + push
    matrices = coupled_by_supports(pair, unlike_waves(own, piece), speed)
    values, shapes = np.linalg.eig(_companion(*matrices))
    size = np.abs(shapes[: 2 * len(piece.omega)].reshape(2, -1, len(values))) ** 2
    more, less = size.sum(axis=1)
    still = roots - 1j * speed
    upper = np.where(still.imag > 0.0, still, still.conj())
    at = np.abs(values - upper[:, None]).argmin(axis=1)
    lean = (more - less)[at] / (more + less)[at]
    turned = np.where(lean > 0.0, upper, upper.conj())
    clear = (np.abs(lean) > ALIKE) & (upper.imag > ALIKE * np.abs(upper))
    return np.asarray(np.where(clear, turned, still) + 1j * speed)


def _apart(
    matrices: tuple[Complexes, Complexes],
    apart: Unlike,
    speed: float,
    roots: Complexes,
) -> Complexes:
    """Return the roots s of nodal diameter 1 on supports that differ by direction.

    In the static frame, with y = Y e^{i Omega t} and X = conj(Y),

    [s^2 + s (G + 2 i Omega) + K + i Omega G - Omega^2] Y = -conj(k_d + s c_d) X

    at each support, and the conjugate equation: each pair of roots s, conj(s) is an
    elliptic motion. It gets the name and place (forward or backward) of the wave on the
    mean supports with the nearest frequency; `_by_orbits` tells how it turns.

    Parameters
    ----------
    matrices : G = D + 2 Omega C and K on the mean supports, (m, m), rotating frame
    apart : supports that differ by direction, see `unlike_waves`
    speed : Omega, rad/s
    roots : (2 m,), 1/s, roots on the mean supports, sorted from forward to backward
    """
    from scipy.optimize import linear_sum_assignment  # slow to import

    found = quadratic_roots(*coupled_by_supports(matrices, apart, speed))
    found = found[np.argsort(-found.imag, kind="stable")][: len(roots)]
    named = (roots - 1j * speed).imag
    near = np.abs(named) - ALIKE * named  # of equal frequencies forward is the higher
    found = found[linear_sum_assignment(np.abs(near[:, None] - found.imag))[1]]
    return np.asarray(np.where(named > 0.0, found, found.conj()) + 1j * speed)


def coupled_by_supports(
    matrices: tuple[Complexes, Complexes], apart: Unlike, speed: float
) -> tuple[Complexes, Complexes]:
    """Return the matrices of Y and conj(Y) in the equation of `_apart`, (2 m, 2 m).

    They are those of velocities and of displacements, static frame; matrices, apart,
    speed as in `_apart`
    """
    rate, whole = matrices
    same = np.eye(len(rate))
    held = whole + 1j * speed * rate - speed**2 * same
    lost, stiff = _across(apart, speed)
    return (
        _with_conjugate(rate + 2j * speed * same, lost),
        _with_conjugate(held, stiff),
    )


def _across(apart: Unlike, speed: float) -> tuple[Complexes, Complexes]:
    """Return the sums of c_d and of k_d over supports, as B of `_with_conjugate`.

    apart, speed : as in `_apart`
    """
    now = [(np.outer(row, row), own.at(speed)) for row, own in apart]
    return (
        np.asarray(sum(own.damping_apart * moved for moved, own in now)),
        np.asarray(sum(own.stiffness_apart * moved for moved, own in now)),
    )


def _with_conjugate(matrix: Complexes, across: Any) -> Complexes:
    """Return the matrix of motions on supports that differ by direction, (2 m, 2 m).

    It is [[A, conj(B)], [B, conj(A)]], which acts on (Y, conj(Y)) of `_apart`.

    matrix, across : A and B (m, m); B = k_d z z^T at a support, or c_d z z^T, z (m,)
        its motion in the modes; 0: none
    """
    across = np.broadcast_to(across, matrix.shape)
    return np.block([[matrix, across.conj()], [across, matrix.conj()]])


def diameter_matrices(
    model: ModalModel, piece: SpinBlock, speed: float
) -> tuple[Complexes, Complexes, Complexes, Complexes]:
    """Return the matrices of a rotor's motion at a speed on one nodal diameter, (m, m).

    They are those of Coriolis forces, 2 Omega C, damping, D + D_s, stiffness, K(Omega),
    and circulatory forces of the supports, S, see `modes.Spin`, in amplitudes of m
    modes at rest, in which M = 1.

    piece, speed : the modes and their terms of rotation; Omega, rad/s
    """
    spin = model.terms
    stiffness = np.diag(piece.omega**2) + stiffening_at(piece, speed)
    gyro, damping = 2 * speed * piece.coriolis, modal_damping(model, piece)
    push, damping = np.zeros_like(gyro), damping.astype(np.complex128)
    others = (one.support for one in spin.stations)
    elsewhere = zip(piece.stations, others, strict=False)  # none on other diameters
    for row, support in ((piece.hub, spin.support), *elsewhere):
        moved, own = np.outer(row.conj(), row), support.at(speed)
        held = own.turning(speed)
        damping = damping + own.damping.real * moved
        gyro = gyro - 1j * own.damping.imag * moved
        stiffness = stiffness + held.real * moved
        push = push - 1j * held.imag * moved
    return gyro, damping, stiffness, push


def modal_damping(model: ModalModel, piece: SpinBlock) -> Floats | Complexes:
    """Return the modal damping of a rotor on one nodal diameter, (m, m), 1/s."""
    chosen = np.flatnonzero((model.diameter == piece.k) & (model.phase == 0))
    ratios, held = model.ratios[chosen], model.unheld
    if held is None or not piece.hub.any():
        return np.diag(2 * ratios * piece.omega)
    held = held[0::2, chosen] - 1j * held[1::2, chosen]
    rates = np.asarray(unheld_rates(ratios, piece.omega, held))
    return rates if piece.material is None else rates + piece.material


def quadratic_roots(
    damping: Complexes | Floats, stiffness: Complexes | Floats
) -> Complexes:
    """Return the roots s of motions e^{s t} with x'' + D x' + K x = 0, (..., 2 n), 1/s.

    They are eigenvalues of a companion matrix with velocities scaled by sqrt(K).

    damping, stiffness : D, 1/s, K, 1/s^2, (..., n, n)
    """
    return np.asarray(np.linalg.eigvals(_companion(damping, stiffness)))


def _companion(
    damping: Complexes | Floats, stiffness: Complexes | Floats
) -> Complexes | Floats:
    """Return the companion matrix of `quadratic_roots`, (..., 2 n, 2 n).

    Its vectors are displacements, then velocities in units of sqrt(K).
    """
    n = stiffness.shape[-1]
    scale = np.sqrt(np.linalg.norm(stiffness, axis=(-2, -1), keepdims=True))
    same = np.broadcast_to(np.eye(n), stiffness.shape)
    top = np.concatenate([0.0 * same, scale * same], axis=-1)
    low = np.concatenate([-stiffness / scale, -damping], axis=-1)
    return np.asarray(np.concatenate([top, low], axis=-2))


def turning_matrices(
    model: ModalModel, speed: float, blades: int
) -> tuple[Floats, Floats, Floats, Floats]:
    """Return the matrices of a whole rotor's motion at a speed, (n, n) each.

    They are those of Coriolis forces, 2 Omega C, damping, D + D_s, stiffness, K(Omega),
    and circulatory forces of the supports, S, see `modes.Spin`.

    Parameters
    ----------
    model : rotor with terms of rotation
    speed : Omega, rad/s
    blades : N
    """
    spin = model.terms
    damping = model.damping_matrix()
    gyro = 2 * speed * spin.coriolis
    stiffness = model.stiffness + stiffening_at(spin, speed)
    push = np.zeros_like(stiffness)
    if has_centre(model, blades):
        hub, own = np.s_[2 * blades : 2 * blades + 2], spin.support.at(speed)
        held = own.turning(speed)
        damping[hub, hub] += own.damping.real * np.eye(2)
        gyro[hub, hub] += planar(1j * own.damping.imag)
        stiffness[hub, hub] += held.real * np.eye(2)
        push[hub, hub] = planar(1j * held.imag)
    for one in spin.stations:
        own, rows = one.support.at(speed), one.rows
        held = own.turning(speed)
        damping += own.damping.real * rows.T @ rows
        gyro += rows.T @ planar(1j * own.damping.imag) @ rows
        stiffness += held.real * rows.T @ rows
        push += rows.T @ planar(1j * held.imag) @ rows
    if spin.material is not None:
        damping += spin.material
    return gyro, damping, stiffness, push


def _of_whole(model: ModalModel, blades: int, speed: float) -> list[WaveLine]:
    """Return the waves of a rotor of unequal sectors, or of at most two sectors.

    speed : Omega, rad/s
    """
    gyro, damping, stiffness, push = turning_matrices(model, speed, blades)
    stiffness, n = stiffness + push, len(model.mass)
    right = np.linalg.solve(model.mass, np.hstack([stiffness, damping + gyro]))
    top = np.hstack([np.zeros((n, n)), np.eye(n)])
    roots, shapes = np.linalg.eig(np.vstack([top, -right]))
    moved = np.abs((model.mass @ model.shapes).T @ shapes[:n]) ** 2
    radial = shapes[0 : 2 * blades : 2]
    return lines_of_shapes(model, blades, speed, roots, radial, moved)


def lines_of_shapes(
    model: ModalModel,
    blades: int,
    speed: float,
    roots: Complexes,
    radial: Complexes,
    moved: Floats,
) -> list[WaveLine]:
    """Return the waves of a rotor taken as a whole, named by what moves in them.

    Parameters
    ----------
    model, blades, speed : rotor; N; Omega, rad/s
    roots : (r,), s, 1/s; of a pair of conjugates that with Im s <= 0 is left out
    radial : (N, r), radial motion of the tips
    moved : (m, r), squared amplitudes of modes at rest
    """
    lines = []
    angle = 2 * np.pi * np.arange(blades) / blades
    for root, shape, share in zip(roots, radial.T, moved.T, strict=True):
        if root.imag <= 0.0:
            continue
        m = int(np.argmax(share))
        k = int(model.diameter[m])
        name = family_ranks(model, k)[int(model.rank[m])]
        waves = [abs(shape @ np.exp(sign * 1j * k * angle)) for sign in (-1, 1)]
        forward = np.conj(root)  # of e^{-i k theta + s t}, which turns with Omega
        roots_of_wave = [forward if k == 0 or waves[1] > waves[0] else root]
        if k > 0 and is_simple(k, blades):
            roots_of_wave = [forward, root]
        lines += [_line(k, name, complex(s), speed) for s in roots_of_wave]
    return lines


def largest_growth(model: ModalModel, blades: int, speed: float) -> float:
    """Return the growth rate, 1/s, of the fastest growing free motion at a speed.

    It is negative if all free motions decay.

    model, blades, speed : rotor; N; rad/s
    """
    spin = model.spin
    if spin is not None and spin.waves:
        return max(
            float(wave_roots(model, piece, speed).real.max()) for piece in spin.waves
        )
    if spin is None:
        return float((-model.ratios * model.omega).max())
    gyro, damping, stiffness, push = turning_matrices(model, speed, blades)
    both = np.hstack([damping + gyro, stiffness + push])
    rate, held = np.hsplit(np.linalg.solve(model.mass, both), 2)
    return float(quadratic_roots(rate, held).real.max())


def watched_speeds(model: ModalModel, fastest: float = 0.0) -> tuple[float, float]:
    """Return the speeds, rad/s, between which resonance and instability are searched.

    With a bearing's table these are the speeds of the table, since a case at any other
    is refused. Else they extend to the fastest speed of interest, but at least to
    `WATCHED` times the first natural frequency.

    model, fastest : rotor with terms of rotation; rad/s
    """
    support = model.terms.support
    if isinstance(support, Bearing) and len(support.speeds) > 1:
        return float(support.speeds[0]), float(support.speeds[-1])
    return 0.0, max(WATCHED * float(model.omega[model.omega > 0.0].min()), fastest)


def unbalance_speeds(model: ModalModel, fastest: float = 0.0) -> list[float]:
    """Return the speeds > 0, rad/s, at which an unbalance is in resonance, undamped.

    A wave of k = 1 is then at rest in the rotating frame, like the force of an
    unbalance: det K(Omega) = 0. Supports that differ by direction couple it to the wave
    at 2 Omega in that frame, backward in the static one, with the stiffness K(Omega) +
    4 Omega^2 (i C - M). Empty for unequal sectors and a clamped centre.

    fastest : rad/s, speed of interest, see `watched_speeds`
    """
    spin = model.spin
    for piece in spin.waves if spin else ():
        if spin and piece.hub.any():
            return _met(piece, spin, *watched_speeds(model, fastest))
    return []


def _met(piece: SpinBlock, spin: Spin, low: float, high: float) -> list[float]:
    """Return resonance speeds of an unbalance on supports that depend on the speed.

    The supports are evaluated at each of `SPEEDS` speeds, and the resonance speeds
    computed with them. Where such a speed equals the one at which the supports were
    evaluated, there is a resonance.

    piece, spin : modes and terms of rotation of nodal diameter 1; those of the rotor
    low, high : rad/s, ends of the search
    """
    constant = all(one.is_constant for one in spin.stations)
    if isinstance(spin.support, Support) and constant:
        speeds = _soft_at(*_of_unbalance(piece, spin, 0.0))
        return [float(speed) for speed in speeds if low <= speed <= high]

    def ahead(speed: float) -> Floats:
        found = _soft_at(*_of_unbalance(piece, spin, speed))
        return np.pad(found, (0, most - len(found)), constant_values=np.inf) - speed

    most, found = 2 * len(piece.hub), []
    grid = np.linspace(low, high, SPEEDS).tolist()
    sizes = np.array([ahead(speed) for speed in grid])
    crossed = (sizes[:-1] > 0.0) != (sizes[1:] > 0.0)
    for i, place in np.argwhere(crossed & np.isfinite(sizes[:-1] + sizes[1:])):
        of_place = partial(_at, ahead, int(place))
        found.append(zero_between(of_place, grid[i], grid[i + 1]))
    return sorted(found)


def _at(values: Callable[[float], Floats], place: int, speed: float) -> float:
    return float(values(speed)[place])


def _of_unbalance(
    piece: SpinBlock, spin: Spin, speed: float
) -> tuple[Complexes, Complexes, Complexes | None]:
    """Return the stiffness terms of the waves that an unbalance excites, k = 1.

    They are K_0, K_1, K_2 of K_0 + Omega^2 K_1 + Omega^4 K_2, which is singular at a
    resonance, see `unbalance_speeds`.

    piece, spin : modes and terms of rotation of nodal diameter 1; those of the rotor
    speed : Omega, rad/s, at which the supports are evaluated
    """
    hub, first, second = piece.hub, piece.stiffening, piece.quartic
    own = spin.support if isinstance(spin.support, Support) else spin.support.at(speed)
    rest = np.diag(piece.omega**2) + own.stiffness.real * np.outer(hub.conj(), hub)
    for row, one in zip(piece.stations, spin.stations, strict=True):
        rest += one.support.at(speed).stiffness.real * np.outer(row.conj(), row)
    if spin.is_round:
        return rest, first, second
    first = _with_conjugate(first, 0j)
    n = len(hub)
    first[n:, n:] += (4j * piece.coriolis - 4 * np.eye(n)).conj()
    if second is not None:
        second = _with_conjugate(second, 0j)
    _, across = _across(unlike_waves(spin, piece), speed)
    return _with_conjugate(rest, across), first, second


def _soft_at(stiffness: Any, first: Any, second: Any) -> Floats:
    """Return the speeds > 0, rad/s, at which K + Omega^2 K_1 + Omega^4 K_2 is singular.

    stiffness : K (n, n), positive definite
    first, second : K_1, K_2 (n, n); None: K_2 is 0
    """
    if second is None:
        inverse = eigh(-first, stiffness, eigvals_only=True)
    else:
        n = len(stiffness)
        right = np.linalg.solve(stiffness, np.hstack([first, second]))
        top = np.hstack([-right[:, :n], -right[:, n:]])
        # scaled so that both halves of a vector are of one size
        scale = np.sqrt(np.linalg.norm(right[:, n:]) or 1.0)
        top[:, n:] /= scale
        low = np.hstack([scale * np.eye(n), np.zeros((n, n))])
        values = np.linalg.eigvals(np.vstack([top, low]))
        real = np.abs(values.imag) <= REAL * np.abs(values).max()
        inverse = values[real].real
    floor = ROUND_OFF * np.abs(inverse).max(initial=0.0)
    return np.sort(1 / np.sqrt(inverse[inverse > floor]))


def stiff_up_to(model: ModalModel, blades: int) -> float:
    """Return the speed, rad/s, at which softening cancels the stiffness of the blades.

    There det K(Omega) = 0 with the shaft held; infinite if there is no such speed.
    Coriolis forces, which stabilise a shaft beyond its critical speed, are left out.
    """
    if model.spin is None:
        return float("inf")
    hub = 2 * blades + np.arange(2 * has_centre(model, blades))
    held = np.append(hub, model.spin.tilt).astype(np.intp)
    inner = np.setdiff1d(np.arange(len(model.mass)), held)
    grid, quartic = np.ix_(inner, inner), model.spin.quartic
    speeds = _soft_at(
        model.stiffness[grid],
        model.spin.stiffening[grid],
        None if quartic is None else quartic[grid],
    )
    return float(speeds[0]) if len(speeds) else float("inf")


def tip_growth(model: ModalModel, blades: int, speed: float) -> Floats:
    """Return how much each of N tips grows outward at a speed, (N,), m.

    It is the static response to the centrifugal load Omega^2 F_c.

    model, blades, speed : rotor with terms of rotation; N; Omega, rad/s
    """
    spin = model.spin
    if spin is None:
        return np.zeros(blades)
    stiffness = model.stiffness + stiffening_at(spin, speed)
    moved = np.linalg.solve(stiffness, speed**2 * spin.load)
    return np.asarray(moved[0 : 2 * blades : 2])
