"""HDF5 files: write them safely on a full disk, read damaged ones, store quantities.

HDF5 writes much of a file when its objects are closed, possibly by the garbage
collector. A failure there is not reported: the library keeps the object, tries again at
the end of the process, and crashes. So failures are hidden from it: every write
pretends to succeed, and the first error is raised after the file, useless by then, is
closed.
"""

from __future__ import annotations

import io
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from hpcwhirl.errors import (
    MissingFileError,
    StoreError,
    WhirlError,
    unknown,
    unreadable,
    unwritable,
)
from hpcwhirl.scene.quantities import ARRAYS, AXES
from hpcwhirl.scene.units import Quantity
from hpcwhirl.scene.words import ENUMS
from hpcwhirl.store.atomic import make_folders, replacing

DAMAGE = (OSError, RuntimeError, LookupError, TypeError, ValueError, AttributeError)
FORMAT = 5
Arrays = Mapping[str, NDArray[Any]]


def utf8(text: str) -> NDArray[np.bytes_]:
    """Return a text as an HDF5 attribute stores it: of fixed length, in UTF-8.

    NetCDF, h5netcdf and h5py read such text, and parallel HDF5 can write it.
    """
    data = text.encode()
    return np.array(data, dtype=h5py.string_dtype("utf-8", max(len(data), 1)))


class _Patient(io.FileIO):
    """File whose writes seem to succeed, so that HDF5 does not crash on a full disk.

    `failed` keeps the first error.
    """

    failed: OSError | None = None

    def write(self, data: Any) -> int:
        """Write bytes; keep an error in `failed`. Return how many were given."""
        left = memoryview(data).cast("B")
        size = len(left)
        try:
            while left and self.failed is None:
                left = left[super().write(left) :]
        except OSError as failed:
            self.failed = failed
        return size

    def truncate(self, size: int | None = None) -> int:
        """Set the size of the file; keep an error in `failed`. Return the size."""
        try:
            return super().truncate(size)
        except OSError as failed:
            self.failed = self.failed or failed
            return size or 0


@contextmanager
def writing(path: Path, mode: str = "w", **options: Any) -> Iterator[h5py.File]:
    """Open an HDF5 file for writing in the block; flush and close it at the end.

    Parameters
    ----------
    path : path of the file
    mode, options : arguments of `h5py.File`

    Raises
    ------
    OSError, RuntimeError
        where a write failed, as on a full disk; the file is closed and useless then
    """
    if "driver" in options:  # MPI-IO needs the path, not a Python file
        with h5py.File(path, mode, **options) as file:
            yield file
            file.flush()
        return
    with _Patient(path, "w+" if mode == "w" else "r+") as disk:
        try:
            with h5py.File(disk, mode, **options) as file:
                yield file
                file.flush()
        finally:
            if disk.failed is not None:  # the cause of whatever the library reports
                raise disk.failed


@contextmanager
def reading(path: Path) -> Iterator[None]:
    """Turn an error of the block, which reads a damaged file, into a one-line message.

    path : path of the file, for the message

    Raises
    ------
    StoreError, MissingFileError
        naming the file; the latter if the user may not read it
    """
    try:
        yield
    except WhirlError:
        raise
    except PermissionError as failed:
        raise unreadable(path, failed) from None
    except DAMAGE as failed:
        said = str(failed).splitlines()
        why = said[0] if said else type(failed).__name__
        raise StoreError(f"{path} is damaged: {why}") from None


def refusal(path: Path, failed: Exception) -> MissingFileError:
    """Return the one-line error to raise for an HDF5 file that could not be written.

    Parameters
    ----------
    path : path of the file
    failed : what HDF5 has raised; its causes are searched for the system's error
    """
    chain: list[BaseException] = [failed]
    while (before := chain[-1].__cause__ or chain[-1].__context__) is not None:
        chain.append(before)
    number = next(filter(None, map(_number, chain)), 0)
    why = os.strerror(number) if number else str(failed).splitlines()[0]
    return unwritable(f"cannot write {path}: {why}", number)


def _number(failed: BaseException) -> int:
    """Return the errno (system's error number) of an exception; 0: it has none.

    HDF5 gives it only in the text of its exceptions.
    """
    found = re.search(r"errno = (\d+)", str(failed))
    return getattr(failed, "errno", None) or (int(found[1]) if found else 0)


