"""Identity of processes and machines, to tell a dead process from a new one."""

from __future__ import annotations

import os
import socket
from functools import cache
from pathlib import Path

DEAD = {"Z", "X", "x"}  # states in /proc of a process that has ended


@cache
def machine() -> str:
    """Return an identity shared by the processes that see each other's process numbers.

    The identity consists of the boot's number and the name space of process numbers:
    two machines may have one name, and two containers may share a machine.
    """
    try:
        boot = Path("/proc/sys/kernel/random/boot_id").read_text(encoding="ascii")
        space = os.readlink("/proc/self/ns/pid")  # noqa: PTH115 - no path at all
    except OSError:  # not Linux
        return socket.gethostname()
    return f"{boot.strip()} {space}"


def begun(pid: int) -> int | None:
    """Return the start of a process of this machine, in clock ticks since the boot.

    The start distinguishes a process from a later one with the same number. None if no
    such process exists, or its start is unknown.
    """
    state = _state(pid)
    return int(state[19]) if state else None


def is_alive(pid: int, ticks: int | None = None) -> bool:
    """Return whether a process of this machine exists, running or suspended.

    Parameters
    ----------
    pid : number of the process
    ticks : its start as `begun` returns it; None: unknown
    """
    foreign = False
    try:
        os.kill(pid, 0)
    except (ProcessLookupError, OverflowError, ValueError):
        return False
    except OSError:  # a process of another user, which may be hidden
        foreign = True
    state = _state(pid)
    if state is None:  # the process is hidden or has just ended, or this is not Linux
        return foreign or not Path("/proc/self/stat").exists()
    return state[0] not in DEAD and (ticks is None or int(state[19]) == ticks)


def _state(pid: int) -> list[str] | None:
    """Return the fields of /proc/PID/stat after the command's name, see proc(5)."""
    try:
        text = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return None
    return text.rpartition(")")[2].split()
