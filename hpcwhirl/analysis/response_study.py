"""The response to an unbalance over the speed, judged: peaks, clearance, where to look.

It says which cases are worth integrating: without contact a case is its circle, so that
only where tips come near the casing can contact change anything.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from hpcwhirl.analysis.api617 import (
    CLEARANCE,
    Margin,
    Operating,
    Peak,
    margin_of,
    peaks_of,
    scale_factor,
    unbalance_of,
)
from hpcwhirl.analysis.response import (
    STATION,
    Steady,
    check_response,
    moving_mass,
    range_of,
    speeds_of,
    steady_at,
    unit_of,
)
from hpcwhirl.case.growth import stability_of
from hpcwhirl.case.resolve import resolve
from hpcwhirl.case.unbalance import is_unbalanced, moment_of
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.numbers import zero_between
from hpcwhirl.scene import Scene, apply_settings
from hpcwhirl.scene.input_names import Value

BEYOND = 1.3  # highest speed of a response / highest operating speed: SM <= 26 %
OFFERED = 11  # speeds offered in a band in which a campaign has none
CONSTANT: dict[str, Value] = {
    "acceleration": 0.0, "speed_to": 0.0, "speed_table": ""
}  # fmt: skip


@dataclass(frozen=True)
class Study:
    """A response over the speed with what follows from it.

    Attributes
    ----------
    scene : the case, with its unbalance
    moment : the unbalance m e, as x + i y, kg m, with that of a lost blade
    assumed : whether the unbalance is that of API 617, since the case has none
    operating : operating speeds
    points : steady motions, ascending in speed
    peaks : {place: peaks of its amplitude}
    scale : API 617's scale factor
    """

    scene: Scene
    moment: complex
    assumed: bool
    operating: Operating
    points: tuple[Steady, ...]
    peaks: dict[str, list[Peak]]
    scale: float

    def worst(self) -> Steady:
        """Return the motion that uses most of the clearance up to the highest speed."""
        peaks = (peak.speed for each in self.peaks.values() for peak in each)
        seen = [steady_at(self.scene, speed) for speed in peaks] + [*self.points]
        below = [one for one in seen if one.speed <= self.operating.high]
        return max(below, key=lambda one: one.used)

    def margins(self) -> list[tuple[str, Peak, Margin]]:
        """Return each peak with its place and its separation margin."""
        return [
            (place, peak, margin_of(peak, self.operating))
            for place, peaks in self.peaks.items()
            for peak in peaks
        ]

    def growing(self) -> list[tuple[float, float]]:
        """Return the bands of speed in which free motion grows, rad/s.

        There the rotor leaves its circle, without contact, too.
        """
        model, last = resolve(self.scene).model, self.points[-1].speed
        found = stability_of(model, last)
        bands = found.bands if found else ()
        return [(b.start, min(b.end, last)) for b in bands if b.start < last]

    def bands(self, share: float) -> list[tuple[float, float]]:
        """Return the bands of speed in which tips use a share of the clearance.

        They are [(rad/s, rad/s)], ascending; ends are exact, except those of the range.
        """
        above = [one.used >= share for one in self.points]
        ends = [self.points[0].speed] if above[0] else []
        ends += [
            _crossing(lambda speed: steady_at(self.scene, speed).used, share, *pair)
            for pair, (before, after) in zip(
                pairwise(one.speed for one in self.points), pairwise(above), strict=True
            )
            if before != after
        ]
        ends += [self.points[-1].speed] if above[-1] else []
        return list(zip(ends[::2], ends[1::2], strict=True))


def _crossing(
    used: Callable[[float], float], share: float, low: float, high: float
) -> float:
    """Return the speed at which a share of the clearance is used, between two speeds.

    The function is continuous, but infinite where nothing of the clearance is left.
    """

    def over(speed: float) -> float:
        return min(used(speed), 2.0 * share) - share

    return zero_between(over, low, high) if over(high) else high


def study(scene: Scene, operating: Operating, highest: float = 0.0) -> Study:
    """Return the response of a case to its unbalance, judged.

    A balanced rotor gets the unbalance of API 617.

    scene, operating : the case; its operating speeds
    highest : rad/s, end of the speeds; 0: `BEYOND` times the highest operating speed
    """
    check_response(scene)
    scene = apply_settings(scene, CONSTANT)
    assumed = not is_unbalanced(scene)
    if assumed:
        mass = moving_mass(scene)
        given = {"unbalance": unbalance_of(mass, operating.high)}
        scene = apply_settings(scene, given)
    low, high = range_of(scene, highest or BEYOND * operating.high)
    ends = {speed for speed in operating if low <= speed <= high}
    if not ends:
        raise InputError(
            f"operating speeds must be from {low:.6g} to {high:.6g} rad/s, got "
            f"{operating.low:.6g} to {operating.high:.6g}"
        )
    speeds = sorted({*speeds_of(scene, low, high), *ends})
    points = tuple(steady_at(scene, speed) for speed in speeds)
    peaks = {place: _peaks(scene, place, points) for place in points[0].places}
    first, last = speeds.index(min(ends)), speeds.index(max(ends))
    among = points[first : last + 1]
    most = max(one.size(place) for one in among for place in _probes(one))
    scale = scale_factor(most, operating.high)
    moment = moment_of(resolve(scene).model, scene)
    return Study(scene, moment, assumed, operating, points, peaks, scale)


def _probes(one: Steady) -> list[str]:
    """Return the places where API 617 has its probes: a shaft's stations, or centre."""
    return [p for p in one.places if p.startswith(STATION)] or ["centre"]


