"""The ranges of `hpcwhirl margin --over each`: along every input around one point."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

import numpy as np

from hpcwhirl.cli.margin_checks import check_followers, drawn_in, facts_of_checks
from hpcwhirl.cli.margin_ranges import ENDS, OVER, WORDS, print_told
from hpcwhirl.cli.options import asked_units
from hpcwhirl.cli.setting_text import line_text, value_text
from hpcwhirl.cli.tables import print_data, print_table
from hpcwhirl.errors import InputError
from hpcwhirl.scene.units import showing
from hpcwhirl.store.reading import select

if TYPE_CHECKING:
    import xarray

    from hpcwhirl.studies.margin_check import Check
    from hpcwhirl.studies.margins import Along


def each_input(args: argparse.Namespace, data: xarray.Dataset) -> int:
    """Print the safe range around a point along each input, and return the exit code.

    The point and its inputs are those of --at.
    """
    from hpcwhirl.studies.margins import working_point

    found = working_point(data, _point(args.at), args.sure)
    both = [_along(args, data, one) for one in found]
    found = [one for one, _ in both]
    checks = {one.name: own for one, own in both if own}
    columns = _each_columns(found)
    units = dict.fromkeys(columns, "")
    told = {name: facts_of_checks(own) for name, own in checks.items()}
    if print_data(args, columns, units, "inputs", **({"checks": told} if told else {})):
        return 0
    with showing(asked_units(args.units)):
        for n in ("at", *OVER):
            cells = map(value_text, columns["input"].tolist(), columns[n].tolist())
            columns[n] = np.array([*cells])
        print("range of damped cases around the point along each input, with the other "
              "inputs at the point or at the nearest computed values; up to a step "
              "between two cases nothing was computed")  # fmt: skip
        print_table(columns, units, len(found))
        for one in found:
            print_told([one.found], checks.get(one.name, []), one.name)
    return 0


def _along(
    args: argparse.Namespace, data: xarray.Dataset, one: Along
) -> tuple[Along, list[Check]]:
    """Return the range around a point along one input after the check of --check."""
    from hpcwhirl.store.reading.results_file import Results, results_of
    from hpcwhirl.studies.margins import Along, lines_of, nearest_range, ranges_of

    if not args.check or not one.found.cases:
        return one, []
    lines = lines_of(data, one.name, args.sure)
    line = next(line for line in lines if line.fixed == one.found.fixed)
    check_followers(data, one.name, line)
    with Results(results_of(args.folder)) as results:
        ends = [(one.found.low, one.found.high)]
        line, checks = drawn_in(args, results, one.name, line, ends)
    found = nearest_range(ranges_of(line), one.value)
    return Along(one.name, one.value, found), checks


def _point(settings: list[str]) -> dict[str, float]:
    """Return the point that --at gives, {input: value in SI}.

    settings : texts ``NAME=V`` of --at
    """
    from hpcwhirl.scene import input_names

    out: dict[str, float] = {}
    for text in settings:
        name, sign, raw = text.partition("=")
        if not sign:
            raise InputError(f"--at must be NAME=VALUE, got '{text}'")
        known = {*select.UNITS, *input_names()}
        variable = select.variable_of(name.strip(), known, "input of --at")
        if variable in out:
            raise InputError(f"--at {variable} is given twice")
        out[variable] = select.number_of(raw, variable, "--at")
    return out


def _each_columns(found: list[Along]) -> dict[str, Any]:
    """Return the table of safe ranges along each input, {column: (inputs,)}, in SI.

    found : safe range along each input around a point
    """
    out: dict[str, Any] = {"input": [a.name for a in found]}
    out["unit"] = [select.UNITS.get(a.name, "1") for a in found]
    out["at"] = [a.value for a in found]
    out |= {n: [getattr(a.found, n) for a in found] for n in (*ENDS, *WORDS, "step")}
    out["distance"] = [a.found.distance(a.value) for a in found]
    out["line"] = [line_text(a.found.fixed) for a in found]
    return {name: np.array(values) for name, values in out.items()}
