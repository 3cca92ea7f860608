"""The fingerprint of a user's function `measure`: it changes if the function changes.

So a campaign cannot mix numbers of two functions. The fingerprint has two parts: the
SHA-256 of the source files in which the function, and the functions that it names, are
written; and the SHA-256 of the bytecode and of all values that the function can use:
defaults, closures, arguments of `functools.partial`, attributes, class constants and
the globals that the code names. It does not cover other modules: installed packages,
and modules that a user's own module imports.
"""

from __future__ import annotations

import copyreg
import dis
import functools
import hashlib
import linecache
import site
import sys
import sysconfig
import weakref
from collections.abc import Callable, Iterator
from inspect import getattr_static
from pathlib import Path
from types import (
    BuiltinFunctionType,
    CodeType,
    FunctionType,
    GetSetDescriptorType,
    MappingProxyType,
    MemberDescriptorType,
    MethodType,
    ModuleType,
    WrapperDescriptorType,
)
from typing import Any

import numpy as np

from hpcwhirl.errors import InputError, shown

CALL = "__call__"
# attributes in which wraps and lru_cache, njit, vectorize keep the function
INNER = ("__wrapped__", "py_func", "pyfunc")
PLAIN = (int, float, complex, str, bytes, bool, type(None), type(...))
SLOTS = (GetSetDescriptorType, MemberDescriptorType, weakref.ReferenceType)
UNTOLD = {"__dict__", "__weakref__", "__doc__", "__module__", "__firstlineno__"}
OWN = Path(__file__).parents[1]
VERSION = "version"
MOST_LETTERS = 200
REMEDY = (
    'give version="1", and another version whenever the measure changes: '
    "then only versions are compared"
)


class _UnknownError(Exception):
    """Raised for a value, used by a user's function, that runs cannot compare."""


def fingerprint(function: Any, version: object = None) -> str:
    """Return the fingerprint of a user's function, a text that is stored and compared.

    Parameters
    ----------
    function : a function, method, partial function or callable object
    version : a text or whole number that the user changes with the function; None:
        source, code and values are compared

    Returns
    -------
    "version TEXT", or the interpreter, the SHA-256 of code and values, and that of the
    source files, separated by colons

    Raises
    ------
    InputError
        if the version is invalid; or if none is given, and a value that the function
        uses cannot be compared, or its source cannot be read
    """
    if version is not None:
        return f"{VERSION} {_checked(version)}"
    walk = _Walk()
    try:
        _source_of(function)
        values = walk.digest(function)
    except (_UnknownError, RecursionError) as failed:
        why = "it is nested too deep" if isinstance(failed, RecursionError) else failed
        msg = f"measure cannot be identified by its content: {why}; {REMEDY}"
        raise InputError(msg) from None
    sources = hashlib.sha256("".join(sorted(walk.sources)).encode()).hexdigest()
    return f"{sys.implementation.cache_tag}:{values}:{sources}"


def difference(was: str, now: str) -> str:
    """Return what differs between two fingerprints, as a phrase for a message.

    "" if they are equal or the first is unknown; code and values are compared only if
    both are from the same version of Python.

    was, now : the stored fingerprint, and that of the function of this call
    """
    if was == now or not was:
        return ""
    one, other = was.split(":"), now.split(":")
    if len(one) != 3 or len(other) != 3:
        return f"its {VERSION}"
    if one[2] != other[2]:
        return "its source file"
    return "" if one[0] != other[0] else "its code, or a value that it uses,"


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


def _source_of(function: Any) -> None:
    """Check that the source text of a user's function can be read.

    Raises
    ------
    _UnknownError
        naming the function, if it cannot
    """
    called = function
    while not isinstance(called, FunctionType):
        called = _within(called)
        if called is None:
            raise _UnknownError(f"{_name(function)} is not written in Python")
    if not _text_of(called.__code__):
        raise _UnknownError(f"the source of {_name(called)} cannot be read")


def _within(called: Any) -> Any:
    """Return the function inside a wrapper or callable object; None if unknown."""
    if isinstance(called, functools.partial):
        return called.func
    if isinstance(called, MethodType):
        return called.__func__
    if (inner := _wrapped(called)) is not None:
        return inner
    if isinstance(called, type):
        own = (one for one in vars(called).values() if isinstance(one, FunctionType))
        return next(own, None)
    own = getattr_static(type(called), CALL, None)
    return None if isinstance(own, WrapperDescriptorType) else own


