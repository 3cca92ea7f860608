"""Save public rotors with ROSS, and print the roots that it computes, as JSON.

    python ross_rotors.py FOLDER     in an environment with ross-rotordynamics

Run by `shafts.py`. The rotors are those of ROSS's documentation and tests, of
M. Friswell et al., Dynamics of Rotating Machinery, 2010 (sections 5.9 and 6), and that
of H. Nelson and J. McVaugh, J. Eng. Ind. 98, 1976.
"""

import itertools
import json
import sys
import warnings
from pathlib import Path

warnings.filterwarnings("ignore")

import ross as rs  # noqa: E402 - its warnings are not ours

STEEL = rs.Material(name="Steel", rho=7810, E=211e9, G_s=81.2e9)
SPEEDS = 0.0, 150.0, 419.0
OF_TABLE = 418.8790205, 628.3185308, 837.758041  # rows of the compressor's tables


def rods(count: int, length: float, diameter: float) -> list[rs.ShaftElement]:
    """Return equal elements of a solid shaft."""
    return [rs.ShaftElement(length, 0, diameter, material=STEEL) for _ in range(count)]


def disks(first: int, second: int) -> list[rs.DiskElement]:
    """Return the two disks of Friswell's example 5.9.1."""
    return [
        rs.DiskElement.from_geometry(n, STEEL, 0.07, 0.05, d)
        for n, d in ((first, 0.28), (second, 0.35))
    ]


def supported(nodes: tuple[int, ...], **coefficients: float) -> list[rs.BearingElement]:
    """Return equal bearings at nodes."""
    return [rs.BearingElement(n=n, **coefficients) for n in nodes]


def friswell(**coefficients: float) -> rs.Rotor:
    """Return the rotor of example 5.9.1 on bearings with the given coefficients."""
    return rs.Rotor(rods(6, 0.25, 0.05), disks(2, 4), supported((0, 6), **coefficients))


def overhung() -> rs.Rotor:
    """Return the rotor of example 5.9.9, a disk beyond two bearings."""
    disk = rs.DiskElement.from_geometry(6, STEEL, 0.07, 0.05, 0.35)
    bearings = supported((0, 4), kxx=10e6, cxx=0)
    return rs.Rotor(rods(6, 0.25, 0.05), [disk], bearings)


def tapered() -> rs.Rotor:
    """Return the rotor of example 5.9.5 with its tapered shaft."""
    ends = [0.025 + 0.015 * i / 6 for i in range(7)]
    shaft = [
        rs.ShaftElement(0.25, 0, a, 0, b, material=STEEL)
        for a, b in itertools.pairwise(ends)
    ]
    disk = rs.DiskElement.from_geometry(3, STEEL, 0.04, 0.0325, 0.25)
    return rs.Rotor(shaft, [disk], supported((0, 6), kxx=10e6, cxx=0))


def nelson(**coefficients: float) -> rs.Rotor:
    """Return the rotor of Nelson and McVaugh."""
    places = [0.0, 1.27, 5.08, 7.62, 8.89, 10.16, 10.67, 11.43, 12.7, 13.46, 16.51,
              19.05, 22.86, 26.67, 28.7, 30.48, 31.5, 34.54, 35.81]  # fmt: skip
    outer = [0.51, 1.02, 0.76, 2.03, 2.03, 3.3, 3.3, 2.54, 2.54, 1.27, 1.27, 1.52, 1.52,
             1.27, 1.27, 3.81, 2.03, 2.03]  # fmt: skip
    inner = [0.0] * 6 + [1.52, 1.78] + [0.0] * 9 + [1.52]
    material = rs.Material(name="Published", rho=7806, E=2.078e11, Poisson=0.3)
    shaft = [
        rs.ShaftElement((b - a) / 100, i / 50, o / 50, material=material,
                        shear_effects=False)
        for (a, b), i, o in zip(itertools.pairwise(places), inner, outer, strict=True)
    ]  # fmt: skip
    disk = rs.DiskElement(4, 1.401, 0.00136, 0.002)
    return rs.Rotor(shaft, [disk], supported((10, 14), **coefficients))


def pedestal() -> rs.Rotor:
    """Return the rotor of example 5.9.1 whose bearings stand on pedestals."""
    bearings, masses = [], []
    for node, foot in ((0, 7), (6, 8)):
        bearings.append(
            rs.BearingElement(n=node, n_link=foot, kxx=1e6, kyy=8e5, cxx=3e3)
        )
        bearings.append(rs.BearingElement(n=foot, kxx=1e7, kyy=2e7, cxx=2e2))
        masses.append(rs.PointMass(n=foot, m=10.0))
    return rs.Rotor(
        rods(6, 0.25, 0.05), disks(2, 4), bearings, point_mass_elements=masses
    )


ROTORS = {
    "two disks (5.9.1)": lambda: friswell(kxx=1e6, cxx=10),
    "unequal bearings (5.9.2)": lambda: friswell(kxx=1e6, kyy=8e5, cxx=10),
    "damped bearings (5.9.4)": lambda: friswell(kxx=1e6, cxx=3e3),
    "cross coupling (5.9.6)": lambda: friswell(kxx=1e6, kxy=5e5, kyx=-5e5, cxx=10),
    "tapered (5.9.5)": tapered,
    "overhung (5.9.9)": overhung,
    "on pedestals": pedestal,
    "Nelson-McVaugh": lambda: nelson(kxx=4.378e7, cxx=1752),
    "Nelson-McVaugh, unequal": lambda: nelson(
        kxx=3.503e7, kxy=-8.756e6, kyx=-8.756e6, cxx=1752
    ),
    "compressor (documentation)": rs.compressor_example,
}


def roots_of(rotor: rs.Rotor, speed: float) -> list[list[float]]:
    """Return all roots with Im s > 0, 1/s: Re s, Im s."""
    roots = rotor.run_modal(speed, num_modes=48, sparse=False).evalues
    return [[float(s.real), float(s.imag)] for s in roots if s.imag > 1.0]


def main() -> None:
    """Save each rotor to the folder named, and print its roots."""
    folder, found = Path(sys.argv[1]), {}
    for place, (name, build) in enumerate(ROTORS.items()):
        rotor, path = build(), folder / f"rotor{place}.toml"
        rotor.save(path)
        speeds = OF_TABLE if name.startswith("compressor") else SPEEDS
        own = {str(speed): roots_of(rotor, speed) for speed in speeds}
        found[name] = {"file": str(path), "roots": own}
    print(json.dumps({"version": rs.__version__, "rotors": found}))


main()
