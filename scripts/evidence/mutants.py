"""Draw mutants, see which the quick tests miss: one at a time, in a copy of the tree.

    python scripts/evidence/mutants.py [WORD...]   in all files, or in those with a WORD
    options: --seed 1  --count 40  --minutes 60  --files 12  --list  --write

A mutant is one change of the source outside the kernels: another operator or
comparison, a constant off by one (a float: doubled or halved), a negated condition, a
dropped statement. First a kind is drawn, then a place. Bugs inside the kernels, each of
which compiles them anew, are those of planted.toml.

Test files run until one test fails: first those named after the changed module, then in
the order of how near they are to it by imports; twelve, or `--files` of them. A time
limit that ends a test is no failure: all run again with a longer one, and a mutant with
a test that takes longer yet has timed out, which is neither caught nor survived.

`--write` puts the survivors and what timed out into mutants.md, with the verdicts that
are there already. Exits 1 where one of them has no verdict. Calls that send signals are
not changed.

No library does it: mutmut changes only what lies in functions, behind trampolines that
change what the compiler's fingerprint reads; cosmic-ray drops no statement and draws no
sample.
"""

from __future__ import annotations

import argparse
import ast
import contextlib
import copy
import gc
import importlib
import itertools
import os
import random
import re
import sys
import tempfile
import time
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn

import pytest

sys.path.insert(0, str(Path(__file__).parents[1]))
from common import tell
from evidence import planted

ROOT = Path(__file__).parents[2]
PAGE = Path(__file__).with_suffix(".md")
KERNELS = "hpcwhirl/dynamics/kernels"
QUICK = "not slow and not evidence and not browser and not cluster"
LIMITS = 300.0, 1200.0  # s a test, at first and again: a mutant may loop for ever
ENDED = re.compile(r"^E +(?:Failed: Timeout|subprocess\.TimeoutExpired)", re.MULTILINE)
LIKE = 5  # letters in which the names of a module and of a test agree
LIBRARIES = ("h5netcdf", "h5py", "matplotlib.figure", "numba", "numpy",
             "pydantic", "rich.console", "scipy.sparse.linalg", "scipy.stats",
             "xarray")  # fmt: skip
SIGNALS = {"kill", "killpg"}
BY_NAME = ("hpcwhirl/cli", "hpcwhirl/dynamics/schemes")  # imported by a text
COMPARISONS: dict[type[ast.cmpop], tuple[type[ast.cmpop], ...]] = {
    ast.Lt: (ast.LtE, ast.GtE), ast.LtE: (ast.Lt, ast.Gt),
    ast.Gt: (ast.GtE, ast.LtE), ast.GtE: (ast.Gt, ast.Lt),
    ast.Eq: (ast.NotEq,), ast.NotEq: (ast.Eq,), ast.In: (ast.NotIn,),
    ast.NotIn: (ast.In,), ast.Is: (ast.IsNot,), ast.IsNot: (ast.Is,),
}  # fmt: skip
OPERATORS: dict[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult,
    ast.FloorDiv: ast.Mult, ast.Mod: ast.FloorDiv, ast.Pow: ast.Mult,
}  # fmt: skip
DROPPED = (ast.AugAssign, ast.Raise, ast.Continue, ast.Break, ast.Delete)


@dataclass(frozen=True)
class Mutant:
    """A change of one place of a file: offsets in its bytes, and the new text."""

    file: str
    line: int
    kind: str
    start: int
    stop: int
    before: str
    after: str

    def plant(self, source: bytes) -> bytes:
        """Return the source with the mutant in."""
        return source[: self.start] + self.after.encode() + source[self.stop :]

    def __str__(self) -> str:
        """Tell where it is and what it changes, in one line."""
        before, after = (" ".join(t.split()) for t in (self.before, self.after))
        return f"{self.file}:{self.line}: {before} -> {after}"


def changed(node: ast.AST, **fields: object) -> str:
    """Return the text of a node with other fields, in brackets."""
    other = copy.copy(node)
    for name, value in fields.items():
        setattr(other, name, value)
    return f"({ast.unparse(other)})"


def is_text(node: ast.AST) -> bool:
    """Whether an operand is a text, of which an operator makes nothing but an error."""
    return isinstance(node, ast.JoinedStr) or (
        isinstance(node, ast.Constant) and isinstance(node.value, (str, bytes))
    )


