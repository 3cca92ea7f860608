"""All compiled code, but for what a scheme has in a file of its own.

Numba's cache knows a function by the file it stands in and does not see edits in what
it calls: the cache therefore lies in a directory named by a digest of these files,
under NUMBA_CACHE_DIR or else the user's cache directory. Where that cannot be written,
each process has a cache of its own for as long as it lives.
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
    """Return whether a file can be made in a directory, or in one made there."""
    try:
        place.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=place):
            return True
    except OSError:
        return False


def _own() -> str:
    """Return a directory of this process's own, removed as it ends.

    What numba loads from its cache it executes: nobody else's directory will do.
    """
    place = tempfile.mkdtemp(prefix="hpcwhirl-numba-")
    atexit.register(shutil.rmtree, place, ignore_errors=True)
    return place


DIGEST = _digest()
_settings = vars(config)
WANTED = _cache_base(_settings["CACHE_DIR"]) / DIGEST
KEPT = _may_write(WANTED)  # else all is compiled again in every process
_settings["CACHE_DIR"] = str(WANTED) if KEPT else _own()
keep_apart()
