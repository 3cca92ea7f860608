"""Forward and backward waves of a rotating rotor of equal sectors.

On a nodal diameter, in coordinates of the modes at rest (M = 1), with G = D + 2 Omega C
and K = K(Omega) + S,

x'' + G x' + K x = f

moves freely as the sum of Y e^{st} a over waves, with s the 2 m roots of
[s^2 + s G + K] Y = 0. A wave's amplitude a is complex; a step makes it z a + beta
Lambda, z = e^{s dt}, Lambda the spectrum of the multipliers, which act at its start.

Central differences move as the sum of Y z^n a with z = (1 + s dt/2) / (1 - s dt/2) and
[s^2 (1 - dt^2 K/4) + s G + K] Y = 0; d_n = x_n - x_{n-1} = sum of Y (1 - 1/z) a.

Jacobi's energy (for differences at n + 1/2) and the loss of a step by D and S are
Hermitian forms of a.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from scipy.linalg import eig

from hpcwhirl.arrays import Complexes, Floats, Indices
from hpcwhirl.case.unbalance import circle, swing
from hpcwhirl.dynamics.waves.wave_motion import WaveMotion
from hpcwhirl.reduction.model import Model
from hpcwhirl.reduction.modes import ModalModel, SpinBlock
from hpcwhirl.reduction.waves import diameter_matrices
from hpcwhirl.scene import Scene

BOOKED = 1e-8  # relative difference of work and energy that counts as none
WORST = 1e6  # condition number of scaled waves beyond which they are no basis


@dataclass(frozen=True)
class _Diameter:
    """Waves of one nodal diameter of a rotating rotor: m modes at rest, w = 2 m waves.

    x are the complex amplitudes of the modes at rest, d = x_n - x_{n-1} their
    increments, x' their velocities; a are the amplitudes of the waves. D is the matrix
    of damping, S that of circulatory forces of the supports.

    Attributes
    ----------
    k, step : nodal diameter; dt, s
    ahead : (w,), z - 1, z the factor of a wave in a step without forces
    shapes, rises : (m, w), x for unit amplitudes, and d or, for the exact flow, x'
    radial, along : (m,), change of the gap, and -1 times the tangential displacement of
        the tip, for unit x
    hub : (m,), x_o + i y_o for unit x; zero if the centre does not move
    energy : (w, w), Hermitian form of a, J
    rate, push : (m, m), D and S
    rates : (m, w), velocities for unit amplitudes; of central differences (x_{n+1} -
        x_{n-1}) / 2 dt
    """

    k: int
    step: float
    ahead: Complexes
    shapes: Complexes
    rises: Complexes
    radial: Complexes
    along: Complexes
    hub: Complexes
    energy: Complexes
    rate: Complexes
    push: Complexes
    rates: Complexes

    @property
    def scale(self) -> float:
        """Number by which `condition` divides `rises`: its largest entry."""
        return float(np.abs(self.rises).max())

    @property
    def condition(self) -> float:
        """Condition number of the waves' basis, `shapes` over `rises` / `scale`."""
        basis = np.vstack([self.shapes, self.rises / self.scale])
        return float(np.linalg.cond(basis))

    @cached_property
    def inverse(self) -> Complexes:
        """Matrix (waves, 2 m) from the motion of the modes to amplitudes of the waves.

        The motion is x, the amplitudes of the modes at rest, and their increments d or,
        for the exact flow, velocities x'.
        """
        basis = np.vstack([self.shapes, self.rises / self.scale])
        scale = np.repeat([1.0, 1.0 / self.scale], len(self.shapes))
        return np.asarray(np.linalg.solve(basis, np.diag(scale)))

    @property
    def before(self) -> Complexes:
        """Return the factors 1 / z, (waves,), which lead a step back without forces."""
        return np.asarray(1 / (1 + self.ahead))

    @cached_property
    def motion(self) -> WaveMotion:
        """How the waves move the modes at rest."""
        return WaveMotion(self.shapes, self.rates)

    def force(self, mu: float) -> Complexes:
        """Return the modal forces (m,) of a unit spectrum of the multipliers, 1 N.

        mu : friction coefficient with the sign of Omega
        """
        return np.asarray((self.radial + mu * self.along).conj())


