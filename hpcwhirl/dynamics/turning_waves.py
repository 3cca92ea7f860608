"""Arrays of the kernel `waves`: a rotating rotor as waves, forward and backward apart.

On a nodal diameter, in coordinates of the modes at rest (M = 1), central differences

(1/dt^2 + G/2dt) x_{n+1} = f_n + (2/dt^2 - K) x_n - (1/dt^2 - G/2dt) x_{n-1}

with G = D + 2 Omega C and K = K(Omega) + S move freely as x_n = sum of Y z^n a over
waves with z = (1 + s dt/2) / (1 - s dt/2), and s the 2 m roots of

[s^2 (1 - dt^2 K/4) + s G + K] Y = 0.

A wave's amplitude a is complex: a' = z a + beta Lambda, Lambda the spectrum of the
multipliers; d_n = x_n - x_{n-1} = sum of Y (1 - 1/z) a. Jacobi's energy at n + 1/2, and
the loss of a step, (d' + d) D (d' + d) / (4 dt) + (d' + d) S x_n / 2, are forms of a.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eig

from hpcwhirl.case.unbalance import circle
from hpcwhirl.dynamics.kernels import waves
from hpcwhirl.dynamics.kernels.cyclic import widths
from hpcwhirl.dynamics.kernels.kernel_types import (
    Arrays,
    CyclicCasing,
    CyclicContact,
    Load,
    WaveRotor,
)
from hpcwhirl.dynamics.kernels.passes import packed as packed_modes
from hpcwhirl.dynamics.kernels.vectors import FOUR, aligned
from hpcwhirl.dynamics.operators import friction_with_sign
from hpcwhirl.dynamics.slots import fold, ring_arrays, ring_column, transforms
from hpcwhirl.reduction.model import Model
from hpcwhirl.reduction.modes import Block
from hpcwhirl.reduction.waves import diameter_matrices, hub_of
from hpcwhirl.scene import Scene

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
WORST = 1e6  # condition of scaled waves, beyond which they are no basis


@dataclass(frozen=True)
class Diameter:
    """Waves of one nodal diameter; m modes at rest, w = 2 m waves.

    Attributes
    ----------
    k : nodal diameter
    ahead : (w,), z - 1
    shapes, rises : (m, w), Y and Y (1 - 1/z): x and d of unit amplitudes
    give : (m, m), m/N.., (1/dt^2 + G/2dt)^-1
    radial, along : (m,), what a tip's gap, and its place against theta, read of x
    hub : (m,), z_o of x; zero where the centre rests
    energy : (w, w), Hermitian, of a: J
    rate, push : (m, m), D and S
    """

    k: int
    ahead: Complexes
    shapes: Complexes
    rises: Complexes
    give: Complexes
    radial: Complexes
    along: Complexes
    hub: Complexes
    energy: Complexes
    rate: Complexes
    push: Complexes

    @property
    def fastest(self) -> float:
        """Largest |z - 1|: what d is scaled by."""
        return float(np.abs(self.ahead).max())

    @property
    def condition(self) -> float:
        """Condition of the waves as a basis of (x, d), d scaled."""
        basis = np.vstack([self.shapes, self.rises / self.fastest])
        return float(np.linalg.cond(basis))

    @cached_property
    def inverse(self) -> Complexes:
        """Amplitudes of (x, d), (w, 2 m)."""
        basis = np.vstack([self.shapes, self.rises / self.fastest])
        scale = np.repeat([1.0, 1.0 / self.fastest], len(self.shapes))
        return np.asarray(np.linalg.solve(basis, np.diag(scale)))

    def force(self, mu: float) -> Complexes:
        """Return the modal forces (m,) of a unit Lambda; mu with the sign of Omega."""
        return np.asarray((self.radial + mu * self.along).conj())

    def pushed(self, mu: float) -> Complexes:
        """Return the amplitudes (w,) of a unit Lambda."""
        more = self.give @ self.force(mu)
        return np.asarray(self.inverse @ np.concatenate([more, more]))

    def passing(self) -> Complexes:
        """Return d' + d of unit amplitudes after a step without forces, (m, w)."""
        return np.asarray(self.rises * (1 + 1 / (1 + self.ahead)))

    def lost(self, step: float) -> Complexes:
        """Return the form (w, w) of a step's loss without forces, of a after it, J."""
        moved, place = self.passing(), self.shapes / (1 + self.ahead)
        out = moved.conj().T @ (self.rate @ moved) / (4 * step)
        out = out + moved.conj().T @ (self.push @ place) / 2
        return np.asarray((out + out.conj().T) / 2)

    def work(self, mu: float, step: float) -> tuple[Complexes, float]:
        """Return (row (w,), number): what Lambda adds to energy and loss of a step.

        It adds Re(conj(Lambda) row a) + number |Lambda|^2, a before it.
        """
        beta, more = self.pushed(mu), self.give @ self.force(mu)
        row = 2 * beta.conj() @ self.energy
        row = row + more.conj() @ self.rate @ self.passing() / (2 * step)
        row = row + more.conj() @ self.push @ self.shapes / (1 + self.ahead) / 2
        number = beta.conj() @ self.energy @ beta
        number = number + more.conj() @ self.rate @ more / (4 * step)
        return np.asarray(row), float(number.real)


