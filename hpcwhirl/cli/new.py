"""`hpcwhirl new`: write a commented campaign file for a fan, and for a study of it."""

from __future__ import annotations

import argparse
import math
import re
import shlex
from importlib import resources
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING, Any

from hpcwhirl.cli.command import add_option
from hpcwhirl.cli.new_study import sizes_of, studies, written
from hpcwhirl.cli.options import add_units, asked_units, tell_remarks
from hpcwhirl.errors import InputError, say, shown, unknown
from hpcwhirl.scene.units import (
    ANGULAR,
    in_shown,
    in_si,
    showing,
    told_of,
    written_in,
)

if TYPE_CHECKING:
    from hpcwhirl.case.fan import Checked, Fan
    from hpcwhirl.scene import Scene

UNITS = "rpm", "mm", "kN", "GPa", "MN/m"  # of a new file's numbers; times are in s
EXACT = 8  # digits of the engine's numbers
SECTIONS = (  # lengths of the rotor's beams
    "radius", "root_thickness", "blade_width", "disk_radius", "spoke_width",
    "spoke_thickness", "rim_width", "rim_thickness",
)  # fmt: skip
NOTES = 35  # column of a new file at which comments begin
MAP = "map"  # the study that is written by default
OPTIONS = {  # name: unit, metavar, help
    "radius": ("m", "LENGTH", "tip radius (default 0.5 m)"),
    "gap": ("m", "LENGTH", "blade-tip clearance (default: radius / 3906, the paper's)"),
    "speed": (
        "rad/s", "SPEED",
        "full speed, in rad/s, or as '3000 rpm' (default: 400 m/s at the tips)",
    ),
    "frequency": (
        "Hz", "FREQUENCY",
        "first bending of the blades (1F) at rest, Hz (default: half the full speed)",
    ),
    "friction": ("1", "NUMBER", "Coulomb's coefficient of friction (default 0.1)"),
}  # fmt: skip


def arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments of `hpcwhirl new` on its parser."""
    # fmt: off
    parser.add_argument(
        "file", type=Path, metavar="FILE.toml",
        help="campaign file to write; an existing file is not overwritten",
    )
    add_option(parser, "--blades N", "number of blades (default 22)", default=22)
    for name, (unit, what, meaning) in OPTIONS.items():
        hint = "; in m, or as '0.8 mm'" if unit == "m" else ""
        parser.add_argument(f"--{name}", metavar=what, default="", help=meaning + hint)
    add_option(parser, "--material NAME",
        "material of the blades: titanium (default), steel, aluminium, nickel or "
        "composite", default="titanium")
    add_option(parser, "--casing-material NAME",
        "material of the casing (default: material of the blades)", default="")
    add_option(parser, "--lobes K",
        "number of lobes (nodal diameter) of the load (default 1)", default=1)
    add_option(parser, "--study NAME",
        f"what the file is for: {', '.join(studies())} (default {MAP}: words over "
        "speed and gap)", default=MAP)
    add_units(parser, "the file and of what is printed")


def run(args: argparse.Namespace) -> int:
    """Write a campaign file for a fan; print its frequencies and the pulse's effect.

    Returns the exit code
    """
    from hpcwhirl.case.fan import FANS, scene_of_fan
    from hpcwhirl.store.atomic import write_whole

    def check() -> None:
        if args.file.exists():
            msg = f"{args.file} exists already and is not overwritten"
            raise InputError(msg)

    check()
    if args.study not in studies():
        raise unknown("study", args.study, studies())
    fan, asked = _fan(args), asked_units(args.units)
    scene, checked = scene_of_fan(fan)
    with showing(asked), written_in(UNITS):
        text = toml_of(fan, scene, checked, args.study)
        write_whole(args.file, text.encode(), check)
        print(f"{args.file}: {told_of_model(checked)}")
        if "$pulse" in studies()[args.study]["scene"]:
            print(f"{args.file}: {told_of_pulse(scene, checked)}")
        tell_remarks(scene)
        if not FANS[0] <= checked.share <= FANS[1]:
            hint = f"1F of fans is {FANS[0]:g} to {FANS[1]:g} of full speed, in Hz: "
            say(f"{hint}change --frequency or --speed")
        if growing := told_of_growth(scene, checked):
            say(growing)
    print(f"next: hpcwhirl campaign {shlex.quote(str(args.file))} --dry-run")
    return 0


def _fan(args: argparse.Namespace) -> Fan:
    from hpcwhirl.case.fan import Fan

    texts = {name: text for name in OPTIONS if (text := getattr(args, name))}
    numbers: dict[str, Any] = {n: _number(n, text) for n, text in texts.items()}
    if "speed" in numbers:
        numbers["full_speed"] = numbers.pop("speed")
    plain = ("blades", "material", "casing_material", "lobes")
    return Fan(**{name: getattr(args, name) for name in plain}, **numbers)


def _number(name: str, text: str) -> float:
    """Return the value of an option in SI, a frequency in Hz.

    name, text : name of the option, such as "gap"; text given, such as "0.8mm"
    """
    unit = OPTIONS[name][0]
    value = told_of(f"--{name}", lambda: in_si(text, unit))
    try:
        return float(value)
    except ValueError:
        msg = f"--{name} must be a number, with a unit or without, got {shown(text)}"
        raise InputError(msg) from None


def told_of_model(checked: Checked) -> str:
    """Return a line of text with the engine's frequencies, full speed and ring mass.

    checked : numbers computed from the engine's model
    """
    full = checked.full_speed / (2 * math.pi)
    line = f"1F {checked.family:.1f} Hz, {checked.share:.2f} of the full speed's "
    line += f"{full:.1f} Hz ({in_shown(checked.full_speed, ANGULAR, 4)}); "
    if checked.suspension:
        line += f"suspension {checked.suspension:.1f} Hz; "
    return line + f"ring {checked.ring_mass:.0f} kg"


def told_of_pulse(scene: Scene, checked: Checked) -> str:
    """Return a line of text on how fast and how far the pulse moves the ring.

    checked : numbers computed from the engine's model
    """
    return (
        f"the pulse gives the ring {checked.kick:.3g} m/s and closes the gap of "
        f"{in_shown(scene.gap, 'm', 3)} in {checked.closing * 1e3:.3g} ms; without "
        f"blades the ring would move {checked.reach:.3g} gaps far"
    )


def told_of_growth(scene: Scene, checked: Checked) -> str:
    """Return a line of text on speeds at which free motion grows; "" if there are none.

    They are looked for up to the full speed.

    checked : numbers computed from the engine's model
    """
    from hpcwhirl.case.growth import stability_of
    from hpcwhirl.case.resolve import resolve

    full = checked.full_speed
    found = stability_of(resolve(scene).model, full)
    bands = [band for band in found.bands if band.start < full] if found else []
    if not bands:
        return ""
    spans = ", ".join(
        " to ".join(in_shown(v, ANGULAR, 4) for v in (band.start, min(band.end, full)))
        for band in bands
    )
    return (
        f"free motion grows by itself at {spans}, without contact, by up to "
        f"{max(band.growth for band in bands):.3g} 1/s: no gap, friction or pulse "
        "changes that; raise suspension_damping or --frequency, or lower --speed"
    )


def toml_of(fan: Fan, scene: Scene, checked: Checked, study: str) -> str:
    """Return the text of a fan's campaign file: the template with all values.

    Parameters
    ----------
    fan : dimensions of the fan
    scene : inputs of the fan's scene
    checked : numbers computed from the fan's model
    study : a key of `studies`
    """
    values = {
        **_plain_values(scene),
        **_lengths(scene),
        **sizes_of(study, scene, checked),
        "material": fan.material,
        "name": f"fan, {fan.blades} blades, {in_shown(fan.radius, 'm')}",
        "radius_told": in_shown(fan.radius, "m"),
        "model": told_of_model(checked),
        "pulse_told": told_of_pulse(scene, checked).replace("; ", "\n# "),
    }
    parts = {
        key: Template(text).substitute(values).strip("\n ")
        for key, text in studies()[study].items()
    }
    text = resources.files("hpcwhirl.cli").joinpath("new.template").read_text("utf-8")
    return aligned(Template(text).substitute(values | parts))


def _plain_values(scene: Scene) -> dict[str, Any]:
    """Return the values of a fan's file that are the same in all units."""
    rotor, casing = scene.engine.rotor, scene.engine.casing
    return {
        "blades": rotor.blades, "damping": rotor.damping,
        "suspension_damping": rotor.suspension_damping,
        "casing_damping": casing.damping, "support_damping": casing.support_damping,
        "support_frequency": f'"{casing.support_frequency:g} rad/s"',
        "nodal_diameter": scene.nodal_diameter, "friction": scene.friction,
        "rotation": scene.engine.rotation,
    }  # fmt: skip


def _lengths(scene: Scene) -> dict[str, str]:
    """Return the values of a fan's file that have units, as texts with them."""
    rotor, casing = scene.engine.rotor, scene.engine.casing
    exact = {name: written(getattr(rotor, name), "m", EXACT) for name in SECTIONS}
    return exact | {
        "speed": written(scene.speed, ANGULAR), "gap": written(scene.gap, "m"),
        "force": written(scene.force, "N"), "pulse": f'"{1e3 * scene.pulse:g} ms"',
        "duration": written(scene.duration, "s"),
        "longest": written(4 * scene.duration, "s"),
        "young": written(rotor.young, "Pa", EXACT),
        "density": written(rotor.density, "kg/m^3", EXACT),
        "stiffness": written(rotor.centre_stiffness, "N/m", EXACT),
        "casing_thickness": written(casing.thickness, "m", EXACT),
        "casing_width": written(casing.width, "m", EXACT),
        "casing_young": written(casing.young, "Pa", EXACT),
        "casing_density": written(casing.density, "kg/m^3", EXACT),
    }  # fmt: skip


def aligned(text: str) -> str:
    """Return the text of a TOML file with the comments that follow values aligned."""
    lines = []
    for line in re.sub(r"\n{3,}", "\n\n", text).splitlines():
        code, sign, note = line.partition("#")
        lines.append(
            f"{code.rstrip() + ' ':<{NOTES}}#{note}" if code and sign else line
        )
    return "\n".join([*lines, ""])
