"""Response to an unbalance over the speed: amplitude, lag and force at the supports."""

from __future__ import annotations

import cmath
from typing import Any

import numpy as np

from hpcwhirl.analysis.response import STATION, SUPPORT, Steady
from hpcwhirl.analysis.response_study import Study
from hpcwhirl.report import palette
from hpcwhirl.report.canvas import BOX, axis_of, legend_below, new_figure
from hpcwhirl.scene import title_of
from hpcwhirl.scene.units import in_shown, shown_in

LOOKS = {"centre": (palette.BLUE, "-", 2.4), "tips": (palette.GREEN, "--", 1.2)}
SHOWN = 1e-4  # least amplitude shown / largest
FORCE, ROOM = palette.PURPLE, palette.ORANGE
TOLD = 3  # largest number of peaks whose amplification factor is written


def draw_response(found: Study) -> Any:
    """Return the Bode diagram of a response: amplitudes, lag of the centre, force."""
    figure, (size, lag, force) = new_figure(
        (9.5, 8.0), 3, sharex=True, height_ratios=(3, 1.4, 1.6)
    )
    speeds = np.array([one.speed for one in found.points])
    _amplitudes(size, found, speeds)
    shown = [_lag(found.moment, one) for one in found.points]
    lag.plot(speeds, shown, "-", c=LOOKS["centre"][0])
    lag.set(ylabel="lag of the\ncentre, degrees", yticks=range(-180, 361, 90))
    lag.set_ylim(min(shown) - 10, max(shown) + 10)
    unit, factor = shown_in("N")
    sizes = factor * np.array([one.size("supports") for one in found.points])
    force.semilogy(speeds, sizes, c=FORCE, ls="-.", label="force on the supports")
    _draw_each(force, found, SUPPORT, factor)
    force.set_ylim(SHOWN * sizes.max(), 5.0 * sizes.max())
    force.set(xlabel=axis_of("speed"), ylabel=f"force on the\nsupports, {unit}")
    for axes in (size, lag, force):
        told = "operating speeds" if axes is size else None
        axes.axvspan(*found.operating, fc=palette.FAINT, ec=palette.EDGE,
                     lw=0.5, zorder=0, label=told)  # fmt: skip
        axes.set_xlim(0.0, speeds[-1])
    name = title_of(found.scene.engine.name, found.scene.engine.file)
    moment = in_shown(abs(found.moment), "kg m", 4)
    size.set_title(f"{name}: response to {moment} without contact", parse_math=False)
    legend_below(figure, size, force)
    return figure


def _amplitudes(axes: Any, found: Study, speeds: Any) -> None:
    """Draw amplitudes of centre and tips with the clearance, peaks with their AF."""
    unit, factor = shown_in("m")
    top = 0.0
    for place, (colour, line, width) in LOOKS.items():
        sizes = factor * np.array([one.size(place) for one in found.points])
        axes.semilogy(speeds, sizes, line, c=colour, lw=width,
                      label=f"amplitude, {place}")  # fmt: skip
        top = max(top, float(sizes.max()))
    _draw_each(axes, found, STATION, factor)
    rooms = np.array([one.room for one in found.points])
    axes.semilogy(speeds, factor * np.where(rooms > 0.0, rooms, np.nan), ":", c=ROOM,
                  lw=1.5, label="clearance")  # fmt: skip
    for number, (low, high) in enumerate(found.bands(1.0)):
        axes.axvspan(low, high, fc="none", ec=ROOM, hatch="///", lw=0, alpha=0.5,
                     label=None if number else "the tips touch")  # fmt: skip
    highest = sorted(found.peaks["centre"], key=lambda peak: -peak.amplitude)[:TOLD]
    for peak in highest:
        af = peak.amplification
        told = "" if af is None else f"\nAF {af:.3g}"
        axes.plot(
            peak.speed, factor * peak.amplitude, "o", c=palette.INK, mfc=palette.GROUND
        )
        axes.annotate(in_shown(peak.speed, "rad/s", 4) + told,
                      (peak.speed, factor * peak.amplitude), (8, 10), va="bottom",
                      textcoords="offset points", fontsize=8, bbox=BOX)  # fmt: skip
    top = max(top, factor * float(rooms.max()))
    axes.set(ylabel=f"amplitude, {unit}", ylim=(SHOWN * top, 5.0 * top))


def _draw_each(axes: Any, found: Study, kind: str, factor: float) -> None:
    """Draw the amplitudes at all stations, or the forces of all supports.

    kind, factor : beginning of the places' names; of the unit shown
    """
    speeds = np.array([one.speed for one in found.points])
    places = [p for p in found.points[0].places if p.startswith(kind)]
    for number, place in enumerate(places):
        sizes = factor * np.array([one.size(place) for one in found.points])
        look = palette.spaced(number, len(places), len(speeds)) | {"lw": 0.8}
        axes.semilogy(speeds, sizes, **look, label=place)


def _lag(moment: complex, one: Steady) -> float:
    """Return how far the centre's forward motion lags the unbalance, degrees.

    It is between -90 and 270, so that a passage through 180 is no jump.
    """
    turned = moment * one.centre[0].conjugate()
    degrees = float(np.degrees(cmath.phase(turned)))
    return degrees if degrees >= -90.0 else degrees + 360.0
