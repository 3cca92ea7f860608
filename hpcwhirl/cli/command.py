"""Run a sub-command: check and parse its arguments, print errors, set the exit code.

`add_option` declares one option of a command, in the form in which its help shows it.

The program replaces its standard streams by streams that work even if a descriptor is
closed or a disk is full.
"""

from __future__ import annotations

import argparse
import importlib
import io
import os
import resource
import sys
import traceback
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any, NoReturn

from hpcwhirl.cli import COMMANDS
from hpcwhirl.errors import (
    COMPLETE,
    FAILED,
    INTERNAL,
    PASSING,
    STOPPED,
    WRONG_INPUT,
    InputError,
    NoRoomError,
    WhirlError,
    nearest,
    one_line,
    say,
    shown,
    unknown,
    unwritable,
)
from hpcwhirl.launch import launched_first, launched_ranks, without_mpi

INTERRUPTED = 130  # exit code after SIGINT, as a shell reports it
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
LEAST_MEMORY = 400_000  # KiB of address space (ulimit -v); with 150,000, OpenBLAS may
# try to allocate for ever without a message
# commands that only print
TELL = {
    "branches",
    "cases",
    "compare",
    "doctor",
    "inputs",
    "manual",
    "margin",
    "model",
    "response",
    "status",
}
TELLING = {"-h", "--help", "--version", "--dry-run", "--example"}  # so do these options
LAYOUT = {ord(c): " " for c in "\n\t\xa0"}  # white space allowed in arguments
TOGETHER = ("campaign", "gather", "doctor")  # commands that all ranks run
NO_THREAD = "can't start new thread"
NO_MEMORY = ("failed to map segment", "cannot allocate memory", "out of memory")
GOES_ON = ("--resume", "--restart", "--continue")  # options that others have


class _Parser(argparse.ArgumentParser):
    """argparse's parser, which raises `InputError`, so that an error is one line."""

    def error(self, message: str) -> NoReturn:
        """Raise InputError, instead of printing the usage and exiting."""
        raise InputError(f"{message}{self._hint(message)} (see {self.prog} --help)")

    def _hint(self, message: str) -> str:
        """Return what an unknown option may be: a similar one, or one not needed."""
        name = message.removeprefix("unrecognized arguments: ").split(" ")[0]
        if name == message.split(" ", maxsplit=1)[0] or not name.startswith("--"):
            return ""
        if name in GOES_ON:
            return "; the command that began a campaign continues it"
        return nearest(name, [*self._option_string_actions])


def run_command(words: Sequence[str], *, program: bool = False) -> int:
    """Run a sub-command and return its exit code.

    words : name of the command, and its arguments
    program : whether this process is the program `hpcwhirl`, not a caller in Python:
        then its streams are replaced, and its stdout is flushed at the end
    """
    if program:
        stand_in()
        os.environ["MPLBACKEND"] = "agg"  # no window is opened; a notebook sets others
    for name in THREADS:
        os.environ.setdefault(name, "1")
    try:
        code = int(_prepared(words)())
    except KeyboardInterrupt:
        if program:
            return INTERRUPTED
        raise
    except BaseException as failed:  # noqa: BLE001 - told, or raised again
        code = _code_after(failed, words, program=program)
    return _flushed(code, words) if program else code


def _code_after(failed: BaseException, words: Sequence[str], *, program: bool) -> int:
    """Print the error of a sub-command, and return the exit code.

    An exception that is no error, such as KeyboardInterrupt, is raised again.

    words : name of the command, and its arguments
    program : whether this process is the program `hpcwhirl`, which --help ends
    """
    if isinstance(failed, WhirlError):
        tell_error(failed)
        return code_of(failed)
    unread = failed.__context__ if isinstance(failed, SystemExit) else failed
    if isinstance(unread, BrokenPipeError):  # Rich raises SystemExit from it
        return _unread(words)
    if program and isinstance(failed, SystemExit):  # --help, --version
        return int(failed.code or COMPLETE)
    if isinstance(failed, Exception):  # Python's exit code 1 has a meaning here
        return tell_failure(failed)
    raise failed


def _flushed(code: int, words: Sequence[str]) -> int:
    """Write out what stdout has buffered, and return the final exit code.

    It is `code`, that of the sub-command, unless stdout cannot be written.

    words : name of the command, and its arguments
    """
    try:
        flush_stdout()
    except WhirlError as failed:
        if code not in (WRONG_INPUT, STOPPED):  # else an error was printed already
            tell_error(failed)
        return code or code_of(failed)
    except BrokenPipeError:
        return code or _unread(words)
    return code


