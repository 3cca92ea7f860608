"""Figures of motions that coexist: branches, the edge between two words, basins."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.lines import Line2D

from hpcwhirl.errors import InputError
from hpcwhirl.report import palette
from hpcwhirl.report.canvas import axis_of, in_defaults, new_figure, save, value_of
from hpcwhirl.report.figures.motions import DARK, draw_orbit, unit_of
from hpcwhirl.report.map.data import Wish, picture_of
from hpcwhirl.report.map.layout import figure_of
from hpcwhirl.report.map.probabilities import figure_of_shares, varied
from hpcwhirl.scene.quantities import variable_name
from hpcwhirl.scene.words import REGIMES, SHOWN
from hpcwhirl.store.reading.reader import open_results
from hpcwhirl.store.reading.results_file import Results
from hpcwhirl.studies.basins import Starts, basins, starts_of, with_attractors
from hpcwhirl.studies.branches import Branch, branches_of, changes_of

if TYPE_CHECKING:
    import xarray

    from hpcwhirl.scene import Scene
    from hpcwhirl.studies.edge import Edge

LOOKS = {"up": (">", "-"), "down": ("<", "--")}  # marker and line of a direction
AT_REST = 1e-9  # mm, orbit radius drawn for a centre at rest
SETTLED = 0.5  # share of the edge's motion, at its end, whose orbit is drawn
ROOM = 3.0  # end of the axis of radii / largest radius of the motion on the edge
PANELS = 6  # largest number of panels: points of the sweep with the largest entropy


def draw_branches(results: Results, line: list[int]) -> Any:
    """Return a figure of branches: words of their cases above, orbit radius below.

    Both are drawn over the input that varies along the branches.

    line : numbers of the finished cases of all branches that share the other inputs
    """
    over, branches = branches_of(results, line)
    heights = [0.25 + 0.18 * len(branches), 2.0]
    figure, (upper, lower) = new_figure((10, 6), 2, sharex=True, height_ratios=heights)
    for row, branch in enumerate(branches):
        _strip(upper, row, branch)
        _radii(lower, branch)
    upper.set_yticks(range(len(branches)), [branch.name for branch in branches])
    upper.set_ylim(len(branches) - 0.5, -0.5)
    fixed = branches[0].others.items()
    others = ", ".join(value_of(variable_name(n), v) for n, v in fixed)
    upper.set_title(f"Branches{': ' if others else ''}{others}")
    lower.axhline(
        1e3 * float(results["gap_scale"][line[0]]), c=palette.INK, ls=":", lw=0.8
    )
    lower.set(yscale="log", ylabel="orbit radius, mm (dotted: gap)")
    lower.set_xlabel(axis_of(variable_name(over)))
    figure.legend(*_legend(branches), loc="outside right upper")
    return figure


def _strip(axes: Any, row: int, branch: Branch) -> None:
    """Draw a mark for each case of a branch in the colour of its word, in one row.

    A vertical line marks each change between words that a longer run would keep.

    axes, row : panel of words over the varied input; y of the marks
    """
    marker, _ = _look(branch)
    for value, word in zip(branch.values, branch.words, strict=True):
        shown = SHOWN[word]
        axes.plot(value, row, marker, mfc=shown.colour, mec=shown.stroke, ms=7)
    for one in changes_of(branch):
        if one.kind == "fold":
            axes.plot((one.last + one.first) / 2, row, "|", c=palette.INK, ms=14)


def _radii(axes: Any, branch: Branch) -> None:
    marker, style = _look(branch)
    radii = np.maximum(1e3 * np.nan_to_num(branch.radii), AT_REST)
    axes.plot(branch.values, radii, style, c=palette.EDGE, lw=1, zorder=1)
    for value, radius, word in zip(branch.values, radii, branch.words, strict=True):
        shown = SHOWN[word]
        axes.plot(value, radius, marker, mfc=shown.colour, mec=shown.stroke, ms=5)


def _look(branch: Branch) -> tuple[str, str]:
    return LOOKS[branch.name.split()[0]]


def _legend(branches: list[Branch]) -> tuple[list[Any], list[str]]:
    """Return handles and labels of a legend of branches.

    It explains words, directions and the mark of a change of word.
    """
    words = dict.fromkeys(word for branch in branches for word in branch.words)
    marks = {word: ("o", SHOWN[word].colour) for word in words}
    marks |= {name: (look[0], "none") for name, look in LOOKS.items()}
    marks["word changes"] = ("|", palette.INK)
    handles = [
        Line2D([], [], marker=marker, ls="", mfc=colour, mec=palette.INK)
        for marker, colour in marks.values()
    ]
    return handles, list(marks)


@in_defaults
def draw_edge(scene: Scene, found: Edge, path: Path) -> Path:
    """Draw the unstable motion on the edge between two words; return `path`.

    scene, found, path : scene of the motion; result of `hpcwhirl.edge`; file to write
    """
    return save(edge_figure(scene, found), path)


def edge_figure(scene: Scene, found: Edge) -> Any:
    """Return the figure of the unstable motion on the edge between two words.

    It shows its orbit radius over time, with those of the two motions that leave the
    edge, and its orbit in the static frame.

    scene, found : scene of the motion; result of `hpcwhirl.edge`
    """
    figure, (axes, plane) = new_figure((11, 4.8), 1, 2, width_ratios=[1.4, 1.0])
    radius = np.hypot(*found.centre.T)
    most = ROOM * float(radius.max(initial=0.0))
    factor, unit = unit_of(most)
    for name, side in (("low", found.low), ("high", found.high)):
        look = REGIMES[side.word] if side.word in REGIMES else REGIMES["undecided"]
        axes.plot(side.time, factor * side.radius, c=look.stroke, lw=0.7, gid=name,
                  label=f"leaves the edge: {look.told}")  # fmt: skip
    axes.plot(found.time, factor * radius, c=DARK, lw=0.9, label="edge", gid="edge")
    axes.axhline(factor * scene.gap, color=palette.INK, ls="--", lw=0.8, label="gap")
    for start in found.time[1:][np.diff(found.pieces) != 0]:
        axes.axvline(start, ymax=0.02, color=palette.INK, lw=0.5)
    axes.set(xlabel=axis_of("time"), ylim=(0.0, factor * most))
    axes.set_ylabel(f"distance of the centre from its rest, {unit}")
    axes.legend(fontsize=8, loc="upper left")
    late = np.arange(len(radius)) >= (1.0 - SETTLED) * len(radius)
    draw_orbit(plane, found.centre, late, scene.gap, transient=False)
    told = plane.get_label()
    plane.set(xlabel=f"$X_o$, {told} (static frame)", ylabel=f"$Y_o$, {told}")
    names = ("speed", "nodal_diameter", "gap", "friction")
    at = ", ".join(value_of(name, getattr(scene, name)) for name in names)
    text = f"{scene.engine.name}: {at}\nedge between {found.low.word} and "
    figure.suptitle(text + found.high.word, fontsize=10, parse_math=False)
    return figure


@in_defaults
def draw_fractions(
    data: xarray.Dataset, found: xarray.Dataset, out: Path
) -> list[Path]:
    """Draw the share of starts that end on each motion: basins.png, basins.svg.

    Returns the paths of both files

    Parameters
    ----------
    data : results from `open_results`
    found : result of `studies.basins`
    out : directory of the figures

    Raises
    ------
    InputError
        if the points of the sweep differ in more than one input
    """
    starts = ", ".join(found.attrs["starts"].split()).replace("_", " ")
    how = "drawn" if found.attrs["drawn"] else "on a grid"
    note = f"starts: {starts}, {how}, {int(found['cases'].max())} a point"
    if lost := int(found["lost"].sum()):
        note += f"; {lost} without a result left out"
    figure = figure_of_shares(data, found, note)
    return [save(figure, out / f"basins.{kind}") for kind in ("png", "svg")]


def draw_basins(results: Results, cases: list[int]) -> Any:
    """Return a map of all starts, each coloured by the attractor on which it ends.

    If two inputs differ between starts, these are the axes, and each point of the sweep
    has a panel, at most the six points with the largest entropy. If one input differs,
    the axes are the first swept input and this input.

    Parameters
    ----------
    results : results of a campaign
    cases : numbers of the cases to show
    """
    with open_results(results.path) as whole:
        data = with_attractors(whole).isel(case=cases)
        starts = starts_of(data)
        over, names = (
            [n for n in of if len(set(data[n].to_numpy().tolist())) > 1]
            for of in (starts.swept, starts.inputs)
        )
        if len(names) > 2:
            others = " and ".join(names[2:])
            msg = f"starts differ in {', '.join(names)}: choose a value of {others}"
            raise InputError(f"{msg}, as --at {names[2]}=VALUE")
        if len(names) == 2:
            data, over = _most_mixed(data, starts), []
        axes = [*over[:1], *names, None]
        wish = Wish(axes[0], axes[1], colour="attractor")
        return figure_of(data, picture_of(data, wish), wish, results.path)


def _most_mixed(data: xarray.Dataset, starts: Starts) -> xarray.Dataset:
    """Return results of only those points of a sweep whose starts end most differently.

    They are the `PANELS` points of largest entropy.
    """
    found = basins(data)
    if found.sizes["point"] <= PANELS or not varied(found):
        return data
    order = np.argsort(-found["entropy"].fillna(-1.0).to_numpy(), kind="stable")
    kept = found["point"].to_numpy()[np.sort(order[:PANELS])]
    return data.isel(case=np.flatnonzero(np.isin(starts.point, kept)))
