"""Compute one case, from its scene to numbers, words and traces, without MPI or files.

A case of a branch begins with the last motion of another case. This motion depends on
the case's inputs only: its `history` names the preceding cases. A campaign stores the
last motion of each case of a branch until the next case has ended, too. If it is lost,
the preceding cases are integrated again, with the same result. A case that diverges,
that does not run to its end, or that cannot be integrated leaves no motion: the next
one begins anew, with its pulse.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.analysis.blade_motion import blade_numbers, wear_numbers
from hpcwhirl.analysis.chaos import motion_numbers, twins_of
from hpcwhirl.analysis.estimate import NO_COARSE, estimated, told_of_estimate
from hpcwhirl.analysis.over_speed import told_over_speed, words_over_speed
from hpcwhirl.analysis.regimes import (
    STEADY_SHARE,
    MotionThresholds,
    Thresholds,
    evidence,
    name_regime,
)
from hpcwhirl.analysis.rules import motion_of
from hpcwhirl.analysis.shaft_numbers import loss_numbers, shaft_numbers
from hpcwhirl.analysis.whirl import static_frame
from hpcwhirl.case.bounds import lean_checked, told_beyond
from hpcwhirl.case.coarser import coarser
from hpcwhirl.case.handover import TOLD as HANDED_OVER
from hpcwhirl.case.limits import told_of_film
from hpcwhirl.case.profile import told_of_profile
from hpcwhirl.case.resolve import Case, resolve
from hpcwhirl.case.speed import angle_at, changes
from hpcwhirl.dynamics.bodies.motion import Motion
from hpcwhirl.dynamics.bodies.operators import wears
from hpcwhirl.dynamics.history import LEDGER_TERMS, History
from hpcwhirl.dynamics.march import March
from hpcwhirl.dynamics.side_by_side import SideBySide
from hpcwhirl.dynamics.snapshot import Arrays, fingerprint, restore, snapshot
from hpcwhirl.errors import InputError, shown
from hpcwhirl.reduction.numbers import one_thread
from hpcwhirl.scene import Scene, apply_settings, case_before, digest
from hpcwhirl.scene.contact_laws import PERMANENT
from hpcwhirl.scene.inputs import OF_FILE
from hpcwhirl.scene.quantities import ROW
from hpcwhirl.scene.units import in_shown, with_unit
from hpcwhirl.scene.words import (
    BEYOND_FILM,
    BY_PULSE,
    BY_SPEED,
    GROWS,
    SLIDES_BACK,
    UNDISTURBED,
    is_open,
)

if TYPE_CHECKING:
    import xarray

    from hpcwhirl.campaign.compute import Checkpoints

Value = float | int | str
USUAL = Thresholds()
_LIMITS = asdict(MotionThresholds())
SCENE_ROW = "speed", "nodal_diameter", "gap", "friction", "force", "pulse"
WORDS = "outcome", "regime", "whirl", "motion"  # in the text of a result
NUMBERS = "speed", "gap", "friction", "orbit_radius", "growth_rate", "contacts"
HISTORY_ROW = "steps", "contacts", "contact_impulse", "centre_peak", "last_contact"
Begin = tuple[Case, Motion | None]
Ended = tuple[Mapping[str, Any], March]


@dataclass(frozen=True, repr=False)
class Result:
    """Result of a case: its numbers and words, and time histories (traces).

    Attributes
    ----------
    row : {variable: value}, numbers and words of the motion, the same bits on every
        computation
    traces : {name: array} of n samples; N blades, n_c contact points per tip, H
        harmonics, P stress points: `time` (n,), s; `centre` (n, 2), m, STATIC frame;
        `energy`, `fed`, `rubbed`, `lost` (n,), J; `impulse` (n,), N s; with full traces
        also `tips` (n, N, 2), m, rotating frame, `blade_impulse` (n, N), N s, and
        `casing` (n, H + 1, 2), m, STATIC frame, and with several contact points per tip
        `point_tips` (n, N, n_c, 2), `point_impulse` (n, N, n_c), and of a file with a
        stress matrix `stress` (n, N, P), Pa; where loads of the shaft are read,
        `support_force` (n, s, 2), N, STATIC frame, of s supports, and `shaft_torque`
        (n,), N m; empty if none are kept
    performance : {variable: value} that depend on the machine and its load, such as
        computing times
    notes : remarks on the case, as `hpcwhirl run` prints them
    scene : inputs of the case, of a result of `simulate`
    """

    row: dict[str, Value]
    traces: dict[str, NDArray[np.float64]]
    performance: dict[str, Value]
    notes: tuple[str, ...] = ()
    scene: Scene | None = None

    @property
    def dataset(self) -> xarray.Dataset:
        """Numbers, words and traces as xarray: units on each, traces over `time`.

        It has the form of `open_results(...).isel(case=i)`, read-only copies.
        """
        from hpcwhirl.campaign.measure import one_case  # which imports this module

        data = one_case(self.scene or Scene(), self.row, self.traces)
        return data.set_coords("time") if "time" in data else data

    def __repr__(self) -> str:
        """Return words, main numbers, names of traces and notes, a line for each."""
        lines = [f"Result: {told_in_short(self.row)}"]
        if self.traces:
            count = len(self.traces["time"]) if "time" in self.traces else 0
            lines.append(f"  traces of {count} samples: {', '.join(self.traces)}")
        lines.append(
            f"  {len(self.row)} numbers and words in `row`, with units in `dataset`"
        )
        return "\n".join([*lines, *(f"  {note}" for note in self.notes)])

    def plot(self, *, transient: bool = False) -> Any:
        """Draw the orbit of the shaft's centre; return Matplotlib's axes.

        There are two axes, for the static and the rotating frame; the latter is left
        out if the speed or the gap changes in time.

        Parameters
        ----------
        transient : also draw the time before the window

        Raises
        ------
        InputError
            if no orbit was kept, as with traces = "summary"
        """
        if not _DRAWN_BY:
            msg = "results are drawn by hpcwhirl.report: take simulate from hpcwhirl"
            raise InputError(msg)
        return _DRAWN_BY[-1](self, transient=transient)

    def _repr_html_(self) -> str:
        """Return words and numbers of the case as an HTML table, for a notebook."""
        lines = [
            f"<tr><th>{escape(name)}</th><td>"
            f"{escape(f'{value:.6g}' if isinstance(value, float) else str(value))}</td>"
            f"<td>{escape(with_unit('', ROW[name].unit if name in ROW else '', ''))}"
            "</td></tr>"
            for name, value in self.row.items()
        ]
        told = "".join(f"<p>{escape(note)}</p>" for note in self.notes)
        return f"<table>{''.join(lines)}</table>{told}"


_DRAWN_BY: list[Callable[..., Any]] = []  # what `draw_results_by` has registered


def draw_results_by(draw: Callable[..., Any]) -> None:
    """Register how a result is drawn: rooms above this one draw pictures.

    draw : takes a `Result` and `transient`, returns axes
    """
    _DRAWN_BY.append(draw)


def told_in_short(row: Mapping[str, Value]) -> str:
    """Return words and main numbers of a case as text, in the units shown."""
    words = [f"{name} {row[name]}" for name in WORDS if row.get(name)]
    numbers = (name for name in NUMBERS if isinstance(row.get(name), int | float))
    parts = [
        f"{name} = {in_shown(float(row[name]), ROW[name].unit)}" for name in numbers
    ]
    return ", ".join([*words, *parts])


def simulate(scene: Scene, between_slices: Callable[[], None] | None = None) -> Result:
    """Integrate one scene and determine its regime.

    Parameters
    ----------
    scene
        the case
    between_slices
        function called about every 10 ms; may raise to end the case

    Raises
    ------
    InputError
        if the scene cannot be integrated, e.g. because its time step is above the limit
    """
    _check_scene(scene)
    result = course_of(scene, between_slices).run(between_slices)
    return replace(result, notes=tuple(notes_on(scene, result.row)), scene=scene)


def _check_scene(given: Any) -> None:
    """Raise InputError for anything but a scene."""
    if isinstance(given, Scene):
        return
    hint = " (of a mapping: Scene(**mapping))" if isinstance(given, Mapping) else ""
    if isinstance(given, str | Path):
        hint = OF_FILE
    raise InputError(f"simulate takes a Scene{hint}, got {shown(given)}")


def course_of(scene: Scene, between_slices: Callable[[], None] | None = None) -> Course:
    """Return the integration of a scene, before its first step.

    If the scene continues a branch, the preceding cases are integrated here.

    Parameters
    ----------
    scene : inputs of the case
    between_slices : function called about every 10 ms of the preceding cases'
        integration; may raise to end it
    """

    def march(case: Case, start: Motion | None) -> Ended:
        course = Course(case, start)
        return course.run(between_slices, measure=False).row, course.march

    return Course(*begun(resolve(scene), march))


class Course:
    """Integration of one case: to its end time, then to longer ones while undecided.

    The integration to one end time is a march. A case that lasts longer has, bit for
    bit, the row and the traces of a case with that duration: a longer march continues
    from the state at the last time at which evidence (the numbers that decide the word)
    was recorded, or starts anew if it would have been integrated differently (see
    `dynamics.snapshot.fingerprint`).

    Parameters
    ----------
    case : the case; its input `until` decides how long it is integrated
    start : the motion with which it begins, see `March`; None: at rest
    keep : whether `last` is stored for the longest march, too, for an extension

    Attributes
    ----------
    march : the integration to the present end time
    last : state of the march that gave the result, at the last time at which evidence
        was recorded; None if no longer march can continue from it
    twins : nearby motions that measure chaos after the end of the case; None at other
        times
    """

    @one_thread()
    def __init__(
        self, case: Case, start: Motion | None = None, *, keep: bool = True
    ) -> None:
        self.keep, self.start = keep, start
        self.case, self.ends = case, case.scene.end_times
        self.last: Arrays | None = None
        self.twins: SideBySide | None = None
        self.number, self.march = 0, self._march(0)

    def _march(self, number: int) -> March:
        """Return a new integration of the case, to one of its end times.

        number : index in `ends` of the end time
        """
        if number == 0:
            return March(self.case, self.start)
        settings: dict[str, Value] = {"until": "end", "revolutions": 0.0}
        settings["duration"] = self.ends[number]
        given = apply_settings(self.case.given, settings)
        return March(replace(self.case, given=given), self.start)

    @property
    def seconds(self) -> float:
        """Computing time of the case so far, with measuring chaos, s."""
        return self.march.seconds + (self.twins.seconds if self.twins else 0.0)

    @property
    def done(self) -> bool:
        """Whether the present end time is reached, and chaos is measured."""
        return self.march.done and self.twins is None

    @one_thread()
    def set_out(self, steps: int, total: int) -> None:
        """Choose the integration (march) to which a saved state of the case belongs.

        A case has one march for each of its end times.

        Parameters
        ----------
        steps : number of the time step of the saved state
        total : number of time steps of the march that it was saved from
        """
        marches = [self._march(number) for number in range(len(self.ends))]
        same = [n for n, march in enumerate(marches) if march.total == total]
        longer = [n for n, march in enumerate(marches) if march.last_row >= steps]
        self.number = (same + longer + [0])[0]
        self.march = marches[self.number]

    def run(
        self, between_slices: Callable[[], None] | None = None, *, measure: bool = True
    ) -> Result:
        """Integrate until the regime is decided or the longest end time is reached.

        Parameters
        ----------
        between_slices : function called about every 10 ms; may raise to end the case
        measure : whether chaos is measured afterwards, if `output.chaos` > 0
        """
        with one_thread():
            while True:
                march, self.last = self.march, None
                if self.keep or self.number + 1 < len(self.ends):
                    march.reach(march.last_row, between_slices)
                    fits = march.steps == march.last_row
                    self.last = snapshot(march) if fits else None
                result = result_of(march.case, march.run(between_slices))
                if self.number + 1 == len(self.ends) or not is_open(result.row):
                    break
                self._go_on()
            if not measure:
                return result
            return self._with_estimate(
                self._with_motion(result, between_slices), between_slices
            )

    def _with_estimate(
        self, result: Result, between_slices: Callable[[], None] | None
    ) -> Result:
        """Add how far a coarser run differs, if `solver.estimate` asks.

        If the run is stopped meanwhile, it begins anew.
        """
        case = self.march.case
        if case.given.solver.estimate == "none":
            return result
        coarse = coarser(case)
        row: dict[str, Value] = dict(NO_COARSE)
        performance = dict(result.performance)
        if coarse is not None:
            other = Course(coarse, self.start, keep=False)
            found = other.run(between_slices, measure=False)
            row = estimated(result.row, found.row, case.given.gap)
            performance["seconds"] = self.seconds + other.seconds
        return replace(result, row=result.row | row, performance=performance)

    def _with_motion(
        self, result: Result, between_slices: Callable[[], None] | None
    ) -> Result:
        """Add the numbers of chaos and the word `motion` to a result, if asked for.

        They are asked for by `output.chaos` > 0. They depend only on the state at the
        end of the case: if the run is stopped meanwhile, they are measured again from
        the beginning.
        """
        asked, row = self.case.given.output.chaos, result.row
        if asked == 0.0:
            return result
        found: dict[str, Value] = {}
        performance = dict(result.performance)
        if row["regime"] == "sustained":
            self.twins = twins_of(self.march, asked, between_slices)
            if self.twins is not None:
                found |= motion_numbers(self.twins)
                performance["seconds"] = self.seconds
            self.twins = None
        word = motion_of(row | found, _LIMITS)
        return Result({**row, "motion": word, **found}, result.traces, performance)

    def _go_on(self) -> None:
        """Begin the integration to the next, later end time of an undecided case.

        It continues from the last state of the former one, or starts anew if it would
        have been integrated differently.
        """
        self.number += 1
        old, self.march = self.march, self._march(self.number)
        if old.lean.model.folds != self.march.lean.model.folds:
            self.march.unfold()
        if self.last is not None and fingerprint(old) == fingerprint(self.march):
            restore(self.march, self.last)
        self.march.seconds = old.seconds


def result_of(case: Case, history: History) -> Result:
    """Return the result of an integrated case: evidence, words, numbers and traces.

    Parameters
    ----------
    case : the case
    history : what was recorded while it was integrated
    """
    scene = case.scene
    found = evidence(scene, history) | {"stop": history.stop}
    outcome, regime, whirl = name_regime(found, USUAL)
    row: dict[str, Value] = {"outcome": outcome, "regime": regime, "whirl": whirl}
    row |= {name: getattr(case.given, name) for name in SCENE_ROW}
    row |= {
        "duration": scene.end_time,
        "time_step": scene.solver.time_step,
        "modes": scene.solver.modes,
        "scheme": scene.solver.scheme,
        "folds": history.folds,
        "tip_growth": case.growth,
    }
    row |= {name: getattr(history, name) for name in HISTORY_ROW}
    terms = LEDGER_TERMS if wears(scene) else [t for t in LEDGER_TERMS if t != "wear"]
    row |= {f"ledger_{term}": history.ledger[term] for term in terms}
    row |= found
    if changes(scene) or case.loses:
        row["words_over_speed"] = told_over_speed(words_over_speed(case, history))
    row |= shaft_numbers(history)
    row |= loss_numbers(case, history) | wear_numbers(scene, history.layer)
    if history.rubbing is not None:
        row |= {
            "stick_share": history.rubbing.stuck,
            "reverse_share": history.rubbing.reversed,
            "friction_heat": history.rubbing.heat,
        }
    row["sample_interval"] = history.interval
    row["lean_checked"] = lean_checked(case, row)
    row |= blade_numbers(history.time, history.tips, (1 - STEADY_SHARE) * history.end)
    performance: dict[str, Value] = {
        "seconds": history.seconds,
        "microseconds_per_step": 1e6 * history.seconds / max(history.steps, 1),
    }
    return Result(row, _traces(case, history), performance)


def notes_on(scene: Scene, row: Mapping[str, Any]) -> list[str]:
    """Return remarks for the user on a case, such as why it ended early.

    Others tell of a free motion that grows, of tips that may have slid back while
    friction is that of permanent sliding, of motion beyond a film's clearance, of its
    error in time, of bounds of what was left out that the run exceeded, and of a
    profile that the harmonics of the casing do not follow well.

    Parameters
    ----------
    scene : inputs of the case
    row : numbers and words of the case, see `Result`
    """
    notes = []
    if row["outcome"] == "overloaded":
        by_pulse = row["ledger_pulse"] >= row["driven_energy"]
        notes.append(BY_PULSE if by_pulse else BY_SPEED)
    if row["free_growth"] > 0.0:
        rests = row["late_energy"] == 0.0 and row["late_contacts"] == 0
        notes.append(GROWS.format(row["free_growth"]) + UNDISTURBED * rests)
    if scene.solver.flies and (why := resolve(scene).handed_over):
        notes.append(HANDED_OVER + why)
    rotor = scene.engine.rotor
    if rotor.film_viscosity > 0.0 and row["centre_peak"] > rotor.film_clearance:
        notes.append(BEYOND_FILM)
    if rotor.film_viscosity > 0.0:
        case, peak = resolve(scene), float(row["centre_peak"])
        notes += filter(None, [told_of_film(case.model, case.scene, peak)])
    slides_on = scene.slip != PERMANENT or not row["slip_ratio"] >= 1.0
    if row["outcome"] != "overloaded" and not slides_on:
        notes.append(SLIDES_BACK.format(row["slip_ratio"]))
    if row["lean_checked"] > 1.0:
        notes += told_beyond(resolve(scene), row)
    notes += filter(None, [told_of_profile(scene), told_of_estimate(row)])
    return notes


def _traces(case: Case, history: History) -> dict[str, NDArray[np.float64]]:
    scene = case.scene
    if scene.output.traces in {"summary", "blades"}:
        return {}
    traces = {
        "time": history.time,
        "centre": static_frame(history.centre, angle_at(scene, history.time)),
        "energy": history.energy,
        "impulse": history.impulse,
        "fed": history.fed,
        "rubbed": history.friction,
        "lost": history.lost,
    }
    if history.shaft is not None:
        traces["support_force"] = history.shaft.force[: len(history.time)]
        traces["shaft_torque"] = history.shaft.torque[: len(history.time)]
    if scene.output.traces == "full":
        traces |= {
            "tips": history.tips,
            "blade_impulse": history.blade_impulse,
            "casing": history.casing,
        }
        if history.worn.shape[1]:
            traces["worn"] = history.worn
        if history.stress.shape[2]:
            traces["stress"] = history.stress
        if history.point_impulse.shape[2]:
            traces["point_tips"] = history.point_tips
            traces["point_impulse"] = history.point_impulse
    return traces


def end_of(row: Mapping[str, Any], march: March) -> Motion | None:
    """Return the last motion of a case, with which the next case of a branch begins.

    None if the case diverges or did not run to its end.

    Parameters
    ----------
    row : numbers and words of the case, see `Result`
    march : its integration
    """
    lost = row["outcome"] != "completed" or row["regime"] == "divergent"
    return None if lost else march.motion()


def begun(
    case: Case,
    march: Callable[[Case, Motion | None], Ended],
    ends: Checkpoints | None = None,
) -> Begin:
    """Return a case and the motion with which it begins, left by the case before it.

    The motion is None for a case that begins with its pulse. Preceding cases whose last
    motion is not stored are integrated here.

    Parameters
    ----------
    case : the case
    march : function that integrates a case from a motion to its end and returns its row
        and its last integration
    ends : storage of the last motions of cases; None: preceding cases are integrated
    """
    left, motion, scene = list[Scene](), None, case.given
    while (before := case_before(scene)) is not None:
        known, motion = ends.read(digest(before)) if ends else (False, None)
        if known:
            break
        left.append(before)
        scene = before
    for before in reversed(left):
        motion = _ended(before, motion, march)
        if ends is not None:
            ends.keep(digest(before), motion)
    return _going_on(case, motion), motion


def _going_on(case: Case, motion: Motion | None) -> Case:
    return Case(case.given, case.own, goes_on=True) if motion is not None else case


def _ended(
    scene: Scene, motion: Motion | None, march: Callable[[Case, Motion | None], Ended]
) -> Motion | None:
    try:
        return end_of(*march(_going_on(resolve(scene), motion), motion))
    except InputError:  # the preceding case failed
        return None
