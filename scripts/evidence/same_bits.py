"""Whether two versions of this program give the same numbers, bit for bit.

    python scripts/evidence/same_bits.py make BEFORE     # with the one on PYTHONPATH
    python scripts/evidence/same_bits.py make AFTER      # with the other
    python scripts/evidence/same_bits.py compare BEFORE AFTER

`make` runs campaigns of every way a case is marched: the paper's Table 2, all four
schemes, a mistuned rotor, one from file, a rigid casing, a mode's sectors folded, a
reduced model; all of `mostly_damped`, by its inputs, which was the default of earlier
versions. `compare` holds every variable of their results against its
twin: values, also of integers of another width and of words; attributes and the group
`performance`, which depends on the day, are left out.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from pathlib import Path

import h5py
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
from common import JOBS, under_mpi

HPCWHIRL = "-m", "hpcwhirl"
SHORT = """
[scene]
duration = 0.05
nodal_diameter = {k}
friction = 0.1
[output]
traces = "full"
interval = 1e-4
[solver]
scheme = "{scheme}"
[sweep]
speed = [120, 300, 410, 420]
gap = [5e-5, 2e-4]
"""
RIGID = '[engine.casing]\nkind = "rigid"\n'
MISTUNED = "[engine.rotor]\nmistuning = [{}]\n".format(
    ", ".join(f"{0.02 * np.sin(3.7 * blade):.4f}" for blade in range(22))
)
CAMPAIGNS = {
    "modal": SHORT.format(k=1, scheme="modal"),
    "folded": SHORT.format(k=2, scheme="modal"),
    "exact": SHORT.format(k=1, scheme="exact"),
    "general": SHORT.format(k=1, scheme="general"),
    "paper": SHORT.format(k=3, scheme="paper").replace("0.05", "0.01"),
    "rigid": RIGID + SHORT.format(k=1, scheme="modal"),
    "mistuned": MISTUNED + SHORT.format(k=1, scheme="modal"),
    "draft": SHORT.format(k=1, scheme="modal").replace("0.05", "1.0"),
}
OPTIONS = {"draft": ["--preset", "draft"]}
ENGINE = [  # by values: versions that are compared may know no names
    word
    for value in (
        "casing.thickness=0.02663", "casing.width=0.2077", "casing.damping=0.1214",
        "casing.support_damping=0.4303", "casing.support_frequency=16.29",
        "rotor.damping=0.01103", "rotor.suspension_damping=0.1964", "pulse=0.7802e-3",
    )
    for word in ("--set", value)
]  # fmt: skip


def make(folder: Path) -> None:
    """Run all campaigns; the engine's file is written once, for both versions."""
    folder.mkdir(parents=True)
    engine = Path(tempfile.gettempdir()) / "same-bits-engine.h5"
    if not engine.exists():
        under_mpi(0, *HPCWHIRL, "export-model", engine, *ENGINE)
    imported = SHORT.format(k=1, scheme="general")
    for name, text in (CAMPAIGNS | {"imported": imported}).items():
        (folder / f"{name}.toml").write_text(text)
        more = OPTIONS.get(name, [])
        if name == "imported":
            more = ["--set", f"file={engine}"]
        out = ("--out", folder / name, "--report", "no")
        campaign = ("campaign", folder / f"{name}.toml", *out, *ENGINE, *more)
        under_mpi(0, *HPCWHIRL, *campaign)
        print(name, flush=True)
    out = ("--out", folder / "table2", "--report", "no")
    under_mpi(0, *HPCWHIRL, "campaign", JOBS / "table2.toml", *out, *ENGINE)


def variables(path: Path) -> dict[str, np.ndarray]:
    """Return every variable of a results file outside `performance`, by name."""
    found: dict[str, np.ndarray] = {}

    def take(name: str, item: object) -> None:
        if isinstance(item, h5py.Dataset) and not name.startswith("performance"):
            found[name] = item[()]

    with h5py.File(path) as file:
        file.visititems(take)
    return found


def same(one: np.ndarray, two: np.ndarray) -> bool:
    """Return whether values are equal, numbers bit for bit."""
    one, two = np.asarray(one), np.asarray(two)
    if one.shape != two.shape or one.dtype.kind != two.dtype.kind:
        return False
    if one.dtype.kind == "f":
        return one.tobytes() == two.tobytes()
    return bool(np.all(one == two))


def differing(one: dict[str, np.ndarray], two: dict[str, np.ndarray]) -> list[str]:
    """Return the names of variables that one of them has alone, or that differ."""
    both = sorted(one.keys() & two.keys())
    return sorted(one.keys() ^ two.keys()) + [
        name for name in both if not same(one[name], two[name])
    ]


def compare(before: Path, after: Path) -> int:
    """Print what differs between two folders; return how many variables do."""
    differ = 0
    for path in sorted(before.glob("*/results.h5")):
        name = path.parent.name
        old, new = variables(path), variables(after / name / path.name)
        odd = differing(old, new)
        differ += len(odd)
        told = f"not the same: {', '.join(odd)}" if odd else "the same bits"
        print(f"{name}: {len(old)} variables, {told}")
    return differ


def main() -> int:
    """Make campaigns or compare those that were made."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("what", choices=["make", "compare"])
    parser.add_argument("folders", nargs="+", type=Path)
    args = parser.parse_args()
    if args.what == "make":
        make(*args.folders)
        return 0
    return min(compare(*args.folders), 1)


if __name__ == "__main__":
    sys.exit(main())
