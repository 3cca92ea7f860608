"""Laws of what is left to do: of grids, refined designs, twins and extensions."""

import random
from itertools import pairwise, product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as some

from hpcwhirl.planner.kinds import Chains, Folds, Grid, Refined, cases_before
from hpcwhirl.planner.planner import (
    Completion,
    Ends,
    Job,
    JobCode,
    Planner,
    Stages,
)
from hpcwhirl.refinement.rule import Family, Rule
from hpcwhirl.scene.history import history_of, parsed

SPEEDS, GAPS = [1.0, 2.0, 3.0, 4.0], [1.0, 2.0]
ROWS = [{"speed": speed, "gap": gap} for speed in SPEEDS for gap in GAPS]
DIGESTS = [f"{case:064x}" for case in range(len(ROWS))]
RULE = Rule(("speed", "gap"), ((2, 2, 2), (2,)), ("linear", "linear"), speckle=0)
PASSED = np.array([0, 0, 0, 1, 0, 2, 0, 0], dtype=np.int8)
TWINS = {
    "none": {},
    "all": {"of": "all", "count": 2},
    "boundary": {"of": "boundary", "count": 2},
    "even": {"of": "even", "count": 2, "sample": 2, "seed": 0},
}
OF_GRIDS = list(product(TWINS, [0, 2]))


def refined(twins):
    family = Family(RULE, ROWS)
    return Refined(family, twins, lambda case: f"{case:064x}")


def grid(twins):
    return Grid(ROWS, ["speed", "gap"], DIGESTS, twins)


class Sweeps(Grid):
    """Made up: cases of each gap one after the other, by speeds, up or down."""

    grows = True

    def __init__(self, twins):
        super().__init__(ROWS, ["speed", "gap"], DIGESTS, twins)
        lines = [[c for c, row in enumerate(ROWS) if row["gap"] == gap] for gap in GAPS]
        lines[1].reverse()
        self.next = {a: b for line in lines for a, b in pairwise(line)}
        self.waiting = sorted(self.next.values())

    def after(self, case, end):
        following = [self.next[case]] if case in self.next else []
        return super().after(case, end)._replace(cases=following)


def branches(_):
    return Chains([-1, 0, 1, 2, -1, 4, 5, 6])


def fold_rows():
    """The cases of ROWS as branches, up at one gap and down at the other."""
    rows = []
    for row in ROWS:
        line = SPEEDS if row["gap"] == GAPS[0] else SPEEDS[::-1]
        before = line[: line.index(row["speed"])]
        branch = "up" if line is SPEEDS else "down"
        rows.append(row | {"branch": branch, "history": history_of("speed", before)})
    return rows


ALONG = Rule(("speed",), ((3, 3, 3),), ("linear",), words="branch", speckle=0)
FAMILIES = {
    "refined": Family(RULE, ROWS), "folds": Family(ALONG, fold_rows())
}  # fmt: skip


def folds(_):
    rows = fold_rows()
    return Folds(FAMILIES["folds"], cases_before(rows), lambda case: f"{case:064x}")


def planner_of(kind, twins, stages=0, find=None):
    passed = PASSED if stages else None
    made = KINDS[kind](twins)
    count = twins.get("count", 0)
    known = None if find is None else Found(made.first, count, stages, find)
    return Planner(made, count, Stages(stages, passed), known)


class Found(Ends):
    """How jobs have ended, {job: how}, of cases that follow from others, too."""

    def __init__(self, first, twins, stages, ends):
        super().__init__(first, twins, stages)
        self.ends = ends
        for job, end in ends.items():
            if job.case < first:
                self.codes[job] = self.code(end)

    def find(self, job):
        return self.ends.get(job)


KINDS = {
    "grid": grid, "refined": refined, "sweeps": Sweeps, "branches": branches,
    "folds": folds,
}  # fmt: skip


def ending(job, failing=(), kind="refined"):
    """Return how any job ends: a function of the job alone."""
    if job in failing:
        return Completion("failed")
    family = FAMILIES[kind]
    own = family.settings(family.address(job.case))
    word = "damped" if own["speed"] + own["gap"] < 3.6 else "sustained"
    chance = random.Random(f"{job}")
    is_open = chance.random() < 0.5
    return Completion("ok", "completed", word, "forward", is_open)


def jobs_of(planner):
    jobs = planner.left()
    each = zip(*(column.tolist() for column in jobs), strict=True)
    return {Job(planner.number(row), twin, stage) for row, twin, stage in each}


