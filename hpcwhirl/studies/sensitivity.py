"""Sobol' indices: which drawn input makes a quantity vary, alone and with others.

They are computed from independent draws A, B, and from A_i, a copy of A with input i
taken from B (Saltelli et al., Computer Physics Communications 181, 2010,
doi:10.1016/j.cpc.2009.09.018, Table 2):

    S_i = mean(f(B) (f(A_i) - f(A))) / V,   T_i = mean((f(A) - f(A_i))^2) / (2 V)

with V the variance of f(A) and f(B) together, and f less its mean. A list, such as
mistuning, is one input. `scipy.stats.sobol_indices` gives the same numbers, but needs a
power of 2 of draws, whereas here draws without a result must be left out.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from hpcwhirl.arrays import Floats
from hpcwhirl.errors import InputError, nearest
from hpcwhirl.scene.campaign_tables import SALTELLI
from hpcwhirl.scene.words import COUNTED, REGIMES
from hpcwhirl.store.reading.select import numbers_in
from hpcwhirl.store.reading.shares import CONFIDENCE, interval
from hpcwhirl.store.results.sampled import Drawn, drawn_of, points_of
from hpcwhirl.studies.shares import ends_of

if TYPE_CHECKING:
    import xarray

ORDERS = ("first", "total")
USUAL = ("growth_rate", "orbit_radius", "divergent")  # quantities by default
RESAMPLES = 999  # number of resamples of the bootstrap
SEED = 0  # seed of the bootstrap, fixed so that intervals are reproducible
STILL = 0.01  # largest share of resamples in which the quantity may be constant
WIDE = 0.5  # width of an index's interval above which the index counts as unknown
FEWEST = 8  # least number of pairs of draws for indices


def indices(a: Floats, b: Floats, mixed: Floats) -> Floats:
    """Return a quantity's Sobol' indices for d inputs, first-order and total, (2, d).

    NaN if the quantity does not vary.

    Parameters
    ----------
    a, b : (n,), values of a quantity for the draws A and B
    mixed : (d, n), values for A_i, a copy of A with input i taken from B
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
    """Return confidence intervals of Sobol' indices by bootstrap, (2 ends, 2, d).

    Parameters and indices are those of `indices`. The ends are percentiles of the
    indices of resamples, draws taken with replacement; NaN if the quantity is constant
    in more than a share `STILL` of them, as for a regime that hardly any case has. Ends
    of a quantity with two values are at least as far apart as those of `_of_changes`.
    """
    chosen = np.random.default_rng(SEED).integers(len(a), size=(RESAMPLES, len(a)))
    resampled = np.array([indices(a[i], b[i], mixed[:, i]) for i in chosen])
    if np.isnan(resampled).any(axis=(1, 2)).mean() > STILL:
        return np.full((2, 2, len(mixed)), np.nan)
    tail = (1.0 - CONFIDENCE) / 2
    ends = np.nanquantile(resampled, [tail, 1.0 - tail], axis=0)
    if len(np.unique(np.concatenate([a, b]))) == 2:
        low, high = _of_changes(a, b, mixed)
        ends = [np.minimum(ends[0], low), np.maximum(ends[1], high)]
    return np.asarray(ends)


def _of_changes(a: Floats, b: Floats, mixed: Floats) -> Floats:
    """Return intervals of a regime's Sobol' indices from its changes, (2 ends, 2, d).

    The regime of A and of A_i differs in c of n pairs, and T_i is the share c / n over
    2 V, in units of the squared difference of the two values. Wilson's interval of that
    share also counts changes that no pair has shown, which resamples of the pairs never
    have: inputs that change few words would have index 0 without doubt. S_i follows
    from the same changes, and is as uncertain.

    Parameters are those of `indices`, of a quantity with two values.
    """
    both = np.concatenate([a, b])
    scale = np.ptp(both) ** 2 / (2.0 * both.var())
    changed = (a != mixed).sum(axis=1).tolist()
    share, low, high = scale * np.array([interval(c, len(a)) for c in changed]).T
    first = indices(a, b, mixed)[0]
    return np.array([[first - (high - share), low], [first + (high - share), high]])


def values_of(data: xarray.Dataset, name: str) -> Floats:
    """Return a quantity of each case, (cases,), by the name of a variable or a word.

    For a word such as "divergent" or "overloaded", the quantity is 1 in cases that have
    this word, else 0, and NaN for cases without a result (failed, unstable). A variable
    is NaN also for overloaded cases, whose numbers are those of the load.

    Raises
    ------
    InputError
        if the results have no numeric variable of this name
    """
    word = ends_of(data)
    if name in COUNTED:
        ended = np.isin(word, list(COUNTED))
        return np.where(ended, (word == name).astype(float), np.nan)
    good = np.isin(word, list(REGIMES))
    numeric = numbers_in(data)
    if name not in numeric:
        hint = nearest(name, [*numeric, *COUNTED]) or "; hpcwhirl cases --columns '?'"
        raise InputError(f"unknown quantity '{name}'{hint}")
    return np.where(good, data[name].to_numpy().astype(float), np.nan)


