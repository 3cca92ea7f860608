#!/usr/bin/env python3
"""Rotors of rotor dynamicists: hpcwhirl beside ROSS, published numbers, closed forms.

    python scripts/evidence/rotors.py [--write] [--ross FOLDER]

ROSS 2.3.0 needs an older plotly than hpcwhirl: it gets a virtual environment of its
own, FOLDER (.venv-ross), made by the first run with pip. Both programs get the same
elements, disks and coefficients of bearings; `rotors_of_ross.py` is what ROSS runs.
--write writes the page `agreement.md` of the manual. Exits 1 if a difference exceeds
`MOST`.
"""

from __future__ import annotations

import argparse
import itertools
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
from hpcwhirl.scene.shaft_tables import text_of
from hpcwhirl.structure.shaft import NODE, LineSupport, ShaftDisk, ShaftLine, Tube

TOP = Path(__file__).parents[2]
PAGE = TOP / "hpcwhirl/manual/agreement.md"
TEMPLATE = Path(__file__).with_suffix(".template")
THEIRS = Path(__file__).with_name("rotors_of_ross.py")
PINNED = "ross-rotordynamics==2.3.0", "plotly<6"
MOST = 1e-4  # relative difference where the models are the same
STIFFER = 1.0, 10.0, 100.0, 1e4  # Young's modulus of blades over steel's
LOWEST = 6  # free motions compared at each speed
RPM = 30 / math.pi
STEEL = {"young": 2.11e11, "shear": 8.12e10, "density": 7810.0}


def tube(
    length: float, outer: float, inner: float = 0.0, **given: Any
) -> dict[str, Any]:
    """Return an element of constant diameters, m, as `rotors_of_ross` describes it."""
    usual = STEEL | {"sheared": True, "rotary": True} | given
    poisson = usual["young"] / usual["shear"] / 2 - 1
    return {"length": length, "outer": [outer] * 2, "inner": [inner] * 2,
            "poisson": poisson, **usual}  # fmt: skip


def disk(node: int, mass: float, polar: float, about_diameter: float) -> dict[str, Any]:
    """Return a rigid disk; kg, kg m^2."""
    return {
        "node": node,
        "mass": mass,
        "polar": polar,
        "about_diameter": about_diameter,
    }


def bearing(node: int, **k: float) -> dict[str, Any]:
    """Return a bearing of constant coefficients, N/m and N s/m; those of y as of x."""
    usual = {
        "kyy": k["kxx"],
        "kxy": 0.0,
        "kyx": 0.0,
        "cxx": 0.0,
        "cxy": 0.0,
        "cyx": 0.0,
    }
    own = usual | k
    own.setdefault("cyy", own["cxx"])
    names = "kxx", "kxy", "kyx", "kyy", "cxx", "cxy", "cyx", "cyy"
    return {"node": node, "rows": [[0.0, *(own[name] for name in names)]]}


def nelson_mcvaugh(**held: float) -> dict[str, Any]:
    """Return the rotor of Nelson and McVaugh, J. Eng. Ind. 98, 1976, without shear."""
    places = [
        0.0, 1.27, 5.08, 7.62, 8.89, 10.16, 10.67, 11.43, 12.7, 13.46, 16.51, 19.05,
        22.86, 26.67, 28.7, 30.48, 31.5, 34.54, 35.81,
    ]  # fmt: skip
    outer = [
        0.51, 1.02, 0.76, 2.03, 2.03, 3.3, 3.3, 2.54, 2.54, 1.27, 1.27, 1.52, 1.52,
        1.27, 1.27, 3.81, 2.03, 2.03,
    ]  # fmt: skip
    inner = [0.0] * 6 + [1.52, 1.78] + [0.0] * 9 + [1.52]
    given = {"young": 2.078e11, "shear": 8e10, "density": 7806.0, "sheared": False}
    tubes = [
        tube((b - a) / 100, d / 50, i / 50, **given)
        for (a, b), d, i in zip(itertools.pairwise(places), outer, inner, strict=True)
    ]
    return {"tubes": tubes, "disks": [disk(4, 1.401, 0.002, 0.00136)],
            "bearings": [bearing(node, **held) for node in (10, 14)]}  # fmt: skip


def two_disks(*bearings: dict[str, Any]) -> dict[str, Any]:
    """Return the rotor of Friswell and others, Dynamics of Rotating Machines, 5.9."""

    def solid(d: float) -> tuple[float, float, float]:
        mass = 7810.0 * 0.07 * math.pi / 4 * (d**2 - 0.05**2)
        polar = mass / 8 * (d**2 + 0.05**2)
        return mass, polar, polar / 2 + mass * 0.07**2 / 12

    disks = [disk(2, *solid(0.28)), disk(4, *solid(0.35))]
    return {"tubes": [tube(0.25, 0.05)] * 6, "disks": disks, "bearings": list(bearings)}


