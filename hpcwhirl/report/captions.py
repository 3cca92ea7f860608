"""What a map says in words: title, panels, legend, notes."""

from __future__ import annotations

import textwrap
import tomllib
from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from hpcwhirl.refinement.boundary import STATES
from hpcwhirl.report.cells import HATCHED, HATCHES, fill_of, hatched
from hpcwhirl.report.colours import Colours
from hpcwhirl.report.labels import value_of
from hpcwhirl.report.picture import RPM, Picture, Wish
from hpcwhirl.scene.words import WHIRLS
from hpcwhirl.store.reading.select import told
from hpcwhirl.store.results.cells import Refined

if TYPE_CHECKING:
    import xarray

    from hpcwhirl.report.sheet import Sheet

FIXED = ("speed", "nodal_diameter", "gap", "friction")
NO_BREAK = "\xa0"
LETTERS_AN_INCH = 13  # of a title


def engine_of(data: xarray.Dataset) -> str:
    """Return the name of the engine, from the scene or the title of the file."""
    try:
        scene = tomllib.loads(str(data.attrs["scene"]))
        return str(scene["engine"]["name"])
    except (KeyError, TypeError, tomllib.TOMLDecodeError):
        return str(data.attrs.get("title", "hpcwhirl campaign")).rpartition(", ")[2]


def title_of(data: xarray.Dataset, picture: Picture, wish: Wish, width: float) -> str:
    """Return engine, inputs that all cases share, duration, preset; notes below."""
    parts, wide = [], max(int(LETTERS_AN_INCH * width), 30)
    shown = {*picture.panels[0], picture.x.name, picture.y.name}
    own = [n for n in picture.inputs if n not in FIXED]
    for name in [*FIXED, *own]:
        known = set(data[name].to_numpy()[picture.case].tolist())
        if len(known) == 1 and name not in shown:
            parts.append(_fixed(data, name, known.pop(), rpm=wish.rpm))
    end = np.unique(data["duration"].to_numpy()[picture.case])
    if "duration" not in shown:  # some may have gone on for longer
        parts.append(" to ".join(told(t) for t in np.unique(end[[0, -1]])) + " s")
    if data.attrs.get("preset"):
        parts.append(f"preset {data.attrs['preset']}{_confirming(data)}")
    whole = [part.replace(" ", NO_BREAK) for part in parts]
    text = f"{engine_of(data)}: {', '.join(whole)}"
    lines = [textwrap.fill(line, wide) for line in (text, *picture.along)]
    return "\n".join(lines).replace(NO_BREAK, " ")


def _confirming(data: xarray.Dataset) -> str:
    """Return by which preset boundaries are confirmed, if any."""
    if "fidelity" not in data or not (data["fidelity"] == 1).any():
        return ""
    second = data["preset"].to_numpy()[data["fidelity"].to_numpy() == 1]
    return f", boundaries {second[0]}"


def _fixed(data: xarray.Dataset, name: str, value: Any, *, rpm: bool) -> str:
    if rpm and name == "speed":
        return value_of(name, RPM * value, "rpm")
    return value_of(name, value, str(data[name].attrs.get("units", "")))


def panel_title(values: dict[str, Any]) -> str:
    """Return what the cases of a panel share, with units."""
    return ", ".join(value_of(name, value) for name, value in values.items())


def add_legend(
    figure: Any,
    blocks: Sequence[Any],
    layers: Sequence[Colours],
    sheet: Sheet,
    more: Sequence[Any] = (),
) -> None:
    """Tell the words that occur, and how many cases have each.

    Below the panels, or beside those of each layer where there are several.

    Parameters
    ----------
    figure : of the map
    blocks : (rows, columns) of axes for each layer
    layers, sheet : what they show
    more : further lines of the first layer's legend
    """
    for block, colours in zip(blocks, layers, strict=True):
        counts = Counter(colours.kind.tolist())
        words = [word for word in colours.looks if counts[word]]
        keys = [_key(word, counts[word], colours, sheet) for word in words]
        marked = sheet.lettered and colours.name != "whirl"
        marked = marked or (len(layers) == 1 and sheet.picture.scattered)
        keys += refined_keys(sheet.picture.refined)
        if marked and not sheet.points and sheet.picture.refined is None:
            good = ~np.isin(sheet.picture.word, list(HATCHES))
            keys += _whirl_keys(set(sheet.picture.whirl[good].tolist()))
        keys += more if colours is layers[0] else []
        if len(layers) > 1:
            block[0, -1].legend(handles=keys, loc="upper left", fontsize=8,
                                bbox_to_anchor=(1.0, 1.0), frameon=False)  # fmt: skip
        elif keys:
            figure.legend(handles=keys, loc="outside lower center", fontsize=8,
                          ncols=max(int(figure.get_figwidth() / 1.6), 1),
                          frameon=False)  # fmt: skip


def _key(word: str, count: int, colours: Colours, sheet: Sheet) -> Any:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    look = colours.looks[word]
    told_ = f"{look.letter}  {look.told}" if sheet.lettered else look.told
    label, fill = f"{told_}: {count}", fill_of(word, colours)
    if sheet.points:
        return Line2D([], [], ls="", marker=look.marker, mfc=fill, mec="black", mew=0.5,
                      label=label)  # fmt: skip
    hatch = HATCHES[word] if hatched(colours, [word]) else None
    return Patch(fc=fill, ec=HATCHED, lw=0.5, hatch=hatch, label=label)


def refined_keys(refined: Refined | None) -> list[Any]:
    """Return the keys of what the map of a refined campaign marks."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    if refined is None:
        return []
    cells = refined.cells
    keys: list[Any] = []
    if len(refined.lines) or (len(refined.over) == 1 and len(refined.panel)):
        keys.append(Line2D([], [], c="black", lw=1.0, label="boundary"))
    if cells.confirmed.any():
        label = f"confirmed cell: {int(cells.confirmed.sum())}"
        keys.append(Patch(fc="none", ec="black", lw=0.5, label=label))
    speckle = int((cells.state == STATES.index("speckle")).sum())
    if speckle:
        label = f"speckle: {speckle} cells"
        keys.append(Patch(fc="#BBBBBB", ec="white", hatch="....", lw=0, label=label))
    return keys


def _whirl_keys(found: set[str]) -> list[Any]:
    from matplotlib.lines import Line2D

    kept = {word: look for word, look in WHIRLS.items() if word in found - {"none"}}
    look: dict[str, Any] = {"c": "black", "ls": "", "mfc": "white", "ms": 4.5}
    return [
        Line2D([], [], marker=of.marker, label=word, **look)
        for word, of in kept.items()
    ]