def diameters_of(model: Model, scene: Scene) -> list[Diameter]:
    """Return the waves of all nodal diameters of a rotor of equal sectors."""
    spin = model.rotor.spin
    pieces = spin.waves if spin else ()
    return [_diameter(model, scene, piece) for piece in pieces]


def _diameter(model: Model, scene: Scene, piece: Block) -> Diameter:
    step = scene.solver.time_step
    gyro, rate, stiffness, push = diameter_matrices(model.rotor, piece, scene.speed)
    same, whole = np.eye(len(rate)), stiffness + push
    roots, shapes = _roots(same - step**2 / 4 * whole, rate + gyro, whole)
    ahead = roots * step / (1 - roots * step / 2)
    scale = np.sqrt((2.0 - piece.simple) / model.blades)
    radial, along = -scale * piece.modes[0], -scale * piece.modes[1]
    turned = radial @ shapes
    size = np.abs(turned)
    shapes = shapes * np.where(size > 0.0, turned.conj() / np.where(size, size, 1.0), 1)
    rises = shapes * ahead / (1 + ahead)
    energy = rises.conj().T @ rises / (2 * step**2)
    energy = energy + shapes.conj().T @ stiffness @ (shapes / (1 + ahead)) / 2
    give = np.linalg.solve(same / step**2 + (rate + gyro) / (2 * step), same)
    return Diameter(
        piece.k, ahead, shapes, rises, np.asarray(give), radial, along,
        hub_of(model.rotor, piece), (energy + energy.conj().T) / 2, rate, push,
    )  # fmt: skip


def _roots(
    mass: Complexes, damping: Complexes, stiffness: Complexes
) -> tuple[Complexes, Complexes]:
    """Return (s (2 m,), Y (m, 2 m)) of [s^2 M + s G + K] Y = 0."""
    m = len(mass)
    right = np.linalg.solve(mass, np.hstack([stiffness, damping]))
    top = np.hstack([np.zeros((m, m)), np.eye(m)])
    roots, vectors = eig(np.vstack([top, -right]))
    shapes = vectors[:m]
    return roots, shapes / np.linalg.norm(shapes, axis=0)


@dataclass(frozen=True)
class Circle:
    """The circle x_s of an unbalanced rotor as a wave that stands: z = 1.

    Attributes
    ----------
    amplitude : a, of magnitude 1
    shape : (m,), x_s / a in modes at rest of k = 1, whose gap is real
    """

    amplitude: complex
    shape: Complexes


def circle_of(model: Model, scene: Scene, diameters: list[Diameter]) -> Circle | None:
    """Return the circle of a scene's unbalance; None without one."""
    places, body = circle(model, scene), model.rotor
    if places is None:
        return None
    q = body.shapes.T @ (body.mass @ places)
    parts = [np.flatnonzero((body.diameter == 1) & (body.phase == p)) for p in (0, 1)]
    real, imag = (q[part[np.argsort(body.rank[part])]] for part in parts)
    shape = real + 1j * imag
    opened = complex(diameters[1].radial @ shape)
    amplitude = opened / abs(opened) if opened else 1.0 + 0.0j
    return Circle(amplitude, shape / amplitude)


def is_basis(diameters: list[Diameter]) -> bool:
    """Return whether waves of all diameters span its motion: none nearly coincide."""
    return bool(diameters) and all(own.condition < WORST for own in diameters)


