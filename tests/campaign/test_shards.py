"""Shards of a campaign: whole, balanced, safe beside one another, and the same bits."""

import threading

import h5py
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from journals import plan_of
from launch import BARE, finish, launch, records, root_variables, start

from hpcwhirl.campaign.finalize import _ending_of
from hpcwhirl.campaign.work import share
from hpcwhirl.cli import main
from hpcwhirl.launch import Shard, parse_shard
from hpcwhirl.store.directory.journal import Journals
from hpcwhirl.store.directory.manifest import PlanFile

SWEPT = (
    BARE
    + """
scene = {duration = 4e-3}
solver = {time_step = 2e-6}
output = {interval = 5e-5}
sweep = {speed = [300, 410], gap = [1e-4, 2e-4, 3e-4]}
"""
)
COSTS = st.lists(st.floats(0.0, 1e9), max_size=60)


@pytest.mark.turns
@given(COSTS, st.integers(1, 12))
def test_every_case_is_in_exactly_one_shard(costs, of):
    shares = [share(costs, Shard(number, of)) for number in range(1, of + 1)]
    assert sorted(case for mine in shares for case in mine) == list(range(len(costs)))


@pytest.mark.turns
@given(COSTS, st.integers(1, 12))
def test_no_shard_has_more_than_one_case_above_another(costs, of):
    shares = [share(costs, Shard(number, of)) for number in range(1, of + 1)]
    loads = [sum(costs[case] for case in mine) for mine in shares]
    assert max(loads) - min(loads) <= max(costs, default=0.0) * (1 + 1e-9)


def test_a_dear_case_at_the_end_of_the_list_unbalances_nothing():
    costs = [1.0, 1.0, 2.0]
    loads = [sum(costs[i] for i in share(costs, Shard(n, 2))) for n in (1, 2)]
    assert loads == [2.0, 2.0]


def test_equal_cases_are_dealt_in_turn():
    assert list(share([2.0] * 7, Shard(2, 3))) == [1, 4]


@pytest.mark.parametrize("text", ["", "1", "0/3", "4/3", "-1/3", "1/0", "1/2/3", "a/b"])
def test_what_is_no_shard_is_refused(text):
    with pytest.raises(ValueError, match="--shard must be I/N"):
        parse_shard(text)
    assert parse_shard("3/7") == Shard(3, 7)


def test_runs_that_begin_at_once_never_share_a_journal(tmp_path):
    many = 16
    barrier, claimed = threading.Barrier(many), []

    def claim():
        barrier.wait()
        claimed.append(Journals(tmp_path).claim_run())

    threads = [threading.Thread(target=claim) for _ in range(many)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert sorted(claimed) == list(range(1, many + 1))


def test_plans_written_at_once_leave_a_whole_one(tmp_path):
    plan = plan_of(
        {"speed": 1.0}, ["speed"], [{"speed": float(i)} for i in range(2000)]
    )
    failures = []

    def write():
        try:
            for _ in range(20):
                PlanFile(tmp_path).write(plan)
        except OSError as failed:
            failures.append(failed)

    writers = [threading.Thread(target=write) for _ in range(4)]
    for thread in writers:
        thread.start()
    for thread in writers:
        thread.join()
    assert failures == []
    assert PlanFile(tmp_path).read() == plan
    assert [path.name for path in tmp_path.iterdir()] == ["campaign.json"]


def together(place, ranks, of):
    """Run all shards at once and return their directory and what they printed."""
    (place / "campaign.toml").write_text(SWEPT)
    words = ["campaign", place / "campaign.toml", "--out", place / "out", "--shard"]
    running = [start([*words, f"{i}/{of}"], ranks) for i in range(1, of + 1)]
    ended = [finish(process) for process in running]
    assert [process.returncode for process in ended] == [0] * of, ended[0].err
    return place / "out", [process.out for process in ended]


@pytest.mark.mpi
@pytest.mark.slow
@pytest.mark.parametrize(("ranks", "of"), [(0, 3), (2, 2)])
def test_shards_at_once_give_the_bits_of_one_campaign(tmp_path, ranks, of):
    (tmp_path / "one.toml").write_text(SWEPT)
    assert launch("campaign", tmp_path / "one.toml", "--out", tmp_path / "one").out
    out, told = together(tmp_path, ranks, of)
    assert root_variables(out) == root_variables(tmp_path / "one")
    assert sorted(record["case"] for record in records(out)) == list(range(6))
    assert sum("results.h5" in text for text in told) >= 1
    with h5py.File(out / "results.h5") as file:
        assert not file["status"][:].any()


def test_what_a_shard_leaves_is_open_and_not_its_own():
    class Made(list):
        open = np.array([True, False, True, True, False, True])
        failed = np.array([False, True, False, False, True, False])

    ending = _ending_of([0, 1, 2], Made(range(6)))
    assert (ending.cases, ending.missing, ending.failed, ending.left) == (6, 2, 3, 2)


@pytest.mark.turns
def test_a_shard_computes_its_share_once_and_leaves_the_rest(tmp_path, capsys):
    (tmp_path / "campaign.toml").write_text(SWEPT)
    out = str(tmp_path / "out")
    words = ["campaign", str(tmp_path / "campaign.toml"), "--out", out]
    assert main([*words, "--shard", "1/2"]) == 0
    assert "3 of 6 cases are left to other shards" in capsys.readouterr().out
    own = {record["case"] for record in records(tmp_path / "out")}
    assert own == {0, 2, 4}
    assert not (tmp_path / "out/results.h5").exists()
    assert main([*words, "--shard", "1/2"]) == 0
    assert len(records(tmp_path / "out")) == 3
    assert main(["gather", out]) == 1
    with h5py.File(tmp_path / "out/results.h5") as file:
        assert [i for i, word in enumerate(file["status"][:]) if word == 0] == [0, 2, 4]
    assert main(words) == 0
    assert sorted(record["case"] for record in records(tmp_path / "out")) == [*range(6)]
