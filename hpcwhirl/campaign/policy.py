"""How a campaign is run, which no result depends on: limits, retries, isolation."""

from __future__ import annotations

import math
from typing import Self

from hpcwhirl.campaign.stop import time_left
from hpcwhirl.launch import Shard
from hpcwhirl.scene.campaign_tables import Campaign, walltime_seconds


class Policy(Campaign):
    """The rules of one call of a campaign: [campaign], and what a call alone has.

    Attributes
    ----------
    seconds : until this call is to end, s; None: no limit
    shard : compute this share alone; the last shard to end gathers
    take_over : whether claims of other machines, to compute and to gather, count as
        dead
    pilot : s of computing after which this call ends; cases go out evenly over all
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
        """Return the rules of a call that begins now."""
        given = walltime_seconds(rules.walltime) if rules.walltime else None
        own = {"seconds": time_left(given), "shard": shard, "take_over": take_over}
        own["pilot"] = pilot
        return cls(**dict(rules) | own)

    @property
    def limit(self) -> float:
        """The computing time of a case, s, without end where none is set."""
        return math.inf if self.case_limit is None else self.case_limit
