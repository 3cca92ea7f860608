"""What a step of an uneven rotor costs, and whether its words stay the same.

    python scripts/evidence/general.py times [--blades 12 22 60 100] [--repeats 15]
    python scripts/evidence/general.py words [--scenes 40] [--seed 17]

`times`: processor time of a step of the tuned rotor by `modal` and by `general` of one
from a file, every other mode of which has 1e-3 more frequency (to reduce a mistuned
rotor of 100 blades as a whole takes long): the least of the repeats, with operations
and bytes of the latter. `words`:
mistuned engines at random, certified and ended in closed form (`modal`) and marched to
the end (`general`), by two thirds also read back from a file; exit code 1 if a word
differs.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

from hpcwhirl.campaign.simulate import result_of
from hpcwhirl.case.resolve import resolve
from hpcwhirl.cli.export_model import arrays_of
from hpcwhirl.dynamics.march import March
from hpcwhirl.measure import bench
from hpcwhirl.scene import Scene, apply_settings, named_scene
from hpcwhirl.store.results.single import write_arrays

MODAL = (
    "omega", "damping_ratio", "modal_tip_radial", "modal_tip_tangential",
    "modal_centre",
)  # fmt: skip
WORDS = ("regime", "whirl", "nodal_diameter")


def engine(blades: int, **settings: Any) -> Scene:
    """Return Table 2 with so many blades, five fixed-interface modes of each."""
    sized = {"blades": blades, "modes": 5 * blades, "plan": "everything"}
    return apply_settings(named_scene("mostly_damped"), sized | settings)


def uneven(scene: Scene, path: Path) -> Scene:
    """Return the scene with its rotor written as modes, every other one higher."""
    arrays = arrays_of(resolve(scene).model)
    arrays = {f"rotor/{name}": arrays[f"rotor/{name}"] for name in MODAL}
    omega = np.array(arrays["rotor/omega"])
    split = omega * (1.0 + 1e-3 * (np.arange(len(omega)) % 2))
    write_arrays(path, arrays | {"rotor/omega": split}, {})
    return apply_settings(scene, {"file": str(path)})


def least(scene: Scene, repeats: int, *, contact: bool) -> float:
    """Return the least processor time of a step, us, by the default scheme."""
    march = bench.settled(scene, "modal", contact=contact)
    saved = [array.copy() for array in march.state]
    spent = []
    for _ in range(repeats):
        bench.restore(march, saved)
        before = time.process_time()
        march.advance(bench.STEPS)
        spent.append(time.process_time() - before)
    return 1e6 * min(spent) / bench.STEPS


def costs(tuned: Scene, other: Scene, repeats: int) -> list[str]:
    """Return a row of the table of `times`, but for N."""
    found = [
        least(scene, repeats, contact=contact)
        for scene in (tuned, other)
        for contact in (False, True)
    ]
    rate = 1e-3 * bench.flight_operations(other, "modal") / found[2]
    modes, size = len(resolve(other).model.rotor.omega), bench.bytes_of(other, "modal")
    return [str(modes), *(f"{v:.3f}" for v in found), f"{rate:.1f}", str(size)]


def times(args: argparse.Namespace) -> int:
    """Print a row for each number of blades."""
    print("N coordinates  modal flight contact  general flight contact  GFLOP/s  bytes")
    for blades in args.blades:
        tuned = engine(blades)
        with tempfile.TemporaryDirectory() as folder:
            row = costs(tuned, uneven(tuned, Path(folder) / "rotor.h5"), args.repeats)
        print(blades, *row, flush=True)
    peak = bench.fma_peak(args.repeats)
    print(f"{peak:.1f} GFLOP/s is the measured peak of this core")
    return 0


def drawn(seed: int, index: int) -> dict[str, Any]:
    """Return the inputs of a scene, from (seed, index) alone."""
    random = np.random.default_rng([seed, index])
    blades = int(random.choice([7, 12, 22]))
    return {
        "blades": blades,
        "modes": 5 * blades,
        "mistuning": random.normal(scale=0.03, size=blades).tolist(),
        "speed": float(random.uniform(20.0, 520.0) * random.choice([1, 1, -1])),
        "nodal_diameter": int(random.choice([1, 1, 2, 3])),
        "gap": float(np.exp(random.uniform(np.log(5e-5), np.log(4e-4)))),
        "friction": float(random.choice([0.0, 0.1, 0.3])),
        "casing.thickness": float(random.uniform(12e-3, 40e-3)),
        "rotor.damping": float(np.exp(random.uniform(np.log(2e-3), np.log(5e-2)))),
        "time_step": 4e-6,
        "duration": 1.0,
        "revolutions": 0.0,
    }


def words_of(scene: Scene) -> tuple[tuple[Any, ...], float]:
    """Return the words of a run and the share of its steps that were marched."""
    march = March(resolve(scene))
    row = result_of(march.case, march.run()).row
    return tuple(row[name] for name in WORDS), march.marched / max(march.steps, 1)


def words(args: argparse.Namespace) -> int:
    """Print what differs, and the counts."""
    differ, shares, counts = 0, [], dict[str, int]()
    for index in range(args.scenes):
        scene = apply_settings(named_scene("mostly_damped"), drawn(args.seed, index))
        whole, _ = words_of(apply_settings(scene, {"scheme": "general"}))
        with tempfile.TemporaryDirectory() as folder:
            if index % 3:
                path = Path(folder) / "rotor.h5"
                write_arrays(path, arrays_of(resolve(scene).model), {})
                told = {"file": str(path), "mistuning": []}
                scene = apply_settings(scene, told)
            found, share = words_of(scene)
        shares.append(share)
        counts[whole[0]] = counts.get(whole[0], 0) + 1
        if found != whole:
            differ += 1
            print(index, found, whole, flush=True)
    print(
        f"{args.scenes} scenes, {differ} differ; {counts}; {np.mean(shares):.0%} of "
        "the steps marched where certified"
    )
    return int(differ > 0)


def main() -> int:
    """Run a part."""
    parser = argparse.ArgumentParser(description=__doc__)
    parts = parser.add_subparsers(required=True)
    one, other = parts.add_parser("times"), parts.add_parser("words")
    one.add_argument("--blades", type=int, nargs="+", default=[12, 22, 60, 100])
    one.add_argument("--repeats", type=int, default=15)
    one.set_defaults(run=times)
    other.add_argument("--scenes", type=int, default=40)
    other.add_argument("--seed", type=int, default=17)
    other.set_defaults(run=words)
    args = parser.parse_args()
    return int(args.run(args))


if __name__ == "__main__":
    sys.exit(main())
