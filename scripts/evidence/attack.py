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
import shutil
import sys
import tempfile
from collections import Counter
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))
import apart
import common
from attacks import damage, deaths, engines, ground, outside, text, together
from attacks.family import Chance, Family, Verdict

PAGE = Path(__file__).with_suffix(".md")
FAMILIES: dict[str, Family] = {}
for _module in (deaths, damage, text, engines, together, ground, outside):
    FAMILIES |= _module.FAMILIES
SHOWN = 8  # failures of a family on the page; all are printed
Facts = dict[str, Any]


def attack(name: str, args: argparse.Namespace) -> Facts:
    """Make the tries of a family in this process; return what became of them."""
    family, one = FAMILIES[name], args.number is not None
    count = args.count or max(math.ceil(family.count * args.share), 1)
    tries: Counter[str] = Counter()
    skipped: Counter[str] = Counter()
    failures = []
    with tempfile.TemporaryDirectory(prefix=f"attack-{name}-") as folder:
        place = Path(folder)
        shared = family.prepare(place / "shared")
        for number in [args.number] if one else range(count):
            own = place / f"try-{number}"
            verdict = attempt(name, shared, args.seed, number, own)
            if one:
                kept = tempfile.mkdtemp(prefix="attack-kept-")
                shutil.copytree(place, kept, symlinks=True, dirs_exist_ok=True,
                                ignore=_no_pipes)  # fmt: skip
                print(f"kept in {kept}", file=sys.stderr)
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
    failed = len(failures)
    return {
        "attack": name, "title": family.title, "seed": args.seed,
        "tries": tries.total(), "survived": tries.total() - failed, "failed": failed,
        "kinds": dict(sorted(tries.items())), "skipped": dict(skipped),
        "failures": failures,
    }  # fmt: skip


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


def table(told: list[Facts]) -> list[str]:
    """Return the table, a line for each family."""
    columns = ("title", "tries", "survived", "failed")
    rows = [[facts[name] for name in columns] for facts in told]
    return common.table(("attack", *columns[1:]), rows)


def in_detail(told: list[Facts]) -> str:
    """Return the table, what was tried, what was not, what failed."""
    out = [*table(told), "", "Of these:", ""]
    for facts in told:
        kinds = ", ".join(f"{n} {kind}" for kind, n in facts["kinds"].items())
        name, whole = facts["attack"], FAMILIES[facts["attack"]].count
        short = f" ({whole} in a whole run)" if facts["tries"] < whole else ""
        out.append(f"- **{name}**, seed {facts['seed']}{short}: {kinds or 'none'}")
        out += [f"  - not tried {n} times: {w}" for w, n in facts["skipped"].items()]
        out += [f"  - failed: {line}" for line in facts["failures"][:SHOWN]]
    return "\n".join(out)


def main() -> int:
    """Attack, and tell what became of it."""
    parser = common.parser_of(__doc__, write=PAGE)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--try", dest="number", type=int, help="one, its files stay")
    parser.add_argument("--count", type=int, help="tries of each family instead")
    args = apart.asked(parser, "family", list(FAMILIES))
    if args.inside:
        print(json.dumps(attack(args.inside, args)))
        return 0
    told = list(apart.each(args, lambda name: FAMILIES[name].env))
    if args.json:
        print(json.dumps(told, indent=1))
    else:
        common.tell(in_detail(told), PAGE if args.write else None)
    return 1 if any(facts["failed"] for facts in told) else 0


if __name__ == "__main__":
    sys.exit(main())
