#!/usr/bin/env python3
"""A fan stage of solid twisted blades, from its mesh to the page of its map.

    pip install scikit-fem
    python jobs/stage.py stage             # all of it; again: what is missing
    python jobs/stage.py stage --coarse    # a mesh of 1,298 unknowns a sector

36 blades on a disk with a rigid hub that does not rotate, in a sector of 22,352
unknowns (triquadratic solids). The stiffness is the tangent of finite displacements in
the equilibrium at each of two speeds, so that tension, untwisting and softening are in
it: with that at rest it gives K(Omega) = K_0 + Omega^2 K_1 + Omega^4 K_2. A tip has
contact points along its chord, with a clearance that grows to both edges; the casing is
a cylindrical shell and the shaft is soft. `map.toml` is the campaign.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w
from scipy import sparse
from scipy.io import mmwrite
from scipy.sparse.linalg import LinearOperator, eigs, splu
from wheel import Mesh, cells, turned

BLADES, STEP = 36, 2 * np.pi / 36
HUB, RIM, TIP = 0.12, 0.2, 0.5  # m, radii
WIDTH, THICKNESS = 0.08, 0.012  # m, of the disk and of a blade's root
TAPER, TWIST = 0.5, 0.7  # of the thickness; rad, of the tip against the root
YOUNG, POISSON, DENSITY = 114e9, 0.33, 4430.0  # titanium
SHEAR = YOUNG / (2 * (1 + POISSON))
LAME = YOUNG * POISSON / ((1 + POISSON) * (1 - 2 * POISSON))
SHAFT = 4e7  # N/m
SPEEDS = 420.0, 600.0  # rad/s, at which the stiffness is given
FINE = (6, 2, 3, 22, 12)  # elements around, across a blade, out, along, and axial
COARSE = (4, 2, 1, 3, 4)
POINTS = 3  # of a tip
MODES = 20 * BLADES  # fixed-interface modes, beside the points and what speed adds
ROOT = {"root front": -0.5, "root middle": 0.0, "root rear": 0.5}  # of the width
ABOVE = 0.02  # of a blade's height, of the points where its stress is told
EDGES = 1e-4  # m, clearance of the chord's ends beyond that of its middle
NEWTON, LOADED = 1e-10, 12  # relative residual, most iterations
CHUNK = 64  # solids at a time
HPCWHIRL = sys.executable, "-m", "hpcwhirl"
CAMPAIGN = {
    "scene": {"duration": 1.0, "gap": 5e-5, "nodal_diameter": 2, "force": 2e5},
    "engine": {
        "name": "solid fan stage",
        "file": "rotor.h5",
        "rotation": "full",
        "rotor": {"blades": BLADES, "radius": TIP, "suspension_damping": -1.0},
        "casing": {
            "discretization": "shell", "width": 0.12, "thickness": 0.006,
            "axial_modes": 2, "harmonics": 6, "families": "bending",
        },
    },
    "output": {"traces": "full"},
    "sweep": {"speed": [200, 300, 400], "friction": [0.15, 0.3]},
}  # fmt: skip


def section(share: Any, y: Any, z: Any, twist: float) -> np.ndarray:
    """Return places (3, ...) of a blade at a share of its height above the root."""
    angle = twist * share
    c, s = np.cos(angle), np.sin(angle)
    thick = (1 - (1 - TAPER) * share) * y
    across, along = c * thick - s * z, s * thick + c * z
    radius = RIM + share * (TIP - RIM)
    return np.stack([np.sqrt(radius**2 - across**2), across, along])


def layered(flat: np.ndarray, layers: int) -> np.ndarray:
    """Return corners (8, c layers) of cells (4, c) of layers of 1 + max(flat) points.

    In skfem's order: the corner (1, 1, 1) first, (0, 0, 0) last.
    """
    size = int(flat.max()) + 1
    base = (flat[..., None] + size * np.arange(layers)).reshape(4, -1)
    (a, b, c, d), (e, f, g, h) = base, base + size
    return np.stack([a, e, d, b, h, f, c, g])


def sector_mesh(grid: tuple[int, ...] = FINE, twist: float = TWIST) -> Mesh:
    """Return points (3, p) and hexahedra (8, c) of the sector with its blade on x."""
    around, across, out, along, axial = grid
    z = WIDTH * np.linspace(-0.5, 0.5, axial + 1)[:, None, None]
    half = np.arcsin(THICKNESS / 2 / RIM)
    side = (around - across) // 2
    angle = np.r_[
        np.linspace(-STEP / 2, -half, side + 1)[:-1],
        np.arcsin(THICKNESS / RIM * np.linspace(-0.5, 0.5, across + 1)),
        np.linspace(half, STEP / 2, side + 1)[1:],
    ]
    radius = np.linspace(HUB, RIM, out + 1)[None, :, None]
    disk = np.stack(
        np.broadcast_arrays(radius * np.cos(angle), radius * np.sin(angle), z)
    )
    share = np.linspace(0.0, 1.0, along + 1)[None, :, None]
    y = THICKNESS * np.linspace(-0.5, 0.5, across + 1)
    blade = section(share, y, z, twist)
    points = np.hstack([disk.reshape(3, -1), blade.reshape(3, -1)])
    own = layered(cells(around, out), axial)
    more = layered(cells(across, along), axial) + disk[0].size
    _, first, place = np.unique(
        np.rint(points / 1e-8), axis=1, return_index=True, return_inverse=True
    )
    return points[:, first], place.ravel()[np.hstack([own, more])]


def tangent(
    slope: np.ndarray, value: np.ndarray, weight: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return forces (c, b) and tangents (c, b, b) of c solids of finite displacements.

    St. Venant-Kirchhoff's law, whose stress is linear in Green's strain.

    slope : (b, 3, 3, c, q), of the b shapes at q points
    value : (b, c), their amplitudes
    weight : (c, q), m^3
    """
    one = np.eye(3)[:, :, None, None]
    grown = one + np.einsum("bijcq,bc->ijcq", slope, value)
    stress = elastic((np.einsum("kicq,kjcq->ijcq", grown, grown) - one) / 2) * weight
    half = np.einsum("kicq,bkjcq->bijcq", grown, slope)
    half = (half + np.swapaxes(half, 1, 2)) / 2
    force = np.einsum("ijcq,bijcq->cb", stress, half)
    taut = np.einsum("ijcq,bkjcq->bkicq", stress, slope)
    pairs = (half, np.stack([elastic(own) * weight for own in half])), (slope, taut)
    flat = [[np.moveaxis(a, 3, 0).reshape(a.shape[3], len(a), -1) for a in pair]
            for pair in pairs]  # fmt: skip
    return force, sum(a @ np.swapaxes(b, 1, 2) for a, b in flat)


