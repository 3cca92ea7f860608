"""Absolute paths of files that inputs name."""

from __future__ import annotations

from pathlib import Path

from hpcwhirl.errors import shown


def anchored(file: str, folder: Path | str = "") -> str:
    """Return the absolute path of a file whose name is relative to `folder`.

    "" stays "".

    Raises
    ------
    ValueError
        if no file can have such a name, or the path is not printable UTF-8
    """
    if not file:
        return ""
    try:
        path = str((Path(folder) / file).resolve())
        path.encode()  # results store it as UTF-8
    except UnicodeEncodeError:
        msg = f"a path must be UTF-8, got {shown(file)}"
        raise ValueError(msg) from None
    except (OSError, RuntimeError, ValueError) as failed:  # circular links, NUL
        msg = f"no file can be named {shown(file)}: {failed}"
        raise ValueError(msg) from None
    return printable(path)


def printable(text: str) -> str:
    """Return a text unchanged after checking that all its characters are printable.

    Raises
    ------
    ValueError
        if it has control or other unprintable characters
    """
    if not text.isprintable():
        msg = f"must have no control characters, got {shown(text)}"
        raise ValueError(msg)
    return text
