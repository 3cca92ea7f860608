"""How the computations of a campaign have ended, found in its journals."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.campaign.plan.stages import Ended, Left, Stages, ended_of
from hpcwhirl.store.directory.columns import told_by
from hpcwhirl.store.directory.journal import Record, is_whole, whole_records
from hpcwhirl.store.results.measured import WHY_NOT


@dataclass(frozen=True)
class Ends:
    """What has ended, 9 bytes a case.

    Attributes
    ----------
    over : (cases,), whether a case as planned has ended
    seconds : (cases,), s, that those took which gave a result; NaN of others
    told : {digest: how it ended} of what was asked for
    """

    over: NDArray[np.bool_]
    seconds: NDArray[np.float64]
    told: dict[str, Ended]

    def left(self, stages: Stages) -> Left:
        """Return what is to do of the cases that are not at their end."""
        if stages.is_plain:
            return Left(np.flatnonzero(~self.over), {}, stages.whole())
        return stages.left(self.told)


def ends_of(
    folder: Path,
    stages: Stages,
    retry: Collection[str] = (),
    asked: Collection[str] | None = None,
) -> Ends:
    """Return what has ended in a directory.

    Parameters
    ----------
    folder, stages : of the campaign
    retry : statuses to be computed again; if any, damaged traces are, too
    asked : digests of what is told one by one; None: all
    """
    digests = stages.design.digests
    if asked is not None and stages.is_plain and not retry:
        cases = {name: digests.find(name) for name in asked}
        if min(cases.values(), default=0) >= 0:
            return _by_columns(folder, stages, cases)
    ends = _nothing(stages)
    for _, _, record in whole_records(folder):
        end, seconds, again = brief(folder, retry, record)
        name = record["digest"]
        if asked is None or name in asked:
            ends.told.pop(name, None)
            if not again:
                ends.told[name] = end
        case = digests.find(name, end.case) if end.is_planned else -1
        if case >= 0:
            ends.over[case] = not again
            ends.seconds[case] = seconds if end.status == "ok" else math.nan
    return ends


def _nothing(stages: Stages) -> Ends:
    count = len(stages)
    return Ends(np.zeros(count, dtype=bool), np.full(count, np.nan), {})


def _by_columns(folder: Path, stages: Stages, asked: Mapping[str, int]) -> Ends:
    """Return what has ended where a case is one computation.

    asked : {digest: case} of what is told one by one
    """
    ends = _nothing(stages)
    numbers = np.array(list(asked.values()), dtype=np.int64)
    for _, told in told_by(folder, stages.design.digests):
        own = np.flatnonzero(told.case >= 0)
        case, ok = told.case[own], told.status[own] == "ok"
        ends.over[case] = True
        ends.seconds[case] = np.where(ok, told.seconds[own], np.nan)
        for place in own[np.isin(case, numbers)]:
            name = stages.design.digests[int(told.case[place])]
            still = bool(told.open[place])
            ends.told[name] = Ended(told.status[place], "", still, name, 0, 0.0)
    return ends


def brief(
    folder: Path, retry: Collection[str], record: Record
) -> tuple[Ended, float, bool]:
    """Return how a case ended, its seconds, and whether it is computed again."""
    end, status = ended_of(record), str(record["status"])
    seconds = record["performance"].get("seconds", math.nan)
    damaged = retry and status == "ok" and not is_whole(folder, record)
    damaged = damaged or (retry and WHY_NOT in record)
    return end, seconds, bool(status in retry or damaged)
