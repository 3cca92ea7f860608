"""What each case of a design sets, worked out from its number.

A table is blocks, one after the other; a block is the product of axes, the last of
which varies fastest; an axis is inputs that change together. So a grid of a million
cases is its few values, a zip or drawn numbers are columns, and a list of cases is a
block for each run of cases that set the same inputs.
"""

from __future__ import annotations

import itertools
import json
from abc import abstractmethod
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
MOST_LABELS = 1 << 62
LONG = 4096  # values from which on numbers are kept as 8 bytes each


class OfCases(Sequence[Item]):
    """What is of cases each, made when it is asked for."""

    @abstractmethod
    def _of_case(self, case: int) -> Item:
        """Return what is of a case, by its number from 0."""

    @overload
    def __getitem__(self, case: int) -> Item: ...
    @overload
    def __getitem__(self, case: slice) -> tuple[Item, ...]: ...
    def __getitem__(self, case: int | slice) -> Item | tuple[Item, ...]:
        """Return what is of a case, or of several."""
        found = range(len(self))[case]
        if isinstance(found, range):
            return tuple(map(self._of_case, found))
        return self._of_case(found)


@dataclass(frozen=True, eq=False)
class Axis:
    """Inputs that change together.

    Attributes
    ----------
    names : dotted names of the inputs
    columns : values of each, equally many; an array where they are numbers, (n,), or
        equally many numbers each, (n, width)
    """

    names: tuple[str, ...]
    columns: tuple[Values, ...]

    def __len__(self) -> int:
        """Return the number of places along it."""
        return len(self.columns[0])

    def row(self, place: int) -> Settings:
        """Return {input: value} at a place."""
        both = zip(self.names, self.columns, strict=True)
        return {name: value_at(column, place) for name, column in both}

    def until(self, place: int) -> Axis:
        """Return its first places."""
        return Axis(self.names, tuple(column[:place] for column in self.columns))

    def plain(self) -> dict[str, Any]:
        """Return {input: values} as JSON has them."""
        both = zip(self.names, self.columns, strict=True)
        return {name: listed(column) for name, column in both}


class Block(tuple[Axis, ...]):
    """The product of axes, the last of which varies fastest; of none, one case."""

    __slots__ = ()

    @property
    def cases(self) -> int:
        """Return the number of cases."""
        return prod(map(len, self))

    def row(self, number: int) -> Settings:
        """Return {input: value} of a case by its number in the block."""
        parts = []
        for axis in reversed(self):
            number, place = divmod(number, len(axis))
            parts.append(axis.row(place))
        return {n: value for part in reversed(parts) for n, value in part.items()}

    def stride(self, number: int) -> int:
        """Return after how many cases an axis goes to its next place."""
        return prod(map(len, self[number + 1 :]))


@dataclass(frozen=True)
class Column:
    """One input over all cases of a table.

    Attributes
    ----------
    values : that it has, those of each block after those of the one before
    starts, first, stride, length : (blocks,), the first case of a block; where its
        values begin; after how many cases it goes to the next; how many it has
    """

    values: Values
    starts: Cases
    first: Cases
    stride: Cases
    length: Cases

    def codes(self, cases: Cases) -> Cases:
        """Return which of the values some cases have, (m,)."""
        if len(self.starts) == 1:
            first, stride, length = (
                int(known[0]) for known in (self.first, self.stride, self.length)
            )
            return first + cases // stride % length
        own = np.searchsorted(self.starts, cases, side="right") - 1
        inside = cases - self.starts[own]
        return np.asarray(
            self.first[own] + inside // self.stride[own] % self.length[own]
        )

    def case_of(self, value: int) -> int:
        """Return the first case that has a value, by its number among the values."""
        own = int(np.argmax((self.first <= value) & (value < self.first + self.length)))
        return int(self.starts[own] + (value - self.first[own]) * self.stride[own])

    def of(self, cases: Cases, values: NDArray[Any]) -> NDArray[Any]:
        """Return what stands for the values of some cases, (m,)."""
        return values[self.codes(cases)]


