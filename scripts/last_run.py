"""Ledger of the checks that continuous integration leaves out: scripts/last_run.md.

    python scripts/last_run.py [NAME RESULT]

Without arguments it tells which checks are older than what they judge; with two it
notes that the check NAME has ended with RESULT.

scripts/evidence.sh and scripts/test_cluster.sh note their runs, scripts/check tells
what is old. A check is old where a file that it judges has changed since, by content: a
commit's hash does not outlast a rebase.
"""

from __future__ import annotations

import hashlib
import re
import subprocess
import sys
from datetime import UTC, datetime
from pathlib import Path
from typing import NamedTuple

from common import parser_of

TOP = Path(__file__).parents[1]
LEDGER = TOP / "scripts/last_run.md"
HEAD = """# Last runs

When the checks that continuous integration leaves out were run last, written by
`scripts/evidence.sh` and `scripts/test_cluster.sh`; `scripts/check` tells which of them
are older than the code that they judge (`scripts/last_run.py`). `code` is a digest of
that code.

| check | result | date | commit | code |
|---|---|---|---|---|
"""
COMPUTES = ("analysis", "case", "dynamics", "reduction", "scene", "structure")
MOTIONS = tuple(f"hpcwhirl/{room}" for room in COMPUTES)
STORES = tuple(f"hpcwhirl/{room}" for room in ("campaign", "planner", "store"))
EVIDENCE = "scripts/evidence"
ROW = re.compile(r"^([\w-]+) +\|", re.MULTILINE)  # of the table in evidence.sh
# {check: paths of what it judges}; of others in the table of evidence.sh `ALL`
ALL = ("hpcwhirl",)
JUDGED = {
    "cluster": (
        *STORES, "hpcwhirl/cluster", "hpcwhirl/launch.py", "hpcwhirl/cli/job.py",
        "tests/cluster", "tests/support", "scripts/cluster", "scripts/test_cluster.sh",
    ),
    "tests": ("hpcwhirl", "tests", "scripts"),
    "planted": ("hpcwhirl", "tests", f"{EVIDENCE}/planted.toml"),
    "mutants": ("hpcwhirl", "tests"),
    "extremes": (*MOTIONS, "scripts/extremes"),
    "attacks": ("hpcwhirl", f"{EVIDENCE}/attacks"),
    "crashes": (*STORES, "hpcwhirl/launch.py", f"{EVIDENCE}/crashing"),
    "agreement": MOTIONS,
    "bars": MOTIONS,
    "estimates": (*MOTIONS, f"{EVIDENCE}/estimates.py"),
    "words-hold": (*MOTIONS, f"{EVIDENCE}/words_hold.py"),
    "words-full": (*MOTIONS, f"{EVIDENCE}/words_hold.py"),
    "basins": MOTIONS,
    "neighbours": (*MOTIONS, "hpcwhirl/refinement"),
    "decided": (*MOTIONS, f"{EVIDENCE}/words_hold.py"),
    "motions": MOTIONS,
    "early": MOTIONS,
    "claims": (*MOTIONS, f"{EVIDENCE}/populations"),
    "foresight": (*MOTIONS, "hpcwhirl/campaign/foresight"),
    "releases": ("hpcwhirl", "pyproject.toml"),
    "lowest": ("hpcwhirl", "pyproject.toml"),
    "packages": ("hpcwhirl", "pyproject.toml", "scripts/packaging"),
    "scale-cost": ("hpcwhirl/campaign", "hpcwhirl/dynamics"),
    "million": STORES,
}  # fmt: skip


CHECKS = ("cluster", *ROW.findall((TOP / "scripts/evidence.sh").read_text("utf-8")))


class Run(NamedTuple):
    """A row of the ledger: how a check ended, when, at which commit, on which code."""

    result: str
    date: str
    commit: str
    code: str


def git(*words: str) -> str:
    """Return what git tells of this clone."""
    call = ["git", "-C", str(TOP), *words]
    return subprocess.run(call, check=True, capture_output=True, text=True).stdout


def code_of(check: str) -> str:
    """Return a digest of the tracked files that a check judges, as they lie here."""
    digest = hashlib.sha256()
    names = git("ls-files", "-z", "--", *JUDGED.get(check, ALL)).split("\0")[:-1]
    for name in names:
        path = TOP / name
        if path == LEDGER:
            continue
        digest.update(f"{name}\0".encode())
        digest.update(path.read_bytes() if path.is_file() else b"")
    return digest.hexdigest()[:12]


def rows_of(text: str) -> dict[str, Run]:
    """Return {check: its last run} of a ledger's text."""
    cells = (line.strip("| ").split(" | ") for line in text.splitlines())
    return {row[0]: Run(*row[1:]) for row in cells if row[0] in CHECKS}


def ledger() -> dict[str, Run]:
    """Return {check: its last run} of the ledger in this clone."""
    return rows_of(LEDGER.read_text("utf-8") if LEDGER.exists() else "")


def text_of(rows: dict[str, Run]) -> str:
    """Return the ledger's text, in the order of `CHECKS`."""
    lines = (f"| {' | '.join((n, *rows[n]))} |" for n in CHECKS if n in rows)
    return HEAD + "".join(f"{line}\n" for line in lines)


def note(check: str, result: str) -> None:
    """Write how a check has just ended into the ledger."""
    commit = git("rev-parse", "--short=10", "HEAD").strip()
    if git("status", "--porcelain", "--untracked-files=no"):
        commit += " and changes"
    day = f"{datetime.now(UTC):%Y-%m-%d}"
    rows = ledger() | {check: Run(result, day, commit, code_of(check))}
    LEDGER.write_text(text_of(rows), "utf-8")


def told(rows: dict[str, Run]) -> list[str]:
    """Return a line on checks older than their code, and one on those never noted."""
    old = [f"{n} ({run.date}, {run.result})" for n, run in rows.items()
           if run.code != code_of(n)]  # fmt: skip
    never = [name for name in CHECKS if name not in rows]
    failed = [n for n, run in rows.items() if not run.result.startswith("passed")]
    lines = {"older than their code": old, "never noted": never, "failed": failed}
    return [f"last runs {what}: {', '.join(n)}" for what, n in lines.items() if n]


def main(words: list[str]) -> int:
    """Note a check that has ended, or tell which are old; return the exit code."""
    parser = parser_of(__doc__)
    parser.add_argument("given", nargs="*", metavar="NAME RESULT")
    words = parser.parse_args(words).given
    if not words:
        print("\n".join(told(ledger())))
        return 0
    if len(words) != 2 or words[0] not in CHECKS:
        known = ", ".join(CHECKS)
        print(f"last_run: give NAME RESULT, NAME one of {known}", file=sys.stderr)
        return 2
    note(*words)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
