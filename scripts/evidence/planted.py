"""Put a bug in, see that it is seen: one at a time, each in a copy of the tree.

    python scripts/evidence/planted.py [WORD...]    all, or whose name or file has WORD

A bug of planted.toml goes into a copy of the sources, with a cache of its own. Its
tests must fail then, or the run of Table 2 that it names must be `unstable`; without a
bug that run is `completed`. Exits 1 where one goes unseen, 2 where the place of one is
no longer in the source.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import tomllib
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
TABLE = Path(__file__).with_suffix(".toml")
LIMIT = 3000  # s for the tests or the run of one bug, compilation included
SHORT = {"duration": 8e-3, "time_step": 2e-6, "interval": 2e-5}
Run = dict[str, str | float]


@dataclass(frozen=True)
class Bug:
    """A replacement in a source file, and who is to see it: tests, or a run."""

    name: str
    file: str
    right: str
    wrong: str
    seen_by: str | Run

    @property
    def standing(self) -> bool:
        """Whether its place is in the source."""
        path = ROOT / "hpcwhirl" / self.file
        return path.is_file() and self.right in path.read_text(encoding="utf-8")

    def plant(self, tree: Path) -> None:
        """Copy what tests and runs need, and put the bug in."""
        copy_tree(tree)
        target = tree / "hpcwhirl" / self.file
        text = target.read_text(encoding="utf-8")
        target.write_text(text.replace(self.right, self.wrong), encoding="utf-8")


def copy_tree(tree: Path) -> None:
    """Copy what tests and runs need."""
    skip = shutil.ignore_patterns("__pycache__")
    for part in ("hpcwhirl", "tests", "scripts", "jobs", ".ci", ".pictures"):
        shutil.copytree(ROOT / part, tree / part, ignore=skip)
    for name in ("pyproject.toml", "README.md", "CITATION.cff", "LICENSE"):
        shutil.copy(ROOT / name, tree)


def bugs() -> list[Bug]:
    """Return the table, and first a run with nothing in."""
    files = tomllib.loads(TABLE.read_text(encoding="utf-8"))
    nothing = Bug("nothing (as it is)", "errors.py", "", "", {"scheme": "general"})
    return [nothing] + [
        Bug(name, file, *told)
        for file, own in files.items()
        for name, told in own.items()
    ]


def started(tree: Path, *words: str) -> subprocess.CompletedProcess[str]:
    """Return how a module of Python ended among the sources of a tree."""
    own = {"PYTHONPATH": str(tree), "NUMBA_CACHE_DIR": str(tree / "numba")}
    return subprocess.run(
        [sys.executable, "-m", *words], cwd=tree, env=os.environ | own,
        capture_output=True, text=True, timeout=LIMIT, check=False,
    )  # fmt: skip


def by_tests(tree: Path, tests: str) -> tuple[bool, str]:
    """Return whether tests fail, and the first that does."""
    file, *rest = tests.split("::")
    (path,) = (tree / "tests").rglob(file)
    where = "::".join([str(path), *rest])
    done = started(tree, "pytest", "-qx", "-p", "no:cacheprovider", where)
    found = [t for t in done.stdout.splitlines() if t.startswith(("FAILED", "ERROR"))]
    told = found[0].split(" - ")[0] if found else "NOT SEEN"
    return done.returncode == 1 and bool(found), told


def by_run(tree: Path, settings: Run, wanted: str) -> tuple[bool, str]:
    """Return whether a run has an outcome, and the numbers that name it."""
    pairs = [f"{name}={value}" for name, value in (SHORT | settings).items()]
    given = [word for pair in pairs for word in ("--set", pair)]
    done = started(tree, "hpcwhirl", "run", "--json", "--quiet", *given)
    if not done.stdout:
        return False, f"no result: {done.stderr.strip().splitlines()[-1]}"
    facts = json.loads(done.stdout)
    found = ("ledger_error", "gap_error", "step_share")
    numbers = ", ".join(f"{n} {facts[n]:.1e}" for n in found)
    told = f"{settings['scheme']}: {facts['outcome']} ({facts['stop']}; {numbers})"
    return facts["outcome"] == wanted, told


def seen(bug: Bug) -> bool:
    """Plant a bug; print and return whether it is seen."""
    with tempfile.TemporaryDirectory(prefix="planted-") as name:
        tree = Path(name)
        bug.plant(tree)
        if isinstance(bug.seen_by, str):
            known, told = by_tests(tree, bug.seen_by)
        else:
            wanted = "unstable" if bug.right else "completed"
            known, told = by_run(tree, bug.seen_by, wanted)
    print(f"{bug.name:46s} {bug.file:28s} {told}", flush=True)
    return known


def main() -> int:
    """Try the chosen bugs and report."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("words", nargs="*", metavar="WORD", help="of a name or file")
    words = parser.parse_args().words
    chosen = [b for b in bugs() if all(w in f"{b.name} {b.file}" for w in words)]
    gone = [bug for bug in chosen if not bug.standing]
    for bug in gone:
        print(f"{bug.name}: '{bug.right}' is not in {bug.file}", file=sys.stderr)
    if gone:
        return 2
    unseen = [bug.name for bug in chosen if not seen(bug)]
    print(f"{len(chosen) - len(unseen)} of {len(chosen)} as they should be")
    return 1 if unseen else 0


if __name__ == "__main__":
    sys.exit(main())
