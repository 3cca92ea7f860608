"""Limits of a case's time step (stability, pulse, rotation, wall), and its step counts.

By the time recursion (`dynamics.bodies.timestep`) a free mode of frequency w and
damping ratio xi is proportional to z^n at step n. With x = w dt, z is a root of

(1 + xi x) z^2 - (2 - x^2) z + (1 - xi x) = 0,

so that its phase advances by arg z per step instead of x sqrt(1 - xi^2), see
`frequency_error`.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from hpcwhirl.arrays import Floats
from hpcwhirl.case.profile import (
    AROUND,
    HIGHEST,
    MOST_MISSED,
    WITHIN,
    check_release,
    departure,
    is_round,
    missed_share,
    shape_of,
)
from hpcwhirl.case.speed import check_change, extremes, law_of
from hpcwhirl.case.unbalance import (
    check_films,
    check_stops,
    check_unbalance,
    films_of,
    is_unbalanced,
    stops_of,
)
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.bearing_laws import FULLEST
from hpcwhirl.reduction.bodies import centre_rows, tip_rows
from hpcwhirl.reduction.model import Model
from hpcwhirl.reduction.modes import Spin, unlike
from hpcwhirl.reduction.numbers import one_thread, representable, zero_between
from hpcwhirl.reduction.supports import (
    Bearing,
    LoadedBearing,
    Support,
    film_shares,
)
from hpcwhirl.reduction.waves import stiff_up_to
from hpcwhirl.scene import Scene
from hpcwhirl.scene.contact_laws import RIGID
from hpcwhirl.scene.rules import MOST_STEPS, NO_BLADE
from hpcwhirl.structure import RingOperator

MOST_KEPT = 32  # number of cached models, as in `reduction.model`
# largest (1 - t) (1 + 3 t) / (1 + t), t = Omega / (w + Omega) = 0.155, see `turned`
SLOWER = 1.072
BY_FILM = 0.01  # error of a film in time, relative to dt c / m, see `film_error`
IN_FILM = 0.5  # eccentricity up to which a film has the accuracy that is asked for
USUAL_OF_FILM = 0.01  # error above which it is told where no accuracy is asked for
SAFE = 0.9  # largest ratio of a step chosen by accuracy to the limits of the step
MATTERS = 1e-2  # least compliance of a mode that counts, relative to the largest
PER_PERIOD = 12.0  # rows of evidence per period of `fastest_line`
FEWEST_ROWS = 160  # least number of rows of evidence in a run
FEWEST_IN_PULSE = 10  # least steps of a pulse; fewer miss over 1 % of its impulse
HARDLY = 0.7  # xi from which a mode hardly oscillates; a larger xi counts as this one
# `frequency_error` below which round-off dominates; smaller ones are taken as ~ x^2
RESOLVED = 1e-8
FEWEST_IN_RISE = 50  # least steps of a shape's rise; fewer miss a tenth of the impulse
MOST_GROWTH = 0.05  # relative growth of a rigid casing's distortion per step: 3 % error


def check_limits(model: Model, scene: Scene) -> None:
    """Raise InputError if an input of a scene exceeds a limit that its model sets."""
    check_points(model, scene)
    check_rotation(model, scene)
    check_supports(model, scene)
    check_unbalance(model, scene)
    check_films(model, scene)
    check_stops(model, scene)
    check_step(model, scene)
    check_count(scene)
    check_loading(scene)
    check_turn(model, scene)
    check_layer(scene)
    check_wall(scene)
    check_change(scene, model)
    check_release(model, scene)


def check_points(model: Model, scene: Scene) -> None:
    """Raise InputError if several points per tip do not suit contact law or gap.

    The contact law must allow several contact points, and the clearance of each must
    not be negative.
    """
    if model.rotor.points is None:
        return
    law = scene.engine.casing.contact_law
    if law != RIGID:
        raise InputError(
            "casing.contact_law must be rigid where tips have several contact points, "
            f"got {law}"
        )
    least = -float(model.rotor.points.gap.min())
    if not scene.gap >= least:
        raise InputError(
            f"gap must be >= {least:.6g} m, since rotor/tip_gap of engine.file "
            f"{scene.engine.file} reduces it by that at a point, got {scene.gap:.6g}"
        )


def _short_of(most: float, speed: float, equal: str = "") -> str:
    """Return the limit that a speed exceeds as text: "< 800 rad/s" or "> -800 rad/s".

    most, speed, equal : largest magnitude, rad/s; the speed; "=" if it may be reached
    """
    sign, least = ("<", most) if speed > 0 else (">", -most)
    return f"{sign}{equal} {least:.6g} rad/s"


def check_rotation(model: Model, scene: Scene) -> None:
    """Raise InputError if softening leaves blades without stiffness at the speed.

    The speed must be below that at which softening cancels the stiffness of a wave that
    does not move the shaft. A wave that moves the shaft is stabilised by Coriolis
    forces beyond its critical speed.
    """
    if model.rotor.spin is None:
        return
    with representable("the rotor's stiffness at speed"):
        most = _stiff_up_to(model)
    _, fastest = extremes(scene)
    if not abs(fastest) < most:
        raise InputError(
            f"speed must be {_short_of(most, fastest)} with rotation full: a wave of "
            f"the blades has no stiffness left beyond it, got {fastest:.6g}"
        )


@lru_cache(maxsize=MOST_KEPT)
def _stiff_up_to(model: Model) -> float:
    return stiff_up_to(model.rotor, model.blades)


def _check_range(bearing: Bearing, speeds: tuple[float, ...]) -> None:
    """Raise InputError if one of `speeds`, rad/s, lies outside a bearing's table."""
    least, most = bearing.range
    for speed in speeds:
        if not least <= abs(speed) <= most:
            raise InputError(
                f"speed must be {least:.6g} to {most:.6g} rad/s, in either direction, "
                f"the range of the table of bearing, got {speed:.6g}"
            )


