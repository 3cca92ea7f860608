#!/usr/bin/env python3
"""A wheel of finite elements, made by scikit-fem, to be brought to hpcwhirl.

    pip install scikit-fem
    python jobs/wheel.py wheel    # matrices, wheel.toml, sector.toml, whirl.toml
    hpcwhirl import-model wheel/sector.toml --out wheel/rotor.h5
    mpirun -n 2 hpcwhirl campaign wheel/whirl.toml --out wheel/whirl

22 tapered blades on a disk with a rigid hub that does not rotate, in plane stress with
biquadratic quadrilaterals: 34,000 unknowns, or 1,600 of one sector. `sector.toml` and
`wheel.toml` give the same rotor; show your own code's matrices in the same way. Terms
of rotation are there, too: `rotation = "full"` in `[engine]` includes them.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w
from scipy import sparse
from scipy.io import mmwrite
from scipy.sparse.linalg import spsolve

BLADES = 22
HUB, RIM, TIP = 0.05, 0.11, 0.5  # m, radii
TAPER = 0.78  # of a blade's thickness, tip to root
WIDTH = 0.1347  # m, along the shaft
YOUNG, POISSON, DENSITY = 210e9, 0.3, 7800.0
SPRINGS = 3.4e7  # N/m, of the shaft
STEP = 2 * np.pi / BLADES
GRID = (12, 4, 6, 30)  # elements around a sector and a blade, out along disk and blade
Mesh = tuple[np.ndarray, np.ndarray]
CAMPAIGN = {
    "scene": {"duration": 1.0, "friction": 0.1, "nodal_diameter": 1},
    "engine": {"name": "scikit-fem wheel", "file": "rotor.h5"},
    "solver": {"preset": "draft"},
    "sweep": {
        "speed": {"start": 100, "stop": 500, "step": 40},
        "gap": [0.64e-4, 1.28e-4, 1.92e-4, 2.56e-4, 3.84e-4],
    },
}


def cells(columns: int, rows: int) -> np.ndarray:
    """Return the corners (4, columns rows) of a grid's cells, its points by rows."""
    first = (np.arange(rows)[:, None] * (columns + 1) + np.arange(columns)).ravel()
    return np.stack([first, first + columns + 1, first + columns + 2, first + 1])