@dataclass(frozen=True)
class Differences(_Diameter):
    """Free waves of one nodal diameter by central differences, as in scheme `modal`.

    Attributes
    ----------
    give : (m, m), (1/dt^2 + G/2dt)^-1, increments of the modes by unit modal forces; G
        = D + 2 Omega C
    """

    give: Complexes

    def pushed(self, mu: float) -> Complexes:
        """Return beta (waves,), the effect of a unit spectrum of multipliers on waves.

        It is added to their amplitudes after a step without contact. The spectrum,
        Lambda, changes the amplitudes of the modes and their increments equally.

        mu : friction coefficient with the sign of Omega
        """
        return self.pushed_by(self.force(mu))

    def pushed_by(self, force: Complexes) -> Complexes:
        """Return it for modal forces, (m,), of any unit spectrum."""
        more = self.passed_by(force)
        return np.asarray(self.inverse @ np.concatenate([more, more]))

    def passing(self) -> Complexes:
        """Return the matrix (m, w) from amplitudes of waves to dt (v- + v+) of modes.

        The amplitudes are those after a free step; v- and v+ are the velocities of the
        modes before and after the contact impulse at the step's start. By central
        differences dt (v- + v+) is x_{n+1} - x_{n-1}.
        """
        return np.asarray(self.rises * (1 + self.before))

    def passed(self, mu: float) -> Complexes:
        """Return the change of the modes, (m,), by a unit spectrum of multipliers.

        Lambda, the spectrum, adds it to the amplitudes x_{n+1} of the modes, and also
        to dt (v- + v+), v- and v+ the velocities before and after the contact impulse.

        mu : friction coefficient with the sign of Omega
        """
        return self.passed_by(self.force(mu))

    def passed_by(self, force: Complexes) -> Complexes:
        """Return it for modal forces, (m,), of any unit spectrum."""
        return np.asarray(self.give @ force)

    def work(self, mu: float) -> tuple[Complexes, float]:
        """Return factors (row, number) of the energy and loss, J, that contact adds.

        In a step Lambda, the spectrum of the multipliers, adds Re(conj(Lambda) row a) +
        number |Lambda|^2 to the energy of the waves and to their damping loss together,
        with row (waves,) and the amplitudes a after the step without Lambda.

        mu : friction coefficient with the sign of Omega
        """
        beta, more = self.pushed(mu), self.passed(mu).conj()
        row = 2 * beta.conj() @ self.energy
        row = row + more @ self.rate @ self.passing() / (2 * self.step)
        row = row + more @ self.push @ (self.shapes * self.before) / 2
        number = beta.conj() @ self.energy @ beta
        number = number + more @ self.rate @ more.conj() / (4 * self.step)
        return np.asarray(row), float(number.real)


@dataclass(frozen=True)
class Flow(_Diameter):
    """Free waves of one nodal diameter by the exact flow, as in scheme `exact`.

    Lambda is the spectrum of the multipliers, v- and v+ are velocities before and after
    their impulse.
    """

    def _struck(self, force: Complexes) -> Complexes:
        """Return the change of the waves' amplitudes, (waves,), at a contact impulse.

        The impulse is that of a unit spectrum, such as that of the multipliers, at the
        start of a step.

        force : (m,), modal forces of the unit spectrum
        """
        impulse = self.step * force
        return np.asarray(self.inverse @ np.concatenate([0 * impulse, impulse]))

    def pushed(self, mu: float) -> Complexes:
        """Return beta (waves,), the effect of a unit spectrum of multipliers on waves.

        It is added to their amplitudes after a step without contact.

        mu : friction coefficient with the sign of Omega
        """
        return self.pushed_by(self.force(mu))

    def pushed_by(self, force: Complexes) -> Complexes:
        """Return it for modal forces, (m,), of any unit spectrum."""
        return np.asarray((1 + self.ahead) * self._struck(force))

    def passing(self) -> Complexes:
        """Return the matrix (m, w) from amplitudes of waves to dt (v- + v+) of modes.

        The amplitudes are those after a free step; v- and v+ are the velocities of the
        modes before and after the contact impulse at the step's start. Without an
        impulse v+ = v-, so that this is 2 dt v-.
        """
        return np.asarray(2 * self.step * self.rises * self.before)

    def passed(self, mu: float) -> Complexes:
        """Return dt (v+ - v-), (m,), of the modes by a unit spectrum of multipliers.

        v- and v+ are the velocities of the modes before and after its impulse.

        mu : friction coefficient with the sign of Omega
        """
        return self.passed_by(self.force(mu))

    def passed_by(self, force: Complexes) -> Complexes:
        """Return it for modal forces, (m,), of any unit spectrum."""
        return np.asarray(self.step**2 * force)

    def work(self, mu: float) -> tuple[Complexes, float]:
        """Return factors (row, number) of the energy and loss, J, that contact adds.

        They are used as those of `Differences.work`. Here contact changes only the
        energy at the step's start, by its impulse.

        mu : friction coefficient with the sign of Omega
        """
        struck = self._struck(self.force(mu))
        row = 2 * (struck.conj() @ self.energy) * self.before
        return np.asarray(row), float((struck.conj() @ self.energy @ struck).real)


