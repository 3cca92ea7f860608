"""Read the records of some cases (a block) as the arrays that results.h5 stores.

Gathering goes block by block, so that its memory does not grow with the campaign.
"""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.scene.quantities import PERFORMANCE, ROW, STATUS, variable_name
from hpcwhirl.scene.rules import end_time
from hpcwhirl.scene.table import listed
from hpcwhirl.scene.units import Quantity
from hpcwhirl.scene.words import ENUMS
from hpcwhirl.store.directory.manifest import Manifest
from hpcwhirl.store.directory.reader import Rows
from hpcwhirl.store.directory.record import Record
from hpcwhirl.store.hdf5 import dtype, encode, missing
from hpcwhirl.store.reading.shares import GROUP, TWIN_ROW, shares, words_of
from hpcwhirl.store.results.contents import Contents, parts_of
from hpcwhirl.store.results.layout import stored, swept_extra
from hpcwhirl.store.results.variables import VALUES, WHY_NOT, amplification, measured_of

MOST_BYTES = 32 << 20  # most bytes of traces in a block, unless one case has more
MOST_CASES = 1024
Array = NDArray[Any]
Block = dict[str, Array]  # {path of the variable in the file: (cases, ...)}
Parts = list[tuple[Array, Rows]]  # (indices of cases in the block, their records)
MISSING = {"status": "missing", "message": "not computed yet"}  # without a record


