"""The keyword options of `hpcwhirl.campaign`, for type checkers and editors."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal, TypedDict


class Options(TypedDict, total=False):
    """Options of `hpcwhirl.campaign`: `ranks`, and those of `hpcwhirl campaign`."""

    ranks: int | None
    retry: str | Iterable[str]
    walltime: str | None
    patience: float
    case_limit: float | None
    max_fails: int | None
    save_every: float
    keep_states: bool
    isolate: bool
    same: Literal["told", "strict"]
    fresh: bool
    take_over: bool
