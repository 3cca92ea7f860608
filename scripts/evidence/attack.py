"""Everything that may happen to a campaign, again and again, with a seed.

    python scripts/evidence/attack.py           all families, in full
        --minutes 10                            as much of each as fits
        --only kills,toml                       some families
        --only toml --try 17                    one try, its files kept
        --share 0.01                            a hundredth of each
        --write                                 and scripts/evidence/attack.md
        --write --read one.json two.json        of runs before, by --json

Prints attack | tries | survived | failed, and a line for each failure that does it
again. Every try has a random generator of its own, made of seed, family and number.
Exits 1 where one failed.
"""

from __future__ import annotations

import argparse
import json
import math
import multiprocessing
import os
import shutil
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from attacks import apart
from attacks.family import Chance, Family, Verdict
from attacks.table import FAMILIES

PAGE = Path(__file__).with_suffix(".md")
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
Facts = dict[str, Any]
SHOWN = 8  # failures of a family on the page; all are printed


@dataclass
class Tally:
    """What became of a family's tries."""

    family: Family
    seed: int
    tries: int = 0
    failed: int = 0
    failures: list[str] = field(default_factory=list)
    skipped: Counter[str] = field(default_factory=Counter)
    kinds: Counter[str] = field(default_factory=Counter)

    def add(self, number: int, verdict: Verdict) -> None:
        """Count one verdict."""
        if verdict.skipped:
            self.skipped[verdict.skipped] += 1
            return
        self.tries += verdict.weight
        self.kinds[verdict.what.partition(":")[0]] += verdict.weight
        if verdict.wrong:
            self.failed += 1
            again = f"--only {self.family.name} --try {number} --seed {self.seed}"
            told = f"{verdict.what}: {verdict.wrong}"
            self.failures.append(f"{told} | python scripts/evidence/attack.py {again}")

    def facts(self) -> dict[str, Any]:
        """Return what there is to tell."""
        return {
            "attack": self.family.name,
            "seed": self.seed,
            "title": self.family.title,
            "demanded": self.family.count,
            "tries": self.tries,
            "survived": self.tries - self.failed,
            "failed": self.failed,
            "kinds": dict(sorted(self.kinds.items())),
            "skipped": dict(self.skipped),
            "failures": self.failures,
        }


def _work(
    family: Family, seed: int, numbers: Sequence[int], send: Any, enough: Any
) -> None:
    """Make tries of a family in this process, and send what became of each."""
    os.environ.update(family.env)
    sys.path.insert(0, str(apart.ROOT))
    with tempfile.TemporaryDirectory(prefix=f"attack-{family.name}-") as folder:
        place = Path(folder)
        try:
            shared = family.prepare(place / "shared")
        except Exception as failed:  # noqa: BLE001 - told as a failure of the family
            _tell(send, -1, Verdict("preparing", f"{type(failed).__name__}: {failed}"))
            return
        for number in numbers:
            if enough.is_set():
                return
            own = place / f"try-{number}"
            own.mkdir()
            _tell(send, number, _attempt(family, shared, seed, number, own))
            if len(numbers) == 1:
                kept = Path(tempfile.mkdtemp(prefix="attack-kept-"))
                shutil.copytree(place, kept, symlinks=True, dirs_exist_ok=True,
                                ignore=_no_pipes)  # fmt: skip
                print(f"kept in {kept}", file=sys.stderr)
            _remove(own)


def _tell(send: Any, number: int, verdict: Verdict) -> None:
    with suppress(BrokenPipeError):  # there are enough, and nobody listens
        send.send((number, verdict))


def _attempt(
    family: Family, shared: Any, seed: int, number: int, place: Path
) -> Verdict:
    chance = Chance(f"{seed}/{family.name}/{number}")
    chance.number = number
    try:
        return family.attempt(shared, chance, place)
    except Exception as failed:  # noqa: BLE001 - a broken attack is a failure, too
        where = f"{type(failed).__name__}: {failed}"
        return Verdict("the attack itself", where)


def _no_pipes(folder: str, names: list[str]) -> list[str]:
    return [n for n in names if (Path(folder) / n).is_fifo()]


def _remove(folder: Path) -> None:
    shutil.rmtree(folder, ignore_errors=True)


def _verdicts(
    family: Family, seed: int, numbers: Iterator[int], jobs: int
) -> Iterator[tuple[int, Verdict]]:
    """Yield (number, verdict), from as many processes as there are jobs."""
    context, whole = multiprocessing.get_context("fork"), list(numbers)
    ends, workers, enough = [], [], context.Event()
    for job in range(min(jobs, len(whole))):
        mine, its = context.Pipe(duplex=False)
        call = (family, seed, whole[job::jobs], its, enough)
        worker = context.Process(target=_work, args=call)
        worker.start()
        its.close()
        ends.append(mine)
        workers.append(worker)
    try:
        yield from _received(ends)
    finally:
        enough.set()
        for end in ends:
            end.close()
        for worker in workers:
            worker.join()


def _received(ends: list[Any]) -> Iterator[tuple[int, Verdict]]:
    from multiprocessing.connection import wait

    while ends:
        for end in wait(ends):
            try:
                yield end.recv()
            except EOFError:
                ends.remove(end)