Diameter = Differences | Flow


def books(own: Diameter, mu: float) -> bool:
    """Return whether contact adds to energy and loss what its forces work.

    That is so unless round-off has spoiled the waves. The work in a step is half the
    product of the forces and the motion of the material over two steps.

    own, mu : waves of a nodal diameter; friction with the sign of Omega
    """
    row, _ = own.work(mu)
    told = (own.radial + mu * own.along) @ own.passing() / 2
    miss = np.abs(row - told).max(initial=0.0)
    return bool(miss <= BOOKED * np.abs(told).max(initial=0.0))


def _hermitian(matrix: Complexes) -> Complexes:
    return np.asarray((matrix + matrix.conj().T) / 2)


def diameters_of(model: Model, scene: Scene) -> list[Diameter]:
    """Return the waves of each nodal diameter of a rotating rotor of equal sectors.

    They are those of the scheme of the scene: `Differences` or `Flow`.
    """
    spin, exact = model.rotor.spin, scene.solver.flies
    pieces = spin.waves if spin else ()
    return [_diameter(model, scene, piece, exact=exact) for piece in pieces]


def _diameter(model: Model, scene: Scene, piece: SpinBlock, *, exact: bool) -> Diameter:
    step = scene.solver.time_step
    gyro, rate, stiffness, push = diameter_matrices(model.rotor, piece, scene.speed)
    whole, damping = stiffness + push, rate + gyro
    same: Complexes = np.eye(len(rate), dtype=np.complex128)
    mass = same if exact else np.asarray(same - step**2 / 4 * whole)
    roots, shapes = roots_of(mass, damping, whole)
    scale = np.sqrt((2.0 - piece.simple) / model.blades)
    radial, along = -scale * piece.tips
    turned = radial @ shapes
    size = np.abs(turned)
    shapes = shapes * np.where(size > 0.0, turned.conj() / np.where(size, size, 1.0), 1)
    back = shapes.conj().T
    hub = piece.hub
    if exact:
        rises = shapes * roots
        energy = _hermitian(rises.conj().T @ rises + back @ stiffness @ shapes) / 2
        return Flow(
            piece.k, step, np.expm1(roots * step), shapes, rises, radial, along, hub,
            energy, rate, push, rises,
        )  # fmt: skip
    ahead = roots * step / (1 - roots * step / 2)
    rises = shapes * ahead / (1 + ahead)
    energy = rises.conj().T @ rises / step**2
    energy = _hermitian(energy + back @ stiffness @ (shapes / (1 + ahead))) / 2
    give = np.linalg.solve(same / step**2 + damping / (2 * step), same)
    return Differences(
        piece.k, step, ahead, shapes, rises, radial, along, hub, energy, rate, push,
        rises * (2 + ahead) / (2 * step), np.asarray(give),
    )  # fmt: skip


def roots_of(mass: Any, damping: Any, stiffness: Any) -> tuple[Complexes, Complexes]:
    """Return roots s (2 m,) and shapes Y (m, 2 m) of [s^2 M + s G + K] Y = 0.

    Of real matrices, roots that are not real come in exact pairs.

    mass, damping, stiffness : M, G, K, (m, m) each
    """
    m = len(mass)
    right = np.linalg.solve(mass, np.hstack([stiffness, damping]))
    top = np.hstack([np.zeros((m, m)), np.eye(m)])
    roots, vectors = eig(np.vstack([top, -right]))
    shapes = vectors[:m]
    return roots, shapes / np.linalg.norm(shapes, axis=0)


