"""What a user's function does, as a mark: another code has another one."""

from __future__ import annotations

import dis
import functools
import hashlib
import sys
from collections.abc import Iterator
from inspect import getattr_static
from types import CodeType, FunctionType, MethodType
from typing import Any

import numpy as np

CALL = "__call__"
PLAIN = (int, float, complex, str, bytes, bool, type(None))


def mark_of(function: Any) -> str:
    """Return a mark of a function's code, of what it refers to, and of its numbers.

    Two have one mark where their code does the same on the same data: names, comments
    and lines do not count; defaults, variables around it, and functions and plain data
    of its module that it uses do. What is in other modules is taken as it is. "" where
    there is no code to look at, as of a function in C.

    Returns
    -------
    the interpreter whose code it is, a colon, and a SHA-256
    """
    parts = list(_parts(function, set()))
    if not parts:
        return ""
    told = hashlib.sha256("\n".join(parts).encode("utf-8", "backslashreplace"))
    return f"{sys.implementation.cache_tag}:{told.hexdigest()}"


def differ(was: str, now: str) -> bool:
    """Return whether two marks tell of other code; those of two interpreters do not."""
    tags = {mark.partition(":")[0] for mark in (was, now)}
    return was != now and len(tags) == 1


def _parts(given: Any, seen: set[int]) -> Iterator[str]:
    if id(given) in seen:
        return
    seen.add(id(given))
    if isinstance(given, functools.partial):
        yield from _parts(given.func, seen)
        yield from map(_plain, [*given.args, *sorted(given.keywords.items())])
    elif isinstance(given, MethodType):
        yield from _parts(given.__func__, seen)
        yield from _attributes(given.__self__)
    elif isinstance(given, FunctionType):
        yield from _of_function(given, seen)
    elif isinstance(called := getattr_static(type(given), CALL, None), FunctionType):
        yield from _parts(called, seen)
        yield from _attributes(given)


def _of_function(function: FunctionType, seen: set[int]) -> Iterator[str]:
    yield from _of_code(function.__code__)
    yield _plain(function.__defaults__)
    yield _plain(sorted((function.__kwdefaults__ or {}).items()))
    around = [cell.cell_contents for cell in function.__closure__ or () if _full(cell)]
    module = function.__globals__
    used = [module[name] for name in _globals(function.__code__) if name in module]
    for one in (*around, *used):
        own = getattr(one, "__module__", None) == function.__module__
        if isinstance(one, FunctionType) and own:
            yield from _parts(one, seen)
        else:
            yield _plain(one)


def _full(cell: Any) -> bool:
    """Return whether a variable around a function has a value."""
    try:
        cell.cell_contents  # noqa: B018 - raises where it has none
    except ValueError:
        return False
    return True


def _of_code(code: CodeType) -> Iterator[str]:
    yield code.co_code.hex()
    yield repr((code.co_names, code.co_argcount, code.co_kwonlyargcount))
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from _of_code(constant)
        else:
            yield _plain(constant)


def _globals(code: CodeType) -> list[str]:
    """Return the names that a code looks up in its module, those of inner ones, too."""
    own = [i.argval for i in dis.get_instructions(code) if i.opname == "LOAD_GLOBAL"]
    inner = [c for c in code.co_consts if isinstance(c, CodeType)]
    return sorted({*own, *(name for one in inner for name in _globals(one))})


def _attributes(given: Any) -> Iterator[str]:
    yield from map(_plain, sorted(getattr(given, "__dict__", {}).items()))


def _plain(given: Any) -> str:
    """Return plain data as text; of what else there is, its name or else its type."""
    if isinstance(given, PLAIN):
        return repr(given)
    if isinstance(given, tuple | list):
        return f"{type(given).__name__}({', '.join(map(_plain, given))})"
    if isinstance(given, set | frozenset):
        return f"set({', '.join(sorted(map(_plain, given)))})"
    if isinstance(given, dict):
        pairs = sorted(f"{_plain(k)}: {_plain(v)}" for k, v in given.items())
        return f"dict({', '.join(pairs)})"
    if isinstance(given, np.ndarray | np.generic) and given.dtype.kind in "biufcSU":
        raw = hashlib.sha256(np.ascontiguousarray(given).tobytes()).hexdigest()
        return f"{given.dtype.str}{given.shape}{raw}"
    name = getattr(given, "__qualname__", None)
    return f"{given.__module__}.{name}" if name else type(given).__name__
