"""`hpcwhirl import-model`: from matrices of finite elements to an engine's file."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hpcwhirl.cli.options import add_json, check_writable, print_json
from hpcwhirl.errors import InputError

if TYPE_CHECKING:
    from hpcwhirl.reduction.finite_elements import Imported

LAYOUT = (
    "rotor: coordinates are tip radial and tangential of blade 0, 1, ... (rotating "
    "frame, blade j at 2 pi j / N), then centre x_o, y_o if free, then fixed-interface "
    "amplitudes"
)


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument(
        "file", type=Path, metavar="FILE.toml",
        help="names the files of M and K and the unknowns of tips, centre and cuts; "
        "its keys: hpcwhirl/store/models/wheel_file.py",
    )  # fmt: skip
    parser.add_argument("--out", type=Path, required=True, metavar="FILE.h5")
    add_json(parser)


def arrays_of(rotor: Imported) -> dict[str, Any]:
    """Return {name: array} of the engine's file."""
    tips = 2 * np.arange(rotor.blades)
    hub = 2 * rotor.blades + np.arange(2 if rotor.centre else 0)
    return {
        "rotor/mass": rotor.mass,
        "rotor/stiffness": rotor.stiffness,
        "rotor/tip_radial": tips,
        "rotor/tip_tangential": tips + 1,
        "rotor/centre": hub,
    }


def facts_of(rotor: Imported, unknowns: int) -> dict[str, Any]:
    """Return what is told of an imported rotor."""
    hertz = rotor.omega / (2 * np.pi)
    return {
        "unknowns": unknowns,
        "blades": rotor.blades,
        "coordinates": len(rotor.omega),
        "modes": rotor.kept,
        "highest_hz": rotor.highest / (2 * np.pi),
        "frequencies_hz": hertz.tolist(),
        "rigid_modes": rotor.rigid,
        "condition": rotor.condition,
        "translation": rotor.strained,
        "mass": rotor.carried,
        "time_step_limit": 2.0 / float(rotor.omega[-1]),
    }


def run(args: argparse.Namespace) -> int:
    """Reduce the model and write the file."""
    check_writable(args.out, folder=False)
    from hpcwhirl.reduction.finite_elements import imported
    from hpcwhirl.store.models.wheel_file import read_wheel
    from hpcwhirl.store.results.single import write_arrays

    wheel = read_wheel(args.file)
    for source in (args.file, *wheel.sources):
        if args.out.exists() and args.out.samefile(source):
            msg = f"--out must be another file than {source}, which is read"
            raise InputError(msg)
    rotor = imported(wheel, _tell)
    facts = {"layout": LAYOUT, "source": str(args.file)}
    write_arrays(args.out, arrays_of(rotor), facts)
    told = facts_of(rotor, wheel.mass.shape[0])
    if args.json:
        print_json(told)
    else:
        _show(args.out, told)
    return 0


def _tell(line: str) -> None:
    print(f"hpcwhirl: {line}", file=sys.stderr)


def _show(out: Path, told: dict[str, Any]) -> None:
    lowest = ", ".join(f"{f:.5g}" for f in told["frequencies_hz"][:12])
    print(f"unknowns {told['unknowns']}, condition number {told['condition']:.1e}")
    print(
        f"coordinates {told['coordinates']}: {told['blades']} tips, "
        f"{told['modes']} fixed-interface modes, all to {told['highest_hz']:.5g} Hz"
    )
    print(f"lowest frequencies {lowest} Hz")
    print(f"time-step limit of the rotor {told['time_step_limit']:.3g} s")
    if told["mass"] is not None:
        print(f"mass {told['mass']:.5g} kg, a translation strains ", end="")
        print(f"{told['translation']:.1e} of the wheel")
    if told["rigid_modes"]:
        print(f"rigid modes {told['rigid_modes']}: nothing holds the wheel there")
    print(out)
