"""Free motion of modes under central differences, and the certificate of no contact.

The recursion d' = keep d - pull q, q' = q + d' of central differences, with amplitude q
and increment d = q_n - q_{n-1}, has the roots z = r e^{+-i phi}, r^2 = keep and cos phi
= (1 + keep - pull) / (2 r). Without forces, n steps later,

q_n = r^n (A cos n phi + B sin n phi) = alpha z^n + beta conj(z)^n,
A = q,  B = (q (cos phi - r) + r d) / sin phi,

and |q_n| <= (|A|^2 + |B|^2)^{1/2} for all n >= 0, also for complex amplitudes, and for
those of the ring, which turn in the rotating frame. The sum of these bounds over all
modes, weighted with the radial amplitudes at a blade, bounds the change of every gap:
if it is below the clearance, no blade can touch again. This holds for the motion of the
scheme, with its rounded coefficients, not for that of the continuous modes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hpcwhirl.arrays import Complexes, Floats, Indices
from hpcwhirl.dynamics.kernels import passes
from hpcwhirl.dynamics.kernels.bodies import TINY

SIGNS = (-1.0, 1.0)  # signs in alpha and beta = (A -+ i B) / 2


def flushed(values: Floats) -> Floats:
    """Return numbers with those of magnitude below 1e-150 set to 0, as kernels do."""
    return np.where(np.abs(values) < TINY, 0.0, values)


@dataclass(frozen=True)
class Roots:
    """The roots z = r e^{+-i phi} of central differences, for the modes of one body.

    Attributes
    ----------
    own : (modes,), indices of the modes among the kernel's complex amplitudes, of which
        others are padding
    weight : (modes,), magnitude of the radial displacement, of a blade's tip or of the
        ring, for unit amplitude
    radius, sine : (modes,), r and sin phi
    log : (modes,), log z
    back : (modes,), cos phi - r
    pull : (modes,), coefficient of the amplitude in the next increment, see this module
    decays : whether all modes have stiffness and damping and oscillate; only then is
        the later motion bounded
    """

    own: Indices
    weight: Floats
    radius: Floats
    sine: Floats
    log: Complexes
    back: Floats
    pull: Floats
    decays: bool

    def waves(self, q: Complexes, d: Complexes) -> tuple[Complexes, Complexes]:
        """Return (A, B) of the free amplitudes q_n = r^n (A cos n phi + B sin n phi).

        A, B : (modes,) each
        q, d : (modes,), amplitudes at n = 0, and their increments in the last step
        """
        return q, (q * self.back + self.radius * d) / self.sine

    def increments(self, q: Complexes, d: Complexes) -> tuple[Complexes, Complexes]:
        """Return (A, B) of the free increments d_n = r^n (A cos n phi + B sin n phi).

        A, B : (modes,) each
        q, d : (modes,), amplitudes at n = 0, and their increments d_n = q_n - q_{n-1}
        """
        # d_1 = keep d - pull q = r (A cos phi + B sin phi)
        return d, -(self.back * d + self.pull / self.radius * q) / self.sine


def roots_of(items: Floats) -> Roots:
    """Return the roots z of central differences for the modes of a body.

    items : (ITEMS, n), coefficients of the modes, see `kernels.passes`
    """
    modes = np.flatnonzero(items[passes.KEEP] != 0.0)
    keep, pull = items[passes.KEEP][modes], items[passes.PULL][modes]
    radius = np.sqrt(np.maximum(keep, 0.0))
    lost = (1.0 - keep) / (1.0 + radius)  # 1 - r, without loss of digits
    with np.errstate(divide="ignore", invalid="ignore"):
        away = (pull - lost**2) / (2.0 * radius)  # 1 - cos phi
        sine = np.sqrt(np.maximum(away * (2.0 - away), 0.0))
        back = (1.0 - keep - pull) / (2.0 * radius)
        log = 0.5 * np.log1p(keep - 1.0) + 1j * np.arctan2(sine, 1.0 - away)
    decays = bool(((keep > 0.0) & (keep < 1.0) & (sine > 0.0)).all())
    weight = np.abs(items[passes.RADIAL][modes])
    return Roots(modes, weight, radius, sine, log, back, pull, decays)


@dataclass(frozen=True)
class ModesMotion:
    """A free motion of a body's modes in closed form: q = alpha z^n + beta conj(z)^n.

    z is the root of a mode, n the number of steps since the start of the motion.

    Attributes
    ----------
    most : (modes,), bounds of |q| at all later steps
    body : the modes
    alpha, beta : (modes,), coefficients of the amplitudes q
    gamma, delta : (modes,), those of the increments d = q_n - q_{n-1}
    """

    most: Floats
    body: FreeModes
    alpha: Complexes
    beta: Complexes
    gamma: Complexes
    delta: Complexes

    def places(self, z: Complexes) -> Complexes:
        """Return the modes' amplitudes q, (samples, modes), at given samples.

        z : (samples, modes), z^n after the n steps of each sample
        """
        return self.alpha * z + self.beta * z.conj()

    def swing(self, rows: Complexes) -> Complexes:
        """Return factors f, (modes, r), that give r displacements after n free steps.

        These are Re(f^T z^n), equal to Re(conj(rows) q) with q the modes' amplitudes.

        rows : (r, modes), the displacements for unit amplitudes
        """
        return (rows.conj() * self.alpha + rows * self.beta.conj()).T

    def increments(self, z: Complexes) -> Complexes:
        """Return the modes' increments d, (samples, modes), at given samples.

        z : (samples, modes), z^n after the n steps of each sample
        """
        return self.gamma * z + self.delta * z.conj()

    def energies(self, z: Complexes) -> Floats:
        """Return the energy of all modes together, (samples,), J, at given samples.

        It is defined as by the kernels' `modal_energy`.

        z : (samples, modes), z^n after the n steps of each sample
        """
        a, b, c, d = self.alpha, self.beta, self.gamma, self.delta
        kinetic, strain = 0.5 / self.body.step**2, 0.5 * self.body.omega**2
        steady = kinetic * (np.abs(c) ** 2 + np.abs(d) ** 2)
        steady += strain * (np.abs(a) ** 2 + np.abs(b) ** 2)
        steady -= strain * (a * c.conj() + b * d.conj()).real
        beating = 2 * kinetic * c * d.conj() + 2 * strain * a * b.conj()
        beating -= strain * (a * d.conj() + b.conj() * c)
        return np.asarray(np.abs(z) ** 2 @ steady + (z**2 @ beating).real)

    def leave(self, state: Floats, steps: int, step: int) -> tuple[Floats, Floats]:
        """Write the body's motion after `steps` free steps into the kernel's state.

        Return rates and squares, whose sum of products is the damping loss of the last
        step, J: the kernel enters it in the ledger when it goes on.

        Parameters
        ----------
        state : the body's part of the kernel's state, set here; amplitudes of the ring
            are in the rotating frame
        steps, step : number of steps since the start of this motion, and of the march

        Returns
        -------
        rates : (modes,), J/m^2
        squares : (modes,), m^2
        """
        body = self.body
        now, before = np.exp(np.outer([steps, steps - 1], body.log))
        d, old = self.increments(now), self.increments(before)
        turn, turned = np.exp(1j * np.outer([steps, steps - 1], body.spin))
        for place, values in (
            (0, self.places(now) * turn),
            (1 + (step & 1), d * turn),
            (2 - (step & 1), old * turned),
        ):
            whole = np.zeros(body.size, dtype=complex)
            whole.real[body.own] = flushed(values.real)
            whole.imag[body.own] = flushed(values.imag)
            parts = state.reshape(body.shape)
            parts[place, :, 0] = whole.real.reshape(body.shape[1::2])
            parts[place, :, 1] = whole.imag.reshape(body.shape[1::2])
        return body.rate, np.abs(d + old) ** 2


class FreeModes:
    """Modes of a body under central differences, with free motion in closed form.

    Parameters
    ----------
    items : (ITEMS, modes), coefficients of a step of the modes, see `kernels.passes`
    width : number of modes in a row of the state, which is (3, rows, 2, width), re and
        im
    step : dt, s

    Attributes
    ----------
    own : (m,), indices of those columns of `items` that hold a mode
    log, radius : (m,), log z and |z| of the roots z of these modes
    decays : whether all their free motion decays to zero
    """

    def __init__(self, items: Floats, width: int, step: float) -> None:
        self.step = step
        rows = items.shape[1] // max(width, 1)  # a rigid casing has no modes
        self.shape = passes.ROTOR_STATE, rows, 2, width
        self.roots = roots_of(items)
        self.own, self.decays = self.roots.own, self.roots.decays
        self.log, self.radius = self.roots.log, self.roots.radius
        self.size = items.shape[1]
        self.omega, self.rate = items[[passes.OMEGA, passes.RATE]][:, self.own]
        self.spin = items[passes.SPIN][self.own] * step

    def motion(self, state: Floats, step: int) -> ModesMotion:
        """Return the free motion of the body that starts from a given state.

        state : the body's part of the kernel's state, with all contact forces applied
        step : number of the last step
        """
        parts = state.reshape(self.shape)
        both = parts[:, :, 0] + 1j * parts[:, :, 1]
        values = both.reshape(passes.ROTOR_STATE, self.size)[:, self.own]
        q, d = values[0], values[1 + (step & 1)]
        a, b = self.roots.waves(q, d)
        pairs = (a, b), self.roots.increments(q, d)
        halves = [0.5 * (x + sign * 1j * y) for x, y in pairs for sign in SIGNS]
        most = np.hypot(np.abs(a), np.abs(b))
        return ModesMotion(most, self, *halves)
