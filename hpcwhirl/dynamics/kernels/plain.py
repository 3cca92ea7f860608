"""Kernels compiled by `numba.njit` alone: for any release, processor, or a debugger.

They give the same bits as those of `compiler`, which compile and run faster.
"""

from __future__ import annotations

from typing import Any

from numba import njit

from hpcwhirl.dynamics.kernel_cache import kept


def part(function: Any) -> Any:
    """Compile a function for compiled callers."""
    return njit(error_model="numpy")(function)


def kernel(function: Any) -> Any:
    """Compile a function for Python and for compiled callers, kept on disk."""
    return kept(part(function))


inlined = rare = part
rare_kernel = kernel
