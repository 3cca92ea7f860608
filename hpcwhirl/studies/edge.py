"""Follow the motion on the edge (basin boundary) between two words of one scene.

A weaker and a stronger pulse leave the engine in two states whose motions have
different words. Between these states the boundary of two basins is followed by
bisection, see `studies.edge_tracking`. The side of a state is the word of the motion
that continues from it, by the same rules as for any case, applied to that motion only.
(A threshold on energy would have to be chosen for each engine, and the energy of an
edge motion rises and falls.) A continuation ends early at a proof that contact cannot
recur, or at the amplitude limit.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.analysis.regimes import Thresholds, evidence, name_regime
from hpcwhirl.analysis.whirl import sense_of, static_frame, whirl_numbers
from hpcwhirl.arrays import Floats
from hpcwhirl.case.resolve import resolve
from hpcwhirl.case.speed import changes
from hpcwhirl.dynamics.history import since
from hpcwhirl.dynamics.kernels import contact
from hpcwhirl.dynamics.march import March
from hpcwhirl.dynamics.side_by_side import copy_of, distance, put_between
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.numbers import one_thread
from hpcwhirl.scene import Scene, apply_settings
from hpcwhirl.scene.contact_laws import RIGID
from hpcwhirl.studies.edge_tracking import HIGH, LOW, OPEN, Tracked, track

USUAL = Thresholds()
AFTER = 2.0  # time at which the two states are taken, in durations of the pulse
# number of times in a stride at which evidence is recorded: a stride is 1/6 of the
# period of `limits.fastest_line`
ROWS = 2
LOOKS = 3  # multiple of `look` after which an undecided side counts as unknown
LATER = 0.5  # numbers of an edge motion are computed from this last part of it
Tell = Callable[[str], None] | None
CAN_TELL = ("damped", "sustained", "divergent")


@dataclass(frozen=True)
class Tracking:
    """Times and distances that control how an edge is followed; checked when made.

    Attributes
    ----------
    span : time over which the edge is followed, s
    look : time after which the side of a state is determined, s; up to `LOOKS` times as
        long if the motion is still undecided
    begin : time at which the states after the pulses are taken, s; 0: after two
        durations of the pulse
    near, far : distances of the two states, each the square root of (energy of the
        states' difference / energy of the motion): bisection ends below `near`, and
        begins again above `far`
    """

    span: float = 1.0
    look: float = 1.0
    begin: float = 0.0
    near: float = 1e-6
    far: float = 1e-3

    def __post_init__(self) -> None:
        for name in ("span", "look", "near", "far"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise InputError(f"{name} must be > 0, got {value:g}")
        if not self.near < self.far < 1.0:
            msg = f"near must be < far, and far < 1, got {self.near:g} and {self.far:g}"
            raise InputError(msg)
        if not (math.isfinite(self.begin) and self.begin >= 0.0):
            raise InputError(f"begin must be >= 0 s, got {self.begin:g}")


TRACKING = Tracking()


class Moment(NamedTuple):
    """A state of the motion, and what was recorded on the way to it.

    Attributes
    ----------
    state : copy of the integration's state, see `dynamics.side_by_side`
    rows : (m, columns), what was recorded at m times since the previous state, from
        which words are determined: displacement of the shaft's centre, energies, energy
        fed and lost
    """

    state: Any
    rows: Floats


@dataclass(frozen=True)
class Leaving:
    """The motion that leaves the edge on one side, at n times.

    Attributes
    ----------
    word : word of the motion
    time : (n,), s, since the start of the pulses
    radius : (n,), m, distance of the shaft's centre from its position at rest
    """

    word: str
    time: Floats
    radius: Floats


@dataclass(frozen=True)
class Edge:
    """A motion on the edge between two words: at n times, with numbers of the whole.

    Attributes
    ----------
    time : (n,), s, since the start of the pulses
    centre : (n, 2), m, STATIC frame, displacement of the shaft's centre
    energy : (n,), J, kinetic and strain energy of rotor and casing
    pieces : (n,), number of the piece to which a time belongs; between pieces the two
        states were bisected again
    low, high : the motions on both sides, which leave the edge
    numbers : {name: value}: `begin`, `end`, s; from the later half of the motion
        `orbit_radius`, m (rms about the mean), `orbit_change` (relative change of
        radius from the first to the second part of that half), `turning_rate`, rad/s
        (mean rate of the centre's polar angle, > 0 forward), `whirl_ratio`,
        `line_frequency`, rad/s, `contact_share` (share of steps with contact); from the
        whole motion `leaving_rate`, 1/s, at which the two sides separate,
        `leaving_low` and `leaving_high`, ends of its 95 % interval, and the numbers of
        `bisections`, of `pieces`, and of times that the pair of states was `widened` to
        contain the boundary again
    """

    time: Floats
    centre: Floats
    energy: Floats
    pieces: NDArray[np.int64]
    low: Leaving
    high: Leaving
    numbers: dict[str, float]


class Continued:
    """Motions of one scene after its pulse, as `studies.edge_tracking` needs them.

    It moves states of the integration forward in time, puts a state between two others,
    and finds the side of a state; it implements the protocol `Motions` there.

    Parameters
    ----------
    march : integration of the scene with all sectors; its state is overwritten
    look : time after which a motion gets its word, s; up to `LOOKS` times if undecided

    Attributes
    ----------
    words : (low, high), words of the motions on the two sides; set once they are known
    stride : number of time steps between two states of a motion that is followed
    judged : number of motions integrated so far to find a word
    """

    def __init__(self, march: March, look: float) -> None:
        self.march, self.step = march, march.scene.solver.time_step
        self.look = max(round(look / self.step), 1)
        self.words = ("", "")
        self.stride, self.judged = ROWS * march.beat, 0
        self.free = apply_settings(march.scene, {"force": 0.0})
        at_rest = apply_settings(march.case.given, {"start_energy": 0.0})
        still = March(replace(march.case, given=at_rest))
        still.unfold()
        self._rest = copy_of(still)

    def between(self, low: Moment, high: Moment, share: float) -> Moment:
        """Return the state at a fraction of the way from state `low` to state `high`.

        low, high : two states at the same time
        share : the fraction: 0 gives the state `low`, 1 the state `high`
        """
        put_between(self.march, low.state, high.state, share)
        return Moment(copy_of(self.march), low.rows[:0])

    def distance(self, low: Moment, high: Moment) -> float:
        """Return the distance of two states, relative to the size of the state `low`.

        It is sqrt(energy of the states' difference / energy of the state `low`).
        """
        self._rest.counter[contact.STEP] = low.state.counter[contact.STEP]
        size = distance(self.march, self._rest, low.state)
        apart = distance(self.march, low.state, high.state)
        return apart / size if size > 0.0 else math.inf

    def ahead(self, moment: Moment) -> Moment | None:
        """Return the state `stride` time steps after a given state.

        None if the motion ends earlier, at the amplitude limit or by a proof that
        contact cannot recur.
        """
        start = self._put(moment)
        rows = int(self.march.counter[contact.JUDGED])
        self.march.reach(start + self.stride)
        if self.march.steps < start + self.stride or self._ended:
            return None
        fresh = self.march.tracks.evidence[rows : self.march.counter[contact.JUDGED]]
        return Moment(copy_of(self.march), fresh.copy())

    @property
    def _ended(self) -> bool:
        return int(self.march.counter[contact.STOP]) != contact.RUNNING

    def side(self, moment: Moment) -> int:
        """Return on which side of the edge a state lies: LOW, HIGH or OPEN (unknown).

        It follows from the word of the motion that continues from the state; OPEN: that
        motion is neither damped nor sustained nor divergent (`CAN_TELL`).
        """
        word = self.word(moment)
        if word not in CAN_TELL:
            return OPEN
        return LOW if word == self.words[0] else HIGH

    def word(self, moment: Moment) -> str:
        """Return the word of the motion that continues from a state, such as "damped".

        The motion is continued in up to `LOOKS` parts of length `look`, until its word
        is that of one of the two sides (`words`); otherwise the word at the end is
        returned. A run that reaches the amplitude limit is divergent.
        """
        start, word = self._put(moment), ""
        self.judged += 1
        for number in range(1, LOOKS + 1):
            self.march.reach(start + number * self.look)
            if self.march.counter[contact.STOP] == contact.AMPLITUDE:
                return "divergent"
            word = self._judge(start)
            if word in (self.words if all(self.words) else CAN_TELL) or self._ended:
                break
        return word

    def leaving(self, moment: Moment) -> Leaving:
        """Return the motion that continues from a state until it has its word."""
        start, word = self._put(moment), self.word(moment)
        later = since(self.march.history(), start * self.step)
        radius = np.hypot(*later.judged.centre.T)
        return Leaving(word, start * self.step + later.judged.time, radius)

    def _put(self, moment: Moment) -> int:
        """Set the integration to a given state; return the number of its time step."""
        put_between(self.march, moment.state, moment.state, 0.0)
        return self.march.steps

    def _judge(self, start: int) -> str:
        later = since(self.march.history(), start * self.step)
        found = evidence(self.free, later) | {"stop": later.stop}
        outcome, regime, _ = name_regime(found, USUAL)
        return outcome if regime == "none" else regime


@one_thread()
def edge(
    scene: Scene, low: float, high: float, how: Tracking = TRACKING, tell: Tell = None
) -> Edge:
    """Return the motion on the edge between the words to which two pulses lead.

    Parameters
    ----------
    scene : the case; its force and duration are not used
    low, high : forces of the two pulses, N
    how : times and distances that control the tracking
    tell : called with one line of text after each stage of the work

    Raises
    ------
    InputError
        if both pulses lead to the same word, or the motion after one of them is not
        damped, sustained or divergent within `LOOKS` times the time `look`
    analysis.edge_tracking.LostEdgeError
        if the edge is lost
    """
    if changes(scene):
        msg = "an edge is followed at constant speed and gap: acceleration, "
        raise InputError(f"{msg}gap_closure must be 0, speed_table, gap_table empty")
    if scene.lost_blade_time > 0.0:
        msg = "an edge is followed of one rotor: lost_blade_time must be 0 s, got "
        raise InputError(f"{msg}{scene.lost_blade_time:g}")
    law = scene.engine.casing.contact_law
    if law != RIGID:
        msg = "no edge is followed between casings that differ by wear: "
        raise InputError(f"{msg}casing.contact_law must be {RIGID}, got {law}")
    start = how.begin or AFTER * scene.pulse
    longer = how.span + LOOKS * how.look
    march, other = (_begun(scene, force, start, longer) for force in (low, high))
    ends = moment_of(march), moment_of(other)
    motions = Continued(march, how.look)
    return edge_between(motions, ends, how, f"pulses of {low:g} and {high:g} N", tell)


def moment_of(march: March) -> Moment:
    """Return the present state of an integration as a `Moment`, nothing recorded."""
    return Moment(copy_of(march), np.zeros((0, contact.COLUMNS)))


def edge_between(
    motions: Continued,
    ends: tuple[Moment, Moment],
    how: Tracking = TRACKING,
    told: str = "two states",
    tell: Tell = None,
) -> Edge:
    """Return the motion on the edge between two given states of one scene.

    `edge` calls it with the states after two pulses.

    Parameters
    ----------
    motions : continues motions of the scene
    ends : two states at the same time step, whose motions get different words
    how : times and distances; `look` must be that of `motions`
    told : name of the two states in messages
    tell : called with one line of text after each stage of the work

    Raises
    ------
    InputError, analysis.edge_tracking.LostEdgeError
        as `edge`
    """
    low, high = map(motions.word, ends)
    _check_words((low, high), told)
    motions.words = low, high
    strides = max(round(how.span / (motions.stride * motions.step)), 1)

    def progress(made: int) -> None:
        if tell:
            tell(f"{made} of {strides} strides, {motions.judged} motions")

    if tell:
        tell(f"{told}: {low} and {high}")
    found = track(motions, ends, strides, how.near, how.far, progress)
    return _told(motions, found)


def _begun(scene: Scene, force: float, start: float, longer: float) -> March:
    """Return an integration of all sectors, advanced to some time after its pulse.

    Parameters
    ----------
    scene, force : the scene, and the force of the pulse, N
    start : time until which it is advanced, s
    longer : time by which it can be integrated further, s
    """
    settings: dict[str, Any] = {"force": force, "duration": start + longer}
    settings |= {"revolutions": 0.0, "until": "certain", "traces": "summary"}
    march = March(resolve(apply_settings(scene, settings)))
    march.unfold()
    goal = math.ceil(start / march.scene.solver.time_step)
    if march.scene.solver.flies:  # jumps end at rows of evidence
        goal = -(-goal // march.beat) * march.beat
    march.reach(goal)
    if march.done:
        msg = f"after {start:g} s the motion of a pulse of {force:g} N has ended "
        how = "use a smaller `begin`, or choose pulses nearer to the edge"
        raise InputError(f"{msg}already: {how}")
    return march


def _check_words(words: tuple[str, ...], told: str) -> None:
    """Raise InputError unless two states lead to different, decided words.

    Decided words are damped, sustained and divergent (`CAN_TELL`).

    Parameters
    ----------
    words : words of the motions from the two states
    told : name of the two states, for the message
    """
    if words[0] == words[1]:
        raise InputError(f"no edge: {told} lead to the same word, {words[0]}")
    for word in words:
        if word not in CAN_TELL:
            raise InputError(
                f"no edge: the motion from one of {told} is still {word} after {LOOKS} "
                f"times `look`; its word must be one of {', '.join(CAN_TELL)}: use a "
                "longer `look`"
            )


def _told(motions: Continued, found: Tracked[Moment]) -> Edge:
    """Return the edge motion with its numbers, and the two motions that leave it.

    Parameters
    ----------
    motions : continues motions of the scene
    found : states on both sides of the edge, as `studies.edge_tracking.track` returns
    """
    scene, beat = motions.march.scene, motions.march.beat
    states = [moment for piece in found.pieces for moment in piece[1:]]
    number = [n for n, piece in enumerate(found.pieces) for m in piece[1:]
              for _ in m.rows]  # fmt: skip
    rows = np.concatenate([moment.rows for moment in states])
    begin = int(found.pieces[0][0].state.counter[contact.STEP])
    first = -(-(begin + 1) // beat)  # the first row of evidence after `begin`
    time: Floats = (first + np.arange(float(len(rows)))) * (beat * motions.step)
    centre = static_frame(rows[:, : contact.OF_ROTOR], scene.speed * time)
    energy = rows[:, contact.OF_ROTOR] + rows[:, contact.OF_CASING]
    numbers = {"begin": begin * motions.step, "end": float(time[-1])}
    late = slice(int((1.0 - LATER) * len(time)), None)
    numbers |= _orbit(time[late], centre[late], scene.speed)
    numbers["contact_share"] = _share(found.pieces)
    span = motions.stride * motions.step
    numbers |= {
        "leaving_rate": found.rate.rate / span,
        "leaving_low": found.rate.low / span,
        "leaving_high": found.rate.high / span,
        "bisections": float(found.halvings),
        "pieces": float(len(found.pieces)),
        "widened": float(found.widened),
    }
    sides = motions.leaving(found.last.low), motions.leaving(found.last.high)
    return Edge(time, centre, energy, np.array(number), *sides, numbers)


def _orbit(time: Floats, centre: Floats, speed: float) -> dict[str, float]:
    """Return {name: value} of numbers that describe an orbit of the shaft's centre.

    Parameters
    ----------
    time : (n,), s
    centre : (n, 2), m, static frame, displacement of the centre at these times
    speed : speed of rotation Ω, rad/s
    """
    whirl = whirl_numbers(time, centre, speed)
    z = centre @ np.array([1.0, 1j])
    halves = [np.sqrt(np.mean(np.abs(part) ** 2)) for part in np.array_split(z, 2)]
    turned = sense_of(speed) * np.polyfit(time - time[0], np.unwrap(np.angle(z)), 1)[0]
    return {
        "orbit_radius": whirl.radius,
        "orbit_change": float((halves[1] - halves[0]) / halves[1]),
        "turning_rate": float(turned),
        "whirl_ratio": whirl.ratio,
        "line_frequency": whirl.line,
    }


def _share(pieces: list[list[Moment]]) -> float:
    """Return the share of time steps with contact in the later half of an edge motion.

    pieces : successive states of the motion; between two pieces the pair of states was
        bisected again
    """
    touched = steps = 0
    whole = sum(len(piece) - 1 for piece in pieces)
    strides = 0
    for piece in reversed(pieces):
        begun, ended = (moment.state.counter for moment in (piece[0], piece[-1]))
        touched += int(ended[contact.TOUCHED] - begun[contact.TOUCHED])
        steps += int(ended[contact.STEP] - begun[contact.STEP])
        strides += len(piece) - 1
        if strides >= LATER * whole:
            break
    return touched / steps
