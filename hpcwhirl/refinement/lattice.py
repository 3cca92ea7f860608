"""The values that refined inputs may take: given values, whose intervals are bisected.

Along an input a value is named by an integer, its place: the coarse values, which the
user gives, are `1 << depth` apart, and each interval between them can be bisected up to
its own depth. Values are exact decimals or, on a logarithmic scale, correctly rounded
functions of decimals, cut to 12 digits. So values, and the digests of cases, are the
same on every machine.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from decimal import Context, Decimal
from functools import cached_property

EXACT = Context(prec=60)
DIGITS = Context(prec=12)
Point = tuple[int, ...]
Cell = tuple[int, Point]  # (level, lower corner)


@dataclass(frozen=True)
class Side:
    """The values that one refined input may take; an integer, the place, names each.

    The coarse values of the user are 2^depth places apart; bisections lead to the
    values between them.

    Attributes
    ----------
    name : dotted name of the input
    values : (m,), coarse values, ascending, as the user wrote them
    depths : (m - 1,), largest number of bisections of each interval
    scale : "linear" or "log"
    whole : whether only whole numbers are allowed
    """

    name: str
    values: tuple[float, ...]
    depths: tuple[int, ...]
    scale: str = "linear"
    whole: bool = False

    @cached_property
    def depth(self) -> int:
        """Largest number of bisections of any interval of this input."""
        return max(self.depths)

    @property
    def last(self) -> int:
        """Place (integer that names a value) of the last coarse value of the input."""
        return len(self.depths) << self.depth

    def shift(self, level: int, unit: int) -> int:
        """Return s: along this input, a cell of a level is 2^s places wide.

        Parameters
        ----------
        level : number of bisections that lead to the cell
        unit : place at which a smallest interval inside the cell begins
        """
        return self.depth - min(level, self.depths[unit >> self.depth])

    def level(self, place: int) -> int:
        """Return how many bisections lead to the value at a place; 0: coarse."""
        return max(self.depth - ((place & -place).bit_length() - 1), 0) if place else 0

    def value(self, place: int) -> float:
        """Return the value of the input at a place (integer that names a value)."""
        number, rest = divmod(place, 1 << self.depth)
        if not rest:
            return self.values[number]
        part = Decimal(rest) / (1 << self.depth)  # exact
        low, high = (Decimal(str(v)) for v in self.values[number : number + 2])
        exact = _between(low, high, part, self.scale)
        return int(exact) if self.whole else float(exact)

    def position(self, place: int) -> float:
        """Return a place as a number of coarse intervals from the first value.

        The number, such as 3.25, is always exact.
        """
        return place / (1 << self.depth)

    def place(self, position: float) -> int:
        """Return the place at a number of coarse intervals: `position` inverted."""
        return int(position * (1 << self.depth))


def _between(low: Decimal, high: Decimal, part: Decimal, scale: str) -> Decimal:
    if scale == "linear":
        return EXACT.add(low, EXACT.multiply(EXACT.subtract(high, low), part))
    ratio = EXACT.ln(EXACT.divide(high, low))
    value = EXACT.multiply(low, EXACT.exp(EXACT.multiply(ratio, part)))
    return DIGITS.plus(value)


@dataclass(frozen=True)
class Lattice:
    """The points that one to three refined inputs may take, and the cells between them.

    A point has a place (integer that names a value) along each input. A cell is given
    by its level, the number of bisections that lead to it, and its lower corner. It is
    split by bisection along every input whose interval there allows a further
    bisection; a cell that no input allows to split is "at its end".

    sides : the values that each input may take
    """

    sides: tuple[Side, ...]

    @cached_property
    def depth(self) -> int:
        """Largest number of bisections of any cell between coarse values."""
        return max(side.depth for side in self.sides)

    def level(self, point: Point) -> int:
        """Return the number of bisections after which a point appears; 0: coarse."""
        both = zip(self.sides, point, strict=True)
        return max(side.level(place) for side, place in both)

    def coarse(self) -> Iterator[Cell]:
        """Yield the cells of level 0, whose corners are neighbouring coarse values."""
        starts = (range(0, side.last, 1 << side.depth) for side in self.sides)
        for low in itertools.product(*starts):
            yield 0, low

    def sizes(self, cell: Cell) -> Point:
        """Return the size of a cell along each input, as a difference of places."""
        level, low = cell
        return tuple(
            1 << side.shift(level, x) for side, x in zip(self.sides, low, strict=True)
        )

    def corners(self, cell: Cell) -> tuple[Point, ...]:
        """Return the points at the corners of a cell; the last input varies fastest."""
        ends = zip(cell[1], self.sizes(cell), strict=True)
        return tuple(itertools.product(*((x, x + size) for x, size in ends)))

    def at(self, level: int, unit: Point) -> Cell:
        """Return the cell of a given level that contains a given cell of size 1.

        Parameters
        ----------
        level : number of bisections that lead to the cell
        unit : lower corner of the cell of size 1, places along all inputs
        """
        low = []
        for side, x in zip(self.sides, unit, strict=True):
            shift = side.shift(level, x)
            low.append(x >> shift << shift)
        return level, tuple(low)

    def at_end(self, cell: Cell) -> bool:
        """Return whether a cell cannot be split: no input may be bisected in it."""
        level, low = cell
        return all(
            side.depths[x >> side.depth] <= level
            for side, x in zip(self.sides, low, strict=True)
        )

    def children(self, cell: Cell) -> list[Cell]:
        """Return the cells of the next level into which a cell is split."""
        level, low = cell
        starts = []
        for side, x in zip(self.sides, low, strict=True):
            size, half = side.shift(level, x), side.shift(level + 1, x)
            starts.append((x,) if size == half else (x, x + (1 << half)))
        return [(level + 1, part) for part in itertools.product(*starts)]

    def parts(self, cell: Cell, levels: int) -> int:
        """Return the number of cells that a cell gives after `levels` bisections."""
        level, low = cell
        bits = 0
        for side, x in zip(self.sides, low, strict=True):
            bits += side.shift(level, x) - side.shift(level + levels, x)
        return 1 << bits

    def touching(self, level: int, point: Point) -> set[Cell]:
        """Return the cells of a level that contain a point, inside or on a side."""
        near = [
            {x >> (s := side.shift(level, x)) << s for x in (place - 1, place)
             if 0 <= x < side.last}
            for side, place in zip(self.sides, point, strict=True)
        ]  # fmt: skip
        return {(level, low) for low in itertools.product(*near)}

    def neighbours(self, cell: Cell) -> set[Cell]:
        """Return the cells of the same level that touch a cell, even at a corner."""
        level, low = cell
        near = [
            [x for x in (x0 - 1, x0, x0 + size) if 0 <= x < side.last]
            for side, x0, size in zip(self.sides, low, self.sizes(cell), strict=True)
        ]
        return {self.at(level, unit) for unit in itertools.product(*near)} - {cell}
