"""What `hpcwhirl margin` prints with --first (limits) and --over each (a point)."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

import numpy as np

from hpcwhirl.cli.options import asked_units
from hpcwhirl.cli.tables import in_units, print_data, print_table, unit_of
from hpcwhirl.scene.quantity import with_unit
from hpcwhirl.scene.units import showing, shown_in
from hpcwhirl.store.reading.select import UNITS

if TYPE_CHECKING:
    import xarray

    from hpcwhirl.analysis.margins import Along, FirstChange

TOLD = 12  # largest number of lines of cases with a sentence for each
ENDS = ("low", "high", "below", "above")


def first_change(
    args: argparse.Namespace, data: xarray.Dataset, over: str, point: float | None
) -> int:
    """Print up to which value of an input cases are damped, for each line of cases.

    Parameters
    ----------
    args : options of `hpcwhirl margin`
    data : results of the selected cases
    over : name of the input
    point : value of that input to compare limits with; None: no comparison
    """
    from hpcwhirl.analysis.margins import first_changes

    found = first_changes(data, over, args.sure)
    columns = _first_columns(found, point)
    own = ("safe", "unsafe")
    units = {n: unit_of(data, over if n in own else n) for n in columns}
    shown, told = in_units(args, columns, units)
    if not print_data(args, shown, told, "first", over=over, at=point):
        print(f"damped from the least {over} up to safe; unsafe is the next one tried")
        print_table(shown, told, len(found))
        if point is not None:
            with showing(asked_units(args.units)):
                print("\n".join(_sentences(found, over, point)))
    if args.plot:
        from hpcwhirl.report.map.limits import draw_limits

        with showing(asked_units(args.units)):
            draw_limits(data, found, over, point, args.plot)
    return 0


def _first_columns(found: list[FirstChange], point: float | None) -> dict[str, Any]:
    """Return the table's columns, {name: (lines,)}; `point` adds multiples of it."""
    out: dict[str, Any] = {n: [f.fixed[n] for f in found] for n in found[0].fixed}
    out |= {n: [getattr(f, n) for f in found] for n in ("safe", "unsafe", "word")}
    out["changes"] = [f.changes for f in found]
    if point is not None:
        for name in ("safe", "unsafe"):
            out[f"times_{name}"] = [getattr(f, name) / point for f in found]
    return {name: np.array(values) for name, values in out.items()}


def _sentences(found: list[FirstChange], over: str, point: float) -> list[str]:
    """Return a sentence for each limit, or if many, one for the nearest limit."""
    told = setting_text(over, point)
    if len(found) <= TOLD:
        return [f"{_place(f)}safe {f.times(point)} times {told}{_then(f)}"
                for f in found]  # fmt: skip
    least = min(found, key=lambda f: np.nan_to_num(f.safe))
    open_ = sum(not f.word for f in found)
    text = (
        f"{told}: the lowest of {len(found)} limits is {least.times(point)} times it "
    )
    return [f"{text}({_place(least).rstrip(': ')}); no change was met on {open_}"]


def _place(found: FirstChange) -> str:
    at = ", ".join(setting_text(n, v) for n, v in found.fixed.items())
    return f"at {at}: " if at else ""


def _then(found: FirstChange) -> str:
    """Return the end of a sentence: which word follows above the limit."""
    if not found.word:
        return ", the strongest tried"
    more = found.changes - (not np.isnan(found.safe))
    return f", then {found.word}" + (
        f"; {more} more change{'s' * (more > 1)}" if more else ""
    )


def each_input(args: argparse.Namespace, data: xarray.Dataset) -> int:
    """Print the safe range along each input of ``--at``, around their point."""
    from hpcwhirl.analysis.margins import working_point

    found = working_point(data, _point(args.at), args.sure)
    numbers, texts = _each_columns(found), {}
    units = dict.fromkeys(numbers, "")
    if print_data(args, numbers, units, "inputs"):
        return 0
    with showing(asked_units(args.units)):
        texts = {n: np.array([_cell(n, a) for a in found]) for n in numbers}
    print("safe range around the point along each input, the others as they are or as "
          "near as computed")  # fmt: skip
    print_table(texts, units, len(found))
    return 0


def _point(settings: list[str]) -> dict[str, float]:
    """Return {input: value in SI} of the settings of --at."""
    from hpcwhirl.errors import InputError
    from hpcwhirl.scene import input_names
    from hpcwhirl.store.reading.select import number_of, variable_of

    out: dict[str, float] = {}
    for text in settings:
        name, sign, raw = text.partition("=")
        if not sign:
            msg = f"--at must be NAME=VALUE, got '{text}'"
            raise InputError(msg)
        known = {*UNITS, *input_names()}
        variable = variable_of(name.strip(), known, "input of --at")
        if variable in out:
            msg = f"--at {variable} is given twice"
            raise InputError(msg)
        out[variable] = number_of(raw, variable, "--at")
    return out


def _each_columns(found: list[Along]) -> dict[str, Any]:
    """Return the columns of the table of inputs, {name: (inputs,)}, in SI."""
    out: dict[str, Any] = {"input": [a.name for a in found]}
    out["unit"] = [UNITS.get(a.name, "1") for a in found]
    out["at"] = [a.value for a in found]
    out |= {n: [getattr(a.found, n) for a in found] for n in ENDS}
    for side in ("below", "above"):
        out[f"word_{side}"] = [getattr(a.found, f"word_{side}") for a in found]
    out["distance"] = [a.found.distance(a.value) for a in found]
    out["line"] = [_line(a) for a in found]
    return {name: np.array(values) for name, values in out.items()}


def _line(along: Along) -> str:
    """Return the values of the other inputs on the chosen line, as text."""
    return ", ".join(setting_text(n, v) for n, v in along.found.fixed.items())


def _cell(name: str, along: Along) -> str:
    """Return one cell of the table of inputs as text, numbers in the unit shown."""
    if name in {"at", "distance", *ENDS}:
        value = {"at": along.value, "distance": along.found.distance(along.value)}
        number = float(value.get(name, getattr(along.found, name, np.nan)))
        told = setting_text(along.name, number).partition(" = ")[2]
        return "" if np.isnan(number) else told
    return str(_each_columns([along])[name][0])


def setting_text(variable: str, value: Any) -> str:
    """Return ``variable = value unit`` of an input, in the unit shown."""
    if not isinstance(value, float):
        return f"{variable} = {value}"
    unit, factor = shown_in(UNITS.get(variable, "1"))
    return with_unit(f"{variable} = {factor * value:g}", unit, " ")
