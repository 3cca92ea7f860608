"""How many motions live beside the damped one, and what a campaign of starts costs.

    python scripts/evidence/basins.py [DIR] [--engine NAME]... [--preset NAME]
    python scripts/evidence/basins.py --cost

Runs jobs/basins.toml, 51 speeds by 41 forces from none to twice that of Table 2, with
each engine (resumable in DIR), and prints at how many of the speeds that the present
force leaves damped another of these forces leads to another motion, with Wilson's 95 %
interval. With --cost: seconds of planning 10,000 drawn starts, pulses or energies on
modes, and of a whole campaign of them, beside those of 10,000 swept cases.
"""

from __future__ import annotations

import sys
import time
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w
from numpy.typing import NDArray

import hpcwhirl
from hpcwhirl.campaign.plan.design import design_of
from hpcwhirl.store.reading.shares import interval

sys.path.insert(0, str(Path(__file__).parents[1]))
from common import JOBS, campaign, on_engine, parser_of, results_of, working_folder

JOB = JOBS / "basins.toml"
NAMES = ("mostly_damped", "four_motions")
PRESENT = 75e3  # N, the pulse of Table 2
STARTS = 10_000
SHORT: dict[str, Any] = {
    "scene": {"duration": 2e-3, "speed": 410.0},
    "solver": {"time_step": 2e-6},
    "output": {"interval": 5e-5, "traces": "summary"},
}


def beside(
    speed: NDArray[np.float64], force: NDArray[np.float64], word: NDArray[np.str_]
) -> tuple[int, int, list[float]]:
    """Return speeds that are damped, how many of them have another word, and these.

    speed, force, word : (cases,)
    """
    now = np.isclose(force, PRESENT)
    damped = speed[now & (word == "damped")]
    open_to = ["damped", "undecided"]
    other = [v for v in damped.tolist() if (~np.isin(word[speed == v], open_to)).any()]
    return len(damped), len(other), other


def map_of(engine: str, preset: str, folder: Path, ranks: int) -> None:
    """Run the map of an engine and print what lives beside its damped motions."""
    document = on_engine(engine, tomllib.loads(JOB.read_text()))
    document["solver"]["preset"] = preset
    start = time.perf_counter()
    with results_of(document, folder / f"{engine}-{preset}", ranks=ranks) as data:
        seconds = time.perf_counter() - start
        word = hpcwhirl.words(data["regime"])
        damped, others, at = beside(data["speed"].values, data["force"].values, word)
    share, low, high = interval(others, damped)
    told = f"{others} of {damped} damped speeds, {share:.2f} [{low:.2f}, {high:.2f}]"
    print(f"{engine}, {preset}, {len(word)} cases in {seconds:.0f} s")
    print(f"another motion at {told}: {' '.join(f'{v:g}' for v in at)} rad/s")


def cost(folder: Path, ranks: int) -> None:
    """Print what drawn starts cost beside swept cases."""
    law = {"distribution": "uniform", "low": 0.0, "high": 150e3}
    sample = {"count": STARTS, "method": "halton", "force": law}
    force = {"start": 0.0, "stop": 150e3, "step": 150e3 / (STARTS - 1)}
    energy = {"start_energy": law | {"high": 20.0}, "start_draw": law | {"high": 1.0}}
    shell = {"count": STARTS, "method": "halton"} | energy
    designs = {
        "drawn": {"sample": sample},
        "swept": {"sweep": {"force": force}},
        "energies": {"sample": shell},
    }
    for table in designs.values():
        design_of(SHORT | table)  # what is imported on first use counts for neither
    for name, table in designs.items():
        start = time.perf_counter()
        cases = len(design_of(SHORT | table).settings)
        planned = time.perf_counter() - start
        file = folder / f"{name}.toml"
        file.write_text(tomli_w.dumps(SHORT | table))
        whole = campaign(file, folder / name, "--report", "no", ranks=ranks)
        each = f"campaign {whole:.1f} s, {1e3 * whole / cases:.2f} ms a case"
        print(f"{name}: {cases} cases planned in {planned:.2f} s, {each}")


def main() -> int:
    """Run what is asked for and print it."""
    parser = parser_of(__doc__, folder="?")
    parser.add_argument("--engine", action="append", choices=NAMES, dest="engines")
    parser.add_argument("--preset", default="standard")
    parser.add_argument("--ranks", type=int, default=2)
    parser.add_argument("--cost", action="store_true")
    args = parser.parse_args()
    with working_folder(args.folder, "basins") as folder:
        if args.cost:
            cost(folder, args.ranks)
            return 0
        for engine in args.engines or NAMES:
            map_of(engine, args.preset, folder, args.ranks)
    return 0


if __name__ == "__main__":
    sys.exit(main())
