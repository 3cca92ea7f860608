"""Names of NumPy array types by the type of their elements, for annotations."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]
Integers = NDArray[np.int64]
Indices = NDArray[np.intp]
Matrix = NDArray[Any]  # real or complex
