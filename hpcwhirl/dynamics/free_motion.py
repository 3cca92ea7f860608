"""The certificate that no blade touches again, and the later motion, of all waves.

Without contact each wave's amplitude after n steps is z^n a, z its factor in a step. So
|a| is multiplied by |z|, and the sum of |gamma a|, with gamma the change of a gap for
unit amplitude, bounds all later changes of that gap: if it is below the clearance, no
contact can recur. The motion that follows is z^n a. The damping loss is the decrease of
the energy, so that it needs no account of its own.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from hpcwhirl.arrays import Complexes, Floats, Integers
from hpcwhirl.dynamics.kernels import contact
from hpcwhirl.dynamics.kernels.kernel_types import CyclicState, Strides, Tracks
from hpcwhirl.dynamics.waves.flights import die_out

BLOCK = 256  # samples evaluated at once


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


@dataclass(frozen=True)
class FreeMotion:
    """The waves of both bodies in free motion, and what they move.

    Attributes
    ----------
    ahead : (waves,), z - 1, z the factor by which a step multiplies an amplitude
    push : (r, waves), change of the amplitudes by contact forces
    reach : (P, waves), or (1, waves) if it is equal for all blades: magnitude of the
        change of the gap for unit amplitude
    moved : likewise, magnitude of a tip's displacement
    radial, along : (P, waves), displacements of tips are Re(row a), m
    hub : (2, waves), x_o and y_o are Re(row a), m
    casing : (c, waves), the casing's complex amplitudes are row a; they are stored as
        re and im of each in turn
    read : state -> (waves,), amplitudes a
    write : state, (waves,) -> None: set the state to amplitudes at its step
    energies : (n, waves) -> energies of rotor and casing, (n,) each, J
    """

    ahead: Complexes
    push: Complexes
    reach: Floats
    moved: Floats
    radial: Complexes
    along: Complexes
    hub: Complexes
    casing: Complexes
    read: Callable[[CyclicState], Complexes]
    write: Callable[[CyclicState, Complexes], None]
    energies: Callable[[Complexes], tuple[Floats, Floats]]

    def store(self, a: Complexes, start: Start, tracks: Tracks) -> None:
        """Write samples of the traces of a free motion; a : (samples, waves)."""
        tracks.centre[:] = (a @ self.hub.T).real
        tracks.energy[:] = sum(self.energies(a))
        tracks.lost[:] = start.to_lose - tracks.energy
        tracks.impulse[:] = start.impulse
        tracks.fed[:] = start.row[contact.WAS_FED]
        tracks.rubbed[:] = start.row[contact.WAS_RUBBED]
        if len(tracks.tips) > 0:
            for direction, rows in enumerate((self.radial, self.along)):
                tracks.tips[:, :, direction] = (a @ rows.T).real
            tracks.blade_impulse[:] = start.blades
        if len(tracks.casing) > 0:
            y = a @ self.casing.T
            tracks.casing[:] = np.stack([y.real, y.imag], axis=-1).reshape(len(a), -1)

    def judge(self, a: Complexes, start: Start, tracks: Tracks) -> None:
        """Write the rows of evidence of a free motion; a : (rows, waves)."""
        rows, begun = tracks.evidence, start.row
        rows[:, : contact.AT_Y + 1] = (a @ self.hub.T).real
        rotor, casing = self.energies(a)
        rows[:, contact.OF_ROTOR], rows[:, contact.OF_CASING] = rotor, casing
        rows[:, contact.WAS_FED] = begun[contact.WAS_FED]
        rows[:, contact.WAS_RUBBED] = begun[contact.WAS_RUBBED]
        rows[:, contact.WAS_LOST] = start.to_lose - (rotor + casing)


class WaveDecay:
    """The certificate of a march of waves, and its remaining motion in closed form."""

    def __init__(self, free: FreeMotion) -> None:
        self.free, self.log = free, np.log1p(free.ahead)

    @property
    def possible(self) -> bool:
        """Whether all free motion decays to zero, as a certificate requires."""
        return die_out(self.free.ahead, self.free.push)

    def bound(self, state: CyclicState) -> tuple[Floats, Floats]:
        """Return a bound of all later motion: amplitudes at the tips and their decay.

        Returns
        -------
        sizes : (P, waves), or (1, waves) if it is equal for all blades, m; the sum of a
            row bounds the radial displacement of the blade's tip relative to the casing
        decays : (waves,), factor by which a step multiplies each column of `sizes`
        """
        return self.free.reach * np.abs(self.free.read(state)), np.exp(self.log.real)

    def farthest(self, state: CyclicState) -> float:
        """Return a bound of the magnitude of all later displacements of any tip, m."""
        return float((self.free.moved @ np.abs(self.free.read(state))).max(initial=0.0))

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
        a, counter = self.free.read(state), state.counter
        start = Start.of(state, tracks)
        for slot, stride, write in (
            (contact.SAMPLE, strides.traces, self.free.store),
            (contact.JUDGED, strides.evidence, self.free.judge),
        ):
            first, ahead = int(counter[slot]), start.ahead(total, stride)
            inside = a * np.exp(np.outer(ahead[:BLOCK], self.log))
            for begun in range(0, len(ahead), BLOCK):
                count = len(ahead[begun : begun + BLOCK])
                here = inside[:count] * np.exp(stride * begun * self.log)
                where = slice(first + begun, first + begun + count)
                write(here, start, Tracks._make(track[where] for track in tracks))
            counter[slot] += len(ahead)
        steps = total - start.step
        counter[contact.STEP] += steps
        self.free.write(state, a * np.exp(steps * self.log))
