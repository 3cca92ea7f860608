"""Reading an engine's HDF5 file: which arrays it has, of which kind. No mechanics."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.errors import InputError, MissingFileError

Array = NDArray[Any]
# name: (dimensions, whether it holds indices); the layout of `export-model`
DATASETS = {
    "mass": (2, False),
    "stiffness": (2, False),
    "damping": (2, False),
    "omega": (1, False),
    "shapes": (2, False),
    "modal_tip_radial": (2, False),
    "modal_tip_tangential": (2, False),
    "modal_centre": (2, False),
    "tip_radial": (1, True),
    "tip_tangential": (1, True),
    "centre": (1, True),
}


@dataclass(frozen=True)
class Given:
    """The arrays of the group `rotor` that are there, by name."""

    file: str
    arrays: dict[str, Any]

    def __contains__(self, name: str) -> bool:
        return name in self.arrays

    def __getitem__(self, name: str) -> Array:
        if name not in self.arrays:
            raise self.refusal(
                f"has no rotor/{name}; it must hold rotor/mass, rotor/stiffness, "
                "rotor/tip_radial and rotor/tip_tangential, or rotor/omega, "
                "rotor/modal_tip_radial and rotor/modal_tip_tangential"
            )
        array: Array = self.arrays[name]
        return array

    def refusal(self, told: str) -> InputError:
        """Return the error that names the file."""
        return InputError(f"engine.file {self.file} {told}")

    def wrong(self, name: str, allowed: str, got: object) -> InputError:
        """Return the error of one array: what, allowed, got."""
        return self.refusal(f"rotor/{name} must {allowed}, got {got}")


def read_rotor(file: str) -> Given:
    """Return the arrays of an engine's file, finite and of the right kind.

    Raises
    ------
    MissingFileError
        where the file cannot be read as HDF5
    InputError
        where an array is not what the layout says
    """
    import h5py

    given = Given(file, {})
    try:
        with h5py.File(file, "r") as root:
            group = root.get("rotor")
            if not isinstance(group, h5py.Group):
                raise given.refusal("has no group rotor")
            for name in DATASETS.keys() & group.keys():
                data = group.get(name)  # None where a link leads nowhere
                dataset = isinstance(data, h5py.Dataset)
                given.arrays[name] = np.asarray(data[()]) if dataset else None
    except OSError as failed:
        reason = failed.strerror or str(failed).splitlines()[0]
        msg = f"cannot read engine.file {file}: {reason}"
        raise MissingFileError(msg) from None
    for name in DATASETS.keys() & given.arrays.keys():
        given.arrays[name] = _checked(given, name)
    return given


def _checked(given: Given, name: str) -> Array:
    """Return the array as float64 or int64."""
    dimensions, indices = DATASETS[name]
    array = given.arrays[name]
    kinds = ("iu", "whole numbers") if indices else ("iuf", "numbers")
    if not isinstance(array, np.ndarray) or array.dtype.kind not in kinds[0]:
        raise given.wrong(name, f"hold {kinds[1]}", getattr(array, "dtype", "no array"))
    if array.ndim != dimensions:
        raise given.wrong(name, f"have {dimensions} dimensions", array.ndim)
    if not np.isfinite(array).all():
        raise given.wrong(name, "be finite", array[~np.isfinite(array)][0])
    return array.astype(np.int64 if indices else np.float64)
