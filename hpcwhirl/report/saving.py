"""New figures, and writing figures as files, atomically."""

from __future__ import annotations

import hashlib
import re
import warnings
from pathlib import Path
from typing import Any

from hpcwhirl.errors import legible
from hpcwhirl.store.atomic import make_folders, replacing, sweep_idle, telling

LONGEST = 80  # largest number of characters of a text that is part of a file name


def new_figure(
    size: tuple[float, float], rows: int = 1, columns: int = 1, **options: Any
) -> tuple[Any, Any]:
    """Return a figure of width and height `size`, in, and its axes.

    rows, columns, options : as of `subplots` of matplotlib's figures
    """
    from matplotlib.figure import Figure

    figure = Figure(figsize=size, layout="constrained")
    return figure, figure.subplots(rows, columns, **options)


def part_of_name(text: str) -> str:
    """Return a text as part of a file name: safe characters, bounded length, unique."""
    plain = re.sub(r"[^A-Za-z0-9._=+-]+", "-", text).strip("-")
    if len(plain) <= LONGEST:
        return plain
    return f"{plain[:LONGEST]}-{hashlib.sha256(text.encode()).hexdigest()[:8]}"


def save(figure: Any, path: Path, dpi: int = 130, **options: Any) -> Path:
    """Write a figure in the format of the file's name, and return its path."""
    with telling(path):
        make_folders(path.parent)
        sweep_idle(path.parent, path.name)  # files left by a killed process
        with replacing(path, held=True) as part, warnings.catch_warnings():
            # an engine's name may be in any script: missing letters are boxes in a PNG
            warnings.filterwarnings("ignore", r"Glyph \d+ .* missing from font")
            _tidy(figure)
            figure.savefig(part, format=path.suffix[1:], dpi=dpi, **options)
    return path


def _tidy(figure: Any) -> None:
    """Escape characters in a figure's texts that an SVG must not contain."""
    from matplotlib.text import Text

    for text in figure.findobj(Text):
        if text.get_text() != (told := legible(text.get_text())):
            text.set_text(told)
