"""Select cases of results by values of their inputs, as the option --at does.

Inputs may be named as in the TOML or as in the results.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.errors import InputError, listed, unknown
from hpcwhirl.scene import input_names
from hpcwhirl.scene.quantities import INPUTS, variable_name
from hpcwhirl.scene.units import in_si, measure, told_of

if TYPE_CHECKING:
    import xarray

    from hpcwhirl.store.reading.results_file import Results

SWEPT = "swept input"  # what most names of variables stand for, in messages
FINAL = "final"  # variable of refined campaigns: 0 where a word is superseded
SAME = 1e-9  # relative difference up to which numbers count as equal
MOST_SHOWN = 8  # largest number of values in a message
UNITS = {variable_name(name): quantity.unit for name, quantity in INPUTS.items()}
Mask = NDArray[np.bool_]


def swept_of(data: xarray.Dataset | Results) -> list[str]:
    """Return the names of the swept inputs' variables in results, in file order."""
    return [n for n in str(data.attrs.get("swept", "")).split() if n in data]


def counting(data: xarray.Dataset | Results) -> Mask:
    """Return for each case whether its word counts, (cases,).

    Where a refined map was confirmed by a second preset, a point has two cases: the
    word of the first one is superseded as soon as the second one has a word. All other
    cases count, in any campaign.
    """
    if FINAL not in data:
        return np.ones(data.sizes["case"], dtype=bool)
    return np.asarray(np.asarray(data[FINAL]) == 1)


def counted(data: xarray.Dataset) -> xarray.Dataset:
    """Return results with only the cases whose words count, see `counting`."""
    mask = counting(data)
    return data if mask.all() else data.isel(case=np.flatnonzero(mask))


def follows(data: xarray.Dataset, name: str, by: str) -> bool:
    """Return whether the value of one input determines that of another in all cases.

    Parameters
    ----------
    data : results over `case`
    name : the input that may be determined
    by : the input that may determine it
    """
    known, values = (data[n].to_numpy().tolist() for n in (by, name))
    return len(set(zip(known, values, strict=True))) == len(set(known))


def variable_of(name: str, known: Iterable[str], what: str = SWEPT) -> str:
    """Return the results' variable of an input that a user names, in any allowed form.

    Parameters
    ----------
    name : a variable, a dotted name, or an ending of a dotted name, unique in `known`
    known : variables to choose from
    what : name for the variables in the message
    """
    among = list(known)
    if name in among:
        return name
    dotted = [n for n in input_names() if n == name or n.endswith(f".{name}")]
    found = sorted({variable_name(n) for n in dotted} & set(among))
    if len(found) > 1:
        raise InputError(f"{what} '{name}' may mean {', '.join(found)}: give one name")
    if not found and not among:
        raise InputError(f"unknown {what} '{name}': no input was swept")
    if dotted and not found and what == SWEPT:
        raise InputError(f"input '{name}' was not swept; swept: {listed(among)}")
    if not found:
        raise unknown(what, name, among)
    return found[0]


def numbers_in(data: xarray.Dataset) -> list[str]:
    """Return the names of the results' variables that have a number for each case."""
    return [
        str(n) for n, v in data.variables.items()
        if v.dims == ("case",) and v.dtype.kind in "iuf" and n != "case"
    ]  # fmt: skip


def known_counts(values: NDArray[Any]) -> NDArray[Any]:
    """Return whole numbers as floats with NaN for cases without a result, if any.

    The file stores -1 for these cases, see `store.hdf5.missing`.

    values : (cases,), other than whole numbers unchanged
    """
    if values.dtype.kind not in "iu" or not (values < 0).any():
        return values
    return np.where(values < 0, np.nan, values)


def value_text(value: Any) -> str:
    """Return a value as text for messages and tables, a float with up to ten digits."""
    if isinstance(value, float | np.floating):
        return f"{value:.10g}"
    return str(value)


