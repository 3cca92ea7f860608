"""The certificate that no blade touches again, and the later motion in closed form.

In free motion the amplitude of each mode after n steps is a sum of terms z^n, z the
roots of the time step (`free_modes`, `free_waves`). Their magnitudes bound all later
displacements; if the bound is below the gap, no contact can recur.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from hpcwhirl.arrays import Complexes, Floats, Integers
from hpcwhirl.dynamics.free_modes import FreeModes, ModesMotion
from hpcwhirl.dynamics.free_motion import BLOCK, Start
from hpcwhirl.dynamics.free_waves import WavesMotion, free_rotor
from hpcwhirl.dynamics.kernels import contact, passes
from hpcwhirl.dynamics.kernels.flight import LESS
from hpcwhirl.dynamics.kernels.kernel_types import CyclicState, Strides, Tracks
from hpcwhirl.dynamics.schemes.rotating_frame import RotatingFrame


class _Motion(NamedTuple):
    """Free motion of rotor and ring after n steps, by factors z^n of modes or waves.

    Attributes
    ----------
    rotor, ring : free motion of each body, of its modes or, of a rotor, its waves
    log : (modes,), log z of the rotor's modes, followed by the ring's
    """

    rotor: ModesMotion | WavesMotion
    ring: ModesMotion
    log: Complexes

    def parts(self, z: Complexes) -> tuple[Complexes, Complexes]:
        """Split the factors z^n of all modes into those of rotor and ring.

        z : (samples, modes), the rotor's modes first
        """
        count = len(self.rotor.most)
        return z[:, :count], z[:, count:]

    def energies(self, z: Complexes) -> tuple[Floats, Floats]:
        """Return the energies of rotor and of ring in free motion, (samples,) each, J.

        z : (samples, modes), factors z^n of all modes, the rotor's first
        """
        rotor, ring = self.parts(z)
        return self.rotor.energies(rotor), self.ring.energies(ring)


class FreeDecay:
    """The certificate of a march, and its remaining motion in closed form.

    scheme : integrator of central differences, in the rotating frame
    """

    def __init__(self, scheme: RotatingFrame) -> None:
        blades, step = scheme.model.blades, scheme.scene.solver.time_step
        self.ended = scheme.ended
        self.rotor, self.shapes = free_rotor(scheme.arrays, blades, step)
        self.ring_items = passes.unpacked(scheme.arrays.casing.items)
        self.ring = FreeModes(self.ring_items, self.ring_items.shape[1], step)

    @property
    def possible(self) -> bool:
        """Whether all free motion decays to zero, as a certificate requires."""
        return self.rotor.decays and self.ring.decays

    def motion(self, state: CyclicState) -> _Motion:
        """Return the motion without contact that starts from a state of the march."""
        step = int(state.counter[contact.STEP])
        s_b, s_c, _, _ = self.ended(state)
        log = np.concatenate([self.rotor.log, self.ring.log])
        return _Motion(self.rotor.motion(s_b, step), self.ring.motion(s_c, step), log)

    def bound(self, state: CyclicState) -> tuple[Floats, Floats]:
        """Return a bound of all later motion: amplitudes at the tips and their decay.

        Returns
        -------
        sizes : (N, modes), or (1, modes) if it is equal for all blades, m; the sum of a
            row bounds the radial displacement of the blade's tip relative to the ring
        decays : (modes,), factor by which a step multiplies each column of `sizes`
        """
        motion, reach = self.motion(state), self.shapes.reach
        ring = np.tile(self.ring.roots.weight, (len(reach), 1))
        sizes = [reach * motion.rotor.most, ring * motion.ring.most]
        return np.hstack(sizes), np.concatenate([self.rotor.radius, self.ring.radius])

    def farthest(self, state: CyclicState) -> float:
        """Return a bound of the magnitude of all later displacements of any tip, m."""
        return float((self._moved @ self.motion(state).rotor.most).max(initial=0.0))

    @cached_property
    def _moved(self) -> Floats:
        """Magnitude of each tip's displacement, (N, modes), m, for unit amplitudes."""
        return np.hypot(np.abs(self.shapes.radial), np.abs(self.shapes.tangential))

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
        motion, counter = self.motion(state), state.counter
        settled = self.ended(state)
        start = Start.of(state, tracks)
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
        """Return the centre's x_o, y_o, (samples, 2), m, in a free motion.

        They are in the rotating frame; z : (samples, modes), factors z^n of all modes
        """
        swing = motion.rotor.swing(self.shapes.hub)
        return np.asarray((motion.parts(z)[0] @ swing).real)

    def _judge(
        self, motion: _Motion, z: Complexes, _: Integers, start: Start,
        tracks: Tracks,
    ) -> None:  # fmt: skip
        """Write the rows of evidence of a free motion to `tracks`, in closed form.

        motion, start : free motion, and the state at which it begins
        z : (rows, modes), factors z^n of all modes, n steps after the start
        tracks : only the rows to be written
        """
        rows, begun = tracks.evidence, start.row
        rows[:, : contact.AT_Y + 1] = self._centre(motion, z)
        rotor, ring = motion.energies(z)
        rows[:, contact.OF_ROTOR], rows[:, contact.OF_CASING] = rotor, ring
        rows[:, contact.WAS_FED] = begun[contact.WAS_FED]
        rows[:, contact.WAS_RUBBED] = begun[contact.WAS_RUBBED]
        rows[:, contact.WAS_LOST] = start.to_lose - (rotor + ring)

    def _keep(
        self, motion: _Motion, z: Complexes, steps: Integers, start: Start,
        tracks: Tracks,
    ) -> None:  # fmt: skip
        """Write the samples of the traces of a free motion to `tracks`, in closed form.

        motion, start : free motion, and the state at which it begins
        z : (samples, modes), factors z^n of all modes
        steps : (samples,), numbers n of steps after the start
        tracks : only the samples to be written
        """
        tracks.centre[:] = self._centre(motion, z)
        tracks.energy[:] = sum(motion.energies(z))
        tracks.lost[:] = start.to_lose - tracks.energy
        tracks.impulse[:] = start.impulse
        tracks.fed[:] = start.row[contact.WAS_FED]
        tracks.rubbed[:] = start.row[contact.WAS_RUBBED]
        if len(tracks.tips) > 0:
            places = motion.rotor.places(motion.parts(z)[0])
            for direction, shape in enumerate(self.shapes[:2]):
                tracks.tips[:, :, direction] = (places @ shape.T).real
            tracks.blade_impulse[:] = start.blades
        if len(tracks.casing) > 0:
            tracks.casing[:] = self._ring(motion, z, steps)

    def _ring(self, motion: _Motion, z: Complexes, steps: Integers) -> Floats:
        """Return the ring's amplitudes in a free motion, as the kernel stores them.

        They are (samples, 2 size), real parts, then imaginary parts, in the rotating
        frame.

        z : (samples, modes), factors z^n of all modes
        steps : (samples,), numbers n of steps after the start
        """
        q = motion.ring.places(motion.parts(z)[1])
        q = q * np.exp(1j * np.outer(steps, self.ring.spin))
        copies = np.zeros((len(z), 2, self.ring.size))
        copies[:, 0, self.ring.own], copies[:, 1, self.ring.own] = q.real, q.imag
        return copies.reshape(len(z), -1)

    def _leave(
        self, motion: _Motion, state: CyclicState, settled: Any, steps: int
    ) -> None:
        """Set the state of a march to that after `steps` further steps of free motion.

        It is the state that the kernel would have, with damping losses and step number.

        settled : rotor, ring and their sums of works, with all contact forces applied
        """
        _, _, state.sums_b[:], state.sums_c[:] = settled
        state.counter[contact.STEP] += steps
        step = int(state.counter[contact.STEP])
        ends = np.exp(np.outer([0, steps], motion.log))
        rotor, ring = motion.energies(ends)
        if isinstance(motion.rotor, WavesMotion):
            rotor = 0.0 * rotor  # loss of waves follows from their energy, see `waves`
        lost = (rotor[0] + ring[0]) - (rotor[1] + ring[1])
        bodies = (motion.rotor, state.rotor), (motion.ring, state.ring)
        last = [body.leave(array, steps, step) for body, array in bodies]
        rates, squares = map(np.concatenate, zip(*last, strict=True))
        state.sums_b[2 * len(state.sums_b) // 3] += float(lost) - float(rates @ squares)


def next_look(
    sizes: Floats, decays: Floats, gap: float, shortest: int, longest: int
) -> int:
    """Return after how many steps to search for a certificate again.

    It is the number of steps after which the bound of the tips' motion will be below
    the gap, if no contact occurs before. Only `shortest`, twice, four times it, ... are
    tried.

    Parameters
    ----------
    sizes, decays : results of `FreeDecay.bound`
    gap : m
    shortest, longest : least and largest result, numbers of steps
    """
    for _ in range(40):
        if shortest >= longest or (sizes @ decays**shortest).max() < LESS * gap:
            break
        shortest *= 2
    return min(shortest, longest)
