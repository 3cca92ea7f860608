"""Files with a table as text: CSV in UTF-8 or UTF-16, and spreadsheets.

Of a spreadsheet (.xlsx, .xls, .ods) the first sheet counts: one line for each row, its
cells separated by tabs. So a sheet is read as the text table that the same program
would save, and errors name its rows. The library calamine reads all these formats; it
is an extra, which is named where it is missing.
"""

from __future__ import annotations

import codecs
import io
import zipfile
from pathlib import Path
from typing import Any

SHEETS = ".xls", ".xlsx", ".xlsm", ".ods"
MOST_BYTES = 1 << 28  # largest content of a packed file
MISSING = (
    "it is a spreadsheet, which needs a package: pip install 'hpcwhirl[sheets]'; or "
    "save it as CSV"
)


UTF_16 = codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE


def text_of_table(data: bytes, path: Path | str) -> str:
    """Return the content of a file with a table as lines of text.

    Parameters
    ----------
    data : the content
    path : the file, whose ending tells a spreadsheet

    Raises
    ------
    ValueError
        in one line, with the reason why it cannot be read
    """
    if Path(path).suffix.lower() in SHEETS:
        return lines_of_sheet(data)
    if data.startswith(UTF_16) and len(data) % 2 == 0:  # "Unicode text" of Excel
        return data.decode("utf-16", "replace")
    return utf_8(data)


def utf_8(data: bytes) -> str:
    """Return a file's content as text; ValueError, with the line, if not UTF-8."""
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as failed:
        line = 1 + failed.object.count(b"\n", 0, failed.start)
        msg = f"line {line} is not UTF-8: save the file as UTF-8"
        raise ValueError(msg) from None


def lines_of_sheet(data: bytes) -> str:
    """Return the first sheet of a spreadsheet as lines of cells separated by tabs.

    data : content of the file

    Raises
    ------
    ValueError
        in one line, if it is no spreadsheet, is too large, or the library is missing
    """
    try:
        from python_calamine import CalamineError, CalamineWorkbook
    except ImportError:
        raise ValueError(MISSING) from None
    try:
        _check_size(data)
        sheet = CalamineWorkbook.from_filelike(io.BytesIO(data)).get_sheet_by_index(0)
        rows = sheet.to_python(skip_empty_area=False)
    except (CalamineError, zipfile.BadZipFile, OSError):
        raise ValueError("it is no spreadsheet that can be read") from None
    return "".join("\t".join(map(_text, row)) + "\n" for row in rows)


def _check_size(data: bytes) -> None:
    """Raise ValueError for a packed file whose content would fill the memory."""
    if data[:2] != b"PK":  # .xls is not packed
        return
    size = sum(part.file_size for part in zipfile.ZipFile(io.BytesIO(data)).infolist())
    if size > MOST_BYTES:
        raise ValueError(
            f"it must have at most {MOST_BYTES} bytes unpacked, got {size}"
        )


def _text(cell: Any) -> str:
    """Return a cell as text; a whole number as Excel shows it, without a point."""
    if isinstance(cell, float) and cell.is_integer() and abs(cell) < 1e15:
        return str(int(cell))
    return " ".join(str(cell).split())
