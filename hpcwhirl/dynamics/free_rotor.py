"""Free motion of the rotor, from a kernel's arrays, for the closed form."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.dynamics.free_modes import FreeModes
from hpcwhirl.dynamics.free_waves import FreeWaves, FreeWhole, tip_rows_of
from hpcwhirl.dynamics.kernels import passes, waves
from hpcwhirl.dynamics.kernels.cyclic import widths
from hpcwhirl.dynamics.kernels.kernel_types import Arrays
from hpcwhirl.dynamics.kernels.wave_types import UncoupledRotor, WaveRotor, WholeRotor
from hpcwhirl.dynamics.turning_waves import unpacked

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]


class Shapes(NamedTuple):
    """Displacements of tips and centre per unit amplitude q of a rotor.

    Attributes
    ----------
    radial, tangential : (N, modes), displacements of the tips are Re(q @ row)
    hub : (2, modes), x_o, y_o = Re(conj(hub) q)
    reach : (N, modes), |radial|; (1, modes) if it is equal for all blades
    """

    radial: Complexes
    tangential: Complexes
    hub: Complexes
    reach: Floats


def free_rotor(
    arrays: Arrays, blades: int, step: float
) -> tuple[FreeModes | FreeWaves | FreeWhole, Shapes]:
    """Return the free motion of a rotor and the shapes of its tips and centre.

    Parameters
    ----------
    arrays : constant arrays of a kernel in the rotating frame
    blades : number of blades that are integrated
    step : dt, s
    """
    body: FreeModes | FreeWaves | FreeWhole
    if isinstance(arrays.rotor, WholeRotor | UncoupledRotor):
        body = FreeWhole(arrays.rotor)
        return body, _chosen(_whole(arrays.rotor), body.own)
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


def _whole(rotor: WholeRotor | UncoupledRotor) -> Shapes:
    read = rotor.radial, rotor.tangential, rotor.hub
    radial, along, hub = (tip_rows_of(rotor, rows) for rows in read)
    return Shapes(-radial.conj(), -along.conj(), hub, np.abs(radial))


def _chosen(shapes: Shapes, own: NDArray[np.intp]) -> Shapes:
    return Shapes._make(rows[:, own] for rows in shapes)
