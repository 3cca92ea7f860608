"""The map of a campaign: regimes, whirl or a number over any of its swept inputs."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hpcwhirl.errors import InputError
from hpcwhirl.regular import open_regular
from hpcwhirl.report.captions import FIXED
from hpcwhirl.report.picture import Picture, Wish, picture_of
from hpcwhirl.report.refined import with_cells
from hpcwhirl.report.saving import save
from hpcwhirl.report.shares import (
    SHARE,
    as_cases,
    figure_of_shares,
    shares_shown,
    told_of,
    varied,
    wants_shares,
    write_shares,
)
from hpcwhirl.report.sheet import figure_of
from hpcwhirl.report.table import write_picture
from hpcwhirl.store.hdf5 import reading
from hpcwhirl.store.reading.reader import open_results
from hpcwhirl.store.results.cells import read_refined

if TYPE_CHECKING:
    import xarray

KEY = "Description"  # of the files' metadata: how the map was asked for


@dataclass(frozen=True)
class Drawing:
    """A map, drawn: the figure, what it shows, and how it was asked for.

    Of a campaign whose inputs were drawn it shows shares, see `analysis.shares`.
    """

    figure: Any
    picture: Picture | None
    wish: Wish
    shares: Any = None

    def write_table(self, path: Path) -> Path:
        """Write what is shown as CSV; return the path."""
        if self.picture is None:
            return write_shares(path, self.shares)
        return write_picture(path, self.picture)


def draw_map(results: Path, out: Path, wish: Wish | None = None) -> list[Path]:
    """Draw map.png and map.svg of a campaign and return their paths.

    Parameters
    ----------
    results : `results.h5`
    out : directory of the figures
    wish : axes, panels and colour; what it leaves open is chosen
    """
    return save_map(drawing_of(results, wish or Wish()), out)


def drawing_of(results: Path, wish: Wish) -> Drawing:
    """Return the map of a campaign; only columns of numbers are read, no traces."""
    with open_results(results) as data:
        if not data.sizes.get("case"):
            msg = f"{results} has no cases: nothing to draw"
            raise InputError(msg)
        with reading(results):
            if wants_shares(data, wish):
                return _drawing_of_shares(data, wish, results.parent)
            picture = with_cells(picture_of(data, wish), data, read_refined(results))
            for name in (*FIXED, "duration"):  # what the title tells
                data[name].load()
        figure = figure_of(data, picture, wish, results.parent)
    return Drawing(figure, picture, wish)


def _drawing_of_shares(data: xarray.Dataset, wish: Wish, folder: Path) -> Drawing:
    found = shares_shown(data, wish)
    if len(varied(found)) < 2:
        return Drawing(figure_of_shares(data, found, wish), None, wish, found)
    cases = as_cases(data, found)
    over = replace(wish, colour=SHARE, at=())
    picture = picture_of(cases, over)
    picture = replace(picture, along=[*picture.along, told_of(data, found)])
    figure = figure_of(cases, picture, over, folder)
    return Drawing(figure, None, wish, found)


def save_map(drawing: Drawing, out: Path, stem: str = "map") -> list[Path]:
    """Write a map as PNG and SVG, each whole or not at all; return their paths."""
    told = {KEY: json.dumps(asdict(drawing.wish))}
    paths = [out / f"{stem}.png", out / f"{stem}.svg"]
    for path in paths:
        save(drawing.figure, path, dpi=140, metadata=told)
        drawing.figure.set_layout_engine("none")  # it is laid out now
    return paths


def wish_of(path: Path) -> Wish | None:
    """Return how a map.png was asked for; None where there is none that tells."""
    from PIL import Image, UnidentifiedImageError

    try:
        with open_regular(path) as file, Image.open(file) as image:
            asked = json.loads(image.info[KEY])
        lists = {n: tuple(asked[n]) for n in ("panels", "at")}
        return Wish(**{**asked, **lists})
    except (OSError, KeyError, TypeError, ValueError, UnidentifiedImageError):
        return None
