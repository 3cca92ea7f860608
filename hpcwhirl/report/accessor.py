"""The xarray accessor `hpcwhirl`: selection of cases, and figures, in Python.

Importing this module gives xarray's datasets, such as results from `open_results`, an
attribute `hpcwhirl`; its method `orbit`, for example, draws the orbit of a case.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray
from xarray.core.utils import UncachedAccessor
from xarray.plot.accessor import DataArrayPlotAccessor

from hpcwhirl.analysis.whirl import full_spectrum, sense_of
from hpcwhirl.errors import InputError
from hpcwhirl.report import palette
from hpcwhirl.report.canvas import axis_of, new_figure, title_of
from hpcwhirl.scene.words import MOTIONS, SHOWN, WHIRLS
from hpcwhirl.store.reading.results_file import Results, in_their_units

if TYPE_CHECKING:
    from hpcwhirl.campaign.simulate import Result

NEEDED = "centre"
LOOKS: dict[str, dict[str, Any]] = {
    "regime": {**SHOWN},
    "whirl": {**WHIRLS},
    "motion": {**MOTIONS},
}
UNKEPT = 'no orbits were kept: traces = "orbit" or "full" in [output] keeps them'


def plot_result(result: Result, *, transient: bool = False) -> Any:
    """Draw the centre's orbit from a result of `hpcwhirl.simulate`; return its axes.

    transient : also draw the time before the window
    """
    from hpcwhirl.report.figures.motions import orbits_of

    if NEEDED not in result.traces:
        raise InputError(UNKEPT)
    figure = orbits_of(result.traces, result.row, transient=transient)
    return np.array(figure.axes, dtype=object)


def _asked(wish: dict[str, Any]) -> Any:
    from hpcwhirl.report.map.data import Wish

    try:
        return Wish(**wish)
    except TypeError as failed:
        known = ", ".join(Wish.__dataclass_fields__)
        raise InputError(f"options of map are {known}: {failed}") from None


class WordsPlot(DataArrayPlotAccessor):
    """Replacement of the method `plot` of xarray, which also draws words of cases.

    xarray cannot draw words, such as "damped"; everything else is drawn by xarray.
    """

    __slots__ = ()

    def __call__(self, **wish: Any) -> Any:  # type: ignore[override]
        """Draw an array of words over its one or two dimensions, in the map's colours.

        Parameters
        ----------
        wish : options of xarray's `plot`, such as x, y, ax

        Raises
        ------
        InputError
            if the array of words has three dimensions or more, none, or only `case`
        """
        words, looks = self._da, LOOKS.get(str(self._da.name), {})
        if words.dtype.kind not in set("OUT") or not looks:
            return super().__call__(**wish)
        if words.ndim not in (1, 2) or words.dims == ("case",):
            raise InputError(
                f"{words.name} is drawn over one or two swept inputs, got "
                f"{', '.join(map(str, words.dims)) or 'none'}: choose values, as "
                "hpcwhirl.grid(data).regime.sel(gap=1e-4), or draw data.hpcwhirl.map()"
            )
        shown = [word for word in looks if (words == word).any()]
        codes = xarray.full_like(words, np.nan, dtype=float)
        for code, word in enumerate(shown):
            codes = codes.where(words != word, code)
        colours = [looks[word].colour for word in shown]
        if words.ndim == 1:
            (line,) = codes.plot.line("o", **wish)
            line.axes.set_yticks(range(len(shown)), shown)
            return line
        bar = {"ticks": range(len(shown))}
        mesh = codes.plot.pcolormesh(
            levels=np.arange(len(shown) + 1) - 0.5, colors=colours, cbar_kwargs=bar,
            **wish,
        )  # fmt: skip
        mesh.colorbar.set_ticklabels(shown)
        return mesh


xarray.DataArray.plot = UncachedAccessor(WordsPlot)


@xarray.register_dataset_accessor("hpcwhirl")  # type: ignore[no-untyped-call]
class Whirl:
    """The accessor `hpcwhirl` of results: it selects cases and draws pictures of them.

    A picture is returned as Matplotlib's axes, whose attribute `figure` is the figure.

    Parameters
    ----------
    data : results from `open_results`, or some of their cases by `isel`
    """

    def __init__(self, data: xarray.Dataset) -> None:
        self._data = data

    def map(self, **wish: Any) -> Any:
        """Draw the campaign's map; return its axes, an array for several panels.

        Parameters
        ----------
        wish : options as of `hpcwhirl map`: x, y: swept inputs; panels, at: tuples,
            such as ("gap=1e-4",); colour: "regime", "whirl", "attractor", "motion" or
            an expression of results; units: tuple; rpm, critical: bool
        """
        from hpcwhirl.report.map.maps import drawing_of

        with in_their_units(self._file):
            axes = drawing_of(self._file, _asked(wish)).figure.axes
        return axes[0] if len(axes) == 1 else np.array(axes, dtype=object)

    def hover(self, **wish: Any) -> Any:
        """Return the map as a plotly figure; pointing at a case shows its results.

        Parameters
        ----------
        wish : options of the method `map`, except critical

        Raises
        ------
        InputError
            if plotly is not installed, or the map shows shares of regimes
        """
        from hpcwhirl.report.map.hover import hover_map

        with in_their_units(self._file):
            return hover_map(self._file, _asked(wish))

    def where(self, condition: str) -> xarray.Dataset:
        """Return the cases that satisfy a condition, as `hpcwhirl cases --where`.

        A condition with a word that its variable cannot have is refused.

        Parameters
        ----------
        condition : for example ``"regime == sustained and speed > 400"``
        """
        from hpcwhirl.analysis.columns import matching, source_of

        found = matching(condition, source_of(self._data), "where")
        return self._data.isel(case=np.flatnonzero(found))

    def orbit(self, case: int, *, transient: bool = False) -> Any:
        """Draw the centre's orbit in the static and rotating frame; return the axes.

        The rotating frame is left out if the speed or the gap changes in time.

        Parameters
        ----------
        case : number of a case in the campaign
        transient : also draw the time before the window
        """
        from hpcwhirl.report.figures.motions import draw_orbits

        cases, number = self._case(case)
        figure = draw_orbits(cases, number, transient=transient)
        return np.array(figure.axes, dtype=object)

    def spectrum(self, case: int) -> Any:
        """Draw the full spectrum of the centre's motion in the window; return the axes.

        In the static frame, backward whirl lies below zero.

        Parameters
        ----------
        case : number of a case in the campaign
        """
        from hpcwhirl.report.figures.motions import in_window

        cases, number = self._case(case)
        traces, row = cases.traces(number), cases.rows[number]
        late = in_window(traces["time"], row)
        orbit = (traces["centre"] @ np.array([1.0, 1j]))[late]
        omega, amplitude = full_spectrum(orbit, row["sample_interval"])
        _, axes = new_figure((8, 4))
        axes.semilogy(sense_of(row["speed"]) * omega, 1e3 * amplitude)
        axes.axvline(
            abs(row["speed"]), color=palette.INK, ls="--", lw=0.8, label="ω = Ω"
        )
        axes.set(
            xlabel="ω, rad/s, static frame: backward < 0 < forward",
            ylabel=f"{axis_of('centre').partition(',')[0]}: radius of the circle, mm",
            title=title_of(row),
        )
        axes.legend()
        return axes

    @property
    def _file(self) -> Path:
        """Path of the results file that the data were read from."""
        for variable in self._data.variables.values():
            source = variable.encoding.get("source")
            if source:
                return Path(source)
        msg = "these results have no file: use the result of hpcwhirl.open_results"
        raise InputError(msg)

    def _case(self, case: int) -> tuple[Results, int]:
        """Return the campaign's results, and the number of a case checked to be in it.

        InputError if the case is not among the data or has no stored orbit.
        """
        cases = Results(self._file.parent)
        finished = cases.finished()
        if case not in finished:
            msg = f"case must be a finished case, 0 to {len(cases) - 1}, got {case}"
            raise InputError(msg)
        if NEEDED not in cases.kept:
            raise InputError(UNKEPT)
        return cases, int(case)
