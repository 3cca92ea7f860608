#!/usr/bin/env python3
"""What a long list of cases costs before the first of them is integrated.

python scripts/cost/case_list.py [--cases 1000000]
"""

from __future__ import annotations

import argparse
import random
import resource
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

from hpcwhirl.campaign.plan.design import load_design
from hpcwhirl.cli import main as hpcwhirl


def written(folder: Path, cases: int) -> Path:
    """Write a CSV file of cases at random, and the campaign's file that reads it."""
    drawn = random.Random(1)
    with (folder / "cases.csv").open("w") as file:
        file.write("speed [rpm],gap [mm],friction\n")
        for _ in range(cases):
            speed, gap, mu = (
                drawn.uniform(*r) for r in ((3e3, 5e3), (0.1, 0.2), (0, 1))
            )
            file.write(f"{speed:.3f},{gap:.5f},{mu:.4f}\n")
    path = folder / "c.toml"
    path.write_text('cases = "cases.csv"\n[scene]\nduration = 0.5\n')
    return path


def told(what: str, began: float) -> None:
    """Print the processor time since `began`, and the largest memory so far."""
    most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(
        f"{what}: {time.process_time() - began:.1f} s of the processor, {most:.0f} MB"
    )


def main() -> int:
    """Read the list, then plan its campaign."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--cases", type=int, default=1_000_000)
    args = parser.parse_args()
    with TemporaryDirectory() as name:
        path, began = written(Path(name), args.cases), time.process_time()
        load_design(path, {})
        told("read", began)
        code = hpcwhirl(["campaign", str(path), "--out", f"{name}/out", "--dry-run"])
        told("and planned (--dry-run)", began)
    return code


if __name__ == "__main__":
    sys.exit(main())