class Table(OfCases[Settings]):
    """The settings of all cases, each made when it is asked for.

    Parameters
    ----------
    blocks : that follow each other
    """

    def __init__(self, blocks: Iterable[Block]) -> None:
        self.blocks = tuple(block for block in blocks if block.cases)
        sizes = [block.cases for block in self.blocks]
        self._starts = np.cumsum([0, *sizes], dtype=np.int64)

    @classmethod
    def of(cls, rows: Sequence[Mapping[str, Any]]) -> Table:
        """Return the table of listed cases."""
        if isinstance(rows, Table):
            return rows
        blocks = []
        for names, run in itertools.groupby(rows, key=tuple):
            found = list(run)
            if not names:
                blocks += [Block()] * len(found)
                continue
            columns = tuple(column_of([row[name] for row in found]) for name in names)
            blocks.append(Block([Axis(names, columns)]))
        return cls(blocks)

    @classmethod
    def from_plain(cls, plain: Iterable[Iterable[Mapping[str, Any]]]) -> Table:
        """Return the table that `plain` told."""
        blocks = []
        for axes in plain:
            each = (
                Axis(tuple(axis), tuple(map(column_of, axis.values()))) for axis in axes
            )
            blocks.append(Block(each))
        return cls(blocks)

    def plain(self) -> list[list[dict[str, Any]]]:
        """Return the blocks as JSON has them: a list of axes each."""
        return [[axis.plain() for axis in block] for block in self.blocks]

    def times(self, axis: Axis) -> Table:
        """Return every case at every place of a further axis, which varies fastest."""
        return Table(Block([*block, axis]) for block in self.blocks)

    def mapped(self, name: str, change: Callable[[Any], Any]) -> Table:
        """Return the table with other values of an input."""

        def of(axis: Axis) -> Axis:
            columns = [
                [change(value) for value in listed(column)] if n == name else column
                for n, column in zip(axis.names, axis.columns, strict=True)
            ]
            return Axis(axis.names, tuple(columns))

        return Table(Block(map(of, block)) for block in self.blocks)

    def along_last(self, axis: Axis) -> Table:
        """Return the table with another axis for the one that varies fastest."""
        return Table(Block([*block[:-1], axis]) for block in self.blocks)

    def __len__(self) -> int:
        """Return the number of cases."""
        return int(self._starts[-1])

    def _of_case(self, case: int) -> Settings:
        """Return {input: value} of a case."""
        own = int(np.searchsorted(self._starts, case, side="right")) - 1
        return self.blocks[own].row(case - int(self._starts[own]))

    def __iter__(self) -> Iterator[Settings]:
        """Yield {input: value} of each case."""
        for block in self.blocks:
            places = [[axis.row(i) for i in range(len(axis))] for axis in block]
            for parts in itertools.product(*places):
                yield {n: value for part in parts for n, value in part.items()}

    def __eq__(self, other: object) -> bool:
        """Return whether another sequence tells the same of every case."""
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
        """The inputs that any case sets, in the order that they come."""
        found = (n for block in self.blocks for axis in block for n in axis.names)
        return tuple(dict.fromkeys(found))

    def first_of(self, names: Iterable[str]) -> Cases:
        """Return the first cases that have all there is of some inputs, ascending.

        Of a product, what every other axis begins with; of other tables, all cases.
        """
        if len(self.blocks) != 1:
            return np.arange(len(self))
        own, found = set(names), np.zeros(1, dtype=np.int64)
        for number, axis in enumerate(self.blocks[0]):
            if own & set(axis.names):
                along = np.arange(len(axis)) * self.blocks[0].stride(number)
                found = (found[:, None] + along).ravel()
        return found

    def column(self, name: str, default: Any) -> Column:
        """Return one input over all cases; `default` is of those that do not set it."""
        values: list[Values] = []
        first, stride, length = (np.ones(len(self.blocks), np.int64) for _ in range(3))
        count, plain = 0, -1  # where the default stands, once it is needed
        for number, block in enumerate(self.blocks):
            found = _column_in(block, name)
            if found is None and plain < 0:
                found, plain = ([default], 1), count
            if found is None:
                first[number] = plain
                continue
            column, stride[number] = found
            values.append(column)
            first[number], length[number] = count, len(column)
            count += len(column)
        return Column(_joined(values), self._starts[:-1], first, stride, length)


def _column_in(block: Block, name: str) -> tuple[Values, int] | None:
    """Return the values of an input in a block, and their stride; None without."""
    for number, axis in enumerate(block):
        if name in axis.names:
            return axis.columns[axis.names.index(name)], block.stride(number)
    return None


def _joined(parts: list[Values]) -> Values:
    if len(parts) == 1:
        return parts[0]
    return [value for part in parts for value in listed(part)]


def column_of(values: Values) -> Values:
    """Return values as a column: many numbers as an array."""
    if len(values) < LONG or isinstance(values, np.ndarray):
        return values
    return np.array(values) if all(type(value) is float for value in values) else values


def listed(column: Values) -> list[Any]:
    """Return the values of a column as Python has them."""
    return column.tolist() if isinstance(column, np.ndarray) else list(column)


def value_at(column: Values, place: int) -> Any:
    """Return a value of a column as Python has it."""
    value = column[place]
    return value.tolist() if isinstance(column, np.ndarray) else value


def is_begun_by(whole: Axis, first: Axis) -> bool:
    """Return whether an axis begins with the places of another one."""
    if whole.names != first.names or len(whole) < len(first):
        return False
    return whole.until(len(first)).plain() == first.plain()


def is_table(plain: Any) -> bool:
    """Return whether plain data is what `Table.plain` tells."""
    return isinstance(plain, list) and all(
        isinstance(axes, list) and all(map(_is_axis, axes)) for axes in plain
    )


def _is_axis(axis: Any) -> bool:
    if not isinstance(axis, dict) or not axis:
        return False
    columns = list(axis.values())
    return all(isinstance(c, list) and len(c) == len(columns[0]) for c in columns)


def distinct(column: Values, key: Callable[[Any], str] = json.dumps) -> Cases:
    """Return numbers of values, (n,), the same where values are: 0 and -0 are two.

    key : text of a value that is no number of an array
    """
    if isinstance(column, np.ndarray) and column.ndim == 1:
        bits = np.ascontiguousarray(column, dtype=float).view(np.int64)
        return np.asarray(np.unique(bits, return_inverse=True)[1], dtype=np.int64)
    known: dict[str, int] = {}
    found = (known.setdefault(key(value), len(known)) for value in listed(column))
    return np.fromiter(found, np.int64, len(column))


def labels(parts: Iterable[tuple[Column, Cases]], cases: Cases) -> Cases:
    """Return numbers of some cases, (m,), the same where they are alike in all inputs.

    parts : columns, and the number of each of their values, see `distinct`
    """
    found, radix = np.zeros(len(cases), dtype=np.int64), 1
    for column, numbers in parts:
        kinds = int(numbers.max(initial=0)) + 1
        if radix > MOST_LABELS // kinds:
            found = np.unique(found, return_inverse=True)[1].astype(np.int64)
            radix = int(found.max(initial=0)) + 1
        found = found * kinds + column.of(cases, numbers)
        radix *= kinds
    return found
