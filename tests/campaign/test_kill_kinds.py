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
from launch import all_variables, held, kill, launch, records, start, wait_for

REFINED = """
scene = {duration = 0.02}
output = {interval = 1e-3}
[sweep]
speed = {start = 40, stop = 520, num = 9}
gap = [8e-5, 1.6e-4, 4e-4]
[refine]
over = ["speed", "gap"]
levels = 2
scale = {gap = "log"}
words = "both"
first = "draft"
"""
TWINS = """
[twins]
count = 2
of = "boundary"
spread = {force = 0.1}
"""
GRID = """
scene = {duration = 0.1}
solver = {time_step = 4e-6}
output = {traces = "summary"}
"""
SAMPLED = """
[sample]
count = 4
method = "saltelli"
gap = {distribution = "uniform", low = 1e-4, high = 3e-4}
force = {distribution = "lognormal", median = 75e3, deviation = 0.2}
"""
FOLDS = """
scene = {duration = 0.8}
solver = {preset = "draft"}
output = {traces = "summary"}
sweep = {speed = {start = 420, stop = 520, step = 20}}
branch = {over = "speed", starts = [420, 520]}
refine = {over = "speed", levels = 5, words = "branch"}
"""
RUN_UP = """
scene = {duration = 0.3, acceleration = 40.0, gap_closure = 2e-5, gap_time = 0.1}
solver = {time_step = 4e-6}
output = {traces = "summary", windows = 3}
sweep = {speed = {start = 390, stop = 430, step = 5}}
"""
OVAL = (
    GRID
    + """
[engine.casing]
profile = "harmonic,amplitude,phase;2,3e-5,0.4;3,1e-5,0.9"
[sweep]
speed = {start = 390, stop = 430, step = 5}
"""
)
LAYER = (
    GRID.replace('"summary"', '"full", interval = 1e-3').replace("0.1", "0.02")
    + """
[engine.casing]
contact_law = "abradable"
"""
)
LET_GO = """
[engine.casing]
profile = "harmonic,amplitude,phase;2,3e-5,0.4"
profile_release = 5e-3
"""
MOVING = """
scene = {duration = 0.02, acceleration = 200, gap_closure = 2e-5, gap_time = 0.1}
solver = {time_step = 8e-6}
output = {traces = "summary", windows = 2}
"""
OVER = """
[sweep]
speed = {start = 300, stop = 420, num = 3}
"""
HALVED = """
[refine]
over = ["speed"]
levels = 1
"""
LAWS = {  # of speed, gap and shape, in each kind of campaign that takes them
    "run-ups, refined": MOVING + OVER + HALVED,
    "run-ups, twins": MOVING + OVER + TWINS.replace('of = "boundary"\n', ""),
    "run-ups, sampled": MOVING + SAMPLED,
    "let go, refined": MOVING.replace(", acceleration = 200", "")
    + LET_GO
    + OVER
    + HALVED,
    "let go, sampled": MOVING.replace(", acceleration = 200", "") + LET_GO + SAMPLED,
}
KINDS = {
    "refined": REFINED,
    "refined, attractors": REFINED.replace("both", "attractor"),
    "branches, refined": FOLDS,
    "refined, confirmed": REFINED + 'confirm = "standard"\n',
    "refined, twins": REFINED + TWINS,
    "sampled": GRID + SAMPLED,
    "run-ups": RUN_UP,
    "not round": OVAL,
    "layer, sampled": LAYER + SAMPLED,
    "layer, twins": LAYER + "[sweep]\nspeed = {start = 390, stop = 430, step = 5}\n"
    + TWINS,
    "branches": GRID + "sweep = {speed = {start = 400, stop = 440, step = 5}}\n"
    'branch = {over = "speed"}\n',
    "extended, twins": GRID + "sweep = {speed = {start = 300, stop = 440, step = 10}}\n"
    + TWINS,
}  # fmt: skip
KILLS = int(os.environ.get("HPCWHIRL_KILLS", "1"))  # campaigns, of two kills each
EXTENDED = ("--extend", "undecided", "--to", "0.4")


def killed(words, ranks, count):
    """Start a campaign and kill it once it has so many rows; return how many it has."""
    out = words[4]
    process = start(words, ranks, first=held(out, count))
    wait_for(lambda: len(records(out)) >= count, process)
    kill(process)
    return len(records(out))


def begun(place, kind, name):
    """Return the words that finish a campaign of a kind, begun where it has to be."""
    file, out = place / "c.toml", place / name
    tables = on_engine("mostly_damped", tomllib.loads(KINDS[kind]))
    file.write_text(tomli_w.dumps(tables))
    words = ["campaign", file, "--report=no", "--out", out]
    if not kind.startswith("extended"):
        return words
    if name == "alone":
        assert launch(*words).returncode == 0
        shutil.copytree(out, place / "first")
    else:
        shutil.copytree(place / "first", out)
    return [*words, *EXTENDED]


def survives(place, kind, rounds, sizes=(1, 2)):
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
@pytest.mark.slow
@pytest.mark.parametrize("kind", LAWS)
def test_laws_and_shapes_have_the_same_bits_on_any_ranks(tmp_path, kind):
    file, found = tmp_path / "c.toml", []
    file.write_text(LAWS[kind])
    for ranks in (1, 2, 3):
        out = tmp_path / f"on-{ranks}"
        done = launch("campaign", file, "--report=no", "--out", out, ranks=ranks)
        assert done.returncode == 0, done.err
        found.append(all_variables(out))
    assert found[0] == found[1] == found[2]


@pytest.mark.mpi
@pytest.mark.timeout(3000)
@pytest.mark.parametrize(
    "kind",
    [k if k == "refined" else pytest.param(k, marks=pytest.mark.slow) for k in KINDS],
)
def test_kills_and_resumes_cost_no_bit(tmp_path, kind):
    survives(tmp_path, kind, KILLS)
