"""Numerics of models: the same bits on any number of threads; no overflow unnoticed.

Products and factorizations round differently if BLAS splits them over several threads.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache

import numpy as np
import scipy.linalg  # noqa: F401 - its BLAS must be there when threads are limited
from threadpoolctl import ThreadpoolController

from hpcwhirl.errors import InputError, WhirlError


@cache
def _controller() -> ThreadpoolController:
    return ThreadpoolController()


class _Limit:
    now = False  # whether a block of `one_thread` is being executed


@contextmanager
def one_thread(*, anew: bool = False) -> Iterator[None]:
    """Let BLAS compute on one thread inside the with block or decorated function.

    A block inside another changes nothing, since setting a limit takes 40 us.

    anew : whether the limit is set again inside another block, and again at the end;
        for code that may change it
    """
    was = _Limit.now
    if was and not anew:
        yield
        return
    with _controller().limit(limits=1, user_api="blas"):
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
