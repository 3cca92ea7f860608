"""Words of many cases, such as regimes, held as codes of one byte each."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.errors import StoreError

Words = NDArray[np.str_]


@dataclass(frozen=True, eq=False)
class Coded:
    """The words of n cases, or of their twins, as codes; NumPy reads it as text.

    Attributes
    ----------
    known : possible words, each once
    code : (n,), or (n, twins), index into `known` of each word
    """

    known: tuple[str, ...]
    code: NDArray[np.int8]

    @classmethod
    def of(cls, words: NDArray[Any]) -> Coded:
        """Return given words as codes.

        words : (n,), the word of each case as text
        """
        known, code = np.unique(words.astype(str), return_inverse=True)
        return cls(tuple(known.tolist()), code.astype(np.int8))

    @classmethod
    def read(cls, name: str, codes: NDArray[Any], meanings: str) -> Coded:
        """Return the words of n cases from the codes of a variable, (n,).

        Parameters
        ----------
        name, meanings : the variable, and its `flag_meanings`: words by code from 0 on
        codes : integers; NaN, where xarray has masked a case, is the word ""

        Raises
        ------
        StoreError
            where a code has no word
        """
        known, masked = meanings.split(), np.isnan(codes)
        given = codes[~masked]
        if given.size and not 0 <= given.min() <= given.max() < len(known):
            raise StoreError(f"{name} is damaged: it has a code without a word")
        if masked.any():
            codes, known = np.where(masked, len(known), codes), [*known, ""]
        return cls(tuple(known), codes.astype(np.int8, copy=False))

    def __len__(self) -> int:
        """Return the number of cases that have words here."""
        return len(self.code)

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]:  # noqa: FBT001 - NumPy's
        """Return the words of all cases as text, an array of the shape of `code`."""
        del copy
        return np.array(self.known, dtype=dtype)[self.code]

    def __getitem__(self, rows: NDArray[Any]) -> Coded:
        """Return the words of the cases that an index array or a mask selects."""
        return Coded(self.known, self.code[rows])

    def __iter__(self) -> Iterator[str]:
        """Yield the word of each case as text."""
        return map(self.known.__getitem__, self.code.tolist())

    def tolist(self) -> list[str]:
        """Return the words of all cases as a list of texts."""
        return list(self)

    def isin(self, words: Collection[str]) -> NDArray[np.bool_]:
        """Return for each case whether it has one of the given words, (cases,)."""
        return np.array([word in words for word in self.known])[self.code]

    def counts(self) -> dict[str, int]:
        """Return {word: number of cases that have it} of the words that occur."""
        found = np.bincount(self.code.ravel(), minlength=len(self.known)).tolist()
        return {w: n for w, n in zip(self.known, found, strict=True) if n}


def _together(
    columns: Sequence[Coded],
) -> tuple[NDArray[np.int64], NDArray[np.int64], list[Words]]:
    """Return which combinations of words n cases have in several columns.

    columns : (n,) words each, such as outcome and regime

    Returns
    -------
    place : (n,), number of the combination that each case has, one of m possible ones
    count : (m,), number of cases with each combination, 0 if it does not occur
    words : (k,) for each column, the words of the k combinations that occur
    """
    shape = [len(column.known) for column in columns]
    place = np.ravel_multi_index([column.code for column in columns], shape)
    count = np.bincount(place, minlength=int(np.prod(shape)))
    codes = np.unravel_index(np.flatnonzero(count), shape)
    words = [np.array(c.known)[code] for c, code in zip(columns, codes, strict=True)]
    return place, count, words


def combined(rule: Callable[..., Words], *columns: Coded) -> Coded:
    """Return the word that a rule gives to each case from its words in several columns.

    Parameters
    ----------
    rule : function of arrays of text, one for each column, that returns words; it is
        called once, with every combination of words that occurs
    columns : (n,) words each, such as status, outcome and regime
    """
    place, count, words = _together(columns)
    found, table = Coded.of(rule(*words)), np.zeros(len(count), dtype=np.int8)
    table[count > 0] = found.code
    return Coded(found.known, table[place])


def counted(columns: Sequence[Coded]) -> Counter[tuple[str, ...]]:
    """Return {(word, word, ...): number of cases that have this combination of words}.

    The combinations are in the order of their first occurrence.

    columns : (n,) words each, such as outcome and regime
    """
    place, count, words = _together(columns)
    first = np.zeros(len(count), dtype=np.int64)
    first[place[::-1]] = np.arange(len(place))[::-1]
    order = np.argsort(first[count > 0])
    each = zip(*(one[order].tolist() for one in words), strict=True)
    return Counter(dict(zip(each, count[count > 0][order].tolist(), strict=True)))