def _attribute(given: Any, name: str) -> Any:
    """Return an object's attribute by its name; None if there is none or it raises."""
    try:
        return getattr(given, name, None)
    except Exception:  # noqa: BLE001 - what a user's property raises is no attribute
        return None


def _wrapped(given: Any) -> Any:
    """Return the function inside a wrapper made by `wraps` or numba, else None.

    given : the wrapper, or any other object
    """
    if isinstance(given, MethodType):
        return None
    return next(filter(callable, (_attribute(given, n) for n in INNER)), None)


def _name(given: Any) -> str:
    """Return how a function or value is called in messages: by its name or its type."""
    own = _attribute(given, "__qualname__")
    return own if isinstance(own, str) else f"a {type(given).__qualname__}"


def _text_of(code: CodeType) -> str:
    """Return the text of a code object's source file; in a notebook, of its cell."""
    linecache.checkcache(code.co_filename)
    return "".join(linecache.getlines(code.co_filename))


@functools.cache
def _installed() -> tuple[Path, ...]:
    """Return the folders of hpcwhirl, the standard library and installed packages.

    Functions in modules outside these folders are the user's own.
    """
    known = [sysconfig.get_path(name) for name in ("stdlib", "platstdlib")]
    known += [sysconfig.get_path(name) for name in ("purelib", "platlib")]
    return (OWN, *map(Path, [*known, site.getusersitepackages()]))


def _is_own(module: str) -> bool:
    """Return whether a module is the user's own, not installed; `__main__` is.

    module : name of the module
    """
    file = getattr(sys.modules.get(module), "__file__", None)
    if module == "__main__":
        return True
    if file is None:  # a notebook's module, or a built-in one
        return str(module).partition(".")[0] not in sys.stdlib_module_names
    path = Path(file).resolve()
    return not any(path.is_relative_to(folder) for folder in _installed())


class _Walk:
    """Computes the digests of all objects that a user's function can reach.

    It follows code, values, attributes and globals, and visits every object once.
    """

    def __init__(self) -> None:
        self.sources: set[str] = set()  # SHA-256 of each file
        self._known: dict[int, str] = {}
        self._kept: list[Any] = []  # kept alive, so that their ids are not reused
        self._open: set[int] = set()

    def digest(self, given: Any) -> str:
        """Return the SHA-256 of an object's content, not of its address in memory."""
        number = id(given)
        if number in self._open:  # it contains itself
            return f"around {type(given).__qualname__}"
        if number not in self._known:
            self._open.add(number)
            try:
                found = hashlib.sha256()
                for part in self._parts(given):
                    found.update(f"{len(part)} {part}".encode("utf-8", "surrogatepass"))
            finally:
                self._open.discard(number)
            self._known[number] = found.hexdigest()
            self._kept.append(given)
        return self._known[number]

    def _parts(self, given: Any) -> Iterator[str]:
        """Yield an object's type and content as texts, whose hash is its digest."""
        kind = type(given)
        yield f"{kind.__module__}.{kind.__qualname__}"
        if kind in PLAIN:
            yield repr(given)
        elif kind in (tuple, list):
            yield from map(self.digest, given)
        elif kind in (set, frozenset):
            yield from sorted(map(self.digest, given))
        elif kind in (dict, MappingProxyType):
            yield from sorted(self.digest(k) + self.digest(v) for k, v in given.items())
        elif kind is np.ndarray or isinstance(given, np.generic):
            yield from self._of_array(given)
        else:
            ways = (way for kinds, way in WAYS if isinstance(given, kinds))
            yield from next(ways, _Walk._of_object)(self, given)

    def _of_array(self, given: Any) -> Iterator[str]:
        yield f"{given.dtype} {given.shape}"
        if given.dtype.hasobject:
            yield from map(self.digest, np.asarray(given).ravel().tolist())
        else:
            yield hashlib.sha256(np.ascontiguousarray(given).tobytes()).hexdigest()

    def _of_descriptor(self, given: Any) -> Iterator[str]:
        """Yield digests of the functions in a property, static or class method."""
        names = ("fget", "fset", "fdel", "func", "__func__")
        yield from (self.digest(_attribute(given, name)) for name in names)

    def _state(self, given: Any) -> str:
        """Return the digest of the attributes set on a function or wrapper."""
        own = {n: v for n, v in vars(given).items() if n not in UNTOLD}
        return self.digest(own)

    def _of_function(self, given: FunctionType) -> Iterator[str]:
        yield f"{given.__module__}.{given.__qualname__}"
        if not _is_own(given.__module__) and not given.__closure__:
            return  # a function of an installed package: not followed
        yield from self._of_code(given.__code__)
        yield self.digest((given.__defaults__, given.__kwdefaults__))
        yield self._state(given)
        yield from (self._of_cell(cell) for cell in given.__closure__ or ())
        if _is_own(given.__module__):
            yield from self._of_globals(given)

    def _of_globals(self, given: FunctionType) -> Iterator[str]:
        module = given.__globals__
        for name in _globals(given.__code__):
            if name in module:
                yield name
                yield self.digest(module[name])

    def _of_cell(self, cell: Any) -> str:
        try:
            return self.digest(cell.cell_contents)
        except ValueError:  # a variable that has no value yet
            return ""

    def _of_code(self, given: CodeType) -> Iterator[str]:
        text = _text_of(given)
        if text:
            plain = "\n".join(text.splitlines())
            data = plain.encode("utf-8", "surrogatepass")
            self.sources.add(hashlib.sha256(data).hexdigest())
        yield given.co_code.hex()
        yield repr((given.co_names, given.co_argcount, given.co_kwonlyargcount))
        yield from map(self.digest, given.co_consts)

    def _of_class(self, given: type) -> Iterator[str]:
        yield f"{given.__module__}.{given.__qualname__}"
        if not _is_own(given.__module__):
            return
        yield from map(self.digest, given.__bases__)
        for name, value in sorted(vars(given).items()):
            if name not in UNTOLD and not name.startswith("_abc_"):
                yield name
                yield self.digest(value)

    def _of_module(self, given: ModuleType) -> Iterator[str]:
        """Yield a module's name; record the hash of its file if it is the user's.

        The modules that it imports are not followed.
        """
        yield given.__name__
        file = getattr(given, "__file__", None)
        if file is not None and _is_own(given.__name__):
            self.sources.add(hashlib.sha256(_read(file)).hexdigest())

    def _of_builtin(self, given: BuiltinFunctionType) -> Iterator[str]:
        yield given.__qualname__
        yield self.digest(given.__self__)

    def _of_object(self, given: Any) -> Iterator[str]:
        own = _is_own(type(given).__module__)
        inner = None if own else _wrapped(given)
        if inner is not None:  # the rest is compiled code and caches
            yield self.digest(inner)
        else:
            yield self.digest(type(given))
            yield from map(self.digest, _reduced(given))


