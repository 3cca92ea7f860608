"""Regime and whirl of a motion, determined from evidence: numbers stored with results.

`evidence` reduces the history of a run to numbers; the rules of `scene.words` turn only
these numbers into words, so that `hpcwhirl classify` can give results other words
without integrating again. The window of a run is its last 40 %. Growth means growth of
the amplitude sqrt(energy), by averages over blocks of the window.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import lru_cache

import numpy as np

from hpcwhirl.analysis.rules import words_of_one
from hpcwhirl.analysis.whirl import static_frame, whirl_numbers
from hpcwhirl.arrays import Floats
from hpcwhirl.case.profile import is_round, release_step
from hpcwhirl.case.speed import angle_at, extremes, has_gap_law
from hpcwhirl.dynamics.history import Evidence, History
from hpcwhirl.scene import Scene

Value = float | int | str
STEADY_SHARE = 0.4  # share of a run, at its end, that is the window of evidence
BLOCKS = 12  # blocks of the window over which energy is averaged
SETTLED = 0.2  # share of a run, at its beginning, that `summit` leaves out
# terms of the ledger that may feed energy: supports do as negative damping
FED = ("pulse", "friction", "rotation", "damping")
HARDLY = 1e-10  # distance from an unbalanced rotor's circle / circle's radius, as 0
NOTHING = 1e-280  # J, energy up to which a body counts as at rest


def _limit(default: float, meaning: str) -> float:
    return field(default=default, metadata={"meaning": meaning})


@dataclass(frozen=True)
class Thresholds:
    """Limits in the rules for outcome, regime and whirl; stored with the results.

    Each field's `meaning` says what it limits.
    """

    ledger: float = _limit(
        1e-6, "largest ledger error of a run that is not `unstable`, see `ledger_error`"
    )
    opening: float = _limit(
        1e-9, "largest gap error of a run that is not `unstable`, see `History`"
    )
    significance: float = _limit(
        3.0, "standard errors at which a growth rate counts as non-zero"
    )
    drift: float = _limit(
        0.1, "largest change of ln(amplitude) over the window of a `sustained` motion"
    )
    unclear: float = _limit(
        0.3, "as `drift`, where growth is not significant, as in slowly varying motion"
    )
    rise: float = _limit(
        0.4, "least change of ln(amplitude) over the window of a `divergent` motion"
    )
    onward: float = _limit(
        0.9,
        "least ratio of the growth rate in the window's last quarter to that of the "
        "whole window, of a `divergent` motion",
    )
    above: float = _limit(0.02, "least `summit` of a `divergent` motion")
    replaced: float = _limit(
        0.8,
        "least ratio of energy fed to energy lost, and of lost to fed, if `sustained`",
    )
    turnover: float = _limit(
        2.0,
        "least ratio of energy lost in the window to the mean energy, if `sustained`",
    )
    direction: float = _limit(1.0 / 3.0, "least |P+ - P-|/(P+ + P-) that names a whirl")
    whirl_floor: float = _limit(
        1e-6, "ratio of orbit radius to gap below which there is no whirl"
    )


@dataclass(frozen=True)
class MotionThresholds:
    """Limits in the rules for the word `motion`, such as "periodic" or "chaotic".

    Cases have this word with the input `output.chaos`.
    """

    returns: float = _limit(0.05, "largest `return_distance` of a `periodic` motion")
    calm: float = _limit(
        0.01, "largest exponent per revolution of a motion without chaos"
    )
    sharp: float = _limit(
        0.05, "largest exponent_error per revolution of a `quasi-periodic` motion"
    )
    diffuse: float = _limit(0.5, "least K of the 0-1 test of a `chaotic` motion")
    strong: float = _limit(
        0.2,
        "exponent per revolution above which, with its interval, a motion is `chaotic` "
        "whatever K is",
    )
    bounded: float = _limit(
        0.5, "K of the 0-1 test below which a motion may be `quasi-periodic`"
    )


def threshold_facts() -> dict[str, float]:
    """Return the default thresholds by the names of their attributes in results.

    An example is {"threshold_rise": 0.4}.
    """
    return {f"threshold_{name}": value for name, value in all_thresholds().items()}


def all_thresholds() -> dict[str, float]:
    """Return the default of every threshold by its name, such as {"rise": 0.4}."""
    return asdict(Thresholds()) | asdict(MotionThresholds())


def block_means(values: Floats, count: int) -> Floats:
    """Return means over successive blocks of values, (..., count).

    Blocks are as long as those of `np.array_split`; each mean has the bits of `np.mean`
    of its block.

    values, count : (..., n), along the last axis; number of blocks, <= n
    """
    size, longer = divmod(values.shape[-1], count)
    cut, lead = longer * (size + 1), values.shape[:-1]
    rest = values[..., cut:].reshape(*lead, count - longer, size)
    means = np.add.reduce(rest, axis=-1) / size  # `np.mean` takes twice as long
    if longer:
        first = values[..., :cut].reshape(*lead, longer, size + 1)
        more = np.add.reduce(first, axis=-1) / (size + 1)
        means = np.concatenate([more, means], axis=-1)
    return np.asarray(means)


def levels(values: Floats, count: int) -> Floats:
    """Return the logarithm of the amplitude, ln sqrt(mean energy), of blocks of time.

    Averaging over a block removes the beating of close frequencies. -inf at rest.

    Parameters
    ----------
    values : (..., n), J, energies at n equal intervals of time
    count : number of blocks

    Returns
    -------
    (..., count)
    """
    return _levels(block_means(values, count))


def _levels(means: Floats) -> Floats:
    """Return the log amplitude ln sqrt(E) of each mean energy E, J, in `means`.

    It is -inf for a body at rest, whose energy is at most `NOTHING`.
    """
    moving = means > NOTHING
    if moving.all():
        return np.asarray(0.5 * np.log(means))
    return np.where(moving, 0.5 * np.log(np.where(moving, means, 1.0)), -np.inf)


def growths(
    rows: Floats, rests: Sequence[float] | None = None
) -> list[tuple[float, float]]:
    """Return the growth rate of ln sqrt(energy) of m energies and its error, 1/s.

    The rate is that of a line fitted to the levels of blocks. The standard error
    follows from the distance of each level from the mean of its neighbours, so that a
    smooth rise has no error, even if it accelerates. A body at rest has rate 0 and
    error 0; a body that came to rest within the window has the smallest decay rate that
    explains this.

    rows : (1 + m, n), first the time, s, then m energies over time, J
    rests : (m,), J, energies that a body at rest may have by round-off; None: `NOTHING`
    """
    count = min(BLOCKS, rows.shape[1])
    if count < 3:
        return [(0.0, 0.0)] * (len(rows) - 1)
    means = block_means(rows, count)
    floors = np.array([NOTHING] * (len(rows) - 1) if rests is None else rests)
    return _fitted(means[0], _levels(means[1:]), floors)


def _fitted(at: Floats, level: Floats, rests: Floats) -> list[tuple[float, float]]:
    """Return growth rate and standard error, 1/s, of each of m log amplitudes.

    at, level : (count,), s, middles of blocks; (m, count), see `levels`
    rests : (m,), J, energies that a body at rest may have by round-off
    """
    moving = np.asarray(np.isfinite(level).all(axis=1))
    if not moving.all():
        fits = iter(_fitted(at, level[moving], rests[moving]))
        return [
            next(fits) if moves else (_come_to_rest(at, series, float(rest)), 0.0)
            for moves, series, rest in zip(moving, level, rests, strict=True)
        ]
    away = at - np.add.reduce(at) / len(at)
    spread = away @ away
    rise = level[:, 1:] - level[:, :-1]
    bends = rise[:, 1:] - rise[:, :-1]
    over = 6 * bends.shape[1]
    return [
        (float(away @ series / spread), math.sqrt(bend @ bend / over / spread))
        for series, bend in zip(level, bends, strict=True)
    ]


def _come_to_rest(at: Floats, level: Floats, floor: float) -> float:
    """Return the growth rate, < 0, 1/s, of a body that comes to rest.

    Its amplitude is taken to fall, from the first block to the first block at rest, to
    that of the energy `floor`. Return 0 for a body that is at rest in the first block,
    or moves again later.

    at, level : (count,), s, middles of blocks; log amplitudes, see `levels`
    floor : J, energy that a body at rest may have by round-off
    """
    moving = np.isfinite(level)
    rest = int(np.argmin(moving))
    if rest == 0 or moving[rest:].any():
        return 0.0
    fall = 0.5 * np.log(floor) - level[0]
    return float(fall / (at[rest] - at[0]))


def summit(time: Floats, energy: Floats, start: float) -> float:
    """Return ln(last amplitude / highest amplitude before it) of a run.

    Amplitudes are means over blocks, see `levels`, as long as those of the window that
    begins at `start`, s; the first share `SETTLED` of the run is left out. 0 if there
    are not two blocks to compare. Above 0, the motion ends higher than it ever was.

    time, energy : (n,), s; J
    """
    late = int(np.searchsorted(time, start, side="right"))
    size = (len(time) - late) // BLOCKS
    settled = energy[int(SETTLED * len(time)) :]
    count = len(settled) // size if size else 0
    if count < 2:
        return 0.0
    level = levels(settled[len(settled) - count * size :], count)
    highest = level[:-1].max()
    if not np.isfinite([level[-1], highest]).all():
        return 0.0
    return float(level[-1] - highest)


def evidence(
    scene: Scene, history: History, angles: Floats | None = None
) -> dict[str, Value]:
    """Return the evidence of a run: the numbers that determine its words.

    The window is the last 40 % of the run. Evidence comes from `History.judged` and
    from the ledger of every step: the choice of traces does not change it.

    At a changing speed, the motion that there would be without contact grows or falls
    with the speed; contact adds a further motion. Of a rotor that is driven, see
    `_is_driven`, energies and orbit in a window with contact are those of the added
    motion or of the whole motion, whichever changes less; else those of the added
    motion, which decays without contact. `summit` is 0 for a driven rotor whose speed
    changes and where the gap changes, since the speed or the closing gap may cause
    growth.

    Parameters
    ----------
    scene : the case
    history : its integrated motion
    angles : (b,), rad, angle by which the rotor has turned at each of the b times of
        `History.judged`; None: computed from the scene's speed

    Returns
    -------
    growth_rate, growth_error (1/s, of both bodies' energy), growth_rotor,
    growth_casing, growth_centre (1/s, of the parts: rotor, at rest
    `History.free_growth`; casing; the centre on its suspension, of an unbalanced rotor
    about its circle), growth_last (1/s, of both bodies, last quarter of the window),
    free_growth (1/s, largest `History.free_growth` of the window),
    summit (see `summit`), orbit_radius (m, rms),
    end_time, window (s), whirl_ratio (-), orbit_area (m^2/s), line_frequency (rad/s),
    late_fed, its parts late_friction and late_rotation, late_lost, late_energy (J),
    late_contacts (1 if the window has contact), load_end (s, see `load_end`),
    certificate (s, -1 for none), certificate_reach (m), ledger_error, gap_error,
    step_share (-), gap_scale (m), slip_ratio (-, see `slip_ratio`), driven_energy (J,
    see `_driven_energy`), ledger_pulse, ledger_friction, ledger_rotation,
    ledger_damping (J, of the whole run)
    """
    judged, end = _resolved(history), history.end
    start = (1 - STEADY_SHARE) * end
    first = int(np.searchsorted(judged.time, start, side="right"))
    time, centre = judged.time[first:], judged.centre[first:]
    turned = static_frame(
        centre, angle_at(scene, time) if angles is None else angles[first:]
    )
    with np.errstate(all="ignore"):  # the outcome of a run not finite is its `stop`
        rates, mean = _growing(scene, judged, history, start)
        driven = len(judged.whole) > 0 and _is_driven(scene, history)
        if driven and history.last_contact > start:
            whole = replace(judged, rotor=judged.whole)
            about = replace(history, circle=np.zeros_like(judged.centre))
            held = _growing(scene, whole, about, start)
            rates, mean = min((rates, mean), held, key=lambda one: _change_of(one[0]))
        if driven or has_gap_law(scene):
            rates["summit"] = 0.0
        whirl = whirl_numbers(time, turned, extremes(scene)[1])
    fed, lost = _change(judged.fed[first:]), _change(judged.lost[first:])
    rubbed = _change(judged.friction[first:])
    return {
        **{name: _finite(rate) for name, rate in rates.items()},
        "free_growth": _finite(_window_of(history.free_growth, first).max(initial=0.0)),
        "orbit_radius": _finite(whirl.radius),
        "end_time": end,
        "window": end - start,
        "whirl_ratio": _finite(whirl.ratio),
        "orbit_area": _finite(whirl.area_rate),
        "line_frequency": _finite(whirl.line),
        "late_fed": fed,
        "late_friction": rubbed,
        "late_rotation": fed - rubbed,
        "late_lost": lost,
        "late_energy": _finite(mean),
        "load_end": max(load_end(scene) - history.begun, 0.0),
        "late_contacts": int(history.last_contact > start),
        "certificate": history.certificate,
        "certificate_reach": history.certificate_reach,
        "ledger_error": ledger_error(history, turns=_turns(scene)),
        "gap_error": history.gap_error,
        "step_share": history.step_share,
        "gap_scale": _gap_scale(scene),
        "slip_ratio": slip_ratio(scene, history),
        "driven_energy": _driven_energy(judged),
        **{f"ledger_{term}": history.ledger[term] for term in FED},
    }


def _window_of(values: Floats, first: int) -> Floats:
    """Return the values of a window; values : (b,), or (1,) where they are constant.

    first : index of the first of b samples that the window contains
    """
    return values if len(values) == 1 else values[first:]


def load_end(scene: Scene) -> float:
    """Return the time at which the last load of a run ends, s; 0 without a load.

    Loads are the pulse, and the casing's shape where it rises or is let go: before that
    time a word would be that of another casing than the one that stays.
    """
    casing, step = scene.engine.casing, scene.solver.time_step
    loads = [scene.pulse if scene.is_loaded else 0.0, release_step(scene) * step]
    if not is_round(scene):
        loads.append(casing.profile_rise)
    if casing.kind == "rigid" and casing.amplitude != 0.0:
        loads.append(casing.rise)
    return max(loads)


def _growing(
    scene: Scene, judged: Evidence, history: History, start: float
) -> tuple[dict[str, float], float]:
    """Return growth rates of energies and orbit in a window, and the mean energy, J.

    The rates are {name: 1/s}; one further entry is "summit", see `summit`.

    judged : energies and orbit over the run, from which the numbers are computed
    history : history of the run; the orbit's size is the distance from its `circle`,
        the motion that an unbalance causes without contact
    start : s, beginning of the window
    """
    first = int(np.searchsorted(judged.time, start, side="right"))
    time, centre = judged.time[first:], judged.centre[first:]
    energy, rotor, casing = _energies(scene, judged)
    energies = energy[first:], rotor[first:], casing[first:]
    least, far = history.blur
    squared = _squared(centre, history.circle[first:], far)
    rest = max(least, NOTHING)
    rates = _rates(np.stack([time, *energies, squared]), (rest, rest, NOTHING, NOTHING))
    if history.free_growth.any():
        free = np.broadcast_to(history.free_growth, judged.time.shape)[first:]
        grown = float(free[energies[1] == 0.0].max(initial=0.0))
        if grown > 0.0:
            rates["growth_rotor"] = max(rates["growth_rotor"], grown)
    rates["summit"] = summit(judged.time, rotor, start)
    return rates, energies[0].mean() if len(time) else 0.0


def _driven_energy(judged: Evidence) -> float:
    """Return what the changing speed and an unbalance have put into a run's motion, J.

    It is the energy by which the rotor's whole motion at the end differs from the
    motion that contact causes; 0 unless the speed changes with full rotation. The
    ledger is that of the motion that contact causes and does not contain it.

    judged : energies and orbit of a run
    """
    if not len(judged.whole):
        return 0.0
    return _finite(abs(float(judged.whole[-1] - judged.rotor[-1])))


def _gap_scale(scene: Scene) -> float:
    """Return the length, m, to which the threshold `whirl_floor` refers."""
    return max(scene.gap, 1e-6 * scene.engine.rotor.radius)


def _is_driven(scene: Scene, history: History) -> bool:
    """Return whether the rotor would whirl without contact, as by an unbalance.

    The centre of a balanced rotor of equal sectors would only move by round-off.
    """
    far = float(np.abs(history.circle).max(initial=0.0))
    return far >= Thresholds().whirl_floor * _gap_scale(scene)


def _change_of(rates: dict[str, float]) -> float:
    """Return how much a motion changes: its largest |growth rate|, 1/s.

    The growth rates are those of both bodies together, of the rotor and of the centre.

    rates : growth rates by name, result of `_rates`
    """
    return max(abs(rates[f"growth_{name}"]) for name in ("rate", "rotor", "centre"))


def _turns(scene: Scene) -> bool:
    return scene.engine.rotation == "full"


def _resolved(history: History) -> Evidence:
    """Return a run's energies and orbit, with rotor energies due to round-off set to 0.

    History.blur says up to which energy, J, the rotor may move by round-off alone.
    """
    judged, (least, _) = history.judged, history.blur
    if least == 0.0:
        return judged
    return replace(
        judged, rotor=np.where(np.abs(judged.rotor) > least, judged.rotor, 0.0)
    )


def _energies(scene: Scene, judged: Evidence) -> tuple[Floats, Floats, Floats]:
    """Return three energies over a run, (b,), J: of both bodies, the rotor, the casing.

    With full rotation these are magnitudes: beyond a critical speed, Jacobi's energy of
    a forward whirl is negative and tends to 0 as the whirl decays.

    judged : energies and orbit of a run at b times
    """
    energies = judged.energy, judged.rotor, judged.casing
    if not _turns(scene):
        return energies
    energy, rotor, casing = map(np.abs, energies)
    return energy, rotor, casing


def _squared(centre: Floats, circle: Floats, far: float) -> Floats:
    """Return the centre's squared distance from its motion without contact, (n,), m^2.

    Without contact, the centre of an unbalanced rotor moves on a circle in the static
    frame. Distances below `HARDLY` times its radius are round-off and become 0.

    centre, circle : (n, 2), m, rotating frame; position of the centre, and where it
        would be without contact
    far : m^2, squared distance up to which round-off may move the centre
    """
    if not circle.any():
        return np.asarray(centre[:, 0] ** 2 + centre[:, 1] ** 2)
    away = centre - circle
    squared = away[:, 0] ** 2 + away[:, 1] ** 2
    least = np.maximum(far, HARDLY**2 * (circle[:, 0] ** 2 + circle[:, 1] ** 2))
    return np.where(squared > least, squared, 0.0)


def slip_ratio(scene: Scene, history: History) -> float:
    """Return the largest slip of tips in contact over |Omega| R; 0 without rotation.

    The slip is |v' - u_c'|: v' is the tangential velocity of a tip, with the centre's
    motion but without Omega R; u_c' that of the casing at the tip. Below 1 every tip
    in contact slides in the direction of rotation, and friction that always drags
    against the rotation is Coulomb's law; from 1 on a tip may have slid backwards, and
    real friction would have pushed it forwards. At speed 0 no friction acts.
    """
    rim = abs(extremes(scene)[0]) * scene.engine.rotor.radius
    return _finite(history.slip / rim) if rim > 0.0 else 0.0


def _rates(rows: Floats, rests: Sequence[float]) -> dict[str, float]:
    """Return the evidence `growth_*` of a window, 1/s, by name.

    rows : (5, n), at n times: time, s; energy of both bodies, of the rotor, of the
        casing, J; squared orbit radius, m^2
    rests : of each of the last four, the value that it may have at rest by round-off
    """
    (rate, error), *others = growths(rows, rests)
    rotor, casing, centre = (growing for growing, _ in others)
    last = 3 * rows.shape[1] // 4
    return {
        "growth_rate": rate,
        "growth_error": error,
        "growth_rotor": rotor,
        "growth_casing": casing,
        "growth_centre": centre,
        "growth_last": growths(rows[:2, last:], rests[:1])[0][0],
    }


def _change(values: Floats) -> float:
    """Return the last less the first of the values of an accumulated work; 0 if empty.

    It is 0, too, if it is not finite; values : (n,), J
    """
    return _finite(values[-1] - values[0]) if len(values) else 0.0


def _finite(value: float) -> float:
    return float(value) if math.isfinite(value) else 0.0


def ledger_error(history: History, *, turns: bool = False) -> float:
    """Return the worst violation of the energy ledger, relative to its throughput.

    The residual must be zero; the energy of a stable scheme and the energy lost to
    damping must not be negative. The throughput is the sum of the |terms| of the
    ledger. 1 if numbers of the run are not finite. A violation that round-off explains
    counts as 0: round-off of the energy E_b = b^2, `History.blur`, changes the energy
    a^2 of a motion by up to 2 a b + b^2.

    turns : whether rotation is full; then Jacobi's energy may be negative beyond a
        critical speed, and so may losses, since non-rotating supports may feed energy
    """
    if history.stop == "nonfinite":
        return 1.0
    ledger = dict(history.ledger)
    residual = abs(ledger.pop("residual"))
    through = sum(abs(value) for value in ledger.values())
    least = min(ledger["energy"], float(history.judged.energy.min(initial=0.0)))
    wrong = residual if turns else max(residual, -least, -ledger["damping"])
    blur = history.blur[0]
    allowed = blur + 2.0 * math.sqrt(blur * through)
    if wrong <= allowed or (through < NOTHING and wrong < NOTHING):
        return 0.0
    error = wrong / through if through > 0.0 else 1.0
    return float(error) if math.isfinite(error) else 1.0


def name_regime(
    numbers: Mapping[str, Value], limits: Thresholds
) -> tuple[str, str, str]:
    """Return a case's words (outcome, regime, whirl) by the rules of `scene.words`.

    Parameters
    ----------
    numbers : evidence of the case, result of `evidence`, and `stop`, why the run ended
    limits : thresholds of the rules
    """
    return words_of_one(numbers, _as_numbers(limits))


@lru_cache(maxsize=8)
def _as_numbers(limits: Thresholds) -> dict[str, float]:
    return asdict(limits)
