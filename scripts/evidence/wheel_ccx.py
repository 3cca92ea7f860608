#!/usr/bin/env python3
"""A wheel of CalculiX, and the frequencies of its reduced rotor.

apt-get install calculix-ccx; python scripts/evidence/wheel_ccx.py DIR

Solids of 20 nodes, half the width from the plane of symmetry on; the hub is a rigid
body that does not rotate, the shaft's springs hold it. `SOLVER=MATRIXSTORAGE` writes
M and K as lines "row column value" of one triangle, counted from 1, in .mas and .sti,
and what a row is, "node.direction", in .dof. CalculiX computes frequencies of its own,
too, which it prints in seven digits.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from pathlib import Path

import numpy as np
import tomli_w
from scipy import sparse
from scipy.io import mmwrite

sys.path.insert(0, str(Path(__file__).parents[2] / "jobs"))
import wheel
from wheels import compare

GRID = (8, 2, 4, 16)
MODES = 40  # that CalculiX computes itself


def solids(grid: tuple[int, int, int, int]) -> tuple[np.ndarray, np.ndarray]:
    """Return nodes (n, 3) and elements (e, 20), from 0, of the extruded wheel."""
    points, corners = wheel.whole_mesh(grid)
    ends = np.stack([corners, np.roll(corners, -1, axis=0)])  # (2, 4, e)
    pairs = np.sort(ends.reshape(2, -1), axis=0)
    edges, place = np.unique(pairs, axis=1, return_inverse=True)
    middle = points.shape[1] + place.reshape(corners.shape)
    flat = np.hstack([points, points[:, edges].mean(axis=1)])
    half, count = wheel.WIDTH / 2, flat.shape[1]
    layers = [np.vstack([flat, np.full(count, z)]) for z in (0.0, half)]
    layers.append(np.vstack([points, np.full(points.shape[1], half / 2)]))
    top, upright = count, 2 * count
    every = [corners, corners + top, middle, middle + top, corners + upright]
    return np.hstack(layers).T, np.vstack(every).T


def deck(nodes: np.ndarray, elements: np.ndarray, solver: str) -> str:
    """Return an input deck; the hub's reference and rotation node come last."""
    hub = np.flatnonzero(np.hypot(*nodes.T[:2]) < wheel.HUB * (1 + 1e-6)) + 1
    plane = np.setdiff1d(np.flatnonzero(nodes[:, 2] == 0.0) + 1, hub)
    centre = len(nodes) + 1
    lines = ["*NODE, NSET=ALL"]  # a field has 20 characters
    lines += [
        f"{i}," + ",".join(f"{x:.12e}" for x in own)
        for i, own in enumerate(nodes.tolist(), 1)
    ]
    lines += [f"{centre},0,0,0", f"{centre + 1},0,0,0"]
    lines.append("*ELEMENT, TYPE=C3D20, ELSET=SOLID")
    for i, own in enumerate((elements + 1).tolist(), 1):
        lines.append(f"{i}," + ",".join(map(str, own[:10])) + ",")
        lines.append(",".join(map(str, own[10:])))
    lines += ["*ELEMENT, TYPE=SPRING1, ELSET=SX", f"{len(elements) + 1},{centre}"]
    lines += ["*ELEMENT, TYPE=SPRING1, ELSET=SY", f"{len(elements) + 2},{centre}"]
    for axis, letter in enumerate("XY", 1):
        lines += [f"*SPRING, ELSET=S{letter}", f"{axis}", f"{wheel.SPRINGS / 2!r}"]
    lines += ["*MATERIAL, NAME=STEEL", "*ELASTIC", f"{wheel.YOUNG!r},{wheel.POISSON}"]
    lines += ["*DENSITY", f"{wheel.DENSITY}"]
    lines += ["*SOLID SECTION, ELSET=SOLID, MATERIAL=STEEL"]
    lines += ["*NSET, NSET=HUB", *map(str, hub), "*NSET, NSET=PLANE", *map(str, plane)]
    lines.append(f"*RIGID BODY, NSET=HUB, REF NODE={centre}, ROT NODE={centre + 1}")
    lines += ["*BOUNDARY", f"{centre},3,3", f"{centre + 1},1,3", "PLANE,3,3"]
    lines += ["*STEP", f"*FREQUENCY{solver}", str(MODES), "*END STEP"]
    return "\n".join(lines) + "\n"


def solved(folder: Path, name: str, text: str) -> None:
    """Let CalculiX solve a deck."""
    (folder / f"{name}.inp").write_text(text, encoding="ascii")
    ended = subprocess.run(
        ["ccx", name], cwd=folder, capture_output=True, text=True, check=False
    )
    if ended.returncode or "Job finished" not in ended.stdout:
        raise SystemExit("\n".join(ended.stdout.splitlines()[-20:]) + ended.stderr)


def triangle(path: Path) -> sparse.csr_array:
    """Return the symmetric matrix of a file of lines "row column value", from 1."""
    row, column, value = np.fromfile(path, sep=" ").reshape(-1, 3).T
    places = row.astype(int) - 1, column.astype(int) - 1
    half = sparse.csr_array(sparse.coo_array((value, places)))
    return half + half.T - sparse.diags_array(half.diagonal())


def own_frequencies(path: Path) -> np.ndarray:
    """Return the frequencies, Hz, that CalculiX prints."""
    rows = [line.split() for line in path.read_text().splitlines()]
    return np.array([float(r[3]) for r in rows if len(r) == 5 and r[0].isdigit()])


def main() -> None:
    """Build, solve, import, compare."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    folder = parser.parse_args().folder
    folder.mkdir(parents=True, exist_ok=True)
    nodes, elements = solids(GRID)
    solved(folder, "stored", deck(nodes, elements, ", SOLVER=MATRIXSTORAGE"))
    solved(folder, "solved", deck(nodes, elements, ""))
    for kind, suffix in (("mass", ".mas"), ("stiffness", ".sti")):
        matrix = triangle(folder / f"stored{suffix}")
        mmwrite(folder / f"{kind}.mtx", matrix, symmetry="symmetric", precision=17)
    rows = (folder / "stored.dof").read_text().split()
    row = {name: i for i, name in enumerate(rows)}
    angle = wheel.STEP * np.arange(wheel.BLADES)
    tips = wheel.TIP * np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    near = [int(np.argmin(np.linalg.norm(nodes - tip, axis=1))) + 1 for tip in tips]
    table = {"mass": "mass.mtx", "stiffness": "stiffness.mtx", "blades": wheel.BLADES}
    pairs = {
        letter: [row[f"{n}.{a}"] for n in near] for a, letter in ((1, "x"), (2, "y"))
    }
    hub = {letter: row[f"{len(nodes) + 1}.{a}"] for a, letter in ((1, "x"), (2, "y"))}
    document = {"wheel": table, "tips": pairs, "centre": hub}
    (folder / "wheel.toml").write_text(tomli_w.dumps(document), encoding="utf-8")
    compare(folder / "wheel.toml", own_frequencies(folder / "solved.dat"))


if __name__ == "__main__":
    main()
