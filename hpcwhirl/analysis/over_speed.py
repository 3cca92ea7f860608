"""Words of a run whose speed or gap changes, for successive windows of its time.

The run is divided into equal windows. Each is judged like the last 40 % of a run at the
window's mean speed and gap: `regimes.evidence` reduces it to the same numbers, and the
same rules give its words. Neighbouring windows with the same words are joined to one
interval.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from hpcwhirl.analysis.regimes import (
    BLOCKS,
    STEADY_SHARE,
    Thresholds,
    evidence,
    name_regime,
)
from hpcwhirl.analysis.rotation import critical_of, unbalance_speeds_of
from hpcwhirl.case.resolve import Case
from hpcwhirl.case.speed import angle_at, extremes, law_of, schedule_of, speed_at
from hpcwhirl.case.unbalance import is_unbalanced
from hpcwhirl.dynamics.history import History, between
from hpcwhirl.scene import Scene
from hpcwhirl.scene.units import ANGULAR, shown_in

USUAL = Thresholds()
FEWEST = 4 * BLOCKS  # least number of rows of evidence in a window
LOOKS = 4096  # number of times of a run between which crossings are searched


class Spell(NamedTuple):
    """An interval of a run in which its words do not change.

    Attributes
    ----------
    begin, end : s, times at which the interval begins and ends
    first, last : rad/s, speeds at `begin` and at `end`
    regime, whirl : words in the interval; instead of the regime its outcome, such as
        unstable, if it has none
    """

    begin: float
    end: float
    first: float
    last: float
    regime: str
    whirl: str


def words_over_speed(case: Case, history: History) -> list[Spell]:
    """Return the intervals of a run in which its words do not change, in time order.

    case : the case, whose `output.windows` is the largest number of windows
    history : motion of the whole run
    """
    rows = len(history.judged.time)
    count = max(1, min(case.scene.output.windows, rows // FEWEST))
    ends = np.linspace(0.0, history.end, count + 1).tolist()
    out: list[Spell] = []
    for begin, end in pairwise(ends):
        words = _words(case, history, begin, end)
        first, last = (float(speed_at(case.scene, t)) for t in (begin, end))
        if out and (out[-1].regime, out[-1].whirl) == words:
            out[-1] = out[-1]._replace(end=end, last=last)
        else:
            out.append(Spell(begin, end, first, last, *words))
    return out


def _words(case: Case, history: History, begin: float, end: float) -> tuple[str, str]:
    """Return the words of one window of a run: its regime, or else outcome; its whirl.

    begin, end : s, of the window
    """
    start = max(end - (end - begin) / STEADY_SHARE, 0.0)
    part, last = between(history, start, end), end >= history.end
    angles = np.asarray(angle_at(case.scene, part.judged.time + start))
    scene = _held(case, begin, end)
    found = evidence(scene, part, angles) | {"stop": history.stop if last else "end"}
    outcome, regime, whirl = name_regime(found, USUAL)
    return (outcome if regime == "none" else regime), whirl


def _held(case: Case, begin: float, end: float) -> Scene:
    """Return the case's scene with the constant speed and gap of one window.

    They are the mean speed over the window, and the gap at its middle.

    begin, end : s, of the window
    """
    scene, middle = case.scene, 0.5 * (begin + end)
    schedule = schedule_of(scene, case.model)
    turned = float(angle_at(scene, end)) - float(angle_at(scene, begin))
    return scene.model_copy(
        update={
            "speed": turned / (end - begin),
            "gap": schedule.gap(middle) if schedule else scene.gap,
            "acceleration": 0.0,
            "speed_table": "",
        }
    )


def told_over_speed(spells: list[Spell]) -> str:
    """Return intervals as the text of a case's result `words_over_speed`.

    An example is ``0..0.5 s 100..150 rad/s damped none; ...``: times, speeds, regime
    and whirl of each interval.
    """
    return "; ".join(
        f"{one.begin:.4g}..{one.end:.4g} s {one.first:.5g}..{one.last:.5g} rad/s "
        f"{one.regime} {one.whirl}"
        for one in spells
    )


def in_shown_units(told: str) -> str:
    """Return the text of a case's result `words_over_speed` in the units shown.

    The speed of an interval in which it is constant is written once.

    told : text from `told_over_speed`, or ""
    """
    return "; ".join(
        f"{one.begin:.4g}..{one.end:.4g} s {speeds_told(one, '..')} "
        f"{one.regime} {one.whirl}"
        for one in spells_of(told)
    )


def speeds_told(one: Spell, to: str) -> str:
    """Return first and last speed of an interval in the unit shown, equal ones once.

    to : text between the two
    """
    unit, factor = shown_in(ANGULAR)
    ends = (f"{factor * end:.5g}" for end in (one.first, one.last))
    return f"{to.join(dict.fromkeys(ends))} {unit}"


def spells_of(told: str) -> list[Spell]:
    """Return the intervals in the text of a case's result `words_over_speed`.

    told : text from `told_over_speed`, or ""
    """
    out = []
    for part in told.split("; ") if told else []:
        times, _, speeds, _, regime, whirl = part.split(" ")
        numbers = [float(n) for span in (times, speeds) for n in span.split("..")]
        out.append(Spell._make([*numbers, regime, whirl]))
    return out


def crossings(case: Case) -> list[dict[str, Any]]:
    """Return the critical speeds that a run crosses, in the order of time.

    These are the speeds of Eq. (13) for the pulse's lobes, at which waves of rotor and
    casing coincide, and, for an unbalanced rotor, its undamped resonances.

    Returns
    -------
    a dict for each crossing: "of": "waves" (Eq. 13) or "unbalance" (resonance),
    "speed": rad/s, "time": s, "rising": whether the speed rises at that time
    """
    law, scene = law_of(case.scene), case.scene
    if law is None:
        return []
    k = scene.nodal_diameter
    waves = [one for one in critical_of(case, 1) if one["nodal_diameter"] == k]
    speeds = [("waves", float(one["speed"])) for one in waves]
    if is_unbalanced(scene):
        fastest = abs(extremes(scene)[1])
        own = unbalance_speeds_of(case, fastest)
        speeds += [("unbalance", speed) for speed in own]
    times = np.linspace(0.0, scene.end_time, LOOKS)
    path = np.abs(law.speed(times))
    out = []
    for of, speed in speeds:
        for i in np.flatnonzero((path[:-1] - speed) * (path[1:] - speed) < 0.0):
            share = (speed - path[i]) / (path[i + 1] - path[i])
            time = times[i] + share * (times[i + 1] - times[i])
            rising = bool(path[i + 1] > path[i])
            one = {"of": of, "speed": speed, "time": float(time), "rising": rising}
            out.append(one)
    return sorted(out, key=lambda one: one["time"])
