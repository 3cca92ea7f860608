#!/usr/bin/env python3
"""Rotors of rotor dynamicists: hpcwhirl beside ROSS, published numbers, closed forms.

    python scripts/evidence/rotors.py [--write] [--ross FOLDER]

ROSS 2.3.0 needs an older plotly than hpcwhirl: it gets a virtual environment of its
own, FOLDER (.venv-ross), made by the first run with pip. ROSS builds the rotors of
`rotor_table.py` and saves them (`rotors_of_ross.py`); hpcwhirl reads these files as
`engine.shaft` does, with bearings that differ by direction.
--write writes the page `agreement.md` of the manual. Exits 1 if a difference exceeds
`MOST`.
"""

from __future__ import annotations

import argparse
import json
import math
import subprocess
import sys
import tempfile
import venv
from pathlib import Path
from string import Template
from typing import Any, NamedTuple

import numpy as np
from rotor_table import FAN, HELD, ROTORS, RPM, STEEL, disk, nelson_mcvaugh

from hpcwhirl.analysis.response import moving_mass
from hpcwhirl.case.resolve import resolve
from hpcwhirl.reduction.shaft_whirl import (
    held_by,
    undamped_critical_speeds,
    whirl_matrices,
    whirls,
)
from hpcwhirl.reduction.waves import wave_lines
from hpcwhirl.scene import Scene, apply_settings
from hpcwhirl.scene.shaft_tables import KEPT, parsed, text_of
from hpcwhirl.structure.shaft import (
    GROUND,
    NODE,
    LineSupport,
    ShaftDisk,
    ShaftLine,
    Tube,
    line_of,
)

TOP = Path(__file__).parents[2]
PAGE = TOP / "hpcwhirl/manual/agreement.md"
TEMPLATE = Path(__file__).with_suffix(".template")
THEIRS = Path(__file__).with_name("rotors_of_ross.py")
PINNED = "ross-rotordynamics==2.3.0", "plotly<6"
MOST = 1e-4  # relative difference where the models are the same
STIFFER = 1.0, 10.0, 100.0, 1e4  # Young's modulus of blades over steel's
PLAY, WEIGHT = 1e-4, 9.81  # m, clearance of journals; m/s^2
RESTS = 0.1, 0.3, 0.5, 0.7  # eps of the journals at the onset of oil whirl
LOWEST = 6  # free motions compared at each speed


class Compared(NamedTuple):
    """Largest relative differences of a rotor between hpcwhirl and ROSS.

    Attributes
    ----------
    lowest : rad/s, lowest frequency at each speed, of both
    roots : of the roots s of the `LOWEST` free motions, frequency and growth
    circles : of the circles, forward and backward, of an unbalance, over the larger
    """

    lowest: list[tuple[float, float]]
    roots: float
    circles: float


def line_of_data(rotor: dict[str, Any]) -> ShaftLine:
    """Return the shaft line of plain data, without pedestals."""
    tubes = tuple(
        Tube(
            t["length"], tuple(t["outer"]), tuple(t["inner"]), t["young"], t["density"],
            t["shear"] if t["sheared"] else math.inf, t["poisson"], t["rotary"],
        )
        for t in rotor["tubes"]
    )  # fmt: skip
    supports = tuple(
        LineSupport(NODE * b["node"], GROUND, tuple(map(tuple, b["rows"])))
        for b in rotor["bearings"]
    )
    disks = tuple(ShaftDisk(**d) for d in rotor["disks"])
    return ShaftLine(tubes, disks, supports=supports)


def line_of_file(path: Path) -> ShaftLine:
    """Return the shaft line of a rotor that ROSS saved, as `engine.shaft` reads it."""
    return line_of(text_of(parsed(path), path.name, KEPT))


def circle_of(
    line: ShaftLine, node: int, unbalance: float, speed: float
) -> tuple[float, float]:
    """Return the forward and the backward circle at the node of an unbalance, m."""
    own, n, s = whirl_matrices(line, held_by(line), speed), line.size, 1j * speed
    load = np.zeros(2 * n)
    load[NODE * node] = unbalance * speed**2
    moved = np.linalg.solve(s**2 * own.mass + s * own.damping + own.stiffness, load)
    return abs(moved[NODE * node]), abs(moved[n + NODE * node])


