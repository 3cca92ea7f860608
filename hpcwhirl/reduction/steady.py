"""The steady motion of a rotor without contact, as harmonics of the speed.

In the rotating frame a load is a sum of Re(F_h e^{i h Omega t}): that of an unbalance
has h = 0, a force that is constant in the static frame h = 1. So is the motion, of
X_h. On supports that are the same in all directions each harmonic answers its own load:

A_h X_h = F_h, A_h = K(Omega) + S + i h Omega (D + 2 Omega C) - (h Omega)^2 M.

Supports that differ by direction couple harmonics by their forces. With the motion z =
x + i y of the rotor at one of them, of the centre for example, as the sum of z_h e^{i h
Omega t} over all h, negative ones too,

f_k = -beta_h conj(z_h), k = -(h + 2), beta_h = k_d - i (1 + h) Omega c_d.

With equal sectors this couples h = 0 to h = 2, h = 1 to itself, and nothing else.
Unequal sectors couple f_h to conj(f_{-h}), too: harmonics 0, 2, 4, ... or 1, 3, 5, ...
which decay as 1 / (h Omega)^2 and faster, and are computed up to round-off.

A time step of central differences replaces h Omega by sin(h Omega dt) / dt, its square
by (2 sin(h Omega dt / 2) / dt)^2, so that the motion is steady in time steps.
"""

from __future__ import annotations

from functools import cached_property, lru_cache
from typing import Any, NamedTuple

import numpy as np

from hpcwhirl.arrays import Complexes, Floats, Integers
from hpcwhirl.reduction.modes import ModalModel, unlike
from hpcwhirl.reduction.waves import turning_matrices

LEAST = 1e-15  # size of a harmonic, relative to the largest, that is left out
MOST = 64  # highest harmonic

Loads = dict[int, Complexes]  # {h: F_h, (n,), N}, h >= 0


class Steady(NamedTuple):
    """A motion x = sum of Re(X_h e^{i h Omega t}) of a rotor, rotating frame.

    Attributes
    ----------
    orders : (s,), h, ascending; the first is 0
    shapes : (s, n), X_h, m; that of h = 0 is real
    """

    orders: Integers
    shapes: Complexes

    @property
    def still(self) -> Floats:
        """The part X_0 that is constant in the rotating frame, (n,), m."""
        return np.ascontiguousarray(self.shapes[0].real)

    def at(self, angle: float) -> Floats:
        """Return the displacement, (n,), m, at an angle Omega t, rad."""
        turns = np.exp(1j * angle * self.orders)
        return np.asarray((turns[1:] @ self.shapes[1:]).real + self.shapes[0].real)

    def only(self, parity: int) -> Steady:
        """Return the even (0) or the odd (1) harmonics alone; the first stays h = 0."""
        shapes = self.shapes * (self.orders % 2 == parity)[:, None]
        return Steady(self.orders, shapes)

    def of(self, order: int) -> Complexes:
        """Return the shape X_h of a harmonic, (n,), m; 0 if there is none."""
        return np.asarray(self.shapes[self.orders == order].sum(axis=0))

    def farthest(self) -> Floats:
        """Return a bound of each coordinate's displacement at any time, (n,), m."""
        return np.asarray(self.still + np.abs(self.shapes[1:]).sum(axis=0))

    def sizes(self) -> Floats:
        """Return a bound of each coordinate's magnitude at any time, (n,), m."""
        return np.asarray(np.abs(self.shapes).sum(axis=0))


class _Harmonics:
    """The answers of a rotor to loads at harmonics of the speed, each computed once.

    model, blades : rotor with terms of rotation; N
    speed, step : Omega, rad/s; dt, s, 0: motion in continuous time
    """

    def __init__(
        self, model: ModalModel, blades: int, speed: float, step: float
    ) -> None:
        gyro, damping, stiffness, push = turning_matrices(model, speed, blades)
        self.held, self.rate, self.mass = stiffness + push, damping + gyro, model.mass
        self.speed, self.step = speed, step
        self.apart = [one for one in unlike(model, blades) if not one.support.is_round]
        size = len(self.held)  # (n, 2 s), of s supports that differ by direction
        self.rows = np.vstack([np.zeros((0, size)), *(p.rows for p in self.apart)]).T

    @cached_property
    def differences(self) -> tuple[Complexes, Complexes]:
        """The coefficients k_d - i Omega c_d and c_d of the supports, (s,) each."""
        own = [one.support.at(self.speed) for one in self.apart]
        lost = np.array([one.damping_apart for one in own])
        stiff = np.array([one.stiffness_apart for one in own])
        return stiff - 1j * self.speed * lost, lost

    def times(self, h: int) -> float:
        """Return h Omega, 1/s, as the velocities of time steps have it."""
        angle = h * self.speed * self.step
        return np.sin(angle) / self.step if self.step else h * self.speed

    def answer(self, h: int, load: Complexes) -> Complexes:
        """Return A_h^-1 load, (n, c)."""
        if h == 0:
            return np.asarray(np.linalg.solve(self.held, load.real))
        half = 0.5 * h * self.speed * self.step
        twice = (
            (2.0 * np.sin(half) / self.step) ** 2 if self.step
            else (h * self.speed) ** 2
        )  # fmt: skip
        dynamic = self.held + 1j * self.times(h) * self.rate - twice * self.mass
        return np.asarray(np.linalg.solve(dynamic, load))


