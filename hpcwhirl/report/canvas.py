"""What all figures share: creation, titles, labels and ticks with units, writing."""

from __future__ import annotations

import hashlib
import re
import warnings
from collections.abc import Callable, Sequence
from functools import wraps
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

import numpy as np

from hpcwhirl.errors import legible
from hpcwhirl.report import palette
from hpcwhirl.scene.quantities import AXES, DERIVED, INPUTS, ROW, TRACES, variable_name
from hpcwhirl.scene.units import shown_in, with_unit
from hpcwhirl.store.atomic import make_folders, replacing, sweep_idle, telling
from hpcwhirl.store.reading.select import value_text

FIXED = ("speed", "nodal_diameter", "gap", "friction")  # inputs named first in titles
DIGITS = 6  # digits of a number in a unit other than SI, and in the title of a case
KNOWN = DERIVED | AXES | TRACES | ROW
NAMED = {variable_name(name): quantity for name, quantity in INPUTS.items()} | KNOWN
UNITS = re.compile(r", (rad/s|m|N|s|Hz|1/s)(?=$|[\n,]| \()")
STEPS = (1, 2, 2.5, 5, 10)
P = ParamSpec("P")
T = TypeVar("T")


def name_of(name: str) -> str:
    """Return the name of a variable of results for a label, such as "speed Ω".

    Underscores become spaces; the symbol follows if there is one.
    """
    symbol = NAMED[name].symbol if name in NAMED else ""
    return f"{name.replace('_', ' ')} {symbol}".strip()


def axis_of(name: str) -> str:
    """Return the label of an axis on which a variable is drawn, such as "Ω, rad/s".

    It has the variable's symbol, or else its name, and the SI unit.
    """
    return KNOWN[name].labelled(KNOWN[name].symbol or name.replace("_", " "))


def eq13_of(family: str) -> str:
    """Return the label of a critical speed: "Eq. 13", or "Eq. 13, suspension".

    family : family of the rotor's modes, which is named if it is not "1F"
    """
    return "Eq. 13" if family == "1F" else f"Eq. 13, {family}"


def value_of(name: str, value: Any, unit: str = "") -> str:
    """Return a variable with its value for a title, such as ``Ω = 440 rad/s``.

    Parameters
    ----------
    name : name of a variable of results
    value : number or text; a long text is shortened
    unit : unit of `value`, if not the one in `scene.quantities`; the text has the unit
        that the user chose for it, see `scene.units.shown_in`
    """
    known = NAMED.get(name)
    symbol = (known and known.symbol) or name.replace("_", " ")
    unit, factor = shown_in(unit or (known.unit if known else ""))
    if factor != 1.0 and isinstance(value, int | float):
        value = float(f"{factor * value:.{DIGITS}g}")
    text = value_text(value)
    text = text if len(text) <= 40 else text[:39] + "…"
    return f"{symbol} = {with_unit(text, unit, ' ')}"


def title_of(row: Any) -> str:
    """Return the title of a case's figure: speed, lobes, gap, friction, regime, whirl.

    row : {name of result: value in the case}
    """
    words = f"{row['regime']}, {row['whirl']}"
    lost = {"unstable": "unstable integration", "overloaded": "overloaded"}
    words = lost.get(str(row["outcome"]), words)
    shown = {name: float(f"{row[name]:.{DIGITS}g}") for name in FIXED}
    at = {name: value_of(name, value) for name, value in shown.items()}
    if told := _speeds(str(row.get("words_over_speed", ""))):
        at["speed"] = f"{at['speed'].partition(' = ')[0]} = {told}"
    return f"{', '.join(at.values())}: {words}"


def _speeds(told: str) -> str:
    """Return first and last speed of a run as text; "" where it has no windows.

    told : result `words_over_speed` of the case
    """
    from hpcwhirl.analysis.over_speed import speeds_told, spells_of

    spells = spells_of(told)
    if not spells:
        return ""
    return speeds_told(spells[0]._replace(last=spells[-1].last), " to ")


def tell_in_units(figure: Any) -> None:
    """Change the labels and ticks of a drawn figure to the units that the user chose.

    The data stay in SI; labels name the unit shown, and ticks are at round numbers in
    this unit. Only linear axes whose label contains an SI unit are changed.
    """
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            found = UNITS.search(axis.label.get_text())
            if found and axis.get_scale() == "linear":
                _tell(axis, found)