def compared(given: dict[str, Any], theirs: dict[str, Any]) -> Compared:
    """Return how hpcwhirl and ROSS differ on one rotor."""
    node, size = given["unbalance"]
    lowest, apart, circles = [], 0.0, 0.0
    line = line_of_file(Path(theirs["file"]))
    for place, speed in enumerate(given["speeds"]):
        found = [w.root for w in whirls(line, held_by(line), speed)][:LOWEST]
        other = np.array([complex(*root) for root in theirs["roots"][place]])
        near = [other[np.abs(other - root).argmin()] for root in found]
        apart = max(apart, *(abs(a / b - 1) for a, b in zip(near, found, strict=True)))
        lowest.append((found[0].imag, near[0].imag))
        own = np.array(circle_of(line, node, size, speed))
        miss = np.abs(own - theirs["circles"][place]).max() / own.max()
        circles = max(circles, float(miss))
    return Compared(lowest, float(apart), circles)


def fan(stiffer: float) -> Scene:
    """Return the overhung fan with nine blades in place of the rigid disk."""
    line = text_of(
        {
            "young": STEEL["young"], "density": STEEL["density"],
            "shear": STEEL["shear"],
            "sections": [{"length": 0.6, "outer": 0.05, "elements": 6},
                         {"length": 0.4, "outer": 0.05, "elements": 4}],
            "bearings": [{"station": i, "kxx": 1e8, "cxx": 2e3} for i in (0, 1)],
        },
        "fan",
    )  # fmt: skip
    own = {
        "rotation": "full", "blades": 9, "rotor.elements": 4, "modes": 36,
        "shaft": line, "shaft_station": 2, "shaft_modes": 12, "polar_inertia": 3.0,
        "tilt_inertia": 1.5, "rotor.damping": 0.0, "suspension_damping": -1.0,
        "rotor.young": 2.1e11 * stiffer, "speed": 300.0, "harmonics": 5,
    }  # fmt: skip
    return apply_settings(Scene(), own)


def fan_as_disk() -> dict[str, Any]:
    """Return the same fan with its blades as a rigid disk, for ROSS."""
    mass = moving_mass(fan(1.0)) - sum(
        math.pi / 4 * t["outer"][0] ** 2 * t["length"] * t["density"] for t in FAN
    )
    rotor = {"tubes": FAN, "disks": [disk(10, mass, 3.0, 1.5)], "bearings": HELD}
    return {"rotor": rotor, "speeds": [300.0], "unbalance": [10, 1e-3]}


def fan_apart(stiffer: float, theirs: dict[str, Any]) -> tuple[float, float]:
    """Return the lowest frequency of the fan, and how its shaft's differ from ROSS.

    They are rad/s, static frame, and the largest relative difference of the two lowest.
    """
    model = resolve(fan(stiffer)).model
    lines = [w for w in wave_lines(model.rotor, 9, 300.0) if w.nodal_diameter == 1]
    own = sorted(complex(w.growth, abs(w.static)).imag for w in lines)
    other = sorted(f for _, f in theirs["roots"][0] if f > 1.0)[:2]
    return own[0], max(min(abs(w / f - 1) for w in own) for f in other)


def threshold() -> tuple[float, float]:
    """Return the speed from which internal damping makes a Jeffcott rotor grow, rad/s.

    By hpcwhirl, and in closed form, omega (1 + c / c_i).
    """
    from scipy.optimize import brentq

    length, d, mass, viscous, outside = 1.0, 0.03, 20.0, 2e-4, 150.0
    part = Tube(length / 8, (d, d), (0.0, 0.0), 2.11e11, 10.0, math.inf, 0.3)
    held = (0, 1e12), (4, 0.0), (8, 1e12)
    supports = tuple(
        LineSupport(NODE * node, -1, ((0.0, k, 0, 0, k, c, 0, 0, c),))
        for (node, k), c in zip(held, (0.0, outside, 0.0), strict=True)
    )
    line = ShaftLine((part,) * 8, (ShaftDisk(4, mass),), viscous=viscous,
                     supports=supports)  # fmt: skip
    stiffness = 48 * 2.11e11 * math.pi * d**4 / 64 / length**3
    omega = math.sqrt(stiffness / mass)
    onset = omega * (1 + outside / (viscous * stiffness))

    def growth(speed: float) -> float:
        near = whirls(line, held_by(line), speed)
        return max(w.growth for w in near if w.frequency < 2 * omega)

    return float(brentq(growth, 0.9 * onset, 1.1 * onset)), onset


