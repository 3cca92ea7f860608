"""Errors of hpcwhirl: each says what, what was got and what is allowed.

Every class is also a builtin, so that a caller may catch either.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class WhirlError(Exception):
    """Base of every error that hpcwhirl raises on purpose."""


class InputError(WhirlError, ValueError):
    """A user's input is wrong: what, got, allowed."""


class MissingFileError(WhirlError, OSError):
    """A file or directory is missing, unreadable or cannot be written."""


class StoreError(WhirlError, ValueError):
    """A stored file is damaged or is not what it claims to be."""


class ModelError(WhirlError, ArithmeticError):
    """A structural model contradicts itself; the message gives the miss."""


class CaseError(WhirlError, RuntimeError):
    """One case of a campaign failed; the others go on."""


def nearest(word: str, known: Iterable[str]) -> str:
    """Return ``"; did you mean 'x'?"`` for the nearest known name, or ``""``."""
    found = difflib.get_close_matches(word, list(known), n=1, cutoff=0.5)
    return f"; did you mean '{found[0]}'?" if found else ""


def unknown(what: str, word: str, known: Iterable[str]) -> InputError:
    """Return the error for an unknown name, with the nearest known one."""
    names = sorted(known)
    hint = nearest(word, names) or f"; known: {', '.join(names)}"
    return InputError(f"unknown {what} '{word}'{hint}")
