"""The certificate that no blade touches again, and the later motion, of all waves.

Without contact each wave's amplitude after n steps is z^n a, z its factor in a step. So
|a| is multiplied by |z|, and the sum of |gamma a|, with gamma the change of a gap for
unit amplitude, bounds all later changes of that gap: if it is below the clearance, no
contact can recur. The motion that follows is z^n a. The damping loss is the decrease of
the energy, so that it needs no account of its own.

This is the closed form of all schemes whose state has waves, by slot or by point: where
they lie in the state, and what they move, is data.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from hpcwhirl.arrays import Complexes, Floats, Integers
from hpcwhirl.dynamics.kernels import contact
from hpcwhirl.dynamics.kernels.contact import TINY
from hpcwhirl.dynamics.kernels.kernel_types import CyclicState, Strides, Tracks
from hpcwhirl.dynamics.waves.flights import die_out

BLOCK = 256  # samples evaluated at once
FINE = 16  # samples between two whose factors are computed as exponentials


class Start(NamedTuple):
    """State of a march at the step from which it continues in closed form.

    Attributes
    ----------
    step : number of the step
    row : (COLUMNS,), the row of evidence at this step, see `kernels.contact`
    impulse : N s, normal impulse of all contacts so far
    blades : (N,), N s, normal impulse of each blade so far
    """

    step: int
    row: Floats
    impulse: float
    blades: Floats

    @classmethod
    def of(cls, state: CyclicState, tracks: Tracks) -> Start:
        """Return what a march is at a step with a row of evidence.

        state, tracks : of the march, which has just written this row
        """
        return cls(
            int(state.counter[contact.STEP]),
            tracks.evidence[state.counter[contact.JUDGED] - 1].copy(),
            float(state.ledger[contact.IMPULSE]),
            state.impulse.copy(),
        )

    @property
    def to_lose(self) -> float:
        """Energy dissipated so far plus the energy that is left at this step, J.

        In free motion energy only decreases by damping, so that this sum stays.
        """
        columns = contact.WAS_LOST, contact.OF_ROTOR, contact.OF_CASING
        return float(sum(self.row[column] for column in columns))

    def ahead(self, total: int, stride: int) -> Integers:
        """Return how many steps later each sample up to step `total` is taken.

        stride : steps between samples
        """
        first = self.step // stride + 1
        return np.arange(first, total // stride + 1) * stride - self.step


class Moved(NamedTuple):
    """What the waves of both bodies move, for unit amplitudes a: factors of Re(row a).

    Attributes
    ----------
    reach : (P, waves), or (1, waves) if it is equal for all blades: magnitude of the
        change of the gap; 0 for the points of a lost blade
    far : likewise, magnitude of a tip's displacement
    radial, along : (P, waves), displacements of the tips, m
    hub : (2, waves), x_o and y_o, m
    casing : (c, waves), the casing's coordinates as the kernel stores them
    """

    reach: Floats
    far: Floats
    radial: Complexes
    along: Complexes
    hub: Complexes
    casing: Complexes


@dataclass(frozen=True)
class FreeMotion:
    """The free motion of both bodies' waves: its certificate and its closed form.

    Attributes
    ----------
    index, apart : (waves,), indices of re of the amplitudes in the array `rotor` of the
        state; how far behind each the imaginary part lies
    ahead : (waves,), z - 1, z the factor by which a step multiplies an amplitude
    push : (r, waves), change of the amplitudes by contact forces
    moved : what the waves move
    forms : of rotor and casing, (2 waves, 2 waves), J, energy as a quadratic form of
        all re, then all im; arrays of SciPy, sparse
    settled : state -> None, sets what else a state has of its amplitudes
    """

    index: Integers
    apart: int
    ahead: Complexes
    push: Complexes
    moved: Moved
    forms: tuple[Any, Any]
    settled: Callable[[CyclicState], None]

    @cached_property
    def log(self) -> Complexes:
        """Logarithm of each wave's factor z, (waves,)."""
        return np.log1p(self.ahead)

    @property
    def possible(self) -> bool:
        """Whether all free motion decays to zero, as a certificate requires."""
        return die_out(self.ahead, self.push)

    def amplitudes(self, state: CyclicState) -> Complexes:
        """Return the complex amplitudes of all waves in a state, (waves,)."""
        q = state.rotor
        return np.asarray(q[self.index] + 1j * q[self.index + self.apart])

    def put(self, state: CyclicState, a: Complexes) -> None:
        """Set the amplitudes of all waves in a state, after free motion."""
        state.rotor[self.index] = _flushed(a.real)
        state.rotor[self.index + self.apart] = _flushed(a.imag)
        self.settled(state)

    def bound(self, state: CyclicState) -> tuple[Floats, Floats]:
        """Return a bound of all later motion: amplitudes in the gaps, and their decay.

        Returns
        -------
        sizes : (P, waves), or (1, waves) if it is equal for all blades, m; the sum of a
            row bounds the change of the point's gap
        decays : (waves,), factor by which a step multiplies each column of `sizes`
        """
        sizes = self.moved.reach * np.abs(self.amplitudes(state))
        return sizes, np.exp(self.log.real)

    def farthest(self, state: CyclicState) -> float:
        """Return a bound of the magnitude of all later displacements of any tip, m."""
        sizes = np.abs(self.amplitudes(state))
        return float((self.moved.far @ sizes).max(initial=0.0))

    def energies(self, a: Complexes) -> tuple[Floats, Floats]:
        """Return the energies of rotor and casing at some samples, (samples,) each, J.

        a : (samples, waves), complex amplitudes
        """
        q = np.hstack([a.real, a.imag])
        rotor, casing = (((q @ form) * q).sum(axis=1) for form in self.forms)
        return rotor, casing

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
        a, counter = self.amplitudes(state), state.counter
        start = Start.of(state, tracks)
        for slot, stride, write in (
            (contact.SAMPLE, strides.traces, self._store),
            (contact.JUDGED, strides.evidence, self._judge),
        ):
            first, ahead = int(counter[slot]), start.ahead(total, stride)
            inside = a * _powers(self.log, ahead[:BLOCK])
            for begun in range(0, len(ahead), BLOCK):
                count = len(ahead[begun : begun + BLOCK])
                here = inside[:count] * np.exp(stride * begun * self.log)
                where = slice(first + begun, first + begun + count)
                write(here, start, Tracks._make(track[where] for track in tracks))
            counter[slot] += len(ahead)
        steps = total - start.step
        counter[contact.STEP] += steps
        self.put(state, a * np.exp(steps * self.log))

    def _store(self, a: Complexes, start: Start, tracks: Tracks) -> None:
        """Write samples of the traces of a free motion; a : (samples, waves)."""
        tracks.centre[:] = (a @ self.moved.hub.T).real
        tracks.energy[:] = sum(self.energies(a))
        tracks.lost[:] = start.to_lose - tracks.energy
        tracks.impulse[:] = start.impulse
        tracks.fed[:] = start.row[contact.WAS_FED]
        tracks.rubbed[:] = start.row[contact.WAS_RUBBED]
        if len(tracks.tips) > 0:
            for axis, rows in enumerate((self.moved.radial, self.moved.along)):
                tracks.tips[:, :, axis] = (a @ rows.T).real
            tracks.blade_impulse[:] = start.blades
        if len(tracks.casing) > 0:
            tracks.casing[:] = (a @ self.moved.casing.T).real

    def _judge(self, a: Complexes, start: Start, tracks: Tracks) -> None:
        """Write the rows of evidence of a free motion; a : (rows, waves)."""
        rows, begun = tracks.evidence, start.row
        rows[:, : contact.AT_Y + 1] = (a @ self.moved.hub.T).real
        rotor, casing = self.energies(a)
        rows[:, contact.OF_ROTOR], rows[:, contact.OF_CASING] = rotor, casing
        rows[:, contact.WAS_FED] = begun[contact.WAS_FED]
        rows[:, contact.WAS_RUBBED] = begun[contact.WAS_RUBBED]
        rows[:, contact.WAS_LOST] = start.to_lose - (rotor + casing)


def _powers(log: Complexes, steps: Integers) -> Complexes:
    """Return z^n of waves for numbers of steps n at equal distances, (n, waves).

    Few are computed as exponentials; the others are products of two.

    log, steps : (waves,), logarithms of z; (n,)
    """
    coarse = np.exp(np.outer(steps[::FINE], log))
    fine = np.exp(np.outer(steps[:FINE] - steps[:1], log))
    found = coarse[:, None] * fine
    return np.asarray(found.reshape(-1, len(log))[: len(steps)])


def _flushed(values: Floats) -> Floats:
    """Return numbers with those of magnitude below 1e-150 set to 0, as kernels do."""
    return np.where(np.abs(values) < TINY, 0.0, values)