def published_onset(eps: float) -> tuple[float, float]:
    """Return Omega sqrt(c / g) at the onset of oil whirl, and the whirl over Omega.

    They are those of a rigid rotor on two short journal bearings at rest at eps: the
    published coefficients K c / W and C c Omega / W, along the load and across it
    (D. Childs, Turbomachinery Rotordynamics, 1993, ch. 3), and Routh's condition for
    two coordinates.
    """
    two, root = math.pi**2, math.sqrt(1 - eps**2)
    q = (two * (1 - eps**2) + 16 * eps**2) ** -1.5
    rest = two + (32 + two) * eps**2 + 2 * (16 - two) * eps**4
    damped = two + 2 * (two - 8) * eps**2
    xx = 4 * q * (2 * two + (16 - two) * eps**2)
    across = two - 2 * two * eps**2 - (16 - two) * eps**4
    xy = math.pi * q * across / (eps * root)
    yx, yy = -math.pi * q * rest / (eps * root), 4 * q * rest / (1 - eps**2)
    cxx, cxy = 2 * math.pi * q * root * damped / eps, -8 * q * damped
    cyy = 2 * math.pi * q * (two + 2 * (24 - two) * eps**2 + two * eps**4)
    cyy /= eps * root
    held = (xx * cyy + yy * cxx - (xy + yx) * cxy) / (cxx + cyy)
    ratio = ((xx - held) * (yy - held) - xy * yx) / (cxx * cyy - cxy**2)
    return math.sqrt(held / ratio), math.sqrt(ratio)


def in_journals(viscosity: float, speed: float) -> Scene:
    """Return a nearly rigid rotor, with its weight, on two journal bearings."""
    journal = {
        "journal_viscosity": viscosity, "journal_length": 0.03,
        "journal_radius": 0.05, "journal_clearance": PLAY,
    }  # fmt: skip
    line = text_of(
        {
            "young": 5e12, "density": 780.0,
            "sections": [{"length": 0.3, "outer": 0.2, "elements": 1}] * 2,
            "bearings": [{"station": i, **journal} for i in (0, 2)],
        },
        "rotor",
    )  # fmt: skip
    own = {
        "rotation": "full", "blades": 8, "rotor.elements": 1, "modes": 24,
        "shaft": line, "shaft_station": 1, "shaft_modes": 4, "polar_inertia": 1e-6,
        "tilt_inertia": 1.6, "rotor.damping": 0.0, "suspension_damping": -1.0,
        "rotor.young": 1e15, "speed": speed, "harmonics": 4, "gravity": WEIGHT,
    }  # fmt: skip
    return apply_settings(Scene(), own)


def oil_whirl(eps: float) -> tuple[float, float, float, float]:
    """Return the onset of oil whirl, rad/s, and the whirl over Omega; published, own.

    The viscosity is that with which the journals rest at eps at the published onset.
    """
    from scipy.optimize import brentq

    scaled, ratio = published_onset(eps)
    onset = scaled * math.sqrt(WEIGHT / PLAY)
    shape = math.sqrt(16 * eps**2 + math.pi**2 * (1 - eps**2))
    load = moving_mass(in_journals(0.01, onset)) * WEIGHT / 2
    film = load * 4 * PLAY**2 * (1 - eps**2) ** 2 / (onset * eps * shape)
    model = resolve(in_journals(film / (0.05 * 0.03**3), onset)).model

    def fastest(speed: float) -> Any:
        found = wave_lines(model.rotor, 8, speed)
        return max((w for w in found if w.nodal_diameter == 1), key=lambda w: w.growth)

    own = float(brentq(lambda v: fastest(v).growth, 0.9 * onset, 1.1 * onset))
    return onset, ratio, own, abs(fastest(own).static) / own


