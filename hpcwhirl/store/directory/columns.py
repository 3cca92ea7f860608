"""Journals as columns: what their lines tell of many cases, oldest first."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.scene.words import OPEN, is_open
from hpcwhirl.store.directory.lines import Record
from hpcwhirl.store.directory.many import CASE, Known, chunks

FIELDS = ("ended", "performance.seconds", "row.outcome", "row.regime", "row.stop")
KINDS = (np.int64, object, object, object, bool, float, float)
Words = NDArray[np.object_]


class Told(NamedTuple):
    """What some lines of a journal tell, (lines,) each, in their order.

    Attributes
    ----------
    case : in the plan, of a case as planned; -1: of another one, a twin, a later stage
    status, outcome, regime : words
    open : whether a longer run may tell what it does not
    ended : s since 1970; NaN where a line does not tell
    seconds : s, computing; NaN alike
    """

    case: NDArray[np.int64]
    status: Words
    outcome: Words
    regime: Words
    open: NDArray[np.bool_]
    ended: NDArray[np.float64]
    seconds: NDArray[np.float64]


def told_by(folder: Path, digests: Sequence[str]) -> Iterator[tuple[str, Told]]:
    """Yield (journal, what some of its lines tell), the oldest first.

    Torn lines are dropped, and those whose traces are not all there.

    Parameters
    ----------
    folder : of a campaign
    digests : of its plan's cases
    """
    known = Known(digests)
    for chunk in chunks(folder, known, FIELDS):
        others = [(line, *_of_record(r, known)) for line, r in chunk.others]
        at, *told = zip(*others, strict=True) if others else ((),) * 8
        order = np.argsort(np.concatenate([chunk.at, np.array(at, np.int64)]))
        both = zip(_of_fields(chunk.fields), told, KINDS, strict=True)
        columns = (np.concatenate([a, np.array(b, kind)]) for a, b, kind in both)
        yield chunk.journal.stem, Told(*(column[order] for column in columns))


def _of_fields(found: dict[str, NDArray[Any]]) -> Told:
    """Return what packed lines tell."""
    outcome, regime, stop = (found[f"row.{n}"] for n in ("outcome", "regime", "stop"))
    still = (regime == OPEN["regime"]) & (stop == OPEN["stop"])
    status = np.full(len(regime), "ok", dtype=object)
    times = found["ended"], found["performance.seconds"]
    return Told(found[CASE], status, outcome, regime, still, *times)


def _of_record(record: Record, known: Known) -> tuple[Any, ...]:
    """Return what a line tells, in the order of `Told`."""
    case, row = -1, record.get("row") or {}
    if not record.get("twin") and not record.get("longest"):
        case = known.find(str(record["digest"]), record.get("case"))
    seconds = record.get("performance", {}).get("seconds", np.nan)
    words = (str(row.get(name, "none")) for name in ("outcome", "regime"))
    ended, status = float(record.get("ended", np.nan)), str(record["status"])
    still = status == "ok" and is_open(row)
    return case, status, *words, still, ended, float(seconds)
