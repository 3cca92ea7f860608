"""What a family of attacks is, and how the end of a command is judged."""

from __future__ import annotations

import random
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from attacks.process import Ended

LONGEST = 500  # characters of a line that a person is to read
LINES = 400  # of progress and notes; more says that input was repeated
NOTE = re.compile(r"hpcwhirl: (preset |.*: a campaign's \[.* ignored: )")
HUGE = 2 << 30  # bytes that no campaign of a few ms needs


@dataclass(frozen=True)
class Verdict:
    """What became of one try.

    Attributes
    ----------
    what : the attack in a few words; up to a colon, its kind
    wrong : what was broken by it, "" where it was survived
    skipped : why it could not be tried here, "" where it was
    """

    what: str
    wrong: str = ""
    skipped: str = ""


class Chance(random.Random):
    """The random generator of one try, which also knows the try's number."""

    number = 0

    def weighted(self, weights: Mapping[Any, float]) -> Any:
        """Return one of the keys, by their weights."""
        return self.choices(list(weights), list(weights.values()))[0]


@dataclass(frozen=True)
class Family:
    """A kind of attack.

    Attributes
    ----------
    title : for the table
    count : tries of a whole run
    prepare : called with a directory; returns what all tries share
    attempt : called with that, a generator of the try's own and a directory
    env : what the environment has to hold before anything is imported
    """

    title: str
    count: int
    prepare: Callable[[Path], Any]
    attempt: Callable[[Any, Chance, Path], Verdict]
    env: Mapping[str, str] = field(default_factory=dict)


def fault(ended: Ended, allowed: Iterable[int], most: int = LONGEST) -> str:
    """Return what is wrong with how a command ended, "" where nothing is.

    It must end by itself with an allowed code, without a traceback, in lines of at most
    `most` characters that a person can read, and without taking the machine's memory.
    """
    last = f": {ended.last}" if ended.last else ""
    lines = ended.err.split("\n")
    longest = max(map(len, lines))
    odd = controls(ended.err)
    faults = {
        "hung": ended.hung,
        f"traceback, exit {ended.code}{last}": "Traceback" in ended.err,
        f"died of signal {-ended.code}{last}": ended.code < 0,
        f"exit {ended.code}{last}": ended.code not in allowed,
        f"a line of {longest} characters": longest > most,
        f"{len(lines)} lines on stderr": len(lines) > LINES,
        f"control characters {odd!r} on stderr": bool(odd),
        f"took {ended.peak / 1e9:.2g} GB": ended.peak > HUGE,
    }
    return next((text for text, broken in faults.items() if broken), "")


def controls(text: str) -> list[str]:
    """Return the characters that steer a terminal."""
    return sorted({c for c in text if ord(c) < 32 and c not in "\n\t"})


def refusal(ended: Ended, allowed: Iterable[int] = (0, 2), most: int = LONGEST) -> str:
    """Return `fault`, or that a refusal is not the one line that it should be."""
    wrong = fault(ended, allowed, most)
    lines = [t for t in ended.err.split("\n") if t and not NOTE.match(t)]
    if wrong or ended.code != 2:
        return wrong
    if len(lines) != 1:
        return f"{len(lines)} lines on stderr for one mistake"
    right = lines[0].startswith("hpcwhirl: error: ")
    return "" if right else f"refused as {lines[0][:80]!r}"


def first(faults: Iterable[str]) -> str:
    """Return the first of some faults that is one, "" where none is."""
    return next(filter(None, faults), "")
