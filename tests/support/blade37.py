"""The contact problem of a blade like Rotor 37's, for this program and an oracle.

Example 03 of NLstep (M. Krack, J. Gross), after E. Piollet, F. Nyssen, A. Batailly,
J. Sound Vib. 460 (2019): one blade, clamped, no centrifugal terms, turns at 1344 rad/s
in a rigid casing with two lobes that reach 0.356 mm into it; 16 contact points along
the chord, friction 0.15, modal damping 0.5 %. That blade's mesh is not here: a twisted
plate of solids has its first three frequencies. `hpcwhirl import-model` reduces it to
the points and 50 fixed-interface modes.

The oracle is dense_blade.py. There are two models: all coordinates, whose step must be
small since points carry mass, and the 50 lowest modes, at the example's 1000 steps a
revolution. hpcwhirl takes the casing by its harmonics.
"""

from __future__ import annotations

import contextlib
import io
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import scipy.linalg
import tomli_w
from dense_blade import Blade, Rub, Turning, march
from rotor_files import arrays_in, written
from scipy import sparse
from scipy.sparse.linalg import eigsh

from hpcwhirl.case.resolve import resolve
from hpcwhirl.cli import main as hpcwhirl
from hpcwhirl.dynamics.march import March
from hpcwhirl.scene import Scene, apply_settings

PUBLISHED = np.array([312.12, 922.81, 1165.62])  # Hz
SPEED, FRICTION, RATIO, GAP = 1344.0, 0.15, 0.005, 0.356e-3  # rad/s, 1, 1, m
TURN = 2 * math.pi / SPEED  # s
ROOT, TIP, CHORD = 0.178, 0.253, 0.056  # m, radii and chord
EDGE, STAGGER = 1.0, 0.75  # thickness of an edge over the middle's; rad, of the root
YOUNG, POISSON, DENSITY = 114e9, 0.33, 4430.0  # titanium
POINTS, MODES = 16, 50
GRID = (1, 6, POINTS - 1)  # elements across, out and along the chord
# thickness of the root, mm; that of the tip over it; twist, rad; lean along the
# rotation, rad: back, against friction's sprag
SIZE = (1.73486, 0.193719, 0.167951, -0.16)
HIGHEST = 64  # harmonic of the casing
SAMPLES = 1000  # of a revolution
# s in which the casing takes its shape. It is over 0.35 rad on, before the blade meets
# the first lobe: nothing moves yet, as in the oracle, whose casing has it at once.
RISE = 55 * TURN / SAMPLES
STEPS = {"all": 8, "modes": 1}  # of a sample


class Solid(NamedTuple):
    """Matrices (n, n) of all unknowns; places (3, n), m; axes, 0 to 2; clamped ones."""

    mass: Any
    stiffness: Any
    place: np.ndarray
    axis: np.ndarray
    held: np.ndarray


def section(across: Any, share: Any, along: Any) -> np.ndarray:
    """Return places (3, ...) of the blade; shares of thickness, height and chord."""
    thick, taper, twist, lean = SIZE
    middle = EDGE + (1 - EDGE) * (1 - 4 * along**2)
    off = 1e-3 * thick * (1 - (1 - taper) * share) * middle * across
    angle, chord = STAGGER + twist * share, CHORD * along
    c, s = np.cos(angle), np.sin(angle)
    y = c * off - s * chord + lean * (share - 1) * (TIP - ROOT)
    radius = ROOT + share * (TIP - ROOT)
    return np.stack([np.sqrt(radius**2 - y**2), y, s * off + c * chord])


def solid() -> Solid:
    """Return the blade as triquadratic solids."""
    import skfem
    from skfem.helpers import dot
    from skfem.models.elasticity import lame_parameters, linear_elasticity

    ends = (-0.5, 0.5), (0.0, 1.0), (-0.5, 0.5)
    lines = [np.linspace(*e, n + 1) for e, n in zip(ends, GRID, strict=True)]
    flat = skfem.MeshHex.init_tensor(*lines)
    root = flat.facets_satisfying(lambda x: x[1] == 0.0)
    mesh = skfem.MeshHex(np.ascontiguousarray(section(*flat.p)), flat.t)
    basis = skfem.Basis(mesh, skfem.ElementVector(skfem.ElementHex2()), intorder=4)
    axis = np.empty(basis.N, dtype=int)
    for part in ("nodal", "edge", "facet", "interior"):
        dofs = getattr(basis, f"{part}_dofs")
        for own in range(3):
            axis[dofs[own::3]] = own
    inertia = skfem.BilinearForm(lambda u, v, _: DENSITY * dot(u, v))
    elastic = linear_elasticity(*lame_parameters(YOUNG, POISSON))
    pair = (sparse.csr_array(skfem.asm(form, basis)) for form in (inertia, elastic))
    mass, stiffness = ((a + a.T) / 2 for a in pair)
    held = np.sort(basis.get_dofs(root).all())
    return Solid(mass, stiffness, basis.doflocs, axis, held)


def frequencies(body: Solid, count: int = 3) -> np.ndarray:
    """Return the lowest frequencies of all unknowns, Hz."""
    free = np.setdiff1d(np.arange(len(body.axis)), body.held)
    mass, stiffness = (a[free][:, free].tocsc() for a in body[:2])
    squared = eigsh(stiffness, count, mass, sigma=0.0, return_eigenvectors=False)
    return np.sqrt(np.sort(squared)) / (2 * math.pi)


