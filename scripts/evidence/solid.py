#!/usr/bin/env python3
"""Memory and time that `import-model` takes for a massive solid sector.

    pip install scikit-fem cvxopt pymetis
    python scripts/evidence/solid.py FOLDER [ALONG AROUND LAYERS BLADES] [--write]

A disk of bricks of 27 nodes (19 x 19 x 10 of a sector, 22 sectors unless told) whose
rim is the tips'; the hub follows the centre. Its M and K are written into the folder
and imported by a process of its own, whose peak is told; --write puts that into
solid.md.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import time
from importlib.util import find_spec
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import skfem
import tomli_w
from scipy import sparse

HUB, TIP, WIDTH = 0.1, 0.5, 0.1347  # m
YOUNG, POISSON, DENSITY = 210e9, 0.3, 7800.0
SPRINGS = 3.4e7  # N/m, of the shaft
POINTS = 5  # order of what is integrated exactly: 3 x 3 x 3 points
PAGE = Path(__file__).with_suffix(".md")
TEXT = """# A massive solid sector

Made by `python scripts/evidence/solid.py FOLDER {grid} --write`: bricks of
27 nodes, {grid} along the radius, around, along the shaft and sectors, the
hub tied to the centre. `hpcwhirl import-model` in a process of its own, all nodal
diameters: its largest resident set, seconds of the processor and of the clock.

| unknowns | nodal diameters | modes | with | GB at most | s of CPU | s |
|---|---|---|---|---|---|---|
{row}

