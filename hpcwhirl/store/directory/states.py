"""Saved states of unfinished cases, from which a later run continues them.

There is one file per case, with a checksum, replaced as a whole. Its first line
(`record.sealed`) names what the state belongs to, and name, type and shape of every
array. The arrays' bytes follow, little-endian, in that order.
"""

from __future__ import annotations

import math
import zlib
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.errors import StoreError
from hpcwhirl.safe_open import open_regular
from hpcwhirl.store.atomic import write_whole
from hpcwhirl.store.directory.journal import listed
from hpcwhirl.store.directory.record import Record, opened, sealed

Arrays = dict[str, NDArray[Any]]
FORMAT = 2
TYPES = ("<f8", "<i8")


class States:
    """The files of saved states in a campaign's directory; a digest names each case.

    folder : the campaign's directory
    """

    def __init__(self, folder: Path) -> None:
        self.folder, self.place = folder, folder / "states"

    def _path(self, digest: str) -> Path:
        return self.place / f"{digest}.state"

    def write(self, digest: str, belongs: Record, arrays: Arrays) -> None:
        """Write the saved state of a case, replacing an older one.

        Parameters
        ----------
        digest : digest of the case
        belongs : JSON object that says what the state fits, such as model and compiler;
            it must be equal when the state is read
        arrays : {name: float64 or int64 array}

        Raises
        ------
        MissingFileError
            where the state cannot be written; an older state stays
        """
        data = b"".join(np.ascontiguousarray(a).tobytes() for a in arrays.values())
        head: Record = {"format": FORMAT, "digest": digest, "belongs": belongs}
        head["arrays"] = {n: [a.dtype.str, list(a.shape)] for n, a in arrays.items()}
        head |= {"bytes": len(data), "crc": zlib.crc32(data)}
        self._replace(digest, sealed(head) + data)

    def read(self, digest: str, belongs: Record) -> Arrays | None:
        """Return {name: array} of a case's saved state; None if no state is saved.

        Parameters
        ----------
        digest : digest of the case
        belongs : what the state must fit, as it was written

        Raises
        ------
        StoreError
            where the state is damaged, or was written with another `belongs`
        """
        path = self._path(digest)
        try:
            with open_regular(path) as file:
                head, data = opened(file.readline()), file.read()
        except FileNotFoundError:
            return None
        except OSError as failed:
            raise StoreError(f"cannot read {path}: {failed.strerror}") from None
        try:
            return _arrays(head, data, {"format": FORMAT, "digest": digest, **belongs})
        except (KeyError, TypeError, ValueError) as failed:
            raise StoreError(f"{path} is not usable: {failed}") from None

    def hand_over(self, digest: str, after: str) -> bool:
        """Copy the saved state of one case for another that is a longer run of it.

        Parameters
        ----------
        digest : digest of the case that has the state
        after : digest of the longer run, which will continue from it

        Returns
        -------
        whether an undamaged state was found

        Raises
        ------
        MissingFileError
            where the copy cannot be written
        """
        try:
            with open_regular(self._path(digest)) as file:
                head, data = opened(file.readline()), file.read()
            _arrays(head, data, {"format": FORMAT, "digest": digest})
        except (OSError, KeyError, TypeError, ValueError):
            return False
        self._replace(after, sealed({**(head or {}), "digest": after}) + data)
        return True

    def _replace(self, digest: str, content: bytes) -> None:
        write_whole(self._path(digest), content, parents=False)

    def drop(self, digest: str) -> None:
        """Remove the saved state of a case, if there is one."""
        with suppress(OSError):  # a state left behind does no harm
            self._path(digest).unlink()

    def names(self) -> set[str]:
        """Return the digests of all cases with a saved state."""
        return {path.stem for path in listed(self.place, ".state")}


def _arrays(head: Record | None, data: bytes, belongs: Record) -> Arrays:
    """Return {name: array} of a saved state; raise if it is damaged or does not fit.

    Parameters
    ----------
    head : parsed first line of the state's file, None if damaged
    data : the other bytes of the file
    belongs : what the state must fit
    """
    if head is None or len(data) != head["bytes"] or zlib.crc32(data) != head["crc"]:
        raise ValueError("it is damaged")
    for name, value in belongs.items():
        if (head | head["belongs"]).get(name) != value:
            raise ValueError(f"it belongs to another {name}")
    out, start = {}, 0
    for name, (kind, shape) in head["arrays"].items():
        if kind not in TYPES:
            raise ValueError(f"an array must be {' or '.join(TYPES)}, got {kind}")
        count = math.prod(shape)
        out[name] = np.frombuffer(data, kind, count, start).reshape(shape)
        start += 8 * count
    return out
