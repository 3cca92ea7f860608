"""A user's function of a case: variables it returns, and dataset passed to it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.scene import Scene, flatten
from hpcwhirl.scene.quantities import AXES, BLADES, CHAOS, ROW, TRACES, WORN
from hpcwhirl.scene.quantity import Quantity
from hpcwhirl.store.directory.manifest import MEASURE, Manifest

if TYPE_CHECKING:
    import xarray

VALUES, WHY_NOT = "measured", "measure_message"  # entries of a record
REASON = Quantity("1", "why the user's function gave no numbers", kind="S240")


def measured_of(plan: Manifest) -> dict[str, Quantity]:
    """Return {variable: `Quantity`} of the numbers that the user's function returns.

    `WHY_NOT`, the reason why a case has no numbers, is included. The result is {} for a
    plan without such a function.
    """
    declared = plan.base.get(MEASURE) or {}
    if not declared:
        return {}
    found = {name: Quantity(*told) for name, told in declared.items()}
    return found | {WHY_NOT: REASON}


def one_case(
    scene: Scene, row: Mapping[str, Any], traces: Mapping[str, NDArray[Any]]
) -> xarray.Dataset:
    """Return one case in the form of `open_results(...).isel(case=i)`.

    Parameters
    ----------
    scene : inputs of the case, which become attributes with their dotted names
    row : {variable of `ROW`: value}
    traces : as in `campaign.simulate.Result`

    Returns
    -------
    xarray.Dataset of numbers and words without a dimension, and of traces over `time`.
    All are read-only copies, so that the user's function cannot change what is stored.
    The variables of `performance` are missing, since they depend on the machine
    """
    import xarray

    known = {**ROW, **BLADES, **CHAOS, **WORN, **TRACES, "time": AXES["time"]}
    variables = {
        name: (
            dims,
            _copy(value),
            {"units": known[name].unit, "long_name": known[name].meaning},
        )
        for name, value, dims in [
            *((name, value, ()) for name, value in row.items()),
            *((name, a, _dims(name)) for name, a in traces.items()),
        ]
    }
    return xarray.Dataset(variables, attrs=flatten(scene))


def _dims(name: str) -> tuple[str, ...]:
    return ("time",) if name == "time" else ("time", *TRACES[name].axes)


def _copy(value: Any) -> NDArray[Any]:
    """Return a read-only copy of an array or a number."""
    copy = np.array(value)
    copy.setflags(write=False)
    return copy
