"""The cache of compiled kernels between runs."""

from __future__ import annotations

from typing import Any

from hpcwhirl.dynamics import kernels


def cache_facts() -> dict[str, Any]:
    """Return {fact: value} of numba's cache: path, writability, number of kernels."""
    folder = kernels.WANTED
    compiled = sum(1 for _ in folder.rglob("*.nbc")) if folder.is_dir() else 0
    return {
        "cache": str(folder),
        "cache_writable": kernels.KEPT,
        "cache_kernels": compiled,
    }
