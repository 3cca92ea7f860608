"""Each claim of the program asked on a population of drawn scenes.

    python scripts/evidence/claims.py [NAME...] [--count N] [--seed S] [--write]

A claim is a module of `populations`. Its docstring says in its first line what is
claimed, `COUNT` on how many scenes it is asked, `LEAST` which share of them must hold
(1.0: a law); `drawn(seed, index)` draws a scene, `judged(row)` measures it and returns
at least `held`: True, False, or None where the claim says nothing of this scene, and
`why` where it does not hold. What its `summed(rows)`, if it has one, tells of all
scenes follows the table. Rows go to --file (JSON lines, resumable; default a
temporary file). Exits 1 where fewer hold than must.
"""

from __future__ import annotations

import sys
import time
from importlib import import_module
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))
from common import Row, kept, parser_of, share, table, tell, working_folder

PAGE = Path(__file__).with_suffix(".md")
POPULATIONS = Path(__file__).with_name("populations")
NAMES = sorted(path.stem for path in POPULATIONS.glob("[a-z]*.py"))
HEAD = "claim", "says", "asked", "holds"


def population(name: str) -> Any:
    """Return the module of a claim."""
    return import_module(f"evidence.populations.{name}")


def claim_of(module: Any) -> str:
    """Return what a module claims: the first line of its docstring."""
    return str(module.__doc__).partition("\n")[0]


def judge(name: str, count: int, seed: int, file: Path) -> list[Row]:
    """Return the rows of a claim: those of the file, others drawn and measured.

    count : scenes; 0: as many as the claim's module says
    """
    module = population(name)
    wanted = [
        {"claim": name, "seed": seed, "index": index}
        for index in range(count or module.COUNT)
    ]

    def measure(row: Row) -> Row:
        scene = module.drawn(row["seed"], row["index"])
        return {"scene": scene} | module.judged(scene)

    def told(row: Row) -> None:
        if row["held"] is False:
            print(f"{name} {row['index']}: {row.get('why', 'does not hold')}")

    return kept(file, wanted, measure, told)


def holds(name: str, rows: list[Row]) -> bool:
    """Return whether enough of a claim's scenes hold; False if none was asked."""
    asked = [row["held"] for row in rows if row["held"] is not None]
    return bool(asked) and sum(asked) >= population(name).LEAST * len(asked)


def row_of(name: str, rows: list[Row]) -> list[str]:
    """Return the line of a claim in the table: what it says, scenes, share."""
    asked = [row["held"] for row in rows if row["held"] is not None]
    of = f"{len(asked)} of {len(rows)}"
    return [name, claim_of(population(name)), of, share(sum(asked), len(asked))]


def measured(rows: dict[str, list[Row]], seconds: float) -> str:
    """Return the text of the page: the table, and the scenes that do not hold."""
    lines = table(HEAD, [row_of(name, some) for name, some in rows.items()])
    failed = [
        f"- {name} {row['index']}: {row.get('why', '')}"
        for name, some in rows.items()
        for row in some
        if row["held"] is False
    ]
    for name, some in rows.items():
        if hasattr(population(name), "summed"):
            lines += ["", f"{name}: {population(name).summed(some)}"]
    if failed:
        lines += ["", "Scenes that do not hold:", "", *failed]
    return "\n".join([*lines, "", f"{seconds:.0f} s of the processor."])


def main() -> None:
    """Ask the claims named on the command line, all by default."""
    parser = parser_of(__doc__, write=PAGE)
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(NAMES))
    parser.add_argument("--count", type=int, default=0)
    parser.add_argument("--seed", type=int, default=45)
    parser.add_argument("--file", type=Path)
    given = parser.parse_args()
    unknown = sorted(set(given.names) - set(NAMES))
    if unknown:
        parser.error(f"unknown claim {unknown[0]}; known: {', '.join(NAMES)}")
    began = time.process_time()
    with working_folder(None, "claims") as scratch:
        file = given.file or scratch / "rows.jsonl"
        names = given.names or NAMES
        rows = {name: judge(name, given.count, given.seed, file) for name in names}
    text = measured(rows, time.process_time() - began)
    tell(text, PAGE if given.write else None)
    raise SystemExit(not all(holds(name, some) for name, some in rows.items()))


if __name__ == "__main__":
    main()
