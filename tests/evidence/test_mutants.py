"""What `scripts/evidence/mutants.py` puts into a tree is one change of what runs."""

import ast
import itertools
from pathlib import Path

import pytest
from evidence import mutants

pytestmark = pytest.mark.evidence

SOURCE = b'''"""A text: 1 < 2."""
LIMIT: int | None = 3


@cached(size=4)
def far(x: float = 0.5, *, loud: bool = True) -> float:
    """Say 1."""
    if x < LIMIT and loud:
        say(f"{x + 1} is near")
        os.kill(7, 9)
    return -x * 2.0 + sum(1 for y in (x,) if y > 8)
'''


def test_a_mutant_is_one_change_of_what_runs():
    before = ast.dump(ast.parse(SOURCE))
    every = list(mutants.mutants_of("far.py", SOURCE))
    kinds = {"comparison", "condition", "constant", "dropped", "limit", "operator"}
    assert {mutant.kind for mutant in every} == kinds
    for mutant in every:
        planted = mutant.plant(SOURCE)
        assert ast.dump(ast.parse(planted)) != before
        assert SOURCE.splitlines()[mutant.line - 1].decode().find(
            mutant.before.splitlines()[0]
        ) >= 0  # fmt: skip
    assert not {m.before for m in every} & {"7", "9", "4", "x + 1", "int | None"}


def test_a_seed_tells_the_draws_and_draws_none_twice():
    every = list(mutants.mutants_of("far.py", SOURCE))
    once, again = (list(mutants.drawn(every, 5)) for _ in range(2))
    assert once == again
    assert sorted(map(str, once)) == sorted(map(str, every))
    other = list(itertools.islice(mutants.drawn(every, 6), len(every)))
    assert other != once


def test_a_draw_is_of_all_files_or_of_those_with_a_word(tmp_path):
    for name in ("a/far.py", "b/near.py", "c/mid.py", "dynamics/kernels/b.py"):
        path = tmp_path / "hpcwhirl" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
    for words, stems in (
        ([], "far near mid"),
        (["/a/", "/b"], "far near"),
        (["x"], ""),
    ):
        found = mutants.sources(tmp_path, words)
        assert [path.stem for path in found] == stems.split()


def test_the_tests_that_import_a_module_come_before_those_further_away(tmp_path):
    for name, text in {
        "hpcwhirl/__init__.py": "", "hpcwhirl/a.py": "",
        "hpcwhirl/b.py": "from hpcwhirl.a import x", "tests/support/c.py": "",
        "tests/x/test_far.py": "def f():\n    import hpcwhirl.b",
        "tests/x/test_near.py": "from hpcwhirl import a", "tests/test_other.py": "",
    }.items():  # fmt: skip
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    graph, module = mutants.importers(tmp_path), tmp_path / "hpcwhirl/a.py"
    found = [[p.name for p in mutants.near(graph, module, most)] for most in (1, 9)]
    assert found == [["test_near.py"], ["test_near.py", "test_far.py"]]


def test_tests_named_after_a_module_come_first():
    names = "x/margin_views.py", "x/other.py", "test_near.py", "test_margins.py"
    module, other, near, named = map(Path, names)
    graph = {module: {near, other}, other: {named}, near: set(), named: set()}
    assert mutants.near(graph, module, 9) == [named, near]
    assert mutants.near(graph, other, 9) == [named]
    assert mutants.alike(Path("cli/new.py"), Path("tests/case/test_new.py"))
    assert not mutants.alike(Path("cli/new.py"), Path("tests/report/test_newer.py"))


def test_a_verdict_stays_with_its_survivor_when_lines_move():
    every = list(mutants.mutants_of("hpcwhirl/far.py", SOURCE))
    moved = list(mutants.mutants_of("hpcwhirl/far.py", b"\n\n" + SOURCE))
    rows = {mutants.key(mutants.row_of(m)): "equivalent" for m in every}
    survived = mutants.Outcome("")
    text = mutants.not_seen([mutants.Tried(m, survived, 1.0) for m in moved], rows)
    assert text.count("equivalent") == len(moved)
    assert mutants.verdicts(text) == rows


SLOW = """
import time
def test_slow():
    time.sleep({seconds})
    assert {right}
"""


@pytest.mark.parametrize(
    ("seconds", "right", "told"),
    [
        (0, True, "SURVIVES"), (0, False, "test_slow.py::test_slow"),
        (1, True, "SURVIVES"), (1, False, "test_slow.py::test_slow"),
        (90, False, "TIMED OUT in test_slow.py::test_slow"),
    ],
)  # fmt: skip
def test_a_time_limit_is_no_failure(tmp_path, monkeypatch, capfd, seconds, right, told):
    monkeypatch.setattr(mutants, "LIMITS", (0.5, 6.0))
    test = tmp_path / "test_slow.py"
    test.write_text(SLOW.format(seconds=seconds, right=right))
    with capfd.disabled():  # the fork writes to its log
        outcome = mutants.with_longer_limits(tmp_path, [test])
    assert str(outcome) == told
    assert outcome.caught == (told == "test_slow.py::test_slow")


def test_what_timed_out_is_neither_caught_nor_survived():
    every = list(mutants.mutants_of("hpcwhirl/far.py", SOURCE))[:3]
    ends = ("test_a", False), ("test_b", True), ("", False)
    found = [
        mutants.Tried(mutant, mutants.Outcome(*end), 1.0)
        for mutant, end in zip(every, ends, strict=True)
    ]
    text = mutants.not_seen(found, {})
    assert "1 of 3 mutants caught, 1 timed out" in text
    survived, late = text.split("Those with a test that took more than")
    _, slow, alive = (mutants.row_of(mutant) for mutant in every)
    assert [row in survived for row in (alive, slow)] == [True, False]
    assert [row in late for row in (alive, slow)] == [False, True]
