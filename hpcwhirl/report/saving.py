"""Figures as files, whole or not at all."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from hpcwhirl.errors import unwritable
from hpcwhirl.store.atomic import replacing


def save(figure: Any, path: Path, dpi: int = 130, **options: Any) -> Path:
    """Write a figure in the format of the file's name, and return its path."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with replacing(path) as part:
            figure.savefig(part, format=path.suffix[1:], dpi=dpi, **options)
    except OSError as failed:
        msg = f"cannot write {path}: {failed.strerror or failed}"
        raise unwritable(msg, failed) from None
    return path