def _passed(scene: Scene) -> tuple[float, float]:
    """Return a run's least and largest speed, rad/s; 0 if it changes its sign."""
    slowest, fastest = extremes(scene)
    return (0.0 if slowest * fastest < 0.0 else slowest), fastest


def check_supports(model: Model, scene: Scene) -> None:
    """Raise InputError for supports that are not admissible at a scene's speed.

    The table of a bearing must include the speed. A support that differs by direction
    or has a film must be stiff in all directions, |k_d| < 1 / a with a the compliance
    there at rest on the mean supports, and dampers must not feed energy, |c_d| <= c.
    """
    spin, scheme = model.rotor.spin, scene.solver.scheme
    if spin is None:
        return
    for own in spin.supports:
        if isinstance(own, Bearing):
            _check_range(own, _passed(scene))
    if spin.is_plain:
        return
    for one in unlike(model.rotor, model.blades):
        if isinstance(one.support, LoadedBearing):
            _check_carried(one.support, scene)
            continue
        own, row = one.support.at(scene.speed), one.rows[0] @ model.rotor.shapes
        held = 1.0 / float((row**2 / model.rotor.omega**2).sum()) + own.stiffness.real
        _check_directions(own, held, scene)
    steady = is_unbalanced(scene) and law_of(scene) is None
    if steady and (told := _ellipse_refused(spin, scheme)):
        raise InputError(
            f"unbalance must be 0 {told}, and lost_blade {NO_BLADE}, got "
            f"{scene.unbalance} and {scene.engine.rotor.lost_blade}"
        )


def _check_carried(own: LoadedBearing, scene: Scene) -> None:
    """Raise InputError where a film does not carry its journal at the slowest speed."""
    slowest, _ = _passed(scene)
    if not own.is_carried(slowest):
        raise InputError(
            f"speed must be >= {own.least:.6g} rad/s, in either direction: below, the "
            f"rotor's weight presses a journal of the shaft beyond {FULLEST:g} of its "
            f"clearance, got {slowest:.6g}"
        )


def _check_directions(own: Support, held: float, scene: Scene) -> None:
    """Raise InputError for a stiffness or damping that is negative in a direction.

    own, held : the supports at the scene's speed; N/m, mean stiffness of the centre
    """
    apart, within = abs(own.stiffness_apart), held * (1 - 1e-9)
    lost, least = abs(own.damping_apart), own.damping.real * (1 + 1e-9)
    if apart < within and lost <= least:
        return
    where = scene.engine.rotor.bearing and "bearing"
    if scene.engine.rotor.has_line:
        where = "a bearing of the shaft"
    if where:
        what = f"stiffness > 0 N/m, got {held - apart:.6g}"
        if apart < within:
            what = f"damping >= 0 N s/m, got {own.damping.real - lost:.6g}"
        raise InputError(
            f"{where} must have in all directions, at {scene.speed:.6g} rad/s, a {what}"
        )
    if not lost <= least:
        raise InputError(
            f"damping_difference must be within +-{own.damping.real:.6g} N s/m, the "
            "mean that suspension_damping gives, got "
            f"{own.damping_apart.real:.6g}"
        )
    raise InputError(
        f"stiffness_difference must be within +-{held:.6g} N/m, the mean, got "
        f"{own.stiffness_apart.real:.6g}"
    )


