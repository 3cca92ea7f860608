"""A short slice of scripts/evidence/attack.py: nothing gets through."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[2] / "scripts" / "evidence" / "attack.py"
SLICE = {  # tries of each family, as evidence; work, not seconds, bounds them
    "kills": 4, "damage": 24, "toml": 40, "set": 40, "engines": 16, "names": 12,
    "measures": 12, "conditions": 40, "together": 7, "together-unlocked": 7, "disk": 3,
    "ground": 4, "links": 12, "rounding": 7, "caches": 3, "styles": 3, "processors": 2,
    "libraries": 2, "formulas": 8,
}  # fmt: skip


def attacked(*words):
    call = [sys.executable, SCRIPT, "--json", *map(str, words)]
    return subprocess.run(call, capture_output=True, text=True, check=False)


@pytest.mark.slow
@pytest.mark.mpi
@pytest.mark.timeout(3000)  # a fresh machine compiles the kernels of every mode first
@pytest.mark.parametrize(
    ("family", "tries"),
    [("damage", 4)]
    + [pytest.param(*f, marks=pytest.mark.evidence) for f in SLICE.items()],
)
def test_an_attack_of_this_family_gets_nowhere(family, tries):
    done = attacked("--only", family, "--count", tries)
    (facts,) = json.loads(done.stdout)
    assert not facts["failures"], facts["failures"]
    assert done.returncode == 0, done.stderr
    assert facts["tries"] + sum(facts["skipped"].values()) >= tries


@pytest.mark.turns
def test_an_unknown_family_is_told_with_the_known_ones():
    done = attacked("--only", "nonsense")
    assert done.returncode == 2
    assert "unknown family nonsense" in done.stderr
    assert "kills" in done.stderr
