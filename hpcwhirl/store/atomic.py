"""Replace files as a whole: write a temporary file, then rename it to its final name.

So a reader sees the old content or the new one, never a part of it. A file system
stores names separately from contents: after a crash of the machine, a synced file is
certain to exist only if its directory has been synced, too.
"""

from __future__ import annotations

import errno
import fcntl
import os
import re
import time
import uuid
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext, suppress
from pathlib import Path

from hpcwhirl.errors import WhirlError, unwritable
from hpcwhirl.safe_open import open_regular

NEW = os.O_CREAT | os.O_EXCL | os.O_WRONLY | os.O_NOFOLLOW | os.O_CLOEXEC
Check = Callable[[], None]
Say = Callable[[str], None]  # prints one line
YOUNG = 2.0  # s, age from which a file being written is certain to be locked
LONGEST = 200  # largest number of bytes of a file's name in its temporary name
# Pattern of temporary names, including those of older versions.
PART = re.compile(r".*\.[0-9a-f]{32}\.part|results\.h5\.part(-\d+)?", re.DOTALL)


def part_of(path: Path) -> Path:
    """Make an empty temporary file in the folder of `path`, and return its path.

    Its name is new, so that no existing file or link is written to.
    """
    stem = os.fsdecode(os.fsencode(path.name)[:LONGEST])
    part = path.with_name(f"{stem}.{uuid.uuid4().hex}.part")
    handle = os.open(part, NEW, 0o666)
    try:
        os.close(handle)
    except OSError:  # a file server may report here that it is full
        with suppress(OSError):
            part.unlink()
        raise
    return part


def anyone() -> None:
    """Do nothing: the default `check` of `publish`, so that any process may publish."""


def keep_names(folder: Path) -> None:
    """Sync a directory to disk, so that changes of names in it survive a crash.

    Raises
    ------
    OSError
        if syncing fails; no error on a file system that cannot sync directories
    """
    handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        os.fsync(handle)
    except OSError as failed:
        if failed.errno not in (errno.EINVAL, errno.ENOTSUP):
            raise
    finally:
        os.close(handle)


def make_folders(folder: Path, *, parents: bool = True) -> None:
    """Make a directory and its missing parents, and sync them to survive a crash.

    Parameters
    ----------
    folder : the directory
    parents : whether missing parents are made, too

    Raises
    ------
    OSError
        where one of the directories cannot be made
    """
    missing = [place for place in (folder, *folder.parents) if not place.exists()]
    folder.mkdir(parents=parents, exist_ok=True)
    for place in missing:
        keep_names(place.parent)


@contextmanager
def telling(what: Path | str) -> Iterator[None]:
    """Turn an OSError of the block, which writes a file, into a one-line message.

    Parameters
    ----------
    what : the file, or "in DIRECTORY", for the message

    Raises
    ------
    MissingFileError
        if the block raises OSError; its subclass `NoRoomError` for a temporary cause
    """
    try:
        yield
    except WhirlError:
        raise
    except OSError as failed:
        msg = f"cannot write {what}: {failed.strerror or failed}"
        raise unwritable(msg, failed) from None


@contextmanager
def replacing(
    path: Path, check: Check = anyone, *, held: bool = False
) -> Iterator[Path]:
    """Yield a temporary file to write; it replaces `path` if the block succeeds.

    Parameters
    ----------
    path : file to replace
    check : called before the renaming; raises if another process has taken over
    held : whether the temporary file is locked inside the block, so that `sweep_idle`
        in another process does not remove it
    """
    part = part_of(path)
    try:
        with part.open("rb") if held else nullcontext() as file:
            if file is not None:
                with suppress(OSError):  # no locks: `sweep_idle` leaves the file, too
                    fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
            yield part
            publish(part, path, check)
    finally:
        with suppress(OSError):
            part.unlink(missing_ok=True)


def publish(part: Path, path: Path, check: Check = anyone) -> None:
    """Sync a temporary file to disk and rename it to its final path.

    Parameters
    ----------
    part, path : the temporary file, and its final path
    check : called right before the renaming; raises if another process has taken over,
        so that this one must not write any more
    """
    try:
        with part.open("rb+") as file:
            os.fsync(file.fileno())
        check()
        part.replace(path)
        keep_names(path.parent)
    except FileNotFoundError:  # the process that took over has removed it
        check()
        raise


def write_whole(
    path: Path,
    data: bytes,
    check: Check = anyone,
    *,
    held: bool = False,
    parents: bool = True,
) -> None:
    """Replace the content of a file, synced; several processes may do so at once.

    Parameters
    ----------
    path, data : the file and its new content
    check : called before the renaming; raises if another process has taken over
    held : whether the temporary file is locked meanwhile, see `replacing`
    parents : whether missing parents of the file's folder are made; False for a file in
        a folder of a campaign's directory, which may have been moved meanwhile

    Raises
    ------
    MissingFileError
        where the file cannot be written; the former content stays
    """
    with telling(path):
        make_folders(path.parent, parents=parents)
        with replacing(path, check, held=held) as part:
            part.write_bytes(data)


def _parts_in(folder: Path, stem: str) -> Iterator[os.DirEntry[str]]:
    """Yield those files of a directory that have names of temporary files.

    stem : beginning of their names
    """
    with suppress(OSError), os.scandir(folder) as found:
        for item in found:
            if item.name.startswith(stem) and PART.fullmatch(item.name):
                yield item


def sweep_idle(folder: Path, stem: str) -> None:
    """Remove temporary files of a directory that no living process is writing.

    A process that writes one holds a lock on it, see `replacing`.

    Parameters
    ----------
    folder : the directory
    stem : beginning of the names of the files
    """
    for item in _parts_in(folder, stem):
        with suppress(OSError):
            _remove_idle(item)


def _remove_idle(item: os.DirEntry[str]) -> None:
    """Remove a temporary file unless it is younger than `YOUNG` s or locked.

    item : entry of the file in its directory

    Raises
    ------
    OSError
        where a process has a lock on the file
    """
    if time.time() - item.stat(follow_symlinks=False).st_mtime < YOUNG:
        return
    with open_regular(Path(item.path), "r+b") as file:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        os.unlink(item.path)  # noqa: PTH108 - its name may be odd


def sweep(folder: Path, stem: str = "", older: float = float("inf")) -> None:
    """Remove temporary files that dead processes have left in a directory.

    Parameters
    ----------
    folder : directory in which files are removed, not in its subdirectories
    stem : beginning of the names of these files
    older : remove only files last written before this time, s since 1970 by the clock
        of the file system
    """
    for item in _parts_in(folder, stem):
        with suppress(OSError):
            if item.stat(follow_symlinks=False).st_mtime < older:
                os.unlink(item.path)  # noqa: PTH108 - its name may be odd