DESCRIPTORS = (property, functools.cached_property, staticmethod, classmethod)
WAYS: tuple[tuple[Any, Callable[[_Walk, Any], Iterator[str]]], ...] = (
    (FunctionType, _Walk._of_function),
    (CodeType, _Walk._of_code),
    (type, _Walk._of_class),
    (ModuleType, _Walk._of_module),
    (BuiltinFunctionType, _Walk._of_builtin),
    (DESCRIPTORS, _Walk._of_descriptor),
    (SLOTS, lambda _, given: iter([_name(given)])),
)


def _reduced(given: Any) -> Iterator[Any]:
    """Yield the parts (class, arguments, state) from which pickle rebuilds an object.

    Nothing is rebuilt; the parts stand for the object's content.

    Raises
    ------
    _UnknownError
        if the object cannot be pickled, such as an open file
    """
    if isinstance(given, MethodType):
        yield from (given.__func__, given.__self__)
        return
    try:
        way = copyreg.dispatch_table.get(type(given))
        made = way(given) if way else given.__reduce_ex__(2)
    except Exception:  # noqa: BLE001 - whatever a class says of itself
        made = None
    if isinstance(made, str):
        yield made
        return
    if not isinstance(made, tuple):
        msg = f"it uses {_name(given)}, which has no value that could be compared"
        raise _UnknownError(msg)
    for part in made:
        yield list(part) if isinstance(part, Iterator) else part


def _globals(code: CodeType) -> list[str]:
    """Return the names of globals that a code object, or code inside it, reads."""
    seen = ("LOAD_GLOBAL", "LOAD_NAME")
    own = [i.argval for i in dis.get_instructions(code) if i.opname in seen]
    inner = [c for c in code.co_consts if isinstance(c, CodeType)]
    return sorted({*own, *(name for one in inner for name in _globals(one))})


def _read(file: str) -> bytes:
    try:
        return Path(file).read_bytes()
    except OSError:
        raise _UnknownError(f"{file} cannot be read") from None
