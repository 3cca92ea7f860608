"""An axis of a map: positions of cases on it, edges of their cells, ticks.

The levels of an axis are the distinct values that its input has in the cases.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.arrays import Floats
from hpcwhirl.store.reading.select import value_text

WIDEST = 5.0  # ratio of largest to least value from which an axis may be logarithmic
MOST_TICKS = 14  # number of values up to which each has a tick
LONGEST = 26  # largest number of characters of a text on an axis
WIDE, HIGH = 6.5, 13.0  # points, width of a letter and height of a line
READ = 1e-5  # largest error of the text of a number on an axis, relative
TOLD = 0.6  # least share of values with room for a tick; below it none has a tick
ALONE = 0.5  # half the width of a cell without neighbours, relative to its value


@dataclass(frozen=True)
class Levels:
    """The values of a swept input in n cases, stored as m levels, its distinct values.

    Attributes
    ----------
    known : (m,), levels: numbers ascending, or texts in the order of the campaign
    index : (n,), for each case the index in `known` of its value
    """

    known: NDArray[Any]
    index: NDArray[np.int32]

    @classmethod
    def of(cls, values: NDArray[Any]) -> Levels:
        """Return the levels, distinct values, of an input.

        values : (n,), its value in each of n cases
        """
        if values.dtype.kind in "iufb":
            known, index = np.unique(values, return_inverse=True)
            return cls(known, index.astype(np.int32))
        texts = values.astype(str).tolist()
        number = {text: i for i, text in enumerate(dict.fromkeys(texts))}
        places = np.array([number[text] for text in texts], dtype=np.int32)
        return cls(np.array(list(number), dtype=object), places)

    def __len__(self) -> int:
        """Return the number of distinct values."""
        return len(self.known)

    @property
    def numeric(self) -> bool:
        """Whether the values are numbers."""
        return self.known.dtype.kind in "iufb"

    @property
    def values(self) -> NDArray[Any]:
        """The input's value in each of n cases, (n,)."""
        return np.asarray(self.known[self.index])


@dataclass(frozen=True)
class Axis:
    """An axis of a map of n cases.

    Attributes
    ----------
    name : variable of results whose values are drawn; "" if nothing is swept
    label : label of the axis, with unit
    index : (n,), for each case the index in `levels` of its position
    levels : (m,), the m distinct positions of cases, ascending, in the unit of `label`
    names : (m,), texts of the levels, for an input of texts; empty for numbers
    scale : "linear" or "log"
    whole : whether the input takes whole numbers only
    factor : from the input's SI unit to the unit of the label
    """

    name: str
    label: str
    index: NDArray[np.int32]
    levels: Floats
    names: tuple[str, ...] = ()
    scale: str = "linear"
    whole: bool = False
    factor: float = 1.0

    @property
    def place(self) -> Floats:
        """Position of each of n cases on the axis, (n,)."""
        return self.levels[self.index]

    def edges(self) -> Floats:
        """Return the edges of the cells around m levels, (m + 1,).

        They are half way between levels on the axis' scale, linear or log.
        """
        return cell_edges(self.levels, self.scale)

    def middles(self, rows: NDArray[np.intp]) -> Floats:
        """Return the middles of the cells of some cases, as positions on the axis.

        It is half way between the cell's edges on the axis' scale, linear or log.

        rows : indices of the cases among those of the map
        """
        edges = straight(self.edges(), self.scale)
        middle = (edges[:-1] + edges[1:]) / 2
        where = np.exp(middle) if self.scale == "log" else middle
        return np.asarray(where[self.index[rows]])

    def scaled(self) -> Floats:
        """Return positions of n cases, (n,), in which drawn distances are differences.

        On a log scale they are logarithms.
        """
        return straight(self.levels, self.scale)[self.index]

    def widths(self, points: float) -> Floats:
        """Return the drawn width of the cell of each of m levels, (m,), in points.

        points : drawn length of the axis, points
        """
        edges = straight(self.edges(), self.scale)
        return points * np.diff(edges) / np.ptp(edges)

    def ticks(self, points: float, *, upright: bool) -> tuple[Floats, tuple[str, ...]]:
        """Return the levels with a tick, and their texts; empty without room for ticks.

        Parameters
        ----------
        points : length of the axis in points
        upright : whether the axis is vertical, with texts one above the other
        """
        many = len(self.levels) > MOST_TICKS and not self.names
        if not self.name or many:
            return np.array([]), ()
        texts = self.names or distinct(self.levels)
        at = straight(self.levels, self.scale)
        places = points * (at - at[0]) / (np.ptp(at) or 1.0)
        kept: list[int] = []
        for i, text in enumerate(texts):
            room = HIGH if upright else 0.5 * WIDE * (len(text) + len(texts[i - 1])) + 5
            if not kept or places[i] - places[kept[-1]] >= room or self.names:
                kept.append(i)
        if len(kept) < TOLD * len(texts):
            return np.array([]), ()
        return self.levels[kept], tuple(texts[i] for i in kept)


