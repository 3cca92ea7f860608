"""Sobol' indices: which drawn input makes a quantity vary, alone and with others.

Of independent draws A, B, and of A_i, which is A with input i of B (Saltelli et al.,
Computer Physics Communications 181, 2010, doi:10.1016/j.cpc.2009.09.018, Table 2):

    S_i = mean(f(B) (f(A_i) - f(A))) / V,   T_i = mean((f(A) - f(A_i))^2) / (2 V)

with V the variance of f(A) and f(B), f less its mean. A list, such as mistuning, is one
input. `scipy.stats.sobol_indices` gives the same numbers, but takes powers of 2 alone,
and a draw without a result has to be left out here.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.errors import InputError, nearest
from hpcwhirl.scene.words import REGIMES
from hpcwhirl.store.reading.reader import words
from hpcwhirl.store.reading.shares import CONFIDENCE
from hpcwhirl.store.results.sampled import SALTELLI, Drawn, drawn_of, points_of

if TYPE_CHECKING:
    import xarray

USUAL = ("growth_rate", "orbit_radius", "divergent")
RESAMPLES = 999
SEED = 0  # of the bootstrap: the same intervals every time
STILL = 0.01  # share of resamples in which nothing may vary
FEWEST = 8  # draws that an index is told from
Floats = NDArray[np.float64]


def indices(a: Floats, b: Floats, mixed: Floats) -> Floats:
    """Return Sobol' indices, (2, d): of first order, total; NaN where nothing varies.

    Parameters
    ----------
    a, b : (n,), of the draws A and B
    mixed : (d, n), of A with an input of B
    """
    both = np.concatenate([a, b])
    if np.ptp(both) == 0.0:
        return np.full((2, len(mixed)), np.nan)
    mean, variance = both.mean(), both.var()
    a, b, mixed = a - mean, b - mean, mixed - mean
    first = (b * (mixed - a)).mean(axis=1)
    total = 0.5 * ((a - mixed) ** 2).mean(axis=1)
    return np.asarray(np.stack([first, total]) / variance)


def intervals(a: Floats, b: Floats, mixed: Floats) -> Floats:
    """Return the ends of the indices' intervals, (2 ends, 2, d), by bootstrap.

    Percentiles over draws taken with replacement; NaN where of more than `STILL` of
    these none varies, as of a word that hardly a case has.
    """
    chosen = np.random.default_rng(SEED).integers(len(a), size=(RESAMPLES, len(a)))
    found = np.array([indices(a[i], b[i], mixed[:, i]) for i in chosen])
    if np.isnan(found).any(axis=(1, 2)).mean() > STILL:
        return np.full((2, 2, len(mixed)), np.nan)
    tail = (1.0 - CONFIDENCE) / 2
    return np.asarray(np.nanquantile(found, [tail, 1.0 - tail], axis=0))


def values_of(data: xarray.Dataset, name: str) -> Floats:
    """Return a number of each case, or 1 where it has a regime and 0 where another.

    NaN where the case has no regime, as failed and unstable ones: their numbers mean
    nothing.

    Raises
    ------
    InputError
        where there is no such number
    """
    word = words(data["regime"])
    good = np.isin(word, list(REGIMES))
    if name in REGIMES:
        return np.where(good, (word == name).astype(float), np.nan)
    known = [
        str(n) for n, v in data.variables.items()
        if v.dims == ("case",) and v.dtype.kind in "iuf" and n != "case"
    ]  # fmt: skip
    if name not in known:
        hint = nearest(name, [*known, *REGIMES]) or "; hpcwhirl cases --columns '?'"
        msg = f"unknown number '{name}'{hint}"
        raise InputError(msg)
    return np.where(good, data[name].to_numpy().astype(float), np.nan)


def sensitivity(data: xarray.Dataset, names: Iterable[str] = USUAL) -> xarray.Dataset:
    """Return the Sobol' indices of quantities, at each point of the sweep.

    A pair of draws one of whose cases gave no finite number is left out and counted in
    `dropped`: the indices are then those of the others.

    Parameters
    ----------
    data : of `open_results`, of a campaign whose [sample] has method = "saltelli"
    names : numbers of the results, or regimes, whose probability is meant

    Returns
    -------
    xarray.Dataset over `point` (with the swept inputs), `quantity` and `input`:
    `first`, `total` and their ends `first_low`, `first_high`, `total_low`,
    `total_high` (95 %, bootstrap); without `input`: `draws`, the pairs used, `dropped`,
    `mean` and `deviation`. NaN where a quantity does not vary, or fewer than 8 pairs
    are left

    Raises
    ------
    InputError
        where the campaign's draws do not allow it
    """
    import xarray

    drawn, wanted = drawn_of(data), list(dict.fromkeys(names))
    _check_method(drawn)
    points, swept = points_of(data, drawn)
    numbers = {name: values_of(data, name) for name in wanted}
    rows = [[_told(numbers[name], drawn, point) for name in wanted] for point in points]
    names_of = ("point", "quantity")
    out: dict[str, Any] = {}
    for key in rows[0][0]:
        values = np.array([[one[key] for one in row] for row in rows])
        out[key] = ((*names_of, "input")[: values.ndim], values)
    coords = {"point": points, "quantity": wanted, "input": list(drawn.inputs)}
    return xarray.Dataset(out, coords | swept)


def _check_method(drawn: Drawn) -> None:
    if drawn.method != SALTELLI:
        msg = 'Sobol indices need [sample] method = "saltelli", got '
        msg += f'"{drawn.method}", whose draws tell shares of regimes alone: hpcwhirl '
        raise InputError(msg + "map")


def _told(values: Floats, drawn: Drawn, point: int) -> dict[str, Any]:
    """Return indices, their intervals and what they rest on, of one quantity."""
    width = len(drawn.inputs) + 2
    here = drawn.point == point
    table = np.full((drawn.each // width, width), np.nan)
    table[drawn.draw[here] // width, drawn.block[here]] = values[here]
    whole = np.isfinite(table).all(axis=1)
    a, b, *mixed = table[whole].T
    found, ends = np.full((2, width - 2), np.nan), np.full((2, 2, width - 2), np.nan)
    if whole.sum() >= FEWEST:
        found = indices(a, b, np.array(mixed))
        ends = intervals(a, b, np.array(mixed))
    both = np.concatenate([a, b])
    return {
        "first": found[0], "first_low": ends[0, 0], "first_high": ends[1, 0],
        "total": found[1], "total_low": ends[0, 1], "total_high": ends[1, 1],
        "draws": int(whole.sum()), "dropped": int((~whole).sum()),
        "mean": both.mean() if len(both) else np.nan,
        "deviation": both.std() if len(both) else np.nan,
    }  # fmt: skip
