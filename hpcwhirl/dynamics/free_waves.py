"""Free motion of a rotor as waves: a step multiplies the amplitude a of each by z.

So |a| is multiplied by |z|. The circular orbit of an unbalanced rotor is a wave that is
at rest in the rotating frame, z = 1, and is not excited by contact. Jacobi's energy is
a quadratic form of the amplitudes, for equal sectors of each nodal diameter separately.
The damping loss is the decrease of this energy, so that it needs no separate account.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hpcwhirl.arrays import Complexes, Floats, Indices
from hpcwhirl.dynamics.flights import all_die_out
from hpcwhirl.dynamics.free_modes import FreeModes, flushed
from hpcwhirl.dynamics.kernels import passes, waves
from hpcwhirl.dynamics.kernels.cyclic import widths
from hpcwhirl.dynamics.kernels.kernel_types import Arrays
from hpcwhirl.dynamics.kernels.wave_types import WaveRotor
from hpcwhirl.dynamics.turning_waves import unpacked


@dataclass(frozen=True)
class WavesMotion:
    """Free motion of a rotor's waves from a given state, at any number n of steps.

    A step multiplies the complex amplitude a of each wave by its factor z.

    Attributes
    ----------
    most : (waves,), bounds of |a| at all later steps
    amplitudes : (waves,), a_0 at the start, n = 0
    body : the waves, by nodal diameter
    """

    most: Floats
    amplitudes: Complexes
    body: FreeWaves

    def places(self, z: Complexes) -> Complexes:
        """Return the complex amplitudes a = z^n a_0 of the waves at some samples.

        z : (samples, waves), z^n after the n steps of each sample; so is the result
        """
        return self.amplitudes * z

    def swing(self, rows: Complexes) -> Complexes:
        """Return factors f, (waves, r), by which r displacements are Re(f^T z^n), m.

        z^n are the factors of the waves after n steps.

        rows : (r, waves), which give the r displacements Re(conj(rows) a) from
            amplitudes a
        """
        return (rows.conj() * self.amplitudes).T

    def energies(self, z: Complexes) -> Floats:
        """Return the rotor's energy at some samples, (samples,), J.

        z : (samples, waves), z^n after the n steps of each sample
        """
        return self.body.energies(self.places(z))

    def leave(self, state: Floats, steps: int, step: int) -> tuple[Floats, Floats]:
        """Set a kernel's state to the rotor's motion after `steps` free steps.

        The rates and squares returned, from which a loss would follow (see
        `free_modes.ModesMotion.leave`), are empty: for waves it follows from the
        energy.

        Parameters
        ----------
        state : state of the rotor in the kernel, set here
        steps, step : number of steps since the start of this motion and of the march
        """
        back = np.arange(self.body.seen)
        past = self.places(np.exp(np.outer(steps - back, self.body.log)))
        self.body.write(past, state, step)
        return np.zeros(0), np.zeros(0)


class FreeWaves:
    """Waves of a rotor of equal sectors, as they are stored by the kernel `waves`.

    Row f of its state has the f-th wave of each slot (nodal diameter). The state also
    has the spectra of the gaps of the last `waves.SEEN` steps.

    Attributes
    ----------
    own : (waves,), indices of the waves in arrays (rows, slots), flat; the rest is
        padding
    log, radius : (waves,), log z and |z|, z the factor of an amplitude in a step
    decays : whether all motion that contact can cause decays to zero
    radial : (waves,), change of gap by a unit amplitude
    form : (slots, rows, rows), J, upper triangles: the energy of a nodal diameter is
        Re(a* form a), a its amplitudes, a* their conjugates
    seen : number of last steps of which a state holds amplitudes or spectra
    """

    seen = waves.SEEN

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

    def energies(self, a: Complexes) -> Floats:
        """Return the rotor's energy at some samples, (samples,), J.

        a : (samples, waves), complex amplitudes
        """
        slots, rows, _ = self.form.shape
        every = np.zeros((len(a), rows * slots), dtype=np.complex128)
        every[:, self.own] = a
        apart = every.reshape(-1, rows, slots).transpose(2, 0, 1)
        pair = apart @ self.form.transpose(0, 2, 1)
        return np.asarray((apart.conj() * pair).real.sum(axis=(0, 2)))

    def write(self, past: Complexes, state: Floats, step: int) -> None:
        """Write amplitudes of waves, and spectra of their gaps, to a kernel's state.

        past : (seen, waves), complex amplitudes at `step` and at the steps before it
        state : state of the rotor in the kernel `waves`, set here
        """
        rows = state.reshape(-1, 2, self.slots)
        rows[:] = 0.0
        for back, values in enumerate(past):
            a = np.zeros(self.size, dtype=np.complex128)
            a[self.own] = values
            if back == 0:
                amplitudes = a.reshape(-1, self.slots)
                rows[: len(amplitudes), 0] = flushed(amplitudes.real)
                rows[: len(amplitudes), 1] = flushed(amplitudes.imag)
            a[self.own] *= self.radial
            seen = a.reshape(-1, self.slots).sum(axis=0)
            rows[(step - back) % waves.SEEN - waves.SEEN] = seen.real, seen.imag

    def motion(self, state: Floats, _: int) -> WavesMotion:
        """Return the free motion that starts from a kernel's state.

        state : state of the rotor, after the last step's contact forces
        """
        parts = state[: 2 * self.size].reshape(-1, 2, self.slots)
        a = (parts[:, 0] + 1j * parts[:, 1]).ravel()[self.own]
        return WavesMotion(np.abs(a), a, self)


class Shapes(NamedTuple):
    """Displacements of a rotor's tips and centre, m, for complex amplitudes q.

    The amplitudes are those of modes by nodal diameter, or of waves.

    Attributes
    ----------
    radial, tangential : (N, modes), displacement of a blade is Re(q @ row), row that of
        the blade
    hub : (2, modes), x_o, y_o = Re(conj(hub) q)
    reach : (N, modes), |radial|; (1, modes) if it is equal for all blades
    """

    radial: Complexes
    tangential: Complexes
    hub: Complexes
    reach: Floats


def free_rotor(
    arrays: Arrays, blades: int, step: float
) -> tuple[FreeModes | FreeWaves, Shapes]:
    """Return a rotor's law of free motion, and its tips' and centre's displacements.

    Parameters
    ----------
    arrays : constant arrays of a kernel in the rotating frame
    blades : number of blades that are integrated
    step : dt, s
    """
    body: FreeModes | FreeWaves
    slots, _ = widths(blades)
    if isinstance(arrays.rotor, WaveRotor):
        body = FreeWaves(arrays.rotor, slots)
        pairs = arrays.rotor.along.reshape(-1, 2, slots)
        along = (pairs[:, 0] + 1j * pairs[:, 1]).ravel()
        radial = unpacked(arrays.rotor.items, waves.ITEMS)[waves.RADIAL]
    else:
        parts = passes.unpacked(arrays.rotor.items).reshape(passes.ITEMS, -1, 2, slots)
        items = parts[:, :, 0].reshape(passes.ITEMS, -1)
        body = FreeModes(items, slots, step)
        along = items[passes.SR] + 1j * items[passes.SI]
        radial = items[passes.RADIAL]
    columns = arrays.contact.turns.reshape(blades, 2 * slots)
    turned = columns[:, :slots] - 1j * columns[:, slots:]
    turned = turned[:, np.arange(len(radial)) % slots]
    axes = arrays.rotor.hub.reshape(2, -1, 2, slots)
    hub = (axes[:, :, 0] + 1j * axes[:, :, 1]).reshape(2, -1)
    shapes = Shapes(-radial * turned, -along * turned, hub, np.abs(radial)[None])
    return body, _chosen(shapes, body.own)


def _chosen(shapes: Shapes, own: Indices) -> Shapes:
    return Shapes._make(rows[:, own] for rows in shapes)
