"""The identity of a case: the SHA-256 of its inputs and of its engine file."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

from hpcwhirl.errors import SHOWN, InputError, MissingFileError, one_line
from hpcwhirl.safe_open import check_regular, open_regular
from hpcwhirl.scene.input_names import FILE, LATER, Value, default_of
from hpcwhirl.scene.inputs import Scene
from hpcwhirl.scene.plain_data import flatten

READING = 2  # increased whenever an unchanged engine file gives other numbers
PHYSICS_VERSION = 25  # increased whenever unchanged inputs give other numbers
MOST_BYTES = 2**31  # largest engine file: 16 matrices of 4,000 coordinates


def content_digest(file: str) -> str:
    """Return the SHA-256 of an engine file's bytes, hexadecimal; "" if file is ""."""
    if not file:
        return ""
    try:
        check_bytes(file, check_regular(file))
        state = Path(file).stat()
        return _sha256(file, (state.st_ino, state.st_ctime_ns, state.st_mtime_ns))
    except MissingFileError:
        raise
    except OSError as failed:
        told = one_line(one_line(file), 3 * SHOWN)
        msg = f"cannot read {FILE} {told}: {failed.strerror or failed}"
        raise MissingFileError(msg) from None


def check_bytes(file: str, size: int) -> None:
    """Raise InputError for an engine file of more than `MOST_BYTES`.

    file, size : its name; its size in bytes, in which holes of a sparse file count
    """
    if size > MOST_BYTES:
        msg = f"{FILE} {file} must have at most {MOST_BYTES} bytes, got {size}"
        raise InputError(msg)


@lru_cache(maxsize=64)
def _sha256(file: str, state: tuple[int, ...]) -> str:
    del state  # key of the cache: the file is read again only if it has changed
    with open_regular(file) as handle:
        return hashlib.file_digest(handle, "sha256").hexdigest()


def digest(scene: Scene, content: str | None = None) -> str:
    """Return the SHA-256 of a case's inputs and the physics version, hexadecimal.

    The content of an engine file counts as an input, in addition to its path.

    Parameters
    ----------
    scene : all inputs of the case
    content : `content_digest` of the engine file when the case was planned; None: of
        the present file
    """
    if content is None:
        content = content_digest(scene.engine.file)
    return digest_of(flatten(scene), content)


def digest_of(values: Mapping[str, Value], content: str) -> str:
    """Return a case's SHA-256 from its inputs and the content of its engine file.

    values, content : {dotted input: value} of all inputs; `content_digest` of the file
    """
    told = [PHYSICS_VERSION, without_defaults(values), read_as(content)]
    text = json.dumps(told, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()


def without_defaults(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return the inputs that a case's digest contains, {dotted input: value}.

    Inputs that were added after the first release, `LATER`, are left out if they have
    their default value; so older digests remain valid.
    """
    return {n: v for n, v in values.items() if n not in LATER or v != default_of(n)}


def read_as(content: str) -> str:
    """Return the text that stands for an engine file in a case's digest; "" for none.

    It is the file's SHA-256, `content`, and `READING`, the version of its reader.
    """
    return content and f"{content} {READING}"