def ranges(cases: int, rank: int, size: int, block: int) -> list[range]:
    """Return which cases this rank writes into results.h5, in ranges of limited size.

    The cases of a rank are contiguous; ranks differ by at most one case. Every rank
    gets equally many ranges; a rank with fewer cases gets empty ones at the end.

    Parameters
    ----------
    cases : number of all cases
    rank, size : number of this rank, and of all ranks
    block : largest number of cases in a range
    """
    starts = [r * cases // size for r in range(size + 1)]
    rounds = -(-max(b - a for a, b in pairwise(starts)) // block)
    first, last = starts[rank], starts[rank + 1]
    edges = [min(first + i * block, last) for i in range(rounds + 1)]
    return [range(a, b) for a, b in pairwise(edges)]


def block_size(contents: Contents) -> int:
    """Return how many cases are read and written together, as one block.

    contents : what results are gathered from
    """
    each = max(contents.bytes_of_traces(), 1)
    return max(1, min(MOST_CASES, MOST_BYTES // each))


def read_block(contents: Contents, cases: range) -> Block:
    """Read the records and traces of some cases; return them as results.h5 stores them.

    Parameters
    ----------
    contents : what results are gathered from
    cases : numbers of the cases

    Returns
    -------
    {variable: values, (cases, ...)}

    Raises
    ------
    StoreError, MissingFileError
        where a record or a trace is damaged
    """
    plan, parts = contents.plan, list(parts_of(contents, cases))
    out = _table(ROW | STATUS, parts, len(cases), "row.")
    _fill(plan, cases, parts, out)
    for name, column in _table(PERFORMANCE, parts, len(cases), "performance.").items():
        out[f"performance/{name}"] = column
    out |= _table(measured_of(plan), parts, len(cases), f"{VALUES}.")
    out |= _asked(contents, cases, parts) | _twins(contents, cases, out)
    for name, column in contents.columns.items():
        out[name] = column[cases.start : cases.stop]
    return out | _traces(contents, len(cases), parts) | _swept(plan, cases)


def _fill(plan: Manifest, cases: range, parts: Parts, out: Block) -> None:
    """Enter what is known of cases without a record: status `missing`, and inputs.

    Inputs are also entered for cases that gave no numbers.

    Parameters
    ----------
    plan : plan of the campaign
    cases : numbers of the cases
    parts : their records
    out : {variable: (cases,)}, changed here
    """
    none = np.ones((2, len(cases)), dtype=bool)
    for at, rows in parts:
        none[0, at], none[1, at] = False, ~rows.has_any("row")
    for name, text in MISSING.items():
        out[name][none[0]] = encode(name, STATUS[name], text)
    for place in np.flatnonzero(none[1]).tolist():
        for name, value in inputs_of(plan, cases[place]).items():
            out[name][place] = encode(name, ROW[name], value)


def _swept(plan: Manifest, cases: range) -> Block:
    """Return {variable: (cases,)} of swept inputs that are no usual variables (`ROW`).

    Parameters
    ----------
    plan : plan of the campaign
    cases : numbers of the cases
    """
    out: Block = {}
    numbers = np.arange(cases.start, cases.stop)
    for name, dotted in swept_extra(plan).items():
        column = plan.table.column(dotted, plan.base[dotted])
        out[name] = column.of(numbers, np.array([*map(stored, listed(column.values))]))
    return out


def _twins(contents: Contents, cases: range, own: Block) -> Block:
    """Return the variables of the twins of some cases, and shares of their words.

    Parameters
    ----------
    contents : what results are gathered from
    cases : numbers of the cases
    own : {variable: (cases,)} of the cases themselves, with status, outcome and regime

    Returns
    -------
    {`twins/NAME`: (cases, twins)} and {share: (cases,)}
    """
    if not contents.twins:
        return {}
    parts = []
    for twin in range(1, 1 + contents.twins):
        found = list(parts_of(contents, cases, twin))
        part = _table(TWIN_ROW, found, len(cases), "row.")
        there = np.zeros(len(cases), dtype=bool)
        for at, _ in found:
            there[at] = True
        part["status"][~there] = encode("status", STATUS["status"], MISSING["status"])
        parts.append(part)
    out = {
        f"{GROUP}/{n}": np.stack([part[n] for part in parts], axis=1) for n in TWIN_ROW
    }
    mine, theirs = (
        words_of(*(_words(block[n], n) for n in ("status", "outcome", "regime")))
        for block in (own, {n: out[f"{GROUP}/{n}"] for n in TWIN_ROW})
    )
    return out | shares(mine, theirs)


def _words(codes: Array, name: str) -> Array:
    return np.array(ENUMS[name])[codes]


def _asked(contents: Contents, cases: range, parts: Parts) -> Block:
    """Return {variable: (cases,)} of those variables that only some inputs ask for.

    Parameters
    ----------
    contents : what results are gathered from
    cases : numbers of the cases
    parts : records of the cases, one journal at a time
    """
    out = _table(contents.asked, parts, len(cases), "row.")
    if "amplification" in out:
        tuned = {
            i: contents.tuned[c] for i, c in enumerate(cases) if c in contents.tuned
        }
        beside = [*dict.fromkeys(tuned.values())]
        theirs = _records(parts_of(contents, beside))
        own = _records(parts)
        for place, case in tuned.items():
            other = theirs.get(beside.index(case))
            for name, value in amplification(own.get(place), other).items():
                out[name][place] = value
    return out


def _records(parts: Iterable[tuple[Array, Rows]]) -> dict[int, Record]:
    """Return {index of a case in its block: the record of the case}.

    parts : (indices of cases, their records), one journal at a time
    """
    return {place: rows.record(number) for at, rows in parts
            for number, place in enumerate(at.tolist())}  # fmt: skip


def inputs_of(plan: Manifest, case: int) -> dict[str, Any]:
    """Return {variable: value} of the inputs of a case that gave no result.

    Parameters
    ----------
    plan : plan of the campaign
    case : number of the case
    """
    values = plan.base | plan.settings[case]
    if values.get("revolutions"):
        asked = values["duration"], values["revolutions"], values["speed"]
        values["duration"] = end_time(*asked)
    short = {variable_name(dotted): value for dotted, value in values.items()}
    return {name: short[name] for name in ROW if name in short}


def _table(table: dict[str, Quantity], parts: Parts, count: int, of: str) -> Block:
    """Return the values of some variables in the records of a block of cases.

    Parameters
    ----------
    table : the variables
    parts : records of the cases, one journal at a time
    count : number of cases
    of : prefix of these variables' fields in the records, such as "row."; "": no prefix

    Returns
    -------
    {variable: (count,)}, values as stored; a missing one is NaN, -1, 0 or b""
    """
    out: Block = {}
    for name, quantity in table.items():
        out[name] = np.full(count, missing(quantity), dtype=dtype(quantity))
        key = name if name in STATUS or name == WHY_NOT else f"{of}{name}"
        for at, rows in parts:
            out[name][at] = _column(rows, key, name, quantity)
    return out


def _column(rows: Rows, key: str, name: str, quantity: Quantity) -> Array:
    """Return the values that a field has in some records, as results.h5 stores them.

    Parameters
    ----------
    rows : the records
    key, name : the field in the records, and the variable in the results
    quantity : unit and kind of the variable

    Returns
    -------
    (records,); a missing value is NaN, -1, 0 or b""

    Raises
    ------
    InputError
        where a record has a word that this version does not know
    """
    out = np.full(len(rows), missing(quantity), dtype=dtype(quantity))
    has, words = rows.has(key), rows.header.layout.words.get(key)
    if has.any():
        values = rows.slots[key][has]
        if words is not None:
            known = np.zeros(len(words), dtype=out.dtype)
            for code in np.unique(values):
                known[code] = encode(name, quantity, str(words[code]))
            values = known[values]
        out[has] = values
    for record, value in rows.others.get(key, {}).items():
        out[record] = encode(name, quantity, value)
    return out


def _traces(contents: Contents, count: int, parts: Parts) -> Block:
    shapes = contents.trace_shapes()
    out = {name: np.full((count, *s), np.nan) for name, s in shapes.items()}
    for at, rows in parts:
        for number in np.flatnonzero(rows.has_any("traces")).tolist():
            block = rows.record(number)["traces"]
            for name, values in contents.journals.traces(block).items():
                if name in out:
                    into = out[name][at[number]]
                    into[tuple(map(slice, values.shape))] = values
    return out
