"""The certificate of a march, and its remaining motion in closed form."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.dynamics.certificate import LESS, roots_of
from hpcwhirl.dynamics.free_rotor import free_rotor
from hpcwhirl.dynamics.kernels import contact, passes
from hpcwhirl.dynamics.kernels.bodies import TINY
from hpcwhirl.dynamics.kernels.kernel_types import CyclicState, Strides, Tracks
from hpcwhirl.dynamics.schemes.integrator import Integrator
from hpcwhirl.errors import ModelError

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Integers = NDArray[np.int64]
SIGNS = (-1.0, 1.0)  # signs in alpha and beta = (A -+ i B) / 2
BLOCK = 256  # samples evaluated at once


@dataclass(frozen=True)
class _Motion:
    """Free motion of the modes of both bodies: q = alpha z^n + beta conj(z)^n.

    Attributes
    ----------
    alpha, beta : (modes,), coefficients of the amplitudes, rotor first
    gamma, delta : (modes,), those of the increments
    log : (modes,), log z
    omega : (modes,), rad/s
    step : s
    """

    alpha: Complexes
    beta: Complexes
    gamma: Complexes
    delta: Complexes
    log: Complexes
    omega: Floats
    step: float

    def at(self, steps: int) -> tuple[Complexes, Complexes]:
        """Return (q, d) after so many steps, (modes,) each.

        The ring's amplitudes are those of the rotating frame as it is at the start.
        """
        z = np.exp(steps * self.log)
        back = z.conj()
        return self.alpha * z + self.beta * back, self.gamma * z + self.delta * back

    def energies(self, z: Complexes, own: slice) -> Floats:
        """Return the energy of some modes, (samples,), J, as `modal_energy` defines it.

        z : (samples, modes), z^n of all modes
        own : the modes to sum over
        """
        z = z[:, own]
        a, b, c, d = self.alpha[own], self.beta[own], self.gamma[own], self.delta[own]
        kinetic, strain = 0.5 / self.step**2, 0.5 * self.omega[own] ** 2
        steady = kinetic * (np.abs(c) ** 2 + np.abs(d) ** 2)
        steady += strain * (np.abs(a) ** 2 + np.abs(b) ** 2)
        steady -= strain * (a * c.conj() + b * d.conj()).real
        beating = 2 * kinetic * c * d.conj() + 2 * strain * a * b.conj()
        beating -= strain * (a * d.conj() + b.conj() * c)
        return np.asarray(np.abs(z) ** 2 @ steady + (z**2 @ beating).real)


class _Start(NamedTuple):
    """State of a march where its closed form begins.

    Attributes
    ----------
    step : number of the step
    row : (COLUMNS,), row of evidence there
    impulse : N s, normal impulse of all contacts until then
    blades : (N,), N s, normal impulse of each blade
    """

    step: int
    row: Floats
    impulse: float
    blades: Floats

    @property
    def to_lose(self) -> float:
        """Energy lost so far plus remaining energy, J."""
        columns = contact.WAS_LOST, contact.OF_ROTOR, contact.OF_CASING
        return float(sum(self.row[column] for column in columns))

    def ahead(self, total: int, stride: int) -> Integers:
        """Return the numbers of steps from here to each sample up to step `total`."""
        first = self.step // stride + 1
        return np.arange(first, total // stride + 1) * stride - self.step


def _joined(parts: Sequence[Sequence[NDArray[Any]]]) -> list[NDArray[Any]]:
    """Return arrays of rotor and ring concatenated, for each kind of array."""
    return [np.concatenate(pair) for pair in zip(*parts, strict=True)]


class FreeDecay:
    """Certificate and closed form of one march.

    Parameters
    ----------
    scheme : integrator of central differences, in the rotating frame
    blades : number of blades that are marched
    step : s
    """

    def __init__(self, scheme: Integrator, blades: int, step: float) -> None:
        if scheme.ended is None:
            msg = "only steps of kernels in the frame that turns can be ended"
            raise ModelError(msg)
        self.ended = scheme.ended
        self.free = free_rotor(scheme.arrays, blades)
        self.step = step
        self.rotor_items = self.free.items
        self.ring_items = passes.unpacked(scheme.arrays.casing.items)
        self.rotor, self.ring = roots_of(self.rotor_items), roots_of(self.ring_items)

    @property
    def possible(self) -> bool:
        """Whether all free motion dies out, as a certificate requires."""
        return self.rotor.decays and self.ring.decays

    def _bodies(self, state: CyclicState) -> tuple[Complexes, ...]:
        """Return (q, d) of the rotor and of the ring, padding included, of a state."""
        odd = int(state.counter[contact.STEP]) & 1
        s_b, s_c, _, _ = self.ended(state)
        rotor = self.free.read(s_b)
        parts = s_c.reshape(3, 2, -1)
        ring = parts[:, 0] + 1j * parts[:, 1]
        return rotor[0], rotor[1 + odd], ring[0], ring[1 + odd]

    def bound(self, state: CyclicState) -> tuple[Floats, Floats]:
        """Return weighted amplitudes, (blades, modes), m, and their decay r per step.

        The sum of a row bounds every later radial displacement of a blade's tip against
        the ring. There is one row if it is the same for all blades.
        """
        reach = self.free.reach[:, self.rotor.own]
        weights = reach, np.tile(self.ring.weight, (len(reach), 1))
        sizes = [w * most for w, most in zip(weights, self._most(state), strict=True)]
        decays = np.concatenate([self.rotor.radius, self.ring.radius])
        return np.hstack(sizes), decays

    def _most(self, state: CyclicState) -> list[Floats]:
        """Return bounds of all later amplitudes of rotor and ring, (modes,) each."""
        q_b, d_b, q_c, d_c = self._bodies(state)
        bodies = ((self.rotor, q_b, d_b), (self.ring, q_c, d_c))
        waves = (roots.waves(q[roots.own], d[roots.own]) for roots, q, d in bodies)
        return [np.hypot(np.abs(a), np.abs(b)) for a, b in waves]

    def farthest(self, state: CyclicState) -> float:
        """Return a bound of the magnitude of all later displacements of tips, m."""
        radial, along = self.free.radial, self.free.tangential
        shapes = np.hypot(np.abs(radial), np.abs(along))[:, self.rotor.own]
        return float((shapes @ self._most(state)[0]).max(initial=0.0))

    def motion(self, state: CyclicState) -> _Motion:
        """Return the free motion that starts from a state."""
        q_b, d_b, q_c, d_c = self._bodies(state)
        bodies = ((self.rotor, q_b, d_b), (self.ring, q_c, d_c))
        owns = [(roots, q[roots.own], d[roots.own]) for roots, q, d in bodies]
        a, b = _joined([roots.waves(q, d) for roots, q, d in owns])
        c, d = _joined([roots.increments(q, d) for roots, q, d in owns])
        omega = _joined([
            (self.rotor_items[passes.OMEGA][self.rotor.own],),
            (self.ring_items[passes.OMEGA][self.ring.own],),
        ])[0]  # fmt: skip
        log = np.concatenate([self.rotor.log, self.ring.log])
        halves = [
            0.5 * (x + sign * 1j * y) for x, y in ((a, b), (c, d)) for sign in SIGNS
        ]
        return _Motion(
            halves[0], halves[1], halves[2], halves[3], log, omega, self.step
        )

    def finish(
        self, state: CyclicState, tracks: Tracks, total: int, strides: Strides
    ) -> None:
        """Complete a march from a row of evidence to its end, in closed form.

        Parameters
        ----------
        state : state at a step with a row of evidence, after which no contact occurs;
            set to that at the end
        tracks : samples of the march, filled to the end
        total : steps of the whole run
        strides : steps between samples of the traces, and between rows of evidence
        """
        motion, counter = self.motion(state), state.counter
        settled = self.ended(state)
        start = _Start(
            int(counter[contact.STEP]),
            tracks.evidence[counter[contact.JUDGED] - 1].copy(),
            float(state.ledger[contact.IMPULSE]),
            state.impulse.copy(),
        )
        for slot, stride, write in (
            (contact.SAMPLE, strides.traces, self._keep),
            (contact.JUDGED, strides.evidence, self._judge),
        ):
            first, ahead = int(counter[slot]), start.ahead(total, stride)
            inside = np.exp(np.outer(ahead[:BLOCK], motion.log))
            for begun in range(0, len(ahead), BLOCK):
                steps = ahead[begun : begun + BLOCK]
                z = inside[: len(steps)] * np.exp(stride * begun * motion.log)
                where = slice(first + begun, first + begun + len(steps))
                here = Tracks._make(track[where] for track in tracks)
                write(motion, z, steps, start, here)
            counter[slot] += len(ahead)
        self._leave(motion, state, settled, total - start.step)

    def _centre(self, motion: _Motion, z: Complexes) -> Floats:
        """Return the centre x_o, y_o, (samples, 2), m, rotating frame."""
        rotor_modes = len(self.rotor.own)
        hub = self.free.hub[:, self.rotor.own]
        swing = (
            hub.conj() * motion.alpha[:rotor_modes]
            + hub * motion.beta[:rotor_modes].conj()
        ).T
        return np.asarray((z[:, :rotor_modes] @ swing).real)

    def _energies(self, motion: _Motion, z: Complexes) -> tuple[Floats, Floats]:
        """Return the energies of rotor and ring, (samples,) each, J."""
        rotor_modes = len(self.rotor.own)
        return motion.energies(z, slice(rotor_modes)), motion.energies(
            z, slice(rotor_modes, None)
        )

    def _judge(
        self, motion: _Motion, z: Complexes, _: Integers, start: _Start,
        tracks: Tracks,
    ) -> None:  # fmt: skip
        """Write rows of evidence to the tracks."""
        rows, begun = tracks.evidence, start.row
        rows[:, : contact.AT_Y + 1] = self._centre(motion, z)
        rotor, ring = self._energies(motion, z)
        rows[:, contact.OF_ROTOR], rows[:, contact.OF_CASING] = rotor, ring
        rows[:, contact.WAS_FED] = begun[contact.WAS_FED]
        rows[:, contact.WAS_RUBBED] = begun[contact.WAS_RUBBED]
        rows[:, contact.WAS_LOST] = start.to_lose - (rotor + ring)

    def _keep(
        self, motion: _Motion, z: Complexes, steps: Integers, start: _Start,
        tracks: Tracks,
    ) -> None:  # fmt: skip
        """Write samples of the traces to the tracks.

        steps : (samples,), numbers of steps after the start
        """
        tracks.centre[:] = self._centre(motion, z)
        rotor, ring = self._energies(motion, z)
        tracks.energy[:] = rotor + ring
        tracks.lost[:] = start.to_lose - tracks.energy
        tracks.impulse[:] = start.impulse
        tracks.fed[:] = start.row[contact.WAS_FED]
        tracks.rubbed[:] = start.row[contact.WAS_RUBBED]
        if len(tracks.tips) > 0:
            rotor_modes = len(self.rotor.own)
            q = (
                motion.alpha[:rotor_modes] * z[:, :rotor_modes]
                + motion.beta[:rotor_modes] * z[:, :rotor_modes].conj()
            )
            tracks.tips[:] = self._tips(q)
            tracks.blade_impulse[:] = start.blades
            tracks.casing[:] = self._ring(motion, z, steps)

    def _ring(self, motion: _Motion, z: Complexes, steps: Integers) -> Floats:
        """Return the ring's amplitudes as the kernel copies them, (samples, 2 size)."""
        modes, free = self.ring.own, slice(len(self.rotor.own), None)
        q = motion.alpha[free] * z[:, free] + motion.beta[free] * z[:, free].conj()
        spin = self.ring_items[passes.SPIN][modes] * self.step
        q *= np.exp(1j * np.outer(steps, spin))
        copies = np.zeros((len(z), 2, self.ring_items.shape[1]))
        copies[:, 0, modes], copies[:, 1, modes] = q.real, q.imag
        return copies.reshape(len(z), -1)

    def _tips(self, q: Complexes) -> Floats:
        """Return radial and tangential tip displacements, (samples, N, 2), m.

        q : (samples, modes), amplitudes of the rotor
        """
        shapes = (
            rows[:, self.rotor.own] for rows in (self.free.radial, self.free.tangential)
        )
        return np.stack([(q @ shape.T).real for shape in shapes], axis=-1)

    def _leave(
        self, motion: _Motion, state: CyclicState, settled: Any, steps: int
    ) -> None:
        """Set the state to that after `steps` steps, with the last step not yet booked.

        This is how the kernel leaves a state.
        """
        counter, rotor_modes = state.counter, self.rotor.own
        counter[contact.STEP] += steps
        odd = int(counter[contact.STEP]) & 1
        (q, d), (_, old) = motion.at(steps), motion.at(steps - 1)
        rotor, ring = self._energies(motion, np.exp(np.outer([0, steps], motion.log)))
        rate = np.concatenate([
            self.rotor_items[passes.RATE][rotor_modes],
            self.ring_items[passes.RATE][self.ring.own],
        ])  # fmt: skip
        waits = float(rate @ np.abs(d + old) ** 2)
        _, _, state.sums_b[:], state.sums_c[:] = settled
        lost = (rotor[0] + ring[0]) - (rotor[1] + ring[1])
        state.sums_b[2 * len(state.sums_b) // 3] += float(lost) - waits
        spin = self.ring_items[passes.SPIN][self.ring.own] * self.step
        now, then = np.exp(1j * spin * steps), np.exp(1j * spin * (steps - 1))
        for place, values, turn in (
            (0, q, now),
            (1 + odd, d, now),
            (2 - odd, old, then),
        ):
            self._put(
                state,
                place,
                values[: len(rotor_modes)],
                values[len(rotor_modes) :] * turn,
            )

    def _put(
        self, state: CyclicState, place: int, rotor: Complexes, ring: Complexes
    ) -> None:
        """Write amplitudes or increments, (modes,) of each body, to the state."""
        whole = np.zeros(self.free.items.shape[1], dtype=complex)
        whole.real[self.rotor.own] = flushed(rotor.real)
        whole.imag[self.rotor.own] = flushed(rotor.imag)
        self.free.write(state.rotor, place, whole)
        for part, values in enumerate((ring.real, ring.imag)):
            row = state.ring.reshape(3, 2, -1)[place, part]
            row[:] = 0.0
            row[self.ring.own] = flushed(values)


def flushed(values: Floats) -> Floats:
    """Return values with those below 1e-150 set to zero, as in the kernels."""
    return np.where(np.abs(values) < TINY, 0.0, values)


def next_look(
    sizes: Floats, decays: Floats, gap: float, shortest: int, longest: int
) -> int:
    """Return the steps until the bound falls below the gap, if no contact occurs.

    The result lies within `shortest` .. `longest`.

    sizes, decays : results of `FreeDecay.bound`
    """
    for _ in range(40):
        if shortest >= longest or (sizes @ decays**shortest).max() < LESS * gap:
            break
        shortest *= 2
    return min(shortest, longest)
