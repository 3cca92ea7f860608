"""Run the campaign of a notebook or a script on several ranks, which mpirun starts.

`on_ranks` is called in the user's process, `main` on each rank. What was asked is
written as JSON into a directory that only the user can read; rank 0 writes how it
ended beside it. A rank that finds the file `stop` there, or its caller gone, stops the
campaign as a signal does. So Ctrl-C in a notebook keeps what is finished.
"""

from __future__ import annotations

import importlib
import json
import os
import re
import signal
import subprocess
import sys
import threading
import time
import tomllib
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

from hpcwhirl import errors
from hpcwhirl.campaign.plan.design import Design, plain
from hpcwhirl.errors import InputError, StoppedError, WhirlError, one_line, shown
from hpcwhirl.launch import (
    communicator,
    fate,
    interpreter,
    launched_first,
    launched_ranks,
    mpirun,
)
from hpcwhirl.scene import Scene, to_toml

if TYPE_CHECKING:
    import xarray

    from hpcwhirl.campaign.call import Call

TASK, STOP, ENDED = "task.json", "stop", "ended.json"
LOOK_EVERY = 0.5  # s between checks for the file that asks a rank to stop
MOST = 4096  # largest number of ranks
LAST_LINES = 5  # lines of mpirun that a message repeats
DONE = re.compile(r"hpcwhirl: (\d+) of (\d+) cases\b")
THREADS = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1"
)


def on_ranks(call: Call, ranks: Any) -> xarray.Dataset:
    """Run a campaign on some ranks that mpirun starts, and return its results.

    Where there is no mpirun, this process runs it; a line says so.

    Parameters
    ----------
    call : the arguments of `hpcwhirl.campaign`
    ranks : number of ranks

    Raises
    ------
    InputError
        for arguments that other ranks cannot get, or if this is one of several ranks
    StoppedError
        if the campaign ended early, as by Ctrl-C
    """
    if isinstance(ranks, bool) or not isinstance(ranks, int) or not 1 <= ranks <= MOST:
        msg = f"ranks must be a whole number from 1 to {MOST}, got {shown(ranks)}"
        raise InputError(msg)
    if launched_ranks() > 1:
        msg = f"this process is one of {launched_ranks()} ranks: leave ranks out"
        raise InputError(f"{msg}, got {ranks}")
    task, path = _task(call), mpirun()
    if not path or ranks == 1:
        if not path:
            errors.say("there is no mpirun on the path: one process computes all cases")
        return call.run(None)
    with TemporaryDirectory(prefix="hpcwhirl-") as name:
        folder = Path(name)
        (folder / TASK).write_text(json.dumps(task), encoding="utf-8")
        command = [path, "-n", str(ranks)]
        command += interpreter("hpcwhirl.campaign.started_ranks", name)
        lines, code = _followed(command, folder / STOP)
        return call.opened(_ended(folder / ENDED, lines, code))


def _task(call: Call) -> dict[str, Any]:
    """Return the arguments of a call as data for JSON."""
    design = call.design
    if isinstance(design, Design):
        msg = "with ranks, design must be a TOML file, a mapping of its tables or a "
        raise InputError(f"{msg}Scene, got a Design")
    if isinstance(design, Scene):
        design = tomllib.loads(to_toml(design))
    return {
        "design": plain(design),
        "out": None if call.out is None else str(call.out),
        "measure": named(call.function) if call.function is not None else None,
        "variables": plain(call.variables),
        "version": call.version,
        "options": plain(dict(call.options)),
        "caller": os.getpid(),
    }


def named(function: Any) -> list[str]:
    """Return [module, name] of a function `measure`, by which other ranks import it.

    Raises
    ------
    InputError
        if they could not: it stands in a notebook, a script or another function
    """
    module, name = (
        str(getattr(function, key, "")) for key in ("__module__", "__qualname__")
    )
    found = None
    if module not in {"", "__main__"} and name.isidentifier():
        found = getattr(sys.modules.get(module), name, None)
    if found is not function or not _has_file(module):
        told = f"{module}.{name}" if name else shown(function)
        raise InputError(
            f"measure must be a function that other ranks can import, got {told}: put "
            "it into a file, such as mine.py, and write `from mine import NAME`"
        )
    return [module, name]


def _has_file(module: str) -> bool:
    return bool(getattr(sys.modules.get(module), "__file__", None))


def _followed(command: list[str], stop: Path) -> tuple[list[str], int]:
    """Run mpirun, show its lines, and ask it to stop at Ctrl-C.

    Parameters
    ----------
    command : command line
    stop : file that asks the ranks to stop

    Returns
    -------
    last lines, and exit code
    """
    child = subprocess.Popen(
        command,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
        env={**THREADS, **os.environ},
        start_new_session=True,  # Ctrl-C reaches this process alone
    )
    with child:
        return _watched(child, stop)


