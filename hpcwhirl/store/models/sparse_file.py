"""Read a large sparse matrix that a finite-element code has written; no mechanics.

NAME.mtx         MatrixMarket, real or integer, general or symmetric
NAME.npz         written by scipy.sparse.save_npz, CSR or CSC; nothing is unpickled
NAME.mas, .sti   lines "row column value" of one triangle, from 1, by CalculiX; a file
                 NAME.dof beside it has what each row is, as "node.direction"
NAME.h5, .hdf5   CSR in a group named like the matrix, `mass` or `stiffness`: data,
                 indices, indptr, indices from 0; all in this one file

Sizes and types are checked before anything is read.
"""

from __future__ import annotations

import math
import os
import resource
import zipfile
import zlib
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from hpcwhirl.errors import InputError
from hpcwhirl.safe_open import check_regular, open_regular
from hpcwhirl.store.models.engine_file import Given, check_chunks, check_link, readable

Array = NDArray[Any]
MOST_BYTES = 1 << 34  # largest size of a file
MOST_UNKNOWNS = 10_000_000
MOST_ENTRIES = 300_000_000  # 3.6 GB, and indices fit into 32 bits
MEMORY = 3  # ratio of the memory that symmetrising a matrix takes to that of its arrays
MARKET_BYTES = 16  # bytes in memory of an entry of MatrixMarket: row, column, number
TRIPLET = 24  # bytes of a line "row column value", about
CALCULIX = ".mas", ".sti"
SHORTEST = 2  # least bytes of an entry as text: a digit and a separator
SYMMETRIC = 1e-9  # largest asymmetry, relative to the largest entry
SKEW = {"coriolis"}
PARTS = {"data": "iuf", "indices": "iu", "indptr": "iu"}
UNREADABLE = (
    OSError, RuntimeError, LookupError, TypeError, ValueError, ArithmeticError,
    EOFError, MemoryError, zipfile.BadZipFile, zlib.error,
)  # fmt: skip


class _Source(Given):
    """A matrix and its file; its methods return errors that name both.

    `group` is the name of the matrix, such as "mass".
    """

    def refusal(self, told: str) -> InputError:
        """Return the InputError "FILE TOLD", for a file that is refused.

        told : the rest of the message, such as "has no ..."
        """
        return InputError(f"{self.file} {told}")

    def wrong(self, name: str, allowed: str, got: object) -> InputError:
        """Return the InputError for an array of the matrix that breaks a rule.

        Parameters
        ----------
        name : name of the array; "" for the matrix itself
        allowed : what it must do, as text after "must", such as "be square"
        got : what the file has instead
        """
        own = f"{self.group}/{name}" if name else self.group
        return self.refusal(f"({own}) must {allowed}, got {got}")


def read_matrix(path: Path, name: str) -> sparse.csr_array:
    """Read a square sparse matrix (n, n) of n DoF, such as a mass matrix, from a file.

    It is finite, real, and symmetric or skew, with all entries stored.

    Parameters
    ----------
    path : file that ends in .mtx, .npz, .mas, .sti, .h5 or .hdf5
    name : `mass`, `stiffness`, ...; `coriolis` must be skew, all others symmetric

    Raises
    ------
    MissingFileError
        where the file cannot be read in the format of its ending
    InputError
        where the file holds no such matrix
    """
    source = _Source(str(path), {}, name)
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        raise source.wrong("", f"end in {', '.join(READERS)}", path.suffix or "none")
    with readable(str(path), UNREADABLE):
        matrix = reader(source, _bytes_of(source))
    return _checked(source, matrix)


def _bytes_of(source: _Source) -> int:
    """Return the size of a matrix's file in bytes; refuse a file that is too large."""
    size = check_regular(Path(source.file))
    if size > MOST_BYTES:
        raise source.wrong("", f"have at most {MOST_BYTES} bytes", size)
    return size


def read_vector(path: Path, name: str, size: int) -> Array:
    """Read a vector (size,), such as a load, from a MatrixMarket file with one column.

    Parameters
    ----------
    path, name : the file; name of the vector, for messages
    size : number of entries that it must have

    Raises
    ------
    MissingFileError, InputError
        as `read_matrix`
    """
    return np.asarray(_rectangle(path, name, (size, 1)).toarray().ravel())


