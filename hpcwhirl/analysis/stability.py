"""Linear stability with all contacts held closed, one nodal diameter at a time.

All N tips stay on the casing, w(theta_j) = u_j, and slide with friction mu. In the
rotating frame nothing depends on time: harmonic h of the ring, W_h e^{i h theta} with
theta = phi + Omega t, is W_h e^{i h Omega t} there, and the tips see all h = k (mod N)
as nodal diameter k. With q of the rotor and P_h of the ring, mass-orthonormal,

    q'' + 2 xi w q' + w^2 q = -n N (r + mu t)^H lambda_k
    (d/dt - i h Omega)^2 P + 2 xi w (d/dt - i h Omega) P + w^2 P = n N (W + mu U)^H lambda_k
    sum_h W_h P_h - r q = 0,

n = 2, or 1 for a simple harmonic; lambda_k is the cyclic coordinate of the multipliers,
mu has the sign of Omega. With rotation the rotor's C and K are those of
`reduction.waves`, full matrices. The motions that satisfy the constraint follow from a
quadratic eigenvalue problem.
"""  # noqa: E501

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag, null_space

from hpcwhirl.arrays import Complexes
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.bodies import tip_rows
from hpcwhirl.reduction.model import Model
from hpcwhirl.reduction.modes import ModalModel, Spin
from hpcwhirl.reduction.waves import diameter_matrices, quadratic_roots
from hpcwhirl.structure import FourierOperator

SLOW = 2 * np.pi * 150.0  # rad/s: 1F and suspension of the paper lie below


@dataclass(frozen=True)
class Coupled:
    """Equations of rotor and ring on one nodal diameter, x = (q, P), rotating frame.

    Attributes
    ----------
    damping, stiffness : (m, m), C and K in x'' + C x' + K x = push lambda
    gap : (m,), row vector that gives the gap w - u from x
    push : (m,), modal forces of a unit multiplier lambda_k
    """

    damping: Complexes
    stiffness: Complexes
    gap: Complexes
    push: Complexes


def coupled(model: Model, k: int, speed: float, friction: float) -> Coupled:
    """Return the equations of both bodies on nodal diameter k of the rotor.

    Parameters
    ----------
    model : a cyclic rotor in a ring of harmonics
    k : nodal diameter, 0 .. N // 2
    speed : Omega, rad/s
    friction : coefficient mu; friction drags against Omega
    """
    if not model.rotor.cyclic or not isinstance(model.ring, FourierOperator):
        msg = "closed contacts need a rotor of equal sectors and a ring of harmonics"
        raise InputError(msg)
    spin = model.rotor.spin
    if spin is not None and not spin.waves:
        msg = "closed contacts with rotation need a rotor of three equal blades or more"
        raise InputError(msg)
    mu, blades = friction * float(np.sign(speed)), model.blades
    orders = range(-model.ring.harmonics, model.ring.harmonics + 1)
    harmonics = [h for h in orders if (h - k) % blades == 0]
    parts = [_turning_part(model, spin, k, speed, mu) if spin is not None
             else _rotor_part(model, k, mu)]  # fmt: skip
    parts += [_ring_part(model, model.ring, h, speed, mu) for h in harmonics]
    damping, stiffness, gap, push = zip(*parts, strict=True)
    return Coupled(
        block_diag(*damping),
        block_diag(*stiffness),
        np.concatenate(gap),
        np.concatenate(push),
    )


def _rotor_part(model: Model, k: int, mu: float) -> tuple[Complexes, ...]:
    """Return the rotor's part of `Coupled` at nodal diameter k, with friction mu.

    Returns
    -------
    C, K : (m, m), of its m modes
    gap, push : (m,), their entries in `Coupled.gap` and `Coupled.push`
    """
    body, blades = model.rotor, model.blades
    modes = (body.diameter == k) & (body.phase == 0)
    wave = np.exp(-2j * np.pi * k * np.arange(blades) / blades) / blades
    radial, tangential = (wave @ rows[:, modes] for rows in tip_rows(body, blades))
    count = (1 if 2 * k % blades == 0 else 2) * blades
    omega, ratios = body.omega[modes], body.ratios[modes]
    push = -count * (radial + mu * tangential).conj()
    return np.diag(2 * ratios * omega + 0j), np.diag(omega**2 + 0j), -radial, push


def _turning_part(
    model: Model, spin: Spin, k: int, speed: float, mu: float
) -> tuple[Complexes, ...]:
    """Return the rotor's part of `Coupled` as `_rotor_part` does, with rotation.

    spin, speed : terms of rotation; Omega, rad/s
    """
    piece, blades = spin.waves[k], model.blades
    gyro, rate, stiffness, support = diameter_matrices(model.rotor, piece, speed)
    scale = np.sqrt(piece.multiplicity / blades)
    radial, tangential = scale * piece.tips
    push = -blades * (radial + mu * tangential).conj()
    return gyro + rate, stiffness + support, -radial / piece.multiplicity, push