def dtype(quantity: Quantity) -> np.dtype[Any]:
    """Return the NumPy dtype in which results.h5 stores a variable."""
    return np.dtype("i1" if quantity.kind == "enum" else quantity.kind)


def missing(quantity: Quantity) -> float | int | bytes:
    """Return what a variable in results.h5 holds for a case without a value."""
    empty: dict[str, float | int | bytes] = {"f8": np.nan, "i8": -1, "enum": 0}
    return empty.get(quantity.kind, b"")


def encode(name: str, quantity: Quantity, value: float | str) -> float | int | bytes:
    """Return a value of the variable `name` in the form in which results.h5 stores it.

    A word is stored as its code, its index in the variable's list of words; a word that
    is not in the list is refused. A text is cut to the variable's length.
    """
    if quantity.kind == "enum":
        if value not in ENUMS[name]:
            raise unknown(name, str(value), ENUMS[name])
        return ENUMS[name].index(str(value))
    if quantity.kind.startswith("S"):
        cut = str(value).encode()[: dtype(quantity).itemsize]
        return cut.decode(errors="ignore").encode()  # drops a truncated character
    return float(value) if quantity.kind == "f8" else int(value)


def hdf5_facts() -> dict[str, Any]:
    """Return facts on HDF5 for `doctor`: versions, whether it is parallel, locks."""
    return {
        "h5py": h5py.version.version,
        "hdf5": h5py.version.hdf5_version,
        "mpi_io": bool(h5py.get_config().mpi),
        "locking": os.environ.get("HDF5_USE_FILE_LOCKING", ""),
    }


def mpi_libraries() -> list[str]:
    """Return the paths of the MPI libraries that this process has loaded.

    More than one means that h5py was built for another MPI than mpi4py.
    """
    try:
        lines = Path("/proc/self/maps").read_text(encoding="utf-8").splitlines()
    except OSError:
        return []
    paths = {line.split(maxsplit=5)[5] for line in lines if len(line.split()) > 5}
    named = (
        path for path in paths if Path(path).name.startswith(("libmpi.", "libmpich."))
    )
    return sorted({os.path.realpath(path) for path in named})


def tell(data: h5py.Dataset, quantity: Quantity) -> None:
    """Write unit and meaning of a variable as its attributes `units` and `long_name`.

    Parameters
    ----------
    data : the variable in the file
    quantity : its unit and meaning
    """
    data.attrs["units"] = utf8(quantity.unit)
    data.attrs["long_name"] = utf8(quantity.meaning)


def mark_words(data: h5py.Dataset, words: Sequence[str]) -> None:
    """Write which word each code of a variable means, as attributes of the variable.

    The attributes are `flag_values` and `flag_meanings`, as CF conventions have them.

    Parameters
    ----------
    data : the variable in the file
    words : the word of each code 0, 1, ...
    """
    data.attrs["flag_values"] = np.arange(len(words), dtype="i1")
    data.attrs["flag_meanings"] = utf8(" ".join(words))


def define_axis(group: h5py.Group, name: str, values: NDArray[Any] | int) -> None:
    """Create an axis (HDF5 dimension scale) in a group of a file.

    Parameters
    ----------
    group : the group
    name : name of the axis
    values : the values along it, or its size: the values are then 0, 1, ...
    """
    if isinstance(values, int):
        values = np.arange(values, dtype="i8")
    axis = group.create_dataset(name, data=values)
    tell(axis, AXES[name])
    axis.make_scale(name)


def write_arrays(path: Path, arrays: Arrays, facts: Mapping[str, Any]) -> None:
    """Write an HDF5 file of arrays, such as an engine's, each with unit and meaning.

    Parameters
    ----------
    path : file to write; on failure an older file stays
    arrays : {path in the file such as `rotor/mass`: array}; `scene.quantities.ARRAYS`
        has unit and meaning under the last part of the path
    facts : {attribute: text or number}, attributes of the file
    """
    try:
        make_folders(path.parent)
        with replacing(path) as part, writing(part) as file:
            for name, array in arrays.items():
                told = ARRAYS[name.rpartition("/")[2]]
                data = file.create_dataset(name, data=array)
                # not by `tell`: the digests of cases with an engine's file are those of
                # its bytes, see `scene.case_digest.content_digest`
                data.attrs["units"], data.attrs["long_name"] = told.unit, told.meaning
            for name, value in facts.items():
                file.attrs[name] = value
    except (OSError, RuntimeError) as failed:  # HDF5 raises either, with many lines
        raise refusal(path, failed) from None
