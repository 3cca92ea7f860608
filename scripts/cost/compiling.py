"""Where a first start's seconds go, function by function, in two versions.

    python scripts/cost/compiling.py COMMIT [--unequal] [--scheme NAME] [--most N]

Processor time that numba takes for each function without those that it calls, with an
empty cache; a kernel, which Python calls, includes LLVM's work on all its parts.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))
from common import table, tree_of, with_version

TOP = Path(__file__).parents[2]
RUN = """
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
settings = {"scheme": sys.argv[1], "duration": 2e-3, "traces": "full"}
if sys.argv[2] == "unequal":
    settings["mistuning"] = tuple(0.01 * (blade % 5 - 2) for blade in range(22))
March(resolve(apply_settings(named_scene("table2"), settings))).warm()
print(json.dumps(heard.taken))
"""


def taken(tree: Path, scheme: str, kind: str) -> dict[str, float]:
    """Return {function: seconds} of a version's first start."""
    with tempfile.TemporaryDirectory() as caches:
        call = [sys.executable, "-c", RUN, scheme, kind]
        done = subprocess.run(
            call, env=with_version(tree, Path(caches)), cwd=tree, check=True,
            capture_output=True, text=True,
        )  # fmt: skip
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def main() -> None:
    """Compile and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("commit")
    parser.add_argument("--unequal", action="store_true")
    parser.add_argument("--scheme", default="modal")
    parser.add_argument("--most", type=int, default=15)
    args = parser.parse_args()
    kind = "unequal" if args.unequal else "equal"
    with tree_of(args.commit) as old:
        then, now = (taken(tree, args.scheme, kind) for tree in (old, TOP))
    more = {n: now.get(n, 0.0) - then.get(n, 0.0) for n in {*then, *now}}
    names = sorted(more, key=lambda name: -abs(more[name]))[: args.most]
    rows = [
        [name, f"{then.get(name, 0.0):.2f}", f"{now.get(name, 0.0):.2f}"]
        for name in names
    ]
    whole = ["all", *(f"{sum(one.values()):.2f}" for one in (then, now))]
    counts = ["functions", len(then), len(now)]
    head = f"{args.scheme}, {kind}", f"{args.commit}, s", "now, s"
    print("\n".join(table(head, [whole, counts, *rows])))


if __name__ == "__main__":
    main()
