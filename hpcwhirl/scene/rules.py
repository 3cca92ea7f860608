"""Rules between inputs of a scene, which hold for one case or for many at once.

A rule is arithmetic on scalars or arrays: a `Scene` evaluates it on the inputs of one
case, `batch_validation` on columns of cases. Each table of inputs lists its rules.
"""

from __future__ import annotations

import functools
import math
import operator
from collections.abc import Sequence
from typing import Any

from hpcwhirl.errors import shown
from hpcwhirl.scene import contact_laws
from hpcwhirl.scene.rule import Rule
from hpcwhirl.scene.schemes import STEPWISE, TURNING, either

AS_THE_REST = -1.0  # value of a damping ratio for "that of the other modes"
NO_BLADE = -1  # value of lost_blade for "none"
MOST_STEPS = 1e13  # largest number of steps of a case
MOST_GAP = 10.0  # largest ratio of gap to tip radius


def choose(condition: Any, yes: Any, no: Any) -> Any:
    """Return `yes` where a condition holds, else `no`; all scalars or (cases,)."""
    if isinstance(condition, bool):
        return yes if condition else no
    import numpy as np  # not needed for a single scene

    return np.where(condition, yes, no)


def end_time(duration: Any, revolutions: Any, speed: Any) -> Any:
    """Return the simulated time of a run, s: `revolutions` if > 0, else `duration`.

    Parameters
    ----------
    duration, revolutions, speed : s, 1 and rad/s, each a scalar or (cases,)
    """
    turns = revolutions > 0
    if turns is False:
        return duration
    if turns is True and isinstance(speed, int | float):
        return revolutions * 2 * math.pi / abs(speed)
    import numpy as np

    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        angle = np.asarray(revolutions, dtype=float) * 2 * math.pi
        return np.where(turns, angle / np.abs(np.asarray(speed, dtype=float)), duration)


def last_end(
    duration: Any, revolutions: Any, speed: Any, until: Any, longest: Any
) -> Any:
    """Return the simulated time at which a case ends at the latest, s."""
    end = end_time(duration, revolutions, speed)
    longer = (until == "decided") & (end < longest)
    return choose(longer, longest, end)


def _is_one(scheme: Any, names: Sequence[str]) -> Any:
    """Return whether a scheme is one of `names`; scheme : one, or (cases,)."""
    return functools.reduce(operator.or_, (scheme == name for name in names))


