"""The motion of a body's modes from the amplitudes of its waves, and the reverse.

Without forces modes move as a sum of waves: amplitudes x = Y a and velocities x' = R a,
a the amplitudes of the waves. Where the waves are a basis of the motion, a follows from
x and x'. This is the conversion of all states that have waves, by slot or by point.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

Numbers = NDArray[Any]  # real or complex


@dataclass(frozen=True)
class WaveMotion:
    """How w waves move m modes; of several blocks of modes at once, stacks of these.

    Complex modes have complex waves. Real modes x = Re(Y a) have twice as many real
    amplitudes: all re of a, then all im.

    Attributes
    ----------
    shapes, rates : (..., m, w), Y and R: amplitudes of the modes and their velocities,
        1/s, for unit amplitudes of the waves
    """

    shapes: Numbers
    rates: Numbers

    @cached_property
    def scale(self) -> float:
        """Number by which `basis` divides velocities: the largest one, 1/s."""
        return float(np.abs(self.rates).max(initial=0.0)) or 1.0

    @cached_property
    def basis(self) -> Numbers:
        """Matrices (..., 2 m, w) from amplitudes to a motion (x, x' / scale)."""
        return np.concatenate([self.shapes, self.rates / self.scale], axis=-2)

    def read(self, a: Numbers) -> tuple[Numbers, Numbers]:
        """Return amplitudes and velocities of the modes, (..., m) each.

        a : (..., w), amplitudes of the waves
        """
        column = a[..., None]
        return (self.shapes @ column)[..., 0], (self.rates @ column)[..., 0]

    def write(self, x: Numbers, rate: Numbers) -> Numbers:
        """Return the amplitudes of the waves, (..., w), in a motion of the modes.

        Those that move no mode, such as im of a wave without a conjugate, are 0.

        x, rate : (..., m), amplitudes and velocities of the modes
        """
        given = np.concatenate([x, rate / self.scale], axis=-1)
        size, waves = self.basis.shape[-2:]
        if size == waves:
            return np.asarray(np.linalg.solve(self.basis, given[..., None])[..., 0])
        return np.asarray(np.linalg.lstsq(self.basis, given, rcond=None)[0])
