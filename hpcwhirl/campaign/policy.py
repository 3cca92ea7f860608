"""Options of a run that change no result: limits, retries, isolation."""

from __future__ import annotations

import math
from typing import Self

from hpcwhirl.campaign.stop import time_left
from hpcwhirl.launch import Shard
from hpcwhirl.scene.campaign_tables import Campaign, walltime_seconds


class Policy(Campaign):
    """Options of one run: the keys of [campaign], and the attributes listed here.

    Attributes
    ----------
    seconds : wall time until this run stops, s; None: no limit
    shard : part of the cases to compute; the last shard to end gathers
    take_over : whether claims of processes on other machines count as dead
    pilot : computing time after which a pilot stops, s; its cases are spread evenly
    """

    seconds: float | None = None
    shard: Shard | None = None
    take_over: bool = False
    pilot: float | None = None

    @classmethod
    def of(
        cls,
        rules: Campaign,
        shard: Shard | None = None,
        *,
        take_over: bool = False,
        pilot: float | None = None,
    ) -> Self:
        """Return the options of a run whose wall time counts from now."""
        given = walltime_seconds(rules.walltime) if rules.walltime else None
        own = {"seconds": time_left(given), "shard": shard, "take_over": take_over}
        own["pilot"] = pilot
        return cls(**dict(rules) | own)

    @property
    def limit(self) -> float:
        """Longest computing time of a case, s; infinite by default."""
        return math.inf if self.case_limit is None else self.case_limit
