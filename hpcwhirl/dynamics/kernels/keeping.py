"""A repair of numba's cache for processes that compile at the same time.

Numba numbers the files of compiled code and writes the index first: two processes that
compile two variants of a kernel at once use the same number, and the index of one
refers to the code of the other. Here each file has a unique name and is written before
the index refers to it: at worst an entry is lost and that variant is compiled again.
"""

from __future__ import annotations

import uuid
from typing import Any

from numba.core.caching import IndexDataCacheFile


def save_apart(cache: Any, key: Any, data: Any) -> None:
    """Save compiled code as `IndexDataCacheFile.save` does, but under a unique name."""
    overloads = cache._load_index()
    name = overloads.get(key)
    if name is not None:  # the cache has code for this key already
        cache._save_data(name, data)
        return
    overloads[key] = name = cache._data_name(uuid.uuid4().int)
    cache._save_data(name, data)
    cache._save_index(overloads)


def keep_apart() -> None:
    """Let numba save everything compiled from now on with `save_apart`."""
    IndexDataCacheFile.save = save_apart  # type: ignore[method-assign]