def sensitivity(data: xarray.Dataset, names: Iterable[str] = USUAL) -> xarray.Dataset:
    """Return the Sobol' indices of quantities, at each point of the sweep.

    A pair is a draw of A, the one of B with the same number, and their mixtures A_i. It
    is left out, and counted in `dropped`, if any of its cases has no finite value.

    Parameters
    ----------
    data : results of `open_results` whose [sample] has method = "saltelli"
    names : numeric variables of the results, or regimes, which count as 1 or 0 in each
        case

    Returns
    -------
    xarray.Dataset over `point` (with the swept inputs), `quantity` and `input`:
    `first`, `total` and their ends `first_low`, `first_high`, `total_low`,
    `total_high` (95 %, see `intervals`); without `input`: `draws` (number of pairs
    used), `dropped`, `mean` and `deviation`. NaN if a quantity does not vary, or fewer
    than 8 pairs are left

    Raises
    ------
    InputError
        if inputs were not drawn by method "saltelli", or a name is unknown
    """
    import xarray

    drawn, wanted = drawn_of(data), list(dict.fromkeys(names))
    if drawn.method != SALTELLI:
        msg = 'Sobol indices need [sample] method = "saltelli", got '
        msg += f'"{drawn.method}", whose draws give only probabilities of regimes '
        raise InputError(msg + "(hpcwhirl map)")
    points, swept = points_of(data, drawn)
    numbers = {name: values_of(data, name) for name in wanted}
    rows = [[_indices_at(numbers[n], drawn, point) for n in wanted] for point in points]
    names_of = ("point", "quantity")
    out: dict[str, Any] = {}
    for key in rows[0][0]:
        values = np.array([[one[key] for one in row] for row in rows])
        out[key] = ((*names_of, "input")[: values.ndim], values)
    coords = {"point": points, "quantity": wanted, "input": list(drawn.inputs)}
    return xarray.Dataset(out, coords | swept)


def widest(one: xarray.Dataset) -> float:
    """Return the width of the widest confidence interval of a quantity's indices.

    NaN without any interval.

    Parameters
    ----------
    one : result of `sensitivity` for one quantity
    """
    widths = [(one[f"{n}_high"] - one[f"{n}_low"]).to_numpy() for n in ORDERS]
    known = np.concatenate([w[np.isfinite(w)] for w in widths])
    return float(known.max()) if len(known) else np.nan


def pairs_needed(one: xarray.Dataset) -> int:
    """Return how many pairs of draws would make a quantity's Sobol' indices known.

    Return 0 if the present ones suffice: no interval is wider than `WIDE`. The number
    is a power of 2, as [sample] requires, estimated from the present intervals, which
    shrink with the square root of the number of pairs.

    Parameters
    ----------
    one : result of `sensitivity` for one quantity
    """
    width = widest(one)
    if not width > WIDE:
        return 0
    pairs = int(one["draws"].max()) * (width / WIDE) ** 2
    return int(2 ** np.ceil(np.log2(pairs)))


def _indices_at(values: Floats, drawn: Drawn, point: int) -> dict[str, Any]:
    """Return the Sobol' indices of one quantity at one point of the sweep.

    Returns {name of a variable in the result of `sensitivity`: its value, or one per
    input}

    values : (cases,), the quantity of each case
    drawn : draws of the campaign: which draw and which of A, B, A_i each case is
    point : number of the point of the sweep
    """
    width = len(drawn.inputs) + 2
    here = drawn.point == point
    table = np.full((drawn.each // width, width), np.nan)
    table[drawn.draw[here] // width, drawn.block[here]] = values[here]
    whole = np.isfinite(table).all(axis=1)
    a, b, *mixed = table[whole].T
    estimates, *ends = np.full((3, 2, width - 2), np.nan)
    if whole.sum() >= FEWEST:
        estimates = indices(a, b, np.array(mixed))
        ends = [*intervals(a, b, np.array(mixed))]
    both = np.concatenate([a, b])
    return {
        "first": estimates[0], "first_low": ends[0][0], "first_high": ends[1][0],
        "total": estimates[1], "total_low": ends[0][1], "total_high": ends[1][1],
        "draws": int(whole.sum()), "dropped": int((~whole).sum()),
        "mean": both.mean() if len(both) else np.nan,
        "deviation": both.std() if len(both) else np.nan,
    }  # fmt: skip
