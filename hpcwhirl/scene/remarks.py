"""What of valid inputs looks like another unit than theirs: told, never refused.

Each remark is arithmetic on the columns of a design, so that a million cases cost no
scene, and one line, however many cases it is true of.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from hpcwhirl.scene.inputs import Scene
from hpcwhirl.scene.many import Columns, Many, Rule, end_times
from hpcwhirl.scene.table import Table

MOST_FRICTION = 1.0  # dry metal on metal: 0.1 to 0.8
MOST_TIP_SPEED = 1000.0  # m/s; engines and turbines: 300 to 600
RPM = 30.0 / math.pi


class _Remark(NamedTuple):
    """A remark: of which inputs, when, and its words."""

    inputs: tuple[str, ...]
    holds: Rule
    words: Callable[[Columns], str]


def _has_section(get: Columns) -> Any:
    ring = np.equal(get("engine.casing.kind"), "ring")
    return ring & np.not_equal(get("engine.casing.discretization"), "file")


def _outlasts(get: Columns) -> Any:
    loaded = np.equal(get("engine.casing.kind"), "ring") & np.greater(get("force"), 0)
    return loaded & (np.asarray(get("pulse")) >= end_times(get))


def _tip_speed(get: Columns) -> Any:
    radius = np.asarray(get("engine.rotor.radius"), dtype=float)
    return np.abs(np.asarray(get("speed"), dtype=float)) * radius


_REMARKS = (
    _Remark(
        ("friction",),
        lambda get: np.greater(get("friction"), MOST_FRICTION),
        lambda get: f"friction is {get('friction'):g}: it is a coefficient, no percent",
    ),
    _Remark(
        ("speed", "engine.rotor.radius"),
        lambda get: _tip_speed(get) > MOST_TIP_SPEED,
        lambda get: f"speed is {get('speed'):g} rad/s, {_tip_speed(get):.0f} m/s at the"
        f" tips: {get('speed'):g} rpm would be {get('speed') / RPM:.4g}",
    ),
    _Remark(
        ("pulse", "force", "duration", "revolutions", "speed", "engine.casing.kind"),
        _outlasts,
        lambda get: f"pulse is {get('pulse'):g} s, the run {end_times(get):g} s: the "
        "load lasts as long as the run or longer",
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


def remarks(cases: Many | Scene) -> list[str]:
    """Return lines on what looks like another unit, each once for all cases.

    Parameters
    ----------
    cases : valid ones, or one scene
    """
    many = Many(cases, Table.of([{}])) if isinstance(cases, Scene) else cases
    with np.errstate(over="ignore"):
        return [told for remark in _REMARKS if (told := _told(remark, many))]


def _told(remark: _Remark, many: Many) -> str:
    """Return the words on the first case that a remark is true of, "" for none."""
    case = many.first_where(remark.holds, remark.inputs)
    if case is None:
        return ""
    values = many.all(np.array([case]))
    words = remark.words(lambda name: np.asarray(values(name)).ravel()[0])
    varied = any(name in many.columns for name in remark.inputs)
    return f"{words} (as in case {case})" if varied else words
