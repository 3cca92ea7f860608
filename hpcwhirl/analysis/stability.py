"""Linear stability with all contacts held closed, one nodal diameter at a time.

All N tips stay on the casing, w(theta_j) = u_j, and slide with friction mu. In the
rotating frame nothing depends on time: harmonic h of the ring, W_h e^{i h theta} with
theta = phi + Omega t, is W_h e^{i h Omega t} there, and the tips see all h = k (mod N)
as nodal diameter k. With q of the rotor and P_h of the ring, mass-orthonormal,

    q'' + 2 xi w q' + w^2 q = -n N (r + mu t)^H lambda_k
    (d/dt - i h Omega)^2 P + 2 xi w (d/dt - i h Omega) P + w^2 P = n N (W + mu U)^H lambda_k
    sum_h W_h P_h - r q = 0,

r, t: radial, tangential tip displacements of the rotor's modes; W, U: radial,
tangential amplitudes of the ring's modes; n = 2, or 1 for a simple harmonic; lambda_k
is the cyclic coordinate of the multipliers, mu has the sign of Omega. With rotation the
rotor's C and K are those of `reduction.waves`, full matrices. The motions that satisfy
the constraint follow from a quadratic eigenvalue problem.
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

SLOW = 2 * np.pi * 150.0  # rad/s, above the paper's 1F and suspension frequencies


@dataclass(frozen=True)
class Coupled:
    """Linear equations of rotor and ring in contact, on one nodal diameter k.

    They are x'' + C x' + K x = push lambda_k in the rotating frame, with m amplitudes
    x = (q, P) of the modes of both bodies.

    Attributes
    ----------
    damping, stiffness : (m, m), C and K
    gap : (m,), row vector; gap @ x is the gap w - u, m
    push : (m,), modal forces of a unit multiplier lambda_k, with friction
    """

    damping: Complexes
    stiffness: Complexes
    gap: Complexes
    push: Complexes


def coupled(model: Model, k: int, speed: float, friction: float) -> Coupled:
    """Return the linear equations of rotor and ring on nodal diameter k of the rotor.

    Parameters
    ----------
    model : model with a rotor of equal sectors in a ring of harmonics
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
    """Return the rotor's part of `Coupled` at nodal diameter k, without rotation.

    mu : friction coefficient with the sign of the speed

    Returns
    -------
    C, K : (m, m), of its m modes
    gap, push : (m,), entries of these modes in `Coupled.gap` and `Coupled.push`
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
    """Return the rotor's part of `Coupled` at nodal diameter k, with rotation.

    Returns C, K, gap, push like `_rotor_part`

    spin, speed, mu : rotor's terms of rotation; Omega, rad/s; friction coefficient with
        the sign of the speed
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
    """Return the ring's part of `Coupled` at harmonic h, -H .. H, rotating frame.

    Returns C, K, gap, push like `_rotor_part`, of the casing's modes of harmonic h

    ring, speed, mu : contact operator of the casing; Omega, rad/s; friction coefficient
        with the sign of the speed
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
    """Return the ring's radial and tangential amplitudes W, U of e^{i h theta}.

    Both are (m,), 1/sqrt(kg), of m modes of the casing. w = W cos h theta belongs to
    u = U sin |h| theta; for h = 0, U is a rotation.

    body, modes : the casing; for each of its modes, whether it is one of the m
    ring, h : contact operator of the casing; harmonic, -H .. H
    """
    at = abs(h)
    cosine = max(2 * at - 1, 0)
    sine = 2 * at
    outward = body.shapes[ring.radial[cosine], modes] + 0j
    along = body.shapes[ring.tangential[sine], modes] * (-1j * np.sign(h) if h else 1.0)
    return outward, along


def closed_roots(pair: Coupled) -> Complexes:
    """Return the roots s, 1/s, of motions e^{s t} with all tips held on the ring.

    They are 2 m - 2 for the m modes of rotor and ring.

    pair : equations from `coupled`
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
    """Return the roots s of motions e^{s t} with a spring at each tip, (2 m,), 1/s.

    The spring, lambda = -stiffness (w - u), replaces contact: a contact that is closed
    only part of the time lies between no contact (stiffness 0) and one that is always
    closed (infinite stiffness).

    Parameters
    ----------
    pair : equations from `coupled`
    stiffness : N/m, of the spring at each blade
    """
    extra = stiffness * np.outer(pair.push, pair.gap)
    return quadratic_roots(pair.damping, pair.stiffness + extra)


def fastest(roots: Complexes, below: float = np.inf) -> complex:
    """Return the fastest growing root s, the one of largest Re s, 1/s.

    Only roots with |Im s| < `below`, rad/s, count; if there is none, Re s is -infinity.
    """
    slow = roots[np.abs(roots.imag) < below]
    return complex(slow[np.argmax(slow.real)]) if len(slow) else complex(-np.inf, 0.0)


def growth_of_diameter(
    model: Model, k: int, speed: float, friction: float
) -> dict[str, float]:
    """Return how fast motions of nodal diameter k grow with the tips held on the ring.

    Parameters are those of `coupled`.

    Returns
    -------
    dict: `nodal_diameter`; `closed`, 1/s, the largest growth of all roots and
    `closed_line`, rad/s, its frequency in the rotating frame; `slow` and `slow_line`,
    the same for roots below `SLOW`; `sprung`, 1/s, the largest growth below `SLOW` with
    springs of 1e3 .. 1e9 N/m at each blade, with `sprung_line`, and `spring`, N/m.
    Lines are in the rotating frame, of e^{i (k phi + line t)}; in the static frame such
    a motion has the frequency k Omega - line, > 0 anticlockwise
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