def wave_arrays(
    model: Model, scene: Scene, diameters: list[Diameter]
) -> tuple[Arrays, int]:
    """Return (arrays of `kernels.waves.march_waves`, rows of the ring)."""
    blades, mu = model.blades, friction_with_sign(scene)
    ring, lobe, ring_rows = ring_arrays(model, scene)
    slot, sign = fold(scene.nodal_diameter, blades)
    turns, wave = transforms(blades)
    steady, slots = circle_of(model, scene, diameters), widths(blades)[0]
    rotor = _rotor(diameters, slots, mu, scene.solver.time_step, steady)
    k = np.arange(len(diameters))
    opens = [own.radial @ own.give @ own.force(mu) for own in diameters]
    waves_of = np.exp(2j * np.pi * (np.outer(np.arange(blades), k) % blades) / blades)
    column = (waves_of @ np.array(opens)).real + ring_column(model, scene)
    arrays = Arrays(
        Load(scene.force, scene.pulse, lobe),
        rotor,
        CyclicCasing(packed_modes(ring), slot, sign),
        CyclicContact(column, turns, wave, ()),
    )
    return arrays, ring_rows


def _rotor(
    diameters: list[Diameter], slots: int, mu: float, step: float, steady: Circle | None
) -> WaveRotor:
    """Return the kernel's arrays of a rotor; those of a circle are a row behind."""
    rows = max(len(own.ahead) for own in diameters) + (steady is not None)
    items = np.zeros((waves.ITEMS, rows, slots))
    fixed, hub = np.zeros((waves.FIXED, slots)), np.zeros((2, rows, 2, slots))
    form = np.zeros((rows, rows, 2, slots))
    for own in diameters:
        k, count = own.k, len(own.ahead)
        work, adds = own.work(mu, step)
        of_wave = {
            waves.AHEAD_RE: own.ahead, waves.PUSH_RE: own.pushed(mu),
            waves.RATE_RE: own.along @ own.passing(), waves.WORK_RE: work,
            waves.ALONG_RE: own.along @ own.shapes,
        }  # fmt: skip
        for place, values in of_wave.items():
            items[place, :count, k], items[place + 1, :count, k] = _parts(values)
        items[waves.RADIAL, :count, k] = (own.radial @ own.shapes).real
        opened = own.give @ own.force(mu)
        for place, row in (
            (waves.OPENS_RE, own.radial),
            (waves.SLIDES_RE, own.along),
        ):
            fixed[place, k], fixed[place + 1, k] = _parts(row @ opened)
        fixed[waves.ADDS, k] = adds
        hub[:, :count, :, k] = _read_hub(own.hub @ own.shapes)
        upper = np.triu(own.energy) + np.triu(own.energy, 1)
        form[:count, :count, 0, k], form[:count, :count, 1, k] = _parts(upper)
    if steady is not None:
        own, shape, k = diameters[1], steady.shape, diameters[1].k
        items[waves.RADIAL, -1, k] = (own.radial @ shape).real
        along, centre = complex(own.along @ shape), complex(own.hub @ shape)
        items[[waves.ALONG_RE, waves.ALONG_IM], -1, k] = _parts(along)
        hub[:, -1, :, k] = _read_hub(centre)
    chosen = form[np.triu_indices(rows)]
    return WaveRotor(
        packed(items), aligned(fixed.ravel()), hub.reshape(2, -1).copy(),
        aligned(chosen.ravel()),
    )  # fmt: skip


def _read_hub(centre: Any) -> Floats:
    """Return what x_o and y_o read of re and im of amplitudes, (2, ..., 2)."""
    x = np.stack([centre.real, -centre.imag], axis=-1)
    return np.stack([x, np.stack([-centre.imag, -centre.real], axis=-1)])


def _parts(values: Any) -> tuple[Any, Any]:
    return values.real, values.imag


def packed(items: Floats) -> Floats:
    """Return items (ITEMS, rows, slots) as the kernel reads them, flat."""
    apart = items.reshape(len(items), -1, FOUR).transpose(1, 0, 2)
    return aligned(np.ascontiguousarray(apart).ravel())


def amplitudes_of(state: Floats, own: Diameter, slots: int) -> Complexes:
    """Return the amplitudes a (w,) of a diameter in the kernel's state of the rotor."""
    parts = state.reshape(-1, 2, slots)[: len(own.ahead), :, own.k]
    return np.asarray(parts[:, 0] + 1j * parts[:, 1])


def modal_places(model: Model, state: Floats, diameters: list[Diameter]) -> Floats:
    """Return the amplitudes (m,) of the modes at rest from an ended state."""
    body, slots = model.rotor, widths(model.blades)[0]
    q = np.zeros(len(body.omega))
    for own in diameters:
        x = own.shapes @ amplitudes_of(state, own, slots)
        same = body.diameter == own.k
        for phase, part in enumerate(_parts(x)):
            members = np.flatnonzero(same & (body.phase == phase))
            if len(members):
                q[members[np.argsort(body.rank[members])]] = part
    return q
