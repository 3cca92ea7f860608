"""Waves of a rotating rotor: the quadratic eigenproblem of each nodal diameter.

On nodal diameter k, u = Re(Y e^{i k theta + s t}) in the rotating frame,

[s^2 M + s (D + D_s + 2 Omega C) + K + Omega^2 K_1 + S] Y = 0,

with M, K, K_1 Hermitian and C skew-Hermitian, so that each s is one wave: it turns with
the rotation, forward, where Im s < 0, at -Im s in the rotating frame and -Im s + k
Omega in the static one. Sorted, the 2 m lines of m coordinates keep their order at all
speeds: each is named after the mode at rest that it comes from. With unequal sectors a
wave has no single diameter: it is named after the mode at rest that it contains most.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh
from scipy.optimize import brentq

from hpcwhirl.reduction.cyclic import Complexes, is_simple
from hpcwhirl.reduction.families import family_ranks
from hpcwhirl.reduction.modes import Block, ModalModel, Spin, has_centre

Floats = NDArray[np.float64]
WATCHED = 4.0  # highest speed, over the first frequency: 1,000 rad/s by default
SPEEDS = 101  # speeds at which growth is computed
ROUND_OFF = 1e-11  # growth over the highest frequency that counts as none
HUB = 2  # index of the centre in a block of k = 1, after the tip's two coordinates


@dataclass(frozen=True)
class WaveLine:
    """A travelling wave of the rotor at a speed.

    Attributes
    ----------
    nodal_diameter, family : labels of the mode at rest that it comes from
    rotating, static : damped frequency in either frame, rad/s; > 0: turns with Omega
    growth : growth rate, 1/s
    """

    nodal_diameter: int
    family: str
    rotating: float
    static: float
    growth: float


def wave_lines(model: ModalModel, blades: int, speed: float) -> list[WaveLine]:
    """Return the waves of a rotor at a speed, rad/s, by diameter and frequency.

    A standing wave (of k = N / 2, or a single mode of a mistuned rotor without a spin)
    is returned as two waves of opposite sense; a mode of k = 0 as one.
    """
    if model.spin is None:
        lines = _at_rest(model, speed)
    elif model.spin.waves and blades > 2:
        lines = _by_diameter(model, model.spin, speed)
    else:
        lines = _of_whole(model, blades, speed)
    return sorted(lines, key=lambda line: (line.nodal_diameter, line.rotating))


def _line(k: int, family: str, root: complex, speed: float) -> WaveLine:
    """Return the wave e^{i k theta + s t} of a root s, 1/s."""
    turning = -float(root.imag)
    return WaveLine(k, family, turning, turning + k * speed, float(root.real))


def _at_rest(model: ModalModel, speed: float) -> list[WaveLine]:
    """Return the waves of a rotor whose modes do not depend on its speed."""
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
    """Return the waves of a rotor of equal sectors, by nodal diameter."""
    lines = []
    for piece in spin.waves:
        names = family_ranks(model, piece.k)
        roots = wave_roots(model, piece, speed)
        if piece.k == 0:
            roots = roots[: len(roots) // 2]  # s and its conjugate: one motion
        for place, root in enumerate(roots):
            rank = rank_of(place, len(piece.omega))
            lines.append(_line(piece.k, names[rank], complex(root), speed))
    return lines


def rank_of(place: int, modes: int) -> int:
    """Return the rank of the mode at rest that a root of `wave_roots` comes from.

    place : index of the root, of 2 `modes`
    """
    return modes - 1 - place if place < modes else place - modes


def wave_roots(model: ModalModel, piece: Block, speed: float) -> Complexes:
    """Return the roots s (2 m,), 1/s, of a nodal diameter, from forward to backward."""
    spin = model.spin
    if spin is None or piece.coriolis is None or piece.stiffening is None:
        raise TypeError(piece.k)
    modes = (model.diameter == piece.k) & (model.phase == 0)
    lift = piece.mass @ piece.modes
    rate = 2 * model.ratios[modes] * piece.omega
    damping = (lift * rate) @ lift.conj().T + 2 * speed * piece.coriolis
    stiffness = piece.stiffness + speed**2 * piece.stiffening
    if piece.k == 1 and len(piece.mass) > HUB and has_hub(model):
        damping[HUB, HUB] += spin.damping
        stiffness[HUB, HUB] -= 1j * (speed * spin.damping - spin.cross)
    roots = _roots(piece.mass, damping, stiffness)
    return roots[np.argsort(roots.imag, kind="stable")]


def diameter_matrices(
    model: ModalModel, piece: Block, speed: float
) -> tuple[Complexes, Complexes, Complexes, Complexes]:
    """Return (2 Omega C, D + D_s, K + Omega^2 K_1, S) of a nodal diameter, (m, m) each.

    In coordinates of its modes at rest, where M = 1.
    """
    spin = model.spin
    if spin is None or piece.coriolis is None or piece.stiffening is None:
        raise TypeError(piece.k)
    basis, back = piece.modes, piece.modes.conj().T
    ratios = model.ratios[(model.diameter == piece.k) & (model.phase == 0)]
    gyro = back @ (2 * speed * piece.coriolis) @ basis
    stiffness = back @ (speed**2 * piece.stiffening) @ basis
    stiffness = np.diag(piece.omega**2) + (stiffness + stiffness.conj().T) / 2
    hub = hub_of(model, piece)
    moved = np.outer(hub.conj(), hub)
    damping = np.diag(2 * ratios * piece.omega) + spin.damping * moved
    push = -1j * (speed * spin.damping - spin.cross) * moved
    return (gyro - gyro.conj().T) / 2, damping, stiffness, push


def hub_of(model: ModalModel, piece: Block) -> Complexes:
    """Return z_o of a nodal diameter's modes at rest, (m,), x_o + i y_o = conj(z_o)."""
    if piece.k == 1 and len(piece.mass) > HUB and has_hub(model):
        return np.asarray(piece.modes[HUB])
    return np.zeros(len(piece.mass), dtype=np.complex128)


