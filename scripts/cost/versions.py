"""Processor time of this version over that of an earlier one, both in turn.

    python scripts/cost/versions.py COMMIT [--only NAME ...] [--repeats N]
    python scripts/cost/versions.py COMMIT --functions equal

population: a case of `jobs/mistuned_population.toml`, an engine of its own; sweep: the
51 speeds of the default engine, draft; lobed: rigid lobed casing, rotor from file.
Each is the time (user and system) of a campaign less that of a short one, which has the
same start, map and page; least of the repeats. Kernels are compiled before.
first: a first start, with empty caches, of `modal` and of unequal sectors; with
--functions, where it goes: processor time that numba takes for each function without
those that it calls; a kernel, which Python calls, includes LLVM's work on its parts.
"""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import tomli_w

sys.path.insert(0, str(Path(__file__).parents[1]))
from common import (
    JOBS,
    TOP,
    Row,
    parser_of,
    processor_time,
    table,
    tree_of,
    with_version,
    working_folder,
)

POPULATION = tomllib.loads((JOBS / "mistuned_population.toml").read_text("utf-8"))
SUMMARY = {"output": {"traces": "summary"}}
SWEEP = SUMMARY | {
    "solver": {"preset": "draft"},
    "sweep": {"speed": {"start": 20, "stop": 520, "num": 51}},
}
LOBED = {"kind": "rigid", "amplitude": 0.9e-4, "growth": 0.5}
UNEQUAL = [0.001 * (blade % 5 - 2) for blade in range(22)]
NAMES = "population", "sweep", "lobed", "first, equal", "first, unequal"
MOST = 15  # functions told
# numba's processor time for each function, without those that it calls
TYPED = """
import json, sys, time
from numba.core import event

class Heard(event.Listener):
    def __init__(self):
        self.open, self.taken = [], {}
    def on_start(self, _):
        self.open.append([time.process_time(), 0.0])
    def on_end(self, what):
        begun, inside = self.open.pop()
        whole, made = time.process_time() - begun, what.data["dispatcher"].py_func
        name = made.__module__.rpartition(".")[2] + "." + made.__name__
        self.taken[name] = self.taken.get(name, 0.0) + whole - inside
        if self.open:
            self.open[-1][1] += whole

heard = Heard()
event.register("numba:compile", heard)
from hpcwhirl.case.resolve import resolve
from hpcwhirl.dynamics.march import March
from hpcwhirl.scene import apply_settings, named_scene
settings = {"duration": 2e-3, "traces": "full"}
if sys.argv[1] == "unequal":
    settings["mistuning"] = tuple(0.01 * (blade % 5 - 2) for blade in range(22))
March(resolve(apply_settings(named_scene("table2"), settings))).warm()
print(json.dumps(heard.taken))
"""


def documents(name: str, engine: Path) -> tuple[list[Row], int]:
    """Return a campaign, the short one that is subtracted, and the cases between.

    engine : a rotor's file, for `lobed`
    """
    if name == "population":
        draw = POPULATION["sample"]
        return [POPULATION | {"sample": draw | {"count": n}} for n in (65, 5)], 60
    if name == "sweep":
        return [SWEEP | {"scene": {"duration": d}} for d in (10.0, 0.01)], 1
    if name == "lobed":
        scene = {"nodal_diameter": 2, "gap": 1e-4}
        own = {"engine": {"file": str(engine), "casing": LOBED},
               "sweep": {"speed": [120, 300, 410, 420]}}  # fmt: skip
        return [SUMMARY | own | {"scene": scene | {"duration": d}}
                for d in (1.5, 0.01)], 1  # fmt: skip
    blades = UNEQUAL if name.endswith("unequal") else []
    first = {"scene": {"duration": 1e-3}, "sweep": {"speed": [300]}}
    return [first | {"engine": {"rotor": {"mistuning": blades}}}], 1


