"""Costly tests that take turns: each commit asks a part of them, `TURNS` commits all.

They are marked `slow` (more than 2 s of the processor) or `turns` (a fifth of a second,
or a grid of more than half a second). A row stays in the turn that its name gives, so
that the laws of one table ask the same scenes in a turn and share what these have
computed.
"""

import subprocess
from pathlib import Path
from zlib import crc32

import pytest

TURNS = 6
ALL = "all"
MARKS = "turns", "slow"
COUNT = "git", "rev-list", "--count", "HEAD"
HEAD = "git", "rev-parse", "--short=8", "HEAD"
SHALLOW = "git", "rev-parse", "--is-shallow-repository"
ROOT = Path(__file__).parents[2]


class Turn:
    """A plugin of pytest: of the tests that options have chosen, those of a turn."""

    def __init__(self, number):
        self.number = number

    @classmethod
    def of(cls, word):
        """Return the turn of an option: `commit`, `all`, or a number."""
        if word == ALL:
            return cls(ALL)
        return cls(turn_of_commit() if word == "commit" else int(word) % TURNS)

    def pytest_report_header(self):
        return f"turn {self.number} of {TURNS}"

    @pytest.hookimpl(trylast=True)
    def pytest_collection_modifyitems(self, config, items):
        asked = kept(items, self.number)
        config.hook.pytest_deselected(items=[*{*items} - {*asked}])
        items[:] = asked


def turn_of_commit(ask=None):
    """Return the turn of the commit: its number; of a shallow clone, its digest.

    ask : function of the words of a command of git -> its answer
    """
    ask = ask or answer
    if ask(SHALLOW) == "true":
        return int(ask(HEAD), 16) % TURNS
    return int(ask(COUNT)) % TURNS


def answer(words):
    """Return what git says of this clone."""
    run = subprocess.run(words, cwd=ROOT, capture_output=True, text=True, check=True)
    return run.stdout.strip()


def asked(rows, turn):
    """Return those of a grid's rows that are asked in a turn.

    Of `TURNS` rows or more one at least: no law is left out of a turn.
    """
    own = [row for row in rows if crc32(row.encode()) % TURNS == turn]
    return own or rows[turn % len(rows) :][: len(rows) >= TURNS]


def kept(items, turn):
    """Return the tests of a turn: those that take turns by `asked`, and all others.

    The rows of one test are a grid; tests without rows are one together. `ALL` are
    those that take turns and the evidence: what a turn leaves out, at least.
    """
    if turn == ALL:
        return [item for item in items if takes_turns(item, *MARKS, "evidence")]
    grids = {}
    for item in items:
        if takes_turns(item):
            grid, row = grid_of(item)
            grids.setdefault(grid, {}).setdefault(row, []).append(item)
    chosen = {
        item
        for rows in grids.values()
        for row in asked([*rows], turn)
        for item in rows[row]
    }
    return [item for item in items if item in chosen or not takes_turns(item)]


def takes_turns(item, *marks):
    """Return whether a test has one of some marks, by default of `MARKS`."""
    return any(map(item.get_closest_marker, marks or MARKS))


def grid_of(item):
    """Return the grid of a test and its row there."""
    name, _, row = item.name.partition("[")
    return ((item.path, name), row) if row else ("", f"{item.path.name} {name}")
