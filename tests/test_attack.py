"""A short slice of scripts/evidence/attack.py: nothing gets through."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[1] / "scripts" / "evidence" / "attack.py"
SLICE = {  # tries of each family; work, not seconds, bounds them
    "kills": 4,
    "damage": 24,
    "toml": 40,
    "set": 40,
    "engines": 16,
    "names": 12,
    "gathers": 4,
    "gathers-unlocked": 4,
    "together": 3,
    "disk": 3,
    "signals": 4,
}


def attacked(*words):
    call = [sys.executable, SCRIPT, "--json", *map(str, words)]
    return subprocess.run(call, capture_output=True, text=True, check=False)


@pytest.mark.slow
@pytest.mark.mpi
@pytest.mark.timeout(3000)  # a fresh machine compiles the kernels of every mode first
@pytest.mark.parametrize(("family", "tries"), SLICE.items())
def test_an_attack_of_this_family_gets_nowhere(family, tries):
    done = attacked("--only", family, "--count", tries)
    (facts,) = json.loads(done.stdout)
    assert not facts["failures"], facts["failures"]
    assert done.returncode == 0, done.stderr
    assert facts["tries"] + sum(facts["skipped"].values()) >= tries


def test_an_unknown_family_is_told_with_the_known_ones():
    done = attacked("--only", "nonsense")
    assert done.returncode == 2
    assert "unknown family nonsense" in done.stderr
    assert "kills" in done.stderr


def test_runs_of_several_seeds_are_told_together(tmp_path):
    facts = {"attack": "set", "title": "hostile", "demanded": 2000, "tries": 3}
    facts |= {"survived": 2, "failed": 1, "kinds": {"run": 3}, "skipped": {}}
    for seed in (1, 2):
        told = [facts | {"seed": seed, "failures": [f"of {seed}"]}]
        (tmp_path / f"{seed}.json").write_text(json.dumps(told))
    done = attacked("--read", tmp_path / "1.json", tmp_path / "2.json")
    (both,) = json.loads(done.stdout)
    assert (done.returncode, both["seed"]) == (1, "1 and 2")
    assert (both["tries"], both["kinds"], both["failed"]) == (6, {"run": 6}, 2)
    assert both["failures"] == ["of 1", "of 2"]
    twice = attacked("--read", tmp_path / "1.json", tmp_path / "1.json")
    assert "seed 1 twice" in twice.stderr
