"""Whether a rotor that is exported and read back is the same rotor.

    python scripts/evidence/imported.py [--scenes 300] [--seed 17] [--keep FILE]

Draws speed and its sign, lobes, gap, friction, loading, ring, centre free or clamped
and damping of both bodies on engines of 9 and 22 blades; exports each, whole, as modes
alone or as matrices alone, and runs it as drawn and as read back, `--set traces=full`.
Matrices are solved again; modes keep their bits, and so must motions. Counts the
scenes that have the same words, scheme and folds, and takes the largest difference of
all tips over their largest motion so far, before chaos: as long as a twin, whose gap is
1e-12 larger, differs by less than 1e-10. Prints the ratio of processor times, too. With
FILE, one line of JSON a scene is appended, and scenes that are there are not run again.
Exit code 1 if a kernel differs, a number by more than 1e-9, a bit where modes are read,
or a word or fold where twins agree to the end.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
from common import kept, parser_of, working_folder

from hpcwhirl.campaign.simulate import result_of
from hpcwhirl.case.resolve import resolve
from hpcwhirl.cli.export_model import arrays_of
from hpcwhirl.dynamics.march import March
from hpcwhirl.scene import Scene, apply_settings, named_scene
from hpcwhirl.store.hdf5 import write_arrays

BASE = named_scene("mostly_damped")
ENGINES = ((9, 4, 27), (22, 10, 110))  # blades, elements, modes: a kernel for each
MODAL = (
    "omega", "damping_ratio", "modal_tip_radial", "modal_tip_tangential",
    "modal_centre",
)  # fmt: skip
MATRICES = ("mass", "stiffness", "damping", "tip_radial", "tip_tangential", "centre")
MORE = 1e-12  # of the gap: the twin
CHAOS = 1e-10  # difference of twins from which on numbers tell nothing
SAME = 1e-9
WAYS = {"whole": None, "modes": MODAL, "matrices": MATRICES}
NAMED = ("regime", "whirl", "folds")
Record = dict[str, Any]


def drawn(seed: int, index: int) -> dict[str, Any]:
    """Return the inputs of a scene, from (seed, index) alone."""
    random = np.random.default_rng([seed, index])

    def between(low: float, high: float) -> float:
        return float(np.exp(random.uniform(np.log(low), np.log(high))))

    blades, elements, modes = ENGINES[index % len(ENGINES)]
    return {
        "blades": blades,
        "engine.rotor.elements": elements,
        "modes": modes,
        "centre": str(random.choice(["free", "free", "clamped"])),
        "speed": float(random.uniform(20.0, 520.0) * random.choice([1, 1, 1, -1])),
        "nodal_diameter": int(random.choice([0, 1, 1, 1, 2, 3])),
        "gap": between(5e-5, 4e-4),
        "friction": float(random.choice([0.0, 0.1, 0.2, 0.3])),
        "pulse": float(random.uniform(4e-4, 1e-3)),
        "casing.thickness": between(12e-3, 40e-3),
        "casing.damping": between(0.01, 0.2),
        "rotor.damping": between(2e-3, 0.05),
        "suspension_damping": float(random.choice([-1.0, between(0.01, 0.4)])),
        "rotor.centre_stiffness": between(5e6, 1e8),
        "rotor.taper": float(random.uniform(0.6, 1.0)),
        "time_step": 4e-6,
        "traces": "full",
        "interval": 4e-4,
        "duration": 1.0,
    }


def read_back(scene: Scene, path: Path, way: str) -> Scene:
    """Export the rotor of a scene; return the scene with the rotor read back."""
    arrays, names = arrays_of(resolve(scene).model), WAYS[way]
    if names is not None:
        arrays = {f"rotor/{n}": arrays[f"rotor/{n}"] for n in names}
    write_arrays(path, arrays, {})
    return apply_settings(scene, {"file": str(path)})


def run(scene: Scene) -> tuple[Record, np.ndarray]:
    """Return a run's row, kernel and processor time, and its tips (n, N, 2)."""
    march = March(resolve(scene))
    kernel = march.scheme.kernel
    march.advance(1)  # compile
    before = time.process_time()
    history = march.run()
    spent = time.process_time() - before
    row = result_of(march.case, history).row
    told = {name: row[name] for name in NAMED}
    told |= {"kernel": f"{kernel.__module__}.{kernel.__qualname__}", "seconds": spent}
    return told | {"steps": row["steps"], "contacts": row["contacts"]}, history.tips


