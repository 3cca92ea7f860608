"""Content of a map before it is drawn: axes, panels and a word for each case."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.errors import InputError, cases_told
from hpcwhirl.report.canvas import NAMED, name_of
from hpcwhirl.report.map.axes import Axis, Levels, axis_of, no_axis, scale_of
from hpcwhirl.report.map.colours import Colours, by_majority, colours_of
from hpcwhirl.scene.units import shown_in, with_unit
from hpcwhirl.store.directory.refined import PLACE
from hpcwhirl.store.reading import select
from hpcwhirl.store.reading.coded import Coded, combined
from hpcwhirl.store.reading.reader import coded
from hpcwhirl.store.reading.shares import MAJORITY, words_of
from hpcwhirl.store.results.cells import Refined

if TYPE_CHECKING:
    import xarray

AUTOMATIC = 12  # largest number of panels if the user has not named their inputs
MOST_PANELS = 60
FEW = 12  # largest number of values of an input that has a panel for each value
Inputs = dict[str, Levels]
Cells = NDArray[np.intp]


@dataclass(frozen=True)
class Wish:
    """The user's options of a map; those that are not given are chosen automatically.

    Attributes
    ----------
    x, y, panels : names of swept inputs on the axes, and of those that differ between
        panels
    at : texts ``NAME=V`` that select cases
    colour : "regime", "whirl", "attractor", "motion", or an expression of numbers
    rpm : whether speeds are in revolutions per minute, as with "rpm" in `units`
    critical : whether the critical speeds of Eq. 13 are marked
    units : of axes, panels, title and numbers: names of units, "practical" (mm, kN) or
        "si", see `scene.units.showing`
    """

    x: str | None = None
    y: str | None = None
    panels: tuple[str, ...] = ()
    at: tuple[str, ...] = ()
    colour: str = "regime"
    rpm: bool = False
    critical: bool = False
    units: tuple[str, ...] = ("practical",)

    @property
    def shown(self) -> tuple[str, ...]:
        """Names of the units to show, with "rpm" first if speeds are in rpm.

        Of several units of one quantity the first one counts.
        """
        return (*(("rpm",) if self.rpm else ()), *self.units)


@dataclass(frozen=True)
class Picture:
    """The content of a map of n cases before it is drawn.

    Attributes
    ----------
    case : (n,), numbers of the cases shown
    inputs : {swept variable: its values in the n cases}
    x, y : axes, with the positions of the cases
    panel : (n,), number of the panel in which each case is drawn
    panels : {variable: value} that the cases of each panel share
    word, whirl : (n,), regime, or why there is none, and whirl of each case
    majority : (n,), most frequent word of each case and its twins; None without twins
    colours : meaning of the colours
    along : notes for the title on inputs that vary and are neither axis nor panel
    scattered : whether the cases form no grid
    free : whether an input varies that is neither axis nor panel
    refined : cells and boundaries of a refined campaign; None: each case has a cell of
        its own
    """

    case: NDArray[np.int64]
    inputs: Inputs
    x: Axis
    y: Axis
    panel: Cells
    panels: list[dict[str, Any]]
    word: Coded
    whirl: Coded
    colours: Colours
    along: list[str] = field(default_factory=list)
    scattered: bool = False
    free: bool = False
    refined: Refined | None = None
    majority: Coded | None = None

    @property
    def gridded(self) -> bool:
        """Whether each case has one rectangular cell: neither refined nor scattered."""
        return not self.scattered and self.refined is None

    def __len__(self) -> int:
        """Return the number of cases shown."""
        return len(self.case)

    def counts(self) -> dict[str, int]:
        """Return {word, such as "damped": number of cases shown that have it}."""
        return self.word.counts()


def picture_of(data: xarray.Dataset, wish: Wish) -> Picture:
    """Return the content of a campaign's map: axes, panels, and a word for each case.

    data, wish : results; options of the map

    Raises
    ------
    InputError
        if an axis was not swept, or some cases would cover others
    """
    shown = _shown_cases(data, wish)
    at = select.where(wish.at, {n: data[n].to_numpy() for n in select.swept_of(data)})
    case = np.flatnonzero(shown if at is None else shown & at)
    own = {n: Levels.of(data[n].to_numpy()[case]) for n in select.swept_of(data)}
    x, y = _axes(own, wish)
    panels, along = _panels(own, x, y, wish)
    panel, values = _numbered(own, panels, len(case))
    kinds = (coded(data[n])[case] for n in ("status", "outcome", "regime"))
    word, whirl = combined(words_of, *kinds), coded(data["whirl"])[case]
    across, up = _axis(data, x, own, case), _axis(data, y, own, case)
    scattered = _scattered(across, up, panel)
    return Picture(
        case, own, across, up, panel, values, word, whirl,
        colours_of(data, wish.colour, case, word, whirl),
        along, scattered, any(" from case to case" in note for note in along),
        majority=by_majority(data, case, word) if MAJORITY in data else None,
    )  # fmt: skip


def with_cells(
    picture: Picture, data: xarray.Dataset, refined: Refined | None
) -> Picture:
    """Return a map's content with the cells of a refined campaign added.

    It is returned unchanged if no axis is a refined input.

    refined : cells and boundaries; None if the campaign was not refined
    """
    if refined is None or not {picture.x.name, picture.y.name} & {*refined.over}:
        return picture
    x, y = (_scaled(axis, data, refined) for axis in (picture.x, picture.y))
    return replace(picture, x=x, y=y, refined=refined, scattered=False)


def _scaled(axis: Axis, data: xarray.Dataset, refined: Refined) -> Axis:
    """Return an axis of a refined map with another scale, linear or log.

    It is the scale in [refine] or, if none is set there, the one that suits the values
    of the coarse grid.
    """
    if axis.name not in refined.over:
        return axis
    coarse = np.unique(data[axis.name].to_numpy()[data["level"].to_numpy() == 0])
    log = refined.scale[refined.over.index(axis.name)] == "log"
    return replace(axis, scale="log" if log else scale_of(coarse))


def _shown_cases(data: xarray.Dataset, wish: Wish) -> NDArray[np.bool_]:
    """Return which cases a map shows, (cases,); all of them unless it was refined.

    A refined campaign's map shows the case of the highest fidelity at each point. If
    three inputs are refined, the input that is no axis has a panel for each coarse
    value, unless the option `at` selects others.
    """
    found = select.counting(data)
    over = [str(n).removeprefix(PLACE) for n in data if str(n).startswith(PLACE)]
    if len(over) <= 2:
        return found
    coarse = data["level"].to_numpy() == 0
    own = {n: Levels.of(data[n].to_numpy()[coarse]) for n in select.swept_of(data)}
    axes = _axes(own, wish)
    asked = {
        select.variable_of(text.partition("=")[0].strip(), own) for text in wish.at
    }
    for name in set(over) - {*axes} - asked:
        found &= data[PLACE + name].to_numpy() % 1.0 == 0.0
    return found


def varied(inputs: Inputs) -> list[str]:
    """Return the names of the swept inputs that have more than one value.

    inputs : {input: its `Levels`}
    """
    return [name for name, values in inputs.items() if len(values) > 1]


def _axes(inputs: Inputs, wish: Wish) -> tuple[str, str]:
    """Choose the inputs on the x and the y axis of a map; return them, "" for none.

    Those that the user has not named are chosen by their number of values.

    inputs, wish : {input: its `Levels`}; options of the map
    """
    asked = [select.variable_of(n, inputs) if n else "" for n in (wish.x, wish.y)]
    taken = {select.variable_of(n, inputs) for n in wish.panels}
    both = [n for n in asked if n in taken] + ([asked[0]] if asked[0] else [])
    if len(both) > 1 or (asked[0] and asked[0] == asked[1]):
        raise InputError(f"{both[0]} must be named by only one of --x, --y and --panel")
    open_to = [n for n in varied(inputs) if n not in {*asked, *taken}]
    order = _by_levels(inputs, open_to)
    x = asked[0] or ("speed" if "speed" in open_to else (order or [""])[0])
    if asked[1]:
        return x, asked[1]
    rest = [n for n in order if n != x and not (x and _follows(inputs, n, x))]
    return x, (rest or [""])[0]


def _by_levels(inputs: Inputs, names: Sequence[str]) -> list[str]:
    """Return names of inputs in the order in which they get axes of a map.

    Numbers come before texts, then inputs with more values.

    inputs, names : {input: its `Levels`}; the inputs to sort
    """
    return sorted(names, key=lambda n: (not inputs[n].numeric, -len(inputs[n])))


def _follows(inputs: Inputs, name: str, by: str) -> bool:
    """Return whether one input is a function of another, as those swept in [zip].

    If no value of the other one, `by`, occurs twice, every input is a function of it;
    then the input must rise or fall monotonically with `by`.

    inputs : {input: its `Levels`}
    name, by : the input; the other one
    """
    own, other = inputs[name], inputs[by]
    value = np.zeros(len(other), np.int32)
    value[other.index] = own.index
    if (value[other.index] != own.index).any():
        return False
    if len(other) < len(other.index):
        return True
    steps = np.diff(value)
    monotone = bool((steps > 0).all() or (steps < 0).all())
    return own.numeric and other.numeric and monotone


def _panels(inputs: Inputs, x: str, y: str, wish: Wish) -> tuple[list[str], list[str]]:
    """Return the inputs that differ between panels, and notes on those not shown.

    The notes are for the title: they name inputs that vary and have neither axis nor
    panels.

    inputs, wish : {input: its `Levels`}; options of the map
    x, y : inputs on the axes
    """
    panels = [select.variable_of(n, inputs) for n in wish.panels]
    along, left = [], []
    for name in varied(inputs):
        if name in {x, y, *panels}:
            continue
        by = next((n for n in (x, y) if n and _follows(inputs, name, n)), None)
        if by:
            along.append(f"{name} varies with {by}: {span(name, inputs[name])}")
        else:
            left.append(name)
    for name in left:
        few = len(inputs[name]) <= FEW
        if few or _hidden(inputs, [x, y, *panels]):
            panels.append(name)
        else:
            along.append(
                f"{name} differs from case to case: {span(name, inputs[name])}"
            )
    if len(panels) == 2 and not wish.panels:  # rows are the input with fewer values
        panels.sort(key=lambda name: len(inputs[name]))
    _check_panels(inputs, panels, [x, y], asked=bool(wish.panels))
    return panels, along


def span(name: str, values: Levels) -> str:
    """Return the range of an input as text: "1 to 5 mm", or for texts "3 values".

    name, values : the input, whose unit is shown as the user chose; its values
    """
    if not values.numeric:
        return f"{len(values)} values"
    unit, factor = shown_in(NAMED[name].unit if name in NAMED else "")
    ends = (f"{factor * values.known[i]:.4g}" for i in (0, -1))
    return with_unit(" to ".join(ends), unit, " ")


def _together(inputs: Inputs, names: Sequence[str], count: int) -> tuple[Cells, Cells]:
    """Return numbers for the combinations of values that some inputs have in the cases.

    Returns (combinations,), index of a case with each combination; and (cases,), number
    of each case's combination. They are in the order of the first input's levels, then
    of the next one's

    inputs : {input: its `Levels`}
    names, count : the inputs to combine; number of cases
    """
    first, number = np.zeros(1, np.intp), np.zeros(count, np.intp)
    for one in (inputs[name] for name in names):
        number = number * len(one) + one.index
        _, first, number = np.unique(number, return_index=True, return_inverse=True)
    return first, number


def _hidden(inputs: Inputs, names: Sequence[str]) -> int:
    """Return how many cases others would cover, if drawn by some inputs only.

    They equal an earlier case in all of these inputs.

    inputs, names : {input: its `Levels`}; the inputs of axes and panels
    """
    count = max((len(one.index) for one in inputs.values()), default=1)
    return count - len(_together(inputs, [n for n in names if n], count)[0])


def _check_panels(
    inputs: Inputs, panels: list[str], axes: list[str], *, asked: bool
) -> None:
    """Raise InputError for too many panels, or for cases that others would cover.

    panels, axes : inputs that differ between panels; inputs on the axes
    asked : whether the user named the inputs of the panels
    """
    cases = max((len(one.index) for one in inputs.values()), default=1)
    count = len(_together(inputs, panels, cases)[0])
    most = MOST_PANELS if asked else AUTOMATIC
    if count > most:
        wanted = " or ".join(f"--at {n}={_some(inputs[n])}" for n in panels)
        msg = f"{count} panels of {' and '.join(panels)} are too many, at most {most}: "
        raise InputError(msg + f"add {wanted}")
    hidden = _hidden(inputs, [*axes, *panels])
    if hidden:
        shown = " and ".join(filter(None, axes)) or "inputs"
        have = "has" if hidden == 1 else "have"
        msg = f"{cases_told(hidden)} {have} the same {shown} as other cases "
        raise InputError(msg + "and would be hidden: choose other axes or --at")


def _some(values: Levels) -> str:
    some = [select.value_text(v) for v in values.known[: select.MOST_SHOWN].tolist()]
    return "|".join(some) + ("|…" if len(values) > len(some) else "")


def _numbered(
    inputs: Inputs, panels: list[str], count: int
) -> tuple[Cells, list[dict[str, Any]]]:
    """Return the number of each case's panel, and {variable: value} of each panel.

    panels, count : inputs that differ between panels; number of cases
    """
    first, number = _together(inputs, panels, count)
    known = [inputs[name].values[first].tolist() for name in panels]
    if not panels:
        return number, [{}]
    return number, [
        dict(zip(panels, key, strict=True)) for key in zip(*known, strict=True)
    ]


def _axis(data: xarray.Dataset, name: str, inputs: Inputs, case: Cells) -> Axis:
    if not name:
        return no_axis(len(case))
    label, factor = label_of(data, name)
    return axis_of(name, inputs[name], label, factor)


def label_of(data: xarray.Dataset, name: str) -> tuple[str, float]:
    """Return a variable's label, such as "speed Ω, rad/s", and the factor from SI.

    Both are for the unit that the user chose.
    """
    unit, factor = shown_in(str(data[name].attrs.get("units", "")))
    return with_unit(name_of(name), unit), factor


def _scattered(x: Axis, y: Axis, panel: Cells) -> bool:
    """Return whether cases are scattered: more than a third of the cells have none.

    The cells are those of a grid of all positions on both axes.

    x, y, panel : axes of the map; (n,), number of each case's panel
    """
    cells = sum(
        len(np.unique(x.index[panel == p])) * len(np.unique(y.index[panel == p]))
        for p in np.unique(panel)
    )
    return len(panel) > 5 and 2 * cells > 3 * len(panel)
