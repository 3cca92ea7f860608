"""Contact against exact answers: bars that bounce, strike each other, are pressed.

    python scripts/evidence/bars.py

drop : bars fall from a height on a rigid floor (Doyen, Ern, Piperno 2011, section 3),
    written in the falling frame, where the rigid casing rises with g
two bars : a free bar in the casing's place, brought to speed by the pulse as a body
    force, strikes the bars of the rotor; the bars exchange velocities
clamped : bars clamped at the far end and pressed by a wall that moves in and stays

Every run is a `March` with a scheme of engines. The step is refined alone, then with
the mesh at a fixed Courant number c dt / h, h the element's length; then the schemes.
Columns (of blade 0; None where a rig has no such thing):

impulse     error of the impulse at the end
contact     error of the contact's duration, over T = 2 L / c
rebound     error of the bars' relative velocity after release
end         largest error of the end's displacement, over the way it goes
drag        the same of the mass that friction drags along
force       rms error of the multiplier over the rms of the exact force
peak        largest multiplier over the largest exact force
touch       first two multipliers times dt over the momentum of the ends' masses
loss        lost in impacts over the kinetic energy of arrival
expected    the same over that of the ends' masses
touched     touchdowns
residual    of the ledger, over its largest term
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from hpcwhirl.dynamics.history import History
from hpcwhirl.dynamics.march import March

sys.path.insert(0, str(Path(__file__).parents[1]))
from common import parser_of, table
from evidence.bar_rigs import RIGS, Bar, Floats, Rig, Slider, march_of

FRICTION, SPEED = 0.3, 1.0  # mu and rad/s: the bars slide along the wall
FIXED = 100  # elements where the step alone is refined
COURANT = 0.5  # where step and mesh are refined together
COUNT = 6  # refinements
COLUMNS = (
    "impulse", "contact", "rebound", "end", "drag", "force", "peak", "touch", "loss",
    "expected", "touched", "residual",
)  # fmt: skip
FITTED = ("impulse", "rebound", "end", "drag", "force", "loss")
Row = dict[str, Any]


def mass_centres(march: March, bar: Bar) -> tuple[float, float]:
    """Return mean displacements of blade 0's bar and of the casing's, m, outward."""
    rotor, casing = march.displacements()
    # r^T M x / m: the rigid motion r is 1 on the tip alone in reduced coordinates
    own = float(march.model.rotor.mass[0] @ rotor) / bar.mass
    ring = march.model.ring
    return own, float(ring.lobes(0) @ casing) if ring else 0.0


def mean_velocities(march: March, bar: Bar, steps: int) -> tuple[float, float]:
    """March to the end; return m/s of `mass_centres` over the last steps."""
    march.advance(march.total - steps - march.steps)
    before = mass_centres(march, bar)
    march.run()
    after = mass_centres(march, bar)
    time = steps * march.scene.solver.time_step
    return (after[0] - before[0]) / time, (after[1] - before[1]) / time


def multipliers(history: History) -> Floats:
    """Return the multiplier of blade 0 in each step, N; it acts at the step's start."""
    impulse = np.diff(history.blade_impulse[:, 0], prepend=0.0)
    return np.asarray(impulse / history.interval)


def apart(found: Floats, exact: Floats) -> float:
    """Return the largest difference over the largest exact value."""
    return float(np.abs(found - exact).max() / np.abs(exact).max())


