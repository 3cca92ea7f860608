"""Which of a case's records counts, where a campaign was extended, see `campaign`."""

from __future__ import annotations

from collections.abc import Collection, Iterable

from hpcwhirl.scene.words import is_open
from hpcwhirl.store.journal import Record
from hpcwhirl.store.manifest import Manifest


def stage_of(record: Record, plan: Manifest) -> tuple[int, str]:
    """Return (stage, digest of the case) of a record; (-1, "") of none of this plan's.

    The row of a case is that of the last stage that gave a result: a case that went on
    and failed has the row that it had before.
    """
    if "of" not in record:
        return 0, str(record.get("digest", ""))
    if record.get("status") != "ok" or record.get("longest") not in plan.extended:
        return -1, ""
    return 1 + plan.extended.index(record["longest"]), str(record["of"])


def counting(records: Iterable[Record], plan: Manifest) -> dict[str, Record]:
    """Return {digest of a case: the record that counts} of these, the oldest first."""
    found: dict[str, tuple[int, Record]] = {}
    for record in records:
        stage, name = stage_of(record, plan)
        if stage >= found.get(name, (0,))[0]:
            found[name] = stage, record
    return {name: record for name, (_, record) in found.items()}


def extending(
    records: Collection[Record], plan: Manifest
) -> tuple[frozenset[str], frozenset[str]]:
    """Return digests of the cases that are still to go on, and of those that failed to.

    Parameters
    ----------
    records : all there are, one of each digest
    plan : of the campaign
    """
    tried = {(record.get("of"), record.get("longest")) for record in records}
    left: set[str] = set()
    failed: set[str] = set()
    for name, record in counting(records, plan).items():
        row = record.get("row") or {}
        later = [time for time in plan.extended if time > row.get("duration", 0.0)]
        if record["status"] == "ok" and is_open(row) and later:
            (failed if (name, later[0]) in tried else left).add(name)
    return frozenset(left), frozenset(failed)
