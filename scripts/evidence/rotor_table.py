"""Rotors of rotor dynamicists as plain data, for hpcwhirl, ROSS and the tests.

A rotor has tubes, one after the other from node 0, disks and bearings at nodes, and
masses at nodes beyond the shaft, on which bearings with `to` stand. A bearing may have
an added mass, `mass`, kg.
"""

from __future__ import annotations

import itertools
import math
from typing import Any

RPM = 30 / math.pi
STEEL = {"young": 2.11e11, "shear": 8.12e10, "density": 7810.0}


def tube(
    length: float, outer: float, inner: float = 0.0, **given: Any
) -> dict[str, Any]:
    """Return an element of constant diameters, m, of a shaft."""
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


def ring(node: int, width: float, bore: float, outer: float) -> dict[str, Any]:
    """Return a disk of steel by its sizes, m."""
    mass = STEEL["density"] * width * math.pi / 4 * (outer**2 - bore**2)
    polar = mass / 8 * (outer**2 + bore**2)
    return disk(node, mass, polar, polar / 2 + mass * width**2 / 12)


def two_disks(*bearings: dict[str, Any], **more: Any) -> dict[str, Any]:
    """Return the rotor of Friswell and others, Dynamics of Rotating Machines, 5.9."""
    disks = [ring(2, 0.07, 0.05, 0.28), ring(4, 0.07, 0.05, 0.35)]
    tubes = [tube(0.25, 0.05)] * 6
    return {"tubes": tubes, "disks": disks, "bearings": list(bearings), **more}


def tapered() -> dict[str, Any]:
    """Return the rotor of section 5.9.5 of the same book, with its tapered shaft."""
    ends = [0.025 + 0.015 * i / 6 for i in range(7)]
    tubes = [tube(0.25, a) | {"outer": [a, b]} for a, b in itertools.pairwise(ends)]
    held = [bearing(node, kxx=10e6) for node in (0, 6)]
    return {"tubes": tubes, "disks": [ring(3, 0.04, 0.0325, 0.25)], "bearings": held}


def on_pedestals() -> dict[str, Any]:
    """Return the two disks on bearings that stand on pedestals, nodes 7 and 8."""
    held = [
        own
        for node, foot in ((0, 7), (6, 8))
        for own in (
            bearing(node, kxx=1e6, kyy=8e5, cxx=3e3) | {"to": foot},
            bearing(foot, kxx=1e7, kyy=2e7, cxx=2e2),
        )
    ]
    return two_disks(*held, masses=[[7, 10.0], [8, 10.0]])


FAN = [tube(0.1, 0.05) for _ in range(10)]
HELD = [bearing(0, kxx=1e8, cxx=2e3), bearing(6, kxx=1e8, cxx=2e3)]
SHORT = {
    "kxx": 12.81e6, "kxy": 16.39e6, "kyx": -25.06e6, "kyy": 8.815e6, "cxx": 232.9e3,
    "cxy": -81.92e3, "cyx": -81.92e3, "cyy": 294.9e3,
}  # fmt: skip
OF_TABLE = [418.8790205, 628.3185308, 837.758041]  # rows of the compressor's tables
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
    "two disks, unequal bearings": {
        "rotor": two_disks(
            *(bearing(node, kxx=1e6, kyy=8e5, cxx=10.0) for node in (0, 6))
        ),
        "speeds": [50.0, 419.0], "unbalance": [2, 1e-3],
    },
    "two disks on pedestals": {
        "rotor": on_pedestals(), "speeds": [50.0, 419.0], "unbalance": [2, 1e-3],
    },
    "tapered shaft (Friswell 5.9.5)": {
        "rotor": tapered(), "speeds": [50.0, 419.0], "unbalance": [3, 1e-3],
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
    "two disks and a seal with an added mass of 12 kg": {
        "rotor": two_disks(
            bearing(0, kxx=1e6, cxx=100.0) | {"mass": 1.5},
            bearing(3, kxx=2e5, kxy=3e4, kyx=-3e4, cxx=3e3) | {"mass": 12.0},
            bearing(6, kxx=1e6, cxx=100.0),
        ),
        "speeds": [50.0, 419.0], "unbalance": [2, 1e-3],
    },
    "overhung fan, disk of 60 kg": {
        "rotor": {"tubes": FAN, "disks": [disk(10, 60.0, 3.0, 1.5)], "bearings": HELD},
        "speeds": [50.0, 300.0], "unbalance": [10, 1e-3],
    },
    "ROSS: rotor_example": {
        "example": "rotor_example", "speeds": [100.0, 600.0], "unbalance": [3, 1e-3],
    },
    "ROSS: compressor_example, 12 seals": {
        "example": "compressor_example", "speeds": OF_TABLE,
        "unbalance": [29, 1e-3],
    },
}  # fmt: skip
