"""Texts on a map: its title with notes, titles of its panels, its legend."""

from __future__ import annotations

import textwrap
import tomllib
from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from hpcwhirl.refinement.boundary import STATES
from hpcwhirl.report import palette
from hpcwhirl.report.canvas import FIXED, legend_below, value_of
from hpcwhirl.report.map.colours import GROWING, HATCHED, HATCHES, UNSURE, Colours
from hpcwhirl.report.map.data import Picture
from hpcwhirl.scene import title_of as named
from hpcwhirl.scene.words import SHOWN, WHIRLS
from hpcwhirl.store.reading.select import value_text
from hpcwhirl.store.reading.shares import COUNT, SHARED, SURE, find_credibility
from hpcwhirl.store.results.cells import Refined

if TYPE_CHECKING:
    import xarray

NO_BREAK = "\xa0"
LETTERS_AN_INCH = 13  # letters of a title in an inch
NAMED = {
    "regime": "regimes",
    "whirl": "whirl",
    "both": "regimes and whirl",
    "attractor": "attractors",
    "branch": "branches",
}
KEY = 0.7  # inches, width of a legend entry without its text
LETTERS_OF_KEY = 14  # letters of a legend in an inch


def engine_of(data: xarray.Dataset) -> str:
    """Return the name of the engine from a campaign's results: their scene or title."""
    try:
        scene = tomllib.loads(str(data.attrs["scene"]))
        own = scene["engine"]
        return named(str(own["name"]), str(own.get("file", "")))
    except (KeyError, TypeError, tomllib.TOMLDecodeError):
        return str(data.attrs.get("title", "hpcwhirl campaign")).rpartition(", ")[2]


def title_of(data: xarray.Dataset, picture: Picture, width: float) -> str:
    """Return the title of a map: engine, inputs shared by all cases, duration, notes.

    For a campaign with twins, a note gives the share of cases whose twins agree.

    data, picture, width : results; content of the map; width of the figure, inches
    """
    shown = {*picture.panels[0], picture.x.name, picture.y.name}
    names = [n for n in dict.fromkeys([*FIXED, *picture.inputs]) if n not in shown]
    parts = shared(data, names, picture.case)
    if "duration" not in shown:  # extended cases may have other durations
        end = np.unique(data["duration"].to_numpy()[picture.case])
        parts.append(" to ".join(value_text(t) for t in np.unique(end[[0, -1]])) + " s")
    if data.attrs.get("preset"):
        parts.append(f"preset {data.attrs['preset']}{_confirming(data)}")
    whole = ", ".join(part.replace(" ", NO_BREAK) for part in parts)
    notes = f"{engine_of(data)}: {whole}", *picture.along, *_twins(data, picture)
    wide = max(int(LETTERS_AN_INCH * width), 30)
    return "\n".join(textwrap.fill(note, wide) for note in notes).replace(NO_BREAK, " ")


def shared(
    data: xarray.Dataset,
    names: Sequence[str],
    case: NDArray[np.intp] | slice = slice(None),
) -> list[str]:
    """Return the inputs with one value in all cases as texts ``symbol = value unit``.

    names : names of the inputs that a title may show
    case : indices of the cases, by default all in `data`
    """
    parts = []
    for name in names:
        values = data[name].to_numpy()[case]
        unit = str(data[name].attrs.get("units", ""))
        if len(values) and (values == values[0]).all():
            parts.append(value_of(name, values.item(0), unit))
    return parts


def _twins(data: xarray.Dataset, picture: Picture) -> list[str]:
    """Return notes for a map's title on the share of cases that all twins confirm.

    [] for a campaign without twins.
    """
    if COUNT not in data:
        return []
    found = find_credibility(data[[COUNT, SHARED]].isel(case=picture.case))
    if found is None or not found.cases:
        return []
    by = ["coloured by the most frequent word of case and twins"] * (
        picture.colours.name == "regime"
    )
    return ["; ".join([*by, str(found)])]


def _confirming(data: xarray.Dataset) -> str:
    """Return a note for a map's title on the preset that confirmed boundaries.

    "" if cells of a refined map were not confirmed with a second preset.
    """
    if "fidelity" not in data or not (data["fidelity"] == 1).any():
        return ""
    second = data["preset"].to_numpy()[data["fidelity"].to_numpy() == 1]
    return f", boundaries {second[0]}"


def panel_title(values: dict[str, Any]) -> str:
    """Return the title of a panel: inputs of its cases, as ``symbol = value unit``.

    values : {variable: value in all cases of the panel}
    """
    return ", ".join(value_of(name, value) for name, value in values.items())