def _ellipse_refused(spin: Spin, scheme: str) -> str:
    """Return where an unbalance is refused on supports that make its orbit elliptic.

    The text is part of an error message; "": the unbalance is allowed.

    spin, scheme : the rotor's terms of rotation; name of the scheme
    """
    where = "where supports differ by direction, have a film, or are stops"
    if scheme == "paper":
        return f"with scheme paper {where}"
    if not spin.is_round and films_of(spin):
        return "where supports differ by direction and have a film"
    if not spin.is_round and stops_of(spin):
        return "where supports differ by direction and a stop holds the shaft"
    return ""


def shortest_limits(model: Model, scene: Scene) -> dict[str, float]:
    """Return {body: longest time step, s, that is stable at all speeds of a scene}."""
    return _shortest(model, tuple(dict.fromkeys(extremes(scene))))


@lru_cache(maxsize=MOST_KEPT)
def _shortest(model: Model, speeds: tuple[float, ...]) -> dict[str, float]:
    each = [model.limits(speed) for speed in speeds]
    return {body: min(one[body] for one in each) for body in each[0]}


def check_step(model: Model, scene: Scene) -> None:
    """Raise InputError, naming the limit, if dt >= 2 / omega_max of a body."""
    step = scene.solver.time_step
    bodies = shortest_limits(model, scene)
    body, limit = min(bodies.items(), key=lambda item: item[1])
    if not step < limit:
        raise InputError(
            f"time_step must be < {limit:.6g} s (2 / omega_max of the {body}), "
            f"got {step:.6g}"
        )


def check_count(scene: Scene) -> None:
    """Raise InputError if the step that `accuracy` chooses makes a run too long."""
    step, end = scene.solver.time_step, scene.end_times[-1]
    if not end <= MOST_STEPS * step:
        raise InputError(
            f"duration must be <= {MOST_STEPS * step:.3g} s ({MOST_STEPS:g} steps of "
            f"{step:.3g} s, which accuracy asks for), got {end:.6g}"
        )


def check_loading(scene: Scene) -> None:
    """Raise InputError if the pulse has too few time steps.

    Sampled at n steps, the impulse of a pulse of force F and duration tau is F tau
    cot(pi / 2n) / n instead of 2 F tau / pi, too small by a share (pi / n)^2 / 12; a
    pulse shorter than a step has none.
    """
    step = scene.solver.time_step
    if scene.is_loaded and scene.pulse < FEWEST_IN_PULSE * step:
        raise InputError(
            f"pulse must be >= {FEWEST_IN_PULSE * step:.6g} s ({FEWEST_IN_PULSE} time "
            f"steps, or its impulse is wrong by more than 1 %), got {scene.pulse:.6g}"
        )


def check_wall(scene: Scene) -> None:
    """Raise InputError if a casing's shape would move into the blades too fast.

    Contact removes any penetration within one step: if a casing is inside the blades at
    once, or after few steps, the impulse grows as the step shrinks. If it takes many
    steps to reach the blades, the impulse does not depend on the step.
    """
    casing, step = scene.engine.casing, scene.solver.time_step
    share = missed_share(scene)
    if not share <= MOST_MISSED:
        raise InputError(
            f"profile must be smooth enough for {HIGHEST} harmonics: within "
            f"{WITHIN:.2g} rad of each angle they must be its table to "
            f"{MOST_MISSED:.0%} of the gap there, got {100 * share:.3g} % (parts "
            "narrower than that are lost)"
        )
    limits = {name: (1 + 1e-9) * most for name, most in wall_limits(scene).items()}
    if not step <= limits.get("growth", math.inf):
        most = MOST_GROWTH / step
        raise InputError(
            f"growth must be within +-{most:.6g} 1/s ({MOST_GROWTH:g} of a rigid "
            f"casing's distortion in a time step), got {casing.growth:.6g}"
        )
    if not step <= limits.get("profile_rise", math.inf):
        raise InputError(
            f"profile_rise must be >= {FEWEST_IN_RISE * step:.6g} s ({FEWEST_IN_RISE} "
            "time steps) where profile and offset reach the circle of the tips (inward "
            f"by {shape_of(scene).depth:.6g} m, gap {scene.gap:.6g} m), got "
            f"{casing.profile_rise:.6g}"
        )
    if not step <= limits.get("rise", math.inf):
        raise InputError(
            f"rise must be >= {FEWEST_IN_RISE * step:.6g} s ({FEWEST_IN_RISE} time "
            f"steps) where a rigid casing (amplitude {casing.amplitude:.6g} m) reaches "
            f"the circle of the tips (gap {scene.gap:.6g} m), got {casing.rise:.6g}"
        )


