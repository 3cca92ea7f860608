"""Refinement: the set of cases is the fixed point of a rule on words alone."""

import functools
import json
import random
import shutil
from itertools import combinations, product
from pathlib import Path

import h5py
import numpy as np
import pytest
import tomli_w
from launch import kept, root_variables
from made_up import refined_campaign

import hpcwhirl
from hpcwhirl.campaign.begin import prepare
from hpcwhirl.campaign.plan.design import design_of
from hpcwhirl.campaign.progress import progress_of
from hpcwhirl.cli import main
from hpcwhirl.errors import InputError
from hpcwhirl.refinement.boundary import Cases as Cases_
from hpcwhirl.refinement.boundary import Cells, boundaries_of
from hpcwhirl.refinement.growth import Growth
from hpcwhirl.refinement.lattice import Lattice, Side
from hpcwhirl.refinement.tree import SPECKLE_SHARE
from hpcwhirl.refinement.words import Attractor
from hpcwhirl.report.map.data import Wish
from hpcwhirl.report.map.maps import drawing_of
from hpcwhirl.scene import preset_inputs
from hpcwhirl.store.directory.campaign_directory import Directory
from hpcwhirl.store.reading.results_file import Results, count_statuses


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


def noise(at):
    """Speckle of three words, a quiet corner, and a tongue through both."""
    if tongue(at) == "t":
        return "t"
    return "abc"[random.Random(repr(at)).randrange(3)] if at[-1] > 0.4 else "a"


def holes(at):
    """Some cases end without a word."""
    if random.Random(repr(at)).random() < 0.15:
        return None
    return half_plane(at)


def orbit(at):
    """A radius that grows steadily, three tolerances in all, and jumps by two more."""
    jump = 2.0 * (at[0] + 0.37 * sum(at[1:]) > 1.618)
    return Attractor("sustained", (at[0] + jump, 0.1 * at[-1]))


def shore(at):
    """The same beside motions that die out."""
    return Attractor("damped") if circle(at) == "out" else orbit(at)


FIELDS = [half_plane, circle, tongue, noise, holes, orbit, shore]
DEEP = lattice_of(3, 2, depth=4)
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


def other(one, two):
    if isinstance(one, str):
        return one != two
    both = zip(one.at, two.at, strict=False)
    return one.regime != two.regime or any(abs(a - b) > 1.0 for a, b in both)


