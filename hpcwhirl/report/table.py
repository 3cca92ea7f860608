"""Tables: what a map shows, as CSV."""

from __future__ import annotations

import csv
import io
from pathlib import Path

from hpcwhirl.report.picture import Picture
from hpcwhirl.store.atomic import write_whole


def write_picture(path: Path, picture: Picture) -> Path:
    """Write a line for each case that a map shows; return the path.

    Columns: case, the swept inputs in SI units, panel, position on the axes in the
    units drawn, word, whirl and, where the colour is a number, that number.
    """
    number = picture.colours.number
    head = ["case", *picture.inputs, "panel"]
    head += [f"x: {picture.x.label}", f"y: {picture.y.label}", "word", "whirl"]
    columns = [picture.case, *picture.inputs.values(), picture.panel]
    columns += [picture.x.place, picture.y.place, picture.word, picture.whirl]
    if number is not None:
        head.append(picture.colours.label)
        columns.append(number)
    text = io.StringIO()
    out = csv.writer(text, lineterminator="\n")
    out.writerow(head)
    out.writerows(zip(*(column.tolist() for column in columns), strict=True))
    write_whole(path, text.getvalue().encode())
    return path
