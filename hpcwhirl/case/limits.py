"""Which steps a case allows: stability, pulse, turn and wall, and how they are counted.

The free motion of the recursion that is marched (`dynamics.timestep`) is z^n, (1 + xi
x) z^2 - (2 - x^2) z + (1 - xi x) = 0 with x = w dt, so that a mode turns by arg z a
step instead of x sqrt(1 - xi^2): see `frequency_error`.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from hpcwhirl.errors import InputError
from hpcwhirl.reduction.bodies import centre_rows, tip_rows
from hpcwhirl.reduction.model import Model
from hpcwhirl.scene import Scene
from hpcwhirl.structure import RingOperator

MOST_KEPT = 32  # models, as in `reduction.model`
SAFE = 0.9  # of the stability limit, where an accuracy asks for a step
MATTERS = 1e-2  # share of the largest compliance: 1e-4 of the power
PER_PERIOD = 12.0  # rows of evidence a period of the fastest line
FEWEST_ROWS = 160  # of a run
FEWEST_IN_PULSE = 10  # steps: fewer would miss more than 1 % of its impulse
HARDLY = 0.7  # ratio above which a mode hardly turns: its step is that of this ratio
RESOLVED = 1e-8  # error below which round-off hides it; it goes with x^2 there
FEWEST_IN_RISE = 50  # steps of a rigid casing: fewer miss a tenth of its impulse
MOST_GROWTH = 0.05  # of a rigid casing's distortion in a step: misses 3 % of it


def check_limits(model: Model, scene: Scene) -> None:
    """Raise InputError where a scene's step is beyond what its model and it allow."""
    check_step(model, scene)
    check_loading(scene)
    check_turn(model, scene)
    check_wall(scene)


def check_step(model: Model, scene: Scene) -> None:
    """Raise InputError, naming the limit, where dt >= 2 / omega_max of a body."""
    step = scene.solver.time_step
    body, limit = min(model.limits().items(), key=lambda item: item[1])
    if not step < limit:
        msg = (
            f"time_step must be < {limit:.6g} s (2 / omega_max of the {body}), "
            f"got {step:.6g}"
        )
        raise InputError(msg)


def check_loading(scene: Scene) -> None:
    """Raise InputError where the pulse is too short for the steps it is sampled at.

    n steps give F tau cot(pi / 2n) / n instead of 2 F tau / pi, less by (pi / n)^2 / 12
    of it; a pulse shorter than a step would give nothing.
    """
    step = scene.solver.time_step
    if scene.is_loaded and scene.pulse < FEWEST_IN_PULSE * step:
        msg = (
            f"pulse must be >= {FEWEST_IN_PULSE * step:.6g} s ({FEWEST_IN_PULSE} time "
            f"steps, or its impulse is wrong by more than 1 %), got {scene.pulse:.6g}"
        )
        raise InputError(msg)


def check_wall(scene: Scene) -> None:
    """Raise InputError where a rigid casing would jump into the blades.

    Contact takes back within a step whatever gap is missing at its end: a casing that
    is inside the blades at once, or after few steps, gives an impulse that grows as the
    step falls. One that comes to them in many steps gives the same at any.
    """
    casing, step = scene.engine.casing, scene.solver.time_step
    limits = {name: (1 + 1e-9) * most for name, most in wall_limits(scene).items()}
    if not step <= limits.get("growth", math.inf):
        most = MOST_GROWTH / step
        msg = (
            f"growth must be within +-{most:.6g} 1/s ({MOST_GROWTH:g} of a rigid "
            f"casing's distortion in a time step), got {casing.growth:.6g}"
        )
        raise InputError(msg)
    if not step <= limits.get("rise", math.inf):
        msg = (
            f"rise must be >= {FEWEST_IN_RISE * step:.6g} s ({FEWEST_IN_RISE} time "
            f"steps) where a rigid casing (amplitude {casing.amplitude:.6g} m) rises "
            f"into the blades (gap {scene.gap:.6g} m), got {casing.rise:.6g}"
        )
        raise InputError(msg)


def wall_limits(scene: Scene) -> dict[str, float]:
    """Return the longest steps, s, that a rigid casing's growth and rise allow."""
    casing = scene.engine.casing
    if casing.kind == "ring" or casing.amplitude == 0.0:
        return {}
    out = {"growth": MOST_GROWTH / abs(casing.growth)} if casing.growth else {}
    if _wall_reach(scene) > scene.gap:
        out["rise"] = casing.rise / FEWEST_IN_RISE
    return out


def _wall_reach(scene: Scene) -> float:
    """Return how far inward of round a rigid casing is at any blade after its rise, m.

    During a rise that is too short, blades hardly move.
    """
    casing, blades = scene.engine.casing, scene.engine.rotor.blades
    place = scene.speed * casing.rise + 2 * np.pi * np.arange(blades) / blades
    with np.errstate(over="ignore"):
        size = casing.amplitude * np.exp(casing.growth * casing.rise)
    return float((size * np.cos(scene.nodal_diameter * place)).max())


