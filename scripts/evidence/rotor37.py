"""The contact problem of a blade like Rotor 37's, beside a solver of full matrices.

    pip install scikit-fem
    python scripts/evidence/rotor37.py [FOLDER] [--revolutions 50] [--write]
    python scripts/evidence/rotor37.py --identify

Example 03 of NLstep (M. Krack, J. Gross), after E. Piollet, F. Nyssen, A. Batailly,
J. Sound Vib. 460 (2019): one blade, clamped, no centrifugal terms, turns at 1344 rad/s
in a rigid casing with two lobes that reach 0.356 mm into it; 16 contact points along
the chord, friction 0.15, modal damping 0.5 %. That blade's mesh is not here: a twisted
plate of solids has its first three frequencies, and `--identify` finds the plate's
dimensions from rough ones. `hpcwhirl import-model` reduces it to the points and 50
fixed-interface modes.

The oracle is dense_blade.py. Two models are marched by both, at a step, its half and
its quarter: all coordinates, whose step must be small since points carry mass; and the
50 lowest modes, at the example's 1000 steps a revolution. hpcwhirl takes the casing by
its harmonics, and so does the oracle; at the longest step also by its formula.
With --write, the tables go to scripts/evidence/rotor37.md.
"""

from __future__ import annotations

import contextlib
import io
import math
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import h5py
import numpy as np
import scipy.linalg
import tomli_w
from scipy import sparse
from scipy.optimize import least_squares
from scipy.sparse.linalg import eigsh

from hpcwhirl.case.resolve import resolve
from hpcwhirl.cli import main as hpcwhirl
from hpcwhirl.dynamics.march import March
from hpcwhirl.scene import Scene, apply_settings

sys.path.insert(0, str(Path(__file__).parents[1]))
from common import parser_of, table, tell, working_folder
from evidence.dense_blade import Blade, Rub, Turning, compliance, march

PAGE = Path(__file__).with_suffix(".md")
PUBLISHED = np.array([312.12, 922.81, 1165.62])  # Hz
SPEED, FRICTION, RATIO, GAP = 1344.0, 0.15, 0.005, 0.356e-3  # rad/s, 1, 1, m
TURN = 2 * math.pi / SPEED  # s
ROOT, TIP, CHORD = 0.178, 0.253, 0.056  # m, radii and chord
EDGE, STAGGER = 1.0, 0.75  # thickness of an edge over the middle's; rad, of the root
YOUNG, POISSON, DENSITY = 114e9, 0.33, 4430.0  # titanium
POINTS, MODES = 16, 50
GRID = (1, 6, POINTS - 1)  # elements across, out and along the chord
LEAN = (
    -0.16
)  # rad, of the blade along the rotation: here back, against friction's sprag
# thickness of the root, mm; that of the tip over it; twist, rad; lean, rad
ROUGH = (2.0, 0.4, 0.3, LEAN)
FOUND = (1.73486, 0.193719, 0.167951, LEAN)  # by --identify
HIGHEST = 64  # harmonic of the casing
SAMPLES = 1000  # of a revolution
HALVINGS = (1, 2, 4)
STEPS = {"all": 8, "modes": 1}  # of a sample, the longest
LEVELS = (1e-8, 1e-6, 1e-3)
Dimensions = Sequence[float]


class Solid(NamedTuple):
    """Matrices (n, n) of all unknowns; places (3, n), m; axes, 0 to 2; clamped ones."""

    mass: Any
    stiffness: Any
    place: np.ndarray
    axis: np.ndarray
    held: np.ndarray


def section(size: Dimensions, across: Any, share: Any, along: Any) -> np.ndarray:
    """Return places (3, ...) of the blade; shares of thickness, height and chord."""
    thick, taper, twist, lean = size
    middle = EDGE + (1 - EDGE) * (1 - 4 * along**2)
    off = 1e-3 * thick * (1 - (1 - taper) * share) * middle * across
    angle, chord = STAGGER + twist * share, CHORD * along
    c, s = np.cos(angle), np.sin(angle)
    y = c * off - s * chord + lean * (share - 1) * (TIP - ROOT)
    radius = ROOT + share * (TIP - ROOT)
    return np.stack([np.sqrt(radius**2 - y**2), y, s * off + c * chord])


