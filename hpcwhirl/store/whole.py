"""Small files, replaced whole or not at all."""

from __future__ import annotations

import os
import uuid
from contextlib import suppress
from pathlib import Path

from hpcwhirl.errors import MissingFileError


def write_whole(path: Path, data: bytes) -> None:
    """Put data, synced, in place of what the file held; several may do so at once.

    Raises
    ------
    MissingFileError
        where it cannot be written; what the file held before stays
    """
    part = path.with_name(f"{path.name}.{uuid.uuid4().hex}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with part.open("wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        part.replace(path)
    except OSError as failed:
        with suppress(OSError):
            part.unlink(missing_ok=True)
        msg = f"cannot write {path}: {failed.strerror}"
        raise MissingFileError(msg) from None
