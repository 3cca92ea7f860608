"""Ways to compile the kernels' functions: callable from Python, as a part, or inline.

For every function numba makes an entry for Python, another for C, and machine code that
is optimised together with everything it calls, again at each level of calls. A *part*
is a function that only compiled code calls: it has no entries, is typed and lowered
once, and is optimised where it is linked. Where numba inlines a function, it types a
copy for each call; here LLVM inlines instead.

This depends on internals of numba. HPCWHIRL_PLAIN_NUMBA=1 compiles the same functions
with `numba.njit` only: the same bits, but slower to compile and to run, for another
processor, another release of numba, or a debugger.
"""

from __future__ import annotations

import gc
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any, NoReturn

from numba import njit
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.core.registry import CPUDispatcher
from numba.core.types import unliteral

numba_njit: Any = njit  # Any: its type hints lack the options used below
PLAIN = os.environ.get("HPCWHIRL_PLAIN_NUMBA", "0") not in {"", "0"}
ENTRY = "_ZN7cpython"  # prefix of the mangled names of entries for Python


@contextmanager
def _no_collection() -> Iterator[None]:
    """Switch garbage collection off, which the compiler's many objects make slow."""
    was = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was:
            gc.enable()


class KernelLibrary(JITCodeLibrary):  # type: ignore[misc, unused-ignore]
    """Compiled code without reference counts, optimised in a single pass.

    Numba's further passes only look for reference counts that cancel.
    """

    def _optimize_functions(self, ll_module: Any) -> None:
        ll_module.data_layout = self._codegen._data_layout
        for function in ll_module.functions:
            if not function.is_declaration and self._is_rare(function.name):
                function.add_function_attribute("optsize")  # no loop in two versions

    def _is_rare(self, name: str) -> bool:
        return name.startswith(ENTRY)

    def _optimize_final_module(self) -> None:
        manager, builder = self._codegen._module_pass_manager()
        manager.run(self._final_module, builder)


class PartLibrary(KernelLibrary):
    """Code that is linked into callers as it was lowered, and not executable itself."""

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True

    @property
    def codegen(self) -> Any:
        """Return this library itself; numba then calls its `set_env`."""
        return self

    def set_env(self, *_: Any) -> None:
        """Do nothing: numba sets an environment for calls, and there are none."""

    def get_pointer_to_function(self, _: str) -> int:
        """Return 0, since callers link the code and need no address."""
        self._ensure_finalized()
        return 0


class RareLibrary(PartLibrary):
    """Code of a part that runs in few steps, compiled for size instead of speed."""

    def _is_rare(self, _: str) -> bool:
        return True


class KernelCompiler(Compiler):  # type: ignore[misc, unused-ignore]
    """Numba's compiler, with its code in a library of the type `library`."""

    library: type[JITCodeLibrary] = KernelLibrary

    def _compile_bytecode(self) -> Any:
        state = self.state
        name = state.func_id.func_qualname
        state.library = self.library(state.targetctx.codegen(), name)
        state.library.enable_object_caching()
        return super()._compile_bytecode()


class PartCompiler(KernelCompiler):
    """Compiler of functions that only compiled code calls, see `PartLibrary`."""

    library = PartLibrary


class RareCompiler(KernelCompiler):
    """Numba's compiler of rare parts, see `RareLibrary`."""

    library = RareLibrary


class Part(CPUDispatcher):  # type: ignore[misc, unused-ignore]
    """A function that only compiled code can call; it has no entry for Python."""

    def __call__(self, *_: Any, **__: Any) -> NoReturn:
        """Raise TypeError, since there is no entry for Python."""
        msg = f"{self.py_func.__name__} is for compiled code alone"
        raise TypeError(msg)

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """Return what numba needs to type a call; of constants only the type counts."""
        return super().get_call_template([unliteral(arg) for arg in args], kws)


class Kernel(CPUDispatcher):  # type: ignore[misc, unused-ignore]
    """A function that Python can call; compiled code calls a `Part` of it, `twin`."""

    twin: Any  # the same function compiled as a `Part`

    def compile(self, sig: Any) -> Any:
        """Compile as numba does, but without garbage collection meanwhile."""
        with _no_collection():
            return super().compile(sig)

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """Return what numba needs to type a call by compiled code: that of `twin`."""
        return self.twin.get_call_template(args, kws)

    def get_overload(self, sig: Any) -> Any:
        """Return the machine code of `twin` for a signature: compiled code calls it."""
        return self.twin.get_overload(sig)


class Verb(Part):
    """A compiled function, implemented for each type of its first argument."""

    kinds: dict[type, Any]

    def __call__(self, first: Any, *rest: Any) -> Any:
        """Call the implementation for the type of `first`, the first argument."""
        return self.kinds[type(first)](first, *rest)

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """Return what numba needs to type a call: that of the chosen implementation."""
        return self._of(args).get_call_template(args, kws)

    def get_overload(self, sig: Any) -> Any:
        """Return the machine code of the implementation for a signature."""
        return self._of(sig).get_overload(sig)

    def _of(self, args: Any) -> Any:
        return self.kinds[args[0].instance_class]


COMMON = {"error_model": "numpy", "no_cfunc_wrapper": True, "_nrt": False}


def kernel(function: Any, twin: Callable[[Any], Part] | None = None) -> Any:
    """Compile a function that makes no arrays, for Python and for compiled functions.

    twin : decorator that compiles the variant for compiled callers; None: `part`
    """
    if PLAIN:
        return numba_njit(cache=True, error_model="numpy")(function)
    made = numba_njit(
        cache=True, forceinline=False, pipeline_class=KernelCompiler, **COMMON
    )(function)
    made.__class__ = Kernel
    made.twin = (twin or part)(function)
    return made


def part(
    function: Any, *, inline: bool = False, compiler: type[Compiler] = PartCompiler
) -> Any:
    """Compile a function that makes no arrays, for other compiled functions only."""
    if PLAIN:
        return numba_njit(error_model="numpy")(function)
    made = numba_njit(
        no_cpython_wrapper=True, forceinline=inline, pipeline_class=compiler, **COMMON
    )(function)
    made.__class__ = Part
    return made


def rare(function: Any) -> Any:
    """Compile a part that does not run in every step, for short code, not for speed."""
    return part(function, compiler=RareCompiler)


def inlined(function: Any) -> Any:
    """Compile a part that is inlined into each of its callers."""
    return part(function, inline=True)


def verb(function: Any) -> Any:
    """Declare a name for several parts or kernels, one per type of first argument.

    The decorated function gives name and docstring; `does` adds an implementation.
    """
    made = numba_njit(function)
    made.__class__, made.kinds = Verb, {}
    return made


def does(named: Any, kind: type) -> Callable[[Any], Any]:
    """Register the decorated part as an implementation of the verb `named`.

    kind : type of the first argument for which it is used
    """

    def register(made: Any) -> Any:
        named.kinds[kind] = made
        return made

    return register


rare_kernel = partial(kernel, twin=rare)