def of_constant(value: object) -> Iterator[tuple[str, str]]:
    """Yield the kind and the text of what a constant becomes."""
    if isinstance(value, bool):
        yield "constant", str(not value)
    elif isinstance(value, int):
        yield from (("limit", str(value + 1)), ("limit", f"({value - 1})"))
    elif isinstance(value, float):
        yield from (
            ("constant", repr(v)) for v in {2 * value or 1.0, value / 2 or -1.0}
        )


def of_expression(node: ast.AST) -> Iterator[tuple[str, str]]:
    """Yield the kind and the text of what an expression becomes."""
    match node:
        case ast.Compare(ops=[op]):
            for other in COMPARISONS[type(op)]:
                yield "comparison", changed(node, ops=[other()])
        case ast.BinOp(op=op) if type(op) in OPERATORS:
            if not is_text(node.left) and not is_text(node.right):
                yield "operator", changed(node, op=OPERATORS[type(op)]())
        case ast.BoolOp(op=op):
            other = ast.Or if isinstance(op, ast.And) else ast.And
            yield "operator", changed(node, op=other())
        case ast.Constant(value=value):
            yield from of_constant(value)


def conditions(node: ast.AST) -> list[ast.expr]:
    """Return the conditions that a node asks."""
    if isinstance(node, ast.comprehension):
        return node.ifs
    return [node.test] if isinstance(node, (ast.If, ast.While, ast.IfExp)) else []


def left_alone(node: ast.AST) -> set[ast.AST]:
    """Return the children that say nothing at run time, or send a signal."""
    alone: list[ast.AST | None] = []
    if isinstance(node, (ast.AnnAssign, ast.arg)):
        alone = [node.annotation]
    elif isinstance(node, (ast.FunctionDef, ast.ClassDef)):
        alone = [*node.decorator_list, getattr(node, "returns", None)]
    elif isinstance(node, ast.JoinedStr):  # 3.11 does not know their places
        alone = list(node.values)
    elif isinstance(node, ast.Call) and getattr(node.func, "attr", "") in SIGNALS:
        alone = list(node.args)
    return {child for child in alone if child is not None}


def places(node: ast.AST) -> Iterator[tuple[ast.expr | ast.stmt, str, str]]:
    """Yield (what is changed, kind, new text) of a node and of all below it."""
    for test in conditions(node):
        yield test, "condition", f"(not ({ast.unparse(test)}))"
    if isinstance(node, ast.expr):
        for kind, after in of_expression(node):
            yield node, kind, after
    call = isinstance(node, ast.Expr) and isinstance(node.value, ast.Call)
    if call or isinstance(node, DROPPED):
        yield node, "dropped", "pass"  # type: ignore[misc]
    alone = left_alone(node)
    for child in ast.iter_child_nodes(node):
        if child not in alone:
            yield from places(child)


def mutants_of(file: str, source: bytes) -> Iterator[Mutant]:
    """Yield every mutant of a file."""
    begins = [0]
    for line in source.splitlines(keepends=True):
        begins.append(begins[-1] + len(line))
    for node, kind, after in places(ast.parse(source)):
        start = begins[node.lineno - 1] + node.col_offset
        stop = begins[(node.end_lineno or 0) - 1] + (node.end_col_offset or 0)
        before = source[start:stop].decode()
        yield Mutant(file, node.lineno, kind, start, stop, before, after)


def sources(tree: Path, words: list[str]) -> list[Path]:
    """Return the files that mutants are drawn in."""
    found = sorted((tree / "hpcwhirl").rglob("*.py"))
    names = {path: path.relative_to(tree).as_posix() for path in found}
    return [
        path for path in found
        if KERNELS not in names[path]
        and (not words or any(word in names[path] for word in words))
    ]  # fmt: skip


def drawn(every: Iterable[Mutant], seed: int) -> Iterator[Mutant]:
    """Yield mutants at random without end or repetition: a kind first, then a place."""
    kinds: dict[str, list[Mutant]] = defaultdict(list)
    for mutant in every:
        kinds[mutant.kind].append(mutant)
    dice = random.Random(seed)
    while kinds:
        kind = dice.choice(sorted(kinds))
        yield kinds[kind].pop(dice.randrange(len(kinds[kind])))
        if not kinds[kind]:
            del kinds[kind]


# Which tests are near


