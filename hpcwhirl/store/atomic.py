"""Files that are replaced whole or not at all, each written under a name of its own."""

from __future__ import annotations

import os
import re
import uuid
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from hpcwhirl.errors import unwritable

NEW = os.O_CREAT | os.O_EXCL | os.O_WRONLY | os.O_NOFOLLOW | os.O_CLOEXEC
LONGEST = 200  # bytes of a file's name that its temporary one repeats
# Temporary names, those of older versions too.
PART = re.compile(r".*\.[0-9a-f]{32}\.part|results\.h5\.part(-\d+)?", re.DOTALL)


def part_of(path: Path) -> Path:
    """Make an empty file beside `path`, of this caller alone, and return it.

    Its name is new: nothing that was there, no link either, is written through.
    """
    stem = os.fsdecode(os.fsencode(path.name)[:LONGEST])
    part = path.with_name(f"{stem}.{uuid.uuid4().hex}.part")
    os.close(os.open(part, NEW, 0o666))
    return part


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Give a file that takes the place of `path` once the block has ended well."""
    part = part_of(path)
    try:
        yield part
        publish(part, path)
    finally:
        with suppress(OSError):
            part.unlink(missing_ok=True)


def publish(part: Path, path: Path) -> None:
    """Put a file, synced, in another's place."""
    with part.open("rb+") as file:
        os.fsync(file.fileno())
    part.replace(path)


def write_whole(path: Path, data: bytes) -> None:
    """Put data, synced, in place of what the file held; several may do so at once.

    Raises
    ------
    MissingFileError
        where it cannot be written; what the file held before stays
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with replacing(path) as part:
            part.write_bytes(data)
    except OSError as failed:
        msg = f"cannot write {path}: {failed.strerror}"
        raise unwritable(msg, failed) from None


def sweep(folder: Path, stem: str = "", older: float = float("inf")) -> None:
    """Remove temporary files that a process has left in a directory as it died.

    Parameters
    ----------
    folder : whose own files are looked at
    stem : what their names begin with
    older : only those last written before then, s since 1970 on its file system
    """
    with suppress(OSError), os.scandir(folder) as found:
        for item in found:
            if item.name.startswith(stem) and PART.fullmatch(item.name):
                with suppress(OSError):
                    state = item.stat(follow_symlinks=False)
                    if state.st_mtime < older:
                        os.unlink(item.path)  # noqa: PTH108 - its name may be odd
