"""The figure of branches: words and orbit radius over an input swept up and down."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from hpcwhirl.analysis.branches import Branch, branches_of, folds_of
from hpcwhirl.report.labels import axis_of
from hpcwhirl.scene.quantities import variable_name
from hpcwhirl.scene.words import SHOWN
from hpcwhirl.store.reading.results_file import Results

LOOKS = {"up": (">", "-"), "down": ("<", "--")}  # marker and line of a direction
AT_REST = 1e-9  # mm, orbit radius drawn for a centre at rest


def draw_branches(results: Results, line: list[int]) -> Any:
    """Return a figure: words of each branch above, orbit radius below.

    line : finished cases of one bundle of branches, see `analysis.branches.bundles_of`
    """
    over, branches = branches_of(results, line)
    figure = Figure(figsize=(10, 6), layout="constrained")
    heights = [0.25 + 0.18 * len(branches), 2.0]
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=heights)
    for row, branch in enumerate(branches):
        _strip(upper, row, branch)
        _radii(lower, branch)
    upper.set_yticks(range(len(branches)), [branch.name for branch in branches])
    upper.set_ylim(len(branches) - 0.5, -0.5)
    others = ", ".join(f"{n} = {v}" for n, v in branches[0].others.items())
    upper.set_title(f"Branches{': ' if others else ''}{others}")
    lower.axhline(1e3 * float(results["gap_scale"][line[0]]), c="k", ls=":", lw=0.8)
    lower.set(yscale="log", ylabel="orbit radius, mm (dotted: gap)")
    lower.set_xlabel(axis_of(variable_name(over)))
    figure.legend(*_legend(branches), loc="outside right upper")
    return figure


def _strip(axes: Any, row: int, branch: Branch) -> None:
    """Draw the words of a branch as a row of marks, and where they change."""
    marker, _ = _look(branch)
    for value, word in zip(branch.values, branch.words, strict=True):
        shown = SHOWN[word]
        axes.plot(value, row, marker, mfc=shown.colour, mec=shown.stroke, ms=7)
    for fold in folds_of(branch):
        axes.plot((fold.last + fold.first) / 2, row, "|", c="k", ms=14)


def _radii(axes: Any, branch: Branch) -> None:
    marker, style = _look(branch)
    radii = np.maximum(1e3 * np.nan_to_num(branch.radii), AT_REST)
    axes.plot(branch.values, radii, style, c="0.6", lw=1, zorder=1)
    for value, radius, word in zip(branch.values, radii, branch.words, strict=True):
        shown = SHOWN[word]
        axes.plot(value, radius, marker, mfc=shown.colour, mec=shown.stroke, ms=5)


def _look(branch: Branch) -> tuple[str, str]:
    return LOOKS[branch.name.split()[0]]


def _legend(branches: list[Branch]) -> tuple[list[Any], list[str]]:
    """Return handles and labels of the legend: words, directions, changes of word."""
    from matplotlib.lines import Line2D

    words = dict.fromkeys(word for branch in branches for word in branch.words)
    marks = {word: ("o", SHOWN[word].colour) for word in words}
    marks |= {name: (look[0], "none") for name, look in LOOKS.items()}
    marks["word changes"] = ("|", "k")
    handles = [
        Line2D([], [], marker=marker, ls="", mfc=colour, mec="k")
        for marker, colour in marks.values()
    ]
    return handles, list(marks)
