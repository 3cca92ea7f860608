"""How far a campaign is: told by its manifest, its journals and its ranks' notes."""

from __future__ import annotations

import math
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hpcwhirl.campaign.stop import FILE
from hpcwhirl.scene.inputs import end_time
from hpcwhirl.store.journal import Record, newest, next_run, read_journals
from hpcwhirl.store.manifest import Manifest
from hpcwhirl.store.refined import dropped_of, full_plan
from hpcwhirl.store.rows import counting, extending
from hpcwhirl.store.running import notes
from hpcwhirl.store.runs import why_stopped

PATIENCE = 3.0  # longest cases after which a rank that finished none counts as gone
LEAST_PATIENCE = 60.0  # s


@dataclass(frozen=True)
class Computing:
    """What a rank computes now.

    Attributes
    ----------
    rank, host : of the process
    cases : one, or several while kernels are compiled
    since, seconds : when it began, s since 1970, and for how long; None if unknown
    died : whether it is known to be there no more
    """

    rank: int
    host: str
    cases: list[int]
    since: float | None
    seconds: float | None
    died: bool


@dataclass(frozen=True)
class Progress:
    """State of a campaign.

    Attributes
    ----------
    cases, done, failed, left : numbers of cases
    ranks : that finished a case lately; each is computing one now
    rate : cases/h of these ranks; None before the first of them
    eta : s until nothing is left at that rate, by predicted cost; None if unknown
    kernel_share : of the time of these ranks, up to their last case; the busy fraction
        of results counts keeping cases, too
    stopped : `STOP` where that file is, else why the last run stopped early, if known
    core_hours, core_hours_left : in the kernel; spent includes cases computed twice
    idle_for : s since a case was last finished; None before the first
    regimes : {word: cases}
    statuses : {status: cases} of those that have ended; `unstable` apart from `ok`
    running : what each rank computes now, the longest at it first
    grows : whether words may still ask for more cases
    dropped : cases that a budget has left out
    """

    cases: int
    done: int
    failed: int
    left: int
    ranks: int
    rate: float | None
    eta: float | None
    kernel_share: float | None
    stopped: str
    core_hours: float
    core_hours_left: float | None
    idle_for: float | None
    regimes: dict[str, int]
    statuses: dict[str, int]
    running: list[Computing]
    grows: bool = False
    dropped: int = 0


@dataclass(frozen=True)
class Worker:
    """One rank of one run, as its journal shows it."""

    begun: float
    ended: float
    seconds: float
    work: float
    cases: int

    @property
    def span(self) -> float:
        """Wall time from its beginning to its last finished case, s."""
        return max(self.ended - self.begun, 1e-9)


def worker_of(lines: Sequence[Record], work: Mapping[str, float]) -> Worker | None:
    """Return what a journal tells of its rank; None where it tells no times.

    A core cannot compute more than the clock allows: the rank began no later than
    any case's end less all seconds computed until then, and the earliest of these is
    taken for its beginning.

    Parameters
    ----------
    lines : records of one journal
    work : {digest: predicted steps} of the manifest's cases
    """
    timed = sorted((r for r in lines if "ended" in r), key=lambda r: float(r["ended"]))
    if not timed:
        return None
    begun, seconds = math.inf, 0.0
    for record in timed:
        seconds += seconds_of(record)
        begun = min(begun, record["ended"] - seconds)
    return Worker(
        begun,
        timed[-1]["ended"],
        seconds,
        sum(work.get(r["digest"], 0.0) for r in timed),
        len(timed),
    )


def seconds_of(record: Record) -> float:
    """Return the seconds that a case took."""
    return float(record.get("performance", {}).get("seconds", 0.0))


def status_of(record: Record) -> str:
    """Return the status of an ended case, `unstable` where that is its outcome."""
    unstable = record.get("row", {}).get("outcome") == "unstable"
    return "unstable" if unstable else str(record["status"])


def computing(
    folder: Path, manifest: Manifest, records: Mapping[str, Record], now: float
) -> list[Computing]:
    """Return what each rank computes; a case that has ended since is left out."""
    numbers = {digest: case for case, digest in enumerate(manifest.digests)}
    found = []
    for note in notes(folder):
        begun = note.since or 0.0
        ended = {d for d in note.digests if _ended(records.get(d)) > begun}
        cases = [numbers[d] for d in note.digests if d in numbers and d not in ended]
        if cases:
            seconds = None if note.since is None else now - note.since
            found.append(
                Computing(
                    note.rank, note.host, cases, note.since, seconds, note.left_over
                )
            )
    return sorted(found, key=lambda one: -(one.seconds or 0.0))


