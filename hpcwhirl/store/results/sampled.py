"""Inputs drawn by [sample] in plans and results: each case's draw and sweep point."""

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
    """Return a plan's draws as an axis of cases, the same at each sweep point."""
    return plan.table.blocks[0][-1]


def sample_attribute(plan: Manifest) -> dict[str, str]:
    """Return {attribute: JSON} with a plan's [sample]; {} without [sample]."""
    if SAMPLE not in plan.base or not plan.settings:
        return {}
    told = plan.base[SAMPLE] | {EACH: len(drawn_axis(plan))}
    return {SAMPLE: json.dumps(told)}


@dataclass(frozen=True)
class Drawn:
    """The drawn inputs of some results, and the draw and sweep point of each case.

    Attributes
    ----------
    method : how inputs were drawn, as in [sample]
    inputs : names of the drawn inputs' variables
    swept : names of the other swept inputs' variables
    point, draw : (cases,), number of the point of the sweep, and of the draw there
    each : number of draws at a point
    tuned : whether draw 0 is the tuned engine instead of a draw
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
        """Number of the `saltelli` block to which each case's draw belongs, (cases,).

        0: A, 1: B, 2 + i: A with input i taken from B.
        """
        return self.draw % (len(self.inputs) + 2)

    @property
    def independent(self) -> NDArray[np.bool_]:
        """Whether the draw of each case is independent of all others, (cases,)."""
        if self.method != SALTELLI:
            return np.asarray(self.draw >= self.tuned)
        return np.asarray(self.block < 2)


def points_of(
    data: xarray.Dataset, drawn: Drawn
) -> tuple[NDArray[np.int64], dict[str, Any]]:
    """Return the sweep's point numbers, and {swept input: its value at each point}.

    drawn : the draws behind the results
    """
    points, first = np.unique(drawn.point, return_index=True)
    swept = {n: ("point", data[n].to_numpy()[first], data[n].attrs)
             for n in drawn.swept}  # fmt: skip
    return points, swept


def is_sampled(data: xarray.Dataset) -> bool:
    """Return whether inputs of the cases in some results were drawn."""
    return SAMPLE in data.attrs


def drawn_of(data: xarray.Dataset) -> Drawn:
    """Return the draws behind the results of a campaign or of some of its cases.

    Raises
    ------
    InputError
        where nothing was drawn
    """
    if not is_sampled(data):
        raise InputError("this campaign has no [sample]: its inputs were not drawn")
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
