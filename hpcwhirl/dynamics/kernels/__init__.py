"""All compiled code.

Terms used in these modules, besides those of the manual:

- slot: a nodal diameter 0 .. N // 2 as an index of spectra
- spectrum: (2 k,), re of the k slots, then im; k is N // 2 + 1, padded to vectors
- row, column: the f-th modes of all slots; a slot's real or imaginary part
- items: coefficients of one mode or wave, in a fixed order
- folded: of a row (2 wide,), that its first half has blades j = 0 .. N // 2, its second
  N - j, see `circulant.folded`; `row` is the index where it begins in a flat array
- pending: of a step, that its contact forces are found, but not yet applied
- push, where: multipliers, N, and indices of the blades in contact (active blades)
- tips: displacements of the blades' tips; known: the active blades of the last solution

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

    Numba executes what it loads from its cache, so that no other user may write to it.
    """
    place = tempfile.mkdtemp(prefix="hpcwhirl-numba-")
    atexit.register(shutil.rmtree, place, ignore_errors=True)
    return place


DIGEST = _digest()
_settings = vars(config)
WANTED = _cache_base(_settings["CACHE_DIR"]) / DIGEST
KEPT = _may_write(WANTED)  # otherwise every process compiles everything again
_settings["CACHE_DIR"] = str(WANTED) if KEPT else _own()
keep_apart()