def read_rows(path: Path, name: str, columns: int) -> sparse.csr_array:
    """Read a matrix (rows, columns), such as stress rows, from a MatrixMarket file.

    Parameters
    ----------
    path, name : the file; name of the matrix, for messages
    columns : number of columns that it must have

    Raises
    ------
    MissingFileError, InputError
        as `read_matrix`
    """
    return _rectangle(path, name, (None, columns))


def _rectangle(
    path: Path, name: str, shape: tuple[int | None, int]
) -> sparse.csr_array:
    """Read a finite real matrix of given shape from a MatrixMarket file.

    Parameters
    ----------
    path, name : the file; name of the matrix, for messages
    shape : rows and columns that the matrix must have; rows None: any number
    """
    from scipy.io import mminfo

    source = _Source(str(path), {}, name)
    if path.suffix.lower() != ".mtx":
        raise source.wrong("", "end in .mtx", path.suffix or "none")
    with readable(str(path), UNREADABLE):
        size = _bytes_of(source)
        rows, columns, entries, _, field, _ = mminfo(source.file)
        fits = columns == shape[1] and rows == (rows if shape[0] is None else shape[0])
        if not fits or field not in {"real", "integer"}:
            told = f"{rows} x {columns}, {field}"
            wanted = "any" if shape[0] is None else shape[0]
            raise source.wrong("", f"be real, {wanted} x {shape[1]}", told)
        found = _read_entries(source, entries, size)
    if not np.isfinite(found.data).all():
        wrong = found.data[~np.isfinite(found.data)][0]
        raise source.wrong("", "be finite", wrong)
    return found


def _market(source: _Source, size: int) -> sparse.csr_array:
    from scipy.io import mminfo

    # By path (of a regular file), since SciPy 1.17 aborts on a Python stream.
    rows, columns, entries, _, field, symmetry = mminfo(source.file)
    if field not in {"real", "integer"}:
        raise source.wrong("", "be real", field)
    own = "skew-symmetric" if source.group in SKEW else "symmetric"
    if symmetry not in {"general", own}:
        raise source.wrong("", f"be {own}", symmetry)
    _check_square(source, (rows, columns))
    return _read_entries(source, entries, size)


