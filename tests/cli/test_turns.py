"""Tests that take turns: no row is left out for long, and no law in any turn."""

from dataclasses import dataclass
from pathlib import Path

import pytest
import turns
from turns import TURNS


@dataclass(frozen=True)
class Item:
    """What `turns` asks of a test that pytest has collected."""

    path: Path
    name: str
    mark: str = "turns"

    def get_closest_marker(self, name):
        return name == self.mark


def kept(items):
    """Return the tests of each turn."""
    return [turns.kept(items, turn) for turn in range(TURNS)]


@pytest.mark.parametrize("count", [1, 5, 6, 7, 40])
def test_every_row_has_its_turn_and_every_turn_a_row(count):
    rows = [Item(Path("a.py"), f"test_law[{n}]") for n in range(count)]
    shares = kept(rows)
    assert count < TURNS or all(shares)
    assert {row for share in shares for row in share} == set(rows)
    assert sum(map(len, shares)) < count + TURNS


def test_a_scene_has_the_same_turn_in_every_law():
    laws = [
        [Item(Path("a.py"), f"test_{law}[{n}]") for n in range(40)]
        for law in ("one", "two")
    ]
    for share in kept([*laws[0], *laws[1]]):
        one, two = (
            {item.name.partition("[")[2] for item in share if item in law}
            for law in laws
        )
        assert one == two


def test_what_has_no_mark_is_always_asked_and_slow_tests_take_turns():
    plain = [Item(Path("a.py"), f"test_plain[{n}]", "oracle") for n in range(9)]
    costly = [Item(Path("a.py"), f"test_costly_{n}", "slow") for n in range(30)]
    shares = kept(plain + costly)
    assert all(share[: len(plain)] == plain for share in shares)
    taken = [item for share in shares for item in share[len(plain) :]]
    assert {*taken} == {*costly}
    assert len(taken) < len(costly) + TURNS


def test_all_are_what_turns_leave_out_and_the_evidence():
    tests = [
        Item(Path("a.py"), "test_a", mark)
        for mark in ("turns", "slow", "evidence", "mpi")
    ]
    assert turns.kept(tests, turns.ALL) == tests[:3]


@pytest.mark.parametrize(
    ("shallow", "want"), [("false", 1234 % TURNS), ("true", 0xABCDEF12 % TURNS)]
)
def test_the_commit_gives_the_turn_in_a_shallow_clone_too(shallow, want):
    answers = {turns.SHALLOW: shallow, turns.COUNT: "1234", turns.HEAD: "abcdef12"}
    assert turns.turn_of_commit(answers.get) == want
