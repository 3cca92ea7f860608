"""Free motion of a rotor's forward and backward waves: a becomes z a at each step.

|a| is multiplied by |z| at each step. The circular orbit of an unbalanced rotor is
a wave that is at rest in the rotating frame, z = 1, and that contact does not excite.
Jacobi's energy is a quadratic form of the amplitudes of each nodal diameter; the loss
is its decrease, so that no loss is left pending.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.dynamics.flights import all_die_out
from hpcwhirl.dynamics.free_modes import flushed
from hpcwhirl.dynamics.kernels import waves
from hpcwhirl.dynamics.kernels.kernel_types import WaveRotor
from hpcwhirl.dynamics.turning_waves import unpacked

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]


@dataclass(frozen=True)
class WavesMotion:
    """Free motion of waves.

    Attributes
    ----------
    most : (waves,), bounds of |a| at all later steps
    amplitudes : (waves,), a at the start
    body : the waves
    """

    most: Floats
    amplitudes: Complexes
    body: FreeWaves

    def places(self, z: Complexes) -> Complexes:
        """Return the amplitudes a = z^n a_0 at some samples, (samples, waves).

        z : (samples, waves), z^n after the n steps of each sample
        """
        return self.amplitudes * z

    def swing(self, rows: Complexes) -> Complexes:
        """Return the factors f, (waves, r), with Re(f^T z^n) = Re(conj(rows) a).

        rows : (r, waves), what each of r displacements takes of unit amplitudes
        """
        return (rows.conj() * self.amplitudes).T

    def energies(self, z: Complexes) -> Floats:
        """Return the energy of all waves, (samples,), J; z as in `places`."""
        body = self.body
        slots, rows, _ = body.form.shape
        every = np.zeros((len(z), rows * slots), dtype=np.complex128)
        every[:, body.own] = self.places(z)
        a = every.reshape(-1, rows, slots).transpose(2, 0, 1)
        pair = a @ body.form.transpose(0, 2, 1)
        return np.asarray((a.conj() * pair).real.sum(axis=(0, 2)))

    def leave(self, state: Floats, steps: int, step: int) -> tuple[Floats, Floats]:
        """Set a state to that after `steps` steps, as the kernel would leave it.

        The state includes the spectra of the gaps of the last `waves.SEEN` steps. No
        loss is pending, so that the rates and squares returned, see
        `free_modes.ModesMotion.leave`, are empty.

        Parameters
        ----------
        state : of the rotor in the kernel, set here
        steps, step : number of steps since the start of this motion and of the march
        """
        body, rows = self.body, state.reshape(-1, 2, self.body.slots)
        rows[:] = 0.0
        for back in range(waves.SEEN):
            a = np.zeros(body.size, dtype=np.complex128)
            a[body.own] = self.places(np.exp((steps - back) * body.log))
            if back == 0:
                amplitudes = a.reshape(-1, body.slots)
                rows[: len(amplitudes), 0] = flushed(amplitudes.real)
                rows[: len(amplitudes), 1] = flushed(amplitudes.imag)
            a[body.own] *= body.radial
            seen = a.reshape(-1, body.slots).sum(axis=0)
            rows[(step - back) % waves.SEEN - waves.SEEN] = seen.real, seen.imag
        return np.zeros(0), np.zeros(0)


class FreeWaves:
    """Waves of a rotor in the state of the kernel `waves`.

    Attributes
    ----------
    own : (w,), indices of the waves among (rows, slots)
    log, radius : (w,), log z and |z|
    decays : whether all motion that contact can cause dies out
    radial : (w,), gap that a unit amplitude opens
    form : (slots, rows, rows), J, upper triangles: energy Re(a* form a) of a slot
    """

    def __init__(self, rotor: WaveRotor, slots: int) -> None:
        items = unpacked(rotor.items, waves.ITEMS)
        self.slots, self.size = slots, items.shape[1]
        self.own = np.flatnonzero(items.any(axis=0))
        chosen = items[:, self.own]
        ahead = chosen[waves.AHEAD_RE] + 1j * chosen[waves.AHEAD_IM]
        self.decays = all_die_out(items)
        self.log = np.log1p(ahead)
        self.radius = np.exp(self.log.real)
        self.radial = chosen[waves.RADIAL]
        rows = self.size // slots
        parts = rotor.form.reshape(-1, 2, slots)
        self.form = np.zeros((slots, rows, rows), dtype=np.complex128)
        upper = np.triu_indices(rows)
        self.form[:, upper[0], upper[1]] = (parts[:, 0] + 1j * parts[:, 1]).T

    def motion(self, state: Floats, _: int) -> WavesMotion:
        """Return the free motion from a state without a pending step."""
        parts = state[: 2 * self.size].reshape(-1, 2, self.slots)
        a = (parts[:, 0] + 1j * parts[:, 1]).ravel()[self.own]
        return WavesMotion(np.abs(a), a, self)
