"""The inputs that each case of a campaign sets, computed from the case number.

A table is a sequence of blocks. A block is the product of axes, the last of which
varies fastest. An axis is a set of inputs that change together. So a grid of a million
cases stores only the values of its axes; a zip or drawn numbers are stored as columns,
and a list of cases as a block for each sequence of cases that set the same inputs.
"""

from __future__ import annotations

import itertools
import json
from abc import abstractmethod
from bisect import bisect_right
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import prod
from typing import Any, TypeVar, overload

import numpy as np
from numpy.typing import NDArray

Settings = dict[str, Any]
Values = Sequence[Any] | NDArray[np.float64]
Cases = NDArray[np.int64]
Item = TypeVar("Item")
MOST_LABELS = 1 << 62  # largest product of label counts, so that it fits an int64
LONG = 4096  # least number of values of a column that is stored as an array


class OfCases(Sequence[Item]):
    """Base of sequences with one element for each case of a campaign.

    An element, such as a case's inputs or its digest, is computed on access.
    """

    @abstractmethod
    def _of_case(self, case: int) -> Item:
        """Return the element of the case with the number `case`, from 0."""

    @overload
    def __getitem__(self, case: int) -> Item: ...
    @overload
    def __getitem__(self, case: slice) -> tuple[Item, ...]: ...
    def __getitem__(self, case: int | slice) -> Item | tuple[Item, ...]:
        """Return the element of a case, or the elements of a slice of cases."""
        chosen = range(len(self))[case]
        if isinstance(chosen, range):
            return tuple(map(self._of_case, chosen))
        return self._of_case(chosen)


@dataclass(frozen=True, eq=False)
class Axis:
    """An axis of a grid of cases: inputs that change together, and their n values.

    Attributes
    ----------
    names : full dotted names of the inputs
    columns : n values of each input; numbers may be in an array, (n,), and lists of
        equal length in one of shape (n, width)
    """

    names: tuple[str, ...]
    columns: tuple[Values, ...]

    def __len__(self) -> int:
        """Return n, the number of values of each input along the axis."""
        return len(self.columns[0])

    def row(self, place: int) -> Settings:
        """Return {input: value} at an index along the axis, `place`, from 0."""
        both = zip(self.names, self.columns, strict=True)
        return {name: value_at(column, place) for name, column in both}

    def until(self, place: int) -> Axis:
        """Return the axis with only the first `place` values of each input."""
        return Axis(self.names, tuple(column[:place] for column in self.columns))

    def plain(self) -> dict[str, Any]:
        """Return {input: list of its n values}, as data for JSON."""
        both = zip(self.names, self.columns, strict=True)
        return {name: listed(column) for name, column in both}


class Block(tuple[Axis, ...]):
    """A grid of cases: all combinations of values on its axes, the last axis fastest.

    A block without axes has one case, which sets no input.
    """

    __slots__ = ()

    @property
    def cases(self) -> int:
        """Number of cases of the block."""
        return prod(map(len, self))

    def row(self, number: int) -> Settings:
        """Return {input: value} that a case sets; number : of the case in the block."""
        parts = []
        for axis in reversed(self):
            number, place = divmod(number, len(axis))
            parts.append(axis.row(place))
        return {n: value for part in reversed(parts) for n, value in part.items()}

    def stride(self, number: int) -> int:
        """Return for how many successive cases an axis has the same value.

        number : index of the axis in the block
        """
        return prod(map(len, self[number + 1 :]))


@dataclass(frozen=True)
class Column:
    """The values of one input in all cases of a table, listed block by block.

    Attributes
    ----------
    values : values of the input in all blocks, one block after the other
    starts : (blocks,), first case of each block
    first : (blocks,), index in `values` of each block's first value
    stride : (blocks,), number of successive cases with the same value
    length : (blocks,), number of values of the input in the block
    """

    values: Values
    starts: Cases
    first: Cases
    stride: Cases
    length: Cases

    def codes(self, cases: Cases) -> Cases:
        """Return the index in `values` of the value of each of m cases, (m,)."""
        if len(self.starts) == 1:
            first, stride, length = (
                int(array[0]) for array in (self.first, self.stride, self.length)
            )
            return first + cases // stride % length
        block = np.searchsorted(self.starts, cases, side="right") - 1
        inside = cases - self.starts[block]
        return np.asarray(
            self.first[block] + inside // self.stride[block] % self.length[block]
        )

    def case_of(self, value: int) -> int:
        """Return the number of the first case whose value is `values[value]`."""
        inside = (self.first <= value) & (value < self.first + self.length)
        block = int(np.argmax(inside))
        before = (value - self.first[block]) * self.stride[block]
        return int(self.starts[block] + before)

    def of(self, cases: Cases, values: NDArray[Any]) -> NDArray[Any]:
        """Return an array over m cases, (m,), from an array over the column's values.

        Parameters
        ----------
        cases : (m,), numbers of cases
        values : array with one element for each of the column's `values`
        """
        return values[self.codes(cases)]


