"""Everything that may happen to a campaign, again and again, with a seed.

    python scripts/evidence/attack.py           all families, in full
        --only kills,toml                       some families
        --only toml --try 17                    one try, its files kept
        --share 0.01                            a hundredth of each
        --jobs 2                                families at once
        --write                                 and scripts/evidence/attack.md

Prints attack | tries | survived | failed, and a line for each failure that does it
again. Every try has a random generator of its own, made of seed, family and number.
Each family works in a process of its own. Exits 1 where one failed.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import shutil
import subprocess
import sys
import tempfile
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from importlib import import_module
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))
from attacks import process
from attacks.family import Chance, Family, Verdict
from crashing.trace import compiled

PAGE = Path(__file__).with_suffix(".md")
MODULES = "deaths damage text engines measures together room ground"
FAMILIES: dict[str, Family] = {}
for _module in MODULES.split():
    FAMILIES |= import_module(f"attacks.{_module}").FAMILIES
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
INSIDE = "ATTACK_INSIDE"  # of the environment: a process that attacks by one family
SHOWN = 8  # failures of a family on the page; all are printed
Facts = dict[str, Any]


def attack(name: str, args: argparse.Namespace) -> Facts:
    """Make the tries of a family in this process; return what became of them."""
    family = FAMILIES[name]
    one = args.number is not None
    numbers = [args.number] if one else range(wanted(family, args))
    tries: Counter[str] = Counter()
    skipped: Counter[str] = Counter()
    failures = []
    with tempfile.TemporaryDirectory(prefix=f"attack-{name}-") as folder:
        place = Path(folder)
        shared = family.prepare(place / "shared")
        for number in numbers:
            own = place / f"try-{number}"
            verdict = attempt(name, shared, args.seed, number, own)
            if not one:
                shutil.rmtree(own, ignore_errors=True)
            if verdict.skipped:
                skipped[verdict.skipped] += 1
                continue
            tries[verdict.what.partition(":")[0]] += 1
            if verdict.wrong:
                again = f"--only {name} --try {number} --seed {args.seed}"
                by = f"python scripts/evidence/attack.py {again}"
                failures.append(f"{verdict.what}: {verdict.wrong} | {by}")
                print(failures[-1], file=sys.stderr, flush=True)
        if one:
            kept = tempfile.mkdtemp(prefix="attack-kept-")
            shutil.copytree(place, kept, symlinks=True, dirs_exist_ok=True,
                            ignore=_no_pipes)  # fmt: skip
            print(f"kept in {kept}", file=sys.stderr)
    failed = len(failures)
    return {
        "attack": name, "title": family.title, "seed": args.seed,
        "tries": tries.total(), "survived": tries.total() - failed, "failed": failed,
        "kinds": dict(sorted(tries.items())), "skipped": dict(skipped),
        "failures": failures,
    }  # fmt: skip


def wanted(family: Family, args: argparse.Namespace) -> int:
    """Return how many tries of a family are asked for."""
    return args.count or max(math.ceil(family.count * args.share), 1)


def attempt(name: str, shared: Any, seed: int, number: int, place: Path) -> Verdict:
    """Make one try in a new directory."""
    place.mkdir()
    chance = Chance(f"{seed}/{name}/{number}")
    chance.number = number
    try:
        return FAMILIES[name].attempt(shared, chance, place)
    except Exception as failed:  # noqa: BLE001 - a broken attack is a failure, too
        return Verdict("the attack itself", f"{type(failed).__name__}: {failed}")


def _no_pipes(folder: str, names: list[str]) -> list[str]:
    return [n for n in names if (Path(folder) / n).is_fifo()]


def apart(name: str, args: argparse.Namespace) -> Facts:
    """Attack by a family in a process of its own, with its environment and shim."""
    family, words = FAMILIES[name], ["--only", name, "--json"]
    options = {"seed": args.seed, "share": args.share, "limit": args.limit,
               "count": args.count, "try": args.number}  # fmt: skip
    words += [w for option, value in options.items() if value is not None
              for w in (f"--{option}", str(value))]  # fmt: skip
    with tempfile.TemporaryDirectory(prefix="attack-shim-") as folder:
        env = {**os.environ, **dict.fromkeys(THREADS, "1"), **family.env, INSIDE: "1"}
        if family.shim:
            env["LD_PRELOAD"] = str(compiled(Path(folder), family.shim))
        call = [sys.executable, __file__, *words]
        done = subprocess.run(call, env=env, stdout=subprocess.PIPE, check=False)
    if done.stdout:
        return dict(json.loads(done.stdout)[0])
    msg = f"attack: {name} itself ended with {done.returncode}"
    raise SystemExit(msg)


def table(told: list[Facts]) -> list[str]:
    """Return the table, a line for each family."""
    columns = ("title", "tries", "survived", "failed")
    rows = [[str(facts[name]) for name in columns] for facts in told]
    rows = [["attack", *columns[1:]], ["---", *["---:"] * 3], *rows]
    return [f"| {' | '.join(row)} |" for row in rows]


def page(told: list[Facts], share: float) -> str:
    """Return the page: the table, what was tried, what was not, what failed."""
    by = f"Written by `python scripts/evidence/attack.py --share {share:g} --write`; "
    by += "do not edit."
    out = ["# Attacks", "", by, "", *table(told), "", "Of these:", ""]
    for facts in told:
        kinds = ", ".join(f"{n} {kind}" for kind, n in facts["kinds"].items())
        name, whole = facts["attack"], FAMILIES[facts["attack"]].count
        short = f" ({whole} in a whole run)" if facts["tries"] < whole else ""
        out.append(f"- **{name}**, seed {facts['seed']}{short}: {kinds or 'none'}")
        out += [f"  - not tried {n} times: {w}" for w, n in facts["skipped"].items()]
        out += [f"  - failed: {line}" for line in facts["failures"][:SHOWN]]
    return "\n".join(out) + "\n"


def arguments() -> argparse.Namespace:
    """Return what was asked for."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="", help="families, by commas")
    parser.add_argument(
        "--try", dest="number", type=int, help="one try; its files stay"
    )
    parser.add_argument("--share", type=float, default=1.0, help="of the full counts")
    parser.add_argument("--count", type=int, help="tries of each family instead")
    parser.add_argument("--jobs", type=int, default=1, help="families at once")
    parser.add_argument("--limit", type=float, default=process.LIMIT,
                        help="s until a command counts as hung")  # fmt: skip
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--write", action="store_true", help=f"write {PAGE.name}")
    args = parser.parse_args()
    args.names = args.only.split(",") if args.only else list(FAMILIES)
    for name in args.names:
        if name not in FAMILIES:
            parser.error(f"unknown family {name}; known: {', '.join(FAMILIES)}")
    return args


def main() -> int:
    """Attack, and tell what became of it."""
    args = arguments()
    process.LIMIT = args.limit
    if INSIDE in os.environ:
        print(json.dumps([attack(args.names[0], args)]))
        return 0
    with ThreadPoolExecutor(args.jobs) as pool:
        told = list(pool.map(lambda name: apart(name, args), args.names))
    print(json.dumps(told, indent=1) if args.json else "\n".join(table(told)))
    if args.write:
        PAGE.write_text(page(told, args.share))
    return 1 if any(facts["failed"] for facts in told) else 0


if __name__ == "__main__":
    sys.exit(main())