def _watched(child: subprocess.Popen[str], stop: Path) -> tuple[list[str], int]:
    """Show the lines of mpirun until it ends, see `_followed`."""
    asked, lines = False, list[str]()
    show = progress_bar() or _echo
    while True:
        try:
            for line in child.stdout or ():
                lines = [*lines[1 - LAST_LINES :], line]
                show(line)
            return lines, child.wait()
        except BaseException as failed:
            if asked or not isinstance(failed, KeyboardInterrupt):
                os.killpg(child.pid, signal.SIGKILL)
                raise
            asked = True  # a second one ends it at once
            stop.touch()


def _echo(line: str) -> None:
    sys.stderr.write(line)
    sys.stderr.flush()


def progress_bar() -> Callable[[str], None] | None:
    """Return a function that shows lines of a campaign in a notebook; None elsewhere.

    Lines that tell how many cases have ended move a bar, others are printed.
    """
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    if getattr(shell, "kernel", None) is None:
        return None
    from IPython.display import HTML, display

    bar = display(HTML(drawn(0, 0, "starting")), display_id=True)

    def show(line: str) -> None:
        found = DONE.match(line)
        if found is None:
            print(line, end="")  # noqa: T201 - not the red block of stderr
        elif bar is not None:
            told = line.removeprefix("hpcwhirl: ").strip()
            bar.update(HTML(drawn(int(found[1]), int(found[2]), told)))

    return show


def drawn(done: int, cases: int, told: str) -> str:
    """Return a bar of progress as HTML.

    done, cases : cases that have ended, of how many
    told : text beside the bar
    """
    from html import escape

    value = f' value="{done}" max="{cases}"' if cases else ""
    return f'<progress{value} style="width: 20em"></progress> {escape(told)}'


def _ended(file: Path, lines: list[str], code: int) -> Path:
    """Return the directory of a campaign that has ended; raise its error, if any.

    Parameters
    ----------
    file : what rank 0 has written; it may be missing
    lines, code : last lines and exit code of mpirun
    """
    if not file.exists():
        told = one_line(" ".join(line.strip() for line in lines), 500)
        raise StoppedError(f"mpirun {fate(code)} before the campaign: {told}")
    told = json.loads(file.read_text(encoding="utf-8"))
    if kind := told.get("error"):
        raise getattr(errors, kind)(told["message"])
    return Path(told["out"])


def main() -> None:
    """Run on this rank the campaign that the folder `sys.argv[1]` describes."""
    folder = Path(sys.argv[1])
    task = json.loads((folder / TASK).read_text(encoding="utf-8"))
    threading.Thread(target=_listen, args=(folder, task), daemon=True).start()
    ended: dict[str, Any] = {}
    try:
        ended["out"] = str(_call_of(task).place(communicator()))
    except WhirlError as failed:
        ended |= {"error": type(failed).__name__, "message": str(failed)}
    except KeyboardInterrupt:
        told = "stopped before the first case; the same call begins it"
        ended |= {"error": "StoppedError", "message": told}
    if launched_first():
        part = folder / f"{ENDED}.part"
        part.write_text(json.dumps(ended), encoding="utf-8")
        part.rename(folder / ENDED)


def _call_of(task: Mapping[str, Any]) -> Call:
    from hpcwhirl.campaign.call import Call

    function = None
    if task["measure"]:
        module, name = task["measure"]
        try:
            function = getattr(importlib.import_module(module), name)
        except (ImportError, AttributeError) as failed:
            msg = (
                f"measure {module}.{name} cannot be imported by another rank: {failed}"
            )
            raise InputError(msg) from None
    variables = {
        name: tuple(told) if isinstance(told, list) else told
        for name, told in (task["variables"] or {}).items()
    }
    return Call(
        task["design"], task["out"], function, variables or None, task["version"],
        task["options"],
    )  # fmt: skip


def _listen(folder: Path, task: Mapping[str, Any]) -> None:
    """Stop this process as a signal does once the caller asks for it, or is gone."""
    while True:
        time.sleep(LOOK_EVERY)
        gone = False
        with suppress(PermissionError):
            try:
                os.kill(task["caller"], 0)
            except ProcessLookupError:
                gone = True
        if gone:  # nobody reads what mpirun would forward
            nowhere = os.open(os.devnull, os.O_WRONLY)
            os.dup2(nowhere, 1)
            os.dup2(nowhere, 2)
        if gone or (folder / STOP).exists() or not folder.exists():
            os.kill(os.getpid(), signal.SIGINT)
            return