def steady_response(
    model: ModalModel, blades: int, loads: Loads, speed: float, step: float = 0.0
) -> Steady:
    """Return the steady motion of a rotor under loads, see this module.

    Parameters
    ----------
    model, blades : rotor with terms of rotation and a free centre; N
    loads : loads on the n coordinates, rotating frame; that of h = 0 is real
    speed, step : Omega, rad/s; dt, s, for the motion of central differences; 0: the
        exact one

    Raises
    ------
    numpy.linalg.LinAlgError
        at a critical speed without damping
    """
    answers = _Harmonics(model, blades, speed, step)
    if model.terms.is_round:
        return _sorted({h: answers.answer(h, load) for h, load in loads.items()})
    found: dict[int, Complexes] = {}
    for parity in (0, 1):
        given = {h: load for h, load in loads.items() if h % 2 == parity}
        if given:
            found |= _coupled(answers, given, cyclic=model.cyclic)
    return _sorted(found)


def _sorted(found: dict[int, Complexes]) -> Steady:
    size = len(next(iter(found.values())))
    found = {0: np.zeros(size, dtype=complex), **found}
    large = max(float(np.abs(shape).max()) for shape in found.values())
    kept = [h for h in sorted(found)
            if h == 0 or np.abs(found[h]).max() > LEAST * large]  # fmt: skip
    return Steady(np.array(kept), np.array([found[h] for h in kept], dtype=complex))


def _coupled(
    answers: _Harmonics, given: Loads, *, cyclic: bool
) -> dict[int, Complexes]:
    """Return the harmonics of one parity that supports couple, {h: X_h}, h >= 0.

    given : the loads of this parity
    cyclic : whether sectors are equal, so that only two harmonics are coupled
    """
    top = (2 if cyclic else 8) - max(given) % 2
    known: dict[int, Complexes] = {}
    while True:
        orders = range(top % 2, top + 1, 2)
        for h in orders:
            if h not in known:
                load = given.get(h, np.zeros(len(answers.held), dtype=complex))
                both = np.column_stack([answers.rows, load * (1.0 if h == 0 else 0.5)])
                known[h] = answers.answer(h, both)
        found = _solved(answers, known, orders)
        large = max(float(np.abs(shape).max()) for shape in found.values())
        small = float(np.abs(found[top]).max()) <= LEAST * large
        if cyclic or small or top >= MOST:
            return found
        top += 6


def _solved(
    answers: _Harmonics,
    known: dict[int, Complexes],
    orders: range,
) -> dict[int, Complexes]:
    """Return {h: X_h} of the harmonics `orders`, h >= 0, with the supports' forces.

    known : {h: (n, 2 s + 1)}, answers to unit forces x and y on each of s supports, and
        to the load
    """
    low, top = -orders[-1], orders[-1]
    both = list(range(low, top + 1, 2))
    place, s = {h: i for i, h in enumerate(both)}, len(answers.apart)
    plain = np.eye(len(both) * s, dtype=complex).reshape(len(both), s, len(both), s)
    turned = np.zeros_like(plain)
    right = np.zeros((len(both), s), dtype=complex)
    for k in both:
        h = -(k + 2)
        if h not in place:
            continue
        moved = answers.rows.T @ known[abs(h)]
        moved = moved.conj() if h < 0 else moved
        z = moved[0::2] + 1j * moved[1::2]  # (s, 2 s + 1)
        x, y, rest = z[:, :-1:2], z[:, 1:-1:2], z[:, -1]
        stiff, lost = answers.differences
        beta = stiff - 1j * answers.times(h) * lost
        turned[place[k], :, place[h]] += beta[:, None] * ((x - 1j * y) / 2).conj()
        plain[place[k], :, place[-h]] += beta[:, None] * ((x + 1j * y) / 2).conj()
        right[place[k]] = -beta * rest.conj()
    force = dict(zip(both, _with_conjugates(plain, turned, right), strict=True))
    out = {}
    for h in orders:
        f, back = force[h], force[-h].conj()
        pairs = np.stack([(f + back) / 2, (f - back) / 2j], axis=1)
        pushed = known[h] @ np.append(pairs.ravel(), 1.0)
        out[h] = pushed if h == 0 else 2.0 * pushed
    return out


def _with_conjugates(plain: Complexes, turned: Complexes, right: Complexes) -> Any:
    """Return f with plain f + turned conj(f) = right, all of the shape of `right`."""
    size = right.size
    a, b = plain.reshape(size, size), turned.reshape(size, size)
    a, b = a + b, a - b
    matrix = np.block([[a.real, -b.imag], [a.imag, b.real]])
    both = np.append(right.real.ravel(), right.imag.ravel())
    re, im = np.linalg.solve(matrix, both).reshape(2, -1)
    return (re + 1j * im).reshape(right.shape)


@lru_cache(maxsize=8)
def translation(rotor: ModalModel, blades: int) -> Complexes:
    """Return t, (n,): t @ forces is the resultant F_x + i F_y of forces on a rotor.

    Its parts are the displacements of all coordinates if the rotor moves by 1 along x
    or y without strain: the static response to its centre, with the tilt held.
    """
    hub = 2 * blades + np.arange(2)
    tilt = rotor.spin.tilt if rotor.spin else ()
    held = np.append(hub, tilt).astype(np.intp)
    free = np.setdiff1d(np.arange(len(rotor.mass)), held)
    moved = np.zeros((len(rotor.mass), 2))
    moved[hub] = np.eye(2)
    stiffness = rotor.stiffness
    moved[free] = -np.linalg.solve(
        stiffness[np.ix_(free, free)], stiffness[np.ix_(free, hub)]
    )
    return np.asarray(moved @ [1.0, 1.0j])
