"""Running a sub-command: threads, arguments, and one line for what goes wrong."""

from __future__ import annotations

import argparse
import importlib
import os
import resource
import sys
import traceback
from collections.abc import Sequence
from pathlib import Path
from typing import NoReturn

from hpcwhirl.cli import COMMANDS
from hpcwhirl.cli.streams import flush_stdout, stand_in
from hpcwhirl.errors import InputError, WhirlError, one_line, shown, unknown

COMPLETE, FAILED, WRONG_INPUT, INTERNAL, STOPPED = 0, 1, 2, 70, 75
INTERRUPTED = 130  # as a shell says it
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
LEAST_MEMORY = 400_000  # KiB of addresses; with 150,000 OpenBLAS may try for ever
NO_MEMORY = ("failed to map segment", "cannot allocate memory", "out of memory")


class _Parser(argparse.ArgumentParser):
    """A parser whose complaint is one line, as that of every other wrong input."""

    def error(self, message: str) -> NoReturn:
        """Raise instead of printing the usage and leaving."""
        raise InputError(f"{message} (see {self.prog} --help)")


def run_program(words: Sequence[str]) -> int:
    """Run a sub-command as this process: its streams are the program's own."""
    stand_in()
    try:
        code = run_command(words)
    except SystemExit as left:  # --help, --version
        code = int(left.code or COMPLETE)
    except KeyboardInterrupt:
        return INTERRUPTED
    try:
        flush_stdout()
    except WhirlError as failed:
        if code != WRONG_INPUT:  # told already
            tell_error(failed)
        return code or WRONG_INPUT
    except BrokenPipeError:
        return code or FAILED
    return code


def run_command(words: Sequence[str]) -> int:
    """Run a sub-command and return its exit code."""
    for name in THREADS:
        os.environ.setdefault(name, "1")
    try:
        return _run(words)
    except WhirlError as failed:
        tell_error(failed)
        return WRONG_INPUT
    except BrokenPipeError:
        return FAILED
    except Exception as failed:  # noqa: BLE001 - 1 would say that some cases failed
        return tell_failure(failed)


def tell_error(failed: BaseException | str) -> None:
    """Print one line on stderr."""
    print(f"hpcwhirl: error: {one_line(str(failed))}", file=sys.stderr)


def tell_failure(failed: Exception) -> int:
    """Tell what no one has foreseen; return the exit code.

    What a machine refuses, memory or a file, is a line; a mistake of the program is
    its traceback.
    """
    said = str(failed).lower()
    lacking = isinstance(failed, ImportError | OSError) and any(
        words in said for words in NO_MEMORY
    )
    if lacking or isinstance(failed, MemoryError):
        tell_error(f"not enough memory{_limit()}: {str(failed) or 'imports'}")
        return WRONG_INPUT
    if isinstance(failed, OSError) and failed.filename is not None:
        tell_error(f"{os.fsdecode(failed.filename)}: {failed.strerror}")
        return WRONG_INPUT
    traceback.print_exception(failed)
    return INTERNAL


def _limit() -> str:
    """Return the limit of this process's memory, as a shell sets it."""
    most = resource.getrlimit(resource.RLIMIT_AS)[0]
    return "" if most == resource.RLIM_INFINITY else f" (ulimit -v {most >> 10})"


def _run(words: Sequence[str]) -> int:
    if not words or words[0].startswith("-"):
        parser = _parser()
        if words:
            parser.parse_args(words)
        parser.print_help()
        return WRONG_INPUT
    _check_words(words)
    _check_place()
    _check_memory()
    module = importlib.import_module(_command(words[0]))
    parser = _Parser(prog=f"hpcwhirl {words[0]}", description=COMMANDS[words[0]])
    module.arguments(parser)
    return int(module.run(parser.parse_args(words[1:])))


def _check_words(words: Sequence[str]) -> None:
    """Refuse, before anything is computed, names that results could not keep."""
    for word in words:
        try:
            word.encode()
        except UnicodeEncodeError:
            msg = f"an argument must be UTF-8, got {shown(word)}"
            raise InputError(msg) from None


def _check_place() -> None:
    """Refuse to work in a directory that is no more."""
    try:
        Path.cwd()
    except OSError as failed:
        msg = f"the working directory cannot be used: {failed.strerror}"
        raise InputError(msg) from None


def _check_memory() -> None:
    """Refuse a limit in which a library would hang or end the process as it loads."""
    most = resource.getrlimit(resource.RLIMIT_AS)[0]
    if most != resource.RLIM_INFINITY and most >> 10 < LEAST_MEMORY:
        msg = f"not enough memory{_limit()}: at least {LEAST_MEMORY} are needed"
        raise InputError(msg)


def _parser() -> argparse.ArgumentParser:
    from hpcwhirl import __version__

    parser = _Parser(
        prog="hpcwhirl",
        description="Whirl of a bladed disk in contact with its casing.",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=__version__)
    parser.add_argument("command", choices=COMMANDS, metavar="COMMAND")
    wide = max(map(len, COMMANDS))
    parser.epilog = "commands:\n" + "\n".join(
        f"  {k:{wide}}  {v}" for k, v in COMMANDS.items()
    )
    return parser


def _command(name: str) -> str:
    if name not in COMMANDS:
        raise unknown("command", name, COMMANDS)
    return f"hpcwhirl.cli.{name.replace('-', '_')}"
