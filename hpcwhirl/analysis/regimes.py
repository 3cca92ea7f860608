"""Names for motion: regime and whirl, from numbers that are stored beside them.

`evidence` turns a history into numbers; the rules of `scene.words` turn those numbers
into words and see nothing else, so that words can be given anew without integrating.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.analysis.rules import words_of_one
from hpcwhirl.analysis.whirl import static_frame, whirl_numbers
from hpcwhirl.dynamics.history import History
from hpcwhirl.scene import Scene

Floats = NDArray[np.float64]
Value = float | int | str
STEADY_SHARE = 0.4  # the last part of a run, on which evidence is taken
BLOCKS = 12  # energy is averaged over as many blocks of it before it is compared
SETTLED = 0.2  # of a run: what was before is not compared with its end
NOTHING = 1e-280  # J: squares of amplitudes that kernels flush, and denormals


def _limit(default: float, meaning: str) -> float:
    return field(default=default, metadata={"meaning": meaning})


@dataclass(frozen=True)
class Thresholds:
    """Where one word ends and the next begins; stored with the results."""

    ledger: float = _limit(
        1e-6, "largest ledger error of a run that is not `unstable`, see `ledger_error`"
    )
    opening: float = _limit(1e-9, "largest gap error of such a run, see `History`")
    significance: float = _limit(
        3.0, "standard errors at which a growth rate counts as non-zero"
    )
    drift: float = _limit(
        0.1, "change of ln(amplitude) over the window that `sustained` may show"
    )
    unclear: float = _limit(
        0.3, "the same where it is not significant, as of motions that wander"
    )
    rise: float = _limit(
        0.4, "change of ln(amplitude) over the window that `divergent` must show"
    )
    onward: float = _limit(
        0.5, "share of that rate that the last quarter of the window must go on with"
    )
    above: float = _limit(0.02, "least `summit` of a motion that is `divergent`")
    replaced: float = _limit(
        0.8,
        "fed over lost, or lost over fed, from which a steady motion is `sustained`",
    )
    turnover: float = _limit(
        2.0, "times that its energy must have been lost in the window for that"
    )
    direction: float = _limit(1.0 / 3.0, "least |P+ - P-|/(P+ + P-) that names a whirl")
    whirl_floor: float = _limit(
        1e-6, "orbit radius over gap below which there is no whirl"
    )


def threshold_facts(limits: Thresholds | None = None) -> dict[str, float]:
    """Return thresholds, by default those of new words, as attributes of results."""
    limits = limits or Thresholds()
    return {f"threshold_{name}": value for name, value in asdict(limits).items()}


def block_means(values: Floats, count: int) -> Floats:
    """Return the means (..., count) of blocks of values (..., n), n >= count.

    As many to each as `np.array_split` gives, and each with the bits of its own mean.
    """
    size, longer = divmod(values.shape[-1], count)
    cut, lead = longer * (size + 1), values.shape[:-1]
    rest = values[..., cut:].reshape(*lead, count - longer, size)
    means = np.add.reduce(rest, axis=-1) / size  # `mean` takes twice as long
    if longer:
        first = values[..., :cut].reshape(*lead, longer, size + 1)
        more = np.add.reduce(first, axis=-1) / (size + 1)
        means = np.concatenate([more, means], axis=-1)
    return np.asarray(means)


def levels(values: Floats, count: int) -> Floats:
    """Return ln sqrt of the means of `count` blocks of energies; -inf at 0.

    Blocks average the beating of close frequencies away.

    Parameters
    ----------
    values : (..., n), J

    Returns
    -------
    (..., count)
    """
    return _levels(block_means(values, count))


def _levels(means: Floats) -> Floats:
    """Return ln sqrt of means; -inf at 0."""
    moving = means > NOTHING
    if moving.all():
        return np.asarray(0.5 * np.log(means))
    return np.where(moving, 0.5 * np.log(np.where(moving, means, 1.0)), -np.inf)


def growth(time: Floats, energy: Floats) -> tuple[float, float]:
    """Return (rate, standard error), 1/s, of ln sqrt(energy), fitted by blocks.

    The error is that of the slope where each block errs as much as it stands off the
    middle of its neighbours: a smooth rise, however it accelerates, is not scatter. A
    body at rest has rate 0 and error 0; one that has come to rest meanwhile, its
    energy below `NOTHING`, the least rate that explains it.
    """
    return growths(np.stack([time, energy]))[0]


def growths(rows: Floats) -> list[tuple[float, float]]:
    """Return `growth` of several energies: rows (1 + m, n), the first of time."""
    count = min(BLOCKS, rows.shape[1])
    if count < 3:
        return [(0.0, 0.0)] * (len(rows) - 1)
    means = block_means(rows, count)
    return _fitted(means[0], _levels(means[1:]))


def _fitted(at: Floats, level: Floats) -> list[tuple[float, float]]:
    """Return (rate, standard error), 1/s, of levels (m, count) at times (count,)."""
    moving = np.asarray(np.isfinite(level).all(axis=1))
    if not moving.all():
        fits = iter(_fitted(at, level[moving]))
        return [
            next(fits) if moves else (_come_to_rest(at, own), 0.0)
            for moves, own in zip(moving, level, strict=True)
        ]
    away = at - np.add.reduce(at) / len(at)
    spread = away @ away
    rise = level[:, 1:] - level[:, :-1]
    bends = rise[:, 1:] - rise[:, :-1]
    over = 6 * bends.shape[1]
    return [
        (float(away @ own / spread), math.sqrt(bend @ bend / over / spread))
        for own, bend in zip(level, bends, strict=True)
    ]


def _come_to_rest(at: Floats, level: Floats) -> float:
    """Return the rate from the first block to the first at rest; 0 if it moves on."""
    moving = np.isfinite(level)
    rest = int(np.argmin(moving))
    if rest == 0 or moving[rest:].any():
        return 0.0
    fall = 0.5 * np.log(NOTHING) - level[0]
    return float(fall / (at[rest] - at[0]))


def summit(time: Floats, energy: Floats, start: float) -> float:
    """Return ln amplitude of the last block over the highest before it, see `levels`.

    Of the whole run but its first `SETTLED`, in blocks as long as those of the window
    that begins at `start`; 0 where there is nothing to compare.
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


