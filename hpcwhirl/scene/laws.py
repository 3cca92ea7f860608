"""Probability distributions from which the inputs of [sample] are drawn."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, ClassVar

from hpcwhirl.errors import InputError, shown, unknown
from hpcwhirl.scene.input_names import value_in_si
from hpcwhirl.scene.table_model import TableModel, key, key_of

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

KEY = "distribution"
LEAST = 2.0**-64  # least probability used: the quantile of a normal law at 0 is -inf


class Law(TableModel):
    """A distribution in [sample], from which an input is drawn, with its parameters."""

    RELATIVE: ClassVar[tuple[str, ...]] = ()  # parameters without the input's unit
    distribution: str

    def frozen(self, stats: Any) -> Any:
        """Return SciPy's distribution with these parameters; stats : `scipy.stats`."""
        raise NotImplementedError


class _Uniform(Law):
    low: float = key(...)
    high: float = key(...)

    def frozen(self, stats: Any) -> Any:
        return stats.uniform(self.low, self.high - self.low)


class _Loguniform(Law):
    low: float = key(..., gt=0)
    high: float = key(...)

    def frozen(self, stats: Any) -> Any:
        return stats.loguniform(self.low, self.high)


class _Normal(Law):
    mean: float = key(...)
    deviation: float = key(..., gt=0)

    def frozen(self, stats: Any) -> Any:
        return stats.norm(self.mean, self.deviation)


class _Lognormal(Law):
    RELATIVE: ClassVar[tuple[str, ...]] = ("deviation",)
    median: float = key(..., gt=0)
    deviation: float = key(..., "of the logarithm", gt=0)

    def frozen(self, stats: Any) -> Any:
        return stats.lognorm(self.deviation, scale=self.median)


class _TruncatedNormal(Law):
    mean: float = key(...)
    deviation: float = key(..., gt=0)
    low: float = key(...)
    high: float = key(...)

    def frozen(self, stats: Any) -> Any:
        ends = ((end - self.mean) / self.deviation for end in (self.low, self.high))
        return stats.truncnorm(*ends, self.mean, self.deviation)


LAWS: dict[str, type[Law]] = {
    "uniform": _Uniform,
    "loguniform": _Loguniform,
    "normal": _Normal,
    "lognormal": _Lognormal,
    "truncated_normal": _TruncatedNormal,
}


def law_of(name: str, given: Any) -> Law:
    """Return the distribution that [sample] gives for an input, validated, in SI.

    Parameters
    ----------
    name : full dotted name of the input
    given : parsed table with the key `distribution` and parameters such as `mean`

    Raises
    ------
    InputError
        for an unknown distribution or wrong parameters
    """
    where = f"[sample] {name}"
    if not isinstance(given, Mapping) or KEY not in given:
        example = f'{{ {KEY} = "normal", mean = 1.0, deviation = 0.1 }}'
        msg = f"{where} must be a table such as {example}, got {shown(given)}"
        raise InputError(msg)
    word = given[KEY]
    if not isinstance(word, str) or word not in LAWS:
        raise unknown(f"{KEY} of {where}", str(word), LAWS)
    plain = {KEY, *LAWS[word].RELATIVE}
    values = {k: v if k in plain else value_in_si(name, v) for k, v in given.items()}
    law = LAWS[word].read(values, where, lambda key: f"{where}: {key}")
    ends = getattr(law, "low", 0.0), getattr(law, "high", 1.0)
    if not ends[0] < ends[1]:
        raise InputError(f"{where}: high must be > low, got {ends[0]} and {ends[1]}")
    return law


def parameters() -> str:
    """Return a text that lists the distributions and their parameters for users."""
    found = []
    for word, law in LAWS.items():
        pairs = (
            (n, key_of(f).meaning) for n, f in law.model_fields.items() if n != KEY
        )
        told = ", ".join(f"{name} {meaning}".strip() for name, meaning in pairs)
        found.append(f"{word} ({told})")
    return "; ".join(found)


def drawn(law: Law, unit: Floats) -> Floats:
    """Return values of an input from random numbers: quantiles of its distribution.

    The result has the shape of `unit` and the input's SI unit.

    Parameters
    ----------
    law : distribution of the input, see `law_of`
    unit : array of random numbers in [0, 1), the probabilities, of any shape
    """
    import numpy as np  # not needed to list the tables
    from scipy import stats

    return np.asarray(law.frozen(stats).ppf(np.maximum(unit, LEAST)), dtype=float)
