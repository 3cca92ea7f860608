"""The certificate and the later motion in closed form, with both bodies as waves.

In free motion a step multiplies the complex amplitude of each wave by z, so that its
magnitude |z|^n |a| bounds what it contributes to any gap later. The energy is a
quadratic form of the amplitudes; the damping loss is its decrease.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from hpcwhirl.arrays import Complexes, Floats
from hpcwhirl.dynamics.free_motion import BLOCK, Start
from hpcwhirl.dynamics.kernels import contact
from hpcwhirl.dynamics.kernels.contact import TINY
from hpcwhirl.dynamics.kernels.kernel_types import Arrays, CyclicState, Strides, Tracks
from hpcwhirl.dynamics.waves.flights import die_out
from hpcwhirl.dynamics.waves.point_arrays import Reads
from hpcwhirl.dynamics.waves.point_waves import real_rows


class FreePoints:
    """The certificate of a march of the kernel `points`, and its motion after it.

    reads : waves of both bodies, and how they move the contact points
    arrays : the kernel's constant arrays
    """

    def __init__(self, reads: Reads, arrays: Arrays) -> None:
        self.reads, self.waves, self.rotor = reads, reads.waves, arrays.rotor
        bodies = self.waves.rotor, self.waves.casing, self.waves.steady
        self.ahead = np.concatenate([body.ahead for body in bodies])
        self.log = np.log1p(self.ahead)

    @property
    def possible(self) -> bool:
        """Whether all free motion decays to zero, as a certificate requires.

        It is not known where the supports differ by direction or have a film.
        """
        pushed = self.reads.push()[: len(self.reads.out)]
        return not len(self.rotor.support.which) and die_out(self.ahead, pushed)

    def amplitudes(self, state: CyclicState) -> Complexes:
        """Return the complex amplitudes of all waves in a state, (waves,)."""
        own, half = self.waves.index, self.waves.half
        return np.asarray(state.rotor[own] + 1j * state.rotor[half + own])

    def bound(self, state: CyclicState) -> tuple[Floats, Floats]:
        """Return a bound of all later motion: amplitudes in the gaps, and their decay.

        Returns
        -------
        sizes : (P, waves), m; the sum of a row bounds the change of the point's gap,
            which is 0 for a lost blade
        decays : (waves,), factor by which a step multiplies each column of `sizes`
        """
        sizes = self._opens * np.abs(self.amplitudes(state))
        return sizes, np.exp(self.log.real)

    def farthest(self, state: CyclicState) -> float:
        """Return a bound of the magnitude of all later displacements of any tip, m."""
        moved = np.hypot(*(np.abs(rows) for rows in self._tips))
        return float((moved @ np.abs(self.amplitudes(state))).max(initial=0.0))

    @cached_property
    def _opens(self) -> Floats:
        """Magnitude of the change of each point's gap, (P, waves), by unit amplitudes.

        It is 0 for the points of a lost blade.
        """
        reads = self.reads
        lost = np.abs(reads.out).max(axis=1, initial=0.0) == 0.0
        opens = np.abs(reads.read(reads.out, reads.w))
        return np.where(lost[:, None], 0.0, opens)

    @cached_property
    def _tips(self) -> tuple[Complexes, Complexes]:
        """Radial and tangential displacement of the points, (P, waves), by waves."""
        reads, still = self.reads, np.zeros_like(self.reads.w)
        return reads.read(-reads.out, still), reads.read(-reads.side, still)

    @cached_property
    def _hub(self) -> Complexes:
        return self.reads.at_centre()

    def finish(
        self, state: CyclicState, tracks: Tracks, total: int, strides: Strides
    ) -> None:
        """Complete a certified march in closed form: state, traces and evidence.

        Parameters
        ----------
        state : state at a step with a row of evidence, after which no contact occurs;
            replaced by that at the end
        tracks : samples and rows of evidence of the march, completed here
        total : number of steps of the whole run
        strides : steps between samples of the traces, and between rows of evidence
        """
        counter, begun = state.counter, self.amplitudes(state)
        start = Start.of(state, tracks)
        for slot, stride, write in (
            (contact.SAMPLE, strides.traces, self._keep),
            (contact.JUDGED, strides.evidence, self._judge),
        ):
            first, ahead = int(counter[slot]), start.ahead(total, stride)
            for at in range(0, len(ahead), BLOCK):
                steps = ahead[at : at + BLOCK]
                a = begun * np.exp(np.outer(steps, self.log))
                where = slice(first + at, first + at + len(steps))
                write(a, start, Tracks._make(track[where] for track in tracks))
            counter[slot] += len(ahead)
        last = begun * np.exp((total - start.step) * self.log)
        own, half = self.waves.index, self.waves.half
        state.rotor[own], state.rotor[half + own] = map(flushed, (last.real, last.imag))
        counter[contact.STEP] = total

    def energies(self, a: Complexes) -> tuple[Floats, Floats]:
        """Return the energies of rotor and casing at some samples, (samples,) each, J.

        a : (samples, waves), complex amplitudes
        """
        ends = np.cumsum([len(self.waves.rotor.ahead), len(self.waves.casing.ahead)])
        out = []
        bodies = self.waves.rotor, self.waves.casing
        for body, part in zip(bodies, np.split(a, ends, axis=1)[:2], strict=True):
            q = np.hstack([part.real, part.imag])
            out.append(((q @ body.form) * q).sum(axis=1))
        return out[0], out[1]

    def _judge(self, a: Complexes, start: Start, tracks: Tracks) -> None:
        """Write the rows of evidence of a free motion to `tracks`.

        a, start : (rows, waves), amplitudes; state at which the motion begins
        tracks : only the rows to be written
        """
        rows, begun = tracks.evidence, start.row
        rows[:, : contact.AT_Y + 1] = (a @ self._hub.T).real
        rotor, casing = self.energies(a)
        rows[:, contact.OF_ROTOR], rows[:, contact.OF_CASING] = rotor, casing
        rows[:, contact.WAS_FED] = begun[contact.WAS_FED]
        rows[:, contact.WAS_RUBBED] = begun[contact.WAS_RUBBED]
        rows[:, contact.WAS_LOST] = start.to_lose - (rotor + casing)

    def _keep(self, a: Complexes, start: Start, tracks: Tracks) -> None:
        """Write the samples of the traces of a free motion to `tracks`.

        a, start : (samples, waves), amplitudes; state at which the motion begins
        tracks : only the samples to be written
        """
        tracks.centre[:] = (a @ self._hub.T).real
        tracks.energy[:] = sum(self.energies(a))
        tracks.lost[:] = start.to_lose - tracks.energy
        tracks.impulse[:] = start.impulse
        tracks.fed[:] = start.row[contact.WAS_FED]
        tracks.rubbed[:] = start.row[contact.WAS_RUBBED]
        if len(tracks.tips) > 0:
            for direction, rows in enumerate(self._tips):
                tracks.tips[:, :, direction] = (a @ rows.T).real
            tracks.blade_impulse[:] = start.blades
        if len(tracks.casing) > 0:
            ends = np.cumsum(
                [len(self.waves.rotor.ahead), len(self.waves.casing.ahead)]
            )
            part = np.split(a, ends, axis=1)[1]
            q = np.hstack([part.real, part.imag])
            tracks.casing[:] = q @ real_rows(self.waves.casing.shapes).T


def flushed(values: Floats) -> Floats:
    """Return numbers with those of magnitude below 1e-150 set to 0, as kernels do."""
    return np.where(np.abs(values) < TINY, 0.0, values)
