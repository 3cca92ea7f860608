"""Text lines with a checksum: CRC-32 in hexadecimal, a space, and a JSON object."""

from __future__ import annotations

import json
import zlib

from hpcwhirl.store.directory.record import Record


def sealed(record: Record) -> bytes:
    """Return a JSON object as a line with its checksum."""
    body = json.dumps(record).encode()
    return f"{zlib.crc32(body):08x} ".encode() + body + b"\n"


def opened(line: bytes) -> Record | None:
    """Return the JSON object of a line, None if its checksum is wrong."""
    seal, _, body = line.rstrip(b"\n").partition(b" ")
    if not line.endswith(b"\n") or seal != f"{zlib.crc32(body):08x}".encode():
        return None
    try:
        record = json.loads(body)
    except (ValueError, RecursionError):  # not written by this program
        return None
    return record if isinstance(record, dict) else None
