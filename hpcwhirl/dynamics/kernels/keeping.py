"""Numba's cache where several processes compile at once.

Numba numbers the files of compiled code and writes the index first: two processes that
compile two sizes of one kernel at once take the same number, and the index of one
names the code of the other. Here each file has a name of its own, and is there before
the index names it: what is lost, at worst, is an entry, which is compiled again.
"""

from __future__ import annotations

import uuid
from typing import Any

from numba.core.caching import IndexDataCacheFile


def save_apart(cache: Any, key: Any, data: Any) -> None:
    """Save compiled code as `IndexDataCacheFile.save` does, under a name of its own."""
    overloads = cache._load_index()
    name = overloads.get(key)
    if name is not None:  # the same code again
        cache._save_data(name, data)
        return
    overloads[key] = name = cache._data_name(uuid.uuid4().int)
    cache._save_data(name, data)
    cache._save_index(overloads)


def keep_apart() -> None:
    """Let numba save all that is compiled from now on by `save_apart`."""
    IndexDataCacheFile.save = save_apart  # type: ignore[method-assign]
