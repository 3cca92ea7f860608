"""Lines with checksum: CRC-32 in hexadecimal, a space, and a JSON object."""

from __future__ import annotations

import json
import zlib

from hpcwhirl.store.directory.record import Record


def sealed(record: Record) -> bytes:
    """Return a record as a line."""
    body = json.dumps(record).encode()
    return f"{zlib.crc32(body):08x} ".encode() + body + b"\n"


def opened(line: bytes) -> Record | None:
    """Return the record of a line, None where it does not match its checksum."""
    seal, _, body = line.rstrip(b"\n").partition(b" ")
    if not line.endswith(b"\n") or seal != f"{zlib.crc32(body):08x}".encode():
        return None
    try:
        record = json.loads(body)
    except (ValueError, RecursionError):  # sealed by something else than this program
        return None
    return record if isinstance(record, dict) else None