def attack(family: Family, args: argparse.Namespace, seconds: float) -> Tally:
    """Make the tries of a family until there are enough, or its time is over."""
    tally, end = Tally(family, args.seed), time.monotonic() + seconds
    wanted = args.count or max(math.ceil(family.count * args.share), 1)
    numbers = [args.number] if args.number is not None else range(wanted)
    verdicts = _verdicts(family, args.seed, iter(numbers), args.jobs)
    for number, verdict in verdicts:
        tally.add(number, verdict)
        if verdict.wrong:
            print(tally.failures[-1], file=args.told, flush=True)
        if tally.tries >= wanted or time.monotonic() > end:
            break
    verdicts.close()
    return tally


def _line(cells: Sequence[object]) -> str:
    return "| " + " | ".join(map(str, cells)) + " |"


def _table(found: Sequence[Facts]) -> list[str]:
    lines = [_line(["attack", "tries", "survived", "failed"]), "|---|---:|---:|---:|"]
    names = ("title", "tries", "survived", "failed")
    return lines + [_line([facts[name] for name in names]) for facts in found]


def _page(found: Sequence[Facts]) -> str:
    """Return the page: the table, what was tried, what was not, what failed."""
    by = "Written by `python scripts/evidence/attack.py --write`; do not edit."
    out = ["# Attacks", "", by, "", *_table(found), "", "Of these:", ""]
    for facts in found:
        kinds = ", ".join(f"{n} {kind}" for kind, n in facts["kinds"].items())
        short = facts["tries"] < facts["demanded"]
        lacks = f" (of {facts['demanded']} demanded)" if short else ""
        seed = f"seed {facts['seed']}{lacks}"
        out.append(f"- **{facts['attack']}**, {seed}: {kinds or 'none'}")
        out += [f"  - not tried {n} times: {w}" for w, n in facts["skipped"].items()]
        out += [f"  - failed: {line}" for line in facts["failures"][:SHOWN]]
        if facts.get("replayed"):  # put there by hand, after a mend
            tries = ", ".join(map(str, facts["replayed"]))
            out.append(f"  - failed, then mended and survived by --try: {tries}")
    return "\n".join(out) + "\n"


def _asked() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--minutes", type=float, default=math.inf)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="", help="families, by commas")
    parser.add_argument("--try", dest="number", type=int, help="one try, by number")
    parser.add_argument("--share", type=float, default=1.0, help="of the full counts")
    parser.add_argument("--count", type=int, help="tries of each family instead")
    parser.add_argument("--jobs", type=int, default=1, help="processes at once")
    parser.add_argument("--limit", type=float, default=apart.LIMIT,
                        help="s until a command counts as hung")  # fmt: skip
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--write", action="store_true", help=f"write {PAGE.name}")
    parser.add_argument("--read", nargs="*", type=Path, default=[], metavar="FILE",
                        help="tell what runs said by --json")  # fmt: skip
    args = parser.parse_args()
    names = args.only.split(",") if args.only else list(FAMILIES)
    wrong = [name for name in names if name not in FAMILIES]
    if wrong:
        parser.error(f"unknown family {wrong[0]}; known: {', '.join(FAMILIES)}")
    args.families = [FAMILIES[name] for name in names]
    return args


def _attacks(args: argparse.Namespace) -> list[Facts]:
    """Attack by one family after the other; return what there is to tell."""
    found: list[Facts] = []
    end = time.monotonic() + 60 * args.minutes
    for place, family in enumerate(args.families):
        left = (end - time.monotonic()) / (len(args.families) - place)
        found.append(attack(family, args, left).facts())
    return found


def _read(paths: Sequence[Path]) -> list[Facts]:
    """Return what earlier runs said, families in their order, seeds together."""
    found: dict[str, Facts] = {}
    for path in paths:
        for facts in json.loads(path.read_text()):
            name = facts["attack"]
            found[name] = _together(found[name], facts) if name in found else facts
    return [found[name] for name in FAMILIES if name in found]


def _together(one: Facts, other: Facts) -> Facts:
    """Return what two runs of a family, of different seeds, say together."""
    if str(other["seed"]) in str(one["seed"]).split(" and "):
        msg = f"{one['attack']}: seed {other['seed']} twice; its tries are the same"
        raise SystemExit(msg)
    out = one | {"seed": f"{one['seed']} and {other['seed']}"}
    for name in ("tries", "survived", "failed", "failures"):
        out[name] = one[name] + other[name]
    for name in ("kinds", "skipped"):
        out[name] = dict(sorted((Counter(one[name]) + Counter(other[name])).items()))
    out["replayed"] = one.get("replayed", []) + other.get("replayed", [])
    return out


def main() -> int:
    """Attack, and tell what became of it."""
    args = _asked()
    apart.LIMIT = args.limit
    for name in THREADS:
        os.environ[name] = "1"
    args.told = sys.stderr if args.json else sys.stdout
    found = _read(args.read) if args.read else _attacks(args)
    print(json.dumps(found, indent=1) if args.json else "\n".join(_table(found)))
    if args.write:
        PAGE.write_text(_page(found))
    return 1 if any(facts["failed"] for facts in found) else 0


if __name__ == "__main__":
    sys.exit(main())
