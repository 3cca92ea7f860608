"""The hand-out: what goes first, who is answered when, and that nothing is lost."""

import json
import math

import numpy as np
import pytest
from launch import script

from hpcwhirl.campaign.plan.cost import FEW, NEAREST, Costs, costs_of, neighbours_of
from hpcwhirl.campaign.plan.design import design_of
from hpcwhirl.campaign.ranks import Tally, map_ranks, told
from hpcwhirl.campaign.work_queue import MOST, JobQueue, Order, Questions, WorkQueue
from hpcwhirl.launch import ALONE
from hpcwhirl.planner.kinds import Chains
from hpcwhirl.planner.planner import JobCode, Planner, completion_of

GRID = {
    "scene": {"duration": 1.0},
    "sweep": {"speed": [float(v) for v in range(100, 500, 10)], "friction": [0.0, 0.1]},
}
# All units are handed out, each once, on ranks that take some milliseconds for them.
HAND_OUT = """
import json, sys, time
from mpi4py import MPI
import numpy as np
from hpcwhirl.campaign.work_queue import WorkQueue
from hpcwhirl.campaign.plan.cost import Costs
from hpcwhirl.campaign.ranks import Tally, map_ranks

comm, found = MPI.COMM_WORLD, []
for cases, seconds in json.loads(sys.argv[1]):
    own, told = [], []
    def evaluate(unit, between):
        for _ in range(3):
            time.sleep(seconds / 3)
            between()
        own.append(unit)
        return "ok"
    units = range(cases if comm.rank == 0 else 0)
    costs = Costs(np.full(cases, seconds), np.zeros((cases, 1)))
    queue = WorkQueue(units, costs, comm.size)
    tally = Tally()
    whole = map_ranks(queue, evaluate, lambda u, s: told.append(u), lambda: False,
                      comm, tally)
    assert tally.cases == len(own) and 0.0 <= tally.busy <= tally.span
    found.append([whole, comm.gather(own), told])
    comm.Barrier()
    assert not comm.iprobe()  # no message is left over
    comm.Barrier()
if comm.rank == 0:
    print(json.dumps(found))
"""

# Ranks are asked to stop at about the same time, as by a scheduler's signal to each; in
# the last turn, of slow cases, one worker alone is.
STOPPED = """
import json, sys, time
from mpi4py import MPI
import numpy as np
from hpcwhirl.campaign.work_queue import WorkQueue
from hpcwhirl.campaign.plan.cost import Costs
from hpcwhirl.campaign.ranks import Tally, map_ranks

comm, found, cases = MPI.COMM_WORLD, [], 60
chance = np.random.default_rng(1)
for turn in range(41):
    lone = turn == 40
    at = chance.choice([0.0, 0.002, 0.03, 1e9], comm.size) * chance.random(comm.size)
    if lone:
        at = np.where(np.arange(comm.size) == comm.size - 1, 0.0, 1e9)
    own, told = [], []
    def evaluate(unit, between):
        for _ in range(4):
            time.sleep(2e-2 if lone else 1e-3)
            between()
        own.append(unit)
        return "ok"
    units = range(cases if comm.rank == 0 else 0)
    costs = Costs(np.full(cases, 4e-3), np.zeros((cases, 1)))
    queue = WorkQueue(units, costs, comm.size)
    comm.Barrier()
    end = time.monotonic() + at[comm.rank]
    whole = map_ranks(queue, evaluate, lambda u, s: told.append(u),
                      lambda: time.monotonic() >= end, comm, Tally())
    comm.Barrier()
    unread = [comm.iprobe() for _ in range(20)]
    found.append([whole, comm.gather(own), told, comm.gather(any(unread))])
    comm.Barrier()
if comm.rank == 0:
    print(json.dumps(found))
"""


def known(seconds):
    return Costs(np.array(seconds, dtype=float), np.zeros((len(seconds), 1)))


def handed_out(queue):
    return [queue.take() for _ in range(len(queue))]


def on_ranks(path, ranks, text, *words):
    """Return what rank 0 of some ranks that run a script prints as JSON."""
    done = script(path / "script.py", text, *words, ranks=ranks)
    assert done.returncode == 0, done.err
    return json.loads(done.out)


