"""Kernels compiled with less work than by `numba.njit`, by what is inside numba.

For every function numba makes an entry for Python, another for C, and machine code that
is optimised together with everything it calls, again at each level of calls. A *part*
has no entries, is typed and lowered once, and is optimised where it is linked. Where
numba inlines a function, it types a copy for each call; here LLVM inlines instead. To
type an operation, such as a sum of two numbers, numba tries some ten rules and words
why most do not apply; here its type is remembered for each kind of operands.

This depends on numba's inside: `compiled` imports it with a known release alone. The
functions it returns give the same bits as those of `plain`.
"""

from __future__ import annotations

import gc
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any, NoReturn

from llvmlite.binding import Linkage
from numba import njit
from numba.core import typed_passes, untyped_passes
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler
from numba.core.compiler_machinery import PassManager
from numba.core.registry import CPUDispatcher
from numba.core.types import unliteral
from numba.core.types.functions import BaseFunction

from hpcwhirl.dynamics.kernel_cache import kept

numba_njit: Any = njit  # Any: its type hints lack the options used below
ENTRY = "_ZN7cpython"  # prefix of the mangled names of entries for Python


@contextmanager
def _no_collection() -> Iterator[None]:
    """Switch Python's garbage collection off while numba compiles.

    The compiler makes many objects, among which a collection is slow.
    """
    was = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was:
            gc.enable()


Operation: Any = BaseFunction  # numba's type of sums, products, square roots, ...
TYPED: dict[int, tuple[Any, dict[Any, Any]]] = {}  # {id: (operation, its types)}
type_of_call = Operation.get_call_type  # numba's own


def known_type(operation: Any, context: Any, args: Any, kws: Any) -> Any:
    """Return the signature of an operation of numba, which it works out only once.

    One that numba implements by compiling a function of its own is not remembered: its
    code depends on the caller's options.
    """
    _, known = TYPED.setdefault(id(operation), (operation, {}))
    key = (context, *args, *kws.items())
    found = known.get(key)
    if found is None:
        found = type_of_call(operation, context, args, kws)
        if operation._impl_keys.get(found.args) is operation.typing_key:
            known[key] = found
    return found


@contextmanager
def _types_known() -> Iterator[None]:
    """Let numba work out the type of each operation once, while a kernel compiles."""
    before = Operation.get_call_type
    Operation.get_call_type = known_type
    try:
        yield
    finally:
        Operation.get_call_type = before


class KernelLibrary(JITCodeLibrary):  # type: ignore[misc, unused-ignore]
    """Numba's container of a function's compiled code, optimised in a single pass.

    The code has no reference counts; numba's further passes only look for those that
    cancel.
    """

    def _optimize_functions(self, ll_module: Any) -> None:
        ll_module.data_layout = self._codegen._data_layout
        for function in ll_module.functions:
            if not function.is_declaration and self._is_rare(function.name):
                function.add_function_attribute("optsize")  # no loop in two versions

    def _is_rare(self, name: str) -> bool:
        return name.startswith(ENTRY)

    def finalize(self) -> None:
        """Link each part that is called, also by a part, once; optimise all."""
        _link_called(self, self._final_module)
        self._linking_libraries = []
        super().finalize()

    def _optimize_final_module(self) -> None:
        manager, builder = self._codegen._module_pass_manager()
        manager.run(self._final_module, builder)


def _link_called(library: Any, module: Any) -> None:
    """Link into a module what the code of a library calls, directly or not.

    What calls comes before what is called: LLVM leaves out what nothing calls yet.
    """
    called: dict[Any, None] = {}

    def add(calling: Any) -> None:
        for other in reversed(calling._linking_libraries):
            if other not in called:
                if isinstance(other, PartLibrary):
                    add(other)
                called[other] = None

    add(library)
    for other in reversed(called):
        library._reload_init.update(other._reload_init)
        is_part = isinstance(other, PartLibrary)
        code = other._final_module if is_part else other._get_module_for_linking()
        module.link_in(code, preserve=True)


class PartLibrary(KernelLibrary):
    """Code of one function, which its callers link into theirs and optimise there.

    The library holds the function as the compiler has lowered it, which cannot run.
    """

    def finalize(self) -> None:
        """Link nothing: a kernel links this and all that this calls."""
        for function in self._final_module.functions:
            if not function.is_declaration and function.linkage == Linkage.external:
                function.linkage = "linkonce_odr"  # many link it
        self._finalized = True

    def _get_module_for_linking(self) -> Any:
        """Return the code with all that it calls, for a function of `numba.njit`."""
        if self._shared_module is None:
            self._shared_module = self._final_module.clone()
            _link_called(self, self._shared_module)
        return self._shared_module

    @property
    def codegen(self) -> Any:
        """Return this container itself; numba then calls its `set_env`."""
        return self

    def set_env(self, *_: Any) -> None:
        """Do nothing, where numba would set an environment for calls from Python."""

    def get_pointer_to_function(self, _: str) -> int:
        """Return 0 instead of the machine code's address: callers link the code."""
        self._ensure_finalized()
        return 0