def _peaks(scene: Scene, place: str, points: Sequence[Steady]) -> list[Peak]:
    """Return the peaks of the amplitude at a place of `PLACES`."""
    return peaks_of(
        lambda speed: steady_at(scene, speed).size(place),
        [one.speed for one in points],
        [one.size(place) for one in points],
    )


def offered(
    bands: Sequence[tuple[float, float]], speeds: Sequence[float]
) -> list[float]:
    """Return the speeds that are worth integrating, rad/s, ascending.

    They are a campaign's own in each band, or `OFFERED` of the band if it has none.

    bands, speeds : result of `Study.bands`; speeds of the campaign, rad/s
    """
    found: set[float] = set()
    for low, high in bands:
        own = {speed for speed in speeds if low <= abs(speed) <= high}
        found |= own or {float(f"{v:.6g}") for v in np.linspace(low, high, OFFERED)}
    return sorted(found)


def facts_of_study(found: Study, share: float) -> dict[str, Any]:
    """Return what `hpcwhirl response --json` prints, in SI.

    found, share : the study; share of the clearance from which a case is worth
        integrating
    """
    worst = found.worst()
    return {
        "unbalance": abs(found.moment),
        "unbalance_of_api617": found.assumed,
        "operating": list(found.operating),
        "range": [found.points[0].speed, found.points[-1].speed],
        "peaks": [
            {
                "place": place,
                "unit": unit_of(place),
                **vars(peak),
                "amplification_factor": peak.amplification,
                "two_sided": peak.two_sided,
                "separation_margin": margin.actual,
                "required_margin": margin.required,
                "verdict": margin.verdict,
            }
            for place, peak, margin in found.margins()
        ],
        "clearance": {
            "worst_speed": worst.speed,
            "reach": worst.reach,
            "clearance": worst.room,
            "used": worst.used,
            "scale_factor": found.scale,
            "scaled": found.scale * worst.used,
            "limit": CLEARANCE,
        },
        "growing": found.growing(),
        "touching": found.bands(1.0),
        "worth_integrating": {"share": share, "bands": found.bands(share)},
        "curves": _curves(found),
    }


def _curves(found: Study) -> dict[str, Any]:
    """Return the response over the speed, {name: values at each speed}."""
    curves: dict[str, Any] = {"speed": [one.speed for one in found.points]}
    for place in found.peaks:
        pairs = np.array([one.parts(place) for one in found.points])
        for name, values in zip(("forward", "backward"), pairs.T, strict=True):
            curves[f"{place}_{name}"] = np.abs(values).tolist()
            curves[f"{place}_{name}_phase"] = np.angle(values).tolist()
    for name in ("reach", "room", "used"):
        curves[name] = [getattr(one, name) for one in found.points]
    return curves