def wall_limits(scene: Scene) -> dict[str, float]:
    """Return {casing input: longest time step, s, that it allows}.

    The inputs are `growth`, `rise` and `profile_rise`, by which the casing's shape
    changes in time, see `check_wall`; those that set no limit are absent.
    """
    casing, out = scene.engine.casing, {}
    if shape_of(scene).depth > scene.gap:
        out["profile_rise"] = casing.profile_rise / FEWEST_IN_RISE
    if casing.kind == "ring" or casing.amplitude == 0.0:
        return out
    if casing.growth:
        out["growth"] = MOST_GROWTH / abs(casing.growth)
    if _wall_reach(scene) > scene.gap:
        out["rise"] = casing.rise / FEWEST_IN_RISE
    return out


def _wall_reach(scene: Scene) -> float:
    """Return how far the shape of a rigid casing reaches inward at any angle, m.

    The shape is prescribed and fades in during the time `rise`; the result is for the
    end of this time.
    """
    casing = scene.engine.casing
    place = 2 * np.pi / AROUND * np.arange(float(AROUND))
    with np.errstate(over="ignore"):
        size = casing.amplitude * np.exp(casing.growth * casing.rise)
    inward = size * np.cos(scene.nodal_diameter * place)
    if not is_round(scene):
        inward = inward - departure(shape_of(scene), place)
    return float(inward.max())


def longest_turn(model: Model, scene: Scene) -> float:
    """Return the time in which a blade passes half the casing's shortest wave, s."""
    waves = float(max(scene.nodal_diameter, *shape_of(scene).orders, 0))
    if isinstance(model.ring, RingOperator):
        waves = max(waves, 0.5 * model.ring.elements)
    elif model.ring is not None:
        waves = max(waves, float(model.ring.harmonics))
    fastest = abs(extremes(scene)[1])  # times `waves` it might overflow
    return math.pi / max(waves, 1.0) / fastest if fastest > 0.0 else math.inf


def check_turn(model: Model, scene: Scene) -> None:
    """Raise InputError if a blade passes half a wave of the casing in a step."""
    longest, step = longest_turn(model, scene), scene.solver.time_step
    if not step < longest:
        fastest = extremes(scene)[1]
        most = abs(fastest) * longest / step
        raise InputError(
            f"speed must be {_short_of(most, fastest)} with this time_step (a blade "
            f"would pass half the casing's shortest wave in a step), got {fastest:.6g}"
        )


def longest_over_layer(scene: Scene) -> float:
    """Return the time in which a tip slides by `layer_edge`, s; inf without a layer."""
    engine, fastest = scene.engine, abs(extremes(scene)[1])
    if engine.casing.contact_law == RIGID or fastest == 0.0:
        return math.inf
    slides = engine.rotor.radius * fastest  # 0 where it underflows
    return float(engine.casing.layer_edge / slides) if slides > 0.0 else math.inf


def check_layer(scene: Scene) -> None:
    """Raise InputError if a tip slides by more than `layer_edge` in a time step."""
    longest, step = longest_over_layer(scene), scene.solver.time_step
    if not step <= longest:
        fastest = extremes(scene)[1]
        limit = _short_of(abs(fastest) * longest / step, fastest, "=")
        raise InputError(
            f"speed must be {limit} with this time_step (a tip would move by more than "
            f"layer_edge in a step), got {fastest:.6g}"
        )