def where(
    settings: Sequence[str], columns: Mapping[str, NDArray[Any]], option: str = "--at"
) -> Mask | None:
    """Return for each case whether it has the values that texts ``NAME=V[,V...]`` give.

    Several settings of one input admit any of their values.

    Parameters
    ----------
    settings : these texts, such as ``speed=410``
    columns : {variable: (cases,)} of the inputs that settings may name
    option : name of the option that has the settings, for messages

    Returns
    -------
    (cases,); None if there is no text
    """
    admitted: dict[str, Mask] = {}
    for text in settings:
        name, sign, raw = text.partition("=")
        if not sign or not raw.strip():
            raise InputError(f"{option} must be NAME=VALUE, got '{text}'")
        variable = variable_of(name.strip(), columns, f"input of {option}")
        what, unit = f"{option} {variable}", UNITS.get(variable, "1")
        found = _equal(columns[variable], raw.strip(), what, unit)
        admitted[variable] = admitted.get(variable, np.False_) | found
    if not admitted:
        return None
    both = np.logical_and.reduce(list(admitted.values()))
    if not both.any():
        msg = f"{option} {' '.join(settings)}: no case has this combination of values"
        raise InputError(msg)
    return np.asarray(both)


def chosen(
    data: xarray.Dataset, settings: Sequence[str], inputs: Iterable[str] | None = None
) -> xarray.Dataset:
    """Return those cases of results that have the values in texts ``NAME=V``.

    Parameters
    ----------
    data : results from `open_results`
    settings : texts such as ``speed=410``
    inputs : variables of the inputs that they may name; None: all swept ones
    """
    names = swept_of(data) if inputs is None else inputs
    mask = where(settings, {name: data[name].to_numpy() for name in names})
    return data if mask is None else data.isel(case=np.flatnonzero(mask))


def _equal(values: NDArray[Any], raw: str, what: str, unit: str) -> Mask:
    if values.dtype.kind in "OUS":
        raw = _numbered(values, raw)
        found = np.array([_same_text(str(value), raw) for value in values])
        if not found.any():
            raise unknown(f"value of {what}", raw, {str(v) for v in values})
        return found
    parts = [_number(part, what, unit) for part in raw.split(",")]
    each = [np.isclose(values, part, rtol=SAME, atol=0.0) for part in parts]
    for part, one in zip(parts, each, strict=True):
        if not one.any():
            raise InputError(
                f"{what} = {value_text(part)}: no case has this value, "
                f"{_nearest(values, part)}"
            )
    return np.asarray(np.logical_or.reduce(each))


def _numbered(values: NDArray[Any], raw: str) -> str:
    """Return the n-th distinct text of a variable if the user gives ``#n``.

    Other texts are returned unchanged.

    Parameters
    ----------
    values : (cases,), values of the variable
    raw : text of the user
    """
    order = list(dict.fromkeys(values.astype(str).tolist()))
    known = {f"#{i + 1}": text for i, text in enumerate(order)}
    return str(known.get(raw, raw))


def number_of(text: str, variable: str, option: str) -> float:
    """Return the finite number, in SI, that an option's text gives for an input.

    variable, option : the input; name of the option, for errors

    Raises
    ------
    InputError
        where the text is no finite number
    """
    what = f"{option} {variable}"
    found = _number(text.strip(), what, UNITS.get(variable, "1"))
    if not math.isfinite(found):
        raise InputError(f"{what} must be a finite number, got '{text.strip()}'")
    return found


def _number(text: str, what: str, unit: str) -> float:
    if measure(text):
        return float(told_of(what, lambda: in_si(text, unit)))
    try:
        return float(text)
    except ValueError:
        raise InputError(f"{what} must be a number, got '{text.strip()}'") from None


def _same_text(value: str, raw: str) -> bool:
    if value == raw or not value.startswith("["):
        return value == raw
    try:
        return bool(json.loads(value) == json.loads(raw))
    except ValueError:
        return False


def _nearest(values: NDArray[Any], wanted: float) -> str:
    """Return a hint for a message: an input's values, all if few, else the nearest two.

    Parameters
    ----------
    values : (cases,), values of the cases
    wanted : value that the user asks for
    """
    known = np.unique(values[np.isfinite(values)])
    if len(known) <= MOST_SHOWN:
        return "known: " + ", ".join(map(value_text, known))
    near = np.sort(known[np.argsort(abs(known - wanted))[:2]])
    return "nearest: " + ", ".join(map(value_text, near))
