"""Where compiled code is kept between runs."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from numba import config

import hpcwhirl.dynamics.kernels  # noqa: F401 - it names the directory


def cache_facts() -> dict[str, Any]:
    """Return the directory of numba's cache, whether it can be written and its size."""
    place = Path(vars(config)["CACHE_DIR"])
    compiled = sum(1 for _ in place.rglob("*.nbc")) if place.is_dir() else 0
    existing = place
    while not existing.exists():
        existing = existing.parent
    writable = existing.is_dir() and os.access(existing, os.W_OK | os.X_OK)
    return {"cache": str(place), "cache_writable": writable, "cache_kernels": compiled}