@pytest.mark.turns
@pytest.mark.mpi
@pytest.mark.parametrize("ranks", [1, 2, 4])
def test_every_unit_is_computed_once_by_any_number_of_ranks(tmp_path, ranks):
    sizes = [[0, 0.01], [1, 0.01], [3, 0.01], [20, 0.01], [200, 1e-4]]
    found = on_ranks(tmp_path, ranks, HAND_OUT, json.dumps(sizes))
    for (cases, _), (whole, of_rank, told_units) in zip(sizes, found, strict=True):
        assert whole
        assert sorted(unit for own in of_rank for unit in own) == list(range(cases))
        assert sorted(told_units) == list(range(cases))
        if cases == 20:
            assert all(of_rank)  # rank 0 computes too


@pytest.mark.turns
@pytest.mark.mpi
@pytest.mark.parametrize("ranks", [2, 3])
def test_no_message_is_left_over_whoever_is_asked_to_stop_and_when(tmp_path, ranks):
    found = on_ranks(tmp_path, ranks, STOPPED)
    for whole, of_rank, told_units, unread in found:
        assert not any(unread)
        done = sorted(unit for own in of_rank for unit in own)
        assert sorted(told_units) == done
        assert whole == (done == list(range(60)))
    assert {whole for whole, *_ in found} == {True, False}
    assert len(found[-1][2]) < 50  # all stop where one worker is asked to


def test_the_longest_goes_first_and_equals_are_scattered():
    assert handed_out(WorkQueue(range(3), known([1, 3, 2]))) == [1, 2, 0]
    first = handed_out(WorkQueue(range(100), known(np.ones(100))))[:10]
    assert np.diff(sorted(first)).max() < 20  # of 100: no part of them is left out


def test_costs_are_learned_from_neighbours_and_reorder_what_is_left():
    design = design_of(GRID)
    costs = costs_of(design)
    speed = np.array([scene.speed for scene in design.scenes])
    truth = np.where(speed < 300, 1.0, 2.5)  # s: two regimes
    queue = WorkQueue(range(80), costs)
    for unit in [queue.take() for _ in range(16)]:
        queue.finished(unit, truth[unit])
    rest = np.array(handed_out(queue))
    dear = np.flatnonzero(truth[rest] > 2.0)
    assert np.mean(dear < len(dear)) > 0.9  # the dear ones are now in front
    found = costs.predict(rest)
    assert np.median(np.abs(found / truth[rest] - 1)) < 0.05
    left = queue.seconds_left()
    assert left == pytest.approx(truth[rest].sum(), rel=0.15)


@pytest.mark.parametrize("count", [1, 3, NEAREST, FEW, FEW + 1])
def test_the_nearest_finished_cases_are_found_with_and_without_a_tree(count):
    rng = np.random.default_rng(4)
    places, of = rng.random((50, 3)), rng.random((count, 3))
    away, which = neighbours_of(places, of)
    distance = np.linalg.norm(places[:, None] - of, axis=2)
    least = np.sort(distance, axis=1)[:, :NEAREST]
    assert np.allclose(np.sort(away, axis=1), least, rtol=1e-12)
    assert np.allclose(np.take_along_axis(distance, which, axis=1), away, rtol=1e-12)


def test_another_scheme_is_asked_only_where_nothing_else_is_known():
    sweep = {"scheme": ["modal", "exact"], "speed": [300.0, 310.0, 500.0]}
    design = design_of({"sweep": sweep})
    costs = costs_of(design)
    where = {(s.solver.scheme, s.speed): i for i, s in enumerate(design.scenes)}
    nominal = costs.nominal.copy()
    costs.learn(where["modal", 300.0], 3 * nominal[where["modal", 300.0]])
    assert np.allclose(costs.predict(range(6)), 3 * nominal)
    costs.learn(where["exact", 500.0], 7 * nominal[where["exact", 500.0]])
    found = costs.predict(range(6)) / nominal
    for (scheme, _), case in where.items():
        assert found[case] == pytest.approx(3 if scheme == "modal" else 7, rel=0.05)