def of_motion(rig: Rig, history: History) -> Row:
    """Return the columns that every rig has."""
    time, step, push = history.time, history.interval, multipliers(history)
    force, ledger = rig.force(time - step), dict(history.ledger)
    impulse = rig.impulse(time[-1:] - step / 2)[0]  # forces act at t = 0 .. t_end - dt
    residual = abs(ledger.pop("residual"))
    return {
        "impulse": float(history.blade_impulse[-1, 0] / impulse - 1.0),
        "end": apart(history.tips[:, 0, 0], rig.end(time)),
        "force": float(np.sqrt(((push - force) ** 2).mean() / (force**2).mean())),
        "peak": float(push.max() / force.max()),
        "touched": int(history.contacts // history.blade_impulse.shape[1]),
        "residual": residual / max(map(abs, ledger.values())),
    }


def of_impact(rig: Rig, history: History, rebound: float) -> Row:
    """Return the columns of bars that touch and part; rebound, m/s."""
    step, push = history.interval, multipliers(history)
    held = np.flatnonzero(push)
    lasted = (held[-1] - held[0] + 1) * step
    energy = 0.5 * rig.bar.mass * rig.arrival**2 * history.blade_impulse.shape[1]
    loss = history.ledger["impact"] / energy
    drag = rig.dragged(Slider(), FRICTION, history.time)
    return {
        "contact": float(lasted - (rig.release - rig.touch)) / rig.bar.passage,
        "rebound": rebound / rig.rebound - 1.0,
        "drag": apart(history.tips[:, 0, 1], drag),
        "touch": float(push[held[0] : held[0] + 2].sum())
        * step
        / (rig.end_mass * rig.arrival),
        "loss": loss,
        "expected": loss * rig.bar.mass / rig.end_mass,
    }


def measure(
    name: str, elements: int, courant: float, scheme: str = "general", series: str = ""
) -> Row:
    """Return a run beside its exact answer: what it is, then `COLUMNS`."""
    rig = RIGS[name](elements)
    step = courant * rig.bar.length / (elements * rig.bar.wave_speed)
    blades = 3 if scheme in {"modal", "exact"} else 1
    turning = {"friction": FRICTION, "speed": SPEED}
    march = march_of(rig, step, scheme, blades, **turning)
    late = round(rig.bar.passage / 4 / step)
    own, others = mean_velocities(march, rig.bar, late)
    history = march.history()
    row = {
        "rig": name, "series": series, "scheme": scheme, "elements": elements,
        "time_step": step, "courant": courant,
    }  # fmt: skip
    row |= dict.fromkeys(COLUMNS) | of_motion(rig, history)
    if rig.release < rig.duration:
        wall = others if rig.casing else rig.wall_speed
        row |= of_impact(rig, history, abs(own - wall))
    return row


def rows_of(name: str) -> Iterator[Row]:
    """Yield the runs of a rig."""
    for n in range(COUNT):
        yield measure(name, FIXED, COURANT / 2**n, series="step")
    for n in range(COUNT):
        yield measure(name, 25 * 2**n, COURANT, series="step and mesh")
    schemes = ["general", "paper"]
    if name != "two bars":  # a ring of harmonic 0 has two modes there
        schemes += ["modal", "exact"]
    for scheme in schemes:
        # 51: as many modes as the free bar of 50 has, hence the same compiled kernel
        yield measure(name, 50 + (name == "clamped"), COURANT / 4, scheme, "scheme")


def order(errors: Floats) -> float:
    """Return the observed order of errors whose steps halve, by least squares."""
    places = np.arange(len(errors))
    return float(-np.polyfit(places, np.log2(np.abs(errors)), 1)[0])


def orders(rows: list[Row], series: str) -> dict[str, float]:
    """Return the observed order of each column of `FITTED`.

    With the mesh: of the error. Of the step alone: of the change from row to row, since
    what remains is the mesh's.
    """
    own, out = [row for row in rows if row["series"] == series], {}
    for column in FITTED:
        if any(row[column] is None for row in own):
            continue
        errors = np.array([row[column] for row in own])
        errors = np.diff(errors) if series == "step" else errors
        if np.abs(errors).min() > 1e-12:
            out[column] = order(errors)
    return out


def show(name: str, rows: list[Row]) -> None:
    """Print the table of a rig."""
    print(f"{name}\n")
    start = ("scheme", "elements", "courant")
    cells = ([f"{row[c]:.3g}" if isinstance(row[c], float) else row[c]
              for c in (*start, *COLUMNS)] for row in rows)  # fmt: skip
    print(*table(("scheme", "elements", "c dt/h", *COLUMNS), cells), sep="\n")
    for series in ("step", "step and mesh"):
        found = orders(rows, series)
        told = ", ".join(f"{column} {value:.2f}" for column, value in found.items())
        print(f"observed order in {series}: {told}")


def main() -> None:
    """Print the tables."""
    parser_of(__doc__).parse_args()
    for name in RIGS:
        show(name, list(rows_of(name)))


if __name__ == "__main__":
    main()
