"""A march on its way as plain arrays, and whether another march may go on from them.

Any cut of a march into slices gives the same bits, and a state is all that a march
needs; so a march that takes up a snapshot ends with the bits of one that never was
interrupted, provided that it is the same march. That takes more than the same inputs:
another LAPACK may give a mode the other sign, with which the amplitudes of the
snapshot would mean another motion. A fingerprint of every number that the kernel is
given, of the kernels and of their compiler decides.

How long the run lasts is no part of it: up to its last row of evidence a march passes
the states of a longer one, see `may_last`.
"""

from __future__ import annotations

import hashlib
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from hpcwhirl.dynamics import kernels
from hpcwhirl.dynamics.kernels import contact
from hpcwhirl.dynamics.kernels.named import Flight
from hpcwhirl.dynamics.march import March

Arrays = dict[str, NDArray[Any]]


def fingerprint(march: March) -> str:
    """Return the SHA-256 of what the kernel is called with, code included."""
    found = hashlib.sha256(f"{kernels.DIGEST} numba {numba.__version__}".encode())
    kept = march.stride if march.stride <= march.total else 0
    looks = march.coast is not None  # for a certificate, which ends the stepping
    found.update(repr((kept, march.beat, looks)).encode())
    _feed(found, march.scheme.arrays)
    return found.hexdigest()


def _feed(found: Any, part: Any) -> None:
    if isinstance(part, Flight):
        part = part._replace(total=0)
    if isinstance(part, tuple):
        for item in part:
            _feed(found, item)
        return
    array = np.asarray(part)
    found.update(repr((array.dtype.str, array.shape)).encode())
    found.update(np.ascontiguousarray(array).tobytes())


def snapshot(march: March) -> Arrays:
    """Return {name: array}: `state.NAME`, `tracks.NAME` as written, and others.

    `seconds` and `total` are those of the march. The tracks are its own: what has been
    written of them stays.
    """
    arrays = {name: array.copy() for name, array in _state(march).items()}
    tracks = _tracks(march, march.counter)
    tracks["tracks.closed"] = tracks["tracks.closed"].copy()
    others = {"seconds": np.array([march.seconds]), "total": np.array([march.total])}
    return arrays | tracks | others


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
    if arrays.keys() != snapshot(march).keys() or not may_last(arrays, march):
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


def steps_of(arrays: Arrays) -> tuple[int, int]:
    """Return the steps of a snapshot and those of its whole run."""
    return int(arrays["state.counter"][contact.STEP]), int(arrays["total"][0])


def may_last(arrays: Arrays, march: March) -> bool:
    """Return whether a march of this length passes a snapshot's state.

    That of a run of another length does up to its last row of evidence, and before
    there is a certificate: from there the rest was computed at once, to its end.
    """
    (steps, total), counter = steps_of(arrays), arrays["state.counter"]
    if total == march.total:
        return True
    whole = steps <= min(total, march.total) // march.beat * march.beat
    return whole and counter[contact.CERTIFIED] < 0 and counter[contact.STOP] == 0


def _fit(arrays: Arrays, own: Arrays) -> bool:
    """Return whether arrays have the types and shapes of one's own."""
    pairs = [(arrays[name], mine) for name, mine in own.items()]
    return all((a.dtype, a.shape) == (mine.dtype, mine.shape) for a, mine in pairs)
