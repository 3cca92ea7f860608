"""What a free motion is made of: waves of equal sectors by slot, or waves by point."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.sparse import csr_array

from hpcwhirl.arrays import Floats, Integers
from hpcwhirl.dynamics.kernels.kernel_types import CyclicState
from hpcwhirl.dynamics.kernels.loop.wave_types import SlotRotor
from hpcwhirl.dynamics.kernels.vectors import FOUR
from hpcwhirl.dynamics.waves.free_motion import FreeMotion, Moved
from hpcwhirl.dynamics.waves.point_arrays import Reads
from hpcwhirl.dynamics.waves.slot_waves import SlotPlaces, SlotWaves
from hpcwhirl.dynamics.waves.slots import blade_waves

Settled = Callable[[CyclicState], None]


def free_points(reads: Reads) -> FreeMotion:
    """Return the free motion of waves with rows of points.

    reads : waves of both bodies, and how they move the contact points
    """
    waves, still = reads.waves, np.zeros_like(reads.w)
    bodies = waves.rotor, waves.casing, waves.steady
    sizes = [len(body.ahead) for body in bodies]
    lost = np.abs(reads.out).max(axis=1, initial=0.0) == 0.0
    reach = np.where(lost[:, None], 0.0, np.abs(reads.by_waves(reads.out, reads.w)))
    radial, along = (reads.by_waves(-rows, still) for rows in (reads.out, reads.side))
    none = np.zeros((waves.casing.shapes.shape[0], sizes[0])), waves.casing.shapes
    casing = np.hstack([*none, np.zeros((len(none[0]), sizes[2]))])
    moved = Moved(
        reach, np.hypot(np.abs(radial), np.abs(along)), radial, along,
        reads.at_centre(), casing,
    )  # fmt: skip
    ends = np.cumsum([0, *sizes])
    forms = [
        _placed(body.form, np.arange(first, last), ends[-1])
        for body, first, last in zip(bodies[:2], ends, ends[1:], strict=False)
    ]
    return FreeMotion(
        waves.index, waves.half, np.concatenate([body.ahead for body in bodies]),
        reads.push()[: len(reads.out)], moved, (forms[0], forms[1]), _nothing,
    )  # fmt: skip


def _nothing(_: CyclicState) -> None:
    """Set nothing: a state with rows of points has its amplitudes alone."""


def _placed(form: Floats, at: Integers, waves: int) -> Any:
    """Return a body's energy as a form of all waves, sparse, (2 waves, 2 waves).

    form : (2 w, 2 w), J, of re, then im, of its own w waves
    at : (w,), numbers of these among all waves
    """
    whole = np.append(at, waves + at)
    row, column = np.nonzero(form)
    entries = form[row, column], (whole[row], whole[column])
    return csr_array(entries, shape=(2 * waves, 2 * waves))


def free_slots(
    bodies: tuple[SlotWaves, SlotWaves],
    at: SlotPlaces,
    arrays: SlotRotor,
    blades: int,
    settled: Settled,
) -> FreeMotion:
    """Return the free motion of the waves of equal sectors, by slot.

    bodies, at : waves of rotor and casing, and their places among the amplitudes
    arrays, blades : the kernel's arrays of both bodies; N
    settled : see `FreeMotion`
    """
    rotor, ring = bodies
    own, beside = np.nonzero(rotor.there), np.nonzero(ring.there)
    index = np.concatenate([at.rotor_at(*own), at.ring_at(*beside)])
    ahead = np.append(rotor.ahead[own], ring.ahead[beside])
    push = np.append(rotor.push[own], ring.push[beside])
    forms = _products(rotor, 0, len(index)), _products(ring, len(own[0]), len(index))
    moved = _moved(bodies, index, arrays, blades)
    return FreeMotion(index, FOUR, ahead, push[None], moved, forms, settled)


def _moved(
    bodies: tuple[SlotWaves, SlotWaves], index: Integers, arrays: SlotRotor, blades: int
) -> Moved:
    """Return what the waves of equal sectors move.

    bodies, arrays, blades : as for `free_slots`
    index : (waves,), indices of re of the amplitudes
    """
    rotor, ring = bodies
    own, beside = np.nonzero(rotor.there), np.nonzero(ring.there)
    none = np.zeros((blades, len(beside[0])))
    radial, along = -rotor.radial[own], -rotor.along[own]
    turned = blade_waves(blades)[:, own[1]]
    hub = np.zeros((2, len(index)), dtype=complex)
    casing = np.zeros((len(arrays.modes), len(index)), dtype=complex)
    place = {int(at): n for n, at in enumerate(index)}
    for h, at in enumerate(arrays.centre):
        hub[:, place[int(at)]] = arrays.hub[:, h, 0] - 1j * arrays.hub[:, h, 1]
    for c, both in enumerate(arrays.modes):
        casing[c, [place[int(at)] for at in both]] = 1.0
    return Moved(
        np.abs(np.append(radial, ring.radial[beside]))[None],
        np.append(np.hypot(np.abs(radial), np.abs(along)), none[0])[None],
        np.hstack([radial * turned, none]), np.hstack([along * turned, none]), hub,
        np.stack([casing, -1j * casing], axis=1).reshape(-1, len(index)),
    )  # fmt: skip


def _products(body: SlotWaves, first: int, waves: int) -> Any:
    """Return a body's energy as a form of all waves, sparse, (2 waves, 2 waves).

    A product of waves f and g of a slot is Re(conj(a_f) c a_g).

    first, waves : number of its first one among all; how many these are
    """
    number = np.full(body.there.shape, -1)
    number[body.there] = first + np.arange(body.there.sum())
    values, rows, columns = ([np.zeros(0)] for _ in range(3))
    for (f, g), form in body.form.items():
        k = np.flatnonzero((number[f] >= 0) & (number[g] >= 0) & (form != 0.0))
        one, two, c = number[f, k], number[g, k], form[k]
        values.append(np.concatenate([c.real, c.real, -c.imag, c.imag]))
        rows.append(np.concatenate([one, waves + one, one, waves + one]))
        columns.append(np.concatenate([two, waves + two, waves + two, two]))
    at = (np.concatenate(part).astype(np.int64) for part in (rows, columns))
    return csr_array((np.concatenate(values), tuple(at)), shape=(2 * waves,) * 2)
