"""Exceptions of hpcwhirl, and functions that write their messages.

A message says what is wrong, the value given, and what is allowed. Every class also
derives from a builtin exception, so that a caller may catch either. `say` prints
progress and warnings on stderr.
"""

from __future__ import annotations

import difflib
import errno
import os
import reprlib
import sys
import unicodedata
from collections.abc import Collection, Iterable, Mapping
from pathlib import Path
from typing import Any

COMPLETE, FAILED, WRONG_INPUT, INTERNAL, STOPPED = 0, 1, 2, 70, 75  # exit codes
LONGEST = 2000  # largest number of characters of a message
SHOWN = 100  # largest number of characters of a value repeated in a message
FORMULA = (
    "=",
    "+",
    "-",
    "@",
    "\t",
    "\r",
)  # first characters of a spreadsheet's formula
SURE = 3  # characters of a beginning that tell which name was meant
# errno of temporary failures, which end once someone frees space or remounts the file
# system; a file server may report them in any call, as late as fsync or close
PASSING = {errno.ENOSPC, errno.EDQUOT, errno.EROFS}


class WhirlError(Exception):
    """Base class of all exceptions that hpcwhirl raises on purpose.

    The text of such an exception is printed as one line, without a traceback.
    """

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
    """A structural model fails a check of its matrices; the message gives the miss."""


class CaseError(WhirlError, RuntimeError):
    """One case of a campaign failed; the other cases are still integrated."""


class StoppedError(WhirlError, RuntimeError):
    """A campaign was stopped early; ended cases are kept, the same call resumes it."""


def unwritable(message: str, failed: OSError | int) -> MissingFileError:
    """Return the exception to raise for a file or directory that cannot be written.

    It is a `NoRoomError` if the cause is temporary, such as a full disk, else a
    `MissingFileError`.

    Parameters
    ----------
    message : text of the exception
    failed : the exception of the operating system, or its errno
    """
    number = failed if isinstance(failed, int) else failed.errno
    return NoRoomError(message) if number in PASSING else MissingFileError(message)


def unreadable(path: Path | str, failed: OSError) -> MissingFileError:
    """Return the exception to raise for an existing file that cannot be read.

    failed : the exception of the operating system, or that of h5py with its number
    """
    why = os.strerror(failed.errno) if failed.errno else failed
    return MissingFileError(f"cannot read {path}: {why}")


def cases_told(count: int) -> str:
    """Return a number of cases as text, such as "1 case" or "22 cases"."""
    return number_told(count, "case")


def twins_told(count: int) -> str:
    """Return a number of twins as text, such as "1 twin" or "64 twins"."""
    return number_told(count, "twin")


def number_told(count: int, noun: str) -> str:
    """Return a number of things as text, such as "1 rank" or "64 ranks"."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def one_line(text: str, most: int = LONGEST) -> str:
    """Return a text as one line of at most `most` characters, for a message.

    Control characters are escaped; the middle of a longer text is replaced by the
    number of characters left out.
    """
    if len(text) > most:
        cut = len(text) - most
        text = f"{text[: most // 2]} ({cut} characters) {text[-most // 2 :]}"
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)


def legible(text: str) -> str:
    """Return a text for printing, with control characters escaped.

    Line feeds and tabs are kept.
    """
    if text.isprintable():
        return text
    return "".join(
        c
        if c.isprintable() or c in "\n\t" or unicodedata.category(c) == "Zs"
        else ascii(c)[1:-1]
        for c in text
    )


def csv_cell(value: Any) -> Any:
    """Return a value for a CSV file that a spreadsheet may open.

    A text that a spreadsheet would take for a formula gets an apostrophe in front;
    control characters are escaped. Numbers, also those written as texts, are unchanged.
    """
    if not isinstance(value, str):
        return value
    if value.startswith(FORMULA) and not is_number(value):
        value = f"'{value}"
    return legible(value)


def is_number(text: str) -> bool:
    """Return whether a text is a number as Python writes it."""
    try:
        float(text)
    except ValueError:
        return False
    return True


def text_of(failed: BaseException) -> str:
    """Return class and message of an exception as text, even if ``__str__`` raises."""
    try:
        return f"{type(failed).__name__}: {failed}"
    except BaseException as worse:  # noqa: BLE001 - the class may be a user's
        why = type(worse).__name__
        return f"{type(failed).__name__}, whose text cannot be printed: {why}"


class _Short(reprlib.Repr):
    """Formatter of Python values for messages: `repr`, with long values cut short."""

    def __init__(self) -> None:
        super().__init__()
        self.maxstring = self.maxother = self.maxlong = SHOWN
        self.maxdict = self.maxlist = self.maxtuple = 8

    def repr_int(self, x: int, level: int) -> str:
        """Return the digits of an integer, or its number of bits if it is huge.

        Python refuses to print an integer of over 4,300 digits.
        """
        if x.bit_length() > 300:
            return f"a whole number of {x.bit_length()} bits"
        return super().repr_int(x, level)


def shown(value: Any) -> str:
    """Return the shortened `repr` of a value, on one line, for a message."""
    return one_line(_Short().repr(value), 4 * SHOWN)


def nearest(word: str, known: Iterable[str]) -> str:
    """Return a hint at a misspelt name, ``"; did you mean 'x'?"``, for a message.

    x is the first shortest name in `known` that begins with `word`, or has it as last
    part, else the one that is most similar; the hint is empty if none is similar.
    """
    names = list(known)
    longer = [n for n in names if n.startswith(word) or n.endswith(f".{word}")]
    matches = [min(longer, key=len)] if longer and len(word) >= SURE else []
    matches = matches or difflib.get_close_matches(word, names, n=1, cutoff=0.6)
    return f"; did you mean '{matches[0]}'?" if matches else ""


def unknown(what: str, word: str, known: Iterable[str]) -> InputError:
    """Return the exception for a name that is not among the names allowed.

    Parameters
    ----------
    what : kind of thing that is named, such as "option", for the message
    word : the name that was given
    known : allowed names; the message has the most similar one, or a list of all
    """
    names = list(known)
    word = one_line(word, SHOWN)
    hint = nearest(word, names) or f"; known: {listed(sorted(names))}"
    return InputError(f"unknown {what} '{word}'{hint}")


def as_table(what: str, given: Any, known: Collection[str] = ()) -> Mapping[str, Any]:
    """Check that a user's value is a table with known keys, and return it unchanged.

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


def listed(names: list[str]) -> str:
    """Return names joined by commas, for a message; of too many, only the first.

    The first names are then followed by the number of those left out.
    """
    first: list[str] = []
    room = 3 * SHOWN
    for name in names:
        room -= len(name) + 2
        if room < 0:
            return f"{', '.join(first)} and {len(names) - len(first)} more"
        first.append(name)
    return ", ".join(first)


def say(text: str) -> None:
    """Write one line of plain text, such as a warning, on stderr, and flush it.

    Results of commands go to stdout, so they never mix with these lines.
    """
    sys.stderr.write(f"hpcwhirl: {text}\n")
    sys.stderr.flush()
