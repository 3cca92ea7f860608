"""Whether every case of a table is a scene, without a scene for each.

A rule of a scene is of one input, or of some together. What an input allows is asked
once for each of its values. The rules of several are asked of all cases at once, as
arithmetic on columns; there is one here for each that `inputs` has, by its name. What
is wrong is told by the scene of the first case that breaks one, in the words of
`scene_from`; so is what some cases' scenes find though no column did.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache, partial
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import ConfigDict, FailFast, TypeAdapter, ValidationError

from hpcwhirl.errors import WhirlError
from hpcwhirl.scene.digests import fragment
from hpcwhirl.scene.files import FILE, apply_settings, flatten, takes_list
from hpcwhirl.scene.inputs import MOST_GAP, MOST_STEPS, Scene
from hpcwhirl.scene.quantities import LEAVES
from hpcwhirl.scene.table import Column, Table, Values, distinct, labels, listed

Array = NDArray[Any]
Columns = Callable[[str], Any]  # an input: one value, or (cases,), lists as lengths
Rule = Callable[[Columns], Any]
AT_ONCE = 1 << 18  # cases
BUILT = 16  # scenes made of cases that lie evenly over all
STRICT = ConfigDict(strict=True)


def end_times(get: Columns) -> Any:
    """Return the engine time, s, that cases last, see `Scene.end_time`."""
    turns = np.asarray(get("revolutions"), dtype=float)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        own = turns * 2 * math.pi / np.abs(np.asarray(get("speed"), dtype=float))
    return np.where(turns > 0, own, get("duration"))


def _carried(get: Columns) -> Any:
    """Return whether the casing's ring has the lobes of the load."""
    most = np.where(
        np.equal(get("engine.casing.discretization"), "elements"),
        np.asarray(get("engine.casing.elements")) // 2,
        get("engine.casing.harmonics"),
    )
    ring = np.equal(get("engine.casing.kind"), "ring")
    return ~ring | (np.asarray(get("nodal_diameter")) <= most)


def _decided_end(get: Columns) -> Any:
    """Return the engine time, s, at which cases end at the latest."""
    last, decided = end_times(get), np.equal(get("solver.until"), "decided")
    return np.where(decided, np.maximum(last, get("solver.longest")), last)


def _countable(get: Columns) -> Any:
    """Return whether the steps of a case can be counted."""
    return _decided_end(get) <= MOST_STEPS * np.asarray(get("solver.time_step"))


def _changes(get: Columns) -> Any:
    count = np.asarray(get("engine.rotor.mistuning"))
    return (count == 0) | (count == np.asarray(get("engine.rotor.blades")))


RULES: dict[str, tuple[Rule, tuple[str, ...]]] = {
    "_a_change_a_blade": (
        _changes, ("engine.rotor.mistuning", "engine.rotor.blades"),
    ),
    "_disk_inside": (
        lambda get: np.asarray(get("engine.rotor.disk_radius"))
        < np.asarray(get("engine.rotor.radius")),
        ("engine.rotor.disk_radius", "engine.rotor.radius"),
    ),
    "_families_of_harmonics": (
        lambda get: np.equal(get("engine.casing.families"), "all")
        | np.equal(get("engine.casing.discretization"), "fourier"),
        ("engine.casing.families", "engine.casing.discretization"),
    ),
    "_a_file_is_as_it_is": (
        lambda get: np.equal(get(FILE), "")
        | np.equal(get("engine.rotor.mistuning"), 0),
        (FILE, "engine.rotor.mistuning"),
    ),
    "_a_casing_has_its_file": (
        lambda get: np.not_equal(get("engine.casing.discretization"), "file")
        | np.not_equal(get(FILE), ""),
        ("engine.casing.discretization", FILE),
    ),
    "_ring_carries_the_load": (
        _carried,
        ("engine.casing.kind", "engine.casing.discretization",
         "engine.casing.elements", "engine.casing.harmonics", "nodal_diameter"),
    ),
    "_revolutions_need_a_speed": (
        lambda get: np.less_equal(get("revolutions"), 0)
        | np.not_equal(get("speed"), 0),
        ("revolutions", "speed"),
    ),
    "_countable_steps": (
        _countable,
        ("duration", "revolutions", "speed", "solver.until", "solver.longest",
         "solver.time_step"),
    ),
    "_lasts_as_long_as_asked": (
        lambda get: np.not_equal(get("solver.until"), "decided")
        | (np.asarray(get("solver.longest")) >= end_times(get)),
        ("duration", "revolutions", "speed", "solver.until", "solver.longest"),
    ),
    "_gap_of_a_ring": (
        lambda get: np.asarray(get("gap"))
        <= MOST_GAP * np.asarray(get("engine.rotor.radius")),
        ("gap", "engine.rotor.radius"),
    ),
}  # fmt: skip