def longest_turn(model: Model, scene: Scene) -> float:
    """Return the time in which a blade passes half a wave of the casing, s."""
    waves = float(scene.nodal_diameter)
    if isinstance(model.ring, RingOperator):
        waves = 0.5 * model.ring.elements
    elif model.ring is not None:
        waves = float(model.ring.harmonics)
    turn = max(waves, 1.0) * abs(scene.speed)
    return math.pi / turn if turn > 0.0 else math.inf


def check_turn(model: Model, scene: Scene) -> None:
    """Raise InputError where a blade passes half a wave of the casing in a step."""
    longest, step = longest_turn(model, scene), scene.solver.time_step
    if not step < longest:
        most = abs(scene.speed) * longest / step
        msg = (
            f"speed must be < {most:.6g} rad/s with this time_step (a blade would pass "
            f"half the casing's shortest wave in a step), got {scene.speed:.6g}"
        )
        raise InputError(msg)


def frequency_error(phase: float, ratio: float = 0.0) -> float:
    """Return by how much of itself central differences make a frequency too high.

    sin(w' dt / 2) = (x / 2) sqrt((1 - 2 xi^2 / (1 + s)) / s), s = sqrt(1 - xi^2 x^2),
    against w' = w sqrt(1 - xi^2); undamped sin(w' dt / 2) = w dt / 2, with the leading
    term (w dt)^2 / 24.

    Parameters
    ----------
    phase : x = w dt, at most 2 sqrt(1 - xi^2), from where z is real
    ratio : xi < 1
    """
    root = math.sqrt(1.0 - (ratio * phase) ** 2)
    sine = 0.5 * phase * math.sqrt((1.0 - 2.0 * ratio**2 / (1.0 + root)) / root)
    turned = 2.0 * math.asin(min(sine, 1.0))
    return turned / (phase * math.sqrt(1.0 - ratio**2)) - 1.0


@lru_cache(maxsize=1024)
def longest_phase(accuracy: float, ratio: float = 0.0) -> float:
    """Return the largest x = w dt with a frequency error of at most `accuracy`.

    Parameters
    ----------
    accuracy : of the damped frequency, of itself
    ratio : xi; above `HARDLY` it is taken as that
    """
    ratio = min(ratio, HARDLY)
    top = 2.0 * math.sqrt(1.0 - ratio**2)  # the error grows up to there
    if frequency_error(top, ratio) <= accuracy:
        return top
    from scipy.optimize import brentq  # a campaign of given steps has no need of it

    asked = max(accuracy, RESOLVED)
    phase = brentq(lambda x: frequency_error(x, ratio) - asked, 1e-6, top)
    return float(phase) * math.sqrt(accuracy / asked)


def step_asked(model: Model, scene: Scene) -> float:
    """Return the longest step that a scene's accuracy allows, s.

    Central differences make a mode's frequency wrong by `frequency_error` of itself:
    the step keeps that below `accuracy` for every mode of the rotor, and is at most
    `SAFE` of what the stability of both bodies, the pulse and the turn allow.
    """
    rotor, accuracy = model.rotor, scene.solver.accuracy
    phases = [longest_phase(accuracy, float(ratio)) for ratio in rotor.ratios]
    step = 1.0 / float((rotor.omega / phases).max())
    limits = [*model.limits().values(), longest_turn(model, scene)]
    if scene.is_loaded:
        limits.append(scene.pulse / FEWEST_IN_PULSE)
    limits += [limit for limit in wall_limits(scene).values() if limit > 0.0]
    return min(step, SAFE * min(limits))


def fastest_line(model: Model, speed: float) -> float:
    """Return the fastest line that matters in the static frame, rad/s.

    Of the modes that move the centre, or the tips where none does, under a load that
    stands: those that give at least `MATTERS` of what the most compliant one does;
    in the static frame each has a line at omega + |Omega| at most.
    """
    return _fastest(model) + abs(speed)


@lru_cache(maxsize=MOST_KEPT)
def _fastest(model: Model) -> float:
    """Return the same in the rotating frame."""
    body = model.rotor
    rows = centre_rows(body, model.blades)
    if not rows.any():
        rows = tip_rows(body, model.blades)[0]
    free = body.omega > 0.0
    gives = (rows[:, free] ** 2).sum(axis=0) / body.omega[free] ** 2
    matters = gives >= MATTERS * gives.max(initial=0.0)
    return float(body.omega[free][matters].max(initial=0.0))


def beat_of(model: Model, scene: Scene) -> int:
    """Return the steps between rows of evidence: `PER_PERIOD` of the fastest line.

    It depends on engine, speed, step and duration, never on what is kept; of a run of
    so few steps that its last 40 % would have less than 64 rows, on its duration alone.
    """
    step = scene.solver.time_step
    total, _ = step_counts(scene)
    line = fastest_line(model, scene.speed)
    longest = 2 * math.pi / (PER_PERIOD * line) / step if line > 0.0 else math.inf
    return max(1, round(min(longest, total / FEWEST_ROWS)))


def step_counts(scene: Scene) -> tuple[int, int]:
    """Return (steps of the whole run, steps between samples)."""
    step = scene.solver.time_step
    total = max(1, math.ceil(scene.end_time / step - 1e-9))
    stride = min(scene.output.interval / step, float(total))
    return total, max(1, round(stride))
