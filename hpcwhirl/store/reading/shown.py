"""The words that cases go by, of many at once; see `scene.words.word_of`."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Words = NDArray[np.str_]


def words_of(status: Words, outcome: Words, regime: Words) -> Words:
    """Return the word of `SHOWN` that each case goes by, (cases,)."""
    named = np.where((outcome == "unstable") | (regime == "none"), "unstable", regime)
    without = np.where(status == "missing", "missing", "failed")
    return np.asarray(np.where(status == "ok", named, without))