def frequency_error(phase: float, ratio: float = 0.0) -> float:
    """Return the relative error of a mode's damped frequency by central differences.

    The numerical frequency w' follows from sin(w' dt / 2) = (x / 2) sqrt((1 - 2 xi^2 /
    (1 + s)) / s), s = sqrt(1 - xi^2 x^2); the exact one is w sqrt(1 - xi^2). Undamped,
    sin(w' dt / 2) = w dt / 2, and the leading term of the error is (w dt)^2 / 24.

    Parameters
    ----------
    phase : x = w dt, w the undamped frequency, at most 2 sqrt(1 - xi^2), beyond which
        a free motion does not oscillate
    ratio : damping ratio xi < 1
    """
    root = math.sqrt(1.0 - (ratio * phase) ** 2)
    sine = 0.5 * phase * math.sqrt((1.0 - 2.0 * ratio**2 / (1.0 + root)) / root)
    turned = 2.0 * math.asin(min(sine, 1.0))
    return turned / (phase * math.sqrt(1.0 - ratio**2)) - 1.0


@lru_cache(maxsize=1024)
def longest_phase(accuracy: float, ratio: float = 0.0) -> float:
    """Return the largest w dt with a frequency error of at most `accuracy`.

    w is the undamped frequency of a mode, rad/s, dt the time step.

    Parameters
    ----------
    accuracy : largest relative error of the damped frequency
    ratio : damping ratio xi; above `HARDLY` it is taken as `HARDLY`
    """
    ratio = min(ratio, HARDLY)
    top = 2.0 * math.sqrt(1.0 - ratio**2)  # the error grows up to there
    if frequency_error(top, ratio) <= accuracy:
        return top
    asked = max(accuracy, RESOLVED)
    phase = zero_between(lambda x: frequency_error(x, ratio) - asked, 1e-6, top)
    return phase * math.sqrt(accuracy / asked)


def turned(omega: Floats, speed: float) -> Floats:
    """Return raised frequencies of modes for the choice of the time step, (m,), rad/s.

    A mode at rest of that frequency has the largest error of the waves at speed.

    Integrated by central differences, a wave e^{i w t} with stiffness K and Coriolis
    forces 2 Omega c, |c| <= 1, both per mass, satisfies

    (2 / dt sin(w dt / 2))^2 + 2 Omega c sin(w dt) / dt = K,

    so that the leading term of the relative error of w is (w dt)^2 / 24 (w + 4 Omega c)
    / (w + Omega c). With x = Omega / omega, omega at rest, and K from omega^2 - Omega^2
    (softening) to omega^2, this is at most `SLOWER` (omega dt)^2 / 24 for x < 0.43,
    reached by the slower of the two waves; beyond, the faster wave has (1 + x)^2 (3 x -
    1) times as much.

    Parameters
    ----------
    omega : (m,), frequencies of the modes at rest, rad/s
    speed : Omega of the rotor, rad/s
    """
    x = abs(speed) / np.maximum(omega, np.finfo(float).tiny)
    with np.errstate(over="ignore"):
        faster = (1.0 + x) ** 2 * (3.0 * x - 1.0)
    return np.asarray(omega * np.sqrt(np.maximum(np.minimum(1.0 + x, SLOWER), faster)))


@one_thread()
def step_asked(model: Model, scene: Scene) -> float:
    """Return the longest step that a scene's accuracy allows, s.

    The step keeps `frequency_error` below `accuracy` for every mode of the rotor, with
    terms of rotation for every wave, see `turned`. It is at most `SAFE` of the limits
    by stability of both bodies, pulse, rotation, layer and wall. Modes with omega above
    the rotor's `reach`, which only a basis for all speeds has, need no accuracy: their
    omega counts as `reach`. A squeeze film has this accuracy up to `IN_FILM`.
    """
    rotor, accuracy = model.rotor, scene.solver.accuracy
    phases = [longest_phase(accuracy, float(ratio)) for ratio in rotor.ratios]
    omega, stiffer = np.minimum(rotor.omega, rotor.reach), 1.0
    bodies = shortest_limits(model, scene)
    if rotor.spin is not None:
        omega = turned(omega, extremes(scene)[1])
        stiffer = max(1.0, model.limits(0.0)["rotor"] / bodies["rotor"])
    step = 1.0 / float((stiffer * omega / phases).max())
    if (rate := film_error(model, 1.0, IN_FILM)) > 0.0:
        step = min(step, accuracy / rate)
    turns = longest_turn(model, scene), longest_over_layer(scene)
    limits = [*bodies.values(), *turns]
    if scene.is_loaded:
        limits.append(scene.pulse / FEWEST_IN_PULSE)
    limits += [limit for limit in wall_limits(scene).values() if limit > 0.0]
    return min(step, SAFE * min(limits))


