"""Refuse inputs whose model cannot be computed in double precision."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from hpcwhirl.errors import InputError, WhirlError


@contextmanager
def representable(what: str) -> Iterator[None]:
    """Turn numerical failures inside the block into one InputError.

    Parameters
    ----------
    what : name of what is computed inside, for the message

    Raises
    ------
    InputError
        on overflow, division by zero, or matrices without modes
    """
    try:
        with np.errstate(over="raise", invalid="raise", divide="raise"):
            yield
    except WhirlError:
        raise
    except (ArithmeticError, ValueError) as failed:  # LinAlgError is a ValueError
        numbers = isinstance(failed, ArithmeticError | np.linalg.LinAlgError)
        if not numbers and "infs or NaNs" not in str(failed):
            raise
        msg = (
            f"{what} cannot be computed in double precision with these inputs: one of "
            f"them is too large, too small or far from the others ({failed.args[-1]})"
        )
        raise InputError(msg) from None
