"""Warnings about valid inputs: of another unit, or without effect in this scene.

Each warning is evaluated on the columns of a campaign's table, without a scene per
case, and is one line, for any number of cases.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import reduce
from typing import Any, NamedTuple

import numpy as np

from hpcwhirl.scene.batch_validation import Columns, Condition, Many, end_times
from hpcwhirl.scene.inputs import Scene
from hpcwhirl.scene.quantities import INPUTS
from hpcwhirl.scene.rules import CHANGING
from hpcwhirl.scene.table import Table

MOST_FRICTION = 1.0  # largest coefficient without a warning; dry metals: 0.1 to 0.8
MOST_TIP_SPEED = 1000.0  # m/s, largest without a warning; engines, turbines: 300 to 600
MOST_SLENDER = 0.5  # largest ratio of a film's length to diameter that counts as short
MOST_GAPS = 5.0  # largest motion of the casing by the pulse, in gaps, without a warning
MOST_GAP = 0.05  # largest gap / tip radius without a warning; engines: 0.001 to 0.005
MOST_RADIUS = 10.0  # m, largest tip radius without a warning; fans: below 2
LEAST_YOUNG = 1e8  # Pa, least modulus without a warning; metals: 4e10 to 4e11
LEAST_DENSITY = 200.0  # kg/m^3, least without a warning; composites: 1500
# inputs by which a scene changes in time, and their values where it does not
IN_TIME = CHANGING | {"lost_blade_time": 0.0}
RPM = 30.0 / math.pi  # rpm per rad/s


class _Remark(NamedTuple):
    """A possible warning: inputs on which it depends, its condition, its text.

    Condition and text are functions of a function from an input's name to its values.
    """

    inputs: tuple[str, ...]
    holds: Condition
    words: Callable[[Columns], str]


def _has_section(get: Columns) -> Any:
    ring = np.equal(get("engine.casing.kind"), "ring")
    return ring & np.not_equal(get("engine.casing.discretization"), "file")


def _is_beams(get: Columns) -> Any:
    return np.equal(get("engine.file"), "")


def _is_changing(get: Columns) -> Any:
    parts = (np.not_equal(get(name), usual) for name, usual in IN_TIME.items())
    return reduce(np.logical_or, parts)


def _too_small(name: str, least: float, where: Condition, remedy: str) -> _Remark:
    """Return the warning on a constant of a material that is below `least`.

    Parameters
    ----------
    name : dotted name of the input
    least : least value without a warning
    where : condition for the input to count
    remedy : beginning of a text with the unit that was meant
    """
    part = name.removeprefix("engine.")
    unit = INPUTS[name].unit
    return _Remark(
        (name, "engine.file", "engine.casing.kind", "engine.casing.discretization"),
        lambda get: where(get) & (np.asarray(get(name), dtype=float) < least),
        lambda get: (
            f"{part} is {get(name):g} {unit}: in SI, or as a text, "
            f'{name.rpartition(".")[2]} = "{get(name):g} {remedy}"'
        ),
    )


def _outlasts(get: Columns) -> Any:
    loaded = np.equal(get("engine.casing.kind"), "ring") & np.greater(get("force"), 0)
    return loaded & (np.asarray(get("pulse")) >= end_times(get))


def _tip_speed(get: Columns) -> Any:
    radius = np.asarray(get("engine.rotor.radius"), dtype=float)
    return np.abs(np.asarray(get("speed"), dtype=float)) * radius


def _pushed(get: Columns) -> Any:
    """Estimate how far the pulse has moved an elastic casing at its end, m.

    There is no contact.

    The mode w = cos k theta, u = -sin k theta / k has m = pi R rho A (1 + 1 / k^2) and
    omega^2 = (k^2 - 1)^2 k^2 / (k^2 + 1) E I / (rho A R^4) + omega_c1^2 of the support;
    that of k = 0 has m = 2 pi R rho A and omega^2 = E / (rho R^2) + omega_c1^2.
    F sin(pi t / tau) moves a free mass by F tau^2 / (pi m), and a mass on a spring by
    at most 1.77 F / (m omega^2); the estimate is the smaller one.
    """

    def of(name: str) -> Any:
        return np.asarray(get(name), dtype=float)

    ring = "engine.casing."
    k, radius = of("nodal_diameter"), of("engine.rotor.radius")
    thick, pulse = of(ring + "thickness"), of("pulse")
    line = of(ring + "density") * of(ring + "width") * thick
    breathes = k == 0
    mass = math.pi * radius * line * (1.0 + np.where(breathes, 1.0, k) ** -2.0)
    bend = of(ring + "young") * of(ring + "width") * thick**3 / 12.0
    stiff = (k**2 - 1.0) ** 2 * k**2 / (k**2 + 1.0) * bend / (line * radius**4)
    hoop = of(ring + "young") / (of(ring + "density") * radius**2)
    stiff = np.where(breathes, hoop, stiff) + of(ring + "support_frequency") ** 2
    free = of("force") * pulse**2 / (math.pi * mass)
    with np.errstate(divide="ignore"):
        return np.minimum(free, 1.77 * of("force") / (mass * stiff))


def _overloads(get: Columns) -> Any:
    gap = np.asarray(get("gap"), dtype=float)
    return _has_section(get) & (gap > 0.0) & (_pushed(get) > MOST_GAPS * gap)


_REMARKS = (
    _Remark(
        ("friction",),
        lambda get: np.greater(get("friction"), MOST_FRICTION),
        lambda get: (
            f"friction is {get('friction'):g}: it is a coefficient, not a percentage"
        ),
    ),
    _Remark(
        ("gap", "engine.rotor.radius"),
        lambda get: np.asarray(get("gap"), dtype=float) > MOST_GAP * np.asarray(
            get("engine.rotor.radius"), dtype=float
        ),
        lambda get: f"gap is {get('gap'):g} m, the tip radius "
        f"{get('engine.rotor.radius'):g} m: lengths are in m, or texts with a unit, as "
        "gap = \"0.8 mm\"",
    ),
    _too_small("engine.rotor.young", LEAST_YOUNG, _is_beams, "GPa"),
    _too_small("engine.rotor.density", LEAST_DENSITY, _is_beams, "g/cm^3"),
    _too_small("engine.casing.young", LEAST_YOUNG, _has_section, "GPa"),
    _too_small("engine.casing.density", LEAST_DENSITY, _has_section, "g/cm^3"),
    _Remark(
        ("speed", "engine.rotor.radius"),
        lambda get: _tip_speed(get) > MOST_TIP_SPEED,
        lambda get: f"speed is {get('speed'):g} rad/s, {_tip_speed(get):.0f} m/s at the"
        f" tips: {get('speed'):g} rpm would be {get('speed') / RPM:.4g}",
    ),
    _Remark(
        ("engine.rotor.radius", "engine.file"),
        lambda get: _is_beams(get)
        & (np.asarray(get("engine.rotor.radius"), dtype=float) > MOST_RADIUS),
        lambda get: f"the tip radius is {get('engine.rotor.radius'):g} m: lengths are "
        "in m, or texts with a unit, as radius = \"600 mm\"",
    ),
    _Remark(
        ("acceleration", "speed_to"),
        lambda get: np.equal(get("acceleration"), 0.0) & np.not_equal(
            get("speed_to"), 0.0
        ),
        lambda get: f"speed_to is {get('speed_to'):g} rad/s, but acceleration is 0: "
        "the speed does not go there",
    ),
    _Remark(
        ("solver.until", *IN_TIME),
        lambda get: np.equal(get("solver.until"), "decided") & _is_changing(get),
        lambda _: 'solver.until = "decided" gives way to "end" where speed or gap '
        "changes, or a blade is lost, in time",
    ),
    _Remark(
        ("pulse", "force", "duration", "revolutions", "speed", "engine.casing.kind"),
        _outlasts,
        lambda get: f"pulse is {get('pulse'):g} s, the run {end_times(get):g} s: the "
        "load lasts as long as the run or longer",
    ),
    _Remark(
        ("engine.rotor.film_viscosity", "engine.rotor.film_length",
         "engine.rotor.film_radius"),
        lambda get: np.greater(get("engine.rotor.film_viscosity"), 0.0) & np.greater(
            get("engine.rotor.film_length"),
            MOST_SLENDER * 2.0 * np.asarray(get("engine.rotor.film_radius")),
        ),
        lambda get: f"film_length is {get('engine.rotor.film_length'):g} m, more than "
        f"{MOST_SLENDER:g} of the film's diameter: the damping is computed for a short "
        "film, and too large for this one",
    ),
    _Remark(
        ("engine.casing.thickness", "engine.rotor.radius", "engine.casing.kind",
         "engine.casing.discretization"),
        lambda get: _has_section(get)
        & np.greater(get("engine.casing.thickness"), get("engine.rotor.radius")),
        lambda get: f"casing.thickness is {get('engine.casing.thickness'):g} m, the tip"
        f" radius {get('engine.rotor.radius'):g} m: lengths are in m",
    ),
)  # fmt: skip


_LOAD = _Remark(
    ("force", "pulse", "gap", "nodal_diameter", "engine.rotor.radius",
     *(f"engine.casing.{n}" for n in ("kind", "discretization", "thickness",
       "width", "density", "young", "support_frequency"))),
    _overloads,
    lambda get: f"force is {get('force'):g} N for {get('pulse'):g} s: this pulse alone "
    f"moves the casing by some {_pushed(get):.2g} m, "
    f"{_pushed(get) / get('gap'):.0f} gaps, before it ends, a usual pulse by "
    "about one gap; lower force or pulse",
)  # fmt: skip


def remarks(cases: Many | Scene, *, load: bool = False) -> list[str]:
    """Return the warnings on a campaign's or a scene's inputs, one line each.

    A warning is on an input that looks as if given in another unit.

    Parameters
    ----------
    cases : valid cases of a campaign, or one scene
    load : whether to warn, too, if the pulse moves the casing by many gaps
    """
    table = (_LOAD, *_REMARKS) if load else _REMARKS
    many = Many(cases, Table.of([{}])) if isinstance(cases, Scene) else cases
    with np.errstate(over="ignore"):
        return [line for remark in table if (line := _line(remark, many))]


def _line(remark: _Remark, many: Many) -> str:
    """Return a warning for the first case to which it applies; "" if to none."""
    case = many.first_where(remark.holds, remark.inputs)
    if case is None:
        return ""
    values = many.all(np.array([case]))
    words = remark.words(lambda name: np.asarray(values(name)).ravel()[0])
    varied = any(name in many.columns for name in remark.inputs)
    return f"{words} (as in case {case})" if varied else words