@dataclass(frozen=True)
class Circle:
    """A circular orbit of an unbalanced rotor, stored as one more wave.

    The orbit without contact is constant in the rotating frame; where supports differ
    by direction it is an ellipse, whose second circle turns there by 2 Omega dt in a
    step. The displacement at time 0 is amplitude times shape.

    Attributes
    ----------
    amplitude : phase factor of magnitude 1, so chosen that the shape's change of the
        gap is a real number
    shape : (m,), displacement in the modes at rest of nodal diameter 1
    ahead : z - 1, z the factor by which a step multiplies the amplitude
    """

    amplitude: complex
    shape: Complexes
    ahead: complex = 0j

    def rise(self, step: float) -> complex:
        """Return the velocity (x_{n+1} - x_{n-1}) / 2 dt of a unit displacement, 1/s.

        step : dt, s
        """
        z = 1 + self.ahead
        return (z - 1 / z) / (2 * step)


LEAST = 1e-9  # relative size of a circle that is round-off


def circles_of(
    model: Model, scene: Scene, diameters: list[Diameter]
) -> tuple[Circle, ...]:
    """Return the circular orbits of a rotor with unbalance; () if it is balanced.

    The first is constant in the rotating frame.

    diameters : the rotor's waves of each nodal diameter
    """
    places, swung = circle(model, scene), swing(model, scene)
    if places is None:
        return ()
    lower = model.rotor.shapes.T @ model.rotor.mass
    parts = [(modes_of(model, 1, lower @ places), 0j)]
    if swung is not None:
        one, two = (modes_of(model, 1, lower @ x) for x in (swung.real, swung.imag))
        ahead = complex(np.expm1(2j * scene.speed * scene.solver.time_step))
        parts.append(((one + 1j * two) / 2, ahead))
        parts.append(((one - 1j * two) / 2, ahead.conjugate()))
    least = LEAST * max(float(np.abs(shape).max()) for shape, _ in parts)
    return tuple(
        _circle(complex(diameters[1].radial @ shape), shape, ahead)
        for n, (shape, ahead) in enumerate(parts)
        if n == 0 or np.abs(shape).max() > least
    )


def _circle(opened: complex, shape: Complexes, ahead: complex) -> Circle:
    amplitude = opened / abs(opened) if opened else 1.0 + 0.0j
    return Circle(amplitude, shape / amplitude, ahead)


def is_basis(diameters: list[Diameter]) -> bool:
    """Return whether the waves of every nodal diameter are a basis of its motion.

    They are not if two of them nearly coincide.
    """
    return bool(diameters) and all(own.condition < WORST for own in diameters)


def _parts(values: Any) -> tuple[Any, Any]:
    return values.real, values.imag


def modal_places(
    model: Model, diameters: list[Diameter], places: list[Complexes]
) -> Floats:
    """Return amplitudes (m,) of all modes at rest, from complex ones by diameter.

    places : complex amplitudes of each nodal diameter's modes, as `modes_of` returns
        them
    """
    q = np.zeros(len(model.rotor.omega))
    for own, x in zip(diameters, places, strict=True):
        for phase, part in enumerate(_parts(x)):
            members = _members(model, own.k, phase)
            if len(members):
                q[members] = part
    return q


def modes_of(model: Model, k: int, q: Floats) -> Complexes:
    """Return complex amplitudes of one nodal diameter's modes, from those of all modes.

    q : (m,), amplitudes of the modes at rest; the result is q_0 + i q_1 of the two
        phases
    """
    real, imag = (q[_members(model, k, phase)] for phase in (0, 1))
    return np.asarray(real + 1j * imag if len(imag) else real + 0j)


def _members(model: Model, k: int, phase: int) -> Indices:
    """Return the indices of the modes of nodal diameter k, sorted by rank.

    phase : 0 or 1, the first or the second mode of each pair
    """
    return _members_of(model.rotor, k, phase)


@lru_cache(maxsize=1024)  # read at every sample
def _members_of(body: ModalModel, k: int, phase: int) -> Indices:
    members = np.flatnonzero((body.diameter == k) & (body.phase == phase))
    return members[np.argsort(body.rank[members])]