def run(planner, seed, failing=(), most=10**6):
    """Return {job: how it ended} of all, or the first, in a random order."""
    chance, waiting, ended = random.Random(seed), sorted(jobs_of(planner)), {}
    while waiting and len(ended) < most:
        job = waiting.pop(chance.randrange(len(waiting)))
        assert job not in ended
        kind = "folds" if isinstance(planner.kind, Folds) else "refined"
        ended[job] = ending(job, failing, kind)
        waiting += planner.complete(job, ended[job])
        assert len(waiting) == len(set(waiting))
    assert jobs_of(planner) == set(waiting)
    return ended


CAMPAIGNS = [
    *[("grid", of, stages) for of, stages in OF_GRIDS],
    *[("refined", of, 0) for of in TWINS],
    *[("sweeps", of, stages) for of, stages in OF_GRIDS],
    ("branches", "none", 0),
    ("folds", "none", 0),
]


@pytest.mark.parametrize(("kind", "of", "stages"), CAMPAIGNS)
def test_the_jobs_are_the_same_in_whatever_order_they_end(kind, of, stages):
    twins = TWINS[of]
    first = run(planner_of(kind, twins, stages), 0)
    assert len(first) >= len(ROWS)
    for seed in range(1, 4):
        planner = planner_of(kind, twins, stages)
        assert run(planner, seed) == first
        assert not planner.open.any()


