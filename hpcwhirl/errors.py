"""Errors of hpcwhirl: each message says what is wrong, the value, and what is allowed.

Every class also derives from a builtin exception, so that a caller may catch either.
`say` prints lines beside the results of a command: progress and warnings.
"""

from __future__ import annotations

import difflib
import errno
import reprlib
import sys
import unicodedata
from collections.abc import Collection, Iterable, Mapping
from pathlib import Path
from typing import Any

COMPLETE, FAILED, WRONG_INPUT, INTERNAL, STOPPED = 0, 1, 2, 70, 75  # exit codes
LONGEST = 2000  # largest number of characters of a message
SHOWN = 100  # largest number of characters of a value repeated in a message
# errno of temporary failures, which end once someone frees space or remounts the file
# system; a file server may report them in any call, as late as fsync or close
PASSING = {errno.ENOSPC, errno.EDQUOT, errno.EROFS}


class WhirlError(Exception):
    """Base of every error that hpcwhirl raises on purpose; its text is one line."""

    def __str__(self) -> str:
        """Return the message as one line, with control characters of inputs escaped."""
        return one_line(super().__str__())


class InputError(WhirlError, ValueError):
    """A user's input is wrong; the message names it, its value and what is allowed."""


class MissingFileError(WhirlError, OSError):
    """A file or directory is missing, unreadable or cannot be written."""


class NoRoomError(MissingFileError):
    """A file cannot be written for a temporary reason, such as a full disk."""


class StoreError(WhirlError, ValueError):
    """A stored file is damaged or is not what it claims to be."""


class ModelError(WhirlError, ArithmeticError):
    """A structural model fails a consistency check; the message says by how much."""


class CaseError(WhirlError, RuntimeError):
    """One case of a campaign failed; the other cases are still integrated."""


class StoppedError(WhirlError, RuntimeError):
    """A campaign was stopped early; ended cases are kept, the same call resumes it."""


def unwritable(message: str, failed: OSError | int) -> MissingFileError:
    """Return the error for an unwritable file, `NoRoomError` for a temporary cause.

    Parameters
    ----------
    message : text of the error
    failed : the exception of the operating system, or its errno
    """
    number = failed if isinstance(failed, int) else failed.errno
    return NoRoomError(message) if number in PASSING else MissingFileError(message)


def unreadable(path: Path | str, failed: OSError) -> MissingFileError:
    """Return the error for an existing file that cannot be read.

    failed : the exception of the operating system
    """
    return MissingFileError(f"cannot read {path}: {failed.strerror or failed}")


def one_line(text: str, most: int = LONGEST) -> str:
    """Return a text with control characters escaped, its middle cut out if too long.

    most : largest number of characters
    """
    if len(text) > most:
        cut = len(text) - most
        text = f"{text[: most // 2]} ({cut} characters) {text[-most // 2 :]}"
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)


def legible(text: str) -> str:
    """Return a text with control characters escaped, except line feeds and tabs."""
    if text.isprintable():
        return text
    return "".join(
        c
        if c.isprintable() or c in "\n\t" or unicodedata.category(c) == "Zs"
        else ascii(c)[1:-1]
        for c in text
    )


def text_of(failed: BaseException) -> str:
    """Return an exception's class and message as text, even if ``__str__`` raises."""
    try:
        return f"{type(failed).__name__}: {failed}"
    except BaseException as worse:  # noqa: BLE001 - the class may be a user's
        why = type(worse).__name__
        return f"{type(failed).__name__}, whose text cannot be printed: {why}"


class _Short(reprlib.Repr):
    """Formatter of Python values for messages: `repr`, shortened."""

    def __init__(self) -> None:
        super().__init__()
        self.maxstring = self.maxother = self.maxlong = SHOWN
        self.maxdict = self.maxlist = self.maxtuple = 8

    def repr_int(self, x: int, level: int) -> str:
        """Format an integer; Python refuses to print one of over 4,300 digits."""
        if x.bit_length() > 300:
            return f"a whole number of {x.bit_length()} bits"
        return super().repr_int(x, level)


def shown(value: Any) -> str:
    """Return the shortened `repr` of a value, on one line, for a message."""
    return one_line(_Short().repr(value), 4 * SHOWN)


def nearest(word: str, known: Iterable[str]) -> str:
    """Return ``"; did you mean 'x'?"``, x the name in `known` nearest to `word`.

    The text is empty if no name is near.
    """
    matches = difflib.get_close_matches(word, list(known), n=1, cutoff=0.5)
    return f"; did you mean '{matches[0]}'?" if matches else ""


def unknown(what: str, word: str, known: Iterable[str]) -> InputError:
    """Return the error "unknown WHAT 'WORD'", with the nearest of the known names."""
    names = sorted(known)
    word = one_line(word, SHOWN)
    hint = nearest(word, names) or f"; known: {_listed(names)}"
    return InputError(f"unknown {what} '{word}'{hint}")


def as_table(what: str, given: Any, known: Collection[str] = ()) -> Mapping[str, Any]:
    """Return a value unchanged after checking that it is a table with known keys.

    Parameters
    ----------
    what : name of the table in the message
    given : the value to check
    known : allowed keys; empty: any key is allowed

    Raises
    ------
    InputError
        if the value is no mapping, or has a key that is not allowed
    """
    if not isinstance(given, Mapping):
        raise InputError(f"{what} must be a table, got {shown(given)}")
    for key in given if known else ():
        if key not in known:
            raise unknown(f"key in {what}", key, known)
    return given


def _listed(names: list[str]) -> str:
    """Join names by commas; if too many, the first and the number of the others."""
    first: list[str] = []
    room = 3 * SHOWN
    for name in names:
        room -= len(name) + 2
        if room < 0:
            return f"{', '.join(first)} and {len(names) - len(first)} more"
        first.append(name)
    return ", ".join(first)


def say(text: str) -> None:
    """Write a line of plain text on stderr, where no results are; flush it."""
    sys.stderr.write(f"hpcwhirl: {text}\n")
    sys.stderr.flush()
