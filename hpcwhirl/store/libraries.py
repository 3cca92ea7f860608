"""Versions of HDF5, and the MPI libraries loaded into this process."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import h5py


def hdf5_facts() -> dict[str, Any]:
    """Return the versions of h5py and HDF5, and how HDF5 is built and locks files."""
    return {
        "h5py": h5py.version.version,
        "hdf5": h5py.version.hdf5_version,
        "mpi_io": bool(h5py.get_config().mpi),
        "locking": os.environ.get("HDF5_USE_FILE_LOCKING", ""),
    }


def mpi_libraries() -> list[str]:
    """Return the real paths of the MPI libraries mapped into this process."""
    try:
        lines = Path("/proc/self/maps").read_text(encoding="utf-8").splitlines()
    except OSError:
        return []
    paths = {line.split(maxsplit=5)[5] for line in lines if len(line.split()) > 5}
    named = (
        path for path in paths if Path(path).name.startswith(("libmpi.", "libmpich."))
    )
    return sorted({os.path.realpath(path) for path in named})
