"""Calls in forks of this process, their streams kept in files."""

from __future__ import annotations

import os
import sys
import traceback
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

RAISED = 99  # exit code of a fork where something else than the command raised


def forked(action: Callable[[], int], out: Path, err: Path) -> int:
    """Call `action`, which gives the exit code, in a fork; return its process.

    out, err : files that what it prints is added to
    """
    sys.stdout.flush()
    sys.stderr.flush()
    pid = os.fork()
    if pid:
        return pid
    code = RAISED
    try:
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        flags = os.O_WRONLY | os.O_CREAT | os.O_APPEND
        for number, path in ((1, out), (2, err)):
            os.dup2(os.open(path, flags, 0o644), number)
        code = action()
    except SystemExit as left:
        code = left.code if isinstance(left.code, int) else RAISED
    except BaseException:  # noqa: BLE001 - printed, and a code that no command has
        traceback.print_exc()
    finally:
        with suppress(Exception):
            sys.stdout.flush()
            sys.stderr.flush()
        os._exit(code & 0xFF)
