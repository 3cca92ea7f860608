"""The fingerprint of a user's function `measure`: it changes with the function's file.

So a campaign cannot mix numbers of two functions. The fingerprint is the function's
name, its line, and the SHA-256 of the source file that defines it; of a notebook, of
the cell. Values that stand in no file (arguments of `functools.partial`, variables of
an enclosing function, attributes of an object) cannot be compared in this way: for such
a function the user gives a version, which is compared instead.
"""

from __future__ import annotations

import functools
import hashlib
import inspect
import linecache
from types import FunctionType, MethodType, ModuleType
from typing import Any

from hpcwhirl.errors import InputError, shown

VERSION = "version"
MOST_LETTERS = 200
REMEDY = (
    'give version="1", and another version whenever the measure changes: '
    "then only versions are compared"
)


def fingerprint(function: Any, version: object = None) -> str:
    """Return the fingerprint of a user's function, a text that is stored and compared.

    Parameters
    ----------
    function : a function or class method
    version : a text or whole number that the user changes with the function, which may
        then be any callable; None: the source file is compared

    Returns
    -------
    "version TEXT", or "NAME:LINE:SHA-256"

    Raises
    ------
    InputError
        if the version is invalid; or if none is given and the function has no source
        file, or uses values that stand in none
    """
    if version is not None:
        return f"{VERSION} {_checked(version)}"
    own = _plain(function)
    name, code = getattr(own, "__qualname__", shown(function)), own.__code__
    linecache.checkcache(code.co_filename)
    text = "".join(linecache.getlines(code.co_filename, own.__globals__))
    if not text:
        raise _unknown(f"the source of {name} cannot be read")
    lines = "\n".join(text.splitlines()).encode("utf-8", "surrogatepass")
    return f"{name}:{code.co_firstlineno}:{hashlib.sha256(lines).hexdigest()}"


def difference(was: str, now: str) -> str:
    """Return what differs between two fingerprints, as a phrase for a message.

    "" if they are equal or the first is unknown.

    was, now : the stored fingerprint, and that of the function of this call
    """
    if was == now or not was:
        return ""
    (*one, text), (*other, new) = was.split(":"), now.split(":")
    if not one or not other:
        return f"its {VERSION}"
    return "its source file" if text != new else "its place in the source file"


def _checked(version: object) -> str:
    """Check the `version` that a user gave for a function, and return it as text."""
    text = str(version) if isinstance(version, int | str) else ""
    if isinstance(version, bool) or not 0 < len(text) <= MOST_LETTERS:
        msg = "version must be a whole number or a text of 1 to "
        raise InputError(f"{msg}{MOST_LETTERS} characters, got {shown(version)}")
    if not text.isprintable():
        msg = f"version must have no control characters, got {shown(version)}"
        raise InputError(msg)
    return text


def _plain(function: Any) -> FunctionType:
    """Return the function of Python that a user's function is, or wraps.

    Raises
    ------
    InputError
        naming it, if it is none, or if it uses values that stand in no file
    """
    own = function
    while not isinstance(own, FunctionType) or hasattr(own, "__wrapped__"):
        if isinstance(own, MethodType) and inspect.isclass(own.__self__):
            own = own.__func__
            continue
        inner = getattr(own, "__wrapped__", getattr(own, "py_func", None))
        if inner is None:
            raise _unknown(_why_not(own))
        own = inner
    for name, cell in zip(own.__code__.co_freevars, own.__closure__ or (), strict=True):
        if not _is_code(cell):
            msg = f"{own.__qualname__} uses {name}, a variable of a function around it"
            raise _unknown(msg)
    return own


def _why_not(given: Any) -> str:
    """Return why a callable that is no plain function has no source file of its own."""
    if isinstance(given, functools.partial):
        return "the arguments of a functools.partial stand in no source file"
    if isinstance(given, MethodType):
        return f"the object of the method {given.__qualname__} stands in no source file"
    if inspect.isbuiltin(given):
        return f"{given.__qualname__} is not written in Python"
    return f"an object of type {type(given).__qualname__} stands in no source file"


def _is_code(cell: Any) -> bool:
    """Return whether a variable of an enclosing function is code, or has no value."""
    try:
        held = cell.cell_contents
    except ValueError:
        return True
    return isinstance(held, FunctionType | ModuleType | type)


def _unknown(why: str) -> InputError:
    return InputError(f"measure cannot be identified by its source: {why}; {REMEDY}")