def code_of(failed: BaseException) -> int:
    """Return the exit code for an error: `STOPPED` or `WRONG_INPUT`.

    `STOPPED` tells that the same command may succeed later, as after a full disk or
    quota, see `PASSING`.
    """
    passing = isinstance(failed, OSError) and failed.errno in PASSING
    return STOPPED if passing or isinstance(failed, NoRoomError) else WRONG_INPUT


def _unread(words: Sequence[str]) -> int:
    """Return the exit code if the reader of stdout has closed the pipe, as `head` does.

    It is 0 for a command that only prints, also by an option, 1 for others.

    words : name of the command, and its arguments
    """
    return COMPLETE if {*words[:1]} <= TELL or {*words} & TELLING else FAILED


def tell_error(failed: BaseException | str) -> None:
    """Print an error as one line on stderr."""
    say(f"error: {one_line(str(failed))}")


def tell_failure(failed: Exception) -> int:
    """Print an exception that is no `WhirlError` on stderr; return the exit code.

    Lack of memory, or a file that cannot be written, is one line; any other exception
    is a defect of the program and printed with its traceback.
    """
    message = str(failed).lower()
    lacking = isinstance(failed, ImportError | OSError) and any(
        words in message for words in NO_MEMORY
    )
    threadless = isinstance(failed, RuntimeError) and NO_THREAD in message
    if lacking or threadless or isinstance(failed, MemoryError):
        tell_error(f"not enough memory{_limit()}: {str(failed) or 'imports'}")
        return WRONG_INPUT
    if isinstance(failed, OSError) and (failed.filename or code_of(failed) == STOPPED):
        name = failed.filename or "a file cannot be written"  # close() names no file
        tell_error(f"{os.fsdecode(name)}: {failed.strerror}")
        return code_of(failed)
    traceback.print_exception(failed)
    return INTERNAL


def _limit() -> str:
    """Return " (ulimit -v N)" if this process's address space is limited, else ""."""
    most = resource.getrlimit(resource.RLIMIT_AS)[0]
    return "" if most == resource.RLIM_INFINITY else f" (ulimit -v {most >> 10})"


def _prepared(words: Sequence[str]) -> Callable[[], int]:
    """Check a sub-command's arguments; return the function that runs it.

    The function returns the exit code.

    words : name of the command, and its arguments
    """
    if not words or words[0].startswith("-"):
        return partial(_help, words)
    _check_words(words)
    _check_place()
    _check_memory()
    if words[0] not in TOGETHER and launched_ranks() > 1:
        if not launched_first():
            return partial(int, COMPLETE)  # rank 0 alone runs the command
        without_mpi()
    module = importlib.import_module(_command(words[0]))
    parser = _Parser(prog=f"hpcwhirl {words[0]}", description=COMMANDS[words[0]])
    module.arguments(parser)
    args = parser.parse_args(words[1:])
    if not (hasattr(args, "units") or words[0] == "campaign"):
        return partial(module.run, args)
    from hpcwhirl.cli.written import in_written_units

    return partial(in_written_units, module.run, args)


def _help(words: Sequence[str]) -> int:
    """Print the program's help or version; return the exit code without a command.

    words : arguments of the program, such as --version
    """
    parser = _parser()
    if words:
        parser.parse_args(words)
    parser.print_help()
    return WRONG_INPUT


def _check_words(words: Sequence[str]) -> None:
    """Raise InputError for arguments that are not UTF-8 or have control characters."""
    for word in words:
        try:
            word.encode()
        except UnicodeEncodeError:
            raise InputError(f"an argument must be UTF-8, got {shown(word)}") from None
        if not word.translate(LAYOUT).isprintable():
            msg = f"an argument must have no control characters, got {shown(word)}"
            raise InputError(msg)


def _check_place() -> None:
    """Raise InputError if the working directory was removed or cannot be used."""
    try:
        Path.cwd()
    except OSError as failed:
        msg = f"the working directory cannot be used: {failed.strerror}"
        raise InputError(msg) from None


def _check_memory() -> None:
    """Raise InputError if ``ulimit -v`` is so low that importing a library may hang."""
    most = resource.getrlimit(resource.RLIMIT_AS)[0]
    if most != resource.RLIM_INFINITY and most >> 10 < LEAST_MEMORY:
        msg = f"not enough memory{_limit()}: at least {LEAST_MEMORY} KiB are needed"
        raise InputError(msg)