def add_legend(
    figure: Any, picture: Picture, more: Sequence[Any], *, lettered: bool
) -> None:
    """Add a legend of the words that occur, with the number of cases of each.

    Parameters
    ----------
    figure : figure of the map
    picture : content of the map
    more : further handles of the legend
    lettered : whether letters and markers of whirl are drawn in the cells
    """
    colours = picture.colours
    counts = colours.kind.counts()
    keys = [_key(word, counts[word], colours, picture, lettered=lettered)
            for word in colours.words(colours.kind)]  # fmt: skip
    keys += _refined_keys(picture.refined)
    if lettered and colours.name != "whirl":
        good = ~picture.word.isin(HATCHES)
        keys += _whirl_keys({*picture.whirl[good].counts()})
    keys += more
    if keys:
        legend_below(figure, more=keys, ncols=_columns(keys, figure.get_figwidth()))


def _columns(keys: Sequence[Any], width: float) -> int:
    """Return how many columns of a legend fit side by side below a figure, at least 1.

    keys, width : handles of the legend, with labels; width of the figure, inches
    """
    longest = max(len(str(key.get_label())) for key in keys)
    return max(int(width / max(1.6, KEY + longest / LETTERS_OF_KEY)), 1)


def _key(
    word: str, count: int, colours: Colours, picture: Picture, *, lettered: bool
) -> Any:
    look = colours.looks[word]
    label = f"{look.letter}  " * lettered + f"{look.told}: {count}"
    if picture.scattered:
        return Line2D([], [], ls="", marker=look.marker, mfc=look.colour,
                      mec=palette.INK, mew=0.5, label=label)  # fmt: skip
    hatch = colours.hatch(word)
    return Patch(fc=colours.fill(word), ec=HATCHED, lw=0.5, hatch=hatch and hatch[0],
                 label=label)  # fmt: skip


def _refined_keys(refined: Refined | None) -> list[Any]:
    """Return legend entries for boundary, confirmed cells and speckle of a refined map.

    [] for a map that was not refined.
    """
    if refined is None:
        return []
    cells = refined.cells
    keys: list[Any] = []
    if len(refined.lines) or (len(refined.over) == 1 and len(refined.panel)):
        label = f"boundary of {NAMED[refined.by]}, half way between cases"
        keys.append(Line2D([], [], c=palette.INK, lw=1.0, label=label))
    if cells.confirmed.any():
        label = f"confirmed cell: {int(cells.confirmed.sum())}"
        keys.append(Patch(fc="none", ec=palette.INK, lw=0.5, label=label))
    speckle = int((cells.state == STATES.index("speckle")).sum())
    if speckle:
        label = f"speckle: {speckle} cells"
        keys.append(
            Patch(fc=palette.PALE, ec=palette.GROUND, hatch="....", lw=0, label=label)
        )
    return keys


def _whirl_keys(found: set[str]) -> list[Any]:
    look: dict[str, Any] = {
        "c": palette.INK,
        "ls": "",
        "mfc": palette.GROUND,
        "ms": 4.5,
    }
    return [
        Line2D([], [], marker=of.marker, label=word, **look)
        for word, of in WHIRLS.items()
        if word in found - {"none"}
    ]


def growing_key(count: int) -> Any:
    """Return the legend entry of cells in which a free motion grows; their number."""
    label = f"free motion grows without contact: {count}"
    return Patch(
        fc=palette.GROUND, ec=GROWING[1], lw=0.5, hatch=GROWING[0], label=label
    )


def twin_keys(
    data: xarray.Dataset, picture: Picture, unsure: NDArray[np.bool_]
) -> list[Any]:
    """Return legend entries of hatched cells, whose word is unsure by their twins.

    They count the cells with too few twins of their word, and those that are coloured
    by the word of most twins instead of their own.

    Parameters
    ----------
    data, picture : results; content of the map
    unsure : (n,), whether too few twins of a case have its word
    """
    labels = {}
    if unsure.any():
        few = f"fewer than {float(data.attrs[SURE]):.0%} of twins agree"
        labels[f"{few}: {int(unsure.sum())}"] = palette.GROUND
    if picture.colours.name == "regime":
        pairs = zip(picture.colours.kind, picture.word, strict=True)
        for (most, own), count in sorted(Counter(pairs).items()):
            if most != own:
                by = f"{SHOWN[most].told} by most twins, itself {SHOWN[own].told}"
                labels[f"{by}: {count}"] = SHOWN[most].colour
    return [
        Patch(fc=fill, ec=UNSURE[1], lw=0.5, hatch=UNSURE[0], label=label)
        for label, fill in labels.items()
    ]
