"""Reading, drawing and writing maps of regimes, whirl or a number over swept inputs."""

from __future__ import annotations

import csv
import io
import json
import shlex
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from hpcwhirl.errors import InputError, csv_cell
from hpcwhirl.report.canvas import FIXED, in_defaults, part_of_name, save
from hpcwhirl.report.map.data import Picture, Wish, picture_of, with_cells
from hpcwhirl.report.page.build import is_stale
from hpcwhirl.safe_open import open_regular
from hpcwhirl.scene.units import showing
from hpcwhirl.store.atomic import write_whole
from hpcwhirl.store.directory.campaign_directory import PAGE, Directory
from hpcwhirl.store.hdf5 import reading
from hpcwhirl.store.reading.reader import open_coded
from hpcwhirl.store.reading.results_file import in_their_units
from hpcwhirl.store.results.cells import read_refined

if TYPE_CHECKING:
    import xarray

MADE_BY = {
    "map.png": "hpcwhirl map {}",
    PAGE: "hpcwhirl report {}",
    "figures": "hpcwhirl figures {}",
}
KEY = "Description"  # entry of a PNG's metadata with the map's options


@dataclass(frozen=True)
class Drawing:
    """A drawn map: its figure, its content and the user's options.

    Attributes
    ----------
    figure, wish : figure of matplotlib; the options
    picture : content of the map; None if it shows shares of regimes
    shares : table of these shares, else None
    """

    figure: Any
    picture: Picture | None
    wish: Wish
    shares: Any = None

    def write_table(self, path: Path) -> Path:
        """Write what the map shows as a CSV file, a line for each case; return `path`.

        For shares of regimes there is a line for each point and regime.
        """
        from hpcwhirl.report.map.probabilities import shares_table

        shown = self.picture
        rows = shares_table(self.shares) if shown is None else picture_table(shown)
        text = io.StringIO()
        out = csv.writer(text, lineterminator="\n")
        out.writerows(map(csv_cell, row) for row in rows)
        write_whole(path, text.getvalue().encode())
        return path


def picture_table(picture: Picture) -> Iterator[Sequence[Any]]:
    """Yield the header and the rows of a map's table, one for each case shown.

    Columns: case, swept inputs in SI units, panel, positions on the axes in the units
    drawn, word, whirl, the most frequent word of case and twins (if there are twins)
    and, if a number is coloured, that number.
    """
    columns: dict[str, Any] = {"case": picture.case}
    columns |= {name: own.values for name, own in picture.inputs.items()}
    columns["panel"] = picture.panel
    columns |= {f"x: {picture.x.label}": picture.x.place}
    columns |= {f"y: {picture.y.label}": picture.y.place}
    columns |= {"word": picture.word, "whirl": picture.whirl}
    if picture.majority is not None:
        columns["word by majority"] = picture.majority
    if picture.colours.number is not None:
        columns[picture.colours.label] = picture.colours.number
    yield [*columns]
    yield from zip(*(column.tolist() for column in columns.values()), strict=True)


@in_defaults
def draw_map(
    results: Path, out: Path, wish: Wish | None = None, *, table: bool = False
) -> list[Path]:
    """Draw a campaign's map as a PNG and an SVG file; return their paths.

    Parameters
    ----------
    results : path of `results.h5`
    out : directory of the figures
    wish : options of the map; None: all chosen automatically
    table : whether the values drawn are also written, as a CSV file
    """
    with in_their_units(results):
        drawing = drawing_of(results, wish or Wish())
        paths = save_map(drawing, out)
    if table:
        paths.append(drawing.write_table(out / f"{stem_of(drawing.wish)}.csv"))
    return paths


def stem_of(wish: Wish) -> str:
    """Return the name of a map's files without ending, which tells its options.

    It is ``map`` by default, and for example ``map-growth_rate`` with another colour.
    """
    parts = [wish.colour] if wish.colour != "regime" else []
    parts += [f"{side}-{name}" for side in ("x", "y") if (name := getattr(wish, side))]
    parts += [f"panel-{name}" for name in wish.panels] + [*wish.at]
    parts += [name for name in ("rpm", "critical") if getattr(wish, name)]
    parts += wish.units if wish.units != Wish.units else ()
    return "-".join(["map", *filter(None, [part_of_name("-".join(parts))])])


