"""How a campaign is run, which no result depends on: limits, retries, isolation."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

from hpcwhirl.campaign.stop import parse_walltime
from hpcwhirl.errors import InputError, shown, unknown
from hpcwhirl.launch import Shard
from hpcwhirl.scene.files import PRESET

WAYS = ("auto", "yes", "no")  # of what pays, or is wanted, not always
RETRIES = ("failed", "timeout", "crashed")
PATIENCE = 30.0  # s for all ranks to stop; a slice takes milliseconds
SAVE_EVERY = 600.0  # s of a case's computing between states kept of it
MOST_ON_PAGE = 2000  # cases of a page that is written without being asked for


@dataclass(frozen=True)
class Policy:
    """The rules of one call of a campaign.

    Attributes
    ----------
    retry : statuses of cases that are computed again
    seconds : until this call is to end, s; None: no limit
    case_limit : computing time of a case, s, over all calls; None: no limit
    max_fails : cases without a result after which this call ends; None: no limit
    isolate : whether each case is computed in a process of its own
    save_every : s of a case's computing between states kept of it
    shard : compute this share alone; the last shard to end gathers
    keep_states : whether the last states of undecided cases are kept, see `stages`
    patience : s after a wish to stop in which all ranks have to; then all are ended
    """

    retry: frozenset[str] = frozenset()
    seconds: float | None = None
    case_limit: float | None = None
    max_fails: int | None = None
    isolate: bool = False
    save_every: float = SAVE_EVERY
    keep_states: bool = False
    shard: Shard | None = None
    patience: float = PATIENCE

    @property
    def limit(self) -> float:
        """The computing time of a case, s, without end where none is set."""
        return math.inf if self.case_limit is None else self.case_limit


def retries(words: Iterable[str], what: str = "--retry") -> frozenset[str]:
    """Return the statuses that ``--retry`` names, each a list by commas."""
    found = [part.strip() for word in words for part in word.split(",")]
    for part in found:
        if part not in RETRIES:
            raise unknown(what, part, RETRIES)
    return frozenset(found)


def with_rules(policy: Policy, rules: Mapping[str, Any]) -> Policy:
    """Return the policy with what a campaign's table [campaign] sets.

    Raises
    ------
    InputError
        naming the key, what it got and what is allowed
    """
    options_of(rules)
    own = {key: value for key, value in rules.items() if key in CHECKS}
    for key, value in own.items():
        kind, allowed = CHECKS[key]
        number = not isinstance(value, bool) or kind is bool
        if not number or not isinstance(value, kind) or (kind is not bool and not (
            0 < value < math.inf
        )):  # fmt: skip
            msg = f"[campaign] {key} must be {allowed}, got {shown(value)}"
            raise InputError(msg)
    return replace(policy, **own)


def options_of(rules: Mapping[str, Any]) -> dict[str, Any]:
    """Return {option of `campaign`: its value} that a table [campaign] sets.

    Parameters
    ----------
    rules : the table; what `with_rules` takes is left out

    Raises
    ------
    InputError
        naming the key, what it got and what is allowed
    """
    for key in rules:
        if key == PRESET:
            msg = "unknown key in [campaign] 'preset'; it belongs in [solver]"
            raise InputError(msg)
        if key not in CHECKS and key not in OPTIONS:
            raise unknown("key in [campaign]", key, [*CHECKS, *OPTIONS])
    return {key: OPTIONS[key](f"[campaign] {key}", value)
            for key, value in rules.items() if key in OPTIONS}  # fmt: skip


def _text(what: str, value: Any, allowed: str) -> str:
    if not isinstance(value, str) or not value.strip() or not value.isprintable():
        msg = f"{what} must be {allowed}, got {shown(value)}"
        raise InputError(msg)
    return value


def _folder(what: str, value: Any) -> str:
    return _text(what, value, "the path of a directory")


def _walltime(what: str, value: Any) -> str:
    text = _text(what, value, 'a text such as "01:50:00"')
    parse_walltime(text, what)
    return text


def _retry(what: str, value: Any) -> list[str]:
    listed = value if isinstance(value, list) else [value]
    allowed = f"{', '.join(RETRIES)}, or a list of them"
    found = [_text(what, one, allowed) for one in listed]
    retries(found, what)
    return found


def _way(what: str, value: Any) -> str:
    word = _text(what, value, f"one of {', '.join(WAYS)}")
    if word not in WAYS:
        raise unknown(what, word, WAYS)
    return word


OPTIONS: dict[str, Callable[[str, Any], Any]] = {
    "out": _folder,
    "walltime": _walltime,
    "retry": _retry,
    "report": _way,
}


CHECKS: dict[str, tuple[Any, str]] = {
    "case_limit": (int | float, "a number of seconds > 0"),
    "max_fails": (int, "a whole number > 0"),
    "isolate": (bool, "true or false"),
    "keep_states": (bool, "true or false"),
    "save_every": (int | float, "a number of seconds > 0"),
    "patience": (int | float, "a number of seconds > 0"),
}
