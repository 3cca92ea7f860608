"""What several scripts do: programs under mpirun, campaigns, tables, shares, inputs."""

from __future__ import annotations

import argparse
import json
import os
import resource
import shlex
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from copy import deepcopy
from pathlib import Path
from typing import Any

MPIRUN = shlex.split(os.environ.get("HPCWHIRL_MPIRUN", "mpirun"))
TOP = Path(__file__).parents[1]
JOBS = TOP / "jobs"
Row = dict[str, Any]

# Programs


def program(ranks: int, *words: str | Path) -> list[str]:
    """Return the call of `python WORDS` on so many ranks; 0: without mpirun."""
    front = [*MPIRUN, "-n", str(ranks)] if ranks else []
    return [*front, sys.executable, *map(str, words)]


def under_mpi(ranks: int, *words: str | Path) -> str:
    """Return what `python WORDS` prints on so many ranks."""
    call = program(ranks, *words)
    return subprocess.run(call, check=True, capture_output=True, text=True).stdout


def processor_time(*whose: int) -> float:
    """Return processor seconds, user's and system's, of ended children by default."""
    used = map(resource.getrusage, whose or (resource.RUSAGE_CHILDREN,))
    return sum(one.ru_utime + one.ru_stime for one in used)


@contextmanager
def working_folder(given: Path | None, name: str) -> Iterator[Path]:
    """Make and give a directory: the one given, or one that is removed afterwards."""
    with tempfile.TemporaryDirectory(prefix=f"hpcwhirl-{name}-") as scratch:
        folder = given or Path(scratch)
        folder.mkdir(parents=True, exist_ok=True)
        yield folder


def parser_of(told: str | None, *, write: Path | None = None, folder: str = "") -> Any:
    """Return the parser of a script's command line, by its docstring.

    write : a page; there is an option then that writes it
    folder : how many directories may be given, as argparse has it
    """
    parser = argparse.ArgumentParser(
        description=told, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    if folder:
        parser.add_argument("folder", type=Path, nargs=folder)
    if write:
        parser.add_argument("--write", action="store_true", help=f"to {write.name}")
    return parser


# Campaigns


def campaign(file: Path, out: Path, *options: str, ranks: int = 2) -> float:
    """Return the seconds of a whole `hpcwhirl campaign` of a file into a directory."""
    start = time.perf_counter()
    under_mpi(ranks, "-m", "hpcwhirl", "campaign", file, "--out", out, *options)
    return time.perf_counter() - start


def results_of(document: Mapping[str, Any], out: Path, *more: str, ranks: int) -> Any:
    """Return the results of a campaign's tables, run or continued in a directory.

    more : options of the command
    """
    import tomli_w

    import hpcwhirl

    file = out.with_name(f"{out.name}.toml")
    file.write_text(tomli_w.dumps(document))
    try:
        campaign(file, out, "--report", "no", *more, ranks=ranks)
    except subprocess.CalledProcessError as ended:
        if ended.returncode != 1:  # 1: cases failed, which their rows tell
            raise SystemExit(f"{out}: {ended.stderr}") from None
    return hpcwhirl.open_results(out)


def completed(document: Any, out: Path, engine: Mapping[str, Any] | None = None) -> Any:
    """Run or continue a campaign in this process; return the directory, complete.

    document : its tables or its file
    engine : inputs that its tables do not give
    """
    from hpcwhirl.campaign.begin import prepare
    from hpcwhirl.campaign.plan.design import design_of
    from hpcwhirl.campaign.run import run_campaign
    from hpcwhirl.store.directory.campaign_directory import Directory

    design = design_of(document, engine or {})
    prepare(design, Directory(out))
    if not run_campaign(design, Directory(out)).complete:
        raise SystemExit(75)  # asked to stop: the same command continues
    return out


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


# Rows that are kept, and tables of them


def kept(
    path: Path,
    wanted: Iterable[Row],
    measure: Callable[[Row], Row],
    tell: Callable[[Row], object] = bool,
) -> list[Row]:
    """Return a row for each one wanted: that of a file of JSON lines, or measured.

    A row has what is wanted and what was measured; what is measured is added to the
    file at once. `tell` is called with each row before the next one is wanted.
    """
    path.touch()
    rows = [json.loads(line) for line in path.read_text().splitlines()]
    out = []
    for one in wanted:
        row = next((r for r in rows if r.items() >= one.items()), None)
        if row is None:
            row = one | measure(one)
            with path.open("a") as file:
                file.write(json.dumps(row) + "\n")
        tell(row)
        out.append(row)
    return out


def table(head: Sequence[str], rows: Iterable[Sequence[Any]]) -> list[str]:
    """Return the lines of a table in Markdown."""
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return lines + ["| " + " | ".join(map(str, row)) + " |" for row in rows]


def share(part: int, whole: int, form: str = "{0} of {1}: {2:.1%} ({3})") -> str:
    """Return a share with its 95 % interval (Wilson)."""
    from hpcwhirl.store.reading.shares import interval

    if not whole:
        return "none"
    value, low, high = interval(part, whole)
    return form.format(part, whole, value, f"{low:.1%} to {high:.1%}")


def with_section(page: str, section: str) -> str:
    """Return a page with a section in place of the one of its heading, or at the end.

    section : its text from `## ` on
    """
    head, *parts = page.split("\n## ")
    given = {part.partition("\n")[0]: part.rstrip() for part in parts}
    text = section.rstrip().removeprefix("## ")
    given[text.partition("\n")[0]] = text
    return "\n\n## ".join([head.rstrip(), *given.values()]) + "\n"


def tell(measured: str, page: Path | None) -> None:
    """Print what was measured, and write it into a page, if one is given.

    It takes the place of the page's section `Measured`, with the command that made it;
    what else stands on the page is written by hand.
    """
    print(measured)
    if page:
        script = Path(sys.argv[0]).resolve().relative_to(TOP)
        words = ("FOLDER" if Path(word).exists() else word for word in sys.argv[1:])
        call = shlex.join(["python", str(script), *words])
        section = f"## Measured\n\nMade by `{call}`.\n\n{measured}"
        page.write_text(with_section(page.read_text("utf-8"), section), "utf-8")


def in_turn(
    works: Mapping[str, Callable[[], float]], repeats: int
) -> dict[str, list[float]]:
    """Return the times of works, done one after the other so many times.

    A machine that gets slower meanwhile makes none look dearer than another.
    """
    found: dict[str, list[float]] = {name: [] for name in works}
    for _ in range(repeats):
        for name, work in works.items():
            found[name].append(work())
    return found
