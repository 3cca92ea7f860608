"""Evaluation of a user's conditions and expressions over the variables of results.

An example is ``cases --where "regime == divergent and speed > 400"``. A condition is
checked before it is evaluated, see `analysis.condition`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.analysis.condition import Check, Kind, Source
from hpcwhirl.analysis.expression import (
    Program,
    is_text,
    names_in,
    parse,
    value_of,
)
from hpcwhirl.errors import SHOWN, InputError, cases_told, nearest, one_line
from hpcwhirl.scene.quantities import (
    BLADES,
    CHAOS,
    ESTIMATED,
    LOST,
    OVER_SPEED,
    REFINED,
    ROW,
    SLIPPED,
    WORN,
)
from hpcwhirl.scene.units import shown_in
from hpcwhirl.scene.words import ENUMS
from hpcwhirl.scene.words import SHOWN as WORDS
from hpcwhirl.store.reading.coded import combined
from hpcwhirl.store.reading.reader import coded
from hpcwhirl.store.reading.select import known_counts, variable_of
from hpcwhirl.store.reading.shares import SHARE, words_of

if TYPE_CHECKING:
    import xarray

WORD = "word"  # variable with a case's regime or, without one, why it has none
# {variable that only some campaigns have: what they need for it}
NEEDS = (
    dict.fromkeys(CHAOS, "output.chaos > 0")
    | dict.fromkeys(ESTIMATED, 'solver.estimate = "step" or "all"')
    | dict.fromkeys(BLADES, 'output.traces = "blades" or "full"')
    | dict.fromkeys(WORN, "a layer that wears (casing.contact_law)")
    | dict.fromkeys(OVER_SPEED, "a speed or gap that changes, or a blade lost later")
    | dict.fromkeys(LOST, "a lost blade (engine.rotor.lost_blade)")
    | dict.fromkeys(SLIPPED, 'slip = "set-valued"')
    | dict.fromkeys(REFINED, "the table [refine]")
    | dict.fromkeys(SHARE, "the table [twins]")
)
AT_ONCE = 100_000  # number of cases whose texts are read from the file at a time


def unknown_variable(
    name: str, known: Sequence[str], what: str, otherwise: str
) -> InputError:
    """Return the exception for a name that is no variable of results.

    Parameters
    ----------
    name, known : the name; names of the results' variables
    what, otherwise : kind of name, with a blank, or ""; end of the message where no
        variable has a similar name
    """
    if name in NEEDS:
        return InputError(f"'{name}' needs {NEEDS[name]}, which these results lack")
    place = {one: number for number, one in enumerate(ROW)}
    hint = nearest(name, sorted(known, key=lambda one: place.get(one, len(place))))
    return InputError(f"unknown {what}'{one_line(name, SHOWN)}'{hint or otherwise}")


def source_of(data: xarray.Dataset) -> Source:
    """Return access to all variables with a value per case, and to each case's word.

    data : results from `open_results`; the word has the name `word`
    """
    known = [str(n) for n, v in data.variables.items() if v.dims == ("case",)]

    def variable(name: str) -> str:
        if name == WORD or name in known:
            return name
        try:
            return variable_of(name, known, "variable")
        except InputError:
            every = "; `cases --columns '?'` lists all variables"
            raise unknown_variable(name, known, "variable ", every) from None

    def column(name: str) -> NDArray[Any]:
        if name == WORD:
            kinds = (coded(data[n]) for n in ("status", "outcome", "regime"))
            return np.asarray(combined(words_of, *kinds), dtype=object)
        if name in ENUMS and data[name].dtype.kind in "iu":
            return np.asarray(coded(data[name]), dtype=object)
        if data[name].dtype.kind == "O":
            return _texts(data[name])
        return known_counts(data[name].to_numpy())

    allowed: dict[str, Any] = {n: ENUMS[n] for n in ENUMS if n in known}
    words = allowed | {WORD: tuple(WORDS)}
    units = {n: str(data[n].attrs.get("units", "1")) for n in known}
    return Source(variable, column, words, data.sizes["case"], units)


def _texts(variable: xarray.DataArray) -> NDArray[np.object_]:
    """Return a variable of texts as an array, (cases,), read in parts to save memory.

    variable : variable of the results that has a text for each case
    """
    starts = range(0, max(len(variable), 1), AT_ONCE)
    parts = [variable[start : start + AT_ONCE].to_numpy() for start in starts]
    return np.concatenate(parts)


def matching(text: str, source: Source, option: str = "--where") -> NDArray[np.bool_]:
    """Return for each case whether a condition holds, (cases,).

    It does not where a number that decides it is missing, as without a result.

    text : the condition, such as "regime == divergent"
    source : variables of the results
    option : option with which the user wrote the condition, for messages

    Raises
    ------
    InputError
        if the text is no condition, or names an unknown variable
    """
    found = _evaluated(text, source, "truth", option)
    return np.broadcast_to(np.asarray(found) == 1, source.cases).copy()


def numbers(text: str, source: Source, option: str) -> NDArray[np.float64]:
    """Return the value of a numeric expression for each case, (cases,).

    text : the expression, such as "orbit_radius/gap"
    source : variables of the results
    option : option with which the user wrote the expression, for messages

    Raises
    ------
    InputError
        if the text gives no number, or names an unknown variable
    """
    values = _evaluated(text, source, "number", option)
    return np.broadcast_to(np.asarray(values, float), source.cases).copy()


def unit_remark(text: str, source: Source) -> str:
    """Return why a condition that no case fulfils may be one on numbers in SI.

    It is "" unless cases fulfil it with its plain numbers read in the units in which
    tables show them.

    text, source : as for `matching`
    """
    check = Check(parse(text), source)
    steps = list(check.named("truth"))
    told = {}
    for at, unit in check.plain.items():
        name, factor = shown_in(unit)
        if factor != 1.0 and steps[at].value:
            told[f"{steps[at].text} {name}"] = unit
            steps[at] = replace(steps[at], value=float(steps[at].value) / factor)
    found = np.broadcast_to(_value(tuple(steps), source) == 1, source.cases)
    if not told or not found.any():
        return ""
    units = " and ".join(dict.fromkeys(told.values()))
    return (
        f"plain numbers are in SI, here in {units}; with {' and '.join(told)} it "
        f"selects {cases_told(int(found.sum()))}"
    )


def _evaluated(text: str, source: Source, wanted: Kind, option: str) -> Any:
    try:
        program = Check(parse(text), source).named(wanted)
    except InputError as failed:
        raise InputError(f"{option}: {failed}") from None
    return _value(program, source)


def _value(program: Program, source: Source) -> Any:
    """Return the value of a checked program in each case, (cases,) or one for all."""
    columns = {name: _plain(source.column(name)) for name in names_in(program)}
    with np.errstate(all="ignore"):
        return value_of(program, columns)


def _plain(column: NDArray[Any]) -> NDArray[Any]:
    """Return a variable's values as they are if texts, else as floats.

    Integers could overflow in expressions; column : (cases,)
    """
    return column if is_text(column) else column.astype(float)