def drawing_of(results: Path, wish: Wish) -> Drawing:
    """Draw a campaign's map without writing it.

    Of the results, traces are not read.

    results, wish : path of `results.h5`; options of the map
    """
    from hpcwhirl.report.map.layout import figure_of
    from hpcwhirl.report.map.probabilities import wants_shares

    with open_coded(results) as data, showing(wish.shown):
        if not data.sizes.get("case"):
            raise InputError(f"{results} has no cases: nothing to draw")
        with reading(results):
            if wants_shares(data, wish):
                return _drawing_of_shares(data, wish, results)
            picture = picture_in(data, results, wish)
            for name in (*FIXED, "duration"):  # shown in the title
                data[name].load()
        figure = figure_of(data, picture, wish, results)
    return Drawing(figure, picture, wish)


def picture_in(data: xarray.Dataset, results: Path, wish: Wish) -> Picture:
    """Return the content of a map, including the cells of a refined campaign.

    results : path of `results.h5`, from which the cells are read
    """
    by = wish.colour if wish.colour in {"regime", "whirl"} else ""
    return with_cells(picture_of(data, wish), data, read_refined(results, by))


def _drawing_of_shares(data: xarray.Dataset, wish: Wish, results: Path) -> Drawing:
    from hpcwhirl.report.map import layout, probabilities

    found = probabilities.shares_shown(data, wish)
    if len(probabilities.varied(found)) < 2:
        note = probabilities.draws_note(data, found)
        figure = probabilities.figure_of_shares(data, found, note)
        return Drawing(figure, None, wish, found)
    cases = probabilities.as_cases(data, found)
    over = replace(wish, colour=probabilities.SHARE, at=())
    picture = picture_of(cases, over)
    drawn = probabilities.draws_note(data, found)
    picture = replace(picture, along=[*picture.along, drawn])
    figure = layout.figure_of(cases, picture, over, results)
    return Drawing(figure, None, wish, found)


@in_defaults
def save_map(drawing: Drawing, out: Path) -> list[Path]:
    """Write a map as a PNG and an SVG file, each atomically; return their paths.

    The files are named by the map's options, see `stem_of`; the PNG also stores them.

    out : directory of the files
    """
    told = {KEY: json.dumps(asdict(drawing.wish))}
    stem = stem_of(drawing.wish)
    paths = [out / f"{stem}.{kind}" for kind in ("png", "svg")]
    for path in paths:
        save(drawing.figure, path, dpi=140, metadata=told)
    return paths


def wish_of(path: Path) -> Wish | None:
    """Return the options with which a map was drawn, which its PNG file stores.

    None if the file has none; path : the PNG file
    """
    from PIL import Image, UnidentifiedImageError

    try:
        with open_regular(path) as file, Image.open(file) as image:
            asked = json.loads(image.info[KEY])
        lists = {n: tuple(v) for n, v in asked.items() if isinstance(v, list)}
        return Wish(**{**asked, **lists})
    except (OSError, KeyError, TypeError, ValueError, UnidentifiedImageError):
        return None


def refresh(
    directory: Directory, *, changed: bool = True
) -> tuple[list[Path], list[str]]:
    """Draw a campaign's existing maps again after its results were written again.

    Each is drawn with the options stored in it; its table, if there is one, follows.

    changed : whether numbers or words of the results changed, so that figures, which
        are not drawn again, show older ones

    Returns
    -------
    paths of the maps drawn, and a message for each other file, such as the page, that
    still shows older results
    """
    drawn: list[Path] = []
    why, folder = {}, directory.path
    for path in sorted(folder.glob("map*.png")):
        wish = wish_of(path)
        if wish is None:
            continue
        try:
            table = path.with_suffix(".csv").exists()
            drawn += draw_map(directory.results, folder, wish, table=table)
        except InputError as refused:
            why[path.name] = f" ({refused})"
    names = dict.fromkeys([*MADE_BY, *why])
    lines = [
        f"{folder / name} is stale{why.get(name, '')}: "
        + MADE_BY.get(name, "hpcwhirl map {} ...").format(shlex.quote(str(folder)))
        for name in names
        if (folder / name).exists() and folder / name not in drawn
        if (is_stale(directory) if name == PAGE else changed or name in why)
    ]
    return drawn, lines
