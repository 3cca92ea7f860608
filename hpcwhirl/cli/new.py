"""`hpcwhirl new`: write a commented campaign file for a fan of given dimensions."""

from __future__ import annotations

import argparse
import math
import shlex
from importlib import resources
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING, Any

from hpcwhirl.cli.command import add_option
from hpcwhirl.cli.options import tell_remarks
from hpcwhirl.errors import InputError, say, shown
from hpcwhirl.scene.units import in_si, told_of

if TYPE_CHECKING:
    from hpcwhirl.case.fan import Checked, Fan
    from hpcwhirl.scene import Scene

RPM = 30.0 / math.pi  # rpm per rad/s
GAPS = (0.5, 1.0, 2.0, 4.0)  # gaps that a new file sweeps, as multiples of the fan's
NOTES = 30  # column of a new file at which comments begin
SPEEDS = 20  # approximate number of speeds in the sweep
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
    fan = _fan(args)
    scene, checked = scene_of_fan(fan)
    text = toml_of(fan, scene, checked)
    write_whole(args.file, text.encode(), check)
    print(f"{args.file}: {told_of_model(checked)}")
    print(f"{args.file}: {told_of_pulse(scene, checked)}")
    tell_remarks(scene)
    if not FANS[0] <= checked.share <= FANS[1]:
        hint = f"1F of fans is {FANS[0]:g} to {FANS[1]:g} of full speed, in Hz: change "
        hint += "--frequency or --speed"
        say(hint)
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
    line += f"{full:.1f} Hz ({checked.full_speed * RPM:.0f} rpm); "
    if checked.suspension:
        line += f"suspension {checked.suspension:.1f} Hz; "
    return line + f"ring {checked.ring_mass:.0f} kg"


def told_of_pulse(scene: Scene, checked: Checked) -> str:
    """Return a line of text on how fast and how far the pulse moves the ring.

    checked : numbers computed from the engine's model
    """
    return (
        f"the pulse gives the ring {checked.kick:.3g} m/s and closes the gap of "
        f"{scene.gap * 1e3:.3g} mm in {checked.closing * 1e3:.3g} ms; without blades "
        f"the ring would move {checked.reach:.3g} gaps far"
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
        f"{band.start * RPM:.0f} to {min(band.end, full) * RPM:.0f} rpm"
        for band in bands
    )
    return (
        f"free motion grows by itself at {spans}, without contact, by up to "
        f"{max(band.growth for band in bands):.3g} 1/s: no gap, friction or pulse "
        "changes that; raise suspension_damping or --frequency, or lower --speed"
    )


def _speeds(full: float) -> dict[str, str]:
    """Return the sweep of speeds of a new campaign file: start, stop, step, as texts.

    It has about `SPEEDS` speeds at round rpm.

    Parameters
    ----------
    full : full speed, rad/s
    """
    step = full * RPM / SPEEDS
    unit = 10.0 ** math.floor(math.log10(step))
    step = min((f * unit for f in (1, 2, 2.5, 5, 10)), key=lambda s: abs(s - step))
    last = math.floor(full * RPM / step + 1e-9) * step
    bounds = {"start": 2 * step, "stop": last, "step": step}
    return {name: f"{value:g} rpm" for name, value in bounds.items()}


def toml_of(fan: Fan, scene: Scene, checked: Checked) -> str:
    """Return the text of a fan's campaign file: the template with all values.

    Parameters
    ----------
    fan : dimensions of the fan
    scene : inputs of the fan's scene
    checked : numbers computed from the fan's model
    """
    rotor, casing = scene.engine.rotor, scene.engine.casing
    ring = {f"casing_{name}": value for name, value in casing.model_dump().items()}
    values = {
        **rotor.model_dump(), **ring, **scene.model_dump(),
        "material": fan.material,
        "rotation": scene.engine.rotation,
        "model": told_of_model(checked),
        "pulse_told": told_of_pulse(scene, checked).replace("; ", "\n# "),
        "full_rpm": f"{checked.full_speed * RPM:.4g}",
        "gap_mm": f"{1e3 * scene.gap:.4g}",
        "force_kn": f"{scene.force / 1e3:g}",
        "pulse_ms": f"{scene.pulse * 1e3:g}",
        "young": f"{rotor.young / 1e9:g}",
        "casing_young": f"{casing.young / 1e9:g}",
        "shaft": f"{rotor.centre_stiffness / 1e6:g}",
        "support_frequency": casing.support_frequency,
        "support_damping": casing.support_damping,
        "longest": 4 * scene.duration,
        "gaps": ", ".join(f'"{1e3 * part * scene.gap:.4g} mm"' for part in GAPS),
        **_speeds(checked.full_speed),
    }  # fmt: skip
    text = resources.files("hpcwhirl.cli").joinpath("new.template").read_text("utf-8")
    return aligned(Template(text).substitute(values))


def aligned(text: str) -> str:
    """Return the text of a TOML file with the comments that follow values aligned."""
    lines = []
    for line in text.splitlines():
        code, sign, note = line.partition("#")
        lines.append(
            f"{code.rstrip() + ' ':<{NOTES}}#{note}" if code and sign else line
        )
    return "\n".join([*lines, ""])
