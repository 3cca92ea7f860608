"""Type annotations for NumPy arrays, such as `Floats` for arrays of float64.

Each name is an alias of `numpy.typing.NDArray` with the type of the array's elements.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Integers = NDArray[np.int64]
Indices = NDArray[np.intp]
Matrix = NDArray[Any]  # real or complex
