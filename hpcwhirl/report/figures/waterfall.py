"""Waterfall of a run whose speed or gap changes: spectra over time and over speed."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from numpy.typing import NDArray

from hpcwhirl.analysis.over_speed import Spell, crossings, spells_of
from hpcwhirl.analysis.spectrum import full_spectrum
from hpcwhirl.case.resolve import Case, resolve
from hpcwhirl.case.speed import law_of, speed_at
from hpcwhirl.errors import InputError
from hpcwhirl.report.labels import axis_of, title_of
from hpcwhirl.scene.words import SHOWN
from hpcwhirl.store.reading.results_file import Results

Floats = NDArray[np.float64]
COLUMNS = 120  # largest number of spectra
TURNS = 8.0  # revolutions at the mean speed that each spectrum covers
FEWEST = 32  # least number of samples of a spectrum
DECADES = 4  # decades of amplitude that are shown
STRIP = 0.05  # height of the strip of words, relative to that of the axes


def spectra_over(
    time: Floats, orbit: NDArray[np.complex128], turn: float
) -> tuple[Floats, Floats, Floats]:
    """Return spectra of an orbit over time.

    Parameters
    ----------
    time : (n,), s, equally spaced
    orbit : (n,), m, static frame
    turn : s, duration of a revolution

    Returns
    -------
    middles : (c,), s, middle of the part of `TURNS` revolutions of each spectrum
    omega : (f,), rad/s, ascending
    amplitude : (c, f), m
    """
    interval = float(time[1] - time[0])
    size = min(max(round(TURNS * turn / interval), FEWEST), len(time))
    first = np.unique(np.linspace(0, len(time) - size, COLUMNS).astype(int))
    parts = [full_spectrum(orbit[i : i + size], interval) for i in first]
    middles = time[first] + 0.5 * (size - 1) * interval
    return middles, parts[0][0], np.stack([amplitude for _, amplitude in parts])


def draw_waterfall(cases: Results, case: int) -> Any:
    """Return a figure of the centre's spectra over time and, if it changes, speed.

    The strip below shows the word of each window, dashed lines Omega and -Omega, dotted
    lines the times and speeds at which a critical speed is crossed.
    """
    resolved, row, traces = (
        resolve(cases.scene(case)),
        cases.rows[case],
        cases.traces(case),
    )
    told = str(row.get("words_over_speed", ""))
    if not told:
        msg = "a waterfall needs a case whose speed or gap changes in time"
        raise InputError(msg)
    scene, time = resolved.scene, traces["time"]
    if len(time) < 2 * FEWEST:
        msg = f"a waterfall needs {2 * FEWEST} samples, got {len(time)}: lower interval"
        raise InputError(msg)
    mean = float(np.abs(speed_at(scene, time)).mean())
    turn = 2 * np.pi / mean if mean > 0.0 else float(time[-1])
    spectra = spectra_over(time, traces["centre"] @ np.array([1.0, 1j]), turn)
    moves = law_of(scene) is not None
    figure = Figure(figsize=(11 if moves else 7, 5.6), layout="constrained")
    panels = figure.subplots(1, 2 if moves else 1, sharey=True, squeeze=False)[0]
    mesh = _over_time(panels[0], resolved, spectra)
    _strip(panels[0], [(s.begin, s.end, s) for s in spells_of(told)])
    if moves:
        _over_speed(panels[1], resolved, spectra)
        _strip(panels[1], [(s.first, s.last, s) for s in spells_of(told)])
    panels[0].set_ylabel("ω, rad/s, static frame: backward < 0 < forward")
    figure.colorbar(mesh, ax=list(panels), label="radius of the line's circle, mm")
    figure.suptitle(title_of(row))
    regimes = dict.fromkeys(spell.regime for spell in spells_of(told))
    patches = [Patch(fc=SHOWN[r].colour, ec="k", lw=0.4, label=r) for r in regimes]
    figure.legend(handles=patches, loc="outside lower center", ncols=len(patches))
    return figure


def _mesh(axes: Any, at: Floats, omega: Floats, amplitude: Floats, most: float) -> Any:
    shown = np.abs(omega) <= most
    values = 1e3 * amplitude[:, shown].T
    top = float(values.max(initial=0.0)) or 1.0
    norm = LogNorm(top * 10.0**-DECADES, top, clip=True)
    return axes.pcolormesh(at, omega[shown], values, norm=norm, shading="nearest",
                           rasterized=True)  # fmt: skip


def _top(omega: Floats, amplitude: Floats, speed: float) -> float:
    """Return the highest |omega| to draw, rad/s, between 1.2 and 3 times `speed`.

    Within these limits it is the highest |omega| with an amplitude above 1/1000 of the
    largest one.
    """
    seen = (amplitude > 1e-3 * amplitude.max(initial=0.0)).any(axis=0)
    highest = float(np.abs(omega[seen]).max(initial=0.0))
    return min(max(highest, 1.2 * speed), 3.0 * speed)


def _over_time(axes: Any, case: Case, spectra: tuple[Floats, Floats, Floats]) -> Any:
    middles, omega, amplitude = spectra
    speeds = speed_at(case.scene, middles)
    most = _top(omega, amplitude, float(np.abs(speeds).max()))
    mesh = _mesh(axes, middles, omega, amplitude, most)
    for sign in (1.0, -1.0):
        axes.plot(middles, sign * speeds, "w--", lw=0.8)
    for one in crossings(case):
        axes.axvline(one["time"], c="w", ls=":", lw=0.9)
    axes.set(xlabel="t, s", ylim=(-most, most))
    return mesh


def _over_speed(axes: Any, case: Case, spectra: tuple[Floats, Floats, Floats]) -> None:
    """Draw the spectra over speed; at speeds passed repeatedly, those passed last."""
    middles, omega, amplitude = spectra
    speeds, last = np.unique(speed_at(case.scene, middles)[::-1], return_index=True)
    most = _top(omega, amplitude, float(np.abs(speeds).max()))
    _mesh(axes, speeds, omega, amplitude[::-1][last], most)
    for sign in (1.0, -1.0):
        axes.plot(speeds, sign * speeds, "w--", lw=0.8)
    for one in crossings(case):
        axes.axvline(one["speed"], c="w", ls=":", lw=0.9)
    axes.set(xlabel=axis_of("speed"))


def _strip(axes: Any, spans: list[tuple[float, float, Spell]]) -> None:
    for begin, end, spell in spans:
        axes.axvspan(begin, end, 0.0, STRIP, fc=SHOWN[spell.regime].colour, ec="k",
                     lw=0.4)  # fmt: skip
