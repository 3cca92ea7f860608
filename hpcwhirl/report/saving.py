"""Figures as files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from hpcwhirl.errors import MissingFileError


def save(figure: Any, path: Path) -> Path:
    """Write a figure and return its path."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, dpi=130)
    except OSError as failed:
        msg = f"cannot write {path}: {failed.strerror or failed}"
        raise MissingFileError(msg) from None
    return path