def solid(size: Dimensions = FOUND, grid: tuple[int, int, int] = GRID) -> Solid:
    """Return the blade as triquadratic solids."""
    try:
        import skfem
        from skfem.helpers import dot
        from skfem.models.elasticity import lame_parameters, linear_elasticity
    except ImportError:
        raise SystemExit("rotor37.py needs: pip install scikit-fem") from None
    ends = (-0.5, 0.5), (0.0, 1.0), (-0.5, 0.5)
    lines = [np.linspace(*e, n + 1) for e, n in zip(ends, grid, strict=True)]
    flat = skfem.MeshHex.init_tensor(*lines)
    root = flat.facets_satisfying(lambda x: x[1] == 0.0)
    mesh = skfem.MeshHex(np.ascontiguousarray(section(size, *flat.p)), flat.t)
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


def identified(grid: tuple[int, int, int] = GRID) -> np.ndarray:
    """Return the dimensions that have the published frequencies."""

    def away(size: np.ndarray) -> np.ndarray:
        return np.log(frequencies(solid([*size, LEAN], grid)) / PUBLISHED)

    wide = (0.5, 0.05, -0.5), (10.0, 1.5, 1.5)
    found = least_squares(away, ROUGH[:3], bounds=wide, diff_step=1e-3, xtol=1e-6)
    return np.append(found.x, LEAN)


def tips_of(body: Solid, size: Dimensions) -> dict[str, Any]:
    """Return what a TOML says of the contact points, by ascending axial place."""
    share = np.linspace(-0.5, 0.5, POINTS)
    wanted = section(size, np.zeros(POINTS), np.ones(POINTS), share).T
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


def reduced(folder: Path, body: Solid, size: Dimensions = FOUND) -> dict[str, Path]:
    """Write the engine files of both models; return {model: file}."""
    files = {"all": folder / "rotor.h5", "modes": folder / "modes.h5"}
    blade = {"blades": 1, "modes": MODES, "held": body.held.tolist()}
    for name in ("mass", "stiffness"):
        sparse.save_npz(folder / f"{name}.npz", getattr(body, name))
        blade[name] = f"{name}.npz"
    document = {"wheel": blade, "tips": tips_of(body, size)}
    toml = folder / "blade.toml"
    toml.write_text(tomli_w.dumps(document), encoding="utf-8")
    with contextlib.redirect_stdout(io.StringIO()):
        if hpcwhirl(["import-model", str(toml), "--out", str(files["all"])]):
            raise SystemExit(2)
    whole = blade_of(files["all"])
    squared, shapes = scipy.linalg.eigh(whole.stiffness, whole.mass)
    shapes = shapes[:, :MODES]
    with h5py.File(files["all"]) as file:
        beside = {n: file[f"rotor/{n}"][()] for n in ("tip_station", "tip_angle")}
    beside |= {
        "omega": np.sqrt(squared[:MODES]),
        "modal_tip_radial": (whole.radial @ shapes)[None],
        "modal_tip_tangential": (whole.along @ shapes)[None],
    }
    with h5py.File(files["modes"], "w") as file:
        for name, array in beside.items():
            file[f"rotor/{name}"] = array
    return files


def blade_of(path: Path) -> Blade:
    """Return the blade of an engine's file, as the oracle takes it."""
    with h5py.File(path) as file:
        given = {name: array[()] for name, array in file["rotor"].items()}
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
        "engine.casing.profile": f"harmonic,amplitude,phase;{rows}",
        "speed": SPEED, "gap": GAP, "friction": FRICTION, "force": 0.0,
        "duration": revolutions * TURN, "time_step": TURN / SAMPLES / step,
        "interval": TURN / SAMPLES, "traces": "full",
    }  # fmt: skip


