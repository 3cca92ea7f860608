"""A march on its way as plain arrays, and whether another march may go on from them.

Any cut of a march into slices gives the same bits, and a state is all that a march
needs; so a march that takes up a snapshot ends with the bits of one that never was
interrupted, provided that it is the same march. That takes more than the same inputs:
another LAPACK may give a mode the other sign, with which the amplitudes of the
snapshot would mean another motion. A fingerprint of every number that the kernel is
given, of the kernels and of their compiler decides.
"""

from __future__ import annotations

import hashlib
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from hpcwhirl.dynamics import kernels
from hpcwhirl.dynamics.kernels import contact
from hpcwhirl.dynamics.march import March

Arrays = dict[str, NDArray[Any]]


def fingerprint(march: March) -> str:
    """Return the SHA-256 of what the kernel is called with, code included."""
    found = hashlib.sha256(f"{kernels.DIGEST} numba {numba.__version__}".encode())
    found.update(repr((march.total, march.stride, march.beat)).encode())
    _feed(found, march.scheme.arrays)
    return found.hexdigest()


def _feed(found: Any, part: Any) -> None:
    if isinstance(part, tuple):
        for item in part:
            _feed(found, item)
        return
    array = np.asarray(part)
    found.update(repr((array.dtype.str, array.shape)).encode())
    found.update(np.ascontiguousarray(array).tobytes())


def snapshot(march: March) -> Arrays:
    """Return {name: array}: `state.NAME`, `tracks.NAME` as written, `seconds`."""
    arrays = {name: array.copy() for name, array in _state(march).items()}
    for name, track in _tracks(march, march.counter).items():
        arrays[name] = track.copy()
    return arrays | {"seconds": np.array([march.seconds])}


def _state(march: March) -> Arrays:
    return {f"state.{name}": a for name, a in march.state._asdict().items()}


def _tracks(march: March, counter: NDArray[np.int64]) -> Arrays:
    """Return of each track what has been written, by a march with that counter."""
    counts = {"evidence": counter[contact.JUDGED], "closed": contact.CLOSED}
    return {  # those that are not kept have no rows
        f"tracks.{name}": own[: max(int(counts.get(name, counter[contact.SAMPLE])), 0)]
        for name, own in march.tracks._asdict().items()
    }


def restore(march: March, arrays: Arrays) -> bool:
    """Set a march that has not begun to a snapshot; return whether the arrays fit."""
    if arrays.keys() != snapshot(march).keys():
        return False
    own = _state(march)
    if not _fit(arrays, own):
        return False
    own |= _tracks(march, arrays["state.counter"])
    if not _fit(arrays, own):
        return False
    for name, array in own.items():
        array[:] = arrays[name]
    march.seconds = float(arrays["seconds"][0])
    return True


def _fit(arrays: Arrays, own: Arrays) -> bool:
    """Return whether arrays have the types and shapes of one's own."""
    pairs = [(arrays[name], mine) for name, mine in own.items()]
    return all((a.dtype, a.shape) == (mine.dtype, mine.shape) for a, mine in pairs)