def _ring_part(
    model: Model, ring: FourierOperator, h: int, speed: float, mu: float
) -> tuple[Complexes, ...]:
    """Return the ring's part of `Coupled` at harmonic h, -H .. H; see `_rotor_part`.

    ring, speed, mu : contact operator; Omega, rad/s; friction coefficient
    """
    body = model.casing
    if body is None:
        raise InputError("closed contacts need an elastic casing")
    modes = (body.diameter == abs(h)) & (body.phase == 0)
    outward, along = _amplitudes(body, modes, ring, h)
    share = 0.5 if h else 1.0
    count = (2 if h else 1) * model.blades
    push = count * share * (outward + mu * along).conj()
    omega, ratios = body.omega[modes], body.ratios[modes]
    turn = -1j * h * speed
    damping = 2 * ratios * omega
    return (
        np.diag(damping + 2 * turn),
        np.diag(omega**2 + damping * turn + turn**2),
        share * outward,
        push,
    )


def _amplitudes(
    body: ModalModel, modes: NDArray[np.bool_], ring: FourierOperator, h: int
) -> tuple[Complexes, Complexes]:
    """Return the ring's amplitudes W and U of e^{i h theta} in m chosen modes.

    Both are (m,), 1/sqrt(kg). w = W cos h theta belongs to u = U sin |h| theta; for h =
    0, U is a rotation.

    body, modes : the casing; whether each of its modes is chosen
    """
    at = abs(h)
    cosine = max(2 * at - 1, 0)
    sine = 2 * at
    outward = body.shapes[ring.radial[cosine], modes] + 0j
    along = body.shapes[ring.tangential[sine], modes] * (-1j * np.sign(h) if h else 1.0)
    return outward, along


def closed_roots(pair: Coupled) -> Complexes:
    """Return the 2 m - 2 roots s, 1/s, of motions e^{s t} with contacts held closed.

    pair : equations of rotor and ring
    """
    right = null_space(pair.gap[None, :])
    left = null_space(pair.push[None, :].conj())
    mass, damping, stiffness = (
        left.conj().T @ matrix @ right
        for matrix in (np.eye(len(pair.gap)), pair.damping, pair.stiffness)
    )
    return quadratic_roots(
        np.linalg.solve(mass, damping), np.linalg.solve(mass, stiffness)
    )


def sprung_roots(pair: Coupled, stiffness: float) -> Complexes:
    """Return the roots s with a spring at each blade instead of contact, (2 m,), 1/s.

    lambda = -stiffness (w - u): a contact that is closed only part of the time lies
    between no contact (stiffness 0) and a closed one (infinite stiffness).

    Parameters
    ----------
    pair : equations from `coupled`
    stiffness : N/m, of the spring at each blade
    """
    extra = stiffness * np.outer(pair.push, pair.gap)
    return quadratic_roots(pair.damping, pair.stiffness + extra)


def fastest(roots: Complexes, below: float = np.inf) -> complex:
    """Return the root s of largest growth Re s with |Im s| < `below`, rad/s.

    If no root lies below, Re s is -infinity.
    """
    slow = roots[np.abs(roots.imag) < below]
    return complex(slow[np.argmax(slow.real)]) if len(slow) else complex(-np.inf, 0.0)


def growth_of_diameter(
    model: Model, k: int, speed: float, friction: float
) -> dict[str, float]:
    """Return growth rates of a nodal diameter with contacts held closed or sprung.

    Returns
    -------
    record: `nodal_diameter`; `closed`, 1/s, the largest growth of all roots and
    `closed_line`, rad/s, its frequency in the rotating frame; `slow` and `slow_line`,
    the same for roots below `SLOW`; `sprung`, 1/s, the largest growth below `SLOW` with
    springs of 1e3 .. 1e9 N/m at each blade, with `sprung_line`, and `spring`, N/m.
    Lines are in the rotating frame, of e^{i (k phi + line t)}; in the static frame such
    a motion has the frequency k Omega - line, > 0 forward
    """
    pair = coupled(model, k, speed, friction)
    roots = closed_roots(pair)
    root, slow = fastest(roots), fastest(roots, SLOW)
    springs = np.geomspace(1e3, 1e9, 61)
    by_spring = [fastest(sprung_roots(pair, s), SLOW) for s in springs]
    best = int(np.argmax([r.real for r in by_spring]))
    return {
        "nodal_diameter": float(k),
        "closed": root.real,
        "closed_line": root.imag,
        "slow": slow.real,
        "slow_line": slow.imag,
        "sprung": by_spring[best].real,
        "sprung_line": by_spring[best].imag,
        "spring": float(springs[best]),
    }