class Brute:
    """All of the rules applied to all cells again and again, with all words known."""

    def __init__(self, lattice, word, levels, confirm, sure=frozenset()):
        self.lattice, self.word, self.levels = lattice, word, levels
        self.confirm, self.sure = confirm, sure
        self.cells = set(lattice.coarse())
        self.split, self.opened, self.moved = set(), set(), set()
        while self.once():
            pass

    def points(self):
        return {p for cell in self.cells for p in self.lattice.corners(cell)}

    def confirmed(self):
        corners = self.lattice.corners
        doubted = [c for c in self.opened if not self.sure.issuperset(corners(c))]
        return {p for cell in (*doubted, *self.moved) for p in corners(cell)}

    def once(self):
        before = len(self.cells), len(self.opened), len(self.moved)
        first, second = self.points(), self.confirmed()
        changed = {
            p for p in second
            if None not in (self.word(0, p), self.word(1, p))
            and other(self.word(0, p), self.word(1, p))
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
            if self.confirm and end and mixed:
                self.opened.add(cell)
            if self.confirm and around and self.inside(cell, changed):
                self.moved.add(cell)
        return before != (len(self.cells), len(self.opened), len(self.moved))

    def inside(self, cell, points):
        corners = self.lattice.corners(cell)
        low, high = corners[0], corners[-1]
        return [
            p for p in points
            if all(a <= x <= b for a, x, b in zip(low, p, high, strict=True))
        ]  # fmt: skip

    def differ(self, fidelity, points):
        words = {self.word(fidelity, p) for p in points} - {None}
        return any(other(*pair) for pair in combinations(words, 2))

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
        return found > SPECKLE_SHARE * self.lattice.parts(above, self.levels)

    def twinned(self, of):
        """All cases that have twins: with a word, at mixed cells that are not split."""
        cases, out = self.cases(), set()
        both = self.points(), self.confirmed()
        for cell in self.cells - self.split:
            known = [self.inside(cell, points) for points in both]
            if not any(self.differ(f, points) for f, points in enumerate(known)):
                continue
            ends = of == "boundary" and self.lattice.at_end(cell)
            if self.blocked(cell) or ends:
                of_cell = (0, 1) if self.blocked(cell) else (int(self.confirm),)
                corners = self.lattice.corners(cell)
                out |= {(f, p) for f in of_cell for p in corners}
                if self.sure.issuperset(corners):
                    out |= {(0, p) for p in corners}
        chosen = cases if of == "all" else out & cases
        return {case for case in chosen if self.word(*case) is not None}

    def even(self):
        """Cases that no cell which is not split has together with another word."""
        first, second = self.points(), self.confirmed()

        def final(point):
            return self.word(1, point) if point in second else self.word(0, point)

        found = set(first)
        for cell in self.cells - self.split:
            inside = self.inside(cell, first)
            if len({final(point) for point in inside}) > 1:
                found -= set(inside)
        return {(int(point in second), point) for point in found}

    def cases(self):
        first = {(0, point) for point in self.points()}
        return first | {(1, point) for point in self.confirmed()}


@functools.cache
def brute_of(lattice, levels, *fields, some=False):
    """Return the words of fields, and `Brute` of them, for all tests that compare.

    some : whether the first words of two in three points are sure
    """
    word = worded(lattice, *fields)
    sure = sure_points(lattice, word) if some else frozenset()
    return word, Brute(lattice, word, levels, fields[1] is not None, sure)


def sure_points(lattice, word):
    """Return two in three points of a lattice, of those with a first word."""
    points = product(*(range(side.last + 1) for side in lattice.sides))
    known = [p for p in points if word(0, p) is not None]
    return frozenset(p for p in known if random.Random(repr(p)).random() < 2 / 3)


def arrived(lattice, word, levels, confirm, seed, sure=(), **options):
    """Return the growth of words that come in at random, each of a wanted case."""
    growth = Growth(lattice, 1, levels, confirm=confirm, **options)
    chance, waiting = random.Random(seed), list(growth.wanted)
    while waiting:
        address = waiting.pop(chance.randrange(len(waiting)))
        known = not address.fidelity and address.point in sure
        found = word(address.fidelity, address.point)
        waiting += growth.learn(address, found, sure=known)
    return growth


def cases_of(growth):
    assert len(set(growth.wanted)) == len(growth.wanted)
    return {(a.fidelity, a.point) for a in growth.wanted}


@pytest.mark.turns
@pytest.mark.parametrize("lattice", LATTICES)
@pytest.mark.parametrize("field", FIELDS)
@pytest.mark.parametrize("levels", [0, 2])
def test_cases_are_the_fixed_point_in_whatever_order_words_come(lattice, field, levels):
    word = worded(lattice, field)
    expected = Brute(lattice, word, levels, confirm=False).cases()
    for seed in range(3):
        assert cases_of(arrived(lattice, word, levels, False, seed)) == expected


@pytest.mark.turns
@pytest.mark.parametrize("levels", [1, 2])
def test_speckle_is_the_same_in_whatever_order_words_come(levels):
    word = worded(DEEP, noise)
    expected = Brute(DEEP, word, levels, confirm=False).cases()
    without = Brute(DEEP, word, 0, confirm=False).cases()
    assert len(expected) < 0.8 * len(without)
    for seed in range(20):
        assert cases_of(arrived(DEEP, word, levels, False, seed)) == expected


def test_a_steady_change_is_refined_no_more_and_a_jump_to_the_end():
    lattice = Lattice((Side("x", (0.0, 6.0, 12.0), (6, 6)),))

    def radius(_, point):
        x = lattice.sides[0].value(point[0])
        return Attractor("sustained", (0.6 * x + 1.4 * (x > 3.3),))

    growth = arrived(lattice, radius, 0, False, 0)
    (tree,) = growth.trees
    ends = [cell for cell, node in tree.cells.items() if node.mixed and not node.split]
    assert [(level, lattice.at_end((level, low))) for level, low in ends] == [(6, True)]
    steady = [a for a in growth.wanted if lattice.sides[0].value(a.point[0]) > 6.0]
    assert len(steady) <= 4  # 6 to 12 in four steps, of 64
    found = boundaries_of(cells_made(growth), words_made(growth, radius))
    assert [(found.low[0], found.high[0])] == [(3.28125, 3.375)]


def cells_made(growth):
    """Return the unsplit cells of a growth without a second fidelity."""
    (tree,), rows = growth.trees, {a.point: n for n, a in enumerate(growth.wanted)}
    own = [(cell, node) for cell, node in tree.cells.items() if not node.split]
    corner = np.array([[rows[p] for p in node.corners] for _, node in own])
    mixed = np.array([int(node.mixed) for _, node in own])
    level = np.array([cell[0] for cell, _ in own])
    return Cells(corner, 0 * mixed, level, mixed, 0 * mixed)


def words_made(growth, word):
    places = [[place(growth.lattice, a.point)[0] for a in growth.wanted]]
    words = [word(0, a.point) for a in growth.wanted]
    return Cases_(np.array(places), ["linear"], words, np.zeros(len(words), int))


def shifted(at):
    return half_plane((at[0] - 0.2, *at[1:]))


@pytest.mark.turns
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


@pytest.mark.turns
@pytest.mark.parametrize("lattice", LATTICES)
@pytest.mark.parametrize(
    "fields", [(half_plane, shifted), (circle, half_plane), (half_plane, holes)]
)
def test_sure_cases_are_confirmed_only_where_the_word_has_moved(lattice, fields):
    word, brute = brute_of(lattice, 2, *fields, some=True)
    expected = brute.cases()
    assert len(expected) <= len(brute_of(lattice, 2, *fields)[1].cases())
    for seed in range(3):
        found = arrived(lattice, word, 2, True, seed, brute.sure)
        assert cases_of(found) == expected
    every = {(f, p) for f, p in expected if not f}
    sure = {p for _, p in every if word(0, p) is not None}
    found = arrived(lattice, word, 2, True, 0, sure | brute.sure)
    assert sure == {p for _, p in every}
    assert cases_of(found) == {(0, a.point) for a in found.wanted}


TWINNED = [
    (noise, None, 2), (holes, None, 1), (circle, half_plane, 2), (noise, shifted, 1)
]  # fmt: skip


@pytest.mark.turns
@pytest.mark.parametrize("fields", TWINNED)
@pytest.mark.parametrize("some", [False, True])
def test_even_cases_lie_between_alike_ones_in_whatever_order_words_come(fields, some):
    *fields, levels = fields
    confirm = fields[1] is not None
    for lattice in (LATTICES[1], LATTICES[2]):
        word, brute = brute_of(lattice, levels, *fields, some=some)
        expected = brute.even()
        for seed in range(3):
            found = arrived(lattice, word, levels, confirm, seed, brute.sure)
            assert not found.left
            assert {(a.fidelity, a.point) for a in found.even()} == expected


@pytest.mark.turns
@pytest.mark.parametrize("fields", TWINNED)
@pytest.mark.parametrize("of", ["all", "boundary", "speckle"])
@pytest.mark.parametrize("some", [False, True])
def test_which_cases_have_twins_is_a_fixed_point_too(fields, of, some):
    *fields, levels = fields
    confirm = fields[1] is not None
    for lattice in (LATTICES[1], LATTICES[2]):
        word, brute = brute_of(lattice, levels, *fields, some=some)
        expected = brute.twinned(of)
        for seed in range(3):
            found = arrived(lattice, word, levels, confirm, seed, brute.sure, twins=of)
            assert cases_of(found) == brute.cases()  # twins ask for no case
            twinned = [(a.fidelity, a.point) for a in found.twinned]
            assert len(set(twinned)) == len(twinned)
            assert set(twinned) == expected


@pytest.mark.turns
def test_a_value_is_the_same_however_deep_the_lattice():
    for scale in ("linear", "log"):
        sides = [Side("x", (0.1, 0.2, 0.7), (d, d), scale) for d in (1, 4, 9)]
        for fine in sides:
            for place in range(fine.last + 1):
                position = fine.position(place)
                for other in sides:
                    if other.position(other.place(position)) == position:
                        assert other.value(other.place(position)) == fine.value(place)
                assert fine.place(position) == place
    assert Side("x", (0.1, 0.3), (1,)).value(1) == 0.2  # as a list would give it
    assert Side("x", (1e-4, 4e-4), (1,), "log").value(1) == 2e-4
    values = [sides[-1].value(place) for place in range(sides[-1].last + 1)]
    assert values == sorted(set(values))


def test_an_interval_has_its_own_depth():
    lattice = uneven()
    sides = lattice.sides[0]
    assert [sides.value(p) for p in range(sides.last + 1)][:9:4] == [0.0, 0.5, 1.0]
    ends = [c for c in lattice.coarse() if lattice.at_end(c)]
    assert not ends
    parts = lattice.children((0, (16, 0)))  # the last interval is not bisected
    assert [lattice.sizes(part) for part in parts] == [(8, 2)] * 2


def generations(lattice, word, total):
    """Return the cases of a budget by its definition: generation after generation."""
    found, new = {}, sorted(arrived_first(lattice))
    left = total
    while new:
        cut = new[: int(left)]
        found |= {a: word(a.fidelity, a.point) for a in cut}
        left -= len(cut)
        if len(cut) < len(new):
            break
        growth = Growth(lattice)
        growth.feed(found.__getitem__, list(growth.wanted))
        new = sorted(set(growth.wanted) - found.keys())
    return set(found)


def arrived_first(lattice):
    return Growth(lattice).wanted


@pytest.mark.turns
@pytest.mark.parametrize("field", [half_plane, circle, holes])
def test_a_budget_leaves_out_the_last_of_a_generation(field):
    lattice = lattice_of(3, 3)
    word = worded(lattice, field)
    all_of_it = len(arrived(lattice, word, 0, False, 0).wanted)
    for total in (9, 20, all_of_it - 1, all_of_it):
        expected = generations(lattice, word, total)
        assert len(expected) == total
        for seed in range(3):
            found = arrived(lattice, word, 0, False, seed, budget=(total, 1.0, 1.0))
            assert set(found.wanted) == expected
            assert bool(found.dropped) == (total < all_of_it)


def speckle_cells(field, depth=5):
    lattice = lattice_of(3, 3, depth=depth)
    growth = arrived(lattice, worded(lattice, field), 2, False, 0)
    (tree,) = growth.trees
    mixed = [c for c, n in tree.cells.items() if n.mixed and not n.split]
    return len(growth.wanted), sum(map(tree.is_speckle, mixed)), len(mixed)


@pytest.mark.turns
def test_a_coin_toss_is_speckle_and_lines_and_tongues_are_not():
    everything = ((2 << 5) + 1) ** 2
    cases, speckled, mixed = speckle_cells(speckle)
    assert speckled > 0.5 * mixed
    assert cases < 0.4 * everything
    for field in (half_plane, circle, tongue):
        assert not speckle_cells(field)[1]


DOCUMENT = {
    "output": {"traces": "summary"},
    "sweep": {
        "speed": {"start": 100, "stop": 500, "num": 5},
        "gap": [1e-4, 2e-4, 4e-4],
        "friction": [0.1, 0.3],
    },
    "refine": {"over": ["speed", "gap"], "levels": 2, "scale": {"gap": "log"}},
}


def with_refine(**more):
    return DOCUMENT | {"refine": DOCUMENT["refine"] | more}


def line(settings):
    edge = 260 + 400 * settings["friction"] + 2e5 * settings["gap"]
    return "sustained" if settings["speed"] > edge else "damped"


def drafty(settings):
    """Draft errs by 30 rad/s, and everywhere in a corner."""
    second = settings.get("solver.accuracy") == preset_inputs("standard")[ACCURACY]
    if settings["speed"] < 150 and settings["gap"] > 3e-4:
        return "divergent" if second else "damped"
    return line(settings | {"speed": settings["speed"] + 30 * second})


ACCURACY = "solver.accuracy"
CONFIRM = {"first": "draft", "confirm": "standard"}


@pytest.fixture(scope="module")
def refined(tmp_path_factory):
    return refined_campaign(tmp_path_factory.mktemp("r") / "out", DOCUMENT, line)


@pytest.fixture(scope="module")
def confirmed(tmp_path_factory):
    place = tmp_path_factory.mktemp("c") / "out"
    return refined_campaign(place, with_refine(**CONFIRM), drafty)


@pytest.mark.turns
def test_rows_are_coarse_first_then_by_level_panel_and_place(refined):
    data = hpcwhirl.open_results(refined)
    level, panel = data["level"].to_numpy(), data["panel"].to_numpy()
    assert (level[:30] == 0).all()
    assert (level[30:] > 0).all()
    places = [data[f"place_{n}"].to_numpy() for n in ("speed", "gap")]
    keys = list(zip(level[30:], panel[30:], *(p[30:] for p in places), strict=True))
    assert keys == sorted(keys)
    settings = [{n: float(data[n][i]) for n in ("speed", "gap", "friction")}
                for i in range(data.sizes["case"])]  # fmt: skip
    assert [line(s) for s in settings] == data["regime"].to_numpy().tolist()
    assert len(Results(refined)) == data.sizes["case"]
    assert Results(refined).scene(40).gap == float(data["gap"][40])


@pytest.mark.slow
def test_the_order_of_arrival_and_older_rows_change_no_bit(refined, tmp_path):
    again = refined_campaign(tmp_path / "again", DOCUMENT, line, seed=5)
    assert root_variables(again) == root_variables(refined)
    finer = refined_campaign(
        refined_twice(refined, tmp_path), with_refine(levels=4), line
    )
    fresh = refined_campaign(tmp_path / "fresh", with_refine(levels=4), line)
    assert root_variables(finer) == root_variables(fresh)


def refined_twice(refined, tmp_path):
    return Path(shutil.copytree(refined, tmp_path / "finer"))


@pytest.mark.turns
def test_a_case_that_is_wanted_and_not_there_is_missing(refined, tmp_path):
    folder = Path(shutil.copytree(refined, tmp_path / "cut"))
    (log,) = (folder / "journal").iterdir()
    whole, found = log.read_bytes(), kept(log)
    for left in (len(found) - 1, len(found) // 2, 1):
        log.write_bytes(whole[: found[left][0]])
        assert main(["gather", str(folder)]) == 1
        assert count_statuses(folder / "results.h5")["missing"] > 0
        progress = progress_of(Directory(folder))
        assert progress.grows
        assert progress.left > 0


@pytest.mark.turns
def test_grid_is_nearest_and_says_where_cases_are(refined):
    data = hpcwhirl.open_results(refined)
    found = hpcwhirl.grid(data)
    assert found.sizes == {"speed": 12, "gap": 9, "friction": 2}  # that occur
    assert int(found["computed"].sum()) == data.sizes["case"]
    regime = found["regime"].to_numpy()
    wrong = [
        at
        for at in np.ndindex(12, 9, 2)
        if regime[at] != line({n: float(found[n][i]) for n, i in zip(
            ("speed", "gap", "friction"), at, strict=True)})
    ]  # fmt: skip
    assert not wrong  # a straight line: every cell it crosses is resolved


def test_no_point_is_told_to_be_surer_than_the_cases_it_lies_between(refined):
    data = hpcwhirl.open_results(refined)
    told = {str(n) for n in data if str(n).startswith("boundary_")}
    assert not any("error" in name or "std" in name for name in told)
    number = data["boundary_along"].to_numpy()
    for end, rows in (("low", "before"), ("high", "behind")):
        case = data[f"boundary_{rows}"].to_numpy()
        for along, name in enumerate(("speed", "gap")):
            own = number == along
            at = data[f"boundary_{end}"].to_numpy()[own]
            assert np.array_equal(at, data[name].to_numpy()[case[own]])


def test_a_boundary_lies_between_cases_of_two_words(refined):
    data = hpcwhirl.open_results(refined)
    low, high = data["boundary_low"].to_numpy(), data["boundary_high"].to_numpy()
    before, behind = (data[f"boundary_{n}"].to_numpy() for n in ("before", "behind"))
    regime = data["regime"].to_numpy()
    edges = data["boundary_along"].to_numpy() >= 0
    assert edges.sum() > 20
    assert (regime[before[edges]] != regime[behind[edges]]).all()
    assert (low[edges] < high[edges]).all()
    for along, name in enumerate(("speed", "gap")):
        own = data["boundary_along"].to_numpy() == along
        at = data[f"boundary_{name}"].to_numpy()[own]
        assert ((at > low[own]) & (at < high[own])).all()
    friction = data["friction"].to_numpy()[before[edges]]
    speed, gap = (data[f"boundary_{n}"].to_numpy()[edges] for n in ("speed", "gap"))
    off = speed - (260 + 400 * friction + 2e5 * gap)
    assert abs(off).max() < 25.0  # a cell of 25 rad/s


def test_lines_join_points_of_one_panel_within_a_cell(refined):
    data = hpcwhirl.open_results(refined)
    ends = [data[f"boundary_line_{end}"].to_numpy() for end in ("begin", "end")]
    assert len(ends[0]) > 20
    assert (ends[0] != ends[1]).all()
    panel = data["boundary_panel"].to_numpy()
    assert np.array_equal(*(panel[end] for end in ends))
    speed, gap = (data[f"boundary_{n}"].to_numpy() for n in ("speed", "gap"))
    assert abs(np.subtract(*(speed[end] for end in ends))).max() <= 25.0
    assert abs(np.subtract(*(np.log(gap[end]) for end in ends))).max() < 1.0


def one_edge(word, ends=(1.0, 2.0), scale="linear", fidelity=(0, 0)):
    cases = Cases_(np.array([ends]), [scale], np.array(word), np.array(fidelity))
    ones = np.ones(1, dtype=np.int64)
    cells = Cells(np.array([[0, 1]]), 0 * ones, 0 * ones, ones, 0 * ones)
    return boundaries_of(cells, cases)


def test_a_point_of_a_boundary_is_the_middle_of_its_interval():
    for scale, ends, middle in (("linear", (1.0, 2.0), 1.5), ("log", (1.0, 4.0), 2.0)):
        found = one_edge(["damped", "divergent"], ends, scale)
        assert (found.low, found.high) == ([ends[0]], [ends[1]])
        assert found.at[0][0] == pytest.approx(middle)
    assert not len(one_edge(["damped", "damped"]).at)
    assert not len(one_edge(["damped", ""]).at)


def test_no_boundary_lies_between_words_of_two_fidelities():
    both = ["damped", "sustained"]
    assert len(one_edge(both, fidelity=(1, 1)).at)
    assert not len(one_edge(both, fidelity=(0, 1)).at)


@pytest.mark.turns
def test_confirmed_words_count_and_both_rows_are_kept(confirmed):
    data = hpcwhirl.open_results(confirmed)
    second = data["fidelity"].to_numpy() == 1
    preset = data["preset"].to_numpy().astype(str)
    assert set(preset[second]) == {"standard"}
    assert set(preset[~second]) == {"draft"}
    key = [tuple(float(data[n][i]) for n in ("speed", "gap", "friction"))
           for i in range(data.sizes["case"])]  # fmt: skip
    assert {k for k, s in zip(key, second, strict=True) if s} < set(key)
    assert sum(data["final"].to_numpy()) == len(set(key))
    found = hpcwhirl.grid(data)
    regime = found["regime"].to_numpy()
    standard = {"solver.accuracy": preset_inputs("standard")[ACCURACY]}
    names = ("speed", "gap", "friction")
    wrong = sum(
        regime[at] != drafty(standard | {n: float(found[n][i]) for n, i in zip(
            names, at, strict=True)})
        for at in np.ndindex(*regime.shape)
        if found["speed"][at[0]] >= 150 or found["gap"][at[1]] <= 3e-4
    )  # fmt: skip
    assert wrong == 0  # 30 rad/s are more than a cell: it was followed


ESTIMATED = with_refine(**CONFIRM) | {"solver": {"estimate": "step"}}


def below(settings):
    """Draft errs by 30 rad/s at low friction."""
    again = settings.get("solver.accuracy") == preset_inputs("standard")[ACCURACY]
    more = 30 * (again and settings["friction"] < 0.2)
    return line(settings | {"speed": settings["speed"] + more})


def coarser(settings):
    """The longer step errs there by 60 rad/s more."""
    less = 60 * (settings["friction"] < 0.2)
    return line(settings | {"speed": settings["speed"] - less})


@pytest.mark.turns
def test_words_that_an_estimate_keeps_are_not_computed_again(tmp_path):
    document = with_refine(**CONFIRM)
    by_place = refined_campaign(tmp_path / "place", document, below)
    folder = refined_campaign(tmp_path / "out", ESTIMATED, below, coarse=coarser)
    data, every = map(hpcwhirl.open_results, (folder, by_place))
    second = data["fidelity"].to_numpy() == 1
    assert 0 < second.sum() < 0.7 * every["fidelity"].to_numpy().sum()
    assert (data["friction"].to_numpy()[second] < 0.2).all()
    assert set(hpcwhirl.words(data["coarse_regime"][second])) == {"none"}
    found, all_of_it = hpcwhirl.grid(data), hpcwhirl.grid(every)
    assert (found["regime"] == all_of_it["regime"]).all()
    ends = ("boundary_low", "boundary_high", "boundary_along")
    for name in ends:
        assert sorted(data[name].to_numpy()) == sorted(every[name].to_numpy())
    assert (data["cell_confirmed"] == 1)[data["cell_state"] != 0].all()
    other = refined_campaign(tmp_path / "b", ESTIMATED, below, seed=5, coarse=coarser)
    assert root_variables(other) == root_variables(folder)


@pytest.mark.turns
def test_an_estimate_of_regimes_says_nothing_of_the_whirl(tmp_path):
    whirl = with_refine(words="whirl", **CONFIRM)
    both = [whirl, whirl | {"solver": {"estimate": "step"}}]
    counts = [
        hpcwhirl.open_results(
            refined_campaign(tmp_path / str(n), one, spun, coarse=lambda _: "damped")
        )["fidelity"].to_numpy().sum()
        for n, one in enumerate(both)
    ]  # fmt: skip
    assert counts[0] == counts[1] > 0


def spun(settings):
    return "damped forward" if line(settings) == "damped" else "damped backward"


@pytest.mark.turns
def test_classify_finds_other_boundaries(refined, tmp_path):
    folder = Path(shutil.copytree(refined, tmp_path / "out"))
    before = hpcwhirl.open_results(folder)
    states = before["cell_state"].to_numpy()
    before.close()
    assert main(["classify", str(folder)]) == 0  # made-up evidence: all of one word
    after = hpcwhirl.open_results(folder)
    assert len(set(after["regime"].to_numpy().tolist())) == 1
    assert states.any()
    assert not after["cell_state"].to_numpy().any()
    assert after.sizes.get("point", 0) == 0


def small_or_large(settings):
    """A radius that grows by a factor over the map, and threefold at one speed."""
    return settings["gap"] * (1 + settings["speed"] / 500) * (3 ** (
        settings["speed"] > 333.0))  # fmt: skip


@pytest.mark.turns
def test_attractors_of_one_regime_have_a_boundary_in_results_and_map(tmp_path):
    document = with_refine(words="attractor")
    found = []
    for seed in (1, 2):
        folder = tmp_path / f"{seed}"
        refined_campaign(folder, document, lambda _: "sustained", seed, small_or_large)
        found.append(root_variables(folder))
    assert found[0] == found[1]  # in whatever order the cases came
    with h5py.File(folder / "results.h5") as file:
        group = file["boundaries"]
        assert group.attrs["words"] == b"attractor"
        at = group["speed"][:]
    assert len(at)
    assert (abs(at - 333.0) <= 12.5).all()  # half a cell at the end
    assert main(["map", str(folder), "--out", str(tmp_path / "map")]) == 0
    states = hpcwhirl.open_results(folder)["cell_state"].to_numpy()
    assert main(["classify", str(folder)]) == 0  # made-up evidence: one word
    assert states.any()
    assert not hpcwhirl.open_results(folder)["cell_state"].to_numpy().any()


def test_a_failed_case_is_a_row_and_splits_nothing(tmp_path):
    def word(settings):
        return None if settings["speed"] == 300.0 else "damped"

    folder = refined_campaign(tmp_path / "out", DOCUMENT, word)
    assert count_statuses(folder / "results.h5") == {"ok": 24, "failed": 6}


def tiles(folder, **wish):
    """Return (boxes, words) of what a map draws, and the area of its axes."""
    figure = drawing_of(folder / "results.h5", Wish(**wish)).figure
    (axes,) = [a for a in figure.axes if a.get_visible()][:1]
    found = []
    for drawn in axes.collections:
        name = str(drawn.get_gid())
        if name.startswith("cells "):
            found += [(path.vertices, name.removeprefix("cells "))
                      for path in drawn.get_paths()]  # fmt: skip
    return found, (*axes.get_xlim(), *axes.get_ylim())


@pytest.mark.turns
@pytest.mark.parametrize("which", ["refined", "confirmed"])
def test_a_map_is_covered_by_cells_of_the_nearest_words(which, request):
    folder = request.getfixturevalue(which)
    found, (left, right, low, high) = tiles(folder, at=("friction=0.1",))
    area = sum(np.ptp(box[:, 0]) * np.ptp(np.log(box[:, 1])) for box, _ in found)
    assert area == pytest.approx((right - left) * np.log(high / low))
    grid = hpcwhirl.grid(hpcwhirl.open_results(folder)).sel(friction=0.1)
    regime = {
        (round(x, 6), round(1e9 * y, 6)): str(grid["regime"].to_numpy()[i, j])
        for i, x in enumerate(grid["speed"].to_numpy())
        for j, y in enumerate(grid["gap"].to_numpy())
    }
    for box, word in found:  # a corner of each is its case; the axis is in mm
        ends = {(round(float(x), 6), round(1e6 * float(y), 6)) for x, y in box}
        assert word in {regime.get(end) for end in ends}


@pytest.mark.turns
@pytest.mark.parametrize("friction", [0.1, 0.2, 0.3])
def test_a_plane_of_three_refined_inputs_is_covered_once(tmp_path, friction):
    sweep = {"speed": [100.0, 300.0, 500.0], "gap": [1e-4, 2e-4, 4e-4]}
    over = [*sweep, "friction"]
    refine = {"over": over, "levels": 1, "scale": {"gap": "log"}, "first": "draft"}
    document = {"sweep": sweep | {"friction": [0.1, 0.2, 0.3]}, "refine": refine}
    folder = refined_campaign(
        tmp_path / "o",
        document,
        lambda s: ("damped", "sustained")[s["speed"] > 1000 * s["friction"] + 50],
    )
    found, (left, right, low, high) = tiles(folder, at=(f"friction={friction}",))
    area = sum(np.ptp(box[:, 0]) * np.ptp(np.log(box[:, 1])) for box, _ in found)
    assert area == pytest.approx((right - left) * np.log(high / low))


BAD = [
    ({"over": "speedz"}, "speed"),
    ({"over": "force", "scale": "linear"}, "not in [sweep]"),
    ({"over": []}, "one to 3"),
    ({"over": ["speed", "speed"], "scale": "linear"}, "twice"),
    ({"resolution": 1.0}, "either levels or resolution of speed"),
    ({"levels": 2.5}, "whole number from 0"),
    ({"levels": 0}, "refines nothing"),
    ({"levels": 17}, "from 0 to 16, got 17"),
    ({"scale": "cubic"}, "linear, log, got 'cubic'"),
    ({"scale": {"friction": "log"}}, "not an input of over"),
    ({"words": "outcome"}, "regime, whirl, both, attractor, branch, got 'outcome'"),
    ({"speckle": -1}, "0 for never, got -1"),
    ({"budget": 100}, "{cases = N} or {core_hours = H}"),
    ({"budget": {"cases": 29}}, "cases = 30, got 29"),
    ({"first": "quick"}, "draft, standard, reference, got 'quick'"),
    ({"confirm": "strict"}, "got 'strict'"),
    ({"first": "draft", "confirm": "draft"}, "sets nothing that the first"),
    ({"resolutions": 1.0}, "did you mean 'resolution'"),
]  # fmt: skip


@pytest.mark.parametrize(("wrong", "why"), BAD)
def test_bad_input_is_one_line_that_names_it(wrong, why):
    with pytest.raises(InputError) as refused:
        design_of(with_refine(**wrong))
    assert why in str(refused.value)


def test_a_budget_of_core_hours_is_one_of_seconds():
    design = design_of(with_refine(budget={"core_hours": 1e3}))
    amount, *each = design.rule.budget
    assert amount == 1e3
    assert each == [s / 3600 for s in design.mean_seconds(design.rule)]


def test_what_has_no_cells_is_refused():
    sample = {"count": 4, "speed": {"uniform": [100.0, 200.0]}}
    with pytest.raises(InputError, match=r"cases of \[\[cases\]\]: use \[sweep\]"):
        design_of(DOCUMENT | {"cases": [{"speed": 1.0, "gap": 1e-4}]})
    with pytest.raises(InputError, match=r"not with \[refine\]"):
        design_of(DOCUMENT | {"sample": sample})
    budget = with_refine(budget={"cases": 99})
    with pytest.raises(InputError, match=r"\[twins\] and \[refine\] budget"):
        design_of(budget | {"twins": {"count": 2, "of": "all"}})


def test_whole_numbers_are_refined_to_whole_numbers_alone():
    sweep = {"modes": [4, 8, 12], "speed": [300.0, 400.0]}
    table = {"over": "modes", "levels": 2}
    design = design_of({"sweep": sweep, "refine": table})
    values = {design.settings_of(i)["solver.modes"] for i in range(6, 6 + 18)}
    assert values == set(range(4, 13))
    assert all(isinstance(value, int) for value in values)
    with pytest.raises(InputError, match="use at most 2 for whole"):
        design_of({"sweep": sweep, "refine": table | {"levels": 3}})


def test_a_campaign_is_refined_further_and_nothing_else(refined, tmp_path):
    folder = Path(shutil.copytree(refined, tmp_path / "out"))
    for wrong, why in [
        ({"levels": 1}, "by 2 levels, got 1"),
        ({"words": "whirl"}, "words = 'regime', got 'whirl'"),
        ({"speckle": 3}, "speckle = 2, got 3"),
        ({"scale": "linear"}, "scale = 'linear, log', got 'linear, linear'"),
    ]:
        with pytest.raises(InputError) as refused:
            prepare(design_of(with_refine(**wrong)), Directory(folder))
        assert why in str(refused.value)
    plain = {k: v for k, v in DOCUMENT.items() if k != "refine"}
    with pytest.raises(InputError, match="begun with"):
        prepare(design_of(plain), Directory(folder))
    prepare(design_of(with_refine(levels=3)), Directory(folder))


def test_shards_are_refused_and_a_dry_run_tells_the_bound(tmp_path, capsys):
    file = tmp_path / "c.toml"
    file.write_text(tomli_w.dumps(DOCUMENT | {"scene": {"duration": 0.01}}))
    words = ["campaign", str(file), "--out", str(tmp_path / "out")]
    assert main([*words, "--shard", "1/2"]) == 2
    assert "[refine] needs the words of all cases" in capsys.readouterr().err
    assert main([*words, "--extend", "undecided", "--to", "1"]) == 2
    assert "--extend and [refine]" in capsys.readouterr().err
    assert main([*words, "--dry-run"]) == 0
    assert f"{17 * 9 * 2} cases at most" in capsys.readouterr().out


@pytest.mark.turns
def test_a_dry_run_of_a_finer_campaign_counts_what_words_already_ask_for(
    tmp_path, capsys
):
    folder, file = tmp_path / "out", tmp_path / "c.toml"
    refined_campaign(folder, DOCUMENT, line)
    there = hpcwhirl.open_results(folder).sizes["case"]
    finer = DOCUMENT | {"refine": DOCUMENT["refine"] | {"levels": 3}}
    file.write_text(tomli_w.dumps(finer))
    words = ["campaign", str(file), "--out", str(folder), "--dry-run"]
    assert main([*words, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["left"] == 0  # of the coarse ones
    assert found["beyond"] == there - found["coarse"]
    after = refined_campaign(tmp_path / "finer", finer, line)
    more = hpcwhirl.open_results(after).sizes["case"] - there
    assert more > 50
    assert 0.8 * more <= found["more"]["usual"] <= 1.2 * more
    # each made-up case took half a second
    assert found["core_hours"] == pytest.approx(0.5 * found["more"]["usual"] / 3600)
    assert found["core_hours_range"][0] > 0
    assert found["microseconds_per_step"] > 0
    assert main(words) == 0
    assert f"{found['beyond']} beyond it have ended" in capsys.readouterr().out


def test_a_refined_directory_is_not_extended_for_the_same_reason(refined, capsys):
    before = sorted(path.stat().st_mtime_ns for path in refined.rglob("*"))
    assert main(["campaign", str(refined), "--extend", "undecided", "--to", "9"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert f"{refined}: --extend and [refine]" in line
    assert before == sorted(path.stat().st_mtime_ns for path in refined.rglob("*"))
