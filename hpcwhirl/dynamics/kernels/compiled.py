"""Decorators by which the kernels' functions are compiled by numba.

`kernel` makes a function callable from Python and from compiled code, `part` from
compiled code only, `inlined` a part that is copied into its callers, `rare` one that is
compiled for size, `by_numba` a function that makes arrays; `verb` and `does` choose a
function by the type of its first argument.

With a known release of numba, `compiler` compiles them, else `plain` does: see
`kernel_cache.is_plain`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numba import njit
from numba.core.registry import CPUDispatcher

from hpcwhirl.dynamics.kernel_cache import PLAIN, kept


def _decorators() -> Any:
    """Return the module that compiles: `plain` or `compiler`."""
    if PLAIN:
        from hpcwhirl.dynamics.kernels import plain

        return plain
    from hpcwhirl.dynamics.kernels import compiler

    return compiler


_made_by = _decorators()
kernel, part, inlined = _made_by.kernel, _made_by.part, _made_by.inlined
rare, rare_kernel = _made_by.rare, _made_by.rare_kernel


def by_numba(**options: Any) -> Callable[[Any], Any]:
    """Return a decorator that compiles a function which makes arrays, kept on disk.

    options : of `numba.njit`
    """
    make: Any = njit(error_model="numpy", **options)
    return lambda function: kept(make(function))


class Verb(CPUDispatcher):  # type: ignore[misc, unused-ignore]
    """A name for several compiled functions, one per type of first argument."""

    kinds: dict[type, Any]

    def __call__(self, first: Any, *rest: Any) -> Any:
        """Call the function for the type of `first`, the first argument."""
        return self.kinds[type(first)](first, *rest)

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """Return what numba needs to type a call of the function for these types."""
        return self._of(args).get_call_template(args, kws)

    def get_overload(self, sig: Any) -> Any:
        """Return the machine code of the function chosen for a signature."""
        return self._of(sig).get_overload(sig)

    def _of(self, args: Any) -> Any:
        return self.kinds[args[0].instance_class]


def verb(function: Any) -> Any:
    """Declare a name for several compiled functions, one per type of first argument.

    The decorated function gives name and docstring; `does` adds an implementation.
    """
    made: Any = njit(function)
    made.__class__, made.kinds = Verb, {}
    return made


def does(named: Any, kind: type) -> Callable[[Any], Any]:
    """Register the decorated compiled function as an implementation of a verb.

    named, kind : the verb; type of the first argument for which the function is called
    """

    def register(made: Any) -> Any:
        named.kinds[kind] = made
        return made

    return register