def elastic(strain: np.ndarray) -> np.ndarray:
    """Return the stress of a strain, (3, 3, ...)."""
    one = np.eye(3)[:, :, None, None]
    return LAME * np.trace(strain) * one + 2 * SHEAR * strain


def factor(matrix: Any) -> Any:
    """Return the factor of a sparse Hermitian matrix that is positive definite."""
    options = {"SymmetricMode": True}  # without it the fine mesh takes twice the memory
    return splu(
        sparse.csc_array(matrix), "MMD_AT_PLUS_A", diag_pivot_thresh=0.0,
        options=options,
    )  # fmt: skip


class Sector:
    """Matrices of a sector whose hub follows the centre.

    mass, coriolis : (n, n), kg; the centre's x and y are the last unknowns
    softening : (n, n), kg, of what moves in the plane
    load : (n,), kg m, per unit Omega^2
    place, axis : (n - 2, 3), m, and (n - 2,), 0 to 2, of the others
    """

    def __init__(self, points: np.ndarray, corners: np.ndarray) -> None:
        try:
            import skfem
            from skfem.helpers import dot
        except ImportError:
            raise SystemExit("jobs/stage.py needs: pip install scikit-fem") from None
        self.fem = skfem
        mesh = skfem.MeshHex(
            np.ascontiguousarray(points), np.ascontiguousarray(corners)
        )
        element = skfem.ElementVector(skfem.ElementHex2())
        self.basis = basis = skfem.Basis(mesh, element, intorder=4)
        axis = np.empty(basis.N, dtype=int)
        for part in ("nodal", "edge", "facet", "interior"):
            dofs = getattr(basis, f"{part}_dofs")
            for own in range(3):
                axis[dofs[own::3]] = own
        where = basis.doflocs
        hub = np.hypot(where[0], where[1]) < HUB * (1 + 1e-3)
        free = np.flatnonzero(~hub)
        rows = np.r_[free, np.flatnonzero(hub & (axis < 2))]
        columns = np.r_[np.arange(len(free)), len(free) + axis[hub & (axis < 2)]]
        self.tie = sparse.csr_array(
            (np.ones(len(rows)), (rows, columns)), (basis.N, len(free) + 2)
        )
        self.place, self.axis = where[:, free].T, axis[free]
        form = skfem.BilinearForm
        flat = form(lambda u, v, _: DENSITY * (u[0] * v[0] + u[1] * v[1]))
        ahead = form(lambda u, v, _: DENSITY * (v[1] * u[0] - v[0] * u[1]))
        whole = form(lambda u, v, _: DENSITY * dot(u, v))
        self.mass, self.softening, self.coriolis = (
            self.tied(skfem.asm(own, basis)) for own in (whole, flat, ahead)
        )
        places = where[axis, np.arange(basis.N)]
        self.load = self.tie.T @ (skfem.asm(flat, basis) @ places)
        self.centre = {"x": len(free), "y": len(free) + 1}

    def tied(self, matrix: Any) -> sparse.csr_array:
        """Return a matrix of all unknowns with the hub tied to the centre."""
        return sparse.csr_array(self.tie.T @ matrix @ self.tie)

    def at(self, place: np.ndarray, axis: int) -> int:
        """Return the unknown of an axis at a place, (3,)."""
        away = np.linalg.norm(self.place - place, axis=1) + (self.axis != axis)
        if away.min() > 1e-6:
            raise ValueError(f"no node at {place}")
        return int(np.argmin(away))

    def cuts(self) -> dict[str, list[int]]:
        """Return the unknowns on both cuts, right the next sector's left."""
        x, y, _ = self.place.T
        inside = np.hypot(x, y) < RIM * 1.001
        left = np.flatnonzero(inside & (np.abs(np.arctan2(y, x) + STEP / 2) < 1e-6))
        out = {}
        for axis, letter in enumerate(("_x", "_y", "")):
            own = left[self.axis[left] == axis]
            over = [
                self.at(np.r_[turned(p[:2], STEP), p[2]], axis) for p in self.place[own]
            ]
            out |= {f"left{letter}": own.tolist(), f"right{letter}": over}
        return out

    def stress(self, place: np.ndarray) -> np.ndarray:
        """Return rows (6, n), Pa/m, of the stress at the blade's point next to a place.

        At rest, at the nearest integration point, where the stress of quadratic shapes
        is most exact; xx, yy, zz, yz, zx, xy.
        """
        points = self.basis.global_coordinates()
        away = np.linalg.norm(points - place[:, None, None], axis=0)
        away[np.hypot(points[0], points[1]) < RIM] = np.inf
        solid, own = np.unravel_index(away.argmin(), away.shape)
        out = np.zeros((6, self.basis.N))
        for shape, dof in zip(
            self.basis.basis, self.basis.element_dofs[:, solid], strict=True
        ):
            slope = np.asarray(shape[0].grad)[:, :, [[solid]], [[own]]]
            found = elastic((slope + np.swapaxes(slope, 0, 1)) / 2)[..., 0, 0]
            out[:, dof] += found[[0, 1, 2, 1, 2, 0], [0, 1, 2, 2, 0, 1]]
        return out @ self.tie

    def wave(self, k: int) -> sparse.csc_array:
        """Return T of u = T v for motions e^{2 pi i k j / N} of sector j."""
        cut, size = self.cuts(), len(self.load)
        c, s = np.cos(STEP), np.sin(STEP)
        turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        left = np.array([cut["left_x"], cut["left_y"], cut["left"]])
        right = np.array([cut["right_x"], cut["right_y"], cut["right"]])
        hub = list(self.centre.values())
        keep = np.setdiff1d(np.arange(size), np.r_[right.ravel(), hub])
        column = np.full(size, -1)
        column[keep] = np.arange(len(keep))
        rows, columns, values = [keep], [column[keep]], [np.ones(len(keep), complex)]
        for a, b in zip(*np.nonzero(turn), strict=True):
            rows.append(right[a])
            columns.append(column[left[b]])
            values.append(np.full(left.shape[1], np.exp(1j * k * STEP) * turn[a, b]))
        width = len(keep)
        if k in {1, -1}:  # the centre moves along x - i k y
            rows.append(np.array(hub))
            columns.append(np.full(2, width))
            values.append(np.array([1.0, 1j * k]))
            width += 1
        places = np.concatenate(rows), np.concatenate(columns)
        whole = (np.concatenate(values), places)
        out = sparse.csc_array(whole, shape=(size, width))
        return out.real if k == 0 else out

    def stiffness(self, moved: np.ndarray) -> tuple[np.ndarray, sparse.csr_array]:
        """Return forces (n,) and tangent (n, n) of displacements (n,), hub held."""
        dofs, weight = self.basis.element_dofs, self.basis.dx
        shapes = [np.asarray(own[0].grad) for own in self.basis.basis]
        value = (self.tie @ moved)[dofs]
        pushed, blocks = [], []
        for first in range(0, dofs.shape[1], CHUNK):
            own = slice(first, first + CHUNK)
            slope = np.stack([shape[:, :, own] for shape in shapes])
            force, block = tangent(slope, value[:, own], weight[own])
            pushed.append(force)
            blocks.append(block)
        size, count = self.basis.N, len(dofs)
        whole = np.zeros(size)
        np.add.at(whole, dofs.T, np.concatenate(pushed))
        rows = np.repeat(dofs.T, count, axis=1).ravel()
        places = rows, np.tile(dofs.T, (1, count)).ravel()
        data = np.concatenate(blocks).ravel()
        matrix = self.tied(sparse.csr_array((data, places), shape=(size, size)))
        return self.tie.T @ whole, (matrix + matrix.T) / 2

    def turning(self, speed: float) -> sparse.csr_array:
        """Return K(Omega), softening included, in the equilibrium at that speed."""
        lift = self.wave(0)
        moved = np.zeros(len(self.load))
        for _ in range(LOADED):
            force, tangent = self.stiffness(moved)
            tangent = tangent - speed**2 * self.softening
            pull = speed**2 * (self.load + self.softening @ moved)
            rest = lift.T @ (pull - force)
            if np.linalg.norm(rest) <= NEWTON * np.linalg.norm(lift.T @ pull):
                return tangent
            moved += lift @ factor(lift.T @ tangent @ lift).solve(rest)
        raise SystemExit(f"no equilibrium at {speed:g} rad/s in {LOADED} iterations")

    def frequencies(
        self, tangent: sparse.csr_array, k: int, speed: float, count: int
    ) -> np.ndarray:
        """Return the lowest frequencies of waves e^{i (k theta + omega t)}, rad/s.

        Those of all unknowns, ascending, backward ones negative.

        tangent : (n, n), N/m, K(Omega), see `turning`
        """
        lift, springs = self.wave(k), np.zeros(len(self.load))
        springs[list(self.centre.values())] = SHAFT / BLADES
        own = tangent + sparse.diags_array(springs)
        stiffness, gyro, mass = (
            sparse.csc_array(lift.conj().T @ a @ lift)
            for a in (own, 2 * speed * self.coriolis, self.mass)
        )
        solve, size = factor(stiffness.astype(complex)).solve, mass.shape[0]

        def inverse(x: np.ndarray) -> np.ndarray:
            first, second = x[:size], x[size:]
            return np.r_[-solve(gyro @ first + mass @ second), first]

        operator = LinearOperator((2 * size, 2 * size), inverse, dtype=complex)
        start, ncv = np.ones(2 * size), min(2 * size - 1, 3 * count + 20)
        inverted = eigs(operator, count, ncv=ncv, v0=start, return_eigenvectors=False)
        return np.sort((1 / inverted).imag)