FAN = [tube(0.1, 0.05) for _ in range(10)]
HELD = [bearing(0, kxx=1e8, cxx=2e3), bearing(6, kxx=1e8, cxx=2e3)]
SHORT = {
    "kxx": 12.81e6, "kxy": 16.39e6, "kyx": -25.06e6, "kyy": 8.815e6, "cxx": 232.9e3,
    "cxy": -81.92e3, "cyx": -81.92e3, "cyy": 294.9e3,
}  # fmt: skip
ROTORS: dict[str, dict[str, Any]] = {
    "Nelson and McVaugh, isotropic bearings": {
        "rotor": nelson_mcvaugh(kxx=4.378e7), "speeds": [500.0, 4000.0],
        "unbalance": [4, 1e-4],
    },
    "Nelson and McVaugh, orthotropic bearings": {
        "rotor": nelson_mcvaugh(kxx=3.503e7, kxy=-8.756e6, kyx=-8.756e6),
        "speeds": [500.0, 4000.0], "unbalance": [4, 1e-4],
    },
    "Nelson and McVaugh, damped bearings": {
        "rotor": nelson_mcvaugh(kxx=4.378e7, cxx=1752.0), "speeds": [500.0, 4000.0],
        "unbalance": [4, 1e-4],
    },
    "two disks, isotropic bearings (Friswell 5.9)": {
        "rotor": two_disks(*(bearing(node, kxx=1e6, cxx=100.0) for node in (0, 6))),
        "speeds": [50.0, 419.0], "unbalance": [2, 1e-3],
    },
    "two disks, cross-coupled bearings": {
        "rotor": two_disks(
            bearing(0, kxx=1e6, kxy=1e5, kyx=-1e5, cxx=300.0),
            bearing(6, kxx=1e6, kxy=1e5, kyx=-1e5, cxx=300.0),
        ),
        "speeds": [50.0, 419.0], "unbalance": [2, 1e-3],
    },
    "two disks, short journal bearings at 1500 rpm": {
        "rotor": two_disks(bearing(0, **SHORT), bearing(6, **SHORT)),
        "speeds": [1500 / RPM], "unbalance": [2, 1e-3],
    },
    "overhung fan, disk of 60 kg": {
        "rotor": {"tubes": FAN, "disks": [disk(10, 60.0, 3.0, 1.5)], "bearings": HELD},
        "speeds": [50.0, 300.0], "unbalance": [10, 1e-3],
    },
    "ROSS: rotor_example": {
        "example": "rotor_example", "speeds": [100.0, 600.0], "unbalance": [3, 1e-3],
    },
    "ROSS: compressor_example, 12 seals": {
        "example": "compressor_example", "speeds": [400.0, 900.0],
        "unbalance": [29, 1e-3],
    },
}  # fmt: skip


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


def line_of_data(rotor: dict[str, Any], place: int) -> ShaftLine:
    """Return the shaft line of plain data, with its bearings at one of their speeds."""
    tubes = tuple(
        Tube(
            t["length"], tuple(t["outer"]), tuple(t["inner"]), t["young"], t["density"],
            t["shear"] if t["sheared"] else math.inf, t["poisson"], t["rotary"],
            t.get("node", -1),
        )
        for t in rotor["tubes"]
    )  # fmt: skip
    supports = tuple(
        LineSupport(
            NODE * b["node"],
            -1,
            ((0.0, *b["rows"][min(place, len(b["rows"]) - 1)][1:]),),
        )
        for b in rotor["bearings"]
    )
    disks = tuple(ShaftDisk(**d) for d in rotor["disks"])
    return ShaftLine(tubes, disks, supports=supports)


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
    for place, speed in enumerate(given["speeds"]):
        line = line_of_data(theirs["rotor"], place)
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


def of_ross(folder: Path, given: dict[str, Any]) -> dict[str, Any]:
    """Return what ROSS says of rotors; its environment is made if it is missing."""
    python = folder / "bin/python"
    if not python.exists():
        venv.create(folder, with_pip=True)
        subprocess.run([python, "-m", "pip", "install", "-q", *PINNED], check=True)
    with tempfile.TemporaryDirectory() as scratch:
        names = [Path(scratch) / name for name in ("given.json", "found.json")]
        names[0].write_text(json.dumps(given))
        subprocess.run([python, THEIRS, *names], check=True, capture_output=True)
        found: dict[str, Any] = json.loads(names[1].read_text())
        return found


def criticals() -> list[tuple[str, float, float]]:
    """Return critical speeds of Nelson and McVaugh: name, own, published, rpm."""
    line = line_of_data(nelson_mcvaugh(kxx=4.378e7), 0)
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


def main() -> int:
    """Compare all rotors, print or write the page; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--write", action="store_true", help=f"write {PAGE.name}")
    parser.add_argument(
        "--ross", type=Path, default=TOP / ".venv-ross", metavar="FOLDER"
    )
    args = parser.parse_args()
    found = of_ross(args.ross, ROTORS | {"fan": fan_as_disk()})
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
