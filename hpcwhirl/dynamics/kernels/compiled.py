"""How functions of the cyclic kernel are compiled: in Python, as a part, or inline.

Numba makes of every function one that Python can call, too, and another for C: that is
a sixth of the seconds of a first start. A part has neither.
"""

from __future__ import annotations

from typing import Any, NoReturn

from numba import njit
from numba.core.registry import CPUDispatcher

numba_njit: Any = njit  # its hints leave out the options that name entries
kernel = numba_njit(error_model="numpy", cache=True, no_cfunc_wrapper=True)
inlined = numba_njit(error_model="numpy", inline="always")


class Part(CPUDispatcher):  # type: ignore[misc, unused-ignore]
    """A function that compiled code alone can call: for Python there is no entry."""

    def __call__(self, *_: Any, **__: Any) -> NoReturn:
        """Raise TypeError: there would be nothing behind the pointer."""
        msg = f"{self.py_func.__name__} is for compiled code alone"
        raise TypeError(msg)


def part(function: Any) -> Any:
    """Compile a function for other compiled functions alone."""
    made = numba_njit(
        error_model="numpy", cache=True, no_cpython_wrapper=True, no_cfunc_wrapper=True
    )(function)
    made.__class__ = Part
    return made