def imports(path: Path) -> set[str]:
    """Return the dotted names that a file imports, in functions, too."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(path.read_bytes())):
        if isinstance(node, ast.Import):
            names |= {item.name for item in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            names |= {node.module}
            names |= {f"{node.module}.{item.name}" for item in node.names}
    return names


def importers(tree: Path) -> dict[Path, set[Path]]:
    """Return which files of the tree import each of them."""
    modules: dict[str, Path] = {}
    for root in ("", "tests/support", "scripts"):
        for path in (tree / root).rglob("*.py"):
            dotted = ".".join(path.relative_to(tree / root).with_suffix("").parts)
            modules.setdefault(dotted.removesuffix(".__init__"), path)
    found: dict[Path, set[Path]] = defaultdict(set)
    for path in set(modules.values()):
        for name in imports(path):
            if name in modules:
                found[modules[name]].add(path)
        if path.parent.relative_to(tree).as_posix() in BY_NAME:
            found[path].add(path.parent / "__init__.py")
    return found


def alike(module: Path, test: Path) -> bool:
    """Whether a test file is named after a module, or after the folder it lies in."""
    words = {w for part in (module.parent.name, module.stem) for w in part.split("_")}
    own = test.stem.split("_")[1:]

    def agree(a: str, b: str) -> bool:
        return a == b or (len(a) >= LIKE and a[:LIKE] == b[:LIKE])

    return any(agree(a, b) for a in words for b in own)


def near(graph: dict[Path, set[Path]], module: Path, most: int) -> list[Path]:
    """Return so many of the test files that import a module: the nearest first.

    First come those named after it; of those equally near, the ones that import little
    else, which are about it.
    """
    fan = Counter(path for others in graph.values() for path in others)
    seen, edge, tests = {module}, {module}, []
    while edge:
        edge = {other for path in edge for other in graph[path]} - seen
        seen |= edge
        found = [path for path in edge if path.name.startswith("test_")]
        tests += sorted(found, key=lambda path: (fan[path], path))
    return sorted(tests, key=lambda path: not alike(module, path))[:most]


def loaded() -> None:
    """Import what all tests import, but nothing of the tree: every fork has it."""
    for name in LIBRARIES:
        importlib.import_module(name)
    gc.freeze()


def run_pytest(tree: Path, log: Path, tests: list[Path], limit: float) -> NoReturn:
    """Run the quick ones of these tests in this fork, which ends with pytest's code.

    limit : s a test
    """
    code = 3  # as of an error inside pytest
    try:
        for number in (1, 2):
            os.dup2(os.open(log, os.O_WRONLY | os.O_CREAT | os.O_APPEND), number)
        os.chdir(tree)
        sys.path.insert(0, str(tree))
        words = ["-qx", "-m", QUICK, "--timeout", str(limit), "-p", "no:cacheprovider"]
        code = pytest.main([*words, *map(str, tests)])
    finally:
        sys.stdout.flush()
        os._exit(code)


@dataclass(frozen=True)
class Outcome:
    """The quick test that failed, or an empty text; whether a time limit ended it."""

    test: str
    timed_out: bool = False

    @property
    def caught(self) -> bool:
        """Whether a test failed."""
        return bool(self.test) and not self.timed_out

    def __str__(self) -> str:
        """Tell it in a line."""
        if self.timed_out:
            return f"TIMED OUT in {self.test}"
        return self.test or "SURVIVES"


def by_quick_tests(tree: Path, tests: list[Path], limit: float) -> Outcome:
    """Return how the tests went, up to the first that failed; limit in s a test."""
    if not tests:
        return Outcome("")
    log = tree / "pytest.log"
    log.unlink(missing_ok=True)
    pid = os.fork()
    if pid == 0:
        run_pytest(tree, log, tests, limit)
    code = os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])
    if code in (0, 5):  # 5: none of them is quick
        return Outcome("")
    text = log.read_text(encoding="utf-8")
    told = re.search(r"^(?:FAILED|ERROR) (\S+)", text, re.MULTILINE)
    if not told:
        return Outcome(f"pytest ended with {code}: {text[-300:]}")
    return Outcome(told[1], timed_out=bool(ENDED.search(text)))


def with_longer_limits(tree: Path, tests: list[Path]) -> Outcome:
    """Return how the tests went, with a longer limit where the first ended one."""
    for limit in LIMITS:
        outcome = by_quick_tests(tree, tests, limit)
        if not outcome.timed_out:
            break
    return outcome


@dataclass(frozen=True)
class Tried:
    """A mutant, how its tests went, and what it cost."""

    mutant: Mutant
    outcome: Outcome
    seconds: float


def tried(tree: Path, mutant: Mutant, tests: list[Path]) -> Tried:
    """Put a mutant in, run the tests, take it out; print what became of it."""
    path, began = tree / mutant.file, time.monotonic()
    source = path.read_bytes()
    path.write_bytes(mutant.plant(source))
    try:
        outcome = with_longer_limits(tree, tests)
    finally:
        path.write_bytes(source)
    seconds = time.monotonic() - began
    print(f"{mutant}  {outcome}  {seconds:.0f} s", flush=True)
    return Tried(mutant, outcome, seconds)


# The page


def row_of(mutant: Mutant) -> str:
    """Return the cells of a survivor."""
    before, after = (
        " ".join(t.split()).replace("|", "\\|") for t in (mutant.before, mutant.after)
    )
    return f"| {mutant.file}:{mutant.line} | `{before}` | `{after}` |"


def key(row: str) -> str:
    """Return the row without the line, which moves with what stands above."""
    return re.sub(r":\d+ ", " ", row, count=1)


def verdicts(text: str) -> dict[str, str]:
    """Return the verdicts of a page by what is changed where, without the line."""
    rows = re.findall(r"^(\| hpcwhirl/.*`) \| (.*) \|$", text, re.MULTILINE)
    return {key(f"{row} |"): verdict for row, verdict in rows}


def table(found: Iterable[Tried], known: dict[str, str]) -> list[str]:
    """Return the lines of a table of mutants, with their verdicts."""
    rows = [row_of(one.mutant) for one in found]
    return [
        "| place | before | after | verdict |", "|---|---|---|---|",
        *(f"{row} {known.get(key(row), '')} |" for row in rows),
    ]  # fmt: skip


def told_of(found: list[Tried]) -> str:
    """Return how many were caught, and how many timed out."""
    caught, late = (
        sum(getattr(one.outcome, word) for one in found)
        for word in ("caught", "timed_out")
    )
    return f"{caught} of {len(found)} mutants caught, {late} timed out"


def not_seen(found: list[Tried], known: dict[str, str]) -> str:
    """Return how many were caught, and who was not."""
    survived = [one for one in found if not one.outcome.test]
    late = [one for one in found if one.outcome.timed_out]
    lines = [f"{told_of(found)}. Those that survived:", "", *table(survived, known)]
    if late:
        lines += ["", f"Those with a test that took more than {LIMITS[-1]:g} s:", "",
                  *table(late, known)]  # fmt: skip
    return "\n".join(lines)


def parsed() -> argparse.Namespace:
    """Return the words of the command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("words", nargs="*", metavar="WORD", help="of a file's path")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=40)
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--files", type=int, default=12, help="of tests, at most")
    parser.add_argument("--list", action="store_true", help="draw, do not run")
    parser.add_argument("--write", action="store_true", help="write mutants.md")
    return parser.parse_args()


