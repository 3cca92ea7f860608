"""Figures of the probabilities of regimes in a campaign whose inputs were drawn.

A probability is the share of the cases of a point of the sweep; it is drawn as bars for
one point, as areas over one swept input, as a map over two.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from hpcwhirl.errors import InputError
from hpcwhirl.report import palette
from hpcwhirl.report.canvas import FIXED, legend_below, new_figure
from hpcwhirl.report.map.captions import engine_of, shared
from hpcwhirl.report.map.colours import looks_of_attractors
from hpcwhirl.report.map.data import Wish, label_of
from hpcwhirl.scene.words import COUNTED, Look
from hpcwhirl.store.reading.select import variable_of, where
from hpcwhirl.store.reading.shares import interval
from hpcwhirl.store.results.sampled import drawn_of, is_sampled
from hpcwhirl.studies.shares import shares, swept_in

if TYPE_CHECKING:
    import xarray

SHARE = "share_of_cases"  # name as a variable, so that expressions can use it
SHARE_LABEL = SHARE.replace("_", " ")
PANEL = "motion"  # name as an input of the map: regime whose share a panel shows
ASIDE = 0.03  # margin beside the first and the last point / their distance
BARS = 0.55  # width of a bar, relative to the distance between bars


def wants_shares(data: xarray.Dataset, wish: Wish) -> bool:
    """Return whether a map shows shares of regimes instead of single cases.

    It shows shares if inputs were drawn, unless the options name a drawn input, or two
    inputs were drawn and none was swept.

    data, wish : results; options of the map
    """
    if not is_sampled(data) or wish.colour != "regime":
        return False
    named = [wish.x, wish.y, *wish.panels, *(at.partition("=")[0] for at in wish.at)]
    drawn, known = drawn_of(data), list(map(str, data.variables))
    if not drawn.swept and len(drawn.inputs) == 2:
        return False
    asked = {variable_of(name.strip(), known) for name in named if name}
    return not asked & set(drawn.inputs)


def shares_shown(data: xarray.Dataset, wish: Wish) -> xarray.Dataset:
    """Return the shares of regimes at the points of the sweep that a map shows.

    Its options may select some points; the table is that of `studies.shares`.

    data, wish : results of the campaign; options of the map
    """
    found = shares(data)
    inputs = {n: found[n].to_numpy() for n in drawn_of(data).swept}
    chosen = where(wish.at, inputs)
    return found if chosen is None else found.isel(point=np.flatnonzero(chosen))


def varied(found: xarray.Dataset) -> list[str]:
    """Return the swept inputs that have several values in a table of shares.

    found : result of `studies.shares` or `studies.basins`
    """
    return [n for n in swept_in(found) if len(set(found[n].values.tolist())) > 1]


def as_cases(data: xarray.Dataset, found: xarray.Dataset) -> xarray.Dataset:
    """Return shares of regimes in the form of results, so that a map can show them.

    The result has a case for each point of the sweep and regime, and the share as a
    variable. Regimes without cases are left out.

    data, found : results of the campaign; their shares, from `studies.shares`
    """
    seen = found.sel(regime=(found["count"].sum("point") > 0).to_numpy())
    many = seen.sizes["regime"]
    first = data.isel(case=np.searchsorted(drawn_of(data).point, found["point"]))
    names = [*dict.fromkeys([*FIXED, "duration", *varied(found)])]
    out = first[[*names, "status", "outcome", "regime", "whirl"]]
    out = out.drop_vars("case", errors="ignore").isel(
        case=np.repeat(np.arange(found.sizes["point"]), many)
    )
    attrs = data.attrs | {"swept": " ".join([*varied(found), PANEL])}
    words = {n: (("case",), np.full(out.sizes["case"], word, dtype=object))
             for n, word in (("status", "ok"), ("outcome", "completed"),
                             ("regime", "damped"), ("whirl", "none"))}  # fmt: skip
    # drawn inputs become NaN, which differs from NaN, so that titles do not show them
    drawn = {*drawn_of(data).inputs} & {*FIXED, "duration"}
    none = np.full(out.sizes["case"], np.nan)
    out = out.assign({name: ("case", none, out[name].attrs) for name in drawn})
    share = seen["share"].to_numpy().ravel()
    motion = np.tile(seen["regime"].to_numpy().astype(object), found.sizes["point"])
    return out.assign(
        {**words, PANEL: ("case", motion), SHARE: ("case", share, {"units": "1"})}
    ).assign_attrs(attrs)


def figure_of_shares(data: xarray.Dataset, found: xarray.Dataset, note: str) -> Any:
    """Return the figure of shares of motions, over one swept input or of one point.

    Parameters
    ----------
    data : results
    found : the shares, result of `studies.shares` or `studies.basins`
    note : line on the draws, for the title

    Raises
    ------
    InputError
        if the points of the sweep differ in more than one input
    """
    (figure, axes), over = new_figure((8.0, 4.2)), varied(found)
    if len(over) > 1:
        msg = f"shares are drawn over one swept input, not {' and '.join(over)}: add "
        raise InputError(msg + f"--at {over[-1]}=VALUE")
    if over:
        _areas(axes, found, over[0], *label_of(data, over[0]))
    else:
        _bars(axes, found)
    fixed = ", ".join(shared(data, [n for n in (*FIXED, "duration") if n not in over]))
    text = f"{engine_of(data)}: {fixed}\n{note}; intervals: 95 % (Wilson)"
    figure.suptitle(text, fontsize=10, parse_math=False)
    return figure


def draws_note(data: xarray.Dataset, found: xarray.Dataset) -> str:
    """Return a note for a title: drawn inputs, number of draws, cases without result.

    data, found : results; their shares, from `studies.shares`
    """
    low, high = int(found["cases"].min()), int(found["cases"].max())
    cases = f"{low}" if low == high else f"{low} to {high}"
    names = ", ".join(name.replace("_", " ") for name in drawn_of(data).inputs)
    lost = int(found["lost"].sum())
    text = f"drawn: {names}, {cases} times a point"
    return text + (f"; {lost} without a result left out" if lost else "")


def looks_of(found: xarray.Dataset) -> dict[str, Look]:
    """Return how each motion in a table of shares is drawn, {name: its `Look`}.

    The motions are regimes or attractors; a look is colour, marker and letter.
    """
    if "regime" in found.dims:
        return dict(COUNTED)
    return looks_of_attractors(found["attractor"].to_numpy().tolist())


def _areas(
    axes: Any, found: xarray.Dataset, over: str, label: str, factor: float
) -> None:
    """Draw shares of motions over one input as areas, one on top of the other.

    Error bars show the 95 % interval of the sum of shares up to each border.

    found : table of shares
    over, label, factor : the input; label of its axis; factor from SI to the axis' unit
    """
    along, looks = "regime" if "regime" in found.dims else "attractor", looks_of(found)
    found = found.isel(point=np.argsort(found[over].to_numpy()))
    x = factor * found[over].to_numpy()
    cases, below = found["cases"].to_numpy(), np.zeros(found.sizes["point"], int)
    for word, look in looks.items():
        count = found["count"].sel({along: word}).to_numpy()
        if not count.sum():
            continue
        pairs = zip((below + count).tolist(), cases.tolist(), strict=True)
        ends = np.array([interval(*pair) for pair in pairs])
        base = below / np.maximum(cases, 1)
        axes.fill_between(x, base, ends[:, 0], color=look.colour, lw=0,
                          label=look.told, gid=f"share {word}")  # fmt: skip
        below = below + count
        told = (count > 0) & (below < cases)
        away = np.abs(ends[told, 1:] - ends[told, :1]).T
        axes.errorbar(x[told], ends[told, 0], away, fmt="none", ecolor=palette.INK,
                      elinewidth=0.8, capsize=1.5, gid=f"interval {word}")  # fmt: skip
    axes.set_xlabel(label, parse_math=False)
    room = ASIDE * (x[-1] - x[0])  # the intervals at both ends stand off the frame
    axes.set(ylabel=SHARE_LABEL, ylim=(0.0, 1.0), xlim=(x[0] - room, x[-1] + room))
    legend_below(axes.figure, axes)


def _bars(axes: Any, found: xarray.Dataset) -> None:
    one, looks = found.isel(point=0), list(looks_of(found).values())
    share = np.nan_to_num(one["share"].to_numpy())
    ends = one["share_low"].to_numpy(), one["share_high"].to_numpy()
    away = np.abs(np.stack([share - ends[0], ends[1] - share]))
    axes.barh([look.told for look in looks], share, BARS, xerr=away, capsize=3,
              color=[look.colour for look in looks], ecolor=palette.INK)  # fmt: skip
    axes.invert_yaxis()
    axes.set(xlabel=SHARE_LABEL, xlim=(0.0, 1.02))


def shares_table(found: xarray.Dataset) -> Iterator[list[Any]]:
    """Yield header and rows of a table of shares, a row for each point and regime."""
    swept = [str(n) for n, c in found.coords.items() if c.dims == ("point",)]
    numbers = ["count", "share", "share_low", "share_high"]
    names = [*swept, "cases", "lost", "regime", *numbers]
    table = found.to_dataframe(dim_order=["point", "regime"]).reset_index()
    yield names
    yield from table[names].to_numpy(dtype=object).tolist()
