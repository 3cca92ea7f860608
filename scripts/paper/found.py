"""The campaigns of the paper's figures, and what statements about them read."""

from __future__ import annotations

from functools import cached_property, lru_cache
from typing import Any

import numpy as np

from hpcwhirl.analysis.participation import family_amplitudes
from hpcwhirl.arrays import Floats
from hpcwhirl.case.resolve import resolve
from hpcwhirl.report.figures.motions import rotating
from hpcwhirl.report.figures.sweeps import frequency_spectra
from hpcwhirl.store.reading.results_file import Results

PAPER_SPEEDS = (270.0, 410.0, 420.0, 520.0)  # rad/s, Figs. 9 to 14
BANDS = {"1F": (30, 60), "suspension": (85, 125), "2F": (220, 270)}  # Hz
EARLY = 0.02  # s: before contact makes neighbours part
Row = dict[str, Any]


def strongest(
    where: Floats, amplitude: Floats, low: float, high: float
) -> tuple[float, float]:
    """Return (frequency, amplitude) of the strongest line in [low, high].

    Return (nan, 0) if no line lies there.

    Parameters
    ----------
    where, amplitude : (n,), frequencies and amplitudes of a spectrum
    low, high : limits, in the unit of `where`
    """
    inside = np.flatnonzero((where >= low) & (where <= high))
    if not len(inside):
        return float("nan"), 0.0
    top = inside[np.argmax(amplitude[inside])]
    return float(where[top]), float(amplitude[top])


class Found:
    """The campaigns by name, and what several statements read from them."""

    def __init__(self, cases: dict[str, Results]) -> None:
        self.cases = cases
        self.amplitudes = lru_cache(maxsize=8)(self._amplitudes)

    def line(self, name: str, **inputs: Any) -> list[int]:
        """Return the finished cases of a campaign with such inputs, by speed."""
        cases = self.cases[name]
        same = [
            i
            for i, row in enumerate(cases.rows)
            if row["status"] == "ok"
            and all(cases.value(i, n) == v for n, v in inputs.items())
        ]
        return sorted(same, key=lambda i: float(cases.rows[i]["speed"]))

    def rows(self, name: str, **inputs: Any) -> list[Row]:
        """Return the rows of `line`."""
        return [self.cases[name].rows[i] for i in self.line(name, **inputs)]

    def at(self, speed: float) -> Row:
        """Return the row of a speed of the paper's figures."""
        return self.rows("motions", speed=speed)[0]

    def _amplitudes(self, speed: float) -> tuple[Any, dict[str, Any]]:
        """Return (time (n,), {family: |q_k| (n, 12)}) of a speed."""
        cases, (case,) = self.cases["motions"], self.line("motions", speed=speed)
        traces, row = cases.traces(case), cases.rows[case]
        centre = rotating(traces, row["speed"])
        model = resolve(cases.scene(case)).model
        q = family_amplitudes(traces["tips"], centre, row["sample_interval"], model)
        return traces["time"], q

    def rms(self, speed: float, family: str, start: float, end: float) -> Any:
        """Return rms of |q_k| between two times (s, or shares of a run < 0), (12,)."""
        time, q = self.amplitudes(speed)
        start, end = (-t * time[-1] if t < 0 else t for t in (start, end))
        part = (time > start) & (time <= end)
        return (
            np.sqrt(np.mean(q[family][part] ** 2, axis=0))
            if part.any()
            else q[family][0]
        )

    def casing(self, speed: float) -> float:
        """Return the largest late displacement of the casing, its elastic part, m.

        Bound by the sum over the harmonics from 2 on, over the last 40 % of a run.
        """
        cases, (case,) = self.cases["motions"], self.line("motions", speed=speed)
        traces = cases.traces(case)
        late = traces["time"] > 0.6 * traces["time"][-1]
        waves = np.hypot(*np.moveaxis(traces["casing"][late, 2:], -1, 0))
        return float(waves.sum(axis=1).max())

    def convergence(self, name: str, speed: float) -> list[Row]:
        """Return rows from coarse to finest with `value`, `early` and `late`.

        early : rms difference of the static orbit from the finest over the first 20 ms,
        relative; late : relative difference of the orbit's radius in the window
        """
        cases, key = self.cases[name], {"steps": "time_step", "modes": "modes"}[name]
        line = self.line(name, speed=speed)
        line.sort(key=lambda i: cases.rows[i][key], reverse=name == "steps")
        finest = cases.traces(line[-1])
        first = finest["time"] <= EARLY
        scale = np.sqrt(np.mean(finest["centre"][first] ** 2))
        out = []
        for i in line:
            row, own = cases.rows[i], cases.traces(i)["centre"][: first.sum()]
            early = np.sqrt(np.mean((own - finest["centre"][first]) ** 2)) / scale
            last = cases.rows[line[-1]]["orbit_radius"]
            late = abs(row["orbit_radius"] / last - 1) if last else 0.0
            out.append(row | {"value": row[key], "early": early, "late": late})
        return out

    @cached_property
    def two_lobes(self) -> str:
        """The campaign that tells of k = 2: Table 1, or its gap made narrower."""
        return "lobes" if "lobes" in self.cases else "table1"

    @cached_property
    def spectra(self) -> dict[int, dict[str, Any]]:
        """Spectra of tip and centre of Table 1, by lobes."""
        names = {1: "table1", 2: self.two_lobes}
        return {
            k: frequency_spectra(self.cases[n], self.line(n, nodal_diameter=k))
            for k, n in names.items()
        }

    def level(self, k: int, place: str, low: float, high: float) -> Any:
        """Return the strongest amplitude of a band (Hz) at each speed of Table 1, m."""
        return np.array([strongest(*s, low, high)[1] for s in self.spectra[k][place]])

    def peak(self, k: int, place: str, low: float, high: float) -> float:
        """Return the median place of the strongest line of a band, Hz."""
        found = [strongest(*s, low, high)[0] for s in self.spectra[k][place]]
        return float(np.nanmedian(found))
