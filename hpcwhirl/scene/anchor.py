"""Where a file lies that an input names."""

from __future__ import annotations

from pathlib import Path

from hpcwhirl.errors import shown


def anchored(file: str, folder: Path | str = "") -> str:
    """Return the absolute path of a file named from `folder`; "" stays "".

    Raises
    ------
    ValueError
        where no file can have such a name, or it cannot be stored as text
    """
    if not file:
        return ""
    try:
        path = str((Path(folder) / file).resolve())
        path.encode()  # results keep it
    except UnicodeEncodeError:
        msg = f"a path must be UTF-8, got {shown(file)}"
        raise ValueError(msg) from None
    except (OSError, RuntimeError, ValueError) as failed:  # a loop, NUL, no directory
        msg = f"no file can be named {shown(file)}: {failed}"
        raise ValueError(msg) from None
    return path
