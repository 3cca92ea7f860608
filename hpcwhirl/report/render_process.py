"""Drawing a campaign's map in a separate process, which saves memory of rank 0.

Importing Matplotlib and drawing a map takes some 90 MB, which would be the largest part
of rank 0's memory. The process is a new interpreter, never a fork of a process that has
initialized MPI, and ends with its parent. It ignores the signals that stop a campaign,
so that the map of a finished campaign is completed.
"""

from __future__ import annotations

import json
import logging
import os
import signal
import subprocess
import sys
import threading
from pathlib import Path

from hpcwhirl.early_signals import SIGNALS
from hpcwhirl.errors import (
    InputError,
    MissingFileError,
    NoRoomError,
    StoreError,
    WhirlError,
)
from hpcwhirl.launch import fate, interpreter, without_mpi

# an error is reported as the first of these classes that it belongs to
TOLD = (InputError, NoRoomError, MissingFileError, StoreError, WhirlError,
        MemoryError, ImportError)  # fmt: skip


def draw_in_process(results: Path, out: Path) -> list[Path]:
    """Draw a campaign's map.png and map.svg in another process; return their paths.

    If this process has Matplotlib and xarray already, or can start no other, it draws.

    results, out : path of `results.h5`; directory of the figures

    Raises
    ------
    WhirlError, MemoryError, ImportError
        as raised by `draw_map` in that process; `StoreError` if that process was killed
    RuntimeError
        if that process failed in another way, after printing the traceback
    """
    if not {"matplotlib", "xarray"} <= sys.modules.keys():
        try:
            process = _begun(results, out)
        except OSError:  # too many processes, or too little memory
            pass
        else:
            return _drawn(process, out)
    from hpcwhirl.report.map.maps import draw_map

    return draw_map(results, out)


def _begun(results: Path, out: Path) -> subprocess.Popen[bytes]:
    words = interpreter(__name__, str(results), str(out))
    before = signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)  # a child inherits it
    try:
        return subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _drawn(process: subprocess.Popen[bytes], out: Path) -> list[Path]:
    """Wait for the process that draws the map; return paths, or raise its error.

    process, out : the process; directory of the figures
    """
    with process:  # the input of the process stays open meanwhile
        told = process.stdout.read() if process.stdout else b""
    if told:
        kind, text, paths = json.loads(told)
        if kind is not None:
            raise TOLD[kind](text)
        return [Path(path) for path in paths]
    text = f"the map is not drawn: its process {fate(process.returncode)}"
    if process.returncode < 0:
        raise StoreError(f"{text}; the results are complete: hpcwhirl map {out}")
    raise RuntimeError(text)


def main() -> None:
    """Draw a campaign's map in this process, which `draw_in_process` has started.

    Its reply, which tells of success or the error, is all that goes to stdout; other
    output goes to stderr.
    """
    with os.fdopen(os.dup(1), "w") as sink:
        os.dup2(2, 1)
        threading.Thread(target=_end_with_parent, daemon=True).start()
        without_mpi()
        # such as where its cache is, if the home directory cannot be written
        logging.getLogger("matplotlib").setLevel(logging.ERROR)
        kind, text, paths = None, "", []
        try:
            from hpcwhirl.report.map.maps import draw_map

            paths = draw_map(Path(sys.argv[1]), Path(sys.argv[2]))
        except TOLD as failed:
            kind = [isinstance(failed, one) for one in TOLD].index(True)
            text = str(failed)
        json.dump([kind, text, [str(path) for path in paths]], sink)


def _end_with_parent() -> None:
    """Exit this process when its standard input ends, since its parent has ended."""
    while os.read(0, 1):
        pass
    os._exit(1)
