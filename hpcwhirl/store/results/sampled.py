"""Random inputs ([sample]) in plans and results: which draw each case has.

The cases are all draws at the first point of the sweep, then all at the second, and so
on.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.errors import InputError, StoreError
from hpcwhirl.scene.campaign_tables import SALTELLI
from hpcwhirl.scene.quantities import variable_name
from hpcwhirl.scene.table import Axis
from hpcwhirl.store.directory.manifest import SAMPLE, Manifest
from hpcwhirl.store.reading.select import swept_of

if TYPE_CHECKING:
    import xarray

TUNED = "tuned"
EACH = "each"  # number of draws at a point: key of the root attribute, not of [sample]


def drawn_axis(plan: Manifest) -> Axis:
    """Return the draws of a plan as an axis of cases: drawn inputs and their values.

    Every point of the sweep has the same draws.
    """
    return plan.table.blocks[0][-1]


def sample_attribute(plan: Manifest) -> dict[str, str]:
    """Return the attribute of results.h5 that says how inputs were drawn, {name: JSON}.

    {} without [sample].
    """
    if SAMPLE not in plan.base or not plan.settings:
        return {}
    told = plan.base[SAMPLE] | {EACH: len(drawn_axis(plan))}
    return {SAMPLE: json.dumps(told)}


@dataclass(frozen=True)
class Drawn:
    """Which inputs of some results were drawn, and which draw each case has.

    Attributes
    ----------
    method : how inputs were drawn, as in [sample]
    inputs : names of the drawn inputs' variables
    swept : names of the other swept inputs' variables
    point, draw : (cases,), number of the point of the sweep, and of the draw there
    each : number of draws at a point
    tuned : whether draw 0 is the engine with equal blades instead of a draw
    """

    method: str
    inputs: tuple[str, ...]
    swept: tuple[str, ...]
    point: NDArray[np.int64]
    draw: NDArray[np.int64]
    each: int
    tuned: bool = False

    @property
    def block(self) -> NDArray[np.int64]:
        """Which part of its `saltelli` draw each case is, (cases,).

        0: draw A, 1: draw B, 2 + i: draw A with input i taken from B.
        """
        return self.draw % (len(self.inputs) + 2)

    @property
    def independent(self) -> NDArray[np.bool_]:
        """Whether the draw of each case is independent of all other draws, (cases,).

        Those of `saltelli` that mix A and B are not, nor is the engine with equal
        blades.
        """
        if self.method != SALTELLI:
            return np.asarray(self.draw >= self.tuned)
        return np.asarray(self.block < 2)


def points_of(
    data: xarray.Dataset, drawn: Drawn
) -> tuple[NDArray[np.int64], dict[str, Any]]:
    """Return the points of the sweep in some results, and the swept inputs there.

    Parameters
    ----------
    data : results over `case`
    drawn : which draw each of these cases has

    Returns
    -------
    (points,), numbers of the points; {swept input: its value at each point}
    """
    points, first = np.unique(drawn.point, return_index=True)
    swept = {n: ("point", data[n].to_numpy()[first], data[n].attrs)
             for n in drawn.swept}  # fmt: skip
    return points, swept


def is_sampled(data: xarray.Dataset) -> bool:
    """Return whether inputs of the cases in some results were drawn by [sample]."""
    return SAMPLE in data.attrs


def drawn_of(data: xarray.Dataset) -> Drawn:
    """Return which inputs of some results were drawn, and which draw each case has.

    data : results of a campaign, or some of their cases

    Raises
    ------
    InputError
        where nothing was drawn
    """
    if not is_sampled(data):
        msg = "this campaign has no [sample]: its inputs were not drawn, see hpcwhirl "
        raise InputError(f"{msg}manual uncertainty")
    try:
        told = json.loads(data.attrs[SAMPLE])
        method, each = str(told["method"]), int(told[EACH])
        inputs = tuple(map(variable_name, told["inputs"]))
    except (ValueError, KeyError, TypeError):
        msg = f"the attribute {SAMPLE} of these results is damaged"
        raise StoreError(msg) from None
    number = data["case"].to_numpy()
    swept = tuple(name for name in swept_of(data) if name not in inputs)
    point, draw = number // each, number % each
    return Drawn(method, inputs, swept, point, draw, each, TUNED in told)
