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

Numba numbers the files of compiled code and writes the index first: two processes that
compile two variants of a kernel at once use the same number, and the index of one
refers to the code of the other. Here each file has a unique name and is written before
the index refers to it: at worst an entry is lost and that variant is compiled again.
"""

from __future__ import annotations

import atexit
import hashlib
import os
import shutil
import tempfile
import uuid
from pathlib import Path
from typing import Any

from numba import config
from numba.core.caching import IndexDataCacheFile


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


def save_apart(cache: Any, key: Any, data: Any) -> None:
    """Save compiled code as `IndexDataCacheFile.save` does, but under a unique name."""
    overloads = cache._load_index()
    name = overloads.get(key)
    if name is not None:  # the same code again
        cache._save_data(name, data)
        return
    overloads[key] = name = cache._data_name(uuid.uuid4().int)
    cache._save_data(name, data)
    cache._save_index(overloads)


def cache_facts() -> dict[str, Any]:
    """Return {name: value}: path, writability, number of kernels of numba's cache."""
    compiled = sum(1 for _ in WANTED.rglob("*.nbc")) if WANTED.is_dir() else 0
    return {
        "cache": str(WANTED),
        "cache_writable": KEPT,
        "cache_kernels": compiled,
    }


DIGEST = _digest()
_settings = vars(config)
WANTED = _cache_base(_settings["CACHE_DIR"]) / DIGEST
KEPT = _may_write(WANTED)  # otherwise every process compiles everything again
_settings["CACHE_DIR"] = str(WANTED) if KEPT else _own()
IndexDataCacheFile.save = save_apart  # type: ignore[method-assign]
