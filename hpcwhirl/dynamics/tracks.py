"""Arrays for the samples and the rows of evidence that a march writes."""

from __future__ import annotations

import numpy as np

from hpcwhirl.dynamics.kernels import contact
from hpcwhirl.dynamics.kernels.kernel_types import Tracks


def empty_tracks(
    samples: tuple[int, int, int],
    evidence: tuple[int, int],
    blades: int,
    width: int,
    rods: int,
) -> Tracks:
    """Return empty tracks of a march.

    Parameters
    ----------
    samples : number of samples, of those with tips, and of those with casing
    evidence : number of rows of evidence, and of their columns
    blades, width : number of blades N; number of coordinates of the casing
    rods : number of rods of a layer that wears, 0 without
    """
    count, tips, casing = samples
    numbers = [np.zeros(count) for _ in range(5)]
    energy, impulse, fed, lost, rubbed = numbers
    return Tracks(
        np.zeros((count, 2)), energy, impulse, fed, lost,
        np.zeros((tips, blades, 2)), np.zeros((tips, blades)), rubbed,
        np.zeros((casing, width)), np.zeros(evidence),
        np.zeros(contact.CLOSED), np.zeros((casing, rods)),
    )  # fmt: skip
