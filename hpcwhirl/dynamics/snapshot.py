"""Snapshots: save a march as plain arrays, and resume it in another process.

Any division of a march into slices gives the same bits, and a march depends on nothing
but its state. So a resumed march ends with the bits of an uninterrupted one, provided
that it is the same march. Equal inputs do not suffice for that: another LAPACK may
change the sign of a mode, and the snapshot's amplitudes would then be another motion.
So a fingerprint is compared: of all numbers passed to the kernel, of the kernels and of
their compiler.

The fingerprint does not include the length of the run: up to its last row of evidence a
march has the states of a longer one, see `may_last`.
"""

from __future__ import annotations

import hashlib
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from hpcwhirl.case.profile import NEVER, told_of_release
from hpcwhirl.case.speed import laws_of
from hpcwhirl.dynamics.kernel_cache import DIGEST
from hpcwhirl.dynamics.kernels import contact
from hpcwhirl.dynamics.kernels.loop.wave_types import SlotFlight
from hpcwhirl.dynamics.march import March

Arrays = dict[str, NDArray[Any]]
CODE = f"{DIGEST} numba {numba.__version__}"  # code that computes the numbers


def fingerprint(march: March) -> str:
    """Return a hash of a march's code and numbers, which a snapshot must match.

    It is the SHA-256 of the kernels' source, numba's version, and all numbers passed to
    the kernel.
    """
    digest = hashlib.sha256(CODE.encode())
    kept = march.stride if march.stride <= march.total else 0
    looks = march.coast is not None  # a certificate ends the stepping
    digest.update(repr((kept, march.beat, looks)).encode())
    with march.at_start():  # arrays of a changing speed depend on the interval
        for scheme in march.schemes:
            _feed(digest, scheme.arrays)
    if march.schedule is not None:
        schedule = march.schedule
        digest.update(repr((schedule.sections, laws_of(schedule.scene))).encode())
    digest.update(repr(march.lost_at).encode() if march.lost_at else b"")
    if march.let_go != NEVER:
        digest.update(repr(told_of_release(march.scene)).encode())
    if march.start is not None:
        _feed(digest, march.start)
    return digest.hexdigest()


def _feed(digest: Any, part: Any) -> None:
    """Add the bytes of an argument of the kernel to a hash.

    digest : hash object, which is updated
    part : array, number, or tuple of them; a `SlotFlight` without the run's length
    """
    if isinstance(part, SlotFlight):
        part = part._replace(total=0)
    if isinstance(part, tuple):
        for item in part:
            _feed(digest, item)
        return
    array = np.asarray(part)
    digest.update(repr((array.dtype.str, array.shape)).encode())
    digest.update(np.ascontiguousarray(array).tobytes())


def snapshot(march: March) -> Arrays:
    """Return the state and samples of a march, to be saved: {name: array}.

    The names are `state.NAME`, `tracks.NAME`, `seconds` and `total`. Only the rows of
    tracks written so far are included; they are views of the march's arrays, in which
    written rows never change.
    """
    arrays = {name: array.copy() for name, array in _state(march).items()}
    tracks = _tracks(march, march.counter)
    for name in {"tracks.closed", "tracks.jump"} & tracks.keys():
        tracks[name] = tracks[name].copy()
    others = {"seconds": np.array([march.seconds]), "total": np.array([march.total])}
    return arrays | tracks | others


def _state(march: March) -> Arrays:
    return {f"state.{name}": a for name, a in march.state._asdict().items()}


def _tracks(march: March, counter: NDArray[np.int64]) -> Arrays:
    """Return the samples that a march has written so far, {name: rows}.

    counter : counters of the state, which have the numbers of these rows
    """
    counts = {"evidence": counter[contact.JUDGED], "closed": contact.CLOSED}
    tracks = march.tracks._asdict()
    tracks.pop("states")  # read already
    if march.stresses.size:
        tracks["stress"] = march.stresses
        counts["stress"] = counter[contact.STEP] // march.every
    if march.loads.size:
        tracks |= {"loads": march.loads, "jump": march.jump}
        counts |= {"loads": counter[contact.STEP] // march.every + 1, "jump": 1}
    return {  # tracks that are not kept have no rows
        f"tracks.{name}": track[
            : max(int(counts.get(name, counter[contact.SAMPLE])), 0)
        ]
        for name, track in tracks.items()
    }


def restore(march: March, arrays: Arrays) -> bool:
    """Set a new march to the state of a snapshot; return whether the snapshot fits.

    If it does not, the march is not changed, except that it may have lost its blade.

    arrays : result of `snapshot`, perhaps of another process
    """
    if arrays.keys() != snapshot(march).keys() or not may_last(arrays, march):
        return False
    march.enter(steps_of(arrays)[0])
    targets = _state(march)
    if not _fit(arrays, targets):
        return False
    targets |= _tracks(march, arrays["state.counter"])
    if not _fit(arrays, targets):
        return False
    for name, array in targets.items():
        array[:] = arrays[name]
    march.seconds = float(arrays["seconds"][0])
    march.recall()
    return True


def steps_of(arrays: Arrays) -> tuple[int, int]:
    """Return the number of steps of a snapshot taken so far, and that of its whole run.

    arrays : result of `snapshot`
    """
    return int(arrays["state.counter"][contact.STEP]), int(arrays["total"][0])


def may_last(arrays: Arrays, march: March) -> bool:
    """Return whether a march passes through a snapshot's state, if its length differs.

    It does so up to the last row of evidence of both runs, and only before a
    certificate, after which the rest of the run was computed at once.

    arrays : result of `snapshot`
    """
    (steps, total), counter = steps_of(arrays), arrays["state.counter"]
    if total == march.total:
        return True
    whole = steps <= min(total, march.total) // march.beat * march.beat
    return whole and counter[contact.CERTIFIED] < 0 and counter[contact.STOP] == 0


def _fit(arrays: Arrays, targets: Arrays) -> bool:
    """Return whether a snapshot's arrays have the types and shapes of a march's arrays.

    arrays, targets : {name: array}, of the snapshot and of the march
    """
    pairs = [(arrays[name], target) for name, target in targets.items()]
    return all((a.dtype, a.shape) == (b.dtype, b.shape) for a, b in pairs)