def upright(folder: Path) -> str:
    """Return what becomes of the blade without its lean."""
    folder.mkdir(exist_ok=True)
    size = [*FOUND[:3], 0.0]
    path = reduced(folder, solid(size), size)["all"]
    given = settings(path, STEPS["all"], 3.0)
    history = March(resolve(apply_settings(Scene(), given))).run()
    ends = 1e3 * np.abs(history.point_tips[-1, 0, [0, -1]]).max(axis=-1)
    return (
        f"Without the lean the same blade ends by `{history.stop}` after "
        f"{history.end / TURN:.2f} revolutions: its first and last point have moved by "
        f"{ends[0]:.2g} and {ends[1]:.2g} mm, since friction pushes one end of the "
        "chord outward, the more the more it presses.\n"
    )


def marched(
    file: Path, step: int, revolutions: float
) -> tuple[March, np.ndarray, float]:
    """Return hpcwhirl's march at its end, points (s, n_c, 2), m, and seconds of CPU.

    The seconds include reading the history, not compiling.
    """
    case = resolve(apply_settings(Scene(), settings(file, step, revolutions)))
    first = March(case)
    first.warm()
    first.history()
    run, begun = March(case), time.process_time()
    history = run.run()
    spent = time.process_time() - begun
    if history.stop != "end":
        raise SystemExit(f"the run stopped: {history.stop}")
    return run, history.point_tips[:, 0], spent


def oracle(
    file: Path, step: int, revolutions: float, gap: Callable[..., np.ndarray]
) -> tuple[Rub, float]:
    """Return the same by full matrices, and seconds of CPU."""
    size, count = TURN / SAMPLES / step, round(revolutions * SAMPLES) * step
    blade, begun = blade_of(file), time.process_time()
    found = march(blade, gap, Turning(SPEED, FRICTION, size, count, step))
    return found, time.process_time() - begun