def test_a_worker_gets_one_long_unit_or_a_moment_s_worth_of_short_ones():
    long = WorkQueue(range(1000), known(np.ones(1000)), ranks=2)
    assert len(long.bundle()) == 1
    short = WorkQueue(range(1000), known(np.full(1000, 0.01)), ranks=2)
    assert len(short.bundle()) == 5
    many = WorkQueue(range(10**4), known(np.full(10**4, 2e-4)), ranks=9)
    assert len(many.bundle()) == MOST
    while len(many) > 9:
        least = math.ceil(many.least / 2e-4)  # or rank 0 would do nothing but answer
        fair = len(many) // 36 + 1
        assert 1 <= len(many.bundle()) <= max(fair, least)


@pytest.mark.parametrize(("cases", "ranks"), [(999, 1000), (1000, 300), (20, 3)])
def test_no_rank_begins_with_much_while_another_has_nothing(cases, ranks):
    units = range(cases)
    begun = [
        len(one) for one in WorkQueue(units, known(np.full(cases, 1e-4)), ranks).first()
    ]
    assert max(begun) <= math.ceil(cases / ranks)
    assert min(begun[1:]) >= 1


@pytest.mark.parametrize("seconds", [0.0, 1e-7])
def test_units_that_are_foretold_to_cost_nothing_are_shared(seconds):
    costs = Costs(np.full(120, seconds), np.zeros((120, 1)))
    begun = [len(part) for part in WorkQueue(range(120), costs, ranks=4).first()]
    assert max(begun) <= 12


def test_the_last_units_wait_for_ranks_that_have_nothing_left():
    questions = Questions(WorkQueue(range(5), known(np.ones(5)), 3), ranks=3)
    ((rank, units),) = questions.ask(1)  # more than a unit a rank: answered ahead
    assert (rank, len(units)) == (1, 1)
    ((rank, _),) = questions.ask(2)
    assert (rank, len(questions.queue)) == (2, 3)
    assert questions.ask(1) == []  # of the last three, one is kept for each
    assert questions.ask(2) == []
    ((rank, units),) = questions.hungry(2)
    assert (rank, len(units)) == (2, 1)
    assert questions.hungry(2) == []  # it was answered while it asked again
    questions.ask(2)
    questions.queue.take()
    questions.queue.take()
    assert questions.rest() == [(1, []), (2, [])]
    assert questions.rest() == []


def test_a_stop_hands_out_nothing_more_and_counts_what_was_begun():
    queue = WorkQueue(range(2), known([1.0, 1.0]))
    tally, asked = Tally(), []

    def evaluate(unit, between):
        asked.append(unit)
        between()
        return "ok"

    assert not map_ranks(
        queue, evaluate, lambda *_: None, lambda: len(asked) > 1, ALONE, tally
    )
    assert len(asked) == 2
    assert tally.cases == 1
    assert 0.0 < tally.busy <= tally.span


def test_the_line_at_the_end_tells_throughput_and_busy_fractions():
    ranks = [
        {"cases": 30, "busy": 9.5, "span": 10.0},
        {"cases": 20, "busy": 9.9, "span": 10.0},
    ]
    assert told(ranks) == (
        "50 cases in 10.0 s on 2 ranks: 5 cases/s, busy fraction 0.950 to 0.990"
    )


def test_units_that_are_to_go_last_go_last_however_long():
    queue = WorkQueue(range(20), known(np.arange(20.0) + 1), order=Order(last={19, 3}))
    assert queue.take() == 18
    queue.finished(18, 1.0)
    assert handed_out(queue)[-2:] == [19, 3]


def test_cases_of_a_branch_that_wait_are_counted_from_the_start():
    chain = Planner(Chains([-1, 0, 1, -1]))
    code = JobCode(4, 0)
    queue = JobQueue(chain, chain.left(), code, known(np.full(4, 2.0)))
    assert (len(queue.rows), queue.known) == (2, 4)
    assert queue.seconds_left() == pytest.approx(8.0)
    unit = queue.take()
    queue.finished(unit, 2.0)
    queue.hear(unit, completion_of({"status": "failed"}))
    assert queue.known == 4
    assert queue.seconds_left() == pytest.approx(6.0)
