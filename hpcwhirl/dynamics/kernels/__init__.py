"""All compiled code.

Terms used in these modules, besides those of the manual:

- slot: a nodal diameter 0 .. N // 2, as an index of a spectrum
- spectrum: (2 k,), re of the k slots, then im; k is N // 2 + 1, padded to vectors
- row (of modes): the f-th mode of every slot; column: re or im of one slot, in all rows
- items: the coefficients of a mode or wave that a step needs, in a fixed order
- folded row: values of all blades (2 wide,), of which the first half are those of
  blades j = 0 .. N // 2, the second those of blades N - j, see `circulant.folded`; in
  signatures, `row` is the index where the row begins in a flat array
- pending step: a step whose contact forces have been computed, but not yet applied
- active blades: those in contact; push, where: their multipliers, N, and their indices
- known: the active blades of the last solution; tips: displacements of all tips
- d, d': increments of an amplitude in the last step and in the present step

Numba's cache identifies a function by its file and does not notice edits in the
functions that it calls. So the cache is in a directory named by a digest of these
files, under NUMBA_CACHE_DIR or the user's cache directory. If that cannot be written,
each process has a temporary cache of its own.
"""

from __future__ import annotations

import atexit
import hashlib
import os
import shutil
import tempfile
from pathlib import Path

from numba import config

from hpcwhirl.dynamics.kernels.keeping import keep_apart


def _digest() -> str:
    here = Path(__file__).parent
    found = [*here.glob("*.py"), *here.parent.glob("schemes/*.py")]
    text = b"".join(path.read_bytes() for path in sorted(found))
    plain = os.environ.get("HPCWHIRL_PLAIN_NUMBA", "0").encode()  # see `compiled`
    return hashlib.sha256(text + plain).hexdigest()[:16]


def _cache_base(chosen: str) -> Path:
    if chosen:
        return Path(chosen)
    home = Path(os.path.expanduser("~"))  # noqa: PTH111 - Path.home raises without one
    return Path(os.environ.get("XDG_CACHE_HOME") or home / ".cache") / "hpcwhirl"


def _may_write(place: Path) -> bool:
    """Return whether files can be written to a directory; create it if missing."""
    try:
        place.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=place):
            return True
    except OSError:
        return False


def _own() -> str:
    """Create a directory for this process alone, removed at its end; return its path.

    Numba executes what it loads from its cache: other users must not be able to write.
    """
    place = tempfile.mkdtemp(prefix="hpcwhirl-numba-")
    atexit.register(shutil.rmtree, place, ignore_errors=True)
    return place


DIGEST = _digest()
_settings = vars(config)
WANTED = _cache_base(_settings["CACHE_DIR"]) / DIGEST
KEPT = _may_write(WANTED)  # if False, every process compiles everything again
_settings["CACHE_DIR"] = str(WANTED) if KEPT else _own()
keep_apart()
