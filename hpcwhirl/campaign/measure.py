"""The user's function `measure`: call it for each case, check the numbers it returns.

The numbers become variables of the results.
"""

from __future__ import annotations

import os
import re
import sys
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.campaign.fingerprint import fingerprint
from hpcwhirl.campaign.simulate import Result
from hpcwhirl.errors import InputError, one_line, say, shown, text_of
from hpcwhirl.scene import Scene, flatten
from hpcwhirl.scene.quantities import (
    AXES,
    BLADES,
    CHAOS,
    ESTIMATED,
    INPUTS,
    LOST,
    OVER_SPEED,
    PERFORMANCE,
    ROW,
    SLIPPED,
    STATUS,
    TRACES,
    TUNED,
    WORN,
    variable_name,
)
from hpcwhirl.store.reading.shares import GROUP, SHARE
from hpcwhirl.store.results.cells import BOUNDARIES, CELLS
from hpcwhirl.store.results.variables import VALUES, WHY_NOT

if TYPE_CHECKING:
    import xarray

ADDRESS = re.compile(r" at 0x[0-9a-fA-F]+")  # in the text of an object of Python
LONGEST = 240  # largest number of bytes of `measure_message`
ALLOWED = 'a mapping such as {"largest_tip": "m"} or {"largest_tip": ("m", "meaning")}'


class _EndError(Exception):
    """Raised where a user's function has called `os._exit`, to end the process."""


@dataclass(frozen=True)
class Measure:
    """A user's function, called with each case, and the variables that it returns.

    Attributes
    ----------
    function : takes a case as a dataset, see `one_case`, and returns {name: number}
    variables : {name: (unit, meaning)} of the numbers that it returns
    fingerprint : text that changes if the function changes, see `campaign.fingerprint`
    """

    function: Callable[[xarray.Dataset], Any] = field(compare=False)
    variables: dict[str, tuple[str, str]]
    fingerprint: str = ""

    def plan(self) -> dict[str, list[str]]:
        """Return {variable: [unit, meaning]}, to be stored in the campaign's plan."""
        return {name: list(told) for name, told in self.variables.items()}

    def __call__(self, scene: Scene, result: Result) -> dict[str, Any]:
        """Call the user's function with one case; return entries for the case's record.

        The entries are its numbers, or why there are none. An exception of the
        function, even by `sys.exit` or `os._exit`, is no failure of the case, whose
        words do not depend on it: the variables become NaN, and `measure_message` says
        why. Only `KeyboardInterrupt` is passed on.

        Parameters
        ----------
        scene : inputs of the case
        result : result of the case
        """
        try:
            with _guarded():
                case = one_case(scene, result.row, result.traces)
                return {VALUES: self._checked(self.function(case))}
        except KeyboardInterrupt:
            raise
        except BaseException as failed:  # noqa: BLE001 - in `measure_message`
            return {WHY_NOT: one_line(text_of(failed), LONGEST)}

    def _checked(self, given: Any) -> dict[str, float]:
        """Check that a user's function has returned its declared variables.

        given : what the function has returned

        Returns
        -------
        {variable: number}
        """
        if not isinstance(given, Mapping):
            msg = f"measure must return {{name: number}}, got {_plain(given)}"
            raise InputError(msg)
        if given.keys() != self.variables.keys():
            own, got = ", ".join(self.variables), ", ".join(map(str, given))
            msg = f"measure must return the declared variables {own}, got {got}"
            raise InputError(msg)
        return {name: _number(name, given[name]) for name in self.variables}


def _number(name: str, given: Any) -> float:
    """Return the value of a variable of a user's function as a number.

    name, given : the variable, and what the function has returned for it
    """
    try:
        return float(given)
    except (TypeError, ValueError, OverflowError):
        msg = f"measure must return a number for {name}, got {_plain(given)}"
        raise InputError(msg) from None


def _plain(given: Any) -> str:
    """Return a value as text that is the same in all runs: without its address."""
    return ADDRESS.sub("", shown(given))


@contextmanager
def _guarded() -> Iterator[None]:
    """Protect this process while a user's function runs in the block.

    In the block `os._exit` raises in this process and thread. A forked child that
    leaves the block is ended; the working directory and NumPy's error settings are
    restored.
    """
    process, thread, leave = os.getpid(), threading.get_ident(), os._exit
    place = os.open(".", os.O_PATH)

    def refuse(status: int) -> None:
        if (os.getpid(), threading.get_ident()) != (process, thread):
            leave(status)
        raise _EndError(f"os._exit({status}) would have ended the campaign")

    os._exit = refuse  # type: ignore[assignment]
    try:
        with np.errstate():  # restores settings of NumPy
            yield
    finally:
        os._exit = leave
        if os.getpid() != process:
            _end_child(leave)
        os.fchdir(place)
        os.close(place)