@cache
def _adapter(name: str) -> TypeAdapter[Any]:
    field = next(field for leaf, field in LEAVES if leaf == name)
    kind = Annotated[field.annotation, *field.metadata]  # type: ignore[name-defined]
    return TypeAdapter(Annotated[list[kind], FailFast()], config=STRICT)


def first_refused(name: str, values: Values) -> int:
    """Return the place of the first value that an input does not allow; -1: all do."""
    try:
        _adapter(name).validate_python(listed(values))
    except ValidationError as failed:
        return int(failed.errors(include_url=False)[0]["loc"][0])
    return -1


class Many:
    """The cases of a table as columns.

    Parameters
    ----------
    base : what they share
    table : what each sets
    """

    def __init__(self, base: Scene, table: Table) -> None:
        self.base, self.table = base, table
        self.shared = flatten(base)
        self.columns = {n: table.column(n, self.shared[n]) for n in table.names}
        self._known_numbers: dict[str, Array] = {}

    def numbers(self, name: str, values: Values) -> Array:
        """Return values for arithmetic: of lists the lengths."""
        if takes_list(name):
            return np.array([len(value) for value in values])
        if isinstance(values, np.ndarray):
            return values
        words = any(isinstance(value, str) for value in values)
        return np.array(values, dtype=object if words else None)

    def chunks(self, count: int | None = None) -> Iterator[Array]:
        """Yield the numbers of the cases, or the first of them, some at once."""
        most = len(self.table) if count is None else count
        for start in range(0, most, AT_ONCE):
            yield np.arange(start, min(start + AT_ONCE, most))

    def check(self) -> None:
        """Raise InputError where a case is no scene, telling of the first such case."""
        wrong = self.first_wrong()
        if wrong < len(self.table):
            apply_settings(self.base, self.table[wrong])
            msg = f"case {wrong} breaks a rule that its scene does not know"
            raise WhirlError(msg)
        for case in sorted(set(np.linspace(0, wrong - 1, BUILT).astype(int).tolist())):
            apply_settings(self.base, self.table[case])

    def first_wrong(self) -> int:
        """Return the first case that is no scene; if all are, the number of cases."""
        wrong = self._first_wrong_value()
        for rule, inputs in RULES.values():
            wrong = self._first_wrong(rule, inputs, wrong)
        return wrong

    def _first_wrong_value(self) -> int:
        """Return the first case with a value that is none of its input."""
        wrong = len(self.table)
        for name, column in self.columns.items():
            place = first_refused(name, column.values)
            if place >= 0:
                wrong = min(wrong, column.case_of(place))
        return wrong

    def _first_wrong(self, rule: Rule, inputs: tuple[str, ...], before: int) -> int:
        """Return the first case before another one that breaks a rule, else that."""
        swept = {n: self.columns[n] for n in inputs if n in self.columns}
        found = self.table.first_of(swept)
        found = found[: np.searchsorted(found, before)]
        if not swept or not len(found):
            return before
        values = {n: self._known(n, column, found) for n, column in swept.items()}
        wrong = self._first(found, lambda get: np.logical_not(rule(get)), values)
        return before if wrong is None else wrong

    def first_where(self, holds: Rule, inputs: tuple[str, ...]) -> int | None:
        """Return the first case of which something holds that inputs decide."""
        swept = (n for n in inputs if n in self.columns)
        return self._first(self.table.first_of(swept), holds)

    def _first(
        self, found: Array, holds: Rule, values: dict[str, Array] | None = None
    ) -> int | None:
        """Return the first of some cases of which something holds."""
        for start in range(0, len(found), AT_ONCE):
            cases = found[start : start + AT_ONCE]
            told = holds(self.all(cases, values))
            met = np.flatnonzero(np.broadcast_to(told, cases.shape))
            if len(met):
                return int(cases[met[0]])
        return None

    def _known(self, name: str, column: Column, cases: Array) -> Array:
        """Return the values of an input that some cases have, as numbers."""
        most = 1 + int(column.codes(cases).max())
        return self.numbers(name, column.values[:most])

    def values(self, name: str) -> Array:
        """Return an input of all cases, (cases,); of lists the lengths."""
        cases = np.arange(len(self.table))
        return np.broadcast_to(self.all(cases)(name), cases.shape)

    def all(self, cases: Array, numbers: Mapping[str, Array] | None = None) -> Columns:
        """Return what tells any input of some cases: one value, or (cases,).

        numbers : {swept input: its values, see `numbers`}, where not all are allowed
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
        """Yield the latest ends of cases, s, some at once."""
        for cases in self.chunks():
            yield np.broadcast_to(_decided_end(self.all(cases)), cases.shape)

    def labels(self, names: Iterable[str], cases: Array | None = None) -> Array:
        """Return numbers of cases, (m,), the same where they have the same inputs.

        Parameters
        ----------
        names : of the inputs; those that no case sets are the same in all
        cases : (m,); None: all
        """
        parts = []
        for name in names:
            if name in self.columns:
                column, text = self.columns[name], partial(fragment, name)
                parts.append((column, distinct(column.values, text)))
        chosen = np.arange(len(self.table)) if cases is None else cases
        return labels(parts, chosen)

    def first_of(self, cases: Array, names: Iterable[str]) -> list[int]:
        """Return the first of some cases with each combination of inputs, in order.

        Of lists it counts how long they are.
        """
        swept = [(n, self.columns[n]) for n in names if n in self.columns]
        parts = [
            (c, distinct(list(map(len, c.values)) if takes_list(n) else c.values))
            for n, c in swept
        ]
        kind = labels(parts, cases)
        first = np.sort(np.unique(kind, return_index=True)[1])
        return [int(case) for case in cases[first]]

    def kinds(self, names: Iterable[str]) -> Array:
        """Return the first case of each combination of some inputs, ascending."""
        swept = [name for name in names if name in self.columns]
        cases = self.table.first_of(swept)
        kind = self.labels(swept, cases)
        return cases[np.sort(np.unique(kind, return_index=True)[1])]

    def twice(self) -> tuple[int, int] | None:
        """Return the first case whose inputs another has before it, that one first."""
        if self._is_plain_product():
            return None
        _, first, kind = np.unique(
            self.labels(self.columns), return_index=True, return_inverse=True
        )
        again = np.flatnonzero(first[kind] != np.arange(len(kind)))
        return (int(first[kind[again[0]]]), int(again[0])) if len(again) else None

    def _is_plain_product(self) -> bool:
        """Return whether cases are a product of axes of one input, no value twice."""
        blocks = self.table.blocks
        if len(blocks) != 1 or any(len(axis.names) > 1 for axis in blocks[0]):
            return False
        return all(
            distinct(axis.columns[0], partial(fragment, axis.names[0])).max() + 1
            == len(axis)
            for axis in blocks[0]
        )
