"""Rules between inputs of a scene, which hold for one case or for many at once.

A rule is arithmetic on scalars or arrays: a `Scene` evaluates it on the inputs of one
case, `batch_validation` on columns of cases. Each table of inputs lists its rules.
"""

from __future__ import annotations

import functools
import math
import operator
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from operator import attrgetter
from typing import Any, NamedTuple

from hpcwhirl.errors import shown
from hpcwhirl.scene.contact_laws import RIGID, rods_around
from hpcwhirl.scene.kept_tables import kept_rows
from hpcwhirl.scene.schemes import MODAL, either
from hpcwhirl.scene.shaft_tables import WORDS

AS_THE_REST = -1.0  # value of a damping ratio for "the ratio of the other modes"
NO_BLADE = -1  # value of lost_blade for "none"
MOST_STEPS = 1e13  # largest number of steps of a case
MOST_GAP = 10.0  # largest ratio of gap to tip radius
MOST_RODS = 10**6  # largest number of rods around a casing
TILTING = 3  # fewest blades of a disk that tilts
STANDING = (  # inputs of supports that must be 0 unless rotation is full
    "cross_coupling",
    "stiffness_difference",
    "damping_difference",
    "film_viscosity",
    "stop_clearance",
)
WHOLE = (  # (input of a rotor, value that it must have unless rotation is full)
    ("shaft", "springs"),
    ("lost_blade", NO_BLADE),
    ("bearing", ""),
)
# inputs by which speed or gap change in time, and their values where they do not
CHANGING: dict[str, Any] = {
    "acceleration": 0.0, "speed_table": "", "gap_closure": 0.0, "gap_table": "",
}  # fmt: skip
# inputs from which `last_end` follows
LASTS = (
    "duration", "revolutions", "speed", "solver.until", "solver.longest",
    "lost_blade_time", *CHANGING,
)  # fmt: skip
SPEED = ("acceleration", "speed_table")  # inputs by which the speed changes
# inputs that set the time step: a given one is used, and judged, if accuracy is 0;
# else `case.limits` judges the step that accuracy chooses
STEP = ("solver.accuracy", "solver.time_step")


@dataclass(frozen=True)
class Rule:
    """A condition on several inputs of a table, or of tables inside it.

    Attributes
    ----------
    inputs : dotted names of the inputs, relative to the table
    holds : function that returns whether their values, scalars or (cases,), are
        allowed; a list is passed as its length
    message : function from the values of a case that breaks the rule to the text of
        its error
    """

    inputs: tuple[str, ...]
    holds: Callable[..., Any]
    message: Callable[..., str]

    @cached_property
    def _read(self) -> attrgetter[tuple[Any, ...]]:
        return attrgetter(*self.inputs)

    def check(self, table: object) -> None:
        """Raise ValueError, with the rule's message, if inputs of a table break it.

        table : object with the inputs as attributes, such as a `Scene`
        """
        values = [len(v) if isinstance(v, tuple) else v for v in self._read(table)]
        if not self.holds(*values):
            raise ValueError(self.message(*values))


def choose(condition: Any, yes: Any, no: Any) -> Any:
    """Return `yes` where `condition` holds, else `no`; all are scalars or (cases,)."""
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


def last_end(*given: Any) -> Any:
    """Return the latest simulated time, s, at which a case may end, by its inputs.

    It is `end_time`, or with `until` = "decided" the input `longest`, s, if that is
    later, unless speed, gap or rotor change in time.

    given : the inputs `LASTS`, scalars or (cases,)
    """
    duration, revolutions, speed, until, longest, lost = given[:6]
    end = end_time(duration, revolutions, speed)
    longer = (until == "decided") & (end < longest)
    return choose(longer & (lost == 0.0) & _unchanged(*given[6:]), longest, end)


class Unless(NamedTuple):
    """An exception to a rule: a condition on other inputs that permits any value.

    Attributes
    ----------
    told : when it does not hold, for the message, such as "with a bearing"; a {} stands
        for the value of an input
    inputs : dotted names of the other inputs
    holds : function from their values to whether the condition holds
    """

    told: str
    inputs: tuple[str, ...]
    holds: Callable[..., Any]


def must_be(
    usual: Any,
    name: str,
    unless: Unless,
    *,
    so: str = "",
    note: str = "",
    got: Callable[[Any], str] = shown,
) -> Rule:
    """Return the rule that an input must be `usual` unless a condition holds.

    Parameters
    ----------
    usual, name : the only allowed value, unless the condition holds; the input's name
    unless : condition under which the input may have other values
    so, note : text in the message after the allowed value; advice at its end
    got : function from the refused value to its text
    """
    told = f"{name} must be {'empty' if usual == '' else usual}{so}"
    return Rule(
        (*unless.inputs, name),
        lambda *values: unless.holds(*values[:-1]) | (values[-1] == usual),
        lambda *values: (
            f"{told} {unless.told.format(*values)}, got {got(values[-1])}{note}"
        ),
    )


