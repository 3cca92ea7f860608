"""Cases in blocks: their columns and traces as arrays, a bounded number of bytes."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.scene.inputs import end_time
from hpcwhirl.scene.quantities import PERFORMANCE, ROW, STATUS, variable_name
from hpcwhirl.scene.quantity import Quantity
from hpcwhirl.scene.table import listed
from hpcwhirl.scene.words import ENUMS
from hpcwhirl.store.directory.blades import amplification
from hpcwhirl.store.directory.journal import Record, read_traces
from hpcwhirl.store.directory.lines import USUAL
from hpcwhirl.store.directory.manifest import Manifest
from hpcwhirl.store.directory.many import columns
from hpcwhirl.store.reading.shares import GROUP, TWIN_ROW, shares
from hpcwhirl.store.reading.shown import words_of
from hpcwhirl.store.results.contents import Contents, packed_of, records_of
from hpcwhirl.store.results.layout import stored, swept_extra
from hpcwhirl.store.results.measured import measured_of, measured_row
from hpcwhirl.store.schema import dtype, encode, missing

MOST_BYTES = 32 << 20  # of the traces of a block, but at least one case
MOST_CASES = 1024
Array = NDArray[Any]
Block = dict[str, Array]  # by the path of the variable in the file
NOTHING: frozenset[type] = frozenset()
PLAIN = {"f8": frozenset({float, int}), "i8": frozenset({int})}
ABSENT = object()  # from a row


def ranges(cases: int, rank: int, size: int, block: int) -> list[range]:
    """Return the ranges of cases that a rank writes, as many for every rank.

    Shares are contiguous and differ by a case at most; who has less than others gets
    empty ranges at the end.
    """
    starts = [r * cases // size for r in range(size + 1)]
    rounds = -(-max(b - a for a, b in pairwise(starts)) // block)
    first, last = starts[rank], starts[rank + 1]
    edges = [min(first + i * block, last) for i in range(rounds + 1)]
    return [range(a, b) for a, b in pairwise(edges)]


def block_size(contents: Contents) -> int:
    """Return the cases of a block."""
    each = max(contents.bytes_of_traces(), 1)
    return max(1, min(MOST_CASES, MOST_BYTES // each))


def read_block(contents: Contents, cases: range) -> Block:
    """Return what the file will hold of some cases, {variable: (cases, ...)}.

    Raises
    ------
    StoreError, MissingFileError
        where a record or a trace is damaged
    """
    if not contents.is_plain:
        out = _by_rows(contents, cases, records_of(contents, cases))
    else:
        at, numbers, records = packed_of(contents, cases)
        rest = np.setdiff1d(np.arange(len(cases)), at, assume_unique=True)
        out = _by_rows(contents, [cases[i] for i in rest.tolist()], records)
        if len(at):
            out = _together(len(cases), (rest, out), (at, _by_numbers(numbers)))
        out |= _traces(contents, cases, records)
    for name, column in contents.columns.items():
        out[name] = column[cases.start : cases.stop]
    return out | _swept(contents.plan, cases)


def _by_rows(
    contents: Contents, cases: Sequence[int], records: dict[int, Record]
) -> Block:
    """Return the columns of cases from their records; of a range, all there are."""
    plan = contents.plan
    rows = [row_of(plan, case, records.get(case)) for case in cases]
    out = _table(ROW, rows) | _table(STATUS, [_status(records.get(c)) for c in cases])
    spent = [records[case]["performance"] if case in records else {} for case in cases]
    for name, column in _table(PERFORMANCE, spent).items():
        out[f"performance/{name}"] = column
    if contents.is_plain or not isinstance(cases, range):
        return out
    out |= _blades(contents, rows, records, cases)
    own = [measured_row(records.get(case)) for case in cases]
    out |= _table(measured_of(plan), own)
    return out | _twins(contents, cases, out) | _traces(contents, cases, records)


def _by_numbers(numbers: Array) -> Block:
    """Return the columns of cases whose lines are packed."""
    out = columns(ROW, numbers, "row")
    for name, column in columns(PERFORMANCE, numbers, "performance").items():
        out[f"performance/{name}"] = column
    usual = [encode(n, q, str(USUAL[n])) for n, q in STATUS.items()]
    for (name, quantity), value in zip(STATUS.items(), usual, strict=True):
        out[name] = np.full(len(numbers), value, dtype=dtype(quantity))
    return out


def _together(
    count: int, one: tuple[Array, Block], other: tuple[Array, Block]
) -> Block:
    """Return columns of so many cases, of which either knows some."""
    out: Block = {}
    for name, column in other[1].items():
        out[name] = np.empty(count, dtype=column.dtype)
        out[name][one[0]], out[name][other[0]] = one[1][name], column
    return out


def _swept(plan: Manifest, cases: range) -> Block:
    """Return the swept inputs that no row has."""
    out: Block = {}
    numbers = np.arange(cases.start, cases.stop)
    for name, dotted in swept_extra(plan).items():
        column = plan.table.column(dotted, plan.base[dotted])
        out[name] = column.of(numbers, np.array([*map(stored, listed(column.values))]))
    return out


def _twins(contents: Contents, cases: range, own: Block) -> Block:
    """Return the rows of twins, {`twins/NAME`: (cases, twins)}, and their shares."""
    count = contents.twins.shape[1]
    if not count:
        return {}
    parts = []
    for twin in range(1, count + 1):
        found = records_of(contents, cases, twin)
        rows = [_twin_row(found.get(case)) for case in cases]
        parts.append(_table(TWIN_ROW, rows))
    out = {
        f"{GROUP}/{n}": np.stack([part[n] for part in parts], axis=1) for n in TWIN_ROW
    }
    mine, theirs = (
        words_of(*(_words(block[n], n) for n in ("status", "outcome", "regime")))
        for block in (own, {n: out[f"{GROUP}/{n}"] for n in TWIN_ROW})
    )
    return out | shares(mine, theirs)


def _twin_row(record: Record | None) -> dict[str, Any]:
    """Return the row of a twin and its status; what is not to be is missing."""
    known = record or {"status": "missing"}
    return dict(known.get("row") or {}) | {"status": known["status"]}


def _words(codes: Array, name: str) -> Array:
    return np.array(ENUMS[name])[codes]


def _blades(
    contents: Contents,
    rows: list[dict[str, Any]],
    records: dict[int, Record],
    cases: range,
) -> Block:
    """Return the variables of blades, if the plan has any."""
    table, tuned_of = contents.blades, contents.tuned
    if "amplification" in table:
        first = {tuned_of[case]: None for case in cases if case in tuned_of}
        tuned = {t: records_of(contents, range(t, t + 1)).get(t) for t in first}
        for case, row in zip(cases, rows, strict=True):
            beside = tuned.get(tuned_of.get(case, -1))
            row.update(amplification(records.get(case), beside))
    return _table(table, rows)


def _status(record: Record | None) -> dict[str, Any]:
    return record or {"status": "missing", "message": "not computed yet"}


def row_of(plan: Manifest, case: int, record: Record | None) -> dict[str, Any]:
    """Return the row of a case; without a result, what is known: its inputs."""
    if record and record.get("row"):
        return dict(record["row"])
    values = plan.base | plan.settings[case]
    if values.get("revolutions"):
        asked = values["duration"], values["revolutions"], values["speed"]
        values["duration"] = end_time(*asked)
    short = {variable_name(dotted): value for dotted, value in values.items()}
    return {name: short[name] for name in ROW if name in short}


def _table(table: dict[str, Quantity], rows: list[dict[str, Any]]) -> Block:
    """Return the columns of a table from rows, of which some may lack some names."""
    return {name: _column(name, variable, rows) for name, variable in table.items()}


def _column(name: str, variable: Quantity, rows: list[dict[str, Any]]) -> Array:
    """Return a column; numbers of the type it has are put there all at once.

    Whatever else stands in a row goes through `encode`, which may refuse it.
    """
    kind = dtype(variable)
    try:
        values = [row[name] for row in rows]
        types = set(map(type, values))
    except KeyError:
        values, types = [row.get(name, ABSENT) for row in rows], {object}
    if types <= PLAIN.get(variable.kind, NOTHING):
        return np.array(values, dtype=kind)
    if types == {str}:
        of = {value: encode(name, variable, value) for value in set(values)}
        return np.array([of[value] for value in values], dtype=kind)
    empty = missing(variable)
    each = (empty if v is ABSENT else encode(name, variable, v) for v in values)
    return np.array(list(each), dtype=kind)


def _traces(contents: Contents, cases: range, records: dict[int, Record]) -> Block:
    shapes = contents.trace_shapes()
    out = {name: np.full((len(cases), *s), np.nan) for name, s in shapes.items()}
    for case, record in records.items():
        if record.get("traces"):
            for name, values in read_traces(contents.folder, record["traces"]).items():
                if name in out:
                    into = out[name][case - cases.start]
                    into[tuple(map(slice, values.shape))] = values
    return out