def tips_of(body: Solid) -> dict[str, Any]:
    """Return what a TOML says of the contact points, by ascending axial place."""
    share = np.linspace(-0.5, 0.5, POINTS)
    wanted = section(np.zeros(POINTS), np.ones(POINTS), share).T
    out: dict[str, Any] = {}
    for axis, letter in enumerate("xy"):
        own = np.flatnonzero(body.axis == axis)
        away = np.linalg.norm(body.place[:, own, None] - wanted.T[:, None], axis=0)
        if away.min(axis=0).max() > 1e-6:
            raise ValueError(f"no nodes along the chord: {away.min(axis=0).max():g} m")
        out[letter] = own[away.argmin(axis=0)].tolist()
    near = body.place[:, out["x"]]
    return out | {
        "station": near[2].tolist(),
        "turn": np.arctan2(near[1], near[0]).tolist(),
    }


def reduced(folder: Path, body: Solid) -> dict[str, Path]:
    """Write the engine files of both models; return {model: file}."""
    files = {"all": folder / "rotor.h5", "modes": folder / "modes.h5"}
    blade = {"blades": 1, "modes": MODES, "held": body.held.tolist()}
    for name in ("mass", "stiffness"):
        sparse.save_npz(folder / f"{name}.npz", getattr(body, name))
        blade[name] = f"{name}.npz"
    document = {"wheel": blade, "tips": tips_of(body)}
    toml = folder / "blade.toml"
    toml.write_text(tomli_w.dumps(document), encoding="utf-8")
    with contextlib.redirect_stdout(io.StringIO()):
        if hpcwhirl(["import-model", str(toml), "--out", str(files["all"])]):
            raise SystemExit(2)
    whole = blade_of(files["all"])
    squared, shapes = scipy.linalg.eigh(whole.stiffness, whole.mass)
    shapes = shapes[:, :MODES]
    own = arrays_in(files["all"])
    beside = {name: own[name] for name in ("tip_station", "tip_angle")} | {
        "omega": np.sqrt(squared[:MODES]),
        "modal_tip_radial": (whole.radial @ shapes)[None],
        "modal_tip_tangential": (whole.along @ shapes)[None],
    }
    written(files["modes"], beside)
    return files


def blade_of(path: Path) -> Blade:
    """Return the blade of an engine's file, as the oracle takes it."""
    given = arrays_in(path)
    if "mass" in given:
        same = np.eye(len(given["mass"]))
        rows = (same[given[f"tip_{n}"][0]] for n in ("radial", "tangential"))
        body = given["mass"], given["stiffness"]
    else:
        rows = (given[f"modal_tip_{n}"][0] for n in ("radial", "tangential"))
        body = np.eye(len(given["omega"])), np.diag(given["omega"] ** 2)
    return Blade(*body, *rows, given["tip_angle"], RATIO)


def clearance(angle: np.ndarray) -> np.ndarray:
    """Return the gap at angles, m, by the published formula."""
    share = angle % math.pi / math.pi - 0.5
    return GAP * (1 - 2 * np.exp(-(share**2) / 0.15**2))


def harmonics() -> np.ndarray:
    """Return rows harmonic, amplitude, phase of the gap beyond `GAP`, (n, 3)."""
    count = 1 << 14
    angle = 2 * math.pi * np.arange(count) / count
    parts = np.fft.rfft(clearance(angle) - GAP)[: HIGHEST + 1 : 2] / count
    sizes = np.where(np.arange(len(parts)) == 0, 1.0, 2.0) * parts.real
    order = 2.0 * np.arange(len(parts))  # the casing is even: phases are 0 or pi
    return np.column_stack([order, np.abs(sizes), np.where(sizes < 0, math.pi, 0.0)])


def by_harmonics() -> Callable[[np.ndarray], np.ndarray]:
    """Return the function of the gap at angles, m, by its harmonics."""
    order, size, phase = harmonics().T
    signed = size * np.cos(phase)
    return lambda angle: GAP + np.cos(np.multiply.outer(angle, order)) @ signed


def settings(file: Path, step: int, revolutions: float) -> dict[str, Any]:
    """Return the inputs of the run; `step` steps make a sample."""
    rows = ";".join(",".join(map(repr, row)) for row in harmonics().tolist())
    return {
        "engine.file": str(file), "blades": 1, "radius": TIP, "rotation": "none",
        "engine.rotor.damping": RATIO, "engine.casing.kind": "rigid",
        "engine.casing.profile_rise": RISE,
        "engine.casing.profile": f"harmonic,amplitude,phase;{rows}",
        "speed": SPEED, "gap": GAP, "friction": FRICTION, "force": 0.0,
        "duration": revolutions * TURN, "time_step": TURN / SAMPLES / step,
        "interval": TURN / SAMPLES, "traces": "full",
    }  # fmt: skip


def marched(file: Path, step: int, revolutions: float) -> tuple[March, np.ndarray]:
    """Return hpcwhirl's march at its end, and points (s, n_c, 2), m."""
    case = resolve(apply_settings(Scene(), settings(file, step, revolutions)))
    run = March(case)
    return run, run.run().point_tips[:, 0]


def oracle(
    file: Path, step: int, revolutions: float, gap: Callable[..., np.ndarray]
) -> Rub:
    """Return the same by full matrices."""
    size, count = TURN / SAMPLES / step, round(revolutions * SAMPLES) * step
    return march(blade_of(file), gap, Turning(SPEED, FRICTION, size, count, step))


def apart(points: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Return the largest difference up to each sample, over the largest of all."""
    away = np.abs(points - others).max(axis=(1, 2))
    return np.maximum.accumulate(away) / np.abs(others).max()
