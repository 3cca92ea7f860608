"""The error of a case, estimated from a second, coarser run.

A motion with contact has no order of convergence on which Richardson's extrapolation
could rely. So the difference of both runs is stored as it is.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from hpcwhirl.scene.words import word_of

LEAST = 0.01  # least size by which a difference is divided / gap
COMPARED = {"radius_error": "orbit_radius", "peak_error": "centre_peak"}
NO_COARSE: dict[str, float | str] = {
    "coarse_regime": "none",
    **dict.fromkeys(COMPARED, math.nan),
}


def told_of_estimate(row: Mapping[str, Any]) -> str:
    """Return a remark on how far a coarser run differs; "" if there is none.

    row : results of the case
    """
    word = row.get("coarse_regime", "")
    if not word:
        return ""
    if word == "none":
        return "no estimate of the step's error: no longer step is stable"
    parts = [f"{row[of]:.4g} m ({of}) differs by {100 * row[name]:.2g} %"
             for name, of in COMPARED.items()]  # fmt: skip
    return f"computed coarser: {word}; {', '.join(parts)}"


def estimated(
    row: Mapping[str, Any], coarse: Mapping[str, Any], gap: float
) -> dict[str, float | str]:
    """Return how far the results of a case differ from those of a coarser run.

    The variables are those of `scene.quantities.ESTIMATED`.

    row, coarse, gap : results of both runs; m
    """
    word = word_of("ok", str(coarse["outcome"]), str(coarse["regime"]))
    found: dict[str, float | str] = {"coarse_regime": word}
    for name, of in COMPARED.items():
        size = max(abs(float(row[of])), LEAST * gap)
        found[name] = abs(float(row[of]) - float(coarse[of])) / size
    return found
