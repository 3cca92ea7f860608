"""Colours, dashes and markers of everything that is drawn: figures, page, hover maps.

Only this table and that of the words, `scene.words`, name colours. The colours of
`SERIES` differ for the colour-blind on white and on the page's dark ground, and stand
out from both grounds; curves differ in their dashes as well, so that they can be told
apart in grey. `tests/scene/test_palette.py` computes these distances.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Series:
    """How one of several curves of a picture is drawn.

    Attributes
    ----------
    colour : colour on white, sRGB
    night : colour on the dark ground of the page, sRGB
    dash : dashes and gaps, in widths of the line; () for a solid line
    marker : Matplotlib's marker
    """

    colour: str
    night: str
    dash: tuple[float, ...]
    marker: str

    @property
    def style(self) -> Any:
        """Line style for Matplotlib."""
        return (0, self.dash) if self.dash else "-"


SERIES = (
    Series("#08519C", "#6E9BF5", (), "o"),
    Series("#D55E00", "#FF7A45", (6, 2), "s"),
    Series("#1B9E77", "#7DEBAE", (6, 2, 1.5, 2), "^"),
    Series("#8A2A6B", "#E6C2EE", (1.5, 1.5), "D"),
)
MARKERS = "os^Dv<>pP"  # nine, and four colours: 36 curves differ
BLUE, ORANGE, GREEN, PURPLE = (one.colour for one in SERIES)
INK, GROUND = "#000000", "#FFFFFF"
DARK, QUIET, GREY, EDGE, PALE, FAINT = (  # greys, from text to grounds of bands
    "#3A3A3A", "#666666", "#808080", "#999999", "#CCCCCC", "#EEEEEE",
)  # fmt: skip
DEEP, SKY = "#08306B", "#9ECAE1"  # a path in the window of the words, and before it
TOUCH = "#C63D0F"  # contact
GROWING = "#B0005A"  # what grows without contact
TINT = "#FFFFFF70"  # laid over a cell, for a hatch of white
ATTRACTORS = {  # shades of a regime's colour, for its attractors by number
    "sustained": ("#F2DC3A", "#6B9E1F", "#C9A800", "#B6D97A", "#7A6A00", "#F7EFA0"),
    "divergent": ("#C63D0F", "#8E1B4A", "#F08A5D", "#5E1208", "#E05A8A", "#A86A3D"),
}
SEQUENTIAL = "cividis"  # colour map, perceptually uniform, fit for the colour-blind
DIVERGING = "PuOr"  # colour map of numbers of both signs
PAGE = {  # {variable of the page's style: (by day, by night)}
    "ground": (GROUND, "#15181D"), "raised": ("#F4F5F7", "#1F242B"),
    "ink": ("#1C2026", "#E6E9EE"), "quiet": ("#5A626D", "#A3ACB8"),
    "edge": ("#C9CED6", "#3B434E"), "pale": (SKY, "#3D6484"),
    "focus": ("#B0007A", "#FF7FD1"), "warn": ("#8A3200", "#FFB38A"),
    "touch": (TOUCH, "#FF9166"), "growing": (GROWING, GROWING),
    "chosen": ("#111111", "#111111"), "halo": ("#FFFFFF", "#FFFFFF"),
    **{f"series-{n}": (one.colour, one.night) for n, one in enumerate(SERIES)},
}  # fmt: skip


def look_of(number: int) -> dict[str, Any]:
    """Return colour, marker and dashes of one of many curves, for Matplotlib's `plot`.

    number : its number; the first 36 differ in colour or marker
    """
    one = SERIES[number % len(SERIES)]
    marker = MARKERS[number % len(MARKERS)]
    return {"c": one.colour, "marker": marker, "ls": one.style}


def spaced(number: int, count: int, points: int) -> dict[str, Any]:
    """Return colour and markers of one of many dense curves over the same axis.

    Curves are solid; each has its marker at ten points that the others leave free.

    number, count, points : its number; number of curves; number of its points
    """
    every = max(points // 10, 1)
    first = int((number + 0.5) / max(count, 1) * every)
    look = look_of(number) | {"ls": "-", "ms": 4, "mfc": GROUND}
    return look | {"markevery": (first, every)}


def page_style() -> str:
    """Return the colours of the page as CSS variables, by day and by night.

    What is printed has those of the day.
    """
    day, night = (
        " ".join(f"--{name}: {pair[i]};" for name, pair in PAGE.items()) for i in (0, 1)
    )
    dark = "@media screen and (prefers-color-scheme: dark)"
    return f":root {{ {day} }}\n{dark} {{ :root {{ {night} }} }}\n"


def page_series() -> list[dict[str, str]]:
    """Return how the page draws curves: colour as a CSS variable, dashes for SVG."""
    return [
        {"stroke": f"var(--series-{n})", "dash": " ".join(map(str, one.dash))}
        for n, one in enumerate(SERIES)
    ]


def style() -> dict[str, Any]:
    """Return what figures have beside the defaults of Matplotlib, as rcParams."""
    from cycler import cycler

    # without dashes: they would reach curves that are given a colour alone
    curves = cycler(color=[s.colour for s in SERIES])
    return {"axes.prop_cycle": curves, "image.cmap": SEQUENTIAL}
