"""Names for motion: regime and whirl, from numbers that are stored beside them.

`evidence` turns a history into numbers; `name_regime` turns those numbers into words
and sees nothing else, so that words can be given anew without integrating.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.analysis.whirl import name_whirl, static_frame, whirl_numbers
from hpcwhirl.dynamics.history import History
from hpcwhirl.scene import Scene

Floats = NDArray[np.float64]
Value = float | int | str
STEADY_SHARE = 0.4  # the last part of a run, on which evidence is taken
NOTHING = 1e-280  # J: squares of amplitudes that kernels flush, and denormals
BLOCKS = 12  # energy is averaged over as many blocks of it before the fit


@dataclass(frozen=True)
class Thresholds:
    """Where one word ends and the next begins; stored with the results.

    Attributes
    ----------
    ledger : largest ledger error of a run that is not `unstable`, see `ledger_error`
    opening : largest gap error of such a run, see `History`
    significance : standard errors at which a growth rate counts as non-zero
    drift : change of ln(amplitude) over the window that `sustained` may show
    rise : change of ln(amplitude) over the window that `divergent` must show
    free : fed over lost up to which a falling motion counts as `damped`
    replaced : fed over lost from which a steady motion counts as `sustained`
    turnover : times that its energy must have been lost in the window for that
    direction : least |P+ - P-|/(P+ + P-) that names a whirl
    whirl_floor : orbit radius over gap below which there is no whirl
    """

    ledger: float = 1e-6
    opening: float = 1e-9
    significance: float = 3.0
    drift: float = 0.1
    rise: float = 0.4
    free: float = 0.1
    replaced: float = 0.8
    turnover: float = 2.0
    direction: float = 1.0 / 3.0
    whirl_floor: float = 1e-6


def growth(time: Floats, energy: Floats) -> tuple[float, float]:
    """Return (rate, standard error), 1/s, of ln sqrt(energy), fitted by blocks.

    Blocks average the beating of close frequencies away; the error is that of the
    slope. A body at rest has rate 0 and error 0; one that has come to rest meanwhile,
    its amplitudes flushed to 0, the least rate that explains it.
    """
    count = min(BLOCKS, len(time))
    if count < 3:
        return 0.0, 0.0
    at = np.array([b.mean() for b in np.array_split(time, count)])
    mean = np.array([b.mean() for b in np.array_split(energy, count)])
    moving = mean > np.finfo(float).tiny
    if not moving.all():
        return _come_to_rest(at, mean, moving), 0.0
    level = 0.5 * np.log(mean)
    away = at - at.mean()
    rate = float(away @ level / (away @ away))
    rest = level - level.mean() - rate * away
    error = float(np.sqrt(rest @ rest / (count - 2) / (away @ away)))
    return rate, error


def _come_to_rest(at: Floats, mean: Floats, moving: NDArray[np.bool_]) -> float:
    """Return the rate from the first block to the first at rest; 0 if it moves on."""
    rest = int(np.argmin(moving))
    if rest == 0 or moving[rest:].any():
        return 0.0
    fall = 0.5 * np.log(np.finfo(float).tiny / mean[0])
    return float(fall / (at[rest] - at[0]))


def evidence(scene: Scene, history: History) -> dict[str, Value]:
    """Return the numbers a word is given by, over the last 40 % of the run.

    Parameters
    ----------
    scene : the case
    history : what its integration left

    Returns
    -------
    growth_rate, growth_error (1/s), orbit_radius (m, rms), end_time, window (s),
    whirl_ratio (-), orbit_area (m^2/s), line_frequency (rad/s), late_fed,
    late_friction, late_rotation (its two parts), late_lost, late_energy (J),
    late_contacts (1 if the window has contact), load_end (s; 0 where there is no
    loading), certificate (s, -1 for none), certificate_reach (m),
    ledger_error, gap_error, step_share (-), gap_scale (m)
    """
    time = history.time
    end = float(time[-1]) if len(time) else 0.0
    start = (1 - STEADY_SHARE) * end
    late = time > start
    centre = static_frame(history.centre[late], scene.speed * time[late])
    with np.errstate(all="ignore"):  # a run that blew up is named by its stop
        rate, error = growth(time[late], history.energy[late])
        whirl = whirl_numbers(time[late], centre, scene.speed)
    fed, lost = _change(history.fed[late]), _change(history.lost[late])
    rubbed = _change(history.friction[late])
    radius = scene.engine.rotor.radius
    return {
        "growth_rate": _number(rate),
        "growth_error": _number(error),
        "orbit_radius": _number(whirl.radius),
        "end_time": end,
        "window": end - start,
        "whirl_ratio": _number(whirl.ratio),
        "orbit_area": _number(whirl.area_rate),
        "line_frequency": _number(whirl.line),
        "late_fed": fed,
        "late_friction": rubbed,
        "late_rotation": fed - rubbed,
        "late_lost": lost,
        "late_energy": _number(history.energy[late].mean()) if late.any() else 0.0,
        "load_end": scene.pulse if scene.is_loaded else 0.0,
        "late_contacts": int(history.last_contact > start),
        "certificate": history.certificate,
        "certificate_reach": history.certificate_reach,
        "ledger_error": ledger_error(history),
        "gap_error": history.gap_error,
        "step_share": history.step_share,
        "gap_scale": max(scene.gap, 1e-6 * radius),
    }


def _change(values: Floats) -> float:
    """Return the last less the first of cumulative values; 0 where there is none."""
    return _number(values[-1] - values[0]) if len(values) else 0.0


def _number(value: float) -> float:
    return float(value) if np.isfinite(value) else 0.0


def ledger_error(history: History) -> float:
    """Return by how much the ledger breaks a law, over what went through it.

    The residual is zero; the energy of a scheme that is stable is never negative, and
    neither is what damping took. The worst of these counts; 1 where the run was lost.
    """
    if history.stop == "nonfinite":
        return 1.0
    ledger = dict(history.ledger)
    residual = abs(ledger.pop("residual"))
    through = sum(abs(value) for value in ledger.values())
    least = min(ledger["energy"], float(history.energy.min(initial=0.0)))
    wrong = max(residual, -least, -ledger["damping"])
    if through < NOTHING and wrong < NOTHING:
        return 0.0
    error = wrong / through if through > 0.0 else 1.0
    return float(error) if np.isfinite(error) else 1.0


def name_regime(
    numbers: Mapping[str, Value], limits: Thresholds
) -> tuple[str, str, str]:
    """Return (outcome, regime, whirl).

    - `unstable`: not finite, no solution of the contact problem, gaps that are not
      those of the bodies, a ledger that does not close, a step at or above the limit,
      or an energy below zero, which a stable scheme does not have; no regime and no
      whirl.
    - `damped`: a certificate that no contact can recur; or amplitudes falling,
      significantly, and either no contact in the window or contact that feeds at
      most `free` of what is lost; or at rest.
    - `divergent`: grown by `rise` over the window, significantly, or beyond the
      amplitude limit, and fed by rotation and friction meanwhile.
    - `sustained`: contact that replaces at least `replaced` of what is lost, the
      energy turned over `turnover` times, and no significant change beyond `drift`.
    - `undecided`: anything else, such as falling while still touching; and whatever
      is loaded by the pulse within the window.

    Parameters
    ----------
    numbers : of `evidence`, and `stop`
    limits : thresholds
    """
    stop = str(numbers["stop"])
    broken = float(numbers["ledger_error"]) > limits.ledger
    broken = broken or float(numbers["gap_error"]) > limits.opening
    broken = broken or float(numbers["step_share"]) >= 1.0
    if stop in {"nonfinite", "complementarity"} or broken:
        return "unstable", "none", "none"
    outcome = "stopped" if stop == "amplitude" else "completed"
    return outcome, _regime(numbers, limits), _whirl(numbers, limits)


def _regime(numbers: Mapping[str, Value], limits: Thresholds) -> str:
    if float(numbers["end_time"]) - float(numbers["window"]) < float(
        numbers["load_end"]
    ):
        return "undecided"
    if float(numbers["certificate"]) >= 0.0:
        return "damped"
    rate, error = float(numbers["growth_rate"]), float(numbers["growth_error"])
    fed, lost = float(numbers["late_fed"]), float(numbers["late_lost"])
    change = rate * float(numbers["window"])
    clear = abs(rate) > limits.significance * error
    if numbers["stop"] == "amplitude" or (clear and change > limits.rise):
        return "divergent" if fed > 0.0 else "undecided"
    falling = clear and rate < 0.0
    at_rest = float(numbers["late_energy"]) == 0.0
    free = not numbers["late_contacts"] or fed <= limits.free * lost
    if at_rest or (falling and free):
        return "damped"
    steady = abs(change) <= limits.drift or not clear
    turned_over = lost >= limits.turnover * float(numbers["late_energy"])
    kept_up = numbers["late_contacts"] and fed >= limits.replaced * lost
    return "sustained" if steady and turned_over and kept_up else "undecided"


def _whirl(numbers: Mapping[str, Value], limits: Thresholds) -> str:
    floor = limits.whirl_floor * float(numbers["gap_scale"])
    if float(numbers["orbit_radius"]) < floor:
        return "none"
    ratio, area = float(numbers["whirl_ratio"]), float(numbers["orbit_area"])
    return name_whirl(ratio, area, limits.direction)
