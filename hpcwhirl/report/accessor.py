"""The xarray accessor `hpcwhirl` of results: conditions on cases, and figures."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray

from hpcwhirl.analysis.spectrum import full_spectrum
from hpcwhirl.errors import InputError
from hpcwhirl.report.labels import axis_of, title_of
from hpcwhirl.store.reading.results_file import Results

if TYPE_CHECKING:
    from hpcwhirl.campaign.simulate import Result

NEEDED = "centre"
UNKEPT = 'no orbits were kept: traces = "orbit" or "full" in [output] keeps them'


def plot_result(result: Result, *, transient: bool = False) -> Any:
    """Return two axes with the orbit of `simulate`'s result, see `Whirl.orbit`."""
    from hpcwhirl.report.figures.motions import orbits_of

    if NEEDED not in result.traces:
        raise InputError(UNKEPT)
    figure = orbits_of(result.traces, result.row, transient=transient)
    return np.array(figure.axes, dtype=object)


@xarray.register_dataset_accessor("hpcwhirl")  # type: ignore[no-untyped-call]
class Whirl:
    """Conditions on results that `hpcwhirl.open_results` gave, and pictures of them.

    A picture is returned as axes to go on with; it is their `figure`.

    Parameters
    ----------
    data : of `open_results`, or some of its cases by `isel`
    """

    def __init__(self, data: xarray.Dataset) -> None:
        self._data = data

    def map(self, **wish: Any) -> Any:
        """Return the axes of the campaign's map, an array where there are several.

        Parameters
        ----------
        wish : x, y: swept inputs; panels, at: tuples, as ("gap=1e-4",); colour:
            "regime", "whirl" or a number; rpm, critical: bool; as `hpcwhirl map`
        """
        from hpcwhirl.report.map.data import Wish
        from hpcwhirl.report.map.maps import drawing_of

        try:
            asked = Wish(**wish)
        except TypeError as failed:
            known = ", ".join(Wish.__dataclass_fields__)
            msg = f"map takes {known}: {failed}"
            raise InputError(msg) from None
        axes = drawing_of(self._file, asked).figure.axes
        return axes[0] if len(axes) == 1 else np.array(axes, dtype=object)

    def where(self, condition: str) -> xarray.Dataset:
        """Return the cases that a condition holds for, as `hpcwhirl cases --where`.

        A word that a variable cannot have is refused, where `==` would find no case.

        Parameters
        ----------
        condition : such as ``"regime == sustained and speed > 400"``
        """
        from hpcwhirl.analysis.columns import matching, source_of

        found = matching(condition, source_of(self._data), "where")
        return self._data.isel(case=np.flatnonzero(found))

    def orbit(self, case: int, *, transient: bool = False) -> Any:
        """Return two axes: the centre's orbit in the static and the rotating frame.

        Parameters
        ----------
        case : its number in the campaign
        transient : draw what is before the window of the words, too
        """
        from hpcwhirl.report.figures.motions import draw_orbits

        cases, number = self._case(case)
        figure = draw_orbits(cases, number, transient=transient)
        return np.array(figure.axes, dtype=object)

    def spectrum(self, case: int) -> Any:
        """Return the axes of the centre's full spectrum in the window, static frame.

        Backward whirl lies below zero.

        Parameters
        ----------
        case : its number in the campaign
        """
        from matplotlib.figure import Figure

        from hpcwhirl.report.figures.motions import in_window

        cases, number = self._case(case)
        traces, row = cases.traces(number), cases.rows[number]
        late = in_window(traces["time"], row)
        orbit = (traces["centre"] @ np.array([1.0, 1j]))[late]
        omega, amplitude = full_spectrum(orbit, row["sample_interval"])
        axes = Figure(figsize=(8, 4), layout="constrained").subplots()
        turned = -1.0 if row["speed"] < 0 else 1.0
        axes.semilogy(turned * omega, 1e3 * amplitude)
        axes.axvline(abs(row["speed"]), color="black", ls="--", lw=0.8, label="ω = Ω")
        axes.set(
            xlabel="ω, rad/s, static frame: backward < 0 < forward",
            ylabel=f"{axis_of('centre').partition(',')[0]}: radius of the circle, mm",
            title=title_of(row),
        )
        axes.legend()
        return axes

    @property
    def _file(self) -> Path:
        """The file that the results were read from."""
        for variable in self._data.variables.values():
            source = variable.encoding.get("source")
            if source:
                return Path(source)
        msg = "these results do not tell their file: ask those of hpcwhirl.open_results"
        raise InputError(msg)

    def _case(self, case: int) -> tuple[Results, int]:
        """Return the campaign, and a case of it that has an orbit."""
        cases = Results(self._file.parent)
        finished = cases.finished()
        if case not in finished:
            msg = f"case must be a finished one of {len(cases)}, got {case}"
            raise InputError(msg)
        if NEEDED not in cases.kept:
            raise InputError(UNKEPT)
        return cases, int(case)
