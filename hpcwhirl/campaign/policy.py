"""How a campaign is run, which no result depends on: limits, retries, isolation."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from hpcwhirl.campaign.shards import Shard
from hpcwhirl.errors import InputError, shown, unknown
from hpcwhirl.scene.files import PRESET

RETRIES = ("failed", "timeout", "crashed")
PATIENCE = 30.0  # s for all ranks to stop; a slice takes milliseconds
SAVE_EVERY = 600.0  # s of a case's computing between states kept of it


@dataclass(frozen=True)
class Policy:
    """The rules of one call of a campaign.

    Attributes
    ----------
    retry : statuses of cases that are computed again
    lanes : whether cases ride in batches; None: where they pay, see `units_of`
    seconds : until this call is to end, s; None: no limit
    case_limit : computing time of a case, s, over all calls; None: no limit
    max_fails : cases without a result after which this call ends; None: no limit
    isolate : whether each case is computed in a process of its own
    save_every : s of a case's computing between states kept of it
    shard : compute this share alone; the last shard to end gathers
    patience : s after a wish to stop in which all ranks have to; then all are ended
    """

    retry: frozenset[str] = frozenset()
    lanes: bool | None = None
    seconds: float | None = None
    case_limit: float | None = None
    max_fails: int | None = None
    isolate: bool = False
    save_every: float = SAVE_EVERY
    shard: Shard | None = None
    patience: float = PATIENCE

    @property
    def limit(self) -> float:
        """The computing time of a case, s, without end where none is set."""
        return math.inf if self.case_limit is None else self.case_limit


def retries(words: Iterable[str]) -> frozenset[str]:
    """Return the statuses that ``--retry`` names, each a list by commas."""
    found = [part.strip() for word in words for part in word.split(",")]
    for part in found:
        if part not in RETRIES:
            raise unknown("--retry", part, RETRIES)
    return frozenset(found)


def with_rules(policy: Policy, rules: Mapping[str, Any]) -> Policy:
    """Return the policy with what a campaign's table [campaign] sets.

    Raises
    ------
    InputError
        naming the key, what it got and what is allowed
    """
    for key, value in rules.items():
        if key == PRESET:
            msg = "unknown key in [campaign] 'preset'; it belongs in [solver]"
            raise InputError(msg)
        if key not in CHECKS:
            raise unknown("key in [campaign]", key, CHECKS)
        kind, allowed = CHECKS[key]
        number = not isinstance(value, bool) or kind is bool
        if not number or not isinstance(value, kind) or (kind is not bool and not (
            0 < value < math.inf
        )):  # fmt: skip
            msg = f"[campaign] {key} must be {allowed}, got {shown(value)}"
            raise InputError(msg)
    return replace(policy, **rules)


CHECKS: dict[str, tuple[Any, str]] = {
    "case_limit": (int | float, "a number of seconds > 0"),
    "max_fails": (int, "a whole number > 0"),
    "isolate": (bool, "true or false"),
    "save_every": (int | float, "a number of seconds > 0"),
    "patience": (int | float, "a number of seconds > 0"),
}