def has_hub(model: ModalModel) -> bool:
    """Return whether a rotor of equal sectors with a spin has a free centre."""
    spin = model.spin
    waves = spin.waves if spin else ()
    return bool(waves) and has_centre(model, _blades(waves))


def _blades(waves: tuple[Block, ...]) -> int:
    """Return the number of blades N from the blocks of k = 0 .. N // 2."""
    return 2 * waves[-1].k + (0 if waves[-1].simple else 1)


def _roots(mass: Complexes, damping: Complexes, stiffness: Complexes) -> Complexes:
    """Return the roots s (2 n,) of s^2 M + s D + K, with scaled velocities."""
    n = len(mass)
    scale = np.sqrt(np.linalg.norm(stiffness) / np.linalg.norm(mass))
    right = np.linalg.solve(mass, np.hstack([stiffness / scale, damping]))
    top = np.hstack([np.zeros((n, n)), scale * np.eye(n)])
    return np.asarray(np.linalg.eigvals(np.vstack([top, -right])))


def turning_matrices(
    model: ModalModel, speed: float, blades: int
) -> tuple[Floats, Floats, Floats, Floats]:
    """Return (2 Omega C, D + D_s, K + Omega^2 K_1, S) of a rotor, (n, n) each.

    Parameters
    ----------
    model : rotor with a spin
    speed : Omega, rad/s
    blades : N
    """
    spin = model.spin
    if spin is None:
        raise TypeError(model)
    damping = model.damping_matrix()
    stiffness = model.stiffness + speed**2 * spin.stiffening
    push = np.zeros_like(stiffness)
    if has_centre(model, blades):
        x, y = 2 * blades, 2 * blades + 1
        damping[[x, y], [x, y]] += spin.damping
        push[y, x] = speed * spin.damping - spin.cross
        push[x, y] = -push[y, x]
    return 2 * speed * spin.coriolis, damping, stiffness, push


def _of_whole(model: ModalModel, blades: int, speed: float) -> list[WaveLine]:
    """Return the waves of a rotor of unequal sectors, or of one or two sectors."""
    gyro, damping, stiffness, push = turning_matrices(model, speed, blades)
    stiffness, n = stiffness + push, len(model.mass)
    right = np.linalg.solve(model.mass, np.hstack([stiffness, damping + gyro]))
    top = np.hstack([np.zeros((n, n)), np.eye(n)])
    roots, shapes = np.linalg.eig(np.vstack([top, -right]))
    moved = np.abs((model.mass @ model.shapes).T @ shapes[:n]) ** 2
    lines = []
    angle = 2 * np.pi * np.arange(blades) / blades
    for root, shape, share in zip(roots, shapes.T, moved.T, strict=True):
        if root.imag <= 0.0:
            continue
        m = int(np.argmax(share))
        k = int(model.diameter[m])
        name = family_ranks(model, k)[int(model.rank[m])]
        radial = shape[0 : 2 * blades : 2]
        waves = [abs(radial @ np.exp(sign * 1j * k * angle)) for sign in (-1, 1)]
        forward = np.conj(root)  # of e^{-i k theta + s t}, which turns with Omega
        roots_of_wave = [forward if k == 0 or waves[1] > waves[0] else root]
        if k > 0 and is_simple(k, blades):
            roots_of_wave = [forward, root]
        lines += [_line(k, name, complex(s), speed) for s in roots_of_wave]
    return lines


