"""Numerics: the same bits whatever this process does besides; no overflow unnoticed.

Products and factorizations round differently if BLAS splits them over several threads.
All arithmetic of a thread rounds differently in another floating-point environment:
direction of rounding, subnormal numbers flushed to zero. A library changes it by
`fesetround`, or as it is loaded, if it was compiled with -ffast-math.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

import numpy as np
import scipy.linalg  # noqa: F401 - its BLAS must be there when threads are limited
from threadpoolctl import ThreadpoolController

from hpcwhirl.errors import InputError, WhirlError


@cache
def _controller() -> ThreadpoolController:
    return ThreadpoolController()


def blas_told() -> str:
    """Return which BLAS NumPy and SciPy use: name, version, kind of processor.

    OpenBLAS has code for several kinds of processors, and chooses one as it is loaded.
    """
    own = (one for one in _controller().info() if _is_used(one))
    names = {
        " ".join(str(one.get(key) or "") for key in ("internal_api", *DECIDES)).strip()
        for one in own
    }
    return ", ".join(sorted(names))


def _is_used(library: dict[str, Any]) -> bool:
    """Return whether a loaded library is a BLAS, and not that of another package.

    library : what threadpoolctl knows about it
    """
    _, inside, package = library["filepath"].partition("site-packages/")
    return library["user_api"] == "blas" and (
        not inside or package.startswith(("numpy", "scipy"))
    )


DECIDES = ("version", "architecture")  # facts of a BLAS that decide its last digits
DEFAULT = ctypes.c_void_p(-1)  # FE_DFL_ENV of the C libraries glibc and musl
ENVIRONMENT = 256  # bytes, more than the type fenv_t has on any processor


@contextmanager
def default_rounding() -> Iterator[None]:
    """Compute in the default floating-point environment; restore the former afterwards.

    It is that of this thread: direction of rounding, treatment of subnormal numbers,
    and which exceptions raise a signal.
    """
    library, former = _library(), ctypes.create_string_buffer(ENVIRONMENT)
    library.fegetenv(former)
    library.fesetenv(DEFAULT)
    try:
        yield
    finally:
        library.fesetenv(former)


@cache
def _library() -> ctypes.CDLL:
    """Return the C library of mathematics, which this process has loaded."""
    library = ctypes.CDLL(None)
    for function in (library.fegetenv, library.fesetenv):
        function.argtypes = [ctypes.c_void_p]
    return library


class _Limit:
    now = False  # whether a block of `one_thread` is being executed


@contextmanager
def one_thread(*, anew: bool = False) -> Iterator[None]:
    """Let BLAS compute on one thread inside the with block or decorated function.

    Arithmetic is done in the default floating-point environment. A block inside another
    changes nothing, since setting a limit takes 40 us.

    anew : whether both are set again inside another block, and again at the end; for
        code that may change them
    """
    was = _Limit.now
    if was and not anew:
        yield
        return
    with default_rounding(), _controller().limit(limits=1, user_api="blas"):
        _Limit.now = True
        try:
            yield
        finally:
            _Limit.now = was


def zero_between(
    function: Callable[[float], float], low: float, high: float, **tolerances: float
) -> float:
    """Return the zero of a continuous function of one number in an interval.

    function : its values at both ends must have different signs
    low, high : ends of the interval
    tolerances : xtol, rtol or maxiter of `scipy.optimize.brentq`
    """
    from scipy.optimize import brentq  # slow to import

    return float(brentq(function, low, high, **tolerances))


@contextmanager
def representable(what: str) -> Iterator[None]:
    """Turn numerical failures inside a with block into one InputError; use one thread.

    Parameters
    ----------
    what : name of what is computed inside, for the message

    Raises
    ------
    InputError
        on overflow, division by zero, or matrices without modes
    """
    try:
        with one_thread(), np.errstate(over="raise", invalid="raise", divide="raise"):
            yield
    except WhirlError:
        raise
    except (ArithmeticError, ValueError) as failed:  # LinAlgError is a ValueError
        numbers = isinstance(failed, ArithmeticError | np.linalg.LinAlgError)
        if not numbers and "infs or NaNs" not in str(failed):
            raise
        raise InputError(
            f"{what} cannot be computed in double precision with these inputs: one of "
            f"them is too large, too small or far from the others ({failed.args[-1]})"
        ) from None
