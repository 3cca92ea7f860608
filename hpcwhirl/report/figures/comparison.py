"""Figure of two campaigns side by side: which cases have another word."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from hpcwhirl.errors import InputError
from hpcwhirl.report.canvas import (
    axis_of,
    in_defaults,
    legend_below,
    name_of,
    new_figure,
    save,
    tell_in_units,
)
from hpcwhirl.scene.words import SHOWN
from hpcwhirl.studies.comparison import Comparison

SAME, CHANGED = 26.0, 110.0  # areas of marks, points²


@in_defaults
def write_comparison(found: Comparison, over: tuple[str, str], path: Path) -> Path:
    """Draw two campaigns side by side, see `draw_comparison`; return `path`.

    over : inputs of the axes
    """
    figure = draw_comparison(found, *over)
    tell_in_units(figure)
    return save(figure, path)


def draw_comparison(found: Comparison, x: str, y: str) -> Any:
    """Return a figure of two campaigns: words in A and in B over one or two inputs.

    A case whose word is the same is a small mark. A changed one is large: the left half
    has the colour of its word in A, the right half that of its word in B, and the
    initials of both stand above it.

    Parameters
    ----------
    found : two campaigns compared
    x, y : varied inputs of the axes; y may be "", and the cases stand in one row
    """
    figure, axes = new_figure((8.0, 5.0 if y else 2.6))
    across, up = found.at[x], found.at[y] if y else np.zeros(len(found.words))
    for word in dict.fromkeys(found.words[~found.changed, 0].tolist()):
        here = ~found.changed & (found.words[:, 0] == word)
        _marks(axes, across[here], up[here], word, SAME, "full")
    for a, b in dict.fromkeys(map(tuple, found.words[found.changed].tolist())):
        here = (found.words[:, 0] == a) & (found.words[:, 1] == b)
        _marks(axes, across[here], up[here], a, CHANGED, "left")
        _marks(axes, across[here], up[here], b, CHANGED, "right")
        for place in zip(across[here], up[here], strict=True):
            axes.annotate(f"{_letter(a)}→{_letter(b)}", place, (0, 8), fontsize=7,
                          textcoords="offset points", ha="center")  # fmt: skip
    axes.margins(0.06, 0.12)
    axes.set_xlabel(axis_of_input(x))
    axes.set_yticks([]) if not y else axes.set_ylabel(axis_of_input(y))
    axes.set_title(_title(found, {x, y}), fontsize=10)
    words = [w for w in SHOWN if w in found.words]
    keys = [_key(word) for word in words]
    legend_below(figure, more=keys, ncols=min(len(keys), 4))
    return figure


def axes_of(found: Comparison, x: str | None, y: str | None) -> tuple[str, str]:
    """Return the inputs of the two axes: those asked for, else those with most values.

    The second is "" if only one input varies.

    x, y : names of varied inputs, None: not asked for

    Raises
    ------
    InputError
        if no number varies, or both axes name one input
    """
    numeric = [n for n, values in found.at.items() if values.dtype.kind in "iuf"]
    order = sorted(numeric, key=lambda n: (n != "speed", -len(np.unique(found.at[n]))))
    varied = [n for n in order if len(np.unique(found.at[n])) > 1]
    first = x or next((n for n in varied if n != y), "")
    second = y or next((n for n in varied if n != first), "")
    if not first or first == second:
        raise InputError("a figure needs a number that varies, and another one as --y")
    return first, second


def axis_of_input(name: str) -> str:
    """Return the label of an axis of a varied input, also where it has no symbol."""
    try:
        return axis_of(name)
    except KeyError:
        return name_of(name)


def _marks(
    axes: Any, x: NDArray[Any], y: NDArray[Any], word: str, area: float, half: str
) -> None:
    """Draw a mark for each of n cases with a word, whole, or its left or right half.

    x, y : (n,), positions
    """
    look = SHOWN[word]
    fill: dict[str, Any] = {"fillstyle": half, "mfc": look.colour, "mec": look.stroke}
    if half != "full":
        fill |= {"markerfacecoloralt": "none", "mew": 0.8}
    axes.plot(x, y, look.marker if half == "full" else "o", ls="", ms=area**0.5, **fill)


def _letter(word: str) -> str:
    return SHOWN[word].letter or word[0].upper()


def _key(word: str) -> Line2D:
    look = SHOWN[word]
    return Line2D([], [], marker=look.marker, ls="", mfc=look.colour, mec=look.stroke,
                  label=f"{word} ({_letter(word)})")  # fmt: skip


def _title(found: Comparison, drawn: set[str]) -> str:
    """Return the title: how many words changed, and over which further inputs."""
    text = f"{int(found.changed.sum())} of {len(found.words)} words changed, A → B"
    others = [n for n in found.over if n not in drawn]
    return text + (f"; {', '.join(others)} vary, too" if others else "")