def film_error(model: Model, step: float, eccentricity: float) -> float:
    """Return an estimate of a squeeze film's relative error in time; 0 without a film.

    It is that of the motion in the film, relative to its largest; of several films the
    largest. A step's contact is not among the velocities that give the film's force in
    the same step: the error is of first order, BY_FILM dt c / m, c being the damping
    along the eccentricity and 1 / m the mobility there. BY_FILM is the largest value
    found in runs with contact up to an eccentricity of 0.83.

    step, eccentricity : dt, s; largest displacement in the film over the clearance
    """
    pulls = [
        one.support.at(0.0).film * ((one.rows @ model.rotor.shapes) ** 2).sum() / 2.0
        for one in unlike(model.rotor, model.blades)
    ]
    most = float(max(pulls, default=0.0))
    return BY_FILM * step * most * film_shares(eccentricity)[0] if most else 0.0


def told_of_film(model: Model, scene: Scene, peak: float) -> str:
    """Return a remark on a film's error in time beyond what is asked for, else "".

    model : the model of all sectors
    scene : with the time step and accuracy
    peak : m, largest displacement of the centre
    """
    clearance = scene.engine.rotor.film_clearance
    asked = scene.solver.accuracy or USUAL_OF_FILM
    error = film_error(model, scene.solver.time_step, peak / clearance)
    if error <= asked:
        return ""
    return (
        f"the squeeze film's error in time is some {min(error, 1.0):.2g} of the "
        f"centre's motion, at {peak / clearance:.3g} of the clearance; time_step = "
        f"{scene.solver.time_step * asked / error:.2g} s would make it {asked:g}"
    )


def fastest_line(model: Model, speed: float) -> float:
    """Return the highest frequency of the rotor that matters, rad/s, static frame.

    A mode matters if it has at least `MATTERS` of the largest modal compliance of the
    centre (of the tips, if no mode moves the centre) under a steady load. Its frequency
    in the static frame is at most omega + |Omega|; with full rotation omega + 2
    |Omega|, since Coriolis forces split a pair by at most 2 |Omega|.
    """
    turns = 1.0 if model.rotor.spin is None else 2.0
    return _fastest(model) + turns * abs(speed)


@lru_cache(maxsize=MOST_KEPT)
def _fastest(model: Model) -> float:
    """Return the highest frequency of a rotor's compliant modes, rad/s, in its frame.

    These are modes with at least `MATTERS` of the largest modal compliance of the
    centre, or of the tips if no mode moves the centre, see `fastest_line`.
    """
    body = model.rotor
    rows = centre_rows(body, model.blades)
    if not rows.any():
        rows = tip_rows(body, model.blades)[0]
    free = body.omega > 0.0
    gives = (rows[:, free] ** 2).sum(axis=0) / body.omega[free] ** 2
    matters = gives >= MATTERS * gives.max(initial=0.0)
    return float(body.omega[free][matters].max(initial=0.0))


def beat_of(model: Model, scene: Scene) -> int:
    """Return the number of time steps between two rows of evidence of a case.

    A row has numbers on the state at one time, from which the word is determined later.

    A period of `fastest_line` has `PER_PERIOD` rows. Their spacing depends on engine,
    speed, step and duration, never on the traces kept. A run has at least `FEWEST_ROWS`
    rows, so that its last 40 % has 64: the spacing of a short run follows from its
    duration alone.
    """
    step = scene.solver.time_step
    total, _ = step_counts(scene)
    line = fastest_line(model, extremes(scene)[1])
    longest = 2 * math.pi / (PER_PERIOD * line) / step if line > 0.0 else math.inf
    return max(1, round(min(longest, total / FEWEST_ROWS)))


def step_counts(scene: Scene) -> tuple[int, int]:
    """Return (time steps of the whole run, time steps between samples of traces)."""
    step = scene.solver.time_step
    total = max(1, math.ceil(scene.end_time / step - 1e-9))
    stride = min(scene.output.interval / step, float(total))
    return total, max(1, round(stride))