def _end_child(leave: Callable[[int], Any]) -> None:
    """End a process that a user's function has forked and that has returned from it.

    It must not continue as a second campaign.

    leave : the real `os._exit`
    """
    left = sys.exception()
    code = 1
    if isinstance(left, SystemExit):
        code = left.code if isinstance(left.code, int) else int(left.code is not None)
    else:
        say("a process forked by measure returned and was ended; the case goes on")
    sys.stdout.flush()
    leave(code)


def measure_of(function: Any, variables: Any, version: Any = None) -> Measure | None:
    """Return a `Measure` for a function given in Python, after checking it.

    Parameters
    ----------
    function, variables, version : arguments `measure`, `variables` and `version` of
        `hpcwhirl.campaign`; None: not given

    Returns
    -------
    the `Measure`; None if neither function nor variables are given

    Raises
    ------
    InputError
        if `function` is no function or has no fingerprint, if its variables are not
        declared, or if the name of a variable is already in use in results
    """
    if function is None and variables is None:
        if version is not None:
            msg = f"version is used only with measure, got {shown(version)} without it"
            raise InputError(msg)
        return None
    if not callable(function):
        msg = f"measure must be a function of one case, got {shown(function)}"
        raise InputError(msg)
    if not isinstance(variables, Mapping) or not variables:
        msg = f"variables must declare what measure returns, {ALLOWED}, "
        raise InputError(msg + f"got {shown(variables)}")
    told = {n: _told(n, given) for n, given in variables.items()}
    return Measure(function, told, fingerprint(function, version))


def _told(name: Any, given: Any) -> tuple[str, str]:
    """Check how a user declares one variable of `measure`; return its unit and meaning.

    Parameters
    ----------
    name : name of the variable
    given : its unit, or (unit, meaning)
    """
    if not isinstance(name, str) or not name.isidentifier() or not name.isascii():
        msg = f"variables: a name has only letters, digits and _, got {shown(name)}"
        raise InputError(msg)
    taken = {
        *ROW, *BLADES, *CHAOS, *ESTIMATED, *OVER_SPEED, *LOST, *SLIPPED, *WORN, *TUNED,
        *STATUS,
        *TRACES, *AXES, *PERFORMANCE, *SHARE, GROUP, CELLS, BOUNDARIES, WHY_NOT,
        "performance",
    }  # fmt: skip
    if name in taken | set(map(variable_name, INPUTS)):
        raise InputError(
            f"variables: {name} is a name of the results: choose another name"
        )
    pair = (given, name.replace("_", " ")) if isinstance(given, str) else given
    if not isinstance(pair, tuple | list) or [type(t) for t in pair] != [str, str]:
        raise InputError(f"variables must be {ALLOWED}, got {shown({name: given})}")
    if not "".join(pair).isprintable():
        msg = f"variables: unit and meaning of {name} must have no control characters, "
        raise InputError(f"{msg}got {shown(pair)}")
    return pair[0] or "1", pair[1]


def one_case(
    scene: Scene, row: Mapping[str, Any], traces: Mapping[str, NDArray[Any]]
) -> xarray.Dataset:
    """Return the results of one case as the dataset that a user's function gets.

    It has the form of `open_results(...).isel(case=i)`.

    Parameters
    ----------
    scene : inputs of the case, which become attributes with their dotted names
    row : {variable: value} of the case, see `campaign.simulate.Result`
    traces : {name: array}, time histories, see `campaign.simulate.Result`

    Returns
    -------
    xarray.Dataset of numbers and words without a dimension, and of traces over `time`.
    All are read-only copies, so that the user's function cannot change what is stored.
    The variables of `performance` are missing, since they depend on the machine
    """
    import xarray

    known = {
        **ROW,
        **BLADES,
        **CHAOS,
        **ESTIMATED,
        **LOST,
        **SLIPPED,
        **WORN,
        **TRACES,
        "time": AXES["time"],
    }
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
    """Return a read-only copy of an array, or of a number as an array."""
    copy = np.array(value)
    copy.setflags(write=False)
    return copy