def chosen(tree: Path, asked: argparse.Namespace) -> Iterator[Mutant]:
    """Yield the mutants drawn, as many as are asked for."""
    every = [
        mutant
        for path in sources(tree, asked.words)
        for mutant in mutants_of(str(path.relative_to(tree)), path.read_bytes())
    ]
    print(f"{len(every)} mutants to draw from")
    yield from itertools.islice(drawn(every, asked.seed), asked.count)


def main() -> int:
    """Draw, try and report."""
    asked = parsed()
    found: list[Tried] = []
    until = time.monotonic() + 60 * asked.minutes
    with tempfile.TemporaryDirectory(prefix="mutants-") as name:
        tree = Path(name)
        planted.copy_tree(tree)
        os.environ |= {"PYTHONPATH": name, "NUMBA_CACHE_DIR": f"{name}/numba"}
        loaded()
        graph = importers(tree)
        for mutant in chosen(tree, asked):
            if asked.list:
                print(mutant)
            elif time.monotonic() < until:
                tests = near(graph, tree / mutant.file, asked.files)
                found.append(tried(tree, mutant, tests))
    known = verdicts(PAGE.read_text(encoding="utf-8"))
    tell(not_seen(found, known), PAGE if asked.write else None)
    left = [one.mutant for one in found if not one.outcome.caught]
    return 0 if all(known.get(key(row_of(mutant))) for mutant in left) else 1


if __name__ == "__main__":
    with contextlib.suppress(KeyboardInterrupt):
        sys.exit(main())
