#!/usr/bin/env python3
"""A wheel of CalculiX: the matrices and TOML files that `import-model` reads.

apt-get install calculix-ccx; python scripts/evidence/wheel_ccx.py DIR

Solids of 20 nodes, half the width from the plane of symmetry on; the hub is a rigid
body that does not rotate, the shaft's springs hold it. `SOLVER=MATRIXSTORAGE` writes
M and K as lines "row column value" of one triangle, counted from 1, in .mas and .sti,
and what a row is, "node.direction", in .dof. Frequencies that CalculiX computes
itself are printed in seven digits (`own_frequencies`).

turning.toml has the terms of rotation. After a *STATIC step with the centrifugal load,
a step with PERTURBATION writes K(Omega), stress stiffness and softening included, at
two speeds. CalculiX does not write Coriolis forces and the load; of solids whose
directions are those of the axes M is m for each direction, so that with J, which turns
displacements about z by 90 degrees, C = J M, and the load is M times the places of the
nodes, of a hub that is not yet a rigid body.

CalculiX 2.20 is wrong in a step *COMPLEX FREQUENCY, CORIOLIS of this wheel, since it
has a *RIGID BODY: at 300 rad/s, of the grid (4, 1, 2, 6), its lowest line is at 183.7
rad/s, with 40 modes or 100, where C = J M on the same 40 modes gives 194.2. With
`on_springs`, which makes the hub one of elastic nodes, each on springs, both give
194.127 rad/s (`turning_lines`, `own_lines`).
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w
from scipy import sparse
from scipy.io import mmwrite
from scipy.sparse.linalg import eigsh

sys.path.insert(0, str(Path(__file__).parents[2] / "jobs"))
import wheel

Mesh = tuple[np.ndarray, np.ndarray]
GRID = (8, 2, 4, 16)
MODES = 40  # that CalculiX computes itself
SHIFT = -1e3  # rad^2/s^2
SPEEDS = 200.0, 400.0  # rad/s, of turning.toml


def solids(points: np.ndarray, corners: np.ndarray) -> Mesh:
    """Return nodes (n, 3) and elements (e, 20), from 0, of an extruded mesh."""
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


def deck(
    mesh: Mesh, springs: float, solver: str, speed: float = 0.0, steps: str = ""
) -> str:
    """Return an input deck; the hub's reference and rotation node come last.

    speed : rad/s, of the centrifugal load before the last step
    steps : further cards of the static step
    """
    nodes, elements = mesh
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
        lines += [f"*SPRING, ELSET=S{letter}", f"{axis}", f"{springs!r}"]
    lines += ["*MATERIAL, NAME=STEEL", "*ELASTIC", f"{wheel.YOUNG!r},{wheel.POISSON}"]
    lines += ["*DENSITY", f"{wheel.DENSITY}"]
    lines += ["*SOLID SECTION, ELSET=SOLID, MATERIAL=STEEL"]
    lines += ["*NSET, NSET=HUB", *map(str, hub), "*NSET, NSET=PLANE", *map(str, plane)]
    lines.append(f"*RIGID BODY, NSET=HUB, REF NODE={centre}, ROT NODE={centre + 1}")
    lines += ["*BOUNDARY", f"{centre},3,3", f"{centre + 1},1,3", "PLANE,3,3"]
    if speed:
        load = f"SOLID,CENTRIF,{speed**2!r},0.,0.,0.,0.,0.,1."
        lines += ["*STEP", "*STATIC", "*DLOAD", load, *steps.split("\n"), "*END STEP"]
    lines += ["*STEP, PERTURBATION" if speed else "*STEP"]
    lines += [f"*FREQUENCY{solver}", str(MODES), "*END STEP"]
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


def stored(folder: Path, name: str, mesh: Mesh, springs: float) -> dict[str, int]:
    """Write M and K as .mtx; return {"node.direction": row, from 0}."""
    solved(folder, name, deck(mesh, springs, ", SOLVER=MATRIXSTORAGE"))
    for kind, suffix in (("mass", ".mas"), ("stiffness", ".sti")):
        path = folder / f"{name}_{kind}.mtx"
        matrix = triangle(folder / f"{name}{suffix}")
        mmwrite(path, matrix, symmetry="symmetric", precision=17)
    names = (folder / f"{name}.dof").read_text().split()
    return {dof: i for i, dof in enumerate(names)}


def loose(text: str) -> str:
    """Return a deck without the hub's rigid body, its centre and springs."""
    cards = text.split("\n*")
    gone = "RIGID BODY", "SPRING", "ELEMENT, TYPE=SPRING1", "BOUNDARY"
    return "\n*".join(card for card in cards if not card.startswith(gone))


