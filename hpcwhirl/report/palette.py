"""The word that a case is shown by, and colour maps; looks are of `scene.words`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

SEQUENTIAL = "cividis"  # of numbers: perceptual, and the same to the colour-blind
DIVERGING = "PuOr"  # of numbers about zero


def words_of(
    status: NDArray[np.str_], outcome: NDArray[np.str_], regime: NDArray[np.str_]
) -> NDArray[np.str_]:
    """Return the word of `scene.words.SHOWN` that each case is shown by, (cases,)."""
    named = np.where((outcome == "unstable") | (regime == "none"), "unstable", regime)
    without = np.where(status == "missing", "missing", "failed")
    return np.where(status == "ok", named, without)


def word_of(status: str, outcome: str, regime: str) -> str:
    """Return `words_of` of one case."""
    return str(words_of(*map(np.asarray, (status, outcome, regime))))
