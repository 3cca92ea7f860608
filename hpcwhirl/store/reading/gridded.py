"""A variable over the axes of a grid whose data stay in the file until asked for.

xarray's own lazy indexing by several axes makes an index for every number.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray
from numpy.typing import NDArray
from xarray.backends import BackendArray
from xarray.core import indexing


class _Gridded(BackendArray):
    """Array over a grid of cases, (grid..., samples...); one index of each axis a read.

    Parameters
    ----------
    of_case : variable over (case, samples...)
    rows : (grid...), number of the case at each point
    """

    def __init__(self, of_case: xarray.Variable, rows: NDArray[np.int64]) -> None:
        self._of_case, self._rows = of_case, rows
        self.shape = (*rows.shape, *of_case.shape[1:])
        self.dtype = of_case.dtype

    def __getitem__(self, key: Any) -> Any:
        return indexing.explicit_indexing_adapter(
            key, self.shape, indexing.IndexingSupport.OUTER, self._read
        )

    def _read(self, key: tuple[Any, ...]) -> NDArray[Any]:
        """Return the numbers of an outer index: a number, slice or array each axis."""
        count = self._rows.ndim
        rows = self._rows
        for axis in reversed(range(count)):  # from the last, as numbers drop their axis
            rows = rows[(slice(None),) * axis + (key[axis],)]
        rest = dict(zip(self._of_case.dims[1:], key[count:], strict=True))
        read = self._of_case.isel({"case": rows.ravel(), **rest}).to_numpy()
        return np.asarray(read).reshape(*rows.shape, *read.shape[1:])


def gridded(of_case: xarray.Variable, number: xarray.DataArray) -> xarray.Variable:
    """Return a variable over a grid instead of over `case`.

    Parameters
    ----------
    of_case : variable over (case, samples...)
    number : number of the case at each point of the grid
    """
    data = _Gridded(of_case, number.to_numpy().astype(np.int64))
    lazy = indexing.LazilyIndexedArray(data)
    return xarray.Variable((*number.dims, *of_case.dims[1:]), lazy, of_case.attrs)
