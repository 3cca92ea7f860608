"""Modes that rotation does not couple as waves of central differences, for `points`.

The two roots of central differences of a mode of frequency omega and damping ratio xi,

s^2 (1 - dt^2 omega^2/4) + 2 xi omega s + omega^2 = 0,  z = (1 + s dt/2)/(1 - s dt/2),

are a conjugate pair. The mode's wave is a complex amplitude a that a free step
multiplies by z; the mode's amplitude is q = Re(a), and its increment d = q_n - q_{n-1}
= Re(rise a), rise = 1 - 1/z. A modal force f adds give f to q and to d at the step's
end. The increments of a free step that ends with a, and of the step before it, have the
sum Re(moves a).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.arrays import Complexes, Floats
from hpcwhirl.dynamics.bodies.timestep import recursion
from hpcwhirl.dynamics.waves.turning_waves import WORST
from hpcwhirl.reduction.modes import ModalModel


@dataclass(frozen=True)
class ModeWaves:
    """The m modes of a body as waves of central differences, one for each mode.

    A wave is a complex amplitude a; the mode's amplitude is q = Re(a), its last
    increment d = q_n - q_{n-1}.

    Attributes
    ----------
    step : dt, s
    omega : (m,), rad/s
    ahead : (m,), z - 1: a step without forces multiplies a by z
    give : (m,), (1/dt^2 + xi omega/dt)^-1, change of q and of d in a step by a unit
        modal force
    """

    step: float
    omega: Floats
    ahead: Complexes
    give: Floats

    @property
    def rise(self) -> Complexes:
        """Factors, (m,), that give increments of modes: q_n - q_{n-1} = Re(rise a_n).

        a_n is the wave's complex amplitude at step n, q_n = Re(a_n) that of the mode.
        """
        return np.asarray(self.ahead / (1 + self.ahead))

    @property
    def rates(self) -> Complexes:
        """Factors, (m,), 1/s, that give velocities of modes, Re(rates a_n).

        a_n is the wave's complex amplitude at step n; the velocity is (q_{n+1} -
        q_{n-1}) / 2 dt.
        """
        return np.asarray(self.rise * (2 + self.ahead) / (2 * self.step))

    @property
    def oscillates(self) -> NDArray[np.bool_]:
        """Whether each mode oscillates, (m,), with two roots that are not nearly equal.

        If not, its motion cannot be integrated as a wave.
        """
        with np.errstate(divide="ignore", invalid="ignore"):
            apart = np.abs(self.rise.imag) / np.abs(self.rise)
        return np.asarray(apart * WORST > 1.0)

    @property
    def is_basis(self) -> bool:
        """Whether all modes can be integrated as waves."""
        return bool(self.oscillates.all())

    @property
    def moves(self) -> Complexes:
        """Factors, (m,), that give the change of modal amplitudes over two free steps.

        q_{n+1} - q_{n-1} = Re(moves a_{n+1}), with a the wave's amplitude, q the
        mode's.
        """
        return np.asarray(self.rise * (1 + 1 / (1 + self.ahead)))

    def amplitudes(self, q: Floats, moved: Floats, of: Complexes) -> Complexes:
        """Return the waves' complex amplitudes a, (m,), of a motion of the modes.

        They have Re(a) = q and Re(of a) = moved.

        q, moved : (m,), amplitudes of the modes, and their increments or velocities
        of : (m,), factors for the latter: `rise` for increments, `rates` for velocities
        """
        return np.asarray(q + 1j * (of.real * q - moved) / of.imag)

    @property
    def gives(self) -> Complexes:
        """Change of each wave's complex amplitude a by a unit modal force, (m,).

        The force acts in one step; the change is that at its end.
        """
        return self.amplitudes(self.give, self.give, self.rise)

    @property
    def form(self) -> Floats:
        """Coefficients (3, m) of re^2, 2 re im and im^2 of the waves' amplitudes, in J.

        They give the energy of each mode, (d / dt)^2 / 2 + omega^2 q (q - d) / 2, with
        amplitude q and increment d = q_n - q_{n-1}.
        """
        rise, before, stiff = self.rise, 1 / (1 + self.ahead), self.omega**2
        squares = rise.real**2, -rise.real * rise.imag, rise.imag**2
        potential = stiff * before.real, -stiff * before.imag / 2, 0.0 * stiff
        return (np.array(squares) / self.step**2 + np.array(potential)) / 2


def mode_waves(body: ModalModel, step: float) -> ModeWaves:
    """Return the modes of a body as waves of central differences.

    step : dt, s, below the stability limit
    """
    omega, rate = body.omega, body.ratios * body.omega
    stiff = 1 - (omega * step / 2) ** 2
    swing = np.sqrt((omega**2 * stiff - rate**2).astype(np.complex128))
    half = (1j * swing - rate) / stiff * (step / 2)
    _, _, give = recursion(omega, body.ratios, step)
    return ModeWaves(step, omega, np.asarray(2 * half / (1 - half)), give)
