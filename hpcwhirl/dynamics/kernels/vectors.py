"""Vectors of four doubles as values of compiled code: type `Four` and its operations.

Numba leaves vectorisation to the compiler, which must first prove that no two arrays
overlap, and whose rounding depends on how it contracts products and sums. `Four` is an
LLVM vector: operations are computed as written, with `fma` only where it is called, in
the same order on every machine.

Sums of rows of a table, each row times a factor, are computed for two or six vectors at
a time: a fused multiply-add waits for the preceding one of the same sum, and six sums
at once keep both units of a core busy. The terms of a sum are added in the order of the
rows listed in the argument `which`.
"""

from __future__ import annotations

import operator
from collections.abc import Sequence
from typing import Any

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.core.imputils import lower_builtin
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, models, register_model
from numpy.typing import NDArray

from hpcwhirl.dynamics.kernels.compiled import inlined

FOUR = 4
EIGHT = 2 * FOUR  # modes and folded blades are padded to a multiple of this
ROW = 2 * EIGHT  # numbers that `whole.four_sums` multiplies at once
LINE = 64  # bytes of a cache line
_VECTOR = ir.VectorType(ir.DoubleType(), FOUR)


def widths(blades: int) -> tuple[int, int]:
    """Return (k, wide): padded lengths of a spectrum's real part, and of half the gaps.

    Both are N // 2 + 1, rounded up to a multiple of four: a spectrum has k nodal
    diameters, and an array of all gaps in folded order is (2 wide,), see
    `loop.circulant.folded`.
    """
    slots = -(-(blades // 2 + 1) // FOUR) * FOUR
    return slots, slots


def aligned(values: NDArray[Any]) -> NDArray[Any]:
    """Return a copy of an array that begins at a cache line of 64 bytes.

    So no vector of four doubles spans two cache lines, which changes the time of a step
    by up to a third.
    """
    return all_aligned([values])[0]


def all_aligned(arrays: Sequence[NDArray[Any]]) -> list[NDArray[Any]]:
    """Return copies of arrays that begin at cache lines, in one block of memory."""
    spans = [-(-values.nbytes // LINE) * LINE for values in arrays]
    room = np.empty(sum(spans) + LINE, np.uint8)
    place, out = -room.__array_interface__["data"][0] % LINE, []
    for values, span in zip(arrays, spans, strict=True):
        copy: NDArray[Any] = np.ndarray(values.shape, values.dtype, room, place)
        copy[...] = values
        out.append(copy)
        place += span
    return out


def aligned_zeros(*lengths: int) -> list[NDArray[np.float64]]:
    """Return arrays of zeros, (n,) each, that begin at cache lines, in one block."""
    each, out = LINE // 8, []
    room = np.zeros(sum(lengths) + each * (1 + len(lengths)))
    place = -room.__array_interface__["data"][0] % LINE // 8
    for n in lengths:
        out.append(room[place : place + n])
        place += -(-n // each) * each
    return out


class Four(types.Type):
    """Numba's type of a vector of four doubles."""

    def __init__(self) -> None:
        super().__init__(name="Four")


four = Four()


@register_model(Four)
class _FourModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _VECTOR)


def _data(context: Any, builder: Any, kind: Any, array: Any) -> Any:
    return context.make_array(kind)(context, builder, array).data


def _place(context: Any, builder: Any, kind: Any, array: Any, index: Any) -> Any:
    data = _data(context, builder, kind, array)
    return builder.bitcast(builder.gep(data, [index]), _VECTOR.as_pointer())


@intrinsic
def load(typing: Any, array: Any, index: Any) -> Any:
    """Return the four doubles array[index : index + 4] as a vector.

    array : (n,) of doubles; the index is not checked
    """
    del typing, index

    def code(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        value = builder.load(_place(context, builder, sig.args[0], *args))
        value.align = 8
        return value

    return four(array, types.intp), code


@intrinsic
def store(typing: Any, array: Any, index: Any, value: Any) -> Any:
    """Write a vector of four doubles to array[index : index + 4].

    array : (n,) of doubles; the index is not checked
    """
    del typing, index, value

    def code(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        place = _place(context, builder, sig.args[0], *args[:2])
        builder.store(args[2], place).align = 8
        return context.get_dummy_value()

    return types.void(array, types.intp, four), code


def _broadcast(builder: Any, value: Any) -> Any:
    empty, whole = ir.Constant(_VECTOR, ir.Undefined), ir.IntType(32)
    first = builder.insert_element(empty, value, ir.Constant(whole, 0))
    zeros = ir.Constant(ir.VectorType(whole, FOUR), [0] * FOUR)
    return builder.shuffle_vector(first, empty, zeros)


@intrinsic
def broadcast(typing: Any, value: Any) -> Any:
    """Return a vector of four doubles that are all equal to `value`."""
    del typing, value

    def code(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        del context, sig
        return _broadcast(builder, args[0])

    return four(types.float64), code


def _call(builder: Any, name: str, *args: Any) -> Any:
    kind = ir.FunctionType(_VECTOR, [_VECTOR] * len(args))
    full = f"llvm.{name}.v{FOUR}f64"
    function = cgutils.get_or_insert_function(builder.module, kind, full)
    return builder.call(function, args)


def _intrinsic(name: str, count: int) -> Any:
    def code(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        del context, sig
        return _call(builder, name, *args)

    return four(*[four] * count), code


@intrinsic
def fma(typing: Any, a: Any, b: Any, c: Any) -> Any:
    """Return a b + c of vectors, element by element, each rounded once."""
    del typing, a, b, c
    return _intrinsic("fma", 3)


@intrinsic
def fnma(typing: Any, a: Any, b: Any, c: Any) -> Any:
    """Return c - a b of vectors, element by element, each rounded once."""
    del typing, a, b, c

    def code(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        del context, sig
        minus = builder.fsub(ir.Constant(_VECTOR, [-0.0] * FOUR), args[0])
        return _call(builder, "fma", minus, *args[1:])

    return four(four, four, four), code


@intrinsic
def lower_of(typing: Any, a: Any, b: Any) -> Any:
    """Return the elementwise minimum of two vectors of four doubles.

    If one double of a pair is NaN, the other one is returned.
    """
    del typing, a, b
    return _intrinsic("minnum", 2)


@intrinsic
def higher_of(typing: Any, a: Any, b: Any) -> Any:
    """Return the elementwise maximum of two vectors of four doubles.

    If one double of a pair is NaN, the other one is returned.
    """
    del typing, a, b
    return _intrinsic("maxnum", 2)


@intrinsic
def magnitude(typing: Any, a: Any) -> Any:
    """Return the absolute values of the four doubles of a vector."""
    del typing, a
    return _intrinsic("fabs", 1)


@intrinsic
def root(typing: Any, a: Any) -> Any:
    """Return the square roots of the four doubles of a vector."""
    del typing, a
    return _intrinsic("sqrt", 1)


@intrinsic
def element(typing: Any, a: Any, index: Any) -> Any:
    """Return the double number `index`, 0 .. 3, of a vector."""
    del typing, a, index

    def code(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        del context, sig
        return builder.extract_element(args[0], args[1])

    return types.float64(four, types.intp), code


@intrinsic
def reverse(typing: Any, a: Any) -> Any:
    """Return a vector with its four doubles in reverse order."""
    del typing, a

    def code(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        del context, sig
        order = ir.Constant(ir.VectorType(ir.IntType(32), FOUR), [3, 2, 1, 0])
        return builder.shuffle_vector(args[0], args[0], order)

    return four(four), code


@intrinsic(prefer_literal=True)
def room(typing: Any, size: Any) -> Any:
    """Return an uninitialised array (size,) of doubles on the stack, as work space.

    It ceases to exist when the function that calls `room` returns. size : a constant
    """
    del typing
    kind = types.Array(types.float64, 1, "C")

    def code(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        del args
        count = sig.args[0].literal_value
        data = cgutils.alloca_once(builder, ir.DoubleType(), count)
        data.align = LINE
        array = context.make_array(kind)(context, builder)
        shape, item = context.get_constant(types.intp, count), 8
        context.populate_array(
            array, data=data, shape=[shape],
            strides=[context.get_constant(types.intp, item)],
            itemsize=context.get_constant(types.intp, item), meminfo=None,
        )  # fmt: skip
        return array._getvalue()

    return kind(size), code


@intrinsic
def get(typing: Any, array: Any, index: Any) -> Any:
    """Return array[index] without checking the index, which must be >= 0.

    array : (n,), of any type of number
    """
    del typing, index

    def code(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        data = _data(context, builder, sig.args[0], args[0])
        return builder.load(builder.gep(data, [args[1]]))

    return array.dtype(array, types.intp), code


@intrinsic
def put(typing: Any, array: Any, index: Any, value: Any) -> Any:
    """Set array[index] = value without checking the index, which must be >= 0.

    array : (n,), of any type of number
    """
    del typing, index, value

    def code(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        data = _data(context, builder, sig.args[0], args[0])
        builder.store(args[2], builder.gep(data, [args[1]]))
        return context.get_dummy_value()

    return types.void(array, types.intp, array.dtype), code


def _arithmetic(symbol: Any, instruction: str) -> None:
    @infer_global(symbol)
    class Template(AbstractTemplate):  # type: ignore[misc, unused-ignore]
        def generic(self, args: Any, kws: Any) -> Any:
            del kws
            return signature(four, four, four) if args == (four, four) else None

    @lower_builtin(symbol, Four, Four)  # type: ignore[untyped-decorator, unused-ignore]
    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        del context, sig
        return getattr(builder, instruction)(*args)


for _symbol, _instruction in (
    (operator.add, "fadd"),
    (operator.iadd, "fadd"),
    (operator.sub, "fsub"),
    (operator.isub, "fsub"),
    (operator.mul, "fmul"),
    (operator.imul, "fmul"),
    (operator.truediv, "fdiv"),
):
    _arithmetic(_symbol, _instruction)


@inlined
def total_of(four):
    """Return the sum of the four doubles of a vector."""
    return (element(four, 0) + element(four, 1)) + (element(four, 2) + element(four, 3))


@inlined
def add_six(factors, which, size, table, stride, v, six):
    """Return six vectors, to which rows of a table, each times a factor, are added.

    The sum over s < size of factors[s] times row which[s] is added, at 24 columns.

    table, stride : flat; length of its rows
    v, six : first of the 24 columns; six vectors of four doubles
    """
    a, b, c, d, e, f = six
    for s in range(size):
        factor, at = broadcast(get(factors, s)), get(which, s) * stride + v
        a = fma(load(table, at), factor, a)
        b = fma(load(table, at + FOUR), factor, b)
        c = fma(load(table, at + 2 * FOUR), factor, c)
        d = fma(load(table, at + 3 * FOUR), factor, d)
        e = fma(load(table, at + 4 * FOUR), factor, e)
        f = fma(load(table, at + 5 * FOUR), factor, f)
    return a, b, c, d, e, f


@inlined
def add_two(factors, which, size, table, stride, v, two):
    """Return two vectors, to which rows of a table, each times a factor, are added.

    The sum over s < size of factors[s] times row which[s] is added, at the 8 columns
    from v on. Arguments are those of `add_six`; two : the vectors
    """
    a, b = two
    for s in range(size):
        factor, at = broadcast(get(factors, s)), get(which, s) * stride + v
        a = fma(load(table, at), factor, a)
        b = fma(load(table, at + FOUR), factor, b)
    return a, b


@inlined
def store_six(out, v, six):
    """Write six vectors to out[v : v + 24]; return their elementwise minimum."""
    a, b, c, d, e, f = six
    store(out, v, a)
    store(out, v + FOUR, b)
    store(out, v + 2 * FOUR, c)
    store(out, v + 3 * FOUR, d)
    store(out, v + 4 * FOUR, e)
    store(out, v + 5 * FOUR, f)
    return lower_of(lower_of(lower_of(a, b), lower_of(c, d)), lower_of(e, f))


@inlined
def load_both(a, size, m):
    """Return four complex values (re, im): re from a[m], im from a[size + m] on."""
    return load(a, m), load(a, size + m)


@inlined
def store_both(a, size, m, value):
    """Store four complex values: re from a[m], im from a[size + m] on.

    a, size, m : array, number of its real parts, index; value : (re, im)
    """
    store(a, m, value[0])
    store(a, size + m, value[1])