class Table(OfCases[Settings]):
    """The inputs that each case of a campaign sets: a sequence of {input: value}.

    Parameters
    ----------
    blocks : grids of cases, numbered one after the other
    """

    def __init__(self, blocks: Iterable[Block]) -> None:
        self.blocks = tuple(block for block in blocks if block.cases)
        sizes = [block.cases for block in self.blocks]
        self._starts = np.cumsum([0, *sizes], dtype=np.int64)

    @classmethod
    def of(cls, rows: Sequence[Mapping[str, Any]]) -> Table:
        """Return the table of cases in a list, `rows`: {input: value} of each case."""
        if isinstance(rows, Table):
            return rows
        blocks = []
        for names, run in itertools.groupby(rows, key=tuple):
            same = list(run)
            if not names:
                blocks += [Block()] * len(same)
                continue
            columns = tuple(column_of([row[name] for row in same]) for name in names)
            blocks.append(Block([Axis(names, columns)]))
        return cls(blocks)

    @classmethod
    def from_plain(cls, plain: Iterable[Iterable[Mapping[str, Any]]]) -> Table:
        """Return the table from the result of the method `plain`, read from JSON."""
        blocks = []
        for axes in plain:
            each = (
                Axis(tuple(axis), tuple(map(column_of, axis.values()))) for axis in axes
            )
            blocks.append(Block(each))
        return cls(blocks)

    def plain(self) -> list[list[dict[str, Any]]]:
        """Return the blocks as data for JSON: each a list of axes, {input: values}."""
        return [[axis.plain() for axis in block] for block in self.blocks]

    def times(self, axis: Axis) -> Table:
        """Return the table with each case repeated for every value on a further axis.

        In each block, this axis varies fastest.
        """
        return Table(Block([*block, axis]) for block in self.blocks)

    def mapped(self, name: str, change: Callable[[Any], Any]) -> Table:
        """Return the table with each value v of input `name` replaced by change(v)."""

        def of(axis: Axis) -> Axis:
            columns = [
                [change(value) for value in listed(column)] if n == name else column
                for n, column in zip(axis.names, axis.columns, strict=True)
            ]
            return Axis(axis.names, tuple(columns))

        return Table(Block(map(of, block)) for block in self.blocks)

    def along_last(self, axis: Axis) -> Table:
        """Return the table with `axis` instead of the last axis of each block."""
        return Table(Block([*block[:-1], axis]) for block in self.blocks)

    def __len__(self) -> int:
        """Return the number of cases."""
        return int(self._starts[-1])

    def _of_case(self, case: int) -> Settings:
        """Return {input: value} that the case with the number `case` sets."""
        block = bisect_right(self._starts, case) - 1
        return self.blocks[block].row(case - int(self._starts[block]))

    def __iter__(self) -> Iterator[Settings]:
        """Yield {input: value} that each case sets, in the order of case numbers."""
        for block in self.blocks:
            places = [[axis.row(i) for i in range(len(axis))] for axis in block]
            for parts in itertools.product(*places):
                yield {n: value for part in parts for n, value in part.items()}

    def __eq__(self, other: object) -> bool:
        """Return whether another sequence sets equal inputs in every case."""
        if not isinstance(other, Sequence):
            return NotImplemented
        if len(self) != len(other):
            return False
        if isinstance(other, Table) and self.plain() == other.plain():
            return True
        return all(a == b for a, b in zip(self, other, strict=True))

    __hash__ = None  # type: ignore[assignment]

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Full dotted names of inputs that any case sets, in order of appearance."""
        names = (n for block in self.blocks for axis in block for n in axis.names)
        return tuple(dict.fromkeys(names))

    def first_of(self, names: Iterable[str]) -> Cases:
        """Return numbers of cases that have all combinations of values of some inputs.

        For a single block, these are the cases with the first value on all other axes;
        otherwise all cases are returned. The numbers ascend; names : the inputs
        """
        if len(self.blocks) != 1:
            return np.arange(len(self))
        chosen, cases = set(names), np.zeros(1, dtype=np.int64)
        for number, axis in enumerate(self.blocks[0]):
            if chosen & set(axis.names):
                along = np.arange(len(axis)) * self.blocks[0].stride(number)
                cases = (cases[:, None] + along).ravel()
        return cases

    def column(self, name: str, default: Any) -> Column:
        """Return the values of the input `name` in all cases.

        default : its value in cases that do not set it
        """
        values: list[Values] = []
        first, stride, length = (np.ones(len(self.blocks), np.int64) for _ in range(3))
        count, plain = 0, -1  # plain: index of the default among the values, or -1
        for number, block in enumerate(self.blocks):
            pair = _column_in(block, name)
            if pair is None and plain < 0:
                pair, plain = ([default], 1), count
            if pair is None:
                first[number] = plain
                continue
            column, stride[number] = pair
            values.append(column)
            first[number], length[number] = count, len(column)
            count += len(column)
        return Column(_joined(values), self._starts[:-1], first, stride, length)


def _column_in(block: Block, name: str) -> tuple[Values, int] | None:
    """Return (values, stride) of an input in a block; None if no case in it sets it.

    stride : number of successive cases with the same value
    """
    for number, axis in enumerate(block):
        if name in axis.names:
            return axis.columns[axis.names.index(name)], block.stride(number)
    return None


def _joined(parts: list[Values]) -> Values:
    if len(parts) == 1:
        return parts[0]
    return [value for part in parts for value in listed(part)]


def column_of(values: Values) -> Values:
    """Return n values of an input for an `Axis`: many floats (`LONG`) as an array."""
    if len(values) < LONG or isinstance(values, np.ndarray):
        return values
    return np.array(values) if all(type(value) is float for value in values) else values


def listed(column: Values) -> list[Any]:
    """Return values of an input, an array or list, as a list of Python objects."""
    return column.tolist() if isinstance(column, np.ndarray) else list(column)


def value_at(column: Values, place: int) -> Any:
    """Return the element of an input's values with the index `place`, from 0.

    An array's element is converted to a Python object.
    """
    value = column[place]
    return value.tolist() if isinstance(column, np.ndarray) else value


def is_begun_by(whole: Axis, first: Axis) -> bool:
    """Return whether the values of the axis `whole` begin with those of `first`."""
    if whole.names != first.names or len(whole) < len(first):
        return False
    return whole.until(len(first)).plain() == first.plain()


def is_table(plain: Any) -> bool:
    """Return whether data from JSON has the form of the result of `Table.plain`."""
    return isinstance(plain, list) and all(
        isinstance(axes, list) and all(map(_is_axis, axes)) for axes in plain
    )


def _is_axis(axis: Any) -> bool:
    if not isinstance(axis, dict) or not axis:
        return False
    columns = list(axis.values())
    return all(isinstance(c, list) and len(c) == len(columns[0]) for c in columns)


def distinct(column: Values, key: Callable[[Any], str] = json.dumps) -> Cases:
    """Return an integer label of each of n values, (n,), equal for equal values.

    0.0 and -0.0 count as different.

    Parameters
    ----------
    column : n values
    key : function from a value to the text that is compared; not used for an array
    """
    if isinstance(column, np.ndarray) and column.ndim == 1:
        bits = np.ascontiguousarray(column, dtype=float).view(np.int64)
        return np.asarray(np.unique(bits, return_inverse=True)[1], dtype=np.int64)
    known: dict[str, int] = {}
    numbers = (known.setdefault(key(value), len(known)) for value in listed(column))
    return np.fromiter(numbers, np.int64, len(column))


def labels(parts: Iterable[tuple[Column, Cases]], cases: Cases) -> Cases:
    """Return a label of each of m cases, (m,), equal where all given inputs are equal.

    Parameters
    ----------
    parts : (column, label of each of its values, from `distinct`) of each input
    cases : (m,), numbers of cases
    """
    out, radix = np.zeros(len(cases), dtype=np.int64), 1
    for column, numbers in parts:
        kinds = int(numbers.max(initial=0)) + 1
        if radix > MOST_LABELS // kinds:
            out = np.unique(out, return_inverse=True)[1].astype(np.int64)
            radix = int(out.max(initial=0)) + 1
        out = out * kinds + column.of(cases, numbers)
        radix *= kinds
    return out
