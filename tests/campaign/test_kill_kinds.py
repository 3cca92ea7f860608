"""Kills of campaigns of every kind: refined, with twins, extended, sampled.

Whatever the ranks and however often they are killed, the bits are those of a campaign
that one process computed undisturbed, and nothing is computed that it did not. Twenty
kills of each kind: `HPCWHIRL_KILLS=10 pytest -m mpi tests/campaign/test_kill_kinds.py`.
"""

import os
import random
import shutil
import tomllib

import pytest
import tomli_w
from common import on_engine
from launch import (
    BARE,
    all_variables,
    held,
    kill,
    launch,
    records,
    start,
    wait_for,
)

HALVED = """
[sweep]
speed = {start = 40, stop = 520, num = 5}
gap = [8e-5, 4e-4]
[refine]
over = ["speed", "gap"]
levels = 1
scale = {gap = "log"}
words = "both"
first = "draft"
"""
TWINS = """
[twins]
count = 2
spread = {force = 0.1}
"""
BOUNDARY = TWINS + 'of = "boundary"\n'
SAMPLED = """
[sample]
count = 2
method = "saltelli"
gap = {distribution = "uniform", low = 1e-4, high = 3e-4}
force = {distribution = "lognormal", median = 75e3, deviation = 0.2}
"""
SWEPT = "sweep = {speed = {start = 400, stop = 440, step = 10}}\n"
FOLDS = """
scene = {duration = 0.4}
solver = {preset = "draft"}
output = {traces = "summary"}
sweep = {speed = {start = 440, stop = 500, step = 20}}
branch = {over = "speed", starts = [440, 500]}
refine = {over = "speed", levels = 2, words = "branch"}
"""
PLAIN = """
scene = {duration = 0.02}
solver = {time_step = 8e-6}
output = {interval = 1e-3}
"""
# laws of speed, gap and shape, and a casing that keeps what was rubbed off
MOVING = """
scene = {duration = 0.02, acceleration = 200, gap_closure = 2e-5, gap_time = 0.1}
solver = {time_step = 8e-6}
output = {traces = "summary", windows = 2}
"""
LET_GO = """
scene = {duration = 0.02, gap_closure = 2e-5, gap_time = 0.1}
solver = {time_step = 8e-6}
engine.casing = {profile = "harmonic,amplitude,phase;2,3e-5,0.4", \
    profile_release = 5e-3}
"""
OVAL = """
scene = {duration = 0.1}
solver = {time_step = 8e-6}
output = {traces = "summary"}
engine.casing.profile = "harmonic,amplitude,phase;2,3e-5,0.4;3,1e-5,0.9"
"""
LAYER = PLAIN + 'engine.casing.contact_law = "abradable"\n'
KINDS = {  # every plan of cases, every law, not every pair of them
    "refined": PLAIN + HALVED,
    "let go, refined, attractors": LET_GO + HALVED.replace("both", "attractor"),
    "branches, refined": FOLDS,
    "refined, confirmed": PLAIN + HALVED + 'confirm = "standard"\n',
    "refined, twins": PLAIN + HALVED + BOUNDARY,
    "run-ups, sampled": MOVING + SAMPLED,
    "layer, twins": LAYER + SWEPT + TWINS,
    "branches": PLAIN + SWEPT + 'branch = {over = "speed"}\n',
    "extended, twins": OVAL + SWEPT + TWINS,
}
MORE = {
    "run-ups, refined": MOVING + HALVED,
    "run-ups, twins": MOVING + SWEPT + TWINS,
    "let go, sampled": LET_GO + SAMPLED,
    "layer, sampled": LAYER + SAMPLED,
    "not round": OVAL + SWEPT,
}
QUICK = "refined"
KILLS = int(
    os.environ.get("HPCWHIRL_KILLS", "0")
)  # further campaigns, of two kills each
EXTENDED = ("--extend", "undecided", "--to", "0.2")


def killed(words, ranks, count):
    """Start a campaign and kill it once it has so many rows; return how many it has."""
    out = words[3]
    process = start(words, ranks, first=held(out, count))
    wait_for(lambda: len(records(out)) >= count, process)
    kill(process)
    return len(records(out))


def begun(place, kind, name):
    """Return the words that finish a campaign of a kind, begun where it has to be."""
    file, out = place / "c.toml", place / name
    given = tomllib.loads(BARE + (KINDS | MORE)[kind])
    tables = on_engine("mostly_damped", given)
    file.write_text(tomli_w.dumps(tables))
    words = ["campaign", file, "--out", out]
    if not kind.startswith("extended"):
        return words
    if name == "alone":
        assert launch(*words).returncode == 0
        shutil.copytree(out, place / "first")
    else:
        shutil.copytree(place / "first", out)
    return [*words, *EXTENDED]


def survives(place, kind, rounds, sizes):
    """Kill campaigns on each number of ranks in turn; compare what they end with."""
    words = begun(place, kind, "alone")
    first = len(records(place / "alone"))
    assert launch(*words).returncode == 0
    expected, cases = all_variables(place / "alone"), len(records(place / "alone"))
    chance = random.Random(7)
    for turn in range(rounds):
        out = place / f"killed-{turn}"
        words = begun(place, kind, out.name)
        # each rank may end one case more
        counts = sorted(chance.sample(range(first + 1, cases - 2), len(sizes)))
        for ranks, count in zip(sizes, counts, strict=True):
            assert count <= killed(words, ranks, count) < cases
        done = launch(*words, "--retry", "crashed", ranks=3)
        assert done.returncode == 0, done.err
        assert all_variables(out) == expected
        assert len({r["digest"] for r in records(out)}) == cases  # none too many


@pytest.mark.mpi
@pytest.mark.timeout(3000)
@pytest.mark.parametrize(
    "kind",
    [QUICK]
    + [pytest.param(kind, marks=pytest.mark.slow) for kind in KINDS if kind != QUICK]
    + [pytest.param(kind, marks=pytest.mark.evidence) for kind in MORE],
)
def test_kills_and_resumes_cost_no_bit(tmp_path, kind):
    sizes = (1, 2) if KILLS else (2,)
    survives(tmp_path, kind, KILLS or 1, sizes)
