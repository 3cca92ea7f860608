"""Validation of the inputs of all cases of a campaign, without a `Scene` for each.

Each value of an input is checked once, however many cases have it. The rules between
inputs (module `rules`) are evaluated on arrays with one element per case. The error is
that which the `Scene` of the first invalid case would raise.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache, partial
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import ConfigDict, FailFast, TypeAdapter, ValidationError

from hpcwhirl.errors import WhirlError
from hpcwhirl.scene.digests import fragment, takes_real
from hpcwhirl.scene.input_names import takes_list
from hpcwhirl.scene.inputs import Scene
from hpcwhirl.scene.plain_data import apply_settings, flatten
from hpcwhirl.scene.quantities import LEAVES
from hpcwhirl.scene.rules import LASTS, Rule, end_time, last_end
from hpcwhirl.scene.table import Column, Table, Values, distinct, labels, listed
from hpcwhirl.scene.table_model import Inputs

Array = NDArray[Any]
# function from an input's name to its value or, if it is swept, its values, (cases,);
# an input that is a list has its length as value
Columns = Callable[[str], Any]
Condition = Callable[[Columns], Any]
AT_ONCE = 1 << 18  # largest number of cases evaluated together
STRICT = ConfigDict(strict=True)


def end_times(get: Columns) -> Any:
    """Return the simulated time at which each case ends, s, as `Scene.end_time` does.

    get : function from an input's name to its value, a scalar or (cases,)
    """
    return end_time(get("duration"), get("revolutions"), get("speed"))


def _rules(
    model: type[Inputs] = Scene, prefix: str = ""
) -> Iterator[tuple[tuple[str, ...], Rule]]:
    """Yield (full dotted names of its inputs, rule) of each rule of a table of inputs.

    model : class of the table; rules of the tables inside it are included
    prefix : dotted name of the table and a dot, such as "engine."; "" for `Scene`
    """
    for rule in model.RULES:
        yield tuple(prefix + name for name in rule.inputs), rule
    for name, field in model.model_fields.items():
        kind = field.annotation
        if isinstance(kind, type) and issubclass(kind, Inputs):
            yield from _rules(kind, f"{prefix}{name}.")


RULES = tuple(_rules())


@cache
def _adapter(name: str) -> TypeAdapter[Any]:
    field = next(field for leaf, field in LEAVES if leaf == name)
    kind = Annotated[field.annotation, *field.metadata]  # type: ignore[name-defined]
    return TypeAdapter(Annotated[list[kind], FailFast()], config=STRICT)


def first_refused(name: str, values: Values) -> int:
    """Return the index of the first value that an input does not allow; -1: none.

    name, values : full dotted name of the input; n values of it
    """
    for start in range(0, len(values), AT_ONCE):
        try:
            _adapter(name).validate_python(listed(values[start : start + AT_ONCE]))
        except ValidationError as failed:
            return start + int(failed.errors(include_url=False)[0]["loc"][0])
    return -1


class Many:
    """All cases of a campaign: for each input that cases set, a column of its values.

    Conditions on inputs are evaluated on columns, for all cases at once. A case is
    named by its number in the table, from 0.

    Parameters
    ----------
    base : scene with the inputs that all cases share
    table : {input: value} that each case sets
    """

    def __init__(self, base: Scene, table: Table) -> None:
        self.base, self.table = base, table
        self.shared = flatten(base)
        self.columns = {n: table.column(n, self.shared[n]) for n in table.names}
        self._known_numbers: dict[str, Array] = {}

    def numbers(self, name: str, values: Values) -> Array:
        """Return n values of an input as an array, (n,), on which conditions work.

        Of an input that is a list, the array has the length of each list.
        """
        if takes_list(name):
            return np.array([len(value) for value in values])
        if isinstance(values, np.ndarray):
            return values
        words = any(isinstance(value, str) for value in values)
        return np.array(values, dtype=object if words else None)

    def chunks(self) -> Iterator[Array]:
        """Yield the case numbers, from 0 on, in arrays of at most `AT_ONCE` numbers."""
        most = len(self.table)
        for start in range(0, most, AT_ONCE):
            yield np.arange(start, min(start + AT_ONCE, most))

    def check(self) -> None:
        """Raise the InputError of the first case with invalid inputs, if any."""
        wrong = self.first_wrong()
        if wrong < len(self.table):
            apply_settings(self.base, self.table[wrong])
            raise WhirlError(f"case {wrong} breaks a rule that its scene does not have")

    def first_wrong(self) -> int:
        """Return the number, from 0, of the first case with invalid inputs.

        If the inputs of all cases are valid, return how many cases there are.
        """
        wrong = self._first_wrong_value()
        for inputs, rule in RULES:
            wrong = self._first_wrong(rule, inputs, wrong)
        return wrong

    def _first_wrong_value(self) -> int:
        """Return the number of the first case with a value that its input disallows.

        Rules between inputs do not count. If all values are valid, return how many
        cases there are.
        """
        wrong = len(self.table)
        for name, column in self.columns.items():
            place = first_refused(name, column.values)
            if place >= 0:
                wrong = min(wrong, column.case_of(place))
        return wrong

    def _first_wrong(self, rule: Rule, inputs: tuple[str, ...], before: int) -> int:
        """Return the number of the first case that breaks a rule, or `before`.

        inputs : full dotted names of the rule's inputs
        before : number of a case; only cases before it are examined
        """
        swept = {n: self.columns[n] for n in inputs if n in self.columns}
        cases = self.table.first_of(swept)
        cases = cases[: np.searchsorted(cases, before)]
        if not swept or not len(cases):
            return before
        values = {n: self._known(n, column, cases) for n, column in swept.items()}

        def broken(get: Columns) -> Any:
            with np.errstate(over="ignore"):  # infinite is too large, too
                return np.logical_not(rule.holds(*map(get, inputs)))

        wrong = self._first(cases, broken, values)
        return before if wrong is None else wrong

    def first_where(self, holds: Condition, inputs: tuple[str, ...]) -> int | None:
        """Return the number of the first case that meets a condition; None: no case.

        holds : condition; its argument is a function from an input's name to values
        inputs : full dotted names of the inputs on which the condition depends
        """
        swept = (n for n in inputs if n in self.columns)
        return self._first(self.table.first_of(swept), holds)

    def _first(
        self, chosen: Array, holds: Condition, values: dict[str, Array] | None = None
    ) -> int | None:
        """Return the first of some cases that meets a condition; None: no case.

        chosen : numbers of the cases
        holds : condition; its argument is a function from an input's name to values
        values : {input that cases set: array of its values}; None: those of the table
        """
        for start in range(0, len(chosen), AT_ONCE):
            cases = chosen[start : start + AT_ONCE]
            mask = holds(self.all(cases, values))
            met = np.flatnonzero(np.broadcast_to(mask, cases.shape))
            if len(met):
                return int(cases[met[0]])
        return None

    def _known(self, name: str, column: Column, cases: Array) -> Array:
        """Return the values of an input, up to the last one that `cases` have, (n,).

        Values that only later cases have are left out, since they may be invalid.

        name, column : the input, and its column of values
        cases : numbers of cases
        """
        most = 1 + int(column.codes(cases).max())
        return self.numbers(name, column.values[:most])

    def values(self, name: str) -> Array:
        """Return the value of an input in every case, (cases,).

        Of an input that is a list, it is the list's length.
        """
        cases = np.arange(len(self.table))
        return np.broadcast_to(self.all(cases)(name), cases.shape)

    def all(self, cases: Array, numbers: Mapping[str, Array] | None = None) -> Columns:
        """Return a function from an input's name to its values in m cases.

        It returns an array, (m,), or one value for an input that all cases share.

        Parameters
        ----------
        cases : (m,), numbers of the cases
        numbers : {input that cases set: array of its values}; None: from the table
        """

        def get(name: str) -> Any:
            if name not in self.columns:
                value = self.shared[name]
                return len(value) if isinstance(value, list) else value
            known = numbers[name] if numbers else self._numbers_of(name)
            return self.columns[name].of(cases, known)

        return get

    def _numbers_of(self, name: str) -> Array:
        if name not in self._known_numbers:
            values = self.numbers(name, self.columns[name].values)
            self._known_numbers[name] = values
        return self._known_numbers[name]

    def last_ends(self) -> Iterator[Array]:
        """Yield for each of `chunks` the latest times at which its cases may end, s."""
        for cases in self.chunks():
            ends = last_end(*map(self.all(cases), LASTS))
            yield np.broadcast_to(ends, cases.shape)

    def labels(self, names: Iterable[str], cases: Array | None = None) -> Array:
        """Return a label of each of m cases, (m,), equal where some inputs are equal.

        Parameters
        ----------
        names : the inputs to compare; an input that no case sets is ignored
        cases : (m,), numbers of cases; None: all
        """
        columns = ((n, self.columns[n]) for n in names if n in self.columns)
        parts = ((c, distinct(c.values, partial(fragment, n))) for n, c in columns)
        chosen = np.arange(len(self.table)) if cases is None else cases
        return labels(parts, chosen)

    def first_of(self, cases: Array, names: Iterable[str]) -> list[int]:
        """Return of each combination of values of some inputs the first case's number.

        cases : numbers of the cases to compare, ascending
        names : the inputs; two lists of the same length count as equal values, and
            so do two real numbers other than 0
        """

        def alike(name: str, values: Values) -> Values:
            if takes_list(name):
                return list(map(len, values))
            return np.asarray(values, float) != 0.0 if takes_real(name) else values

        swept = [(n, self.columns[n]) for n in names if n in self.columns]
        kind = labels([(c, distinct(alike(n, c.values))) for n, c in swept], cases)
        first = np.sort(np.unique(kind, return_index=True)[1])
        return [int(case) for case in cases[first]]

    def kinds(self, names: Iterable[str]) -> Array:
        """Return of each combination of values of some inputs the first case's number.

        All cases are compared; the numbers ascend.
        """
        swept = [name for name in names if name in self.columns]
        cases = self.table.first_of(swept)
        kind = self.labels(swept, cases)
        return cases[np.sort(np.unique(kind, return_index=True)[1])]

    def twice(self) -> tuple[int, int] | None:
        """Return the numbers of two cases with equal inputs; None: all cases differ.

        The first number is the lower one.
        """
        if self._is_plain_product():
            return None
        each = self.labels(self.columns)
        if len(np.unique(each)) == len(each):
            return None
        _, first, kind = np.unique(each, return_index=True, return_inverse=True)
        again = np.flatnonzero(first[kind] != np.arange(len(kind)))
        return int(first[kind[again[0]]]), int(again[0])

    def _is_plain_product(self) -> bool:
        """Return whether cases are a grid of which no axis has a value twice.

        Then all cases differ. Each axis must have a single input.
        """
        blocks = self.table.blocks
        if len(blocks) != 1 or any(len(axis.names) > 1 for axis in blocks[0]):
            return False
        return all(
            distinct(axis.columns[0], partial(fragment, axis.names[0])).max() + 1
            == len(axis)
            for axis in blocks[0]
        )
