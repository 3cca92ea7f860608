"""What several scripts do: programs under mpirun, tables in Markdown, inputs."""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from copy import deepcopy
from pathlib import Path
from typing import Any

MPIRUN = shlex.split(os.environ.get("HPCWHIRL_MPIRUN", "mpirun"))


def program(ranks: int, *words: str | Path) -> list[str]:
    """Return the call of `python WORDS` on so many ranks; 0: without mpirun."""
    front = [*MPIRUN, "-n", str(ranks)] if ranks else []
    return [*front, sys.executable, *map(str, words)]


def under_mpi(ranks: int, *words: str | Path) -> str:
    """Return what `python WORDS` prints on so many ranks."""
    call = program(ranks, *words)
    return subprocess.run(call, check=True, capture_output=True, text=True).stdout


def campaign(file: Path, out: Path, *options: str, ranks: int = 2) -> float:
    """Return the seconds of a whole `hpcwhirl campaign` of a file into a directory."""
    start = time.perf_counter()
    under_mpi(ranks, "-m", "hpcwhirl", "campaign", file, "--out", out, *options)
    return time.perf_counter() - start


@contextmanager
def working_folder(given: Path | None, name: str) -> Iterator[Path]:
    """Make and give a directory: the one given, or one that is removed afterwards."""
    with tempfile.TemporaryDirectory(prefix=f"hpcwhirl-{name}-") as scratch:
        folder = given or Path(scratch)
        folder.mkdir(parents=True, exist_ok=True)
        yield folder


@contextmanager
def tree_of(commit: str) -> Iterator[Path]:
    """Give a directory with the files of a commit; it is removed afterwards."""
    with working_folder(None, "version") as folder:
        call, top = ["git", "archive", commit], Path(__file__).parents[1]
        packed = subprocess.run(call, cwd=top, check=True, capture_output=True)
        subprocess.run(["tar", "x"], cwd=folder, check=True, input=packed.stdout)
        yield folder


def with_version(tree: Path, caches: Path) -> dict[str, str]:
    """Return the environment of a version, with its compiled kernels in `caches`."""
    return os.environ | {"PYTHONPATH": str(tree), "NUMBA_CACHE_DIR": str(caches)}


def table(head: Sequence[str], rows: Iterable[Sequence[Any]]) -> list[str]:
    """Return the lines of a table in Markdown."""
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return lines + ["| " + " | ".join(map(str, row)) + " |" for row in rows]


def on_engine(name: str, document: Mapping[str, Any]) -> dict[str, Any]:
    """Return a campaign's tables with the inputs of a named engine added to them."""
    from hpcwhirl.scene import engine_inputs

    out = deepcopy(dict(document))
    for full, value in engine_inputs(name).items():
        *tables, last = ("scene." * ("." not in full) + full).split(".")
        place = out
        for table in tables:
            place = place.setdefault(table, {})
        place[last] = value
    return out
