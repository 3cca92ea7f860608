"""`hpcwhirl export-model`: write rotor and casing of a scene to an engine's file.

The HDF5 file has mass, stiffness and damping matrices, modes, contact operators, and
the indices of the DoF of tips and centre.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

import numpy as np

from hpcwhirl.arrays import Floats
from hpcwhirl.case.resolve import resolve
from hpcwhirl.cli.command import add_option
from hpcwhirl.cli.options import (
    SCENES,
    USUAL,
    add_json,
    check_writable,
    print_paths,
    scene_of,
)
from hpcwhirl.errors import InputError, shown
from hpcwhirl.reduction.bodies import centre_rows
from hpcwhirl.reduction.model import Model
from hpcwhirl.reduction.modes import ModalModel, Spin, stiffening_at
from hpcwhirl.reduction.points import Stress
from hpcwhirl.reduction.round_casing import table_of
from hpcwhirl.scene import to_toml
from hpcwhirl.structure import FourierOperator

RIGID = 1e-5  # ratio to the highest frequency below which a mode may be rigid
LAYOUT = (
    "rotor: coordinates are tip radial and tangential of blade 0, 1, ... (rotating "
    "frame, blade j at 2 pi j / N), then centre x_o, y_o if free, then fixed-interface "
    "amplitudes; casing (static frame, u tangential with theta, w radial outward): of "
    "harmonics w_0, w_1c, w_1s, ... w_Hs, then u_0, u_1c, ... (c: cos h theta, s: "
    "sin); "
    "of elements u, u', w, w' at each node, node j at 2 pi j / elements"
)


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of `hpcwhirl export-model` on its parser."""
    # fmt: off
    parser.add_argument(
        "words", nargs="*", metavar="SCENE",
        help=f"{SCENES}; without --out FILE.h5 goes before it",
    )
    add_option(parser, "--out FILE.h5", "engine file to write", type=Path)
    add_option(parser, "--set NAME=VALUE",
        "set an input, e.g. blades=18; may be repeated", default=[], dest="settings")
    add_json(parser)


def _body(name: str, model: ModalModel) -> dict[str, Any]:
    arrays = {
        "shapes": model.shapes,
        "omega": model.omega,
        "damping_ratio": np.array(model.ratios),
        "nodal_diameter": model.diameter,
    }
    if model.has_matrices:
        arrays["mass"], arrays["stiffness"] = model.mass, model.stiffness
        arrays["damping"] = model.damping_matrix()
    return {f"{name}/{part}": array for part, array in arrays.items()}


def turning_arrays(
    mass: Floats, stiffness: Floats, spin: Spin, omega: Floats
) -> dict[str, Any]:
    """Return a rotor's terms of rotation as arrays of an engine's file.

    Returns {name in the file's group rotor: array}. If K(Omega) has no term in Omega^4,
    its change is written as stress stiffness minus softening: the softening is the
    whole mass matrix, and the stress stiffness the change per Omega^2 plus the mass
    matrix. Otherwise K is written at two speeds.

    mass, stiffness, omega : matrices of the rotor at rest, and its frequencies, rad/s
    """
    own = spin.support.at(0.0)  # a squeeze film is an input, no part of the file
    out = {
        "coriolis": spin.coriolis,
        "centrifugal_load": spin.load,
        "centre_damping": np.array([own.damping.real - own.film]),
    }
    if spin.quartic is None:
        parts = {"stress_stiffness": spin.stiffening + mass, "softening": mass}
        return out | parts
    first = float(omega[omega > RIGID * omega.max()].min())
    speeds = np.array([first, 2.0 * first])
    at = [stiffness + stiffening_at(spin, float(speed)) for speed in speeds]
    return out | {"speeds": speeds, "stiffness_a": at[0], "stiffness_b": at[1]}


def arrays_of_stress(stress: Stress | None) -> dict[str, Any]:
    """Return the stress at named points as arrays of an engine's file.

    Returns {name in the file's group rotor: array}
    """
    if stress is None:
        return {}
    names = np.array([name.encode() for name in stress.names])
    return {"stress": stress.rows, "stress_name": names}


def arrays_of(model: Model) -> dict[str, Any]:
    """Return rotor and casing of a model as arrays of an engine's file.

    Returns {path in the file, such as "rotor/mass": array}
    """
    hub = np.arange(len(model.rotor.shapes))[2 * model.blades :]
    points, places = model.rotor.points, {}
    tips = np.array(model.places)
    if points is not None:
        tips = tips.reshape(2, model.blades, -1)
        own = "station", "angle", "gap"
        places = {f"rotor/tip_{name}": getattr(points, name) for name in own}
    radial, tangential = (model.rotor.shapes[rows] for rows in tips)
    out = _body("rotor", model.rotor) | {
        "rotor/tip_radial": tips[0],
        "rotor/tip_tangential": tips[1],
        "rotor/centre": hub[: len(hub) - model.rotor.kept],
        "rotor/modal_tip_radial": radial,
        "rotor/modal_tip_tangential": tangential,
        "rotor/modal_centre": centre_rows(model.rotor, model.blades),
    }
    out |= places
    stress = arrays_of_stress(model.rotor.stress)
    out |= {f"rotor/{name}": array for name, array in stress.items()}
    if model.rotor.spin is not None:
        body = model.rotor
        turning = turning_arrays(
            body.mass, body.stiffness, model.rotor.spin, body.omega
        )
        out |= {f"rotor/{name}": array for name, array in turning.items()}
    if model.casing and model.ring:
        angles = 2 * np.pi * np.arange(model.blades) / model.blades
        rows = model.ring.rows(angles)
        out |= _body("casing", model.casing)
        out |= {"casing/radial_rows": rows[0], "casing/tangential_rows": rows[1]}
        if isinstance(model.ring, FourierOperator):
            table = table_of(model.casing, model.ring)
            station = table.pop("station", None)
            out |= {f"casing/modal_{name}": array for name, array in table.items()}
            if station is not None:
                out["casing/station"] = station
    return out


def run(args: argparse.Namespace) -> int:
    """Write rotor and casing of a scene to an engine's file; return the exit code."""
    from hpcwhirl.store.hdf5 import write_arrays

    out, name = _places(args)
    check_writable(out, folder=False)
    scene = scene_of(name, args.settings)
    model = resolve(scene).model
    spin = model.rotor.spin
    if spin is not None and (spin.tilt or spin.released is not None):
        raise InputError(
            "export-model cannot write a disk that tilts or a lost blade: the file has "
            "no terms for either with rotation full"
        )
    if scene.engine.rotor.bearing:
        raise InputError(
            "export-model cannot write a bearing's table: the file holds the springs "
            "that the table replaces; leave out bearing"
        )
    facts = {"layout": LAYOUT, "scene": to_toml(scene)}
    write_arrays(out, arrays_of(model), facts)
    print_paths(args, [out])
    return 0


def _places(args: argparse.Namespace) -> tuple[Path, str]:
    """Return the file to write, and the name of the scene."""
    words = [*args.words]
    if args.out is None and not words:
        msg = "export-model needs --out FILE.h5 (see hpcwhirl export-model --help)"
        raise InputError(msg)
    out = Path(words.pop(0)) if args.out is None else args.out
    if len(words) > 1:
        raise InputError(f"export-model takes one SCENE, got {shown(' '.join(words))}")
    return out, words[0] if words else USUAL
