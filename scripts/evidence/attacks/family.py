"""What a family of attacks is, and what is known of a try."""

from __future__ import annotations

import random
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from attacks.apart import Ended

LONGEST = 500  # characters of a line that a person is to read
LINES = 400  # of progress and notes; more says that input was repeated
NOTE = re.compile(r"hpcwhirl: (preset |.*: a campaign's \[.* ignored: )")
HUGE = 2 << 30  # bytes that no campaign of a few ms needs


@dataclass(frozen=True)
class Verdict:
    """What became of one try.

    Attributes
    ----------
    what : the attack in a few words
    wrong : what was broken by it, "" where it was survived
    skipped : why it could not be tried here, "" where it was
    weight : how many attacks it was, e.g. several kills of one campaign
    """

    what: str
    wrong: str = ""
    skipped: str = ""
    weight: int = 1


class Chance(random.Random):
    """The random generator of one try, which also knows the try's number."""

    number = 0


Attempt = Callable[[Any, random.Random, Path], Verdict]


@dataclass(frozen=True)
class Family:
    """A kind of attack.

    Attributes
    ----------
    name, title : short, and for the table
    count : how many attacks are demanded
    prepare : of a directory: what all tries share
    attempt : of that, a random generator of the try's own and a directory
    env : what the environment is to hold before anything is imported
    """

    name: str
    title: str
    count: int
    prepare: Callable[[Path], Any]
    attempt: Attempt
    env: Mapping[str, str] = field(default_factory=dict)


def fault(ended: Ended, allowed: tuple[int, ...], most: int = LONGEST) -> str:
    """Return what is wrong with how a command ended, "" where nothing is.

    It must end by itself with an allowed code, without a traceback, in lines of at most
    `most` characters that a person can read, and without taking the machine's memory.
    """
    told = f": {ended.last}" if ended.last else ""
    lines = ended.err.split("\n")
    longest = max(map(len, lines))
    odd = sorted({c for c in ended.err if ord(c) < 32 and c not in "\n\t"})
    found = [
        (ended.hung, "hung"),
        ("Traceback" in ended.err, f"traceback, exit {ended.code}{told}"),
        (ended.code < 0, f"died of signal {-ended.code}{told}"),
        (ended.code not in allowed, f"exit {ended.code}{told}"),
        (longest > most, f"a line of {longest} characters"),
        (len(lines) > LINES, f"{len(lines)} lines on stderr"),
        (bool(odd), f"control characters {odd!r} on stderr"),
        (ended.peak > HUGE, f"took {ended.peak / 1e9:.2g} GB"),
    ]
    return next((text for broken, text in found if broken), "")


def refusal(
    ended: Ended, allowed: tuple[int, ...] = (0, 2), most: int = LONGEST
) -> str:
    """Return `fault`, or that a refusal is not the one line that it should be."""
    wrong = fault(ended, allowed, most)
    lines = [t for t in ended.err.split("\n") if t and not NOTE.match(t)]
    if not wrong and ended.code == 2 and len(lines) != 1:
        wrong = f"{len(lines)} lines on stderr for one mistake"
    if not wrong and ended.code == 2 and not lines[0].startswith("hpcwhirl: error: "):
        wrong = f"told as {lines[0][:80]!r}"
    return wrong
