"""How far a preset's regime map is to be trusted: 500 cases, against `reference`.

    python scripts/preset_map.py [DIR]

Two engines, the default and one whose ring lets motion grow, at 25 speeds and 10 gaps
each, 2.5 s. Runs the campaign with each preset on two ranks (resumable), prints seconds
of whole commands, the confusion of regimes, how many cells differ where the reference's
map has no boundary (the same words in all neighbouring cells), and the map: d(amped),
s(ustained), v (divergent) or u(ndecided), a capital where any preset gives another one.
"""

from __future__ import annotations

import os
import shlex
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import numpy as np
import tomli_w
from numpy.typing import NDArray

import hpcwhirl
from hpcwhirl.campaign.trials import trials
from hpcwhirl.scene import preset_names
from hpcwhirl.scene.files import resolve
from hpcwhirl.store.reader import words

MPIRUN = shlex.split(os.environ.get("HPCWHIRL_MPIRUN", "mpirun"))
SPEEDS = [float(s) for s in np.linspace(40.0, 520.0, 25)]
GAPS = [float(f"{g:.3g}") for g in np.geomspace(0.8e-4, 4e-4, 10)]
Names = NDArray[np.str_]
LETTERS = {"damped": "d", "sustained": "s", "divergent": "v", "undecided": "u"}


def inputs_of(engine: str) -> dict[str, object]:
    """Return the inputs of an engine by their dotted names."""
    if engine == "default":
        return {}
    return {resolve(name): value for name, value in trials()["rubbing"].items()}


def campaign(engine: str, folder: Path) -> Path:
    """Write the campaign of an engine and return its file."""
    cases = [
        {"speed": speed, "gap": gap, **inputs_of(engine)}
        for gap in GAPS
        for speed in SPEEDS
    ]
    path = folder / f"{engine}.toml"
    path.write_text(tomli_w.dumps({"output": {"traces": "summary"}, "cases": cases}))
    return path


def mapped(engine: str, preset: str, folder: Path) -> tuple[Names, float]:
    """Return regimes (gaps, speeds) and the seconds of the whole command."""
    out = folder / f"{engine}-{preset}"
    call = [*MPIRUN, "-n", "2", sys.executable, "-m", "hpcwhirl", "campaign"]
    start = time.perf_counter()
    subprocess.run(
        [*call, str(campaign(engine, folder)), "--out", str(out), "--preset", preset],
        check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    seconds = time.perf_counter() - start
    data = hpcwhirl.open_results(out)
    return words(data.regime).reshape(len(GAPS), len(SPEEDS)), seconds


def inside(regimes: Names) -> NDArray[np.bool_]:
    """Return where all neighbours, diagonal ones too, have a cell's own word."""
    padded = np.pad(regimes, 1, mode="edge")
    rows, columns = regimes.shape
    near = [
        padded[i : i + rows, j : j + columns] == regimes
        for i in range(3)
        for j in range(3)
    ]
    return np.asarray(np.logical_and.reduce(near))


def main() -> int:
    """Run everything and print."""
    with tempfile.TemporaryDirectory(prefix="hpcwhirl-presets-") as scratch:
        folder = Path(sys.argv[1] if len(sys.argv) > 1 else scratch)
        folder.mkdir(parents=True, exist_ok=True)
        names = preset_names()
        found: dict[str, dict[str, Names]] = {}
        spent = dict.fromkeys(names, 0.0)
        for engine in ("default", "rubbing"):
            found[engine] = {}
            for preset in names:
                found[engine][preset], seconds = mapped(engine, preset, folder)
                spent[preset] += seconds
    true = {engine: maps["reference"] for engine, maps in found.items()}
    for preset in names:
        pairs: Counter[tuple[str, str]] = Counter()
        far = 0
        for engine, regimes in true.items():
            got = found[engine][preset]
            pairs.update(zip(regimes.ravel(), got.ravel(), strict=True))
            far += int(((got != regimes) & inside(regimes)).sum())
        total = sum(pairs.values())
        same = sum(n for (a, b), n in pairs.items() if a == b)
        print(f"{preset}: {spent[preset]:.1f} s; {same} of {total} regimes those of "
              f"reference; {far} differ away from a boundary of the map")  # fmt: skip
        for (a, b), n in sorted(pairs.items(), key=lambda item: -item[1]):
            print(f"    {n:4d}  {a} -> {b}")
    for engine, regimes in true.items():
        print(f"{engine}: gaps {1e3 * GAPS[0]:g} (below) to {1e3 * GAPS[-1]:g} mm over "
              f"{SPEEDS[0]:g} to {SPEEDS[-1]:g} rad/s")  # fmt: skip
        apart = np.any([found[engine][p] != regimes for p in names], axis=0)
        for row, differs in zip(regimes[::-1], apart[::-1], strict=True):
            letters = [LETTERS[w].upper() if x else LETTERS[w]
                       for w, x in zip(row, differs, strict=True)]  # fmt: skip
            print("    " + "".join(letters))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