@pytest.mark.turns
@pytest.mark.parametrize(("kind", "of", "stages"), CAMPAIGNS)
def test_what_has_ended_is_never_asked_for_again(kind, of, stages):
    """Broken off anywhere, what is left is what a run that went on would do."""
    twins = TWINS[of]
    whole = run(planner_of(kind, twins, stages), 0)
    for most in range(0, len(whole) + 1, max(len(whole) // 7, 1)):
        planner = planner_of(kind, twins, stages)
        ended = run(planner, most, most=most)
        again = planner_of(kind, twins, stages, ended)
        assert jobs_of(again) == jobs_of(planner)
        assert not jobs_of(again) & ended.keys()
        assert by_case(again) == by_case(planner)
        assert ended | run(again, 1) == whole


def by_case(planner):
    ends, table = planner.ends.tolist(), planner.known.table
    return {planner.number(r): table[c] for r, c in enumerate(ends) if c >= 0}


@pytest.mark.parametrize("stages", [0, 2])
def test_a_case_that_waits_goes_out_when_the_one_before_has_ended(stages):
    planner = planner_of("sweeps", TWINS["boundary"], stages)
    assert jobs_of(planner) == {Job(0), Job(7)}
    assert planner.open.all()
    assert sorted(planner.ahead().row.tolist()) == list(range(8))
    ended = [job for job in run(planner, 0) if not job.twin]
    lasts = {case: max(i for i, job in enumerate(ended) if job.case == case)
             for case in range(8)}  # fmt: skip
    for before, following in Sweeps({}).next.items():
        assert lasts[before] < ended.index(Job(following))


def test_a_branch_goes_on_after_a_case_that_failed():
    ended = run(planner_of("branches", {}), 0, failing={Job(1), Job(4)})
    assert {job.case for job in ended} == set(range(8))


def test_a_fold_is_bisected_from_the_side_that_the_branch_comes_from():
    family = FAMILIES["folds"]
    ended = [job.case for job in run(planner_of("folds", {}), 0)]
    places = {case: family.settings(family.address(case)) for case in ended}
    for place, case in enumerate(ended):
        own = places[case]
        over, before = parsed(own["history"])
        if before:
            last = own | {over: before[-1], "history": history_of(over, before[:-1])}
            first = next(c for c, known in places.items() if known == last)
            assert ended.index(first) < place  # it has ended, and left its motion
    found = {gap: [] for gap in GAPS}
    for case, own in places.items():
        if case >= len(ROWS):
            found[own["gap"]].append((own["speed"], own["history"]))
    assert sorted(found[1.0]) == [  # up, the word changes at 2.6
        (2.5, "speed = 1.0, 2.0"),
        (2.625, "speed = 1.0, 2.0, 2.5"),
        (2.75, "speed = 1.0, 2.0, 2.5"),
    ]
    assert sorted(found[2.0]) == [  # down, at 1.6
        (1.5, "speed = 4.0, 3.0, 2.0"),
        (1.625, "speed = 4.0, 3.0, 2.0, 1.75"),
        (1.75, "speed = 4.0, 3.0, 2.0"),
    ]


@settings(deadline=None, max_examples=40)
@given(some.lists(some.sampled_from(range(8)), unique=True), some.data())
def test_a_plain_campaign_at_once_is_that_one_by_one(ended, data):
    ok = np.array(data.draw(some.lists(some.booleans(), min_size=8, max_size=8)))
    over = np.isin(np.arange(8), ended)
    found = {Job(case): Completion("ok" if ok[case] else "failed") for case in ended}
    one, other = planner_of("grid", {}), planner_of("grid", {}, find=found)
    for job, end in found.items():
        assert one.complete(job, end) == []
    assert jobs_of(one) == jobs_of(other) == {Job(c) for c in range(8) if not over[c]}
    for name in ("open", "failed", "failed_alone"):
        assert getattr(one, name).tolist() == getattr(other, name).tolist()


def test_a_case_goes_on_by_stages_longer_than_it_lasts_while_it_is_open():
    planner = planner_of("grid", {}, stages=2)
    open_, over = (Completion("ok", is_open=value) for value in (True, False))
    assert planner.complete(Job(0), open_) == [Job(0, 0, 1)]
    assert planner.complete(Job(0, 0, 1), over) == []
    assert planner.complete(Job(3), open_) == [Job(3, 0, 2)]  # it lasts the first time
    assert planner.complete(Job(3, 0, 2), open_) == []  # no longer one is asked for
    assert planner.complete(Job(5), open_) == []
    assert planner.complete(Job(1), over) == []


def test_a_case_that_failed_to_go_on_has_the_result_of_before():
    planner = planner_of("grid", {}, stages=2)
    first = Completion("ok", "completed", "undecided", is_open=True)
    planner.complete(Job(0), first)
    planner.complete(Job(0, 0, 1), Completion("failed"))
    assert by_case(planner)[0] == first
    assert planner.failed_alone[0]
    assert not planner.open[0]


def test_twins_follow_their_case_and_go_on_by_themselves():
    planner = planner_of("grid", TWINS["all"], stages=2)
    again, over = (Completion("ok", is_open=value) for value in (True, False))
    assert planner.complete(Job(0), again) == [Job(0, 0, 1)]
    twins = planner.complete(Job(0, 0, 1), over)
    assert twins == [Job(0, 1), Job(0, 2)]
    assert planner.complete(Job(0, 1), again) == [Job(0, 1, 1)]
    assert planner.complete(Job(0, 2), over) == []
    assert planner.open[0]


@pytest.mark.parametrize("of", ["all", "boundary", "even"])
def test_a_case_without_a_result_has_no_twins(of):
    failing = {Job(0), Job(4)}
    planner = planner_of("grid", TWINS[of])
    ended = run(planner, 0, failing)
    twinned = {job.case for job in ended if job.twin}
    assert twinned
    assert not twinned & {0, 4}
    assert np.flatnonzero(planner.twinned).tolist() == sorted(twinned)
    assert np.flatnonzero(planner.failed).tolist() == [0, 4]


@pytest.mark.parametrize("of", ["boundary", "even"])
def test_late_twins_of_a_grid_wait_for_the_words_of_all(of):
    planner = planner_of("grid", TWINS[of])
    for case in range(7):
        assert planner.complete(Job(case), ending(Job(case))) == []
    jobs = planner.complete(Job(7), ending(Job(7)))
    words = [ending(Job(case)).word for case in range(8)]
    wanted = np.flatnonzero(grid(TWINS[of]).twinned(words))
    assert sorted({job.case for job in jobs}) == wanted.tolist()


def test_refined_jobs_are_those_of_the_rule():
    family = Family(RULE, ROWS)
    growth = family.growth("boundary")
    growth.feed(
        lambda a: RULE.word_of(ending(Job(family.number(a)))._asdict()),
        list(growth.wanted),
    )
    ended = run(planner_of("refined", TWINS["boundary"]), 3)
    assert {job.case for job in ended} == set(map(family.number, growth.wanted))
    twinned = {family.number(address) for address in growth.twinned}
    assert {job for job in ended if job.twin} == {
        Job(case, twin) for case in twinned for twin in (1, 2)
    }


@settings(max_examples=50)
@given(some.integers(0, 10**30), some.integers(0, 1000), some.integers(0, 100))
def test_a_job_is_known_by_its_number(case, twin, stage):
    code = JobCode(10**30 + 1, 1000)
    job = Job(case, twin, stage)
    assert code.decode(code.encode(job)) == job
