"""Meaning of the colours of a map: a word of each case, such as a regime, or a number.

A look is how a word is drawn: colour, marker, letter, see `scene.words.Look`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.analysis.columns import numbers, source_of, unknown_variable
from hpcwhirl.analysis.expression import parse
from hpcwhirl.arrays import Floats
from hpcwhirl.errors import InputError
from hpcwhirl.report import palette
from hpcwhirl.scene.units import shown_in, with_unit
from hpcwhirl.scene.words import BAD, COUNTED, MOTIONS, SHOWN, WHIRLS, Look
from hpcwhirl.store.reading.coded import Coded, combined
from hpcwhirl.store.reading.reader import coded
from hpcwhirl.store.reading.select import numbers_in, variable_of
from hpcwhirl.store.reading.shares import MAJORITY
from hpcwhirl.studies.basins import in_order, with_attractors

if TYPE_CHECKING:
    import xarray

DECADES = 100.0  # ratio of largest to least number from which a scale is logarithmic
KEPT = 1e-4  # least |number| on a signed logarithmic scale, relative to the largest
INK = palette.INK
HATCHED = palette.GREY
HATCHES = {"missing": "////", "failed": "xxx", "unstable": "+++", "overloaded": "..."}
UNSURE = (
    "\\\\\\\\",
    palette.DARK,
)  # hatch of cases whose word too few of their twins have
GROWING = (
    "//",
    palette.GROWING,
)  # hatch of cases whose free motion grows without contact
TINT = palette.TINT  # colour laid over cases with the hatch `UNSURE`


@dataclass(frozen=True)
class Colours:
    """Meaning of the colours of a map of n cases.

    Attributes
    ----------
    name, label : quantity shown, as the user named it; its name with unit
    kind : (n,), word that gives a case its colour; "" if a number gives it
    number : (n,), number that gives a case its colour; None if words do
    looks : {word: `Look`}, of all possible words
    """

    name: str
    label: str
    kind: Coded
    number: Floats | None
    looks: dict[str, Look]

    def words(self, kind: Coded) -> list[str]:
        """Return the words that occur among some cases, in the order of a legend.

        kind : word of each of these cases
        """
        found = kind.counts()
        return [word for word in self.looks if word in found]

    def fill(self, word: str) -> str:
        """Return the colour that fills cells with a word; white on a map of numbers."""
        return self.looks[word].colour if self.number is None else palette.GROUND

    def hatch(self, word: str) -> tuple[str, str] | None:
        """Return pattern and colour of the hatch of cells with a word; None: no hatch.

        On a map of words only `missing` is hatched: other words have a colour.
        """
        if word not in HATCHES or (self.number is None and word != "missing"):
            return None
        return HATCHES[word], HATCHED

    def norm(self) -> Any:
        """Return Matplotlib's norm from numbers to the colour map.

        It is logarithmic if they span decades, and symmetric if they have both signs.
        """
        from matplotlib.colors import LogNorm, Normalize, SymLogNorm

        known = self._known()
        if self.name.startswith("share"):
            return Normalize(0.0, 1.0)
        least, most = float(known.min(initial=np.inf)), float(known.max(initial=0.0))
        if least < 0.0 < most:
            size = max(-least, most)
            small = np.percentile(abs(known[known != 0]), 10)
            if small * DECADES < size:
                return SymLogNorm(max(small, KEPT * size), vmin=-size, vmax=size)
            return Normalize(-size, size)
        if least < 0.0 or not most:
            return Normalize(min(least, 0.0), most or 1.0)
        positive = float(known[known > 0].min())
        if most >= DECADES * positive:
            return LogNorm(positive, most, clip=True)
        return Normalize(least, most)

    def map(self) -> str:
        """Return the name of a colour map; diverging for numbers of both signs."""
        known = self._known()
        signed = known.min(initial=0) < 0 < known.max(initial=0)
        return palette.DIVERGING if signed else palette.SEQUENTIAL

    def _known(self) -> Floats:
        number = self.number
        if number is None:
            return np.zeros(0)
        return np.asarray(number[self.kind.isin([""]) & np.isfinite(number)])


def colours_of(
    data: xarray.Dataset,
    name: str,
    case: NDArray[np.intp],
    word: Coded,
    whirl: Coded,
) -> Colours:
    """Return what the colours of a map mean, from the quantity that the user chose.

    Parameters
    ----------
    data : results
    name : the quantity: "regime" (with twins, the majority's word), "whirl",
        "attractor" (see `studies.attractors`), "motion" if the results have it, or an
        expression over numbers of the results
    case : (n,), numbers of the cases shown
    word, whirl : (n,), regime, or why there is none, and whirl of these cases

    Raises
    ------
    InputError
        if there are cases with results, but none with a finite number
    """
    if name == "regime":
        return Colours(name, "", by_majority(data, case, word), None, SHOWN)
    if name == "whirl":
        return Colours(name, "", _unless_bad(word, whirl), None, WHIRLS | BAD)
    if name == "attractor":
        if name not in data:
            data = with_attractors(data)
        own = Coded.of(data[name].to_numpy()[case])
        good = np.array([*own[~word.isin(BAD)].counts()], dtype=str)
        kind, looks = _unless_bad(word, own), looks_of_attractors(in_order(good))
        return Colours(name, "", kind, None, looks | BAD)
    if name == "motion" and name in data:
        kind = _unless_bad(word, coded(data[name])[case])
        return Colours(name, "", kind, None, MOTIONS | BAD)
    number, label = _numbers(data, name)
    shown = number[case]
    finite, given = np.isfinite(shown), ~word.isin(BAD)
    if given.any() and not finite[given].any():
        msg = (
            f"--colour: '{name.strip()}' is a finite number in none of the cases shown"
        )
        raise InputError(msg)
    known = Coded(("failed", ""), finite.astype(np.int8))
    return Colours(name, label, _unless_bad(word, known), shown, BAD)


def _unless_bad(word: Coded, other: Coded) -> Coded:
    """Return another word of each case, such as its whirl, if the case has results.

    A case whose word is one of `BAD`, such as failed, keeps it.

    word, other : word of each case; the other one
    """

    def rule(own: NDArray[np.str_], other: NDArray[np.str_]) -> NDArray[np.str_]:
        return np.asarray(np.where(np.isin(own, list(BAD)), own, other))

    return combined(rule, word, other)


def looks_of_attractors(names: Sequence[str]) -> dict[str, Look]:
    """Return how attractors, and cases without one, are drawn, {name: its `Look`}.

    Attractors of one regime share its marker; their colours repeat after six.

    names : names of attractors, from `studies.attractors`, such as "A1 sustained"
    """
    looks = {}
    for name in names:
        number, _, regime = name.rpartition(" ")
        look = COUNTED[regime]
        if number:
            colour = palette.ATTRACTORS[regime][
                (int(number[1:]) - 1) % len(palette.ATTRACTORS[regime])
            ]
            look = replace(look, colour=colour, letter=number, told=name, line="")
        looks[name] = look
    return looks


def by_majority(data: xarray.Dataset, case: NDArray[np.intp], word: Coded) -> Coded:
    """Return the most frequent word among each of n cases and its twins, (n,).

    Parameters
    ----------
    data : results from `open_results`
    case, word : (n,), numbers of the cases; their own words, which are returned for
        cases without twins
    """
    if MAJORITY not in data:
        return word

    def rule(most: NDArray[np.str_], own: NDArray[np.str_]) -> NDArray[np.str_]:
        return np.asarray(np.where(most == "none", own, most))

    return combined(rule, coded(data[MAJORITY])[case], word)


def _numbers(data: xarray.Dataset, text: str) -> tuple[Floats, str]:
    """Return the number by which each case is coloured, and the colour bar's label.

    The numbers are in the unit that the label names.

    text : expression of results, such as "orbit_radius/gap"
    """
    source, known = source_of(data), numbers_in(data)

    def variable(name: str) -> str:
        if name in data:
            if data[name].dims == ("case",):
                return name
            raise InputError(f"'{name}' does not have one number for each case")
        try:
            return variable_of(name, known, "number")
        except InputError:
            named = ["regime", "whirl", "attractor", *known]
            every = ": use regime, whirl, attractor or a variable with numbers"
            raise unknown_variable(name, named, "", every) from None

    values = numbers(text, replace(source, variable=variable), "--colour")
    label, factor = _label(data, text, variable)
    return factor * values, label


def _label(
    data: xarray.Dataset, text: str, variable: Callable[[str], str]
) -> tuple[str, float]:
    """Return the label of a colour bar, with unit, and the factor from SI to the unit.

    text, variable : expression shown; function from a name in it to the variable's name
    """
    program = parse(text)
    if [step.does for step in program] not in (["name"], ["name", "name", "/"]):
        return text.strip(), 1.0
    parts = [variable(str(step.value)) for step in program if step.does == "name"]
    units = [str(data[part].attrs.get("units", "")) for part in parts]
    plain = [part.replace("_", " ") for part in parts]
    if len(parts) == 1:
        unit, factor = shown_in(units[0])
        return with_unit(plain[0], unit), factor
    unit = "" if units[0] == units[1] else f", {units[0]} / {units[1]}"
    return f"{plain[0]} / {plain[1]}{unit}", 1.0