Lowest frequencies: {frequencies} Hz.
"""


def basis_of(grid: list[int], step: float) -> skfem.Basis:
    """Return the space of one sector, radii times angles times layers."""
    ends = ((HUB, TIP), (-step / 2, step / 2), (0.0, WIDTH))
    axes = [np.linspace(*e, n + 1) for e, n in zip(ends, grid, strict=True)]
    mesh = skfem.MeshHex.init_tensor(*axes)
    return skfem.Basis(mesh, skfem.ElementVector(skfem.ElementHex2()))


def bent(basis: skfem.Basis, places: np.ndarray) -> skfem.Basis:
    """Return the same space on the sector that polar coordinates (3, n) tell."""
    radius, angle, along = places
    points = np.stack([radius * np.cos(angle), radius * np.sin(angle), along])
    mesh = skfem.MeshHex(points, basis.mesh.t)
    return skfem.Basis(mesh, skfem.ElementVector(skfem.ElementHex2()))


def matrices(basis: skfem.Basis) -> list[sparse.csr_array]:
    """Return M and K: 81 x 81 forms would take scikit-fem a quarter of an hour."""
    own = skfem.Basis(basis.mesh, skfem.ElementHex2(), intorder=POINTS)
    value = np.stack([phi[0].value for phi in own.basis])  # (27, elements, points)
    slope = np.stack([phi[0].grad for phi in own.basis])
    nodes, elements, weight = len(value), own.mesh.t.shape[1], own.dx
    near = np.einsum("iep,jep,ep->eij", value, value, weight, optimize=True)
    a = slope.reshape(3 * nodes, elements, -1).transpose(1, 0, 2)
    both = ((a * weight[:, None]) @ a.transpose(0, 2, 1)).reshape(
        elements, nodes, 3, nodes, 3
    )
    same = np.eye(3)[None, None, :, None, :]
    shear = YOUNG / (2 * (1 + POISSON))
    volume = YOUNG * POISSON / ((1 + POISSON) * (1 - 2 * POISSON))
    elastic = np.trace(both, axis1=2, axis2=4)[:, :, None, :, None] * same
    elastic = shear * (elastic + both.transpose(0, 1, 4, 3, 2)) + volume * both
    heavy = DENSITY * near[:, :, None, :, None] * same
    dofs, side = basis.element_dofs.T, 3 * nodes
    rows, columns = np.repeat(dofs, side, axis=1).ravel(), np.tile(dofs, side).ravel()
    shape = (basis.N, basis.N)
    return [
        sparse.csr_array((part.ravel(), (rows, columns)), shape=shape)
        for part in (heavy, elastic)
    ]


def sector(folder: Path, grid: list[int], blades: int) -> None:
    """Write M, K and sector.toml."""
    step = 2 * np.pi / blades
    straight = basis_of(grid, step)
    basis = bent(straight, straight.mesh.p)
    count = basis.N
    place = np.rint(straight.doflocs / 1e-9).astype(np.int64)
    axis = np.empty(count, dtype=int)
    for dofs in (basis.nodal_dofs, basis.edge_dofs, basis.facet_dofs):
        for own in range(3):
            axis[dofs[own]] = own
    for own in range(3):
        axis[basis.interior_dofs[own]] = own
    hub = place[0] == place[0].min()
    free = np.flatnonzero(~hub)
    columns = np.full(count, -1)
    columns[free] = np.arange(len(free))
    moved = hub & (axis < 2)
    columns[moved] = len(free) + axis[moved]
    rows = np.flatnonzero(columns >= 0)
    tie = sparse.csr_array(
        (np.ones(len(rows)), (rows, columns[rows])), shape=(count, len(free) + 2)
    )
    springs = np.r_[np.zeros(len(free)), [SPRINGS / blades] * 2]
    mass, stiffness = (tie.T @ a @ tie for a in matrices(basis))
    stiffness = stiffness + sparse.diags_array(springs)
    for name, matrix in (("mass", mass), ("stiffness", stiffness)):
        half = sparse.csr_matrix((matrix + matrix.T) / 2)
        sparse.save_npz(folder / f"{name}.npz", half, compressed=False)
    document = {
        "sector": {
            "mass": "mass.npz",
            "stiffness": "stiffness.npz",
            "blades": blades,
            "modes": 5 * blades,
            **cuts(place[:, free], axis[free]),
        },
        "tips": tip(place[:, free], axis[free]),
        "centre": {"x": len(free), "y": len(free) + 1},
    }
    (folder / "sector.toml").write_text(tomli_w.dumps(document), encoding="utf-8")


def cuts(place: np.ndarray, axis: np.ndarray) -> dict[str, list[int]]:
    """Return the unknowns of both cuts by the names of the file."""
    found = {}
    names = (("_x", 0), ("_y", 1), ("", 2))
    for side, angle in (("left", place[1].min()), ("right", place[1].max())):
        for name, own in names:
            dofs = np.flatnonzero((place[1] == angle) & (axis == own))
            order = np.lexsort(place[:, dofs])
            found[side + name] = dofs[order].tolist()
    return found


def tip(place: np.ndarray, axis: np.ndarray) -> dict[str, int]:
    """Return the two unknowns of the node at the rim that is next to the middle."""
    centre = np.array([place[0].max(), 0, place[2].max() // 2])
    away = np.abs(place - centre[:, None]).sum(axis=0)
    return {
        letter: int(np.argmin(np.where(axis == own, away, np.iinfo(np.int64).max)))
        for own, letter in enumerate("xy")
    }


def imported(where: Path) -> dict[str, str]:
    """Return what `import-model` tells and takes, for the page."""
    begun = time.perf_counter()
    names = [str(where / name) for name in ("sector.toml", "rotor.h5")]
    command = ["hpcwhirl", "import-model", names[0], "--out", names[1], "--json"]
    with (where / "told.json").open("w+") as file:
        _, status, used = os.wait4(subprocess.Popen(command, stdout=file).pid, 0)
        if status:
            raise SystemExit(os.waitstatus_to_exitcode(status))
        file.seek(0)
        told = json.load(file)
    found = [name for name in ("cvxopt", "pymetis") if find_spec(name)]
    cells = [
        f"{told['unknowns']:,}",
        told["blades"] // 2 + 1,
        told["modes"],
        ", ".join(found) or "SciPy alone",
        f"{used.ru_maxrss * 1024 / 1e9:.2f}",
        f"{used.ru_utime + used.ru_stime:.0f}",
        f"{time.perf_counter() - begun:.0f}",
    ]
    lowest = (f"{hertz:.6g}" for hertz in told["frequencies_hz"][:12])
    row = f"| {' | '.join(map(str, cells))} |"
    return {"row": row, "frequencies": ", ".join(lowest)}


def main() -> None:
    """Write, import and tell."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("grid", type=int, nargs="*", default=[19, 19, 10, 22])
    parser.add_argument("--write", action="store_true", help=f"write {PAGE.name}")
    args = parser.parse_args()
    if len(args.grid) != 4 or min(args.grid) < 3:
        parser.error("ALONG AROUND LAYERS BLADES must be four numbers from 3")
    args.folder.mkdir(parents=True, exist_ok=True)
    # In a process of its own: Linux counts a parent's peak as that of its children.
    made = get_context("spawn").Process(
        target=sector, args=(args.folder, args.grid[:3], args.grid[3])
    )
    made.start()
    made.join()
    if made.exitcode:
        raise SystemExit(made.exitcode)
    grid = " ".join(map(str, args.grid))
    text = TEXT.format(grid=grid, **imported(args.folder))
    print(text)
    if args.write:
        PAGE.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
