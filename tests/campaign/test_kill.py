"""Kills and torn files: whatever happens, the same command ends with the same bits."""

import itertools
import os
import random
import shutil
import signal
import time

import pytest
from launch import (
    BARE,
    LIMIT,
    finish,
    kill,
    launch,
    pid_of,
    records,
    root_variables,
    start,
)

from hpcwhirl.campaign.begin import prepare
from hpcwhirl.campaign.plan.design import load_design
from hpcwhirl.campaign.run import run_campaign
from hpcwhirl.store.directory.campaign_directory import Directory
from hpcwhirl.store.directory.journal import Journals

CAMPAIGN = """
scene = {{duration = {duration}}}
solver = {{time_step = 2e-6}}
output = {{interval = 1e-3}}
sweep = {{speed = {{start = 300, stop = 500, num = {speeds}}}, friction = [0.0, 0.2]}}
"""


def inputs(place, speeds, duration):
    path = place / "campaign.toml"
    path.write_text(BARE + CAMPAIGN.format(speeds=speeds, duration=duration))
    return load_design(path, {})


def undisturbed(design, place):
    """Return the root variables of a campaign computed in this process at one go."""
    prepare(design, Directory(place / "undisturbed"))
    assert run_campaign(design, Directory(place / "undisturbed")).complete
    return root_variables(place / "undisturbed")


def end(process, victim):
    """Kill a rank, or with None mpirun and all its ranks; return once all is over."""
    pid = pid_of(process, victim) if victim is not None else None
    if pid is None:
        kill(process)
        return
    os.kill(pid, signal.SIGKILL)
    process.communicate(timeout=LIMIT)


def runs(out):
    return {path.name.split("-")[0] for path in out.glob("journal/*.log")}


def left_of(out, cases):
    return cases - len({record["case"] for record in records(out)})


def struck(words, cases, ranks, victim, chance):
    """Start a campaign and kill it at a random moment; tell whether that cut it short.

    A machine that is fast enough has done everything before.
    """
    out = words[-1]
    before, more, old = len(records(out)), chance.randrange(9), len(runs(out))
    process = start(words, ranks)
    limit = time.monotonic() + LIMIT
    while len(runs(out)) == old or len(records(out)) < before + more:
        if process.poll() is not None or not left_of(out, cases):
            break
        assert time.monotonic() < limit
        time.sleep(0.005)
    time.sleep(chance.uniform(0.0, 0.05))
    alive = process.poll() is None
    if alive:
        end(process, victim)
    else:
        finish(process)
    if not left_of(out, cases):
        return False
    assert alive, process.err  # ended by itself, but not with all done
    assert process.returncode not in (0, 1)
    return True


def completes(words, cases, expected):
    """Finish a campaign: the bits of the undisturbed one, every case once."""
    # what was under way at several kills may have been set aside: again, please
    done = launch(*words, "--retry", "failed,crashed", ranks=2)
    assert done.returncode == 0, done.err
    assert root_variables(words[-1]) == expected
    after = sorted(record["case"] for record in records(words[-1]) if "row" in record)
    assert after == list(range(cases))


def survives(place, design, kills, sizes, seed, bound):
    """Kill campaigns time after time; their bits are those of an undisturbed one.

    However fast the machine: a campaign that is nearly done is finished and compared,
    and another one is begun, until there have been so many kills.
    """
    end_of_test, chance = time.monotonic() + bound, random.Random(seed)
    expected, cases, ranks = undisturbed(design, place), len(design.scenes), 1
    victims = list(itertools.islice(itertools.cycle([None, 1, 0]), kills))
    for number in itertools.count():
        if not victims:
            return
        out = place / f"out-{number}"
        words = ["campaign", place / "campaign.toml", "--out", out]
        kept = []
        while victims and left_of(out, cases) > cases // 4:
            assert time.monotonic() < end_of_test, f"{len(victims)} kills to go"
            ranks = chance.choice([n for n in sizes if n != ranks])
            if struck(words, cases, ranks, victims[0], chance):
                victims.pop(0)
            found = records(out)
            assert all(record in found for record in kept)  # nothing kept is lost
            kept = found
        completes(words, cases, expected)


@pytest.mark.mpi
@pytest.mark.slow
@pytest.mark.timeout(3000)
@pytest.mark.parametrize(
    ("kills", "sizes"),
    [(3, (2, 3)), pytest.param(20, (2, 3, 4), marks=pytest.mark.evidence)],
)
def test_kills_of_all_of_a_worker_and_of_rank_0_cost_no_bit(tmp_path, kills, sizes):
    design = inputs(tmp_path, speeds=5 * kills, duration=0.05)
    survives(tmp_path, design, kills, sizes, seed=2, bound=3600)


def torn(whole, place, name, keep):
    """Return a copy of a finished campaign with one file cut to some bytes."""
    out = place / "torn"
    shutil.rmtree(out, ignore_errors=True)
    shutil.copytree(whole, out)
    (out / "results.h5").unlink()
    (path,) = (out / name).iterdir()
    path.write_bytes(path.read_bytes()[:keep])
    return out


@pytest.mark.turns
def test_a_journal_cut_at_any_byte_is_a_prefix_of_itself(finished, tmp_path):
    out = torn(finished, tmp_path, "journal", None)
    (log,) = (out / "journal").iterdir()
    whole, everything = log.read_bytes(), list(Journals(out).newest().items())
    assert len(everything) == 2
    counts = []
    for size in reversed(range(len(whole) + 1)):
        os.truncate(log, size)
        left = list(Journals(out).newest().items())
        assert left == everything[: len(left)]
        counts.append(len(left))
    assert counts == sorted(counts, reverse=True)
    assert (counts[:2], counts[-1]) == ([2, 1], 0)  # no byte of a record is spare


@pytest.mark.turns
def test_traces_cut_at_any_byte_leave_whole_blocks_only(finished, tmp_path):
    out = torn(finished, tmp_path, "traces", None)
    (blocks,) = (out / "traces").iterdir()
    whole, everything = blocks.read_bytes(), Journals(out).newest()
    names = list(everything)
    ends = [sum(everything[n]["traces"][k] for k in ("offset", "bytes")) for n in names]
    for size in reversed(range(0, len(whole) + 1, 7)):
        os.truncate(blocks, size)
        found = Journals(out).newest()
        assert list(found) == names[: sum(end <= size for end in ends)]
        for record in found.values():
            Journals(out).traces(record["traces"])  # raises where one is damaged


@pytest.mark.turns
def test_what_was_cut_anywhere_is_completed_to_the_same_bits(finished, tmp_path):
    expected, chance = root_variables(finished), random.Random(3)
    handlers = {s: signal.getsignal(s) for s in (2, signal.SIGUSR1, signal.SIGTERM)}
    design = load_design(finished.parent / "short.toml", {})
    for name in ("journal", "traces"):
        (path,) = (finished / name).iterdir()
        size = path.stat().st_size
        for keep in [0, 1, size - 1, *(chance.randrange(size) for _ in range(3))]:
            out = torn(finished, tmp_path, name, keep)
            assert run_campaign(design, Directory(out)).complete
            assert root_variables(out) == expected
    for number, handler in handlers.items():
        signal.signal(number, handler)
