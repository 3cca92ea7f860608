"""Words of many cases as codes of one byte each."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Words = NDArray[np.str_]


@dataclass(frozen=True, eq=False)
class Coded:
    """Words of n cases; NumPy reads them as an array of text.

    Attributes
    ----------
    known : possible words, each once
    code : (n,), index into `known`
    """

    known: tuple[str, ...]
    code: NDArray[np.int8]

    @classmethod
    def of(cls, words: NDArray[Any]) -> Coded:
        """Return words, (n,), as codes."""
        known, code = np.unique(words.astype(str), return_inverse=True)
        return cls(tuple(known.tolist()), code.astype(np.int8))

    def __len__(self) -> int:
        """Return the number of cases."""
        return len(self.code)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:  # noqa: FBT001 - NumPy's
        """Return the words as text, (n,)."""
        del copy
        return np.array(self.known, dtype=dtype)[self.code]

    def __getitem__(self, rows: NDArray[Any]) -> Coded:
        """Return the words of some cases, by index or by mask."""
        return Coded(self.known, self.code[rows])

    def __iter__(self) -> Iterator[str]:
        """Return the words, one after the other."""
        return map(self.known.__getitem__, self.code.tolist())

    def tolist(self) -> list[str]:
        """Return the words as a list."""
        return list(self)

    def isin(self, words: Collection[str]) -> NDArray[np.bool_]:
        """Return which cases have one of some words, (n,)."""
        return np.array([word in words for word in self.known])[self.code]

    def counts(self) -> dict[str, int]:
        """Return {word: number of cases} of the words that occur."""
        found = np.bincount(self.code, minlength=len(self.known)).tolist()
        return {w: n for w, n in zip(self.known, found, strict=True) if n}


def combined(rule: Callable[..., Words], *columns: Coded) -> Coded:
    """Return the word that a rule gives for the words of each case.

    rule : function of arrays of text, one for each column; it is called once, with
        every combination of words that occurs
    """
    shape = [len(column.known) for column in columns]
    place = np.ravel_multi_index([column.code for column in columns], shape)
    there = np.flatnonzero(np.bincount(place))
    every = zip(columns, np.unravel_index(there, shape), strict=True)
    found = Coded.of(rule(*(np.array(one.known)[codes] for one, codes in every)))
    table = np.zeros(np.prod(shape), dtype=np.int8)
    table[there] = found.code
    return Coded(found.known, table[place])
