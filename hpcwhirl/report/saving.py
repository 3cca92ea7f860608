"""Figures as files, whole or not at all."""

from __future__ import annotations

import uuid
from pathlib import Path
from typing import Any

from hpcwhirl.errors import unwritable


def save(figure: Any, path: Path) -> Path:
    """Write a figure and return its path."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        part = path.with_name(f".{uuid.uuid4().hex}{path.suffix}")
        try:
            figure.savefig(part, dpi=130)
            part.replace(path)
        finally:
            part.unlink(missing_ok=True)
    except OSError as failed:
        msg = f"cannot write {path}: {failed.strerror or failed}"
        raise unwritable(msg, failed) from None
    return path