def _ended(record: Record | None) -> float:
    """Return when a case ended, s since 1970; -inf where it has not."""
    return float(record.get("ended", 0.0)) if record else -math.inf


def predicted_work(manifest: Manifest) -> dict[str, float]:
    """Return {digest: steps} of each case; one each where the step is not an input."""
    work = {}
    for digest, settings in zip(manifest.digests, manifest.settings, strict=True):
        values: Mapping[str, Any] = manifest.base | settings
        asked = (values.get(name, 0.0) for name in ("duration", "revolutions", "speed"))
        work[digest] = end_time(*asked) / values.get("solver.time_step", 1.0)
    unknown = any((manifest.base | s).get("solver.accuracy") for s in manifest.settings)
    return dict.fromkeys(work, 1.0) if unknown else work


def active(workers: Sequence[Worker], longest: float) -> list[Worker]:
    """Return the ranks that finished a case about as lately as the last one did."""
    last = max((w.ended for w in workers), default=0.0)
    patience = max(LEAST_PATIENCE, PATIENCE * longest)
    return [w for w in workers if last - w.ended <= patience]


def progress_of(folder: Path, now: float | None = None) -> Progress:
    """Return the progress of a campaign directory.

    Parameters
    ----------
    folder : the campaign's directory
    now : s since 1970; None: this moment

    Raises
    ------
    MissingFileError, StoreError
        where it is no campaign directory, or its manifest is damaged
    """
    now = time.time() if now is None else now
    manifest, journals = full_plan(folder), read_journals(folder)
    lines = [record for journal in journals.values() for record in journal]
    records = newest(folder, lines)
    counts = counting(records.values(), manifest)
    own = [counts[d] for d in manifest.digests if d in counts]
    done = [r for r in own if r["status"] == "ok"]
    work = predicted_work(manifest)
    workers = [worker_of(journal, work) for journal in journals.values()]
    known = [w for w in workers if w is not None]
    at_work = active(known, max(map(seconds_of, lines), default=0.0))
    going, stuck = extending(records.values(), manifest)
    open_ = [d for d in manifest.digests if d not in records or d in going]
    left_work = sum(work[d] for d in open_)
    seconds, span = sum(w.seconds for w in at_work), sum(w.span for w in at_work)
    pace = sum(w.work / w.span for w in at_work)
    done_work = sum(w.work for w in known)
    spent = sum(map(seconds_of, lines))
    last = max((w.ended for w in known), default=None)
    left = len(open_)
    without = len(own) - len(done) + len(stuck)
    at_it = computing(folder, manifest, records, now)
    return Progress(
        cases=len(manifest.digests),
        done=len(manifest.digests) - left - without,
        failed=without,
        left=left,
        ranks=len(at_work),
        rate=3600 * sum(w.cases / w.span for w in at_work) if at_work else None,
        eta=left_work / pace if pace else (0.0 if not left else None),
        kernel_share=seconds / span if at_work else None,
        stopped=stopped(folder, left, at_it),
        core_hours=spent / 3600,
        core_hours_left=left_work * spent / done_work / 3600 if done_work else None,
        idle_for=now - last if last else None,
        regimes=dict(Counter(r["row"]["regime"] for r in done)),
        statuses=dict(Counter(map(status_of, own))),
        running=at_it,
        grows=bool(manifest.refine) and left > 0,
        dropped=dropped_of(manifest),
    )


def stopped(folder: Path, left: int, running: Sequence[Computing]) -> str:
    """Return `STOP` where that file is, else why the last run stopped early.

    A run that was killed tells nothing, nor does one that is at it.
    """
    if (folder / FILE).exists():
        return FILE
    if not left or any(not one.died for one in running):
        return ""
    told = why_stopped(folder, next_run(folder) - 1)
    return f"{FILE}, removed since" if told.endswith(f"{FILE} is there") else told


def duration_text(seconds: float) -> str:
    """Return a duration as people write it: ``42 s``, ``3 min``, ``5 h 20 min``."""
    whole = round(seconds)
    if whole < 120:
        return f"{whole} s"
    hours, minutes = divmod(round(seconds / 60), 60)
    return f"{hours} h {minutes:02d} min" if hours else f"{minutes} min"