def evidence(scene: Scene, history: History) -> dict[str, Value]:
    """Return the numbers a word is given by, over the last 40 % of the run.

    They come from `History.judged` and from every step's ledger: what of the motion is
    kept in traces changes none of them.

    Parameters
    ----------
    scene : the case
    history : what its integration left

    Returns
    -------
    growth_rate, growth_error (1/s, of both bodies' energy), growth_rotor,
    growth_casing, growth_centre (1/s, of the parts: rotor, casing, the centre on its
    suspension), growth_last (1/s, of its last quarter), summit (-, see
    `summit`), orbit_radius (m, rms), end_time, window (s), whirl_ratio (-), orbit_area
    (m^2/s), line_frequency (rad/s), late_fed, late_friction, late_rotation (its two
    parts), late_lost, late_energy (J), late_contacts (1 if the window has contact),
    load_end (s; 0 where there is no loading), certificate (s, -1 for none),
    certificate_reach (m), ledger_error, gap_error, step_share (-), gap_scale (m)
    """
    judged, end = history.judged, history.end
    start = (1 - STEADY_SHARE) * end
    first = int(np.searchsorted(judged.time, start, side="right"))
    time, energy = judged.time[first:], judged.energy[first:]
    centre = judged.centre[first:]
    turned = static_frame(centre, scene.speed * time)
    with np.errstate(all="ignore"):  # a run that blew up is named by its stop
        orbit = centre[:, 0] ** 2 + centre[:, 1] ** 2
        own = energy, judged.rotor[first:], judged.casing[first:], orbit
        rates = _rates(np.stack([time, *own]))
        rates["summit"] = summit(judged.time, judged.rotor, start)
        whirl = whirl_numbers(time, turned, scene.speed)
    fed, lost = _change(judged.fed[first:]), _change(judged.lost[first:])
    rubbed = _change(judged.friction[first:])
    radius = scene.engine.rotor.radius
    return {
        **{name: _number(rate) for name, rate in rates.items()},
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
        "late_energy": _number(energy.mean()) if len(time) else 0.0,
        "load_end": scene.pulse if scene.is_loaded else 0.0,
        "late_contacts": int(history.last_contact > start),
        "certificate": history.certificate,
        "certificate_reach": history.certificate_reach,
        "ledger_error": ledger_error(history),
        "gap_error": history.gap_error,
        "step_share": history.step_share,
        "gap_scale": max(scene.gap, 1e-6 * radius),
    }


def _rates(rows: Floats) -> dict[str, float]:
    """Return the growth of the whole and of its parts, 1/s.

    rows : (5, n), time, energies of both bodies, of each, and the orbit's square
    """
    (rate, error), *others = growths(rows)
    rotor, casing, centre = (growing for growing, _ in others)
    last = 3 * rows.shape[1] // 4
    return {
        "growth_rate": rate,
        "growth_error": error,
        "growth_rotor": rotor,
        "growth_casing": casing,
        "growth_centre": centre,
        "growth_last": growths(rows[:2, last:])[0][0],
    }


def _change(values: Floats) -> float:
    """Return the last less the first of cumulative values; 0 where there is none."""
    return _number(values[-1] - values[0]) if len(values) else 0.0


def _number(value: float) -> float:
    return float(value) if math.isfinite(value) else 0.0


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
    least = min(ledger["energy"], float(history.judged.energy.min(initial=0.0)))
    wrong = max(residual, -least, -ledger["damping"])
    if through < NOTHING and wrong < NOTHING:
        return 0.0
    error = wrong / through if through > 0.0 else 1.0
    return float(error) if math.isfinite(error) else 1.0


def name_regime(
    numbers: Mapping[str, Value], limits: Thresholds
) -> tuple[str, str, str]:
    """Return (outcome, regime, whirl) by the rules of `scene.words`.

    Parameters
    ----------
    numbers : of `evidence`, and `stop`
    limits : thresholds
    """
    return words_of_one(numbers, _as_numbers(limits))


@lru_cache(maxsize=8)
def _as_numbers(limits: Thresholds) -> dict[str, float]:
    return asdict(limits)