def _read_entries(source: _Source, entries: int, size: int) -> sparse.csr_array:
    """Read a MatrixMarket file; refuse impossible or too many entries before reading.

    Parameters
    ----------
    source : the matrix
    entries : number of entries that the file's header states
    size : size of the file, bytes
    """
    from scipy.io import mmread

    _check_entries(source, "", entries, size // SHORTEST)
    _check_memory(source, MARKET_BYTES * entries)
    return sparse.csr_array(mmread(source.file), dtype=np.float64)


def _numpy(source: _Source, _size: int) -> sparse.csr_array:
    names, bytes_told = [*PARTS, "shape", "format"], 0
    with open_regular(source.file) as file, zipfile.ZipFile(file) as archive:
        for part in names:
            if f"{part}.npy" not in archive.namelist():
                told = "was not written by scipy.sparse.save_npz in CSR or CSC"
                raise source.refusal(f"has no {part}: it {told}")
            kinds = PARTS.get(part, "iu" if part == "shape" else "SU")
            shape, kind = _header(archive, part)
            _check_part(source, part, shape, kind, kinds)
            bytes_told += math.prod(shape) * kind.itemsize
        _check_memory(source, bytes_told)
        file.seek(0)
        with np.load(file, allow_pickle=False) as held:
            arrays = {part: held[part] for part in names}
    kind = arrays["format"].item()
    if kind not in {"csr", b"csr", "csc", b"csc"}:
        raise source.wrong("", "be CSR or CSC", kind)
    shape = tuple(arrays["shape"].tolist())
    _check_square(source, shape)
    if len(arrays["indptr"]) != shape[0] + 1:
        allowed = f"have {shape[0] + 1} entries, as its shape requires"
        raise source.wrong("indptr", allowed, len(arrays["indptr"]))
    matrix = _compressed(source, arrays)
    return matrix if kind in {"csr", b"csr"} else sparse.csr_array(matrix.T)


def _header(archive: zipfile.ZipFile, part: str) -> tuple[tuple[int, ...], Any]:
    """Return (shape, dtype) of an array in a .npz file, without reading its numbers.

    An array that is cut short is refused.

    Parameters
    ----------
    archive : the .npz file
    part : name of the array
    """
    member = archive.getinfo(f"{part}.npy")
    with archive.open(member) as file:
        version = np.lib.format.read_magic(file)
        read = np.lib.format.read_array_header_1_0
        if version != (1, 0):
            read = np.lib.format.read_array_header_2_0
        shape, _, kind = read(file)
    if int(np.prod(shape, dtype=object)) * kind.itemsize > member.file_size:
        raise ValueError(f"{part} is cut short")
    return shape, kind


def _hdf5(source: _Source, _size: int) -> sparse.csr_array:
    import h5py

    name = source.group
    with open_regular(source.file) as file, h5py.File(file, "r") as root:
        if name not in root:
            raise source.refusal(f"has no group {name} with data, indices, indptr")
        check_link(source, root, name, "")
        group = root[name]
        if not isinstance(group, h5py.Group):
            raise source.wrong("", "be a group", "an array")
        for part in PARTS:
            _check_dataset(source, group, part)
        sizes = (group[part].size * group[part].dtype.itemsize for part in PARTS)
        _check_memory(source, sum(sizes))
        arrays = {part: group[part][()] for part in PARTS}
    return _compressed(source, arrays)


def _check_dataset(source: _Source, group: Any, part: str) -> None:
    if part not in group:
        raise source.refusal(f"has no {source.group}/{part}")
    check_link(source, group, part, f"{source.group}/")
    data = group[part]
    shape = getattr(data, "shape", None)
    if shape is None:
        raise source.wrong(part, "be an array", "none")
    _check_part(source, part, shape, data.dtype, PARTS[part])
    if data.chunks:
        check_chunks(source, part, data)


def _triplets(source: _Source, size: int) -> sparse.csr_array:
    """Read the lines "row column value", from 1, that CalculiX writes."""
    _check_memory(source, (size // TRIPLET + 1) * 2 * MARKET_BYTES)
    with open_regular(source.file) as file:
        lines = np.loadtxt(file, dtype=np.float64, ndmin=2)
    if lines.shape[1] != 3 or not len(lines):
        raise source.wrong("", "have lines of row, column, value", lines.shape)
    places = lines[:, :2].astype(np.int64) - 1
    if (places != lines[:, :2] - 1).any() or places.min() < 0:
        raise source.wrong(
            "", "have whole numbers from 1 on as rows and columns", "others"
        )
    count = max(int(places.max()) + 1, len(row_names(Path(source.file))))
    _check_square(source, (count, count))
    own = sparse.coo_array((lines[:, 2], tuple(places.T)), shape=(count, count))
    half = sparse.csr_array(own)
    if sparse.triu(half, 1).nnz and sparse.tril(half, -1).nnz:
        return half  # whole; it is checked for symmetry
    return sparse.csr_array(half + half.T - sparse.diags_array(half.diagonal()))


def row_names(path: Path) -> dict[str, int]:
    """Return {"node.direction": row, from 0} from the .dof beside CalculiX's matrix.

    It is empty where there is no such file, or the matrix is not CalculiX's.

    path : file of the matrix
    """
    beside = path.with_suffix(".dof")
    if path.suffix.lower() not in CALCULIX or not beside.is_file():
        return {}
    with readable(str(beside), UNREADABLE):
        check_regular(beside)
        names = beside.read_text("ascii").split()
    return {name: row for row, name in enumerate(names)}


READERS = {
    ".mtx": _market, ".npz": _numpy, ".mas": _triplets, ".sti": _triplets,
    ".h5": _hdf5, ".hdf5": _hdf5,
}  # fmt: skip


def _check_part(
    source: _Source, part: str, shape: tuple[int, ...], kind: Any, kinds: str
) -> None:
    """Raise InputError for an array of a sparse matrix with wrong dimensions or type.

    It is called before the array is read.

    Parameters
    ----------
    source, part : the matrix; name of the array
    shape, kind : shape and dtype of the array
    kinds : letters of the kinds of dtype that are allowed
    """
    if kind.kind not in kinds:
        wanted = "be real" if "f" in kinds else "hold whole numbers"
        raise source.wrong(part, wanted, "complex" if kind.kind == "c" else kind)
    if len(shape) != (0 if "S" in kinds else 1):
        raise source.wrong(part, "be a list", f"{len(shape)} dimensions")
    _check_entries(source, part, *shape)


def _check_square(source: _Source, shape: tuple[int, ...]) -> None:
    if len(shape) != 2 or shape[0] != shape[1]:
        raise source.wrong("", "be square", shape)
    if not 1 <= shape[0] <= MOST_UNKNOWNS:
        allowed = f"have 1 to {MOST_UNKNOWNS} degrees of freedom"
        raise source.wrong("", allowed, shape[0])


def _check_entries(
    source: _Source, part: str, count: int = 0, most: int = MOST_ENTRIES
) -> None:
    if count > MOST_ENTRIES:
        raise source.wrong(part, f"have at most {MOST_ENTRIES} entries", count)
    if count > most:
        raise source.refusal(f"is cut short: it is too small for {count} entries")


def _check_memory(source: _Source, size: int) -> None:
    """Raise InputError for a matrix whose arrays need more than the free memory.

    Parameters
    ----------
    source, size : the matrix; bytes that its arrays need
    """
    most = _free_memory() / MEMORY
    if size > most:
        allowed = f"have arrays of at most {most / 1e9:.2g} GB, 1/{MEMORY} of the "
        raise source.wrong("", f"{allowed}memory that is free", f"{size / 1e9:.2g} GB")


def _free_memory() -> float:
    """Return how many bytes of memory this process may still allocate."""
    page = resource.getpagesize()
    free = float(os.sysconf("SC_AVPHYS_PAGES") * page)
    with suppress(OSError):  # Linux: including caches that it can free
        told = Path("/proc/meminfo").read_text().split()
        free = 1024.0 * int(told[told.index("MemAvailable:") + 1])
        taken = int(Path("/proc/self/statm").read_text().split()[0]) * page
        most = resource.getrlimit(resource.RLIMIT_AS)[0]
        if most != resource.RLIM_INFINITY:
            free = min(free, float(most - taken))
    return free


def _compressed(source: _Source, arrays: Mapping[str, Array]) -> sparse.csr_array:
    """Return the sparse matrix of the arrays data, indices and indptr in CSR form.

    Of arrays in CSC form, it is the transpose.

    Parameters
    ----------
    source : the matrix, for messages
    arrays : {"data", "indices", "indptr": array}
    """
    size = len(arrays["indptr"]) - 1
    _check_square(source, (size, size))
    parts = tuple(arrays[part] for part in PARTS)
    matrix = sparse.csr_array(parts, shape=(size, size), dtype=np.float64)
    matrix.check_format(full_check=True)  # indices out of range crash SciPy
    return matrix


def _checked(source: _Source, matrix: sparse.csr_array) -> sparse.csr_array:
    """Return the exactly symmetric (or skew) part of a matrix, without its round-off.

    Parameters
    ----------
    source, matrix : the matrix's file; (n, n), as read

    Raises
    ------
    InputError
        where the matrix is not symmetric (or skew) to `SYMMETRIC`, zero, or not finite
    """
    matrix.sum_duplicates()
    wrong = ~np.isfinite(matrix.data)
    if wrong.any():
        raise source.wrong("", "be finite", matrix.data[wrong][0])
    largest = np.abs(matrix.data).max(initial=0.0)
    if not largest > 0:
        raise source.wrong("", "have an entry that is not 0", "none")
    sign, kind = (-1.0, "skew") if source.group in SKEW else (1.0, "symmetric")
    miss = np.abs((matrix - sign * matrix.T).data).max(initial=0.0) / largest
    if not miss <= SYMMETRIC:
        half = sparse.triu(matrix, 1).nnz * sparse.tril(matrix, -1).nnz == 0
        hint = ": the file has only one triangle; write both" if half else ""
        allowed = f"be {kind} to {SYMMETRIC:g} of its largest entry"
        raise source.wrong("", allowed, f"{miss:.2g}{hint}")
    matrix = (matrix + sign * matrix.T) / 2
    places = (part.astype(np.int32) for part in (matrix.indices, matrix.indptr))
    return sparse.csr_array((matrix.data, *places), shape=matrix.shape)