class RareLibrary(PartLibrary):
    """Container of a part that runs in few steps: optimised for size, not speed."""

    def _is_rare(self, _: str) -> bool:
        return True


class Steps(PassManager):  # type: ignore[misc, unused-ignore]
    """Numba's list of the steps of a compilation, here with those that kernels need.

    Numba has 27, among them some for closures, generators and loops over tuples of
    several types, and analyses the code anew after each.
    """

    def _runPass(self, _: int, step: Any, state: Any) -> None:
        step.analysis = self._analysis
        step.run_pass(state)


STEPS = Steps("kernel")
for step in (
    untyped_passes.TranslateByteCode,
    untyped_passes.FixupArgs,
    untyped_passes.IRProcessing,
    untyped_passes.RewriteSemanticConstants,
    untyped_passes.DeadBranchPrune,
    untyped_passes.GenericRewrites,
    untyped_passes.ReconstructSSA,
    typed_passes.NopythonTypeInference,
    typed_passes.PreLowerStripPhis,
    typed_passes.IRLegalization,
    typed_passes.NativeLowering,
    typed_passes.NoPythonBackend,
):
    STEPS.add_pass(step, step.__name__)
STEPS.finalize()


class KernelCompiler(Compiler):  # type: ignore[misc, unused-ignore]
    """Numba's compiler, with another way to optimise and link the machine code.

    library : class of numba's code library (the object that optimises and links the
        LLVM code of a function); numba itself uses `JITCodeLibrary`
    """

    library: type[JITCodeLibrary] = KernelLibrary

    def define_pipelines(self) -> list[PassManager]:
        """Return lists of steps, of which the first that succeeds counts."""
        return [STEPS]

    def _compile_bytecode(self) -> Any:
        state = self.state
        name = state.func_id.func_qualname
        state.library = self.library(state.targetctx.codegen(), name)
        state.library.enable_object_caching()
        return super()._compile_bytecode()


class PartCompiler(KernelCompiler):
    """Numba's compiler of functions for compiled callers only, see `PartLibrary`."""

    library = PartLibrary


class RareCompiler(KernelCompiler):
    """Numba's compiler of parts that run in few steps, see `RareLibrary`."""

    library = RareLibrary


class Part(CPUDispatcher):  # type: ignore[misc, unused-ignore]
    """A compiled function for compiled callers only; it has no entry for Python."""

    def __call__(self, *_: Any, **__: Any) -> NoReturn:
        """Raise TypeError: only compiled code can call this function, not Python."""
        msg = f"{self.py_func.__name__} is for compiled code alone"
        raise TypeError(msg)

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """Return what numba needs to type a call, with literals as plain types."""
        return super().get_call_template([unliteral(arg) for arg in args], kws)


class Kernel(CPUDispatcher):  # type: ignore[misc, unused-ignore]
    """A compiled function for Python; compiled callers use its variant `twin`."""

    twin: Any  # the same function compiled as a `Part`

    def compile(self, sig: Any) -> Any:
        """Compile the function for a signature, with what makes numba faster."""
        with _no_collection(), _types_known():
            return super().compile(sig)

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """Return what numba needs to type a call of `twin` by compiled code."""
        return self.twin.get_call_template(args, kws)

    def get_overload(self, sig: Any) -> Any:
        """Return the machine code of `twin` for a signature, for compiled callers."""
        return self.twin.get_overload(sig)


COMMON = {"error_model": "numpy", "no_cfunc_wrapper": True, "_nrt": False}


def kernel(function: Any, twin: Callable[[Any], Part] | None = None) -> Any:
    """Compile a function that makes no arrays, for Python and for compiled callers.

    twin : decorator that compiles the variant for compiled callers; None: `part`
    """
    made = numba_njit(forceinline=False, pipeline_class=KernelCompiler, **COMMON)(
        function
    )
    made.__class__ = Kernel
    made.twin = (twin or part)(function)
    return kept(made)


def part(
    function: Any, *, inline: bool = False, compiler: type[Compiler] = PartCompiler
) -> Any:
    """Compile a function that makes no arrays, for compiled callers only.

    inline : whether to copy its code into each caller
    compiler : class of numba's compiler to use
    """
    made = numba_njit(
        no_cpython_wrapper=True, forceinline=inline, pipeline_class=compiler, **COMMON
    )(function)
    made.__class__ = Part
    return made


def rare(function: Any) -> Any:
    """Compile a part that runs in few steps: for short code instead of speed."""
    return part(function, compiler=RareCompiler)


def inlined(function: Any) -> Any:
    """Compile a part whose code is copied into each of its callers."""
    return part(function, inline=True)


rare_kernel = partial(kernel, twin=rare)
