"""Errors of hpcwhirl: each says what, what was got and what is allowed.

Every class is also a builtin, so that a caller may catch either.
"""

from __future__ import annotations

import difflib
import errno
import reprlib
from collections.abc import Collection, Iterable, Mapping
from typing import Any

LONGEST = 2000  # characters of a message
SHOWN = 100  # characters of a value that a message repeats
PASSING = {errno.ENOSPC, errno.EDQUOT}  # of what ends when someone makes room


class WhirlError(Exception):
    """Base of every error that hpcwhirl raises on purpose; its text is one line."""

    def __str__(self) -> str:
        """Return the message, whatever an input put into it, as one line."""
        return one_line(super().__str__())


class InputError(WhirlError, ValueError):
    """A user's input is wrong: what, got, allowed."""


class MissingFileError(WhirlError, OSError):
    """A file or directory is missing, unreadable or cannot be written."""


class NoRoomError(MissingFileError):
    """A file cannot be written for want of room: that may pass."""


class StoreError(WhirlError, ValueError):
    """A stored file is damaged or is not what it claims to be."""


class ModelError(WhirlError, ArithmeticError):
    """A structural model contradicts itself; the message gives the miss."""


class CaseError(WhirlError, RuntimeError):
    """One case of a campaign failed; the others go on."""


class StoppedError(WhirlError, RuntimeError):
    """A campaign ended early: finished cases are kept, the same call continues."""


def unwritable(told: str, failed: OSError | int) -> MissingFileError:
    """Return the error of what cannot be written; its class tells if it may pass.

    Parameters
    ----------
    told : the message
    failed : what the system said, or its number
    """
    number = failed if isinstance(failed, int) else failed.errno
    return NoRoomError(told) if number in PASSING else MissingFileError(told)


def one_line(text: str, most: int = LONGEST) -> str:
    """Return a text without control characters, of a long one its two ends."""
    if len(text) > most:
        cut = len(text) - most
        text = f"{text[: most // 2]} ({cut} characters) {text[-most // 2 :]}"
    if text.isprintable():
        return text
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in text)


class _Short(reprlib.Repr):
    """Values as in Python, shortened."""

    def __init__(self) -> None:
        super().__init__()
        self.maxstring = self.maxother = self.maxlong = SHOWN
        self.maxdict = self.maxlist = self.maxtuple = 8

    def repr_int(self, x: int, level: int) -> str:
        """Return a number; Python itself refuses to print one of 4,300 digits."""
        if x.bit_length() > 300:
            return f"a whole number of {x.bit_length()} bits"
        return super().repr_int(x, level)


def shown(value: Any) -> str:
    """Return a value as a message repeats it: short, on one line."""
    return one_line(_Short().repr(value), 4 * SHOWN)


def nearest(word: str, known: Iterable[str]) -> str:
    """Return ``"; did you mean 'x'?"`` for the nearest known name, or ``""``."""
    found = difflib.get_close_matches(word, list(known), n=1, cutoff=0.5)
    return f"; did you mean '{found[0]}'?" if found else ""


def unknown(what: str, word: str, known: Iterable[str]) -> InputError:
    """Return the error for an unknown name, with the nearest known one."""
    names = sorted(known)
    word = one_line(word, SHOWN)
    hint = nearest(word, names) or f"; known: {_listed(names)}"
    return InputError(f"unknown {what} '{word}'{hint}")


def as_table(what: str, given: Any, known: Collection[str] = ()) -> Mapping[str, Any]:
    """Return a table as it was given.

    Parameters
    ----------
    what : its name in the message
    given : a table, or what stands in its place
    known : the keys that it may have; none: what they are is not asked

    Raises
    ------
    InputError
        where it is no table, or has another key
    """
    if not isinstance(given, Mapping):
        msg = f"{what} must be a table, got {shown(given)}"
        raise InputError(msg)
    for key in given if known else ():
        if key not in known:
            raise unknown(f"key in {what}", key, known)
    return given


def _listed(names: list[str]) -> str:
    """Return names by commas, of very many the first ones and how many there are."""
    told: list[str] = []
    room = 3 * SHOWN
    for name in names:
        room -= len(name) + 2
        if room < 0:
            return f"{', '.join(told)} and {len(names) - len(told)} more"
        told.append(name)
    return ", ".join(told)