def apart(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return by sample (n,) how far tips differ over their largest motion so far."""
    count = min(len(one), len(other))
    miss = np.abs(one[:count] - other[:count]).max(axis=(1, 2))
    size = np.maximum.accumulate(np.abs(other[:count]).max(axis=(1, 2)))
    return np.asarray(miss / np.maximum(size, 1e-12))


def compared(seed: int, index: int, folder: Path, **more: Any) -> Record:
    """Return what a scene, its rotor read back and its twin have in common."""
    scene = apply_settings(BASE, drawn(seed, index) | more)
    path, way = folder / f"{index}.h5", list(WAYS)[index // 2 % len(WAYS)]
    again = read_back(scene, path, way)
    rows, tips = zip(
        *(run(s) for s in (scene, again)),
        run(apply_settings(scene, {"gap": scene.gap * (1 + MORE)})),
        strict=True,
    )
    path.unlink()
    chaotic = apart(tips[2], tips[0]) > CHAOS
    calm = int(np.argmax(chaotic)) if chaotic.any() else len(chaotic)
    return {
        "index": index,
        "way": way,
        "bits": bool(np.array_equal(tips[0], tips[1])),
        "blades": scene.engine.rotor.blades,
        "kernel": rows[0]["kernel"] == rows[1]["kernel"],
        "words": [[row[n] for n in NAMED] for row in rows],
        "same": all(rows[0][n] == rows[1][n] for n in NAMED),
        "twin": all(rows[0][n] == rows[2][n] for n in NAMED),
        "contacts": rows[0]["contacts"],
        "calm": calm / len(chaotic),
        "apart": float(apart(tips[1], tips[0])[:calm].max(initial=0.0)),
        "seconds": [row["seconds"] / row["steps"] for row in rows],
    }


def told(records: list[Record]) -> str:
    """Return the counts in words."""
    touched = [r for r in records if r["contacts"]]
    modes = [r for r in records if r["way"] != "matrices"]
    ratio = np.median([r["seconds"][1] / r["seconds"][0] for r in records])
    twin = np.median([r["seconds"][2] / r["seconds"][0] for r in records])
    other = [r["index"] for r in records if not r["same"]]
    same = [sum(r[name] for r in records) for name in ("kernel", "same", "twin")]
    bits = sum(r["bits"] for r in modes)
    miss = [r["apart"] for r in records]
    calm = np.mean([r["calm"] for r in records])
    return (
        f"{len(records)} scenes, {len(touched)} with contact, {same[0]} in the same "
        f"kernel; tips have the same bits in {bits} of {len(modes)} whose modes are "
        f"read; the same words and folds in {same[1]} (twins in {same[2]}; others: "
        f"{other}); largest difference before chaos {max(miss):.2g}, in the median "
        f"{np.median(miss):.2g}, over {calm:.0%} of the time in the mean; time a step "
        f"{ratio:.3f} times that of the built-in one (twins {twin:.3f})"
    )


def sound(record: Record) -> bool:
    """Return whether a scene is the same but for what chaos explains."""
    bits = record["bits"] or record["way"] == "matrices"
    explained = record["same"] or record["calm"] < 1.0
    return bool(record["kernel"] and bits and explained and record["apart"] <= SAME)


def main() -> int:
    """Run the scenes and print the counts."""
    parser = parser_of(__doc__)
    parser.add_argument("--scenes", type=int, default=300)
    parser.add_argument("--seed", type=int, default=17)
    parser.add_argument("--keep", type=Path)
    args = parser.parse_args()
    with working_folder(None, "imported") as folder:
        records = kept(
            args.keep or folder / "records",
            ({"index": index} for index in range(args.scenes)),
            lambda row: compared(args.seed, row["index"], folder),
        )
    print(told(records))
    return 0 if all(sound(record) for record in records) else 1


if __name__ == "__main__":
    sys.exit(main())