def apart(points: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Return the largest difference up to each sample, over the largest of all."""
    away = np.abs(points - others).max(axis=(1, 2))
    return np.maximum.accumulate(away) / np.abs(others).max()


def reach(away: np.ndarray, level: float) -> str:
    """Return how many revolutions a difference stays within a level."""
    if away[-1] <= level:
        return f"all {len(away) / SAMPLES:g}"
    return f"{int(np.argmax(away > level)) / SAMPLES:.1f}"


def sizes(points: np.ndarray) -> list[str]:
    """Return maximum and rms, mm, of both ends of the chord, radial and along."""
    ends = 1e3 * points[:, [0, -1]].reshape(-1, 4)
    most, mean = np.abs(ends).max(axis=0), np.sqrt((ends**2).mean(axis=0))
    return [f"{a:.4f}, {b:.4f}" for a, b in zip(most, mean, strict=True)]


def compared(files: dict[str, Path], revolutions: float) -> list[str]:
    """March both models at three steps by both programs; return tables' lines.

    The longest step by an oracle with the casing's formula, too.
    """
    moved, agree, cost = [], [], []
    length = revolutions * TURN
    for model, path in files.items():
        for halving in HALVINGS:
            step = STEPS[model] * halving
            run, points, spent = marched(path, step, revolutions)
            found = {"harmonics": oracle(path, step, revolutions, by_harmonics())}
            if halving == 1:
                found["formula"] = oracle(path, step, revolutions, clearance)
            name = [model, f"{step * SAMPLES}", f"{TURN / SAMPLES / step:.3g}"]
            impulse, told = float(run.state.impulse.sum()), int(run.counter[1])
            moved.append([*name, "hpcwhirl", *sizes(points), f"{impulse:.6f}", told])
            for kind, (other, _) in found.items():
                beside = f"{other.impulse.sum():.6f}", other.touchdowns
                moved.append([*name, f"oracle, {kind}", *sizes(other.points), *beside])
                away = apart(points, other.points)
                first = away[min(SAMPLES, len(away)) - 1]
                row = [*name, kind, f"{first:.1e}", f"{away[-1]:.1e}"]
                agree.append(row + [reach(away, level) for level in LEVELS])
            seconds = found["harmonics"][1]
            each = spent / length, seconds / length
            cost.append([*name, *(f"{s:.1f}" for s in each), f"{seconds / spent:.0f}"])
            print(moved[-1], agree[-1], cost[-1], sep="\n", flush=True)
    who = ["model", "steps a revolution", "step, s"]
    ends = [f"{e}, {d}" for e in ("first", "last") for d in ("radial", "along")]
    within = [f"within {level:g}, revolutions" for level in LEVELS]
    return [
        "Displacements of the chord's first and last point, mm: maximum, rms.\n",
        *table([*who, "by", *ends, "impulse, N s", "touchdowns"], moved),
        "\nLargest difference of any point from the oracle, over the largest move.\n",
        *table([*who, "oracle's casing", "1 revolution", "all", *within], agree),
        "\nSeconds of the processor for a simulated second, on a loaded machine.\n",
        *table([*who, "hpcwhirl", "oracle", "oracle / hpcwhirl"], cost),
    ]


def blade_lines(body: Solid, files: dict[str, Path]) -> list[str]:
    """Return a table of the frequencies of the blade and of its models, Hz."""
    whole, rows = frequencies(body), []
    for number, (own, wanted) in enumerate(zip(whole, PUBLISHED, strict=True)):
        kept = [hertz_of(path)[number] for path in files.values()]
        rows.append([f"{wanted}", f"{own:.2f}", f"{100 * (own / wanted - 1):+.3f} %"])
        rows[-1] += [f"{f:.2f}" for f in kept]
    head = ["published, Hz", "all unknowns", "off", *files]
    least = 2 / (2 * math.pi * hertz_of(files["all"])[-1])
    thick, taper, twist, lean = FOUND
    worst = []
    for model, path in files.items():
        size = TURN / SAMPLES / STEPS[model]
        gives = compliance(blade_of(path), FRICTION, size)[-1]
        worst.append(f"{np.linalg.cond(gives):.1e} of `{model}`")
    told = (
        f"Titanium, {len(body.axis)} unknowns, {len(body.held)} of them clamped; "
        f"{thick} mm thick at the root, {taper} of that at the tip, twisted by "
        f"{twist} rad, leaning by {lean} rad. Model `all` has {2 * POINTS + MODES} "
        f"coordinates and is stable below {least:.2g} s, {TURN / least:.0f} steps a "
        f"revolution; `modes` has the {MODES} lowest modes. The "
        f"compliance of the points has the condition number {' and '.join(worst)}, "
        "whose points are nearly dependent: what each of them carries is then known "
        "to as many digits less.\n"
    )
    return [told, *table(head, rows), ""]


def hertz_of(path: Path) -> np.ndarray:
    """Return the frequencies of an engine's file, Hz."""
    blade = blade_of(path)
    squared = scipy.linalg.eigh(blade.stiffness, blade.mass, eigvals_only=True)
    return np.sqrt(squared) / (2 * math.pi)


def casing_line() -> str:
    """Return what the harmonics of the casing miss."""
    angle = np.linspace(0.0, math.pi, 10001)
    away = np.abs(by_harmonics()(angle) - clearance(angle)) / GAP
    return (
        f"The casing's {HIGHEST // 2 + 1} harmonics miss its formula, which has a kink "
        f"where the lobes meet, by {away.max():.1e} of {1e3 * GAP} mm there, and by "
        f"{away[1000:-1000].max():.1e} beyond 18 degrees from it.\n"
    )


def main() -> None:
    """Compare, print, write."""
    parser = parser_of(__doc__, write=PAGE, folder="?")
    parser.add_argument("--revolutions", type=float, default=50)
    parser.add_argument("--identify", action="store_true", help="find the plate")
    args = parser.parse_args()
    if args.identify:
        size = identified()
        print(
            "thickness, mm; tip over root; twist, lean, rad:",
            *(f"{s:.6g}" for s in size),
        )
        print("Hz:", frequencies(solid(size)), "published:", PUBLISHED)
        return
    with working_folder(args.folder, "rotor37") as folder:
        body = solid()
        files = reduced(folder, body)
        lines = [f"{args.revolutions:g} revolutions of {TURN:.6f} s.\n"]
        lines += blade_lines(body, files)
        lines += [upright(folder / "upright"), casing_line()]
        lines += compared(files, args.revolutions)
    tell("\n".join(lines), PAGE if args.write else None)


if __name__ == "__main__":
    main()
