"""All compiled code.

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
    """Return whether a file can be made in a directory, itself made if missing."""
    try:
        place.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=place):
            return True
    except OSError:
        return False


def _own() -> str:
    """Return a new directory of this process, removed when the process ends.

    Numba executes what it loads from its cache, so the directory must be nobody else's.
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