def sector_mesh(grid: tuple[int, int, int, int]) -> Mesh:
    """Return points (2, p) and cells (4, c) of the sector whose blade lies along x."""
    around, blade, out, along = grid
    angle = STEP * np.linspace(-0.5, 0.5, around + 1)
    radius = np.linspace(HUB, RIM, out + 1)[:, None]
    disk = np.stack([radius * np.cos(angle), radius * np.sin(angle)])
    middle = slice((around - blade) // 2, (around + blade) // 2 + 1)
    root = disk[:, -1:, middle]
    tip = np.stack([np.full_like(root[0], TIP), TAPER * root[1]])
    share = np.linspace(0.0, 1.0, along + 1)[:, None]
    bladed = (1 - share) * root + share * tip
    points = np.hstack([disk.reshape(2, -1), bladed.reshape(2, -1)])
    corners = np.hstack([cells(around, out), cells(blade, along) + disk[0].size])
    return merged(points, corners)


def merged(points: np.ndarray, corners: np.ndarray) -> Mesh:
    """Return a mesh whose points, to a nanometre, are there once."""
    _, first, place = np.unique(
        np.rint(points / 1e-9), axis=1, return_index=True, return_inverse=True
    )
    return points[:, first], place.ravel()[corners]


def whole_mesh(grid: tuple[int, int, int, int]) -> Mesh:
    """Return the mesh of all sectors."""
    points, corners = sector_mesh(grid)
    around = [turned(points, STEP * j) for j in range(BLADES)]
    every = [corners + points.shape[1] * j for j in range(BLADES)]
    return merged(np.hstack(around), np.hstack(every))


def turned(points: np.ndarray, angle: float) -> np.ndarray:
    """Return points (2, p) turned against the clock."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s], [s, c]]) @ points


def response(
    place: np.ndarray, axis: np.ndarray, hub: np.ndarray, elastic: Any, load: Any
) -> np.ndarray:
    """Return the displacements by a load that is the same in all sectors, hub held.

    On the cuts of a sector, the mirror lines of the wheel, nothing moves across them.

    place : (2, n), m, and axis : (n,), 0 or 1, of the unknowns
    """
    angle = np.arctan2(place[1], place[0])
    wide = np.abs(angle).max() > STEP  # a whole wheel has no cuts
    cut = (np.abs(np.abs(angle) - STEP / 2) < 1e-6) & ~hub & (not wide)
    cut &= np.hypot(*place) < RIM * 1.001
    free = np.flatnonzero(~hub & ~cut)
    pairs = np.flatnonzero(cut & (axis == 0))
    _, over = np.unique(
        place.round(9)[:, cut & (axis == 1)], axis=1, return_inverse=True
    )
    _, own = np.unique(place.round(9)[:, pairs], axis=1, return_inverse=True)
    twins = np.flatnonzero(cut & (axis == 1))[np.argsort(over)][own]
    rows = np.concatenate([free, pairs, twins])
    radial = len(free) + np.arange(len(pairs))
    columns = np.concatenate([np.arange(len(free)), radial, radial])
    values = np.concatenate(
        [np.ones(len(free)), np.cos(angle[pairs]), np.sin(angle[pairs])]
    )
    lift = sparse.csr_array(
        (values, (rows, columns)), (place.shape[1], len(free) + len(pairs))
    )
    held = sparse.csc_array(lift.T @ elastic @ lift)
    return lift @ spsolve(held, lift.T @ load)


def plane_stress(slope: np.ndarray) -> dict[str, np.ndarray]:
    """Return {s00, s01, s10, s11} at the points of du_i/dx_j, (2, 2, c, q), Pa."""
    shear = YOUNG / (2 * (1 + POISSON))
    plane = YOUNG * POISSON / (1 - POISSON**2)
    sides = plane * (slope[0, 0] + slope[1, 1])
    across = shear * (slope[0, 1] + slope[1, 0])
    own = {f"s{i}{i}": sides + 2 * shear * slope[i, i] for i in (0, 1)}
    return own | {"s01": across, "s10": across}


def taut(u: Any, v: Any, w: Any) -> Any:
    """Return the form of K_g: stress w at slopes of u and v."""
    from skfem.helpers import grad

    return sum(
        w[f"s{i}{j}"] * grad(u)[k, i] * grad(v)[k, j] for i, j, k in np.ndindex(2, 2, 2)
    )


def ahead(u: Any, v: Any, _: Any) -> Any:
    """Return the form of C: v times u, turned by 90 degrees against the clock."""
    return v[1] * u[0] - v[0] * u[1]


class Body:
    """Matrices of a mesh whose hub follows the centre; places of its unknowns.

    mass, stiffness : (n, n), kg and N/m; the centre's x and y come last
    coriolis, stress_stiffness : (n, n), kg, per unit Omega and Omega^2; all mass is in
        the plane, so that `mass` is the softening
    load : (n,), kg m, per unit Omega^2
    place : (n - 2, 2), m, and axis : (n - 2,), 0 for x and 1 for y, of the others
    """

    def __init__(self, points: np.ndarray, corners: np.ndarray, springs: float) -> None:
        try:
            import skfem
            from skfem.helpers import dot, grad
            from skfem.models.elasticity import linear_elasticity
        except ImportError:
            raise SystemExit("jobs/wheel.py needs: pip install scikit-fem") from None
        element = skfem.ElementVector(skfem.ElementQuad2())
        basis = skfem.Basis(
            skfem.MeshQuad(np.ascontiguousarray(points), np.ascontiguousarray(corners)),
            element,
        )
        shear = YOUNG / (2 * (1 + POISSON))
        plane = YOUNG * POISSON / (1 - POISSON**2)  # Lame's lambda in plane stress
        elastic = skfem.asm(linear_elasticity(plane, shear), basis)
        inertia = skfem.asm(skfem.BilinearForm(lambda u, v, _: dot(u, v)), basis)
        axis = np.empty(basis.N, dtype=int)
        for dofs in (basis.nodal_dofs, basis.facet_dofs, basis.interior_dofs):
            for own in range(2):
                axis[dofs[own]] = own
        hub = np.hypot(*basis.doflocs) < HUB * (1 + 1e-3)
        free = np.flatnonzero(~hub)
        columns = np.empty(basis.N, dtype=int)
        columns[free], columns[hub] = np.arange(len(free)), len(free) + axis[hub]
        tie = sparse.csr_array((np.ones(basis.N), (np.arange(basis.N), columns)))
        self.mass = tie.T @ (DENSITY * WIDTH * inertia) @ tie
        springs_too = np.r_[np.zeros(len(free)), [springs] * 2]
        self.stiffness = tie.T @ (WIDTH * elastic) @ tie + sparse.diags_array(
            springs_too
        )
        load = DENSITY * inertia @ basis.doflocs[axis, np.arange(basis.N)]
        moved = response(basis.doflocs, axis, hub, elastic, load)
        stress = plane_stress(grad(basis.interpolate(moved)))

        self.coriolis = (
            tie.T
            @ (DENSITY * WIDTH * skfem.asm(skfem.BilinearForm(ahead), basis))
            @ tie
        )
        self.stress_stiffness = (
            tie.T @ (WIDTH * skfem.asm(skfem.BilinearForm(taut), basis, **stress)) @ tie
        )
        self.load = tie.T @ (WIDTH * load)
        self.place, self.axis = basis.doflocs[:, free].T, axis[free]
        self.centre = {"x": len(free), "y": len(free) + 1}

    def at(self, place: np.ndarray, axis: int) -> int:
        """Return the unknown of an axis at a place, (2,)."""
        away = np.hypot(*(self.place - place).T) + (self.axis != axis)
        if away.min() > 1e-6:
            raise ValueError(f"no node at {place}")
        return int(np.argmin(away))


def written(folder: Path, name: str, body: Body) -> dict[str, Any]:
    """Write the matrices; return what a TOML says of them."""
    files = {}
    for kind in ("mass", "stiffness", "coriolis", "stress_stiffness"):
        matrix, files[kind] = getattr(body, kind), f"{name}_{kind}.mtx"
        sign, symmetry = (
            (-1, "skew-symmetric") if kind == "coriolis" else (1, "symmetric")
        )
        whole = (matrix + sign * matrix.T) / 2
        mmwrite(folder / files[kind], whole, symmetry=symmetry, precision=17)
    files |= {"softening": files["mass"], "centrifugal_load": f"{name}_load.mtx"}
    mmwrite(folder / files["centrifugal_load"], body.load[:, None], precision=17)
    return {**files, "blades": BLADES, "modes": 5 * BLADES}


def whole(folder: Path) -> dict[str, Any]:
    """Return the document of the whole wheel."""
    body = Body(*whole_mesh(GRID), springs=SPRINGS)
    tips = [turned(np.array([TIP, 0.0]), STEP * j) for j in range(BLADES)]
    pairs = {letter: [body.at(t, a) for t in tips] for a, letter in enumerate("xy")}
    table = written(folder, "wheel", body)
    return {"wheel": table, "tips": pairs, "centre": body.centre}


def sector(folder: Path) -> dict[str, Any]:
    """Return the document of one sector: its cuts, right the next one's left."""
    body = Body(*sector_mesh(GRID), springs=SPRINGS / BLADES)  # its part of the springs
    angle = np.arctan2(body.place[:, 1], body.place[:, 0])
    radius = np.hypot(*body.place.T)
    left = np.flatnonzero((np.abs(angle + STEP / 2) < 1e-6) & (radius < RIM * 1.001))
    table = written(folder, "sector", body)
    for axis, letter in enumerate("xy"):
        own = left[body.axis[left] == axis]
        over = [body.at(turned(body.place[i], STEP), axis) for i in own]
        table |= {f"left_{letter}": own.tolist(), f"right_{letter}": over}
    # x and y in the same order: both lists are of the same nodes
    tip = np.array([TIP, 0.0])
    pair = {letter: body.at(tip, axis) for axis, letter in enumerate("xy")}
    return {"sector": table, "tips": pair, "centre": body.centre}


def main() -> None:
    """Write everything into a folder."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    folder = parser.parse_args().folder
    folder.mkdir(parents=True, exist_ok=True)
    documents = {"wheel": whole(folder), "sector": sector(folder), "whirl": CAMPAIGN}
    for name, document in documents.items():
        (folder / f"{name}.toml").write_text(tomli_w.dumps(document), encoding="utf-8")
        print(folder / f"{name}.toml")


if __name__ == "__main__":
    main()