def tip_table(
    body: Sector, axial: int, points: int = POINTS, twist: float = TWIST
) -> dict[str, Any]:
    """Return what a TOML says of the contact points along the tip's chord."""
    share = np.linspace(-0.5, 0.5, points)
    nodes = np.rint((share + 0.5) * 2 * axial) / (2 * axial) - 0.5
    place = section(1.0, 0.0, WIDTH * nodes, twist)
    found = [np.argmin(np.linalg.norm(body.place - p, axis=1)) for p in place.T]
    near = body.place[found]  # a node within an edge is not quite on the chord
    out: dict[str, Any] = {
        letter: [body.at(p, a) for p in near] for a, letter in enumerate("xy")
    }
    out["station"] = near[:, 2].tolist()
    out["turn"] = np.arctan2(near[:, 1], near[:, 0]).tolist()
    return out | {"gap": (4 * EDGES * share**2).tolist()}


def written(folder: Path, grid: tuple[int, ...], modes: int = MODES) -> Sector:
    """Write the matrices, sector.toml and map.toml."""
    body = Sector(*sector_mesh(grid))
    print(f"{len(body.load)} unknowns of a sector", flush=True)
    matrices = {"mass": body.mass, "stiffness": body.turning(0.0)}
    matrices["coriolis"] = body.coriolis
    for letter, speed in zip("ab", SPEEDS, strict=True):
        matrices[f"stiffness_{letter}"] = body.turning(speed)
    files = {name: f"{name}.npz" for name in matrices}
    for name, matrix in matrices.items():
        sign = -1 if name == "coriolis" else 1
        whole = (matrix + sign * matrix.T) / 2
        sparse.save_npz(folder / files[name], sparse.csr_array(whole))
    mmwrite(folder / "load.mtx", body.load[:, None], precision=17)
    files |= {"centrifugal_load": "load.mtx"}
    table = files | {"blades": BLADES, "modes": modes, "speeds": list(SPEEDS)}
    tips, centre = tip_table(body, grid[-1]), body.centre | {"stiffness": SHAFT}
    places = (section(ABOVE, THICKNESS / 2, WIDTH * z, TWIST) for z in ROOT.values())
    rows = np.vstack([body.stress(place) for place in places])
    mmwrite(folder / "stress.mtx", sparse.coo_array(rows), precision=17)
    stress = {"matrix": "stress.mtx", "names": list(ROOT)}
    document = {"sector": table | body.cuts(), "tips": tips, "centre": centre}
    document["stress"] = stress
    for name, whole in (("sector", document), ("map", CAMPAIGN)):
        (folder / f"{name}.toml").write_text(tomli_w.dumps(whole), encoding="utf-8")
    return body


def reduced(folder: Path, grid: tuple[int, ...] = FINE, modes: int = MODES) -> Path:
    """Return the file of the reduced rotor; make what is missing in the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    rotor, sector = folder / "rotor.h5", folder / "sector.toml"
    if not (folder / "map.toml").exists():
        written(folder, grid, modes)
    if not rotor.exists():
        subprocess.run([*HPCWHIRL, "import-model", sector, "--out", rotor], check=True)
    return rotor


def main() -> None:
    """Build, reduce and march what is not there yet."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--coarse", action="store_true", help="a small mesh")
    parser.add_argument("--ranks", type=int, default=2, help="of the campaign")
    args = parser.parse_args()
    folder = args.folder
    reduced(folder, COARSE if args.coarse else FINE)
    mpirun = os.environ.get("HPCWHIRL_MPIRUN", "mpirun")
    campaign = folder / "map.toml", "--out", folder / "map"
    whole = [mpirun, "-n", str(args.ranks), *HPCWHIRL, "campaign", *campaign]
    subprocess.run(whole, check=True)


if __name__ == "__main__":
    main()