def largest_growth(model: ModalModel, blades: int, speed: float) -> float:
    """Return the largest growth rate of any free motion at a speed, 1/s."""
    spin = model.spin
    if spin is not None and spin.waves and blades > 2:
        return max(
            float(wave_roots(model, piece, speed).real.max()) for piece in spin.waves
        )
    return max(line.growth for line in wave_lines(model, blades, speed))


def unbalance_speeds(model: ModalModel) -> list[float]:
    """Return the speeds > 0, rad/s, at which an unbalance is in resonance, undamped.

    A wave of k = 1 then stands in the rotating frame, as the force of an unbalance
    does: det(K + Omega^2 K_1) = 0. Empty for unequal sectors and a clamped centre.
    """
    if not has_hub(model) or model.spin is None:
        return []
    piece = model.spin.waves[1]
    if piece.stiffening is None:
        return []
    inverse = eigh(-piece.stiffening, piece.stiffness, eigvals_only=True)
    near = inverse[inverse * top_speed(model) ** 2 > 1.0]
    return sorted(float(speed) for speed in 1 / np.sqrt(near))


def unbalance_response(
    model: ModalModel, blades: int, force: complex, speed: float
) -> Floats:
    """Return the steady displacements under an unbalance, (n,), m, rotating frame.

    (K + Omega^2 K_1 + S) x = F, constant in this frame: in the static one the rotor
    circles with the rotation. Of a rigid rotor of mass m on isotropic supports,
    z = m_u e Omega^2 / (k - m Omega^2 + i c_s Omega).

    Parameters
    ----------
    model : rotor with a spin and a free centre
    blades : N
    force : F_x + i F_y at the centre, N
    speed : Omega, rad/s

    Raises
    ------
    numpy.linalg.LinAlgError
        at a critical speed without damping
    """
    _, _, stiffness, push = turning_matrices(model, speed, blades)
    load = np.zeros(len(stiffness))
    load[2 * blades : 2 * blades + 2] = force.real, force.imag
    return np.asarray(np.linalg.solve(stiffness + push, load))


def stiff_up_to(model: ModalModel, blades: int) -> float:
    """Return the speed, rad/s, at which softening takes the blades' last stiffness.

    det(K + Omega^2 K_1) = 0 with the centre held; infinite if there is no such speed.
    Coriolis forces, which hold a shaft beyond its critical speed, are left out.
    """
    if model.spin is None:
        return float("inf")
    hub = 2 * blades + np.arange(2 * has_centre(model, blades))
    inner = np.setdiff1d(np.arange(len(model.mass)), hub)
    last, grid = (len(inner) - 1,) * 2, np.ix_(inner, inner)
    inverse = eigh(
        -model.spin.stiffening[grid], model.stiffness[grid], eigvals_only=True,
        subset_by_index=last,
    )[0]  # fmt: skip
    return float(1 / np.sqrt(inverse)) if inverse > 0.0 else float("inf")


def top_speed(model: ModalModel) -> float:
    """Return the highest speed, rad/s, of searches for instability and resonance.

    It is `WATCHED` times the rotor's first frequency: beyond it, stiffening by small
    displacements is not valid.
    """
    return WATCHED * float(model.omega[model.omega > 0.0].min())


def unstable_from(model: ModalModel, blades: int) -> float | None:
    """Return the lowest speed, rad/s, at which a free motion grows; None if not found.

    Searched up to `top_speed` at `SPEEDS` speeds; growth by round-off does not count.
    """

    def growth(speed: float) -> float:
        return largest_growth(model, blades, float(speed)) - floor

    floor = ROUND_OFF * float(model.omega.max())
    speeds = np.linspace(0.0, top_speed(model), SPEEDS)
    low = 0.0
    for speed in speeds.tolist():
        if growth(speed) > 0.0:
            return speed if speed == 0.0 else float(brentq(growth, low, speed))
        low = speed
    return None


def tip_growth(model: ModalModel, blades: int, speed: float) -> Floats:
    """Return the outward displacement of each tip at a speed, (N,), m.

    It is the static response to Omega^2 F_c; `gap` is the clearance that it leaves.
    """
    spin = model.spin
    if spin is None:
        return np.zeros(blades)
    stiffness = model.stiffness + speed**2 * spin.stiffening
    moved = np.linalg.solve(stiffness, speed**2 * spin.load)
    return np.asarray(moved[0 : 2 * blades : 2])
