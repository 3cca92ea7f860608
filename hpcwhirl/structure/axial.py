"""Axial functions: how the harmonics of a casing vary with the axial place zeta.

zeta is 0 in the casing's middle. A harmonic h has an amplitude for each function a_l:
w(theta, zeta) = sum_l a_l(zeta) w_l(theta).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Uniform:
    """A ring, whose displacement does not depend on the axial place."""

    count = 1
    ends = (-math.inf, math.inf)

    def at(self, stations: Floats) -> Floats:
        """Return ones (s, 1), the values at axial places (s,)."""
        return np.ones((len(stations), 1))


@dataclass(frozen=True)
class Sines:
    """A shell simply supported at both ends: sin(p pi (zeta / L + 1/2)), p = 1, 2, ...

    Attributes
    ----------
    count : number of functions
    length : L, m
    """

    count: int
    length: float

    @property
    def ends(self) -> tuple[float, float]:
        """Least and largest axial place, m."""
        return -self.length / 2, self.length / 2

    def at(self, stations: Floats) -> Floats:
        """Return the values of the functions at axial places (s,), m: (s, count)."""
        phase = np.pi * (np.asarray(stations) / self.length + 0.5)
        waves = np.arange(1, self.count + 1)
        return np.asarray(np.sin(np.outer(phase, waves)))


@dataclass(frozen=True)
class Stations:
    """A casing from file: piecewise linear functions, each 1 at its own station only.

    places : (s,), m, ascending, the stations
    """

    places: tuple[float, ...]

    @property
    def count(self) -> int:
        """Number of functions."""
        return len(self.places)

    @property
    def ends(self) -> tuple[float, float]:
        """Least and largest axial place, m."""
        return self.places[0], self.places[-1]

    def at(self, stations: Floats) -> Floats:
        """Return the values at axial places (m,), m: (m, s), constant past the ends."""
        hats = np.eye(self.count)
        columns = [np.interp(stations, self.places, hat) for hat in hats]
        return np.column_stack(columns)


Axial = Uniform | Sines | Stations
EVERYWHERE = Uniform()
