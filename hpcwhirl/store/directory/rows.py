"""Which of a case's records counts, where it went on or has twins, see `campaign`."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import NamedTuple

import numpy as np

from hpcwhirl.scene.words import REGIMES, is_open, word_of
from hpcwhirl.store.directory.journal import Record
from hpcwhirl.store.directory.manifest import Manifest
from hpcwhirl.store.directory.refined import with_twins


class Place(NamedTuple):
    """Of what a record is: a case by its digest, a twin or 0, a stage.

    The row of a case is that of the last stage that gave a result: a case that went on
    and failed has the row that it had before. Stage -1 never counts.
    """

    of: str
    twin: int
    stage: int


def place_of(record: Record, plan: Manifest) -> Place:
    """Return of what a record is."""
    of, twin = str(record.get("of", record.get("digest", ""))), record.get("twin", 0)
    time = record.get("longest", 0.0)
    if not isinstance(twin, int) or not 0 <= twin <= plan.twins.get("count", 0):
        return Place("", 0, -1)
    if time == 0.0:
        return Place(of, twin, 0)
    if record.get("status") != "ok" or time not in plan.extended:
        return Place("", 0, -1)
    return Place(of, twin, 1 + plan.extended.index(time))


def regime_of(record: Record) -> str:
    """Return the regime that a record gives, "" for none: neighbours go by it."""
    row, none = record.get("row") or {}, "none"
    words = (str(row.get(name, none)) for name in ("outcome", "regime"))
    word = word_of(str(record["status"]), *words)
    return word if word in REGIMES else ""


def counting(records: Iterable[Record], plan: Manifest) -> dict[str, Record]:
    """Return {digest of a case: the record that counts} of these, the oldest first."""
    found: dict[str, tuple[int, Record]] = {}
    for record in records:
        name, twin, stage = place_of(record, plan)
        if not twin and stage >= found.get(name, (0,))[0]:
            found[name] = stage, record
    return {name: record for name, (_, record) in found.items()}


def extending(
    records: Collection[Record], plan: Manifest
) -> tuple[frozenset[str], frozenset[str]]:
    """Return digests of the cases that are still to go on, and of those that failed to.

    Where all have gone on, those still count whose twins are not all there.

    Parameters
    ----------
    records : all there are, one of each digest
    plan : of the campaign
    """
    own = [record for record in records if not record.get("twin")]
    tried = {(record.get("of"), record.get("longest")) for record in own}
    left: set[str] = set()
    failed: set[str] = set()
    for name, record in counting(own, plan).items():
        row = record.get("row") or {}
        later = [time for time in plan.extended if time > row.get("duration", 0.0)]
        if record["status"] == "ok" and is_open(row) and later:
            (failed if (name, later[0]) in tried else left).add(name)
    if not left:
        left |= _without_twins(records, plan) - failed
    return frozenset(left), frozenset(failed)


def _without_twins(records: Collection[Record], plan: Manifest) -> set[str]:
    """Return digests of the cases whose twins are not all there yet."""
    wanted = range(1, plan.twins.get("count", 0) + 1)
    counts = counting(records, plan)
    known = [counts.get(name) for name in plan.digests]
    edge = np.array([r is not None and r["status"] == "ok" for r in known], dtype=bool)
    words = [regime_of(record) if record else "" for record in known]
    every = plan.twins.get("of") == "all" or None not in known
    edge &= with_twins(plan, words) & every
    there: dict[str, set[int]] = {}
    for record in records:
        there.setdefault(str(record.get("of")), set()).add(record.get("twin", 0))
    names = np.array(plan.digests)[edge]
    return {str(name) for name in names if set(wanted) - there.get(str(name), set())}
