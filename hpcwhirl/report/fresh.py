"""What a campaign's directory shows of words that have changed since."""

from __future__ import annotations

from pathlib import Path

from hpcwhirl.errors import InputError
from hpcwhirl.report.maps import draw_map, wish_of
from hpcwhirl.report.page.build import NAME, is_stale

MADE_BY = {
    "map.png": "hpcwhirl map {}",
    "map.csv": "hpcwhirl map {} --csv",
    NAME: "hpcwhirl report {}",
    "figures": "hpcwhirl figures {}",
}


def refresh(folder: Path) -> tuple[list[Path], list[str]]:
    """Draw a campaign's map again as it was asked for, and tell what is left stale.

    Returns
    -------
    paths drawn, and a line for each file that still shows what was there before
    """
    drawn, why = [], ""
    wish = wish_of(folder / "map.png")
    if wish is not None:
        try:
            drawn = draw_map(folder / "results.h5", folder, wish)
        except InputError as refused:
            why = f" ({refused})"
    lines = [
        f"{folder / name} is stale{why if name == 'map.png' else ''}: "
        + command.format(folder)
        for name, command in MADE_BY.items()
        if (folder / name).exists() and folder / name not in drawn
        if name != NAME or is_stale(folder)
    ]
    return drawn, lines
