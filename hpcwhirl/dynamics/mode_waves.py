"""Arrays of `kernels.whole`: a rotor of unequal sectors without rotation, as waves.

The two roots of central differences of a mode,

s^2 (1 - dt^2 omega^2/4) + 2 xi omega s + omega^2 = 0,  z = (1 + s dt/2)/(1 - s dt/2),

are a conjugate pair: the mode is q = Re(a), a step turns a into z a, and d = q_n -
q_{n-1} = Re(rise a), rise = 1 - 1/z. A modal force f adds give f to q and to d, at the
step's end. With d' of a step without forces that ends with a, and d of the step before
it, d' + d = Re(moves a).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from hpcwhirl.arrays import Complexes, Floats
from hpcwhirl.dynamics.kernels.vectors import all_aligned
from hpcwhirl.dynamics.kernels.wave_types import UncoupledRotor
from hpcwhirl.dynamics.kernels.whole import EIGHT
from hpcwhirl.dynamics.operators import friction_with_sign
from hpcwhirl.dynamics.timestep import recursion
from hpcwhirl.dynamics.turning_waves import WORST
from hpcwhirl.dynamics.whole_waves import (
    drift_of,
    opened_by_ring,
    padded_blades,
    reads_of,
)
from hpcwhirl.reduction.bodies import centre_rows
from hpcwhirl.reduction.model import Model
from hpcwhirl.reduction.modes import ModalModel
from hpcwhirl.scene import Scene


@dataclass(frozen=True)
class ModeWaves:
    """A rotor's m modes, without terms of rotation, as waves of central differences.

    The displacement of a mode is the real part of its wave's complex amplitude.

    Attributes
    ----------
    step : dt, s
    omega : (m,), rad/s
    ahead : (m,), z - 1, z the factor of an amplitude in a step without forces
    give : (m,), (1/dt^2 + xi omega/dt)^-1, change of a mode's displacement, and of its
        increment in the step, by a unit modal force
    """

    step: float
    omega: Floats
    ahead: Complexes
    give: Floats

    @property
    def rise(self) -> Complexes:
        """Increments d = q_n - q_{n-1} of the modes for unit amplitudes, (m,)."""
        return np.asarray(self.ahead / (1 + self.ahead))

    @property
    def rates(self) -> Complexes:
        """Velocities (q_{n+1} - q_{n-1}) / 2 dt for unit amplitudes at step n, (m,)."""
        return np.asarray(self.rise * (2 + self.ahead) / (2 * self.step))

    @property
    def is_basis(self) -> bool:
        """Whether each mode oscillates, with two roots that do not nearly coincide."""
        with np.errstate(divide="ignore", invalid="ignore"):
            apart = np.abs(self.rise.imag) / np.abs(self.rise)
        return bool((apart * WORST > 1.0).all())

    @property
    def moves(self) -> Complexes:
        """Factors (m,) of a in the motion of a mode over two steps, Re(factor a).

        The motion is x_{n+1} - x_{n-1}, x the displacement of the mode in free motion,
        a the complex amplitude of its wave at step n + 1.
        """
        return np.asarray(self.rise * (1 + 1 / (1 + self.ahead)))

    def amplitudes(self, q: Floats, moved: Floats, of: Complexes) -> Complexes:
        """Return the complex amplitudes a, (m,), with Re(a) = q and Re(of a) = moved.

        q, moved : (m,), displacements of the modes, and their increments or velocities
        of : (m,), factors that give increments or velocities: `rise` or `rates`
        """
        return np.asarray(q + 1j * (of.real * q - moved) / of.imag)

    @property
    def gives(self) -> Complexes:
        """Change of each wave's complex amplitude by a unit modal force, (m,)."""
        return self.amplitudes(self.give, self.give, self.rise)

    @property
    def form(self) -> Floats:
        """Coefficients (3, m), J, of re^2, 2 re im, im^2 of amplitudes in the energy.

        The energy of a mode is (d / dt)^2 / 2 + omega^2 q (q - d) / 2, d = q_n -
        q_{n-1}.
        """
        rise, before, stiff = self.rise, 1 / (1 + self.ahead), self.omega**2
        squares = rise.real**2, -rise.real * rise.imag, rise.imag**2
        potential = stiff * before.real, -stiff * before.imag / 2, 0.0 * stiff
        return (np.array(squares) / self.step**2 + np.array(potential)) / 2


def mode_waves(body: ModalModel, step: float) -> ModeWaves:
    """Return a body's modes as waves of central differences.

    body, step : modes of the body; dt, s, below the stability limit
    """
    omega, rate = body.omega, body.ratios * body.omega
    stiff = 1 - (omega * step / 2) ** 2
    swing = np.sqrt((omega**2 * stiff - rate**2).astype(np.complex128))
    half = (1j * swing - rate) / stiff * (step / 2)
    _, _, give = recursion(omega, body.ratios, step)
    return ModeWaves(step, omega, np.asarray(2 * half / (1 - half)), give)


def uncoupled_rotor(model: Model, scene: Scene, waves: ModeWaves) -> UncoupledRotor:
    """Return the arrays of `kernels.whole` for a rotor without terms of rotation.

    waves : the rotor's modes as waves
    """
    blades, mu = model.blades, friction_with_sign(scene)
    radial, along = reads_of(model)
    size = -(-len(waves.omega) // (2 * EIGHT)) * 2 * EIGHT

    def padded(rows: Floats) -> Floats:
        extra = size - rows.shape[-1]
        return np.pad(rows, [(0, 0)] * (rows.ndim - 1) + [(0, extra)])

    def parts(values: Complexes) -> Floats:
        return np.concatenate([padded(values.real), padded(values.imag)])

    def contact(rows: Floats, given: Floats) -> Floats:
        extra = padded_blades(blades) - blades
        return np.hstack([padded(rows), np.pad(rows @ given, ((0, 0), (0, extra)))])

    forces = radial + mu * along
    given = waves.give[:, None] * forces.T
    moves = waves.moves
    arrays = (
        parts(waves.ahead), padded(drift_of(radial, waves.ahead)), padded(radial),
        padded(radial), padded(along), padded(centre_rows(model.rotor, blades)),
        padded(np.hypot(radial, along).max(axis=0)), padded(forces), parts(waves.gives),
        np.concatenate([padded(moves.real), padded(-moves.imag)]),
        contact(radial, given), contact(along, given),
        opened_by_ring(model, scene), padded(waves.form),
    )  # fmt: skip
    return UncoupledRotor._make(all_aligned([np.ravel(array) for array in arrays]))