def turning(folder: Path, mesh: Mesh, rows: dict[str, int]) -> dict[str, Any]:
    """Write the terms of rotation of the whole wheel; return what a TOML says of them.

    rows : {"node.direction": row} of `stored`
    """
    springs, only = wheel.SPRINGS / 2, ", SOLVER=MATRIXSTORAGE"
    files = {}
    for letter, speed in zip("ab", SPEEDS, strict=True):
        solved(folder, f"at_{letter}", deck(mesh, springs, only, speed))
        matrix = triangle(folder / f"at_{letter}.sti")
        files[f"stiffness_{letter}"] = f"turning_k{letter}.mtx"
        path = folder / files[f"stiffness_{letter}"]
        mmwrite(path, matrix, symmetry="symmetric", precision=17)
    coriolis = ahead_of(rows) @ triangle(folder / "wheel.mas")
    files["coriolis"] = "turning_c.mtx"
    skew = (coriolis - coriolis.T) / 2
    mmwrite(folder / files["coriolis"], skew, symmetry="skew-symmetric", precision=17)
    files["centrifugal_load"] = "turning_load.mtx"
    load = pulled(folder, mesh, rows)
    mmwrite(folder / files["centrifugal_load"], load[:, None], precision=17)
    return {**files, "speeds": list(SPEEDS)}


def on_springs(text: str, mesh: Mesh, springs: float) -> str:
    """Return a deck whose hub is no rigid body: its nodes share the springs."""
    nodes, elements = mesh
    hub = np.flatnonzero(np.hypot(*nodes.T[:2]) < wheel.HUB * (1 + 1e-6)) + 1
    cards, first = [], len(elements) + 1
    for axis, letter in enumerate("XY", 1):
        own = [f"{first + (axis - 1) * len(hub) + i},{n}" for i, n in enumerate(hub)]
        cards.append("\n".join([f"ELEMENT, TYPE=SPRING1, ELSET=S{letter}", *own]))
        cards.append(f"SPRING, ELSET=S{letter}\n{axis}\n{springs / len(hub)!r}")
    held = f"BOUNDARY\nPLANE,3,3\nHUB,3,3\n{len(nodes) + 1},1,3\n{len(nodes) + 2},1,3"
    out = []
    for card in loose(text).split("\n*"):
        out.append(card)
        if card.startswith("SOLID SECTION"):
            out += cards
        if card.startswith("NSET, NSET=PLANE"):
            out.append(held)
    return "\n*".join(out)


def turning_lines(folder: Path, text: str, speed: float, modes: int) -> np.ndarray:
    """Return the frequencies, rad/s, of CalculiX's own step with Coriolis forces.

    text : a deck with a static step at that speed
    """
    head = text[: text.index("*STEP\n*STATIC")]
    load = f"*DLOAD\nSOLID,CENTRIF,{speed**2!r},0.,0.,0.,0.,0.,1."
    steps = (
        f"*STEP\n*STATIC\n{load}\n*END STEP",
        f"*STEP, PERTURBATION\n*FREQUENCY, STORAGE=YES\n{modes}\n*END STEP",
        f"*STEP, PERTURBATION\n*COMPLEX FREQUENCY, CORIOLIS\n{modes}",
        f"{load}\n*END STEP\n",
    )
    solved(folder, "coriolis", head + "\n".join(steps))
    printed = (folder / "coriolis.dat").read_text().split("E I G E N V A L U E")[2]
    rows = [row.split() for row in printed.split("P A R T I C I P")[0].splitlines()]
    return np.array([float(r[1]) for r in rows if len(r) == 4 and r[0].isdigit()])


def own_lines(folder: Path, text: str, speed: float, modes: int) -> np.ndarray:
    """Return the same from C = J M and the modes of K(Omega) that CalculiX writes."""
    solved(
        folder, "turned", text.replace("*FREQUENCY", "*FREQUENCY,SOLVER=MATRIXSTORAGE")
    )
    mass, stiffness = (triangle(folder / f"turned.{kind}") for kind in ("mas", "sti"))
    names = (folder / "turned.dof").read_text().split()
    rows = {dof: i for i, dof in enumerate(names)}
    squared, shapes = eigsh(stiffness.tocsc(), modes, mass.tocsc(), sigma=SHIFT)
    turned = 2 * speed * shapes.T @ (ahead_of(rows) @ mass @ shapes)
    same, none = np.eye(modes), np.zeros((modes, modes))
    whole = np.block([[none, same], [-np.diag(squared), (turned.T - turned) / 2]])
    found = np.sort(np.linalg.eigvals(whole).imag)
    return np.asarray(found[found > 0.0])


