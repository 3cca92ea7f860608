"""Where compiled code is kept between runs."""

from __future__ import annotations

from typing import Any

from hpcwhirl.dynamics import kernels


def cache_facts() -> dict[str, Any]:
    """Return the directory of numba's cache, whether it can be written and its size."""
    place = kernels.WANTED
    compiled = sum(1 for _ in place.rglob("*.nbc")) if place.is_dir() else 0
    return {
        "cache": str(place),
        "cache_writable": kernels.KEPT,
        "cache_kernels": compiled,
    }