def _scheme_of(names: Sequence[str], unless: Unless) -> Rule:
    """Return the rule that solver.scheme is one of `names` unless a condition holds."""
    return Rule(
        (*unless.inputs, "solver.scheme"),
        lambda *values: functools.reduce(
            operator.or_,
            (values[-1] == name for name in names),
            unless.holds(*values[:-1]),
        ),
        lambda *values: (
            f"scheme must be {either(names)} {unless.told}, got '{values[-1]}'"
        ),
    )


def _constant(acceleration: Any, table: Any) -> Any:
    return (acceleration == 0.0) & (table == "")


def _unchanged(rate: Any, table: Any, closure: Any, gaps: Any) -> Any:
    return _constant(rate, table) & (closure == 0.0) & (gaps == "")


def _is(usual: Any) -> Callable[[Any], Any]:
    """Return the function that tells whether a value equals `usual`."""
    return lambda value: value == usual


def _is_not(word: str) -> Callable[[Any], Any]:
    return lambda value: value != word


def _most_lobes(discretization: Any, elements: Any, harmonics: Any) -> Any:
    return choose(discretization == "elements", elements // 2, harmonics)


def _lobes_refused(
    _: Any, discretization: Any, elements: Any, harmonics: Any, lobes: Any
) -> str:
    most = _most_lobes(discretization, elements, harmonics)
    by_elements = discretization == "elements"
    what = f"{elements} elements" if by_elements else f"{harmonics} harmonics"
    return f"nodal_diameter must be <= {most} on a ring of {what}, got {lobes}"


def _leads(rate: Any, ramp: Any, speed: Any, end: Any) -> Any:
    """Return whether speed_to lies ahead; 0 of a linear change is "not given"."""
    endless = (ramp == "linear") & (end == 0.0)
    return (rate == 0.0) | endless | ((end - speed) * rate > 0.0)


def _led_astray(rate: float, ramp: str, speed: float, end: float) -> str:
    if end == speed:
        remedy = "speed is that at the start: lower it for a run-up"
    else:
        remedy = f"a run-{'up' if end > speed else 'down'} needs acceleration = {-rate}"
    return (
        f"speed_to must lie ahead of speed ({speed} rad/s) in the direction of "
        f"acceleration ({rate} rad/s^2) where ramp is {ramp}, got {end}: {remedy}"
    )


def _is_line(shaft: Any) -> Any:
    """Return whether a shaft has mass: it is none of the words of the input."""
    kinds = (shaft != word for word in WORDS)
    return functools.reduce(operator.and_, kinds)


def _short(value: Any) -> str:
    """Return an input's text in a message; of a stored table only its beginning."""
    return "a shaft with mass" if str(value).startswith("{") else shown(value)


ON_LINE = Unless(
    "with a shaft that has mass",
    ("shaft",),
    lambda shaft: functools.reduce(operator.or_, (shaft == word for word in WORDS)),
)
WITHOUT_LINE = Unless("without a shaft that has mass", ("shaft",), _is_line)
CLAMPED = Unless("where centre is clamped", ("centre",), _is_not("clamped"))
BY_TABLE = Unless("with a bearing", ("bearing",), _is(""))
AT_REST = Unless("where rotation is none", ("rotation",), _is_not("none"))
FROM_FILE = Unless("with a rotor from file", ("file",), _is(""))
STEADY_TOLD = Unless(
    f"where the speed changes ({', '.join(SPEED)})", SPEED, _constant
)  # fmt: skip
STILL_TOLD = Unless(
    f"where speed or gap change in time ({', '.join(CHANGING)})", (*CHANGING,),
    _unchanged,
)  # fmt: skip
WHOLE_RUN = Unless("where a blade is lost during the run (lost_blade_time)",
    ("lost_blade_time",), lambda time: time == 0.0)  # fmt: skip
LAW = "engine.casing.contact_law"
NO_LAYER = Unless("where casing.contact_law is {}", (LAW,), _is(RIGID))
# fmt: off
OF_ROTOR = (
    Rule(("mistuning", "blades"),
        lambda count, blades: (count == 0) | (count == blades),
        lambda count, blades:
            f"mistuning must be [] or {blades} numbers, one per blade, got {count}"),
    Rule(("disk_radius", "radius"),
        lambda rim, tip: rim < tip,
        lambda rim, tip: f"disk_radius must be < radius ({tip} m), got {rim}"),
    *(must_be(0, name, CLAMPED) for name in STANDING[1:]),
    *(must_be(usual, name, CLAMPED, got=_short) for name, usual in WHOLE),
    *(must_be(0, name, BY_TABLE) for name in STANDING),
    must_be("springs", "shaft", BY_TABLE, got=_short),
    *(must_be(0, name, ON_LINE) for name in STANDING[1:3]),
    must_be(0, "shaft_station", WITHOUT_LINE),
    Rule(("lost_blade", "blades"),
        lambda lost, blades: lost < blades,
        lambda lost, blades: f"lost_blade must be < blades ({blades}), got {lost}"),
    Rule(("polar_inertia", "tilt_inertia"),  # so of any body with two equal diameters
        lambda polar, tilt: (polar == 0.0) | (tilt == 0.0) | (polar <= 2.0 * tilt),
        lambda polar, tilt:
            f"polar_inertia must be <= 2 tilt_inertia ({2.0 * tilt} kg m^2), as of any "
            f"disk, got {polar}"),
    must_be("springs", "shaft", Unless(f"with fewer than {TILTING} blades",
        ("blades",), lambda blades: blades >= TILTING), got=_short),
)
OF_CASING = (
    must_be("all", "families", Unless("on a ring of {}", ("discretization",),
        lambda by: (by == "fourier") | (by == "shell")), got=str),
    Rule(("profile_release", "profile_rise"),
        lambda time, rise: (time == 0.0) | (time >= rise),
        lambda time, rise:
            f"profile_release must be 0 or >= profile_rise ({rise} s), got {time}"),
    must_be(0, "profile_release", Unless("where the casing cannot swing (kind {})",
        ("kind",), lambda kind: kind == "ring")),
)
OF_ENGINE = (
    *(must_be(0, f"rotor.{name}", AT_REST) for name in STANDING),
    *(must_be(usual, f"rotor.{n}", FROM_FILE, got=_short) for n, usual in WHOLE),
    *(must_be(usual, f"rotor.{n}", AT_REST, got=_short) for n, usual in WHOLE),
    Rule(("rotation", "rotor.suspension_damping", "rotor.damping", "rotor.centre",
          "file"),
        lambda rotation, own, least, centre, file:
            (rotation == "none") | (own == AS_THE_REST) | (own >= least)
            | ((centre == "clamped") & (file == "")),
        lambda _, own, least, *__: (
            f"rotor.suspension_damping must be >= damping ({least}), "
            "or -1, where rotation is not none: its excess over damping is due to a "
            f"damper that does not rotate, got {own}")),
    Rule(("file", "rotor.mistuning"),
        lambda file, count: (file == "") | (count == 0),
        lambda file, _:
            f"rotor.mistuning must be [] with a rotor from file, got {file}"),
    Rule(("casing.discretization", "file"),
        lambda kind, file: (kind != "file") | (file != ""),
        lambda *_: "file must be named where casing.discretization is file, got none"),
)


def _first_of(table: Any) -> Any:
    """Return the value with which a table over time begins; nan: there is no table.

    table : the kept text of a table, or (cases,)
    """
    if isinstance(table, str):
        return kept_rows(table)[0][1] if table else math.nan
    import numpy as np  # not needed for a single scene

    first = {text: _first_of(text) for text in set(table.tolist())}
    return np.array([first[text] for text in table.tolist()])


def _begins_at(name: str) -> Rule:
    """Return the rule that an input is the value with which its table begins.

    name : "speed" or "gap"
    """
    return Rule((name, f"{name}_table"),
        lambda value, table: (table == "") | (_first_of(table) == value),
        lambda value, table:
            f"{name} must be {_first_of(table)!r}, the first of {name}_table, got "
            f"{value!r}")  # fmt: skip


OF_SCENE = (
    must_be(0, "revolutions", STEADY_TOLD),
    must_be(0, "output.chaos", STILL_TOLD),
    must_be("", "history", STILL_TOLD, note="; leave out [branch]"),
    must_be(0, "output.chaos", WHOLE_RUN),
    must_be("", "history", WHOLE_RUN, note="; leave out [branch]"),
    must_be(0, "lost_blade_time", Unless("where no blade is lost (lost_blade)",
        ("engine.rotor.lost_blade",), lambda lost: lost != NO_BLADE)),
    must_be("", "history", Unless("where the casing is not round (profile, offset)",
        ("engine.casing.profile", "engine.casing.profile_scale",
         "engine.casing.offset"),
        lambda table, scale, offset:
            ((table == "") | (scale == 0.0)) & (offset == 0.0)),
        note="; leave out [branch]"),
    Rule((*SPEED, "engine.rotation"),
        lambda rate, table, rotation: _constant(rate, table) | (rotation != "auto"),
        lambda *_:
            "engine.rotation must be none or full where the speed changes, got auto"),
    Rule((*SPEED, "solver.until"),
        lambda rate, table, until: _constant(rate, table) | (until != "certain"),
        lambda *_: "solver.until must be end or decided where the speed changes, got "
            "certain"),
    must_be(0, "acceleration", Unless("with a speed_table", SPEED[1:], _is(""))),
    must_be(0, "gap_closure", Unless("with a gap_table", ("gap_table",), _is(""))),
    _begins_at("speed"),
    _begins_at("gap"),
    _begins_at("friction"),
    must_be("", "friction_table", Unless("unless friction_law is table",
        ("friction_law",), _is("table"))),
    Rule(("friction_law", "friction_table"),
        lambda law, table: (law != "table") | (table != ""),
        lambda *_:
            "friction_table must be given where friction_law is table, got none"),
    _scheme_of(MODAL, Unless("where the speed changes and engine.rotation is full",
        (*SPEED, "engine.rotation"),
        lambda rate, table, rotation: _constant(rate, table) | (rotation == "none"))),
    Rule(("acceleration", "ramp", "speed", "speed_to"),
        _leads, _led_astray),
    Rule(("engine.casing.kind", "engine.casing.discretization",
         "engine.casing.elements", "engine.casing.harmonics", "nodal_diameter"),
        lambda kind, by, elements, harmonics, lobes:
            (kind != "ring") | (lobes <= _most_lobes(by, elements, harmonics)),
        _lobes_refused),
    Rule((LAW, "engine.casing.layer_edge", "engine.rotor.radius",
         "engine.rotor.blades"),
        lambda law, edge, radius, blades:
            (law == RIGID) | (edge * blades <= math.pi * radius),
        lambda _, edge, radius, blades: (
            f"layer_edge must be <= {math.pi * radius / blades:.4g} m, half the "
            f"distance of two tips, got {edge}")),
    Rule((LAW, "engine.casing.layer_edge", "engine.rotor.radius",
         "engine.casing.layer_rods"),
        lambda law, edge, radius, rods:
            (law == RIGID) | (rods_around(edge, radius, rods) <= MOST_RODS),
        lambda _, edge, radius, rods: (
            f"layer_rods must be <= {int(MOST_RODS * edge / radius / 6.3)}"
            f" with a layer_edge of {edge} m, got {rods}")),
    Rule((LAW, "engine.casing.layer_edge", "engine.rotor.radius", "speed",
         *STEP),
        lambda law, edge, radius, speed, accuracy, step:
            (law == RIGID) | (accuracy > 0.0) | (radius * abs(speed) * step <= edge),
        lambda _, edge, radius, speed, __, step: (
            f"time_step must be <= {edge / (radius * abs(speed)):.4g} s, in which a "
            f"tip moves by layer_edge, got {step}")),
    must_be(0, "output.chaos", NO_LAYER),
    must_be("", "history", NO_LAYER, so=", so no [branch],"),
    must_be("speed", "gap_at", Unless(
        "where engine.rotation is none, in which tips do not grow",
        ("engine.rotation",), _is_not("none")), got=str),
    must_be(0, "unbalance", Unless(
        "where engine.rotation is none, which has no critical speed of an unbalance",
        ("engine.rotation",), _is_not("none"))),
    must_be(0, "gravity", Unless(
        "where engine.rotation is none, in which a load that does not turn with the "
        "rotor would meet modes at rest",
        ("engine.rotation",), _is_not("none"))),
    must_be(0, "gravity", Unless("where engine.rotor.centre is clamped",
        ("engine.rotor.centre",), _is_not("clamped"))),
    must_be(0, "gravity", Unless(
        "with scheme paper, whose coordinates are measured from a place that turns "
        "with the rotor", ("solver.scheme",), _is_not("paper"))),
    must_be(0, "unbalance", Unless("where engine.rotor.centre is clamped",
        ("engine.rotor.centre",), _is_not("clamped"))),
    Rule(("revolutions", "speed"),
        lambda revolutions, speed: (revolutions <= 0) | (speed != 0),
        lambda *_: "revolutions must be 0 where speed is 0, got revolutions > 0"),
    Rule((*LASTS, *STEP),
        lambda *given:
            (given[-2] > 0.0) | (last_end(*given[:-2]) <= MOST_STEPS * given[-1]),
        lambda *given:
            f"time_step must be >= {last_end(*given[:-2]) / MOST_STEPS:.3g}"
            f" s (a run of {last_end(*given[:-2]):g} s has at most {MOST_STEPS:g} "
            f"steps), got {given[-1]}"),
    Rule(LASTS,
        lambda *given: (given[3] != "decided") | (given[4] >= end_time(*given[:3])),
        lambda *given: f"longest must be >= {end_time(*given[:3]):g} s (duration), "
            f"got {given[4]:g}"),
    Rule(("gap", "engine.rotor.radius"),
        lambda gap, radius: gap <= MOST_GAP * radius,
        lambda gap, radius: f"gap must be <= {MOST_GAP * radius:g} m, got {gap}"),
)
