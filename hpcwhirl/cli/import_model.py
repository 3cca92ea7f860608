"""`hpcwhirl import-model`: reduce finite-element matrices to an engine file."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from hpcwhirl.cli.command import add_option
from hpcwhirl.cli.export_model import arrays_of_stress, turning_arrays
from hpcwhirl.cli.options import add_json, check_writable, print_json
from hpcwhirl.errors import InputError, say

if TYPE_CHECKING:
    from hpcwhirl.reduction.finite_elements import Imported

LAYOUT = (
    "rotor: coordinates are tip radial and tangential of blade 0, 1, ... (rotating "
    "frame, blade j at 2 pi j / N), of several contact points of each in turn, then "
    "centre x_o, y_o if free, then fixed-interface amplitudes"
)


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of `hpcwhirl import-model` on its parser."""
    # fmt: off
    parser.add_argument(
        "file", type=Path, nargs="?", metavar="FILE.toml",
        help="file that names the matrix files of M and K and the unknowns at tips, "
        "centre and sector cuts; its keys: --example",
    )
    add_option(parser, "--out FILE.h5", "engine file to write", type=Path)
    add_option(parser, "--example",
        "print an example of FILE.toml with all keys and their meanings, and end")
    add_json(parser)


def arrays_of(rotor: Imported) -> dict[str, Any]:
    """Return a rotor reduced from finite elements as arrays of an engine's file.

    Returns {path in the file, such as "rotor/mass": array}
    """
    each = [len(rotor.points["tip_station"])] if rotor.points else []
    tips = 2 * np.arange(rotor.blades * (each or [1])[0]).reshape(rotor.blades, *each)
    hub = 2 * tips.size + np.arange(2 if rotor.centre else 0)
    turning: dict[str, Any] = {}
    if rotor.spin is not None:
        matrices = rotor.mass, rotor.stiffness
        turning = turning_arrays(*matrices, rotor.spin, rotor.omega)
    beside = turning | rotor.points | arrays_of_stress(rotor.stress)
    return {f"rotor/{name}": array for name, array in beside.items()} | {
        "rotor/mass": rotor.mass,
        "rotor/stiffness": rotor.stiffness,
        "rotor/tip_radial": tips,
        "rotor/tip_tangential": tips + 1,
        "rotor/centre": hub,
    }


def facts_of(rotor: Imported, unknowns: int) -> dict[str, Any]:
    """Return what the command prints on a reduced rotor, by name.

    Parameters
    ----------
    rotor : the reduced rotor
    unknowns : number of unknowns of the finite-element model
    """
    hertz = rotor.omega / (2 * np.pi)
    return {
        "unknowns": unknowns,
        "blades": rotor.blades,
        "points": len(rotor.points.get("tip_station", [0])),
        "coordinates": len(rotor.omega),
        "modes": rotor.kept,
        "modes_at_speed": rotor.added,
        "highest_hz": rotor.highest / (2 * np.pi),
        "frequencies_hz": hertz.tolist(),
        "rigid_modes": rotor.rigid,
        "condition": rotor.condition,
        "translation": rotor.strained,
        "mass": rotor.carried,
        "turns": rotor.spin is not None,
        "stress": list(rotor.stress.names) if rotor.stress else [],
        "time_step_limit": 2.0 / float(rotor.omega[-1]),
    }


def run(args: argparse.Namespace) -> int:
    """Reduce finite-element matrices to a rotor, and write it to an engine's file.

    With --example it only prints an example of the TOML file that describes the
    matrices. Returns the exit code
    """
    if args.example:
        from hpcwhirl.store.models.wheel_file import EXAMPLE

        sys.stdout.write(EXAMPLE.read_text())
        return 0
    if args.file is None or args.out is None:
        msg = "import-model needs FILE.toml and --out FILE.h5; --example prints a file"
        raise InputError(msg)
    check_writable(args.out, folder=False)
    from hpcwhirl.reduction.finite_elements import imported
    from hpcwhirl.store.hdf5 import write_arrays
    from hpcwhirl.store.models.wheel_file import read_wheel

    wheel = read_wheel(args.file)
    for source in (args.file, *wheel.sources):
        if args.out.exists() and args.out.samefile(source):
            raise InputError(f"--out must not be {source}, which this command reads")
    rotor = imported(wheel, say)
    facts = {"layout": LAYOUT, "source": str(args.file)}
    write_arrays(args.out, arrays_of(rotor), facts)
    summary = facts_of(rotor, wheel.mass.shape[0])
    if args.json:
        print_json(summary)
    else:
        _show(args.out, summary)
    return 0


def _show(out: Path, facts: dict[str, Any]) -> None:
    lowest = ", ".join(f"{f:.5g}" for f in facts["frequencies_hz"][:12])
    print(f"unknowns {facts['unknowns']}, condition number {facts['condition']:.1e}")
    each = f" of {facts['points']} contact points" if facts["points"] > 1 else ""
    print(
        f"coordinates {facts['coordinates']}: {facts['blades']} tips{each}, "
        f"{facts['modes']} fixed-interface modes, all to {facts['highest_hz']:.5g} Hz"
        + (f", {facts['modes_at_speed']} more for all speeds" if facts["turns"] else "")
    )
    print(f"lowest frequencies {lowest} Hz")
    print(f"time-step limit of the rotor {facts['time_step_limit']:.3g} s")
    if facts["mass"] is not None:
        print(f"mass {facts['mass']:.5g} kg, relative strain in a translation ", end="")
        print(f"{facts['translation']:.1e}")
    if facts["turns"]:
        print("the file has the terms of rotation: engine.rotation may be full")
    if facts["stress"]:
        print(f"stress at {', '.join(facts['stress'])} of each blade")
    if facts["rigid_modes"]:
        print(f"rigid modes {facts['rigid_modes']}: nothing holds the wheel in these")
    print(out)
