"""Many short cases: what they take beside the kernel, and the same bits after kills.

    python scripts/evidence/million.py --cases 10000 --ranks 2 --kills 10
    options: --traces orbit (else summary), --steps 20 (else 5,000 of 1 us, some 2 ms)

Computes a campaign of so many short cases, then the same once more in another
directory, every rank killed (SIGKILL) again and again on the way and the command given
anew. Prints wall time, the processor's, the kernel's own, what ranks took beside it
from their first case to their last, bytes and files of the journal, the most memory
that a rank had, and whether all variables but those of `performance` are the same bits.
Where others use the machine, `--lowest --cases 1000 --steps 20` tells the overhead: it
runs in one process, and prints the lowest time of twenty cases.
"""

from __future__ import annotations

import random
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import h5py
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
from attacks.process import PROGRAM, kill_tree, start
from common import parser_of, processor_time
from evidence.same_bits import differing, variables

from hpcwhirl.campaign.evaluate import Evaluator
from hpcwhirl.cli import main as hpcwhirl

CAMPAIGN = """
scene = {{duration = {duration}}}
solver = {{time_step = 1e-6}}
output = {{traces = "{traces}"}}
[sweep]
speed = {{start = 100, stop = 500, num = {speeds}}}
friction = {{start = 0.0, stop = 0.3, num = 100}}
"""
LOOK_EVERY = 0.05  # s
START = 3.0  # s, until ranks compute


def ran(
    file: Path, out: Path, ranks: int, limit: float = float("inf")
) -> tuple[float, float, float]:
    """Run the campaign, for `limit` s at most; return what it took.

    That is s of the clock, s of the processor on all ranks, and MB of the largest rank.
    """
    begun, spent = time.monotonic(), processor_time()
    words = ("campaign", file, "--out", out, "--report", "no")
    child = start([*PROGRAM, *words], file.parent, ranks=ranks)
    while child.alive:
        time.sleep(LOOK_EVERY)
        if time.monotonic() - begun > limit:
            kill_tree(child.pid)
    memory = child.wait().peak / 1e6
    return time.monotonic() - begun, processor_time() - spent, memory


def killed(file: Path, out: Path, ranks: int, kills: int, seconds: float) -> int:
    """Run the campaign to its end, killed on the way; return how often it was."""
    chance, count = random.Random(1), 0
    while not (out / "results.h5").exists():
        limit = START + seconds * chance.uniform(0.5, 1.5) / (kills + 1)
        ran(file, out, ranks, limit if count < kills else float("inf"))
        count += 1
    return count - 1


def told(out: Path, cases: int) -> None:
    """Print what a campaign took."""
    with h5py.File(out / "results.h5") as file:
        own = file["performance/seconds"][:].sum()
        beside = file["performance/worker_span"][:].sum() - own
    logs = [path.stat().st_size for path in (out / "journal").iterdir()]
    files = sum(path.is_file() for path in out.rglob("*"))
    print(f"kernel {own:.1f} s in all, {1e3 * own / cases:.2f} ms a case, "
          f"beside it {1e3 * beside / cases:.2f}; "
          f"journal {sum(logs) / cases:.0f} bytes a case; {files} files")  # fmt: skip


def lowest(file: Path, out: Path) -> None:
    """Print what a case takes in this process: the lowest of twenty, and the median.

    Other work on the machine lengthens most cases, the lowest of twenty hardly.
    """
    call, took, beside = Evaluator.__call__, [], []

    def timed(self: Evaluator, *given: Any) -> Any:
        start = time.process_time()
        end = call(self, *given)
        took.append(1e3 * (time.process_time() - start))
        beside[:] = self.beside
        return end

    Evaluator.__call__ = timed
    hpcwhirl(["campaign", str(file), "--out", str(out), "--report", "no"])
    for name, values in (("processor", took), ("beside the kernel", beside)):
        low, middle = np.percentile(values, [5, 50])
        scale = 1.0 if values is took else 1e3
        print(f"{name}: {scale * low:.2f} ms a case, median {scale * middle:.2f}")


def main() -> int:
    """Run both campaigns and hold their results against each other."""
    parser = parser_of(__doc__)
    parser.add_argument("--cases", type=int, default=10_000, help="200, 300, ...")
    parser.add_argument("--ranks", type=int, default=2)
    parser.add_argument("--kills", type=int, default=10)
    parser.add_argument("--steps", type=int, default=5_000, help="of a case")
    parser.add_argument("--lowest", action="store_true", help="in this process alone")
    parser.add_argument("--traces", choices=("summary", "orbit"), default="summary")
    args = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="million-") as place:
        file, whole, cut = (Path(place) / name for name in ("m.toml", "whole", "cut"))
        shape = {"speeds": args.cases // 100, "duration": 1e-6 * args.steps}
        file.write_text(CAMPAIGN.format(**shape, traces=args.traces))
        if args.lowest:
            lowest(file, whole)
            return 0
        seconds, processor, memory = ran(file, whole, args.ranks)
        print(f"{args.cases} cases, {args.ranks} ranks: {seconds:.1f} s, of the "
              f"processor {processor:.1f} s, {1e3 * processor / args.cases:.2f} ms a "
              f"case; {memory:.0f} MB", flush=True)  # fmt: skip
        told(whole, args.cases)
        count = killed(file, cut, args.ranks, args.kills, seconds)
        odd = differing(*(variables(out / "results.h5") for out in (whole, cut)))
        bits = f"differ: {' '.join(odd)}" if odd else "the same bits"
        print(f"killed {count} times: {bits}")
    return bool(odd)


if __name__ == "__main__":
    sys.exit(main())
