"""What an input of [sample] is drawn from: a law by its parameters."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.errors import InputError, shown, unknown
from hpcwhirl.scene.files import is_number

Floats = NDArray[np.float64]
KEY = "distribution"
LEAST = 2.0**-64  # of a point of the unit cube: at 0 a normal law is infinite


def _uniform(low: float, high: float) -> Any:
    from scipy.stats import uniform

    return uniform(low, high - low)


def _loguniform(low: float, high: float) -> Any:
    from scipy.stats import loguniform

    return loguniform(low, high)


def _normal(mean: float, deviation: float) -> Any:
    from scipy.stats import norm

    return norm(mean, deviation)


def _lognormal(median: float, deviation: float) -> Any:
    from scipy.stats import lognorm

    return lognorm(deviation, scale=median)


def _truncated_normal(mean: float, deviation: float, low: float, high: float) -> Any:
    from scipy.stats import truncnorm

    ends = (low - mean) / deviation, (high - mean) / deviation
    return truncnorm(*ends, mean, deviation)


@dataclass(frozen=True)
class Law:
    """A distribution by name: its parameters in order, and what makes it of them."""

    parameters: tuple[str, ...]
    frozen: Callable[..., Any]
    positive: tuple[str, ...] = ()


LAWS = {
    "uniform": Law(("low", "high"), _uniform),
    "loguniform": Law(("low", "high"), _loguniform, ("low",)),
    "normal": Law(("mean", "deviation"), _normal, ("deviation",)),
    # deviation: of the logarithm
    "lognormal": Law(("median", "deviation"), _lognormal, ("median", "deviation")),
    "truncated_normal": Law(
        ("mean", "deviation", "low", "high"), _truncated_normal, ("deviation",)
    ),
}


def law_of(name: str, given: Any) -> dict[str, Any]:
    """Return the checked law of an input: {distribution, and its parameters}.

    Raises
    ------
    InputError
        where it is none: what, got, allowed
    """
    where = f"[sample] {name}"
    if not isinstance(given, Mapping) or KEY not in given:
        example = f'{{ {KEY} = "normal", mean = 1.0, deviation = 0.1 }}'
        msg = f"{where} must be a table such as {example}, got {shown(given)}"
        raise InputError(msg)
    word = given[KEY]
    if not isinstance(word, str) or word not in LAWS:
        raise unknown(f"{KEY} of {where}", str(word), LAWS)
    law = LAWS[word]
    for key in given:
        if key not in {KEY, *law.parameters}:
            raise unknown(f"key of {where}", key, law.parameters)
    found: dict[str, Any] = {KEY: word}
    for key in law.parameters:
        found[key] = _number(f"{where}: {key}", given.get(key), key in law.positive)
    if "low" in found and not found["low"] < found["high"]:
        msg = f"{where}: high must be > low, got {found['low']} and {found['high']}"
        raise InputError(msg)
    return found


def _number(what: str, value: Any, positive: bool) -> float:  # noqa: FBT001
    if not is_number(value) or not math.isfinite(value) or (positive and not value > 0):
        allowed = "a number > 0" if positive else "a finite number"
        raise InputError(f"{what} must be {allowed}, got {shown(value)}")
    return float(value)


def drawn(law: Mapping[str, Any], unit: Floats) -> Floats:
    """Return draws of a law at points of the unit interval, of the same shape.

    Parameters
    ----------
    law : of `law_of`
    unit : any shape, in [0, 1)
    """
    kind = LAWS[law[KEY]]
    frozen = kind.frozen(*(law[name] for name in kind.parameters))
    return np.asarray(frozen.ppf(np.maximum(unit, LEAST)), dtype=float)