def _tell(axis: Any, found: re.Match[str]) -> None:
    from matplotlib.ticker import FuncFormatter, MaxNLocator

    unit, factor = shown_in(found[1])
    if factor == 1.0:
        return

    class Round(MaxNLocator):
        """Locator of ticks at round numbers in the unit that is shown."""

        def tick_values(self, vmin: float, vmax: float) -> Any:
            ticks = super().tick_values(factor * vmin, factor * vmax)
            return np.asarray(ticks) / factor

    text = axis.label.get_text()
    axis.set_label_text(f"{text[: found.start()]}, {unit}{text[found.end() :]}")
    axis.set_major_locator(Round(9, steps=STEPS))
    axis.set_major_formatter(
        FuncFormatter(lambda x, _: value_text(round(factor * x, 9)))
    )


def legend_below(
    figure: Any, *panels: Any, more: Sequence[Any] = (), ncols: int = 4
) -> None:
    """Add one legend for all panels below a figure, where it hides no curve.

    panels, more : axes whose labelled curves are listed; further handles
    """
    keys = [k for axes in panels for k in axes.get_legend_handles_labels()[0]]
    figure.legend(handles=[*keys, *more], loc="outside lower center", ncols=ncols,
                  fontsize=8, frameon=False)  # fmt: skip


# white ground of a text that stands on lines, as `bbox` of matplotlib
BOX = {"boxstyle": "round,pad=0.1", "fc": palette.GROUND, "lw": 0, "alpha": 0.8}
LONGEST = 80  # largest number of characters of a text that is part of a file name


def in_defaults(draw: Callable[P, T]) -> Callable[P, T]:
    """Let a function draw and write in Matplotlib's defaults, as a decorator.

    What a matplotlibrc sets, such as LaTeX for all text, does not count: a figure looks
    the same for everyone, and compute nodes have no LaTeX. What `palette.style` sets
    does.
    """

    @wraps(draw)
    def drawn(*args: P.args, **options: P.kwargs) -> T:
        from matplotlib import rc_context, rcParamsDefault

        plain = {n: value for n, value in rcParamsDefault.items() if n != "backend"}
        with rc_context(plain | palette.style()):  # type: ignore[arg-type, unused-ignore]
            return draw(*args, **options)

    return drawn


def new_figure(
    size: tuple[float, float], rows: int = 1, columns: int = 1, **options: Any
) -> tuple[Any, Any]:
    """Return a new figure of matplotlib, and its axes.

    size : width and height, inches
    rows, columns, options : arguments of `subplots` of matplotlib's figures
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, layout="constrained")
    return figure, figure.subplots(rows, columns, **options)


def part_of_name(text: str) -> str:
    """Return a text in a form that can be part of a file name.

    It has safe characters only; a long text is cut and gets a digest, to stay unique.
    """
    plain = re.sub(r"[^A-Za-z0-9._=+-]+", "-", text).strip("-")
    if len(plain) <= LONGEST:
        return plain
    return f"{plain[:LONGEST]}-{hashlib.sha256(text.encode()).hexdigest()[:8]}"


def save(figure: Any, path: Path, dpi: int = 130, **options: Any) -> Path:
    """Write a figure to a file, and return the file's path.

    path : its ending sets the format, such as .png
    dpi, options : dots per inch; arguments of matplotlib's `savefig`
    """
    with telling(path):
        make_folders(path.parent)
        sweep_idle(path.parent, path.name)  # files left by a killed process
        with replacing(path, held=True) as part, warnings.catch_warnings():
            # an engine's name may be in any script: missing letters are boxes in a PNG
            warnings.filterwarnings("ignore", r"Glyph \d+ .* missing from font")
            _tidy(figure)
            if path.suffix == ".png":
                _arrange(figure, dpi)
            figure.savefig(part, format=path.suffix[1:], dpi=dpi, **options)
    return path


def _arrange(figure: Any, dpi: int) -> None:
    """Give all parts of a figure their places, which they keep from now on.

    `savefig` would draw the whole figure once more for that.
    """
    from matplotlib import rc_context

    if engine := figure.get_layout_engine():
        figure.set_dpi(dpi)
        engine.execute(figure)
        none = {"figure.autolayout": False, "figure.constrained_layout.use": False}
        with rc_context(none):  # type: ignore[arg-type, unused-ignore]
            figure.set_layout_engine(None)


def _tidy(figure: Any) -> None:
    """Replace characters that an SVG file must not contain in all texts of a figure."""
    from matplotlib.text import Text

    for text in figure.findobj(Text):
        if text.get_text() != (told := legible(text.get_text())):
            text.set_text(told)
