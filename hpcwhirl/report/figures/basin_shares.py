"""Figures of basins: attractors of all starts, shares of attractors over an input."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hpcwhirl.analysis.basins import Starts, basins, starts_of, with_attractors
from hpcwhirl.errors import InputError
from hpcwhirl.report.map.data import Wish, picture_of
from hpcwhirl.report.map.layout import figure_of
from hpcwhirl.report.map.probabilities import figure_of_shares, varied
from hpcwhirl.report.saving import save
from hpcwhirl.store.reading.reader import open_results
from hpcwhirl.store.reading.results_file import Results

if TYPE_CHECKING:
    import xarray

PANELS = 6  # largest number of panels: points of the sweep with the largest entropy


def draw_fractions(
    data: xarray.Dataset, found: xarray.Dataset, out: Path
) -> list[Path]:
    """Draw the share of starts that reach each attractor: basins.png, basins.svg.

    Parameters
    ----------
    data : results
    found : result of `analysis.basins`
    out : directory of the figures

    Raises
    ------
    InputError
        if the points of the sweep differ in more than one input
    """
    starts = ", ".join(found.attrs["starts"].split()).replace("_", " ")
    how = "drawn" if found.attrs["drawn"] else "on a grid"
    note = f"starts: {starts}, {how}, {int(found['cases'].max())} a point"
    figure = figure_of_shares(data, found, note)
    return [save(figure, out / f"basins.{kind}") for kind in ("png", "svg")]


def draw_basins(results: Results, cases: list[int]) -> Any:
    """Return the figure of all starts, coloured by the attractor that each one reaches.

    If two inputs differ between starts, these are the axes, and each point of the sweep
    has a panel, at most the six points with the largest entropy. If one input differs,
    the axes are the first swept input and this one.

    Parameters
    ----------
    results : results of a campaign
    cases : numbers of the cases to show
    """
    with open_results(results.path) as whole:
        data = with_attractors(whole).isel(case=cases)
        starts = starts_of(data)
        names = [n for n in starts.inputs if len(set(data[n].to_numpy().tolist())) > 1]
        if len(names) > 2:
            others = " and ".join(names[2:])
            msg = f"starts differ in {', '.join(names)}: choose a value of {others}"
            raise InputError(f"{msg}, as --at {names[2]}=VALUE")
        if len(names) == 2:
            data = _most_mixed(data, starts)
            wish = Wish(names[0], names[1], colour="attractor")
        else:
            over = [
                n for n in starts.swept if len(set(data[n].to_numpy().tolist())) > 1
            ]
            axes = [*over[:1], *names, None]
            wish = Wish(axes[0], axes[1], colour="attractor")
        return figure_of(data, picture_of(data, wish), wish, results.path)


def _most_mixed(data: xarray.Dataset, starts: Starts) -> xarray.Dataset:
    """Return the cases of the points of the sweep with the largest basin entropy."""
    found = basins(data)
    if found.sizes["point"] <= PANELS or not varied(found):
        return data
    order = np.argsort(-found["entropy"].fillna(-1.0).to_numpy(), kind="stable")
    kept = found["point"].to_numpy()[np.sort(order[:PANELS])]
    return data.isel(case=np.flatnonzero(np.isin(starts.point, kept)))