def _most_lobes(discretization: Any, elements: Any, harmonics: Any) -> Any:
    return choose(discretization == "elements", elements // 2, harmonics)


def _lobes_refused(
    _: Any, discretization: Any, elements: Any, harmonics: Any, lobes: Any
) -> str:
    most = _most_lobes(discretization, elements, harmonics)
    by_elements = discretization == "elements"
    what = f"{elements} elements" if by_elements else f"{harmonics} harmonics"
    return f"nodal_diameter must be <= {most} on a ring of {what}, got {lobes}"


STANDING = (  # inputs of supports that must be 0 unless rotation is full
    "cross_coupling",
    "stiffness_difference",
    "damping_difference",
    "film_viscosity",
)


def _told(usual: str | int) -> str | int:
    return "empty" if usual == "" else usual


def _of_turning(name: str, usual: str | int) -> Rule:
    """Return the rule that a rotor's input must be `usual` if rotation is none."""
    return Rule(
        ("rotation", f"rotor.{name}"),
        lambda rotation, value: (rotation != "none") | (value == usual),
        lambda _, value: (
            f"rotor.{name} must be {_told(usual)} where rotation is none, got"
            f" {shown(value)}"
        ),
    )


def _of_beams(name: str, usual: str | int) -> Rule:
    """Return the rule that a rotor's input must be `usual` with a rotor from file."""
    return Rule(
        ("file", f"rotor.{name}"),
        lambda file, value: (file == "") | (value == usual),
        lambda _, value: (
            f"rotor.{name} must be {_told(usual)} with a rotor from file, got"
            f" {shown(value)}"
        ),
    )


def _of_moving(name: str, usual: str | int) -> Rule:
    """Return the rule that an input must be `usual` if the centre is clamped."""
    return Rule(
        ("centre", name),
        lambda centre, value: (centre != "clamped") | (value == usual),
        lambda _, value: (
            f"{name} must be {_told(usual)} where centre is clamped, got {shown(value)}"
        ),
    )


def _beside_a_table(name: str, usual: str | int) -> Rule:
    """Return the rule that an input must be `usual` with a bearing's table."""
    return Rule(
        ("bearing", name),
        lambda bearing, value: (bearing == "") | (value == usual),
        lambda _, value: f"{name} must be {usual} with a bearing, got {value}",
    )


WHOLE = (  # (input of a rotor, value that it must have unless rotation is full)
    ("shaft", "springs"),
    ("lost_blade", NO_BLADE),
    ("bearing", ""),
)
TILTING = 3  # fewest blades of a disk that tilts
LASTS = ("duration", "revolutions", "speed", "solver.until", "solver.longest")
OF_ROTOR = (
    Rule(
        ("mistuning", "blades"),
        lambda count, blades: (count == 0) | (count == blades),
        lambda count, blades: (
            f"mistuning must be [] or {blades} numbers, one a blade, got {count}"
        ),
    ),
    Rule(
        ("disk_radius", "radius"),
        lambda rim, tip: rim < tip,
        lambda rim, tip: f"disk_radius must be < radius ({tip} m), got {rim}",
    ),
    *(_of_moving(name, 0) for name in STANDING[1:]),
    *(_of_moving(*one) for one in WHOLE),
    *(_beside_a_table(name, 0) for name in STANDING),
    _beside_a_table("shaft", "springs"),
    Rule(
        ("lost_blade", "blades"),
        lambda lost, blades: lost < blades,
        lambda lost, blades: f"lost_blade must be < blades ({blades}), got {lost}",
    ),
    Rule(
        ("blades", "shaft"),
        lambda blades, shaft: (blades >= TILTING) | (shaft == "springs"),
        lambda _, shaft: (
            f"shaft must be springs with fewer than {TILTING} blades, got {shaft}"
        ),
    ),
)
OF_CASING = (
    Rule(
        ("families", "discretization"),
        lambda families, kind: (
            (families == "all") | (kind == "fourier") | (kind == "shell")
        ),
        lambda families, kind: (
            f"families must be all on a ring of {kind}, got {families}"
        ),
    ),
    Rule(
        ("profile_release", "profile_rise"),
        lambda time, rise: (time == 0.0) | (time >= rise),
        lambda time, rise: (
            f"profile_release must be 0 or >= profile_rise ({rise} s), got {time}"
        ),
    ),
    Rule(
        ("profile_release", "kind", "discretization"),
        lambda time, kind, by: (time == 0.0) | ((kind == "ring") & (by == "fourier")),
        lambda time, kind, by: (
            "profile_release must be 0 where the casing is no ring of harmonics "
            f"(kind {kind}, discretization {by}), got {time}"
        ),
    ),
)
OF_ENGINE = (
    *(_of_turning(name, 0) for name in STANDING),
    *(_of_beams(*one) for one in WHOLE),
    *(_of_turning(*one) for one in WHOLE),
    Rule(
        ("rotation", "rotor.suspension_damping", "rotor.damping"),
        lambda rotation, own, least: (
            (rotation == "none") | (own == AS_THE_REST) | (own >= least)
        ),
        lambda _, own, least: (
            f"rotor.suspension_damping must be >= damping ({least}), "
            "or -1, where rotation is not none: the excess is due to a damper that "
            f"does not rotate, got {own}"
        ),
    ),
    Rule(
        ("file", "rotor.mistuning"),
        lambda file, count: (file == "") | (count == 0),
        lambda file, _: (
            f"rotor.mistuning must be [] with a rotor from file, got {file}"
        ),
    ),
    Rule(
        ("casing.discretization", "file"),
        lambda kind, file: (kind != "file") | (file != ""),
        lambda *_: "file must be named where casing.discretization is file, got none",
    ),
)
# inputs by which speed or gap change in time, and their values where they do not
CHANGING = {"acceleration": 0.0, "speed_table": "", "gap_closure": 0.0, "gap_table": ""}


def _constant(acceleration: Any, table: Any) -> Any:
    return (acceleration == 0.0) & (table == "")


def _at_constant_speed(name: str, usual: Any) -> Rule:
    """Return the rule that an input must be `usual` where the speed changes."""
    return Rule(
        ("acceleration", "speed_table", name),
        lambda rate, table, value: _constant(rate, table) | (value == usual),
        lambda _, __, value: (
            f"{name} must be {_told(usual)} where the speed changes (acceleration, "
            f"speed_table), got {shown(value)}"
        ),
    )


def _unchanged(name: str, usual: Any, note: str = "") -> Rule:
    """Return the rule that an input must be `usual` where speed or gap change.

    note : advice at the end of the message
    """
    return Rule(
        (*CHANGING, name),
        lambda rate, table, closure, gaps, value: (
            (_constant(rate, table) & (closure == 0.0) & (gaps == ""))
            | (value == usual)
        ),
        lambda *values: (
            f"{name} must be {_told(usual)} where speed or gap change in time "
            f"({', '.join(CHANGING)}), got {shown(values[-1])}{note}"
        ),
    )


def _leads(rate: Any, ramp: Any, speed: Any, end: Any) -> Any:
    return (rate == 0.0) | (ramp == "linear") | ((end - speed) * rate > 0.0)


OF_SCENE = (
    _at_constant_speed("revolutions", 0),
    _unchanged("output.chaos", 0),
    _unchanged("history", "", "; leave out [branch]"),
    Rule(
        ("history", "engine.casing.profile", "engine.casing.profile_scale",
         "engine.casing.offset"),
        lambda begun, table, scale, offset: (
            (begun == "") | (((table == "") | (scale == 0.0)) & (offset == 0.0))
        ),
        lambda begun, *_: (
            "history must be empty where the casing is not round (profile, offset), "
            f"got {shown(begun)}; leave out [branch]"
        ),
    ),
    Rule(
        ("acceleration", "speed_table", "engine.rotation"),
        lambda rate, table, rotation: _constant(rate, table) | (rotation != "auto"),
        lambda *_: "engine.rotation must be none or full where the speed changes, got "
        "auto",
    ),
    Rule(
        ("acceleration", "speed_table", "solver.until"),
        lambda rate, table, until: _constant(rate, table) | (until == "end"),
        lambda _, __, until: (
            f"solver.until must be end where the speed changes, got {until}"
        ),
    ),
    Rule(
        ("acceleration", "speed_table"),
        lambda rate, table: (rate == 0.0) | (table == ""),
        lambda rate, _: f"acceleration must be 0 with a speed_table, got {rate}",
    ),
    Rule(
        ("gap_closure", "gap_table"),
        lambda closure, table: (closure == 0.0) | (table == ""),
        lambda closure, _: f"gap_closure must be 0 with a gap_table, got {closure}",
    ),
    Rule(
        (*CHANGING, "solver.scheme"),
        lambda rate, table, closure, gaps, scheme: (
            _constant(rate, table) & (closure == 0.0) & (gaps == "")
        )
        | _is_one(scheme, STEPWISE),
        lambda *given: f"scheme must be {either(STEPWISE)} where speed or gap change "
        f"in time, got '{given[-1]}'",
    ),
    Rule(
        ("engine.casing.profile_release", "solver.scheme"),
        lambda time, scheme: (time == 0.0) | _is_one(scheme, STEPWISE),
        lambda _, scheme: f"scheme must be {either(STEPWISE)} where a casing is let go "
        f"(profile_release), got '{scheme}'",
    ),
    Rule(
        ("acceleration", "speed_table", "solver.scheme", "engine.rotation"),
        lambda rate, table, scheme, rotation: _constant(rate, table)
        | _is_one(scheme, TURNING)
        | (rotation == "none"),
        lambda *given: f"scheme must be {either(TURNING)} where the speed changes and "
        f"engine.rotation is full, got '{given[2]}'",
    ),
    Rule(
        ("acceleration", "ramp", "speed", "speed_to"),
        _leads,
        lambda rate, ramp, speed, end: (
            f"speed_to must lie ahead of speed ({speed} rad/s) in the direction of "
            f"acceleration ({rate} rad/s^2) where ramp is {ramp}, got {end}"
        ),
    ),
    Rule(
        ("engine.casing.kind", "engine.casing.discretization",
         "engine.casing.elements", "engine.casing.harmonics", "nodal_diameter"),
        lambda kind, by, elements, harmonics, lobes: (kind != "ring")
        | (lobes <= _most_lobes(by, elements, harmonics)),
        _lobes_refused,
    ),
    *contact_laws.RULES,
    _at_constant_speed("friction_law", "constant"),
    Rule(
        ("engine.rotation", "gap_at"),
        lambda rotation, at: (rotation != "none") | (at == "speed"),
        lambda _, at: (
            "gap_at must be speed where engine.rotation is none, in which tips do not "
            f"grow, got {at}"
        ),
    ),
    Rule(
        ("engine.rotation", "unbalance"),
        lambda rotation, load: (rotation != "none") | (load == 0.0),
        lambda _, load: (
            "unbalance must be 0 where engine.rotation is none, which has no critical "
            f"speed of an unbalance, got {load}"
        ),
    ),
    Rule(
        ("engine.rotor.centre", "unbalance"),
        lambda centre, load: (centre != "clamped") | (load == 0.0),
        lambda _, load: (
            f"unbalance must be 0 where engine.rotor.centre is clamped, got {load}"
        ),
    ),
    Rule(
        ("start_energy", "unbalance", "engine.rotor.lost_blade"),
        lambda energy, load, lost: (
            (energy == 0.0) | ((load == 0.0) & (lost == NO_BLADE))
        ),
        lambda energy, *_: (
            "start_energy must be 0 with an unbalance or a lost blade, which set the "
            f"initial motion, got {energy}"
        ),
    ),
    Rule(
        ("revolutions", "speed"),
        lambda revolutions, speed: (revolutions <= 0) | (speed != 0),
        lambda *_: "revolutions must be 0 where speed is 0, got revolutions > 0",
    ),
    Rule(
        (*LASTS, "solver.time_step"),
        lambda *given: last_end(*given[:-1]) <= MOST_STEPS * given[-1],
        lambda *given: f"time_step must be >= {last_end(*given[:-1]) / MOST_STEPS:.3g}"
        f" s ({MOST_STEPS:g} steps), got {given[-1]}",
    ),
    Rule(
        LASTS,
        lambda *given: (given[3] != "decided") | (given[4] >= end_time(*given[:3])),
        lambda *given: f"longest must be >= {end_time(*given[:3]):g} s (duration), "
        f"got {given[4]:g}",
    ),
    Rule(
        ("gap", "engine.rotor.radius"),
        lambda gap, radius: gap <= MOST_GAP * radius,
        lambda gap, radius: f"gap must be <= {MOST_GAP * radius:g} m, got {gap}",
    ),
)  # fmt: skip
