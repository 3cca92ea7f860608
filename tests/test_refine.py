"""Refinement: the set of cases is the fixed point of a rule on words alone."""

import functools
import random

import pytest

from hpcwhirl.refinement.growth import Growth
from hpcwhirl.refinement.lattice import Lattice, Side
from hpcwhirl.refinement.tree import MOST


def lattice_of(*sides, depth=3):
    """Return a lattice of so many coarse values along each input, all as deep."""
    return Lattice(
        tuple(
            Side(f"i{j}", tuple(map(float, range(n))), (depth,) * (n - 1))
            for j, n in enumerate(sides)
        )
    )


def uneven():
    """Return a lattice with other depths in each interval."""
    x = Side("x", (0.0, 1.0, 5.0, 6.0), (1, 3, 0))
    return Lattice((x, Side("y", (0.0, 2.0, 3.0), (2, 1))))


def half_plane(at):
    return "a" if at[0] + 0.37 * sum(at[1:]) < 1.618 else "b"


def circle(at):
    away = sum((x - 1.5) ** 2 for x in at)
    return "in" if away < 0.9 else "out"


def tongue(at):
    return "t" if abs(at[0] - 1.41 - 0.21 * at[-1]) < 0.09 else "a"


def speckle(at):
    if at[0] < 1.3:
        return "a"
    return "ab"[random.Random(repr(at)).random() < 0.5]


def holes(at):
    """Some cases end without a word."""
    if random.Random(repr(at)).random() < 0.15:
        return None
    return half_plane(at)


FIELDS = [half_plane, circle, tongue, speckle, holes]
LATTICES = [
    lattice_of(4, depth=5),
    lattice_of(3, 3),
    uneven(),
    lattice_of(3, 2, 2, depth=2),
]


def place(lattice, point):
    return tuple(s.value(x) for s, x in zip(lattice.sides, point, strict=True))


def worded(lattice, field, second=None):
    """Return {(fidelity, point): word} as a function; the second may be another one."""

    @functools.cache
    def word(fidelity, point):
        return (second if fidelity else field)(place(lattice, point))

    return word


class Brute:
    """All of the rules applied to all cells again and again, with all words known."""

    def __init__(self, lattice, word, levels, confirm):
        self.lattice, self.word, self.levels = lattice, word, levels
        self.confirm = confirm
        self.cells = set(lattice.coarse())
        self.split, self.opened = set(), set()
        while self.once():
            pass

    def points(self):
        return {p for cell in self.cells for p in self.lattice.corners(cell)}

    def confirmed(self):
        return {p for cell in self.opened for p in self.lattice.corners(cell)}

    def once(self):
        before = len(self.cells), len(self.opened)
        first, second = self.points(), self.confirmed()
        changed = {
            p for p in second
            if None not in (self.word(0, p), self.word(1, p))
            and self.word(0, p) != self.word(1, p)
        }  # fmt: skip
        for cell in list(self.cells):
            if self.blocked(cell):
                continue
            mixed = self.differ(0, self.inside(cell, first))
            mixed |= self.differ(1, self.inside(cell, second))
            end = self.lattice.at_end(cell)
            if not end and (mixed or self.is_demanded(cell)):
                self.split.add(cell)
                self.cells |= set(self.lattice.children(cell))
            around = end or not self.corners_differ(cell)
            if self.confirm and (
                (end and mixed) or (around and self.inside(cell, changed))
            ):
                self.opened.add(cell)
        return before != (len(self.cells), len(self.opened))

    def inside(self, cell, points):
        corners = self.lattice.corners(cell)
        low, high = corners[0], corners[-1]
        return [
            p for p in points
            if all(a <= x <= b for a, x, b in zip(low, p, high, strict=True))
        ]  # fmt: skip

    def differ(self, fidelity, points):
        return len({self.word(fidelity, p) for p in points} - {None}) > 1

    def corners_differ(self, cell):
        return self.differ(0, self.lattice.corners(cell))

    def is_demanded(self, cell):
        level, low = cell
        end = [x + size for x, size in zip(low, self.lattice.sizes(cell), strict=True)]
        for other in self.split:
            if other[0] == level + 1:
                sizes = self.lattice.sizes(other)
                pairs = zip(low, end, other[1], sizes, strict=True)
                if all(a <= x + size and x <= b for a, b, x, size in pairs):
                    return True
        return False

    def blocked(self, cell):
        level = cell[0] - self.levels
        if not self.levels or level < 0:
            return False
        above = self.lattice.at(level, cell[1])
        parts = self.lattice.children(above)
        for _ in range(self.levels - 1):
            parts = [
                c for p in parts if self.corners_differ(p)
                for c in self.lattice.children(p)
            ]  # fmt: skip
        found = sum(self.corners_differ(part) for part in parts)
        return found > MOST * self.lattice.parts(above, self.levels)

    def cases(self):
        first = {(0, point) for point in self.points()}
        return first | {(1, point) for point in self.confirmed()}


def arrived(lattice, word, levels, confirm, seed, budget=None):
    """Return the growth of words that come in at random, each of a wanted case."""
    growth = Growth(lattice, 1, levels, confirm=confirm, budget=budget)
    chance, waiting = random.Random(seed), list(growth.wanted)
    while waiting:
        address = waiting.pop(chance.randrange(len(waiting)))
        waiting += growth.learn(address, word(address.fidelity, address.point))
    return growth


def cases_of(growth):
    assert len(set(growth.wanted)) == len(growth.wanted)
    return {(a.fidelity, a.point) for a in growth.wanted}


@pytest.mark.parametrize("lattice", LATTICES)
@pytest.mark.parametrize("field", FIELDS)
@pytest.mark.parametrize("levels", [0, 2])
def test_cases_are_the_fixed_point_in_whatever_order_words_come(lattice, field, levels):
    word = worded(lattice, field)
    expected = Brute(lattice, word, levels, confirm=False).cases()
    for seed in range(3):
        assert cases_of(arrived(lattice, word, levels, False, seed)) == expected


def shifted(at):
    return half_plane((at[0] - 0.2, *at[1:]))


@pytest.mark.parametrize("lattice", LATTICES)
@pytest.mark.parametrize(
    "fields", [(half_plane, shifted), (circle, half_plane), (half_plane, holes)]
)
def test_confirmed_cases_are_a_fixed_point_too(lattice, fields):
    word = worded(lattice, *fields)
    expected = Brute(lattice, word, 2, confirm=True).cases()
    assert {fidelity for fidelity, _ in expected} == {0, 1}
    for seed in range(3):
        assert cases_of(arrived(lattice, word, 2, True, seed)) == expected