def of_ross(folder: Path, given: dict[str, Any], scratch: str) -> dict[str, Any]:
    """Return what ROSS says of rotors; its environment is made if it is missing.

    scratch : folder where it saves them
    """
    python = folder / "bin/python"
    if not python.exists():
        venv.create(folder, with_pip=True)
        subprocess.run([python, "-m", "pip", "install", "-q", *PINNED], check=True)
    names = [Path(scratch) / name for name in ("given.json", "found.json")]
    names[0].write_text(json.dumps(given))
    subprocess.run([python, THEIRS, *names], check=True, capture_output=True)
    found: dict[str, Any] = json.loads(names[1].read_text())
    return found


def criticals() -> list[tuple[str, float, float]]:
    """Return critical speeds of Nelson and McVaugh: name, own, published, rpm."""
    line = line_of_data(nelson_mcvaugh(kxx=4.378e7))
    ways = undamped_critical_speeds(line, held_by(line))
    published = {"forward": (17159, 49983, 96457), "backward": (15470, 46612, 64752)}
    return [
        (f"{way}, {number}", float(speed) * RPM, float(theirs))
        for (way, others), found in zip(published.items(), ways, strict=True)
        for number, (speed, theirs) in enumerate(zip(found, others, strict=False), 1)
    ]


def page_of(found: dict[str, Any], rows: dict[str, Compared]) -> str:
    """Return the page of the manual."""
    own, closed = threshold()
    text = Template(TEMPLATE.read_text(encoding="utf-8"))
    return text.substitute(
        version=found["fan"]["version"], lowest=LOWEST, most=f"{MOST:g}",
        own=f"{own:.4f}", closed=f"{closed:.4f}", apart=f"{abs(own / closed - 1):.1e}",
        lines="\n".join(_line(name, one) for name, one in rows.items()),
        criticals="\n".join(
            f"| {name} | {own:.0f} | {theirs:.0f} | {own / theirs - 1:+.2%} |"
            for name, own, theirs in criticals()
        ),
        journals="\n".join(map(_onset, RESTS)),
        fan="\n".join(
            f"| {stiffer:g} | {lowest:.4f} | {apart:.1e} |"
            for stiffer in STIFFER
            for lowest, apart in [fan_apart(stiffer, found["fan"])]
        ),
    )  # fmt: skip


def _line(name: str, own: Compared) -> str:
    speeds = ", ".join(f"{v:g}" for v in np.round(ROTORS[name]["speeds"], 2))
    lowest = ", ".join(f"{a:.4f}" for a, _ in own.lowest)
    return f"| {name} | {speeds} | {lowest} | {own.roots:.1e} | {own.circles:.1e} |"


def _onset(eps: float) -> str:
    theirs, ratio, own, turns = oil_whirl(eps)
    found = f"{theirs:.2f} | {own:.2f} | {own / theirs - 1:+.1e}"
    return f"| {eps:g} | {found} | {ratio:.4f} | {turns:.4f} |"


def main() -> int:
    """Compare all rotors, print or write the page; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--write", action="store_true", help=f"write {PAGE.name}")
    parser.add_argument(
        "--ross", type=Path, default=TOP / ".venv-ross", metavar="FOLDER"
    )
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as scratch:
        found = of_ross(args.ross, ROTORS | {"fan": fan_as_disk()}, scratch)
        rows = {name: compared(one, found[name]) for name, one in ROTORS.items()}
    page = page_of(found, rows)
    if args.write:
        PAGE.write_text(page, encoding="utf-8")
    else:
        print(page)
    bad = [n for n, own in rows.items() if max(own.roots, own.circles) > MOST]
    print(*(f"differs by more than {MOST:g}: {name}" for name in bad), sep="\n")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
