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
    """Return {name: array}: `state0` ..., `track0` ... as far as sampled, `seconds`.

    The last two tracks are the evidence and the ledger at its last row.
    """
    arrays: Arrays = {f"state{i}": a.copy() for i, a in enumerate(march.state)}
    for i, count in enumerate(_lengths(march, march.counter)):
        arrays[f"track{i}"] = march.tracks[i][:count].copy()
    return arrays | {"seconds": np.array([march.seconds])}


def _lengths(march: March, counter: NDArray[np.int64]) -> list[int]:
    """Return the rows of each track that have been written."""
    *sampled, judged, closed = march.tracks
    # those that are not kept have no rows
    counts = [min(int(counter[contact.SAMPLE]), len(own)) for own in sampled]
    return [*counts, min(int(counter[contact.JUDGED]), len(judged)), len(closed)]


def restore(march: March, arrays: Arrays) -> bool:
    """Set a march that has not begun to a snapshot; return whether the arrays fit."""
    fresh = snapshot(march)
    if arrays.keys() != fresh.keys():
        return False
    states = [(arrays[f"state{i}"], own) for i, own in enumerate(march.state)]
    if any((a.dtype, a.shape) != (own.dtype, own.shape) for a, own in states):
        return False
    lengths = _lengths(march, arrays[f"state{len(march.state) - 3}"])
    tracks = [(arrays[f"track{i}"], own) for i, own in enumerate(march.tracks)]
    for (a, own), length in zip(tracks, lengths, strict=True):
        if (a.dtype, a.shape) != (own.dtype, (length, *own.shape[1:])):
            return False
    for a, own in states:
        own[:] = a
    for a, own in tracks:
        own[: len(a)] = a
    march.seconds = float(arrays["seconds"][0])
    return True