def _parser() -> argparse.ArgumentParser:
    from hpcwhirl import __version__
    from hpcwhirl.cli.completion import SHELLS, Completion, ManPage

    parser = _Parser(
        prog="hpcwhirl",
        description="Whirl of a bladed disk in contact with its casing.",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=__version__)
    parser.add_argument(
        "--completion", action=Completion, choices=SHELLS, metavar="SHELL",
        help=f"print the completion of a shell, {', '.join(SHELLS)}, and end",
    )  # fmt: skip
    parser.add_argument(
        "--man", action=ManPage, nargs=0, help="print the man page, in roff, and end"
    )
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


class _Deaf(io.FileIO):
    """Unbuffered stream for stderr, which drops data that cannot be written."""

    def write(self, data: Any) -> int:
        """Write data, or drop them if that fails; return their number of bytes."""
        try:
            return super().write(data)
        except OSError:
            return memoryview(data).nbytes


class _Strict(io.FileIO):
    """Unbuffered stream for stdout, which raises MissingFileError if a write fails.

    If the reader has closed the pipe, it raises BrokenPipeError.
    """

    def write(self, data: Any) -> int:
        """Write data as `io.FileIO` does; return the number of bytes written."""
        try:
            return super().write(data)
        except BrokenPipeError:
            raise
        except OSError as failed:
            msg = f"cannot write stdout: {failed.strerror}"
            raise unwritable(msg, failed) from None


def stand_in() -> None:
    """Make the standard streams safe at the start of the program.

    A closed descriptor 0, 1 or 2 is opened on the null device: otherwise the next file
    opened, such as a journal, would get its number and receive messages. `sys.stdout`
    becomes a stream that reports a failed write as MissingFileError, `sys.stderr` one
    that drops what cannot be written: a log on a full disk must not end a campaign.
    """
    for number in (0, 1, 2):
        try:
            os.fstat(number)
        except OSError:
            free = os.open(os.devnull, os.O_RDWR)  # gets the lowest free number: this
            os.set_inheritable(free, True)  # noqa: FBT003
    words = sys.stdout.encoding if sys.stdout is not None else "utf-8"
    strict = _Strict(1, "wb", closefd=False)
    sys.stdout = io.TextIOWrapper(
        io.BufferedWriter(strict), words, "backslashreplace",
        line_buffering=strict.isatty(),
    )  # fmt: skip
    words = sys.stderr.encoding if sys.stderr is not None else "utf-8"
    sys.stderr = io.TextIOWrapper(
        _Deaf(2, "wb", closefd=False),
        words, "backslashreplace", line_buffering=True, write_through=True,
    )  # fmt: skip


def _tell_late(number: int) -> None:
    """Raise MissingFileError if earlier writes failed without an error.

    A file server may report a full disk only when a file is closed. Closing a duplicate
    of the descriptor makes it do so, and leaves the stream open.

    number : descriptor of the stream
    """
    try:
        os.close(os.dup(number))
    except OSError as failed:
        if failed.errno in PASSING:
            msg = f"cannot write stdout: {failed.strerror}"
            raise unwritable(msg, failed) from None


def flush_stdout() -> None:
    """Write out what stdout has buffered; tell the caller if that fails.

    Raises
    ------
    MissingFileError
        if stdout cannot be written
    BrokenPipeError
        if the reader of stdout has closed the pipe
    """
    try:
        sys.stdout.flush()
        _tell_late(1)
    except OSError:
        # the buffer is lost; the interpreter must not try to flush it again at its end
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        raise


def add_option(
    parser: argparse._ActionsContainer,
    usage: str,
    told: str,
    *,
    default: Any = None,
    **how: Any,
) -> None:
    """Add an option to a command's parser.

    Parameters
    ----------
    parser : parser or group of options
    usage : the option's names, separated by bars, and its value, as ``--at NAME=V``;
        without a value the option is a flag
    told : help text of the option
    default : default value; a number also sets the option's type, a list means that
        the option may be repeated
    how : further arguments of argparse's `add_argument`
    """
    names, _, shape = usage.partition(" ")
    if not shape:
        how = {"action": "store_true"} | how
    else:
        how |= {"metavar": shape, "default": default}
        if isinstance(default, list):
            how = {"action": "append"} | how
        elif isinstance(default, int | float):
            how = {"type": type(default)} | how
    parser.add_argument(*names.split("|"), help=told, **how)
