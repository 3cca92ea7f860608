"""Cells of a map whose word too few of the case's twins share."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.report.cells import Mask, Part, hatch_cells, hatch_grid
from hpcwhirl.report.picture import Picture
from hpcwhirl.report.refined import hatch_refined
from hpcwhirl.store.reading.shares import SURE

if TYPE_CHECKING:
    import xarray

HATCH, INK = "\\\\\\\\", "#3A3A3A"


def unsure_of(data: xarray.Dataset, case: NDArray[np.intp]) -> Mask | None:
    """Return which cases' words fewer twins than wanted share; None without twins.

    Parameters
    ----------
    data : results
    case : (n,), those shown
    """
    if "word_share" not in data or SURE not in data.attrs:
        return None
    share = data["word_share"].to_numpy()[case]
    return np.asarray(share < float(data.attrs[SURE]))


def mark_unsure(axes: Any, part: Part, unsure: Mask, picture: Picture) -> None:
    """Hatch the unsure cells of a panel.

    Parameters
    ----------
    axes, part : where, and its cases
    unsure : (n,), of all cases of the map
    picture : the map
    """
    own, look = unsure[part.rows], (HATCH, INK)
    if not own.any():
        return
    if picture.refined is not None:
        hatch_refined(axes, part, picture, unsure, look)
        return
    draw = hatch_cells if picture.scattered else hatch_grid
    draw(axes, part, own, look)


def unsure_key(unsure: Mask, sure: float) -> Any:
    """Return the line of a legend."""
    from matplotlib.patches import Patch

    label = f"fewer than {sure:.0%} of twins agree: {int(unsure.sum())}"
    return Patch(fc="white", ec=INK, lw=0.5, hatch=HATCH, label=label)