def straight(values: Floats, scale: str) -> Floats:
    """Return values so that equal differences are equal distances on a drawn axis.

    They are the values or, on the scale "log", their logarithms.
    """
    return np.log(values) if scale == "log" else values


def distinct(values: Floats) -> tuple[str, ...]:
    """Return ascending numbers as texts for ticks, the shortest that tell each.

    A text differs from its number by `READ` of it, and by 1 % of the least distance
    between two numbers, at most.
    """
    apart = float(np.diff(values).min(initial=np.inf))
    for digits in range(3, 10):
        texts = tuple(value_text(float(f"{value:.{digits}g}")) for value in values)
        off = abs(np.array([float(text) for text in texts]) - values)
        if np.all(off <= READ * np.minimum(abs(values), 1e3 * apart)):
            return texts
    return tuple(value_text(value) for value in values)


def cell_edges(levels: Floats, scale: str = "linear") -> Floats:
    """Return the edges of cells around positions, half way between them, (m + 1,).

    levels, scale : (m,), positions, ascending; "linear" or "log"
    """
    at = straight(levels, scale)
    if len(at) == 1:
        half = ALONE * abs(at[0]) or ALONE
        return np.array([at[0] - half, at[0] + half])
    middle = (at[1:] + at[:-1]) / 2
    edges = np.r_[2 * at[0] - middle[0], middle, 2 * at[-1] - middle[-1]]
    return np.asarray(np.exp(edges) if scale == "log" else edges)


def scale_of(levels: Floats) -> str:
    """Return the scale on which ascending levels are more evenly spread, log or linear.

    The scale is linear for fewer than 3 levels, or if the ratio of the largest to the
    least is below `WIDEST`.
    """
    if len(levels) < 3 or levels[0] <= 0 or levels[-1] < WIDEST * levels[0]:
        return "linear"
    return min(("linear", "log"), key=lambda s: _unevenness(straight(levels, s)))


def _unevenness(values: Floats) -> float:
    """Return the Kolmogorov distance, 0 to 1, of values from an even spread."""
    share = (values - values[0]) / np.ptp(values)
    return float(abs(share - np.linspace(0.0, 1.0, len(values))).max())


def axis_of(name: str, values: Levels, label: str, factor: float = 1.0) -> Axis:
    """Return the axis of a map on which an input varies.

    Parameters
    ----------
    name, values : the input's variable in results; its values in the cases of the map
    label : label of the axis, with unit
    factor : from the SI unit of numbers to the unit of the label
    """
    if values.numeric:
        whole = values.known.dtype.kind in "iub" or name == "nodal_diameter"
        # two values may become equal in the unit of the label
        levels, merged = np.unique(factor * values.known.astype(float),
                                   return_inverse=True)  # fmt: skip
        scale = "linear" if whole else scale_of(levels)
        index = merged.astype(np.int32)[values.index]
        return Axis(name, label, index, levels, scale=scale, whole=whole, factor=factor)
    levels = np.arange(len(values), dtype=float)
    return Axis(name, label, values.index, levels, short_names(values.known.tolist()))


def no_axis(count: int) -> Axis:
    """Return the axis of a map on which no input varies: one position for all cases.

    count : number of cases of the map
    """
    return Axis("", "", np.zeros(count, np.int32), np.zeros(1))


def short_names(texts: list[str]) -> tuple[str, ...]:
    """Return texts cut to the length that fits on an axis.

    If any is cut, all get a number in front, so that they still differ.
    """
    if all(len(text) <= LONGEST for text in texts):
        return tuple(texts)
    return tuple(
        f"#{i + 1} {text if len(text) <= LONGEST else text[: LONGEST - 1] + '…'}"
        for i, text in enumerate(texts)
    )