def ahead_of(rows: dict[str, int]) -> sparse.csr_array:
    """Return J, which turns displacements about z by 90 degrees; rows: of `stored`."""
    pairs = [
        (row, rows[dof[:-1] + "2"])
        for dof, row in rows.items()
        if dof[-1] == "1" and dof[:-1] + "2" in rows
    ]
    x, y = np.array(pairs).T
    ahead = sparse.csr_array((np.ones(len(x)), (y, x)), (len(rows),) * 2)
    return ahead - ahead.T


def pulled(folder: Path, mesh: Mesh, rows: dict[str, int]) -> np.ndarray:
    """Return the centrifugal load per unit Omega^2, kg m, of each row."""
    solved(folder, "loose", loose(deck(mesh, 0.0, ", SOLVER=MATRIXSTORAGE")))
    names = (folder / "loose.dof").read_text().split()
    nodes, axes = np.array([dof.split(".") for dof in names], dtype=int).T
    places = np.where(axes < 3, mesh[0][nodes - 1, axes - 1], 0.0)
    out = np.zeros(len(rows))
    for dof, force in zip(names, triangle(folder / "loose.mas") @ places, strict=True):
        if dof in rows:  # the hub's cancel each other
            out[rows[dof]] = force
    return out


def document(folder: Path, name: str, mesh: Mesh, parts: int) -> dict[str, Any]:
    """Return what a TOML says of a wheel, or of one of its parts."""
    nodes = mesh[0]
    row = stored(folder, name, mesh, wheel.SPRINGS / 2 / parts)
    angle = wheel.STEP * np.arange(wheel.BLADES // parts)
    tips = wheel.TIP * np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    near = [at(nodes, tip) for tip in tips]
    table: dict[str, Any] = {k: f"{name}_{k}.mtx" for k in ("mass", "stiffness")}
    table["blades"] = wheel.BLADES
    if parts > 1:
        table |= cuts(nodes, row)
    pairs = {
        letter: [row[f"{n}.{a}"] for n in near] for a, letter in ((1, "x"), (2, "y"))
    }
    hub = {letter: row[f"{len(nodes) + 1}.{a}"] for a, letter in ((1, "x"), (2, "y"))}
    return {name: table, "tips": pairs, "centre": hub}


def turning_document(folder: Path, mesh: Mesh) -> dict[str, Any]:
    """Return what a TOML says of the whole wheel with its terms of rotation."""
    found = document(folder, "wheel", mesh, 1)
    names = (folder / "wheel.dof").read_text().split()
    terms = turning(folder, mesh, {dof: row for row, dof in enumerate(names)})
    return found | {"wheel": found["wheel"] | terms}


def at(nodes: np.ndarray, place: np.ndarray) -> int:
    """Return the number, from 1, of the node at a place."""
    return int(np.argmin(np.linalg.norm(nodes - place, axis=1))) + 1


def cuts(nodes: np.ndarray, row: dict[str, int]) -> dict[str, list[int]]:
    """Return rows of the unknowns on both cuts of the sector whose blade is along x."""
    x, y, _ = nodes.T
    inside = np.hypot(x, y) < wheel.RIM * 1.001
    left = np.flatnonzero(inside & (np.abs(np.arctan2(y, x) + wheel.STEP / 2) < 1e-6))
    out: dict[str, list[int]] = {}
    for direction, letter in ((1, "_x"), (2, "_y"), (3, "")):
        own = [n for n in left if f"{n + 1}.{direction}" in row]
        turned = wheel.turned(nodes[own, :2].T, wheel.STEP).T
        over = [
            at(nodes, np.r_[p, nodes[n, 2]]) for p, n in zip(turned, own, strict=True)
        ]
        out[f"left{letter}"] = [row[f"{n + 1}.{direction}"] for n in own]
        out[f"right{letter}"] = [row[f"{n}.{direction}"] for n in over]
    return out


def main() -> None:
    """Build, solve and write: the wheel, its sector, and the wheel that turns."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    folder = parser.parse_args().folder
    folder.mkdir(parents=True, exist_ok=True)
    whole = solids(*wheel.whole_mesh(GRID))
    sector = solids(*wheel.sector_mesh(GRID))
    for name, mesh, parts in (("wheel", whole, 1), ("sector", sector, wheel.BLADES)):
        text = tomli_w.dumps(document(folder, name, mesh, parts))
        (folder / f"{name}.toml").write_text(text, encoding="utf-8")
    (folder / "turning.toml").write_text(
        tomli_w.dumps(turning_document(folder, whole)), encoding="utf-8"
    )


if __name__ == "__main__":
    main()
