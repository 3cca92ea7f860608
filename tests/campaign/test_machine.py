"""Ranks on other processors or with other libraries are told, or refused."""

import json
import platform
import sys

import pytest
from launch import ENVIRONMENT, MPIRUN, ROOT, SIX, ended, root_variables

from hpcwhirl.campaign.machine import FEATURES, difference, machine_facts, told
from hpcwhirl.store.directory.manifest import PlanFile

SHORT = SIX.replace("0.05", "0.002").replace("speed = [300, 340, 380, ", "speed = [")
# an older core, to OpenBLAS and NumPy, which choose their code by the processor
OLDER = {"OPENBLAS_CORETYPE": "Nehalem", "NPY_DISABLE_CPU_FEATURES": "X86_V3 X86_V4"}
WORDS = [sys.executable, "-m", "hpcwhirl", "campaign"]
PLACE = {"cwd": ROOT, "env": ENVIRONMENT}
x86 = pytest.mark.skipif(platform.machine() != "x86_64", reason="cores of x86-64")


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "c.toml"
    path.write_text(SHORT)
    return path


def test_what_decides_the_last_digits_is_known_in_full():
    facts = machine_facts()
    assert all(facts.values())
    assert facts["BLAS"].startswith(("openblas ", "mkl ", "blis "))
    assert json.loads(json.dumps(facts)) == facts
    assert difference(facts, facts) == ""


@pytest.mark.parametrize(
    ("change", "text"),
    [({"numpy": "1"}, "numpy 2 instead of 1"),
     ({"BLAS": "A"}, "BLAS none instead of A"),
     ({FEATURES: "AVX FMA3 SSE"}, "without FMA3"),
     ({FEATURES: "SSE"}, "with AVX"),
     ({FEATURES: "A B C D E F AVX SSE"}, "without A B C D and 2 others"),
     ({FEATURES: "FMA3 SSE", "numpy": "1"},
      "numpy 2 instead of 1, without FMA3, with AVX")],
)  # fmt: skip
def test_a_difference_is_named(change, text):
    now = {"numpy": "2", FEATURES: "AVX SSE"}
    assert difference(now | change, now) == text


def test_the_ranks_that_differ_are_counted():
    first, other = {"numpy": "2"}, {"numpy": "1"}
    assert told(first, [other]).startswith("this process computes otherwise")
    assert told(first, [None, other]).startswith("rank 1 computes otherwise")
    text = told(first, [None, other, None, other])
    assert text.startswith("2 of 4 ranks, first rank 1, compute otherwise")


def lines_of(done):
    return [line for line in done.stderr.splitlines() if "otherwise than" in line]


@pytest.mark.slow
@x86
def test_a_campaign_that_goes_on_on_another_machine_says_so_or_is_refused(
    file, tmp_path
):
    out = tmp_path / "out"
    assert not lines_of(ended(*WORDS, file, "--out", out, check=True, **PLACE))
    before = root_variables(out)
    assert len(PlanFile(out).read().machines) == 1
    file.write_text(SHORT.replace("500]", "500, 520]"))
    older = PLACE | {"env": ENVIRONMENT | OLDER}
    done = ended(*WORDS, file, "--out", out, "--same", "strict", **older)
    assert done.returncode == 2
    assert len(lines_of(done)) == 1
    assert 'same = "strict" refuses that' in done.stderr
    assert root_variables(out) == before
    done = ended(*WORDS, file, "--out", out, check=True, **older)
    (line,) = lines_of(done)
    assert "this process computes otherwise than the process that began" in line
    assert "Nehalem instead of" in line
    machines = PlanFile(out).read().machines
    assert [("Nehalem" in facts["BLAS"]) for facts in machines] == [False, True]
    done = ended(*WORDS, file, "--out", out, check=True, **older)  # nothing is left
    assert not lines_of(done)


@pytest.mark.slow
@x86
@pytest.mark.mpi
def test_a_rank_on_another_machine_is_told_once(file, tmp_path):
    out = tmp_path / "out"
    words = [*map(str, (*WORDS, file, "--out", out))]
    older = ["env", *(f"{name}={value}" for name, value in OLDER.items())]

    def both(*more):
        first = [*MPIRUN, "-n", "1", *words, *more]
        return ended(*first, ":", "-n", "1", *older, *words, *more, **PLACE)

    done = both("--same", "strict")
    assert done.returncode == 2, done.stderr
    assert len(lines_of(done)) == 1
    done = both()
    assert done.returncode == 0, done.stderr
    (line,) = lines_of(done)
    assert "rank 1 computes otherwise" in line
    assert len(PlanFile(out).read().machines) == 2


@pytest.mark.slow
@pytest.mark.mpi
def test_ranks_that_are_alike_are_not_told(file, tmp_path):
    out = tmp_path / "out"
    done = ended(*MPIRUN, "-n", "2", *WORDS, file, "--out", out, check=True, **PLACE)
    assert not lines_of(done)
    assert len(PlanFile(out).read().machines) == 1
