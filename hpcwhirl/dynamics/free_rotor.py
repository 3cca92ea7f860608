"""The freely moving rotor of a kernel's arrays, for the closed form."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.dynamics.kernels import passes
from hpcwhirl.dynamics.kernels.cyclic import widths
from hpcwhirl.dynamics.kernels.kernel_types import (
    Arrays,
    CyclicContact,
    CyclicRotor,
    GeneralRotor,
)

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]


@dataclass(frozen=True)
class FreeRotor:
    """Modes of a rotor with real or complex amplitudes q, and shapes of its tips.

    Attributes
    ----------
    items : (ITEMS, modes), see `kernels.passes`
    phases, width : the state has shape (3, rows, phases, width), modes = rows width;
        real amplitudes have one phase
    radial, tangential : (N, modes), displacements of the tips are Re(q @ row)
    hub : (2, modes), x_o, y_o = Re(conj(hub) q)
    reach : (N, modes), |radial|; (1, modes) where it is the same for all blades
    """

    items: Floats
    phases: int
    width: int
    radial: Complexes
    tangential: Complexes
    hub: Complexes
    reach: Floats

    def read(self, state: Floats) -> Complexes:
        """Return q and the two stored increments d of a state, (3, modes)."""
        parts = state.reshape(passes.ROTOR_STATE, -1, self.phases, self.width)
        values = parts[:, :, 0] + 1j * (parts[:, :, 1] if self.phases == 2 else 0.0)
        return np.asarray(values.reshape(passes.ROTOR_STATE, -1))

    def write(self, state: Floats, place: int, values: Complexes) -> None:
        """Set q (place 0) or d (place 1 or 2) of a state to values (modes,)."""
        parts = state.reshape(passes.ROTOR_STATE, -1, self.phases, self.width)[place]
        parts[:, 0] = values.real.reshape(-1, self.width)
        if self.phases == 2:
            parts[:, 1] = values.imag.reshape(-1, self.width)


def free_rotor(arrays: Arrays, blades: int) -> FreeRotor:
    """Return the free rotor of the arrays of kernel `cyclic` or `general`."""
    if isinstance(arrays.rotor, GeneralRotor):
        return _general(arrays.rotor, blades)
    return _cyclic(arrays.rotor, arrays.contact, blades)


def _general(rotor: GeneralRotor, blades: int) -> FreeRotor:
    items = passes.unpacked(rotor.items)
    radial, tangential = (
        -rows.reshape(blades, -1) for rows in (rotor.radial, rotor.tangential)
    )
    hub, width = rotor.hub.reshape(2, -1), items.shape[1]
    along, axes = tangential.astype(np.complex128), hub.astype(np.complex128)
    whole = radial.astype(np.complex128)
    return FreeRotor(items, 1, width, whole, along, axes, np.abs(radial))


def _cyclic(rotor: CyclicRotor, contact: CyclicContact, blades: int) -> FreeRotor:
    slots, _ = widths(blades)
    parts = passes.unpacked(rotor.items).reshape(passes.ITEMS, -1, 2, slots)
    items = parts[:, :, 0].reshape(passes.ITEMS, -1)
    axes = rotor.hub.reshape(2, -1, 2, slots)
    hub = (axes[:, :, 0] + 1j * axes[:, :, 1]).reshape(2, -1)
    columns = contact.turns.reshape(blades, 2 * slots)
    waves = columns[:, :slots] - 1j * columns[:, slots:]
    waves = waves[:, np.arange(items.shape[1]) % slots]
    sigma = items[passes.SR] + 1j * items[passes.SI]
    shapes = -items[passes.RADIAL] * waves, -sigma * waves
    return FreeRotor(items, 2, slots, *shapes, hub, np.abs(items[passes.RADIAL])[None])