def processor(tree: Path, words: list[str | Path], caches: Path) -> float:
    """Return the processor's seconds of a command of a version."""
    call = [sys.executable, "-m", "hpcwhirl", *map(str, words)]
    before = processor_time()
    subprocess.run(
        call, cwd=tree, env=with_version(tree, caches), check=True, capture_output=True
    )
    return processor_time() - before


def once(name: str, tree: Path, folder: Path) -> float:
    """Return the seconds of a campaign, less those of the short one."""
    tables, cases = documents(name, folder / "engine.h5")
    caches = folder / f"caches-{tree.name}"
    if name.startswith("first"):
        caches = folder / "empty"
        shutil.rmtree(caches, ignore_errors=True)
        caches.mkdir()
    seconds = 0.0
    for document, sign in zip(tables, (1, -1), strict=False):
        file, out = folder / "c.toml", folder / "out"
        file.write_text(tomli_w.dumps(document))
        words: list[str | Path] = ["campaign", file, "--out", out, "--report", "no"]
        seconds += sign * processor(tree, words, caches)
        shutil.rmtree(out)
    return seconds / cases


def compared(names: list[str], before: str, repeats: int) -> list[list[str]]:
    """Return (name, seconds before, seconds now, their ratio) of each."""
    rows = []
    with tree_of(before) as old, working_folder(None, "versions") as folder:
        for tree in (old, TOP):
            (folder / f"caches-{tree.name}").mkdir()
        words: list[str | Path] = ["export-model", folder / "engine.h5"]
        processor(TOP, words, folder / f"caches-{TOP.name}")
        for name in names:
            if not name.startswith("first"):
                for tree in (old, TOP):  # compiles
                    once(name, tree, folder)
            found = [[once(name, tree, folder) for tree in (old, TOP)]
                     for _ in range(repeats)]  # fmt: skip
            least = [min(column) for column in zip(*found, strict=True)]
            each = sorted(now / then for then, now in found)
            ratios = f"{least[1] / least[0]:.2f}", f"{each[0]:.2f} ... {each[-1]:.2f}"
            rows.append([name, *(f"{s:.3f}" for s in least), *ratios])
            print(rows[-1], flush=True)
    return rows


def typed(tree: Path, kind: str) -> dict[str, float]:
    """Return {function: seconds} of a version's first start."""
    with working_folder(None, "typed") as caches:
        done = subprocess.run(
            [sys.executable, "-c", TYPED, kind], env=with_version(tree, caches),
            cwd=tree, check=True, capture_output=True, text=True,
        )  # fmt: skip
    return dict(json.loads(done.stdout))


def functions(before: str, kind: str) -> list[list[str]]:
    """Return (name, seconds before, seconds now) of functions that changed most."""
    with tree_of(before) as old:
        pair = [typed(tree, kind) for tree in (old, TOP)]
    each = {name: [one.get(name, 0.0) for one in pair] for name in {*pair[0], *pair[1]}}
    order = sorted(each, key=lambda name: -abs(each[name][1] - each[name][0]))
    rows = {f"all {kind}": [sum(one.values()) for one in pair]}
    rows |= {"functions": [len(one) for one in pair]} | {
        n: each[n] for n in order[:MOST]
    }
    return [[name, *(f"{value:.2f}" for value in pair)] for name, pair in rows.items()]


def main() -> None:
    """Measure and print."""
    parser = parser_of(__doc__)
    parser.add_argument("commit")
    parser.add_argument("--functions", choices=("equal", "unequal"))
    parser.add_argument("--only", nargs="+", choices=NAMES, default=[*NAMES])
    parser.add_argument("--repeats", type=int, default=3)
    args = parser.parse_args()
    head = "", f"{args.commit}, s", "now, s", "now / before", "of single pairs"
    if args.functions:
        head, rows = head[:3], functions(args.commit, args.functions)
    else:
        rows = compared(args.only, args.commit, args.repeats)
    print("\n".join(table(head, rows)))


if __name__ == "__main__":
    main()
