"""A rotor between contacts as the closed form takes it, from a kernel's arrays."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.dynamics.kernels import passes
from hpcwhirl.dynamics.kernels.cyclic import widths
from hpcwhirl.dynamics.kernels.named import (
    Arrays,
    CyclicContact,
    CyclicRotor,
    GeneralRotor,
)

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]


@dataclass(frozen=True)
class FreeRotor:
    """Amplitudes q of a rotor and what they move; complex, or real ones.

    Attributes
    ----------
    items : (ITEMS, modes), see `kernels.passes`
    phases, width : the state is (3, rows, phases, width), modes = rows width; real
        amplitudes have one phase
    radial, tangential : (N, modes), displacements of the tips Re(q @ row)
    hub : (2, modes), x_o, y_o = Re(conj(hub) q)
    reach : (blades, modes), |radial|; of one blade where all blades have the same
    """

    items: Floats
    phases: int
    width: int
    radial: Complexes
    tangential: Complexes
    hub: Complexes
    reach: Floats

    def read(self, state: Floats) -> Complexes:
        """Return (3, modes): q, and d in two places, of a state."""
        parts = state.reshape(passes.ROTOR_STATE, -1, self.phases, self.width)
        found = parts[:, :, 0] + 1j * (parts[:, :, 1] if self.phases == 2 else 0.0)
        return np.asarray(found.reshape(passes.ROTOR_STATE, -1))

    def write(self, state: Floats, place: int, values: Complexes) -> None:
        """Set q, or d in a place, of a state to values (modes,)."""
        parts = state.reshape(passes.ROTOR_STATE, -1, self.phases, self.width)[place]
        parts[:, 0] = values.real.reshape(-1, self.width)
        if self.phases == 2:
            parts[:, 1] = values.imag.reshape(-1, self.width)


def free_rotor(arrays: Arrays, blades: int) -> FreeRotor:
    """Return the rotor of the arrays of the kernels `cyclic` or `general`."""
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
