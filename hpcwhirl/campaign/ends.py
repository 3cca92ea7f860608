"""How the computations of a campaign have ended, found in its journals."""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.campaign.stages import Ended, Left, Stages, ended_of
from hpcwhirl.store.journal import Record, is_whole, whole_records
from hpcwhirl.store.measured import WHY_NOT


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
    count, digests = len(stages), stages.design.digests
    ends = Ends(np.zeros(count, dtype=bool), np.full(count, np.nan), {})
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


def brief(
    folder: Path, retry: Collection[str], record: Record
) -> tuple[Ended, float, bool]:
    """Return how a case ended, its seconds, and whether it is computed again."""
    end, status = ended_of(record), str(record["status"])
    seconds = record["performance"].get("seconds", math.nan)
    damaged = retry and status == "ok" and not is_whole(folder, record)
    damaged = damaged or (retry and WHY_NOT in record)
    return end, seconds, bool(status in retry or damaged)
