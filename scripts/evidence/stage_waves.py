"""The solid stage of jobs/stage.py: its reduced waves beside those of all unknowns.

    python scripts/evidence/stage_waves.py FOLDER [--coarse] [--modes N] [--write]

What is missing in the folder (mesh, matrices, rotor reduced to N fixed-interface modes
a nodal diameter) is made first. Compared are the three lowest waves of each direction,
of nodal diameters 0 to 3 and N / 2, at rest, at the first speed of the file and at one
that is not in it. Those of all unknowns are of the tangent in the equilibrium at that
speed; reduced ones are by nodal diameter, as they are marched, undamped. At rest the
lowest wave may be 1e-6 apart, others 1e-4, at speed all 1e-3; the exit code is 1 if one
is farther.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
sys.path.insert(0, str(Path(__file__).parents[2] / "jobs"))
import stage
from common import parser_of, table, with_section
from scipy import sparse

from hpcwhirl.case.resolve import resolve
from hpcwhirl.dynamics.point_sectors import nearly_equal
from hpcwhirl.dynamics.turning_waves import roots_of
from hpcwhirl.reduction.model import Model
from hpcwhirl.reduction.modes import stiffening_at
from hpcwhirl.scene import Scene, apply_settings

PAGE = Path(__file__).with_suffix(".md")
DIAMETERS = 0, 1, 2, 3, stage.BLADES // 2
BETWEEN = 300.0  # rad/s, a speed that is not in the file
COUNT = 6  # waves of a nodal diameter, three of each direction
LOWEST, AT_REST, AT_SPEED = 1e-6, 1e-4, 1e-3  # relative, largest differences allowed
Row = tuple[float, int, Any, float, float]  # rad/s, k, rad/s, differences


def model_of(rotor: Path) -> Model:
    """Return the model of a reduced rotor with terms of rotation."""
    given = {"file": str(rotor), "rotation": "full", "suspension_damping": -1.0}
    shape = {"blades": stage.BLADES, "radius": stage.TIP}
    return resolve(apply_settings(Scene(), given | shape)).model


def marched(model: Model, k: int, speed: float) -> Any:
    """Return the frequencies of the reduced waves of a nodal diameter, rad/s."""
    body, sectors = model.rotor, nearly_equal(model)
    if sectors is None or body.spin is None:
        raise SystemExit("the sectors of the reduced rotor are not equal")
    block = body.shapes @ sectors.blocks[k]
    turned = 2 * speed * body.spin.coriolis, stiffening_at(body.spin, speed)
    mass, gyro, stiffness = (
        block.conj().T @ a @ block
        for a in (body.mass, turned[0], body.stiffness + turned[1])
    )
    omega = roots_of(mass, gyro, stiffness)[0].imag
    return np.sort(omega[np.argsort(np.abs(omega))][:COUNT])


def rows_of(
    body: stage.Sector, model: Model, tangent: Callable[[float], sparse.csr_array]
) -> Iterator[Row]:
    """Yield what is compared, speed by speed."""
    for speed in (0.0, BETWEEN, stage.SPEEDS[0]):
        own = tangent(speed)
        for k in DIAMETERS:
            truth = body.frequencies(own, k, speed, COUNT)
            apart = np.abs(marched(model, k, speed) / truth - 1)
            first = np.abs(truth).argmin()
            yield speed, k, truth, float(apart[first]), float(apart.max())


def allowed(row: Row) -> bool:
    """Return whether a row's differences are small enough."""
    speed, _, _, first, most = row
    return most <= AT_SPEED if speed else first <= LOWEST and most <= AT_REST


def page(rows: list[Row], unknowns: int, coordinates: int, call: str) -> str:
    """Return the comparison as Markdown."""
    head = "rad/s", "k", "ω, rad/s", "lowest, apart", "all, apart"
    lines = [
        [f"{speed:g}", k, ", ".join(f"{w:.2f}" for w in truth), f"{first:.1e}",
         f"{most:.1e}" + " ✗" * (not allowed(row))]
        for row in rows for speed, k, truth, first, most in [row]
    ]  # fmt: skip
    good = sum(map(allowed, rows))
    return "\n".join([
        f"## `{call}`", "",
        f"{unknowns} unknowns a sector, reduced to {coordinates} coordinates of the",
        "rotor. Frequencies of all unknowns, backward ones negative, and how far the",
        "reduced ones are from them, relative.", "",
        *table(head, lines), "",
        f"Within {LOWEST:g} (lowest wave) and {AT_REST:g} at rest, {AT_SPEED:g}",
        f"at speed: {good} of {len(rows)} (✗: not).", "",
    ])  # fmt: skip


def main() -> None:
    """Make, compare and print."""
    parser = parser_of(__doc__, write=PAGE, folder="")
    parser.add_argument("folder", type=Path)
    parser.add_argument("--coarse", action="store_true", help="of the small mesh")
    each = stage.MODES // stage.BLADES
    parser.add_argument("--modes", type=int, default=each, help="of a diameter")
    args = parser.parse_args()
    grid = stage.COARSE if args.coarse else stage.FINE
    model = model_of(stage.reduced(args.folder, grid, args.modes * stage.BLADES))
    body = stage.Sector(*stage.sector_mesh(grid))
    rows = list(rows_of(body, model, body.turning))
    call = f"python scripts/evidence/{Path(__file__).name} FOLDER"
    call += " --coarse" * args.coarse + f" --modes {args.modes} --write"
    told = page(rows, len(body.load), len(model.rotor.mass), call)
    print(told)
    if args.write:
        PAGE.write_text(with_section(PAGE.read_text("utf-8"), told), encoding="utf-8")
    sys.exit(not all(map(allowed, rows)))


if __name__ == "__main__":
    main()
