"""All compiled code.

Numba's cache knows a function by the file it stands in and does not see edits in what
it calls: the cache therefore lies in a directory named by a digest of these files,
under NUMBA_CACHE_DIR or else the user's cache directory.
"""

from __future__ import annotations

import hashlib
import os
from pathlib import Path

from numba import config

from hpcwhirl.dynamics.kernels.keeping import keep_apart


def _digest() -> str:
    text = b"".join(p.read_bytes() for p in sorted(Path(__file__).parent.glob("*.py")))
    return hashlib.sha256(text).hexdigest()[:16]


def _cache_base(chosen: str) -> Path:
    if chosen:
        return Path(chosen)
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "hpcwhirl"


DIGEST = _digest()
_settings = vars(config)
_settings["CACHE_DIR"] = str(_cache_base(_settings["CACHE_DIR"]) / DIGEST)
keep_apart()
