"""A campaign's page as one file with styles, scripts and data; it loads no other.

Data from inputs enter the page in two ways only: as JSON without ``<``, which the
script inserts as text, and as base64. A content security policy in the head forbids
network access, and all scripts except those whose digests the policy lists.

It holds facts, commands, columns of results and traces of a campaign.
"""

from __future__ import annotations

import base64
import hashlib
import html
import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.analysis import rules
from hpcwhirl.analysis.regimes import Thresholds
from hpcwhirl.errors import InputError
from hpcwhirl.refinement.boundary import STATES
from hpcwhirl.report import palette
from hpcwhirl.report.canvas import FIXED, axis_of, value_of
from hpcwhirl.report.page.commands import commands_of, setting
from hpcwhirl.report.page.loads import loads_of
from hpcwhirl.report.page.motion import motions_of
from hpcwhirl.report.page.run_ups import run_ups_of
from hpcwhirl.report.page.tables import tables_of
from hpcwhirl.report.page.thin import (
    MOST_RECORDS,
    NEEDED,
    Sizes,
    at_most,
    record_of,
    sizes_for,
)
from hpcwhirl.safe_open import open_regular
from hpcwhirl.scene import input_names
from hpcwhirl.scene.quantities import (
    BLADES,
    CHAOS,
    ESTIMATED,
    INPUTS,
    LOST,
    PERFORMANCE,
    REFINED,
    ROW,
    SLIPPED,
    STATUS,
    TUNED,
    WORN,
    variable_name,
)
from hpcwhirl.scene.units import shown_in, written_factors
from hpcwhirl.scene.words import ENUMS, SHOWN, WHIRLS
from hpcwhirl.store.atomic import sweep_idle, write_whole
from hpcwhirl.store.directory.campaign_directory import Directory
from hpcwhirl.store.reading.results_file import Results
from hpcwhirl.store.reading.select import counting, known_counts
from hpcwhirl.store.reading.shares import SHARE, SURE, find_credibility
from hpcwhirl.store.results.cells import read_refined

FACTS = (
    "title", "created", "version", "git", "command", "hosts", "ranks", "mpi", "python",
    "libraries", "preset", "preset_loses",
)  # fmt: skip
MORE = (  # columns of some campaigns
    BLADES | CHAOS | ESTIMATED | LOST | SLIPPED | WORN | TUNED | REFINED
)
LEFT_OUT = ("message", "rank")  # columns of results that the page's table lacks
CHARTED = ("time", "energy", "power", "line_frequency")  # axes of a case's figures
DERIVED = {  # {name: (expression, unit, meaning)}
    "orbit_over_gap": ("orbit_radius / gap", "1", "orbit radius / gap"),
    "fed_over_lost": ("late_fed / late_lost", "1", "energy fed / lost in the window"),
}


@dataclass(frozen=True)
class PageData:
    """The parts of the data in a campaign's page.

    Attributes
    ----------
    facts : data that become JSON: inputs, meanings, units, commands
    columns : values of all columns of results, as bytes, one after another
    records : traces of each case that has some, reduced to bytes, all of one size
    motions : {case: the wheel in motion, for some cases}
    """

    facts: dict[str, Any]
    columns: bytes
    records: list[bytes]
    motions: dict[int, Any]


def page_data(results: Results, animate: Sequence[int] = ()) -> PageData:
    """Return the data that a campaign's page contains, from its results.

    animate : numbers of the cases whose wheel is shown in motion, see `motions_of`
    """
    sizes, records, slots = _records(results)
    plan = results.plan
    table, data = _columns(results, slots)
    swept = [_swept(results, name) for name in plan.swept]
    run_ups = run_ups_of(results)
    facts = {
        "engine": plan.engine,
        "cases": len(results),
        "superseded": np.flatnonzero(~counting(results)).tolist(),
        "facts": {n: results.attrs[n] for n in FACTS if n in results.attrs},
        "digest": results.digest(),
        "inputs": _inputs(results),
        "fixed": [value_of(n, results[n][0].item()) for n in _fixed(results)
                  if not (n == "speed" and run_ups)],
        "shown": _shown([*table, *swept]),
        "sure": float(results.attrs.get(SURE, 0.0)),
        "labels": {name: axis_of(name) for name in CHARTED},
        "swept": swept,
        "columns": table,
        "derived": {n: dict(zip(("is", "unit", "meaning"), d, strict=True))
                    for n, d in DERIVED.items()},
        "messages": {i: m for i, m in enumerate(results["message"]) if m},
        "rules": rules.as_data(),
        "thresholds": _thresholds(results),
        "twins": str(find_credibility(results) or ""),
        "series": palette.page_series(),
        "words": {n: ENUMS[n] for n in ENUMS if n in results} | {"word": [*SHOWN]},
        "factors": _factors([*table, *swept]),
        "looks": {n: asdict(look) for n, look in SHOWN.items()},
        "whirls": {n: asdict(look) for n, look in WHIRLS.items()},
        "refined": _refined(results),
        "runUps": run_ups,
        "loads": loads_of(results),
        "tables": tables_of(results),
        "traces": asdict(sizes) | {"bytes": sizes.bytes, "kept": len(records)},
        **commands_of(results),
    }  # fmt: skip
    return PageData(facts, data, records, motions_of(results, animate))


def _refined(results: Results) -> dict[str, Any] | None:
    """Return a refined campaign's cells and boundaries as data for the page.

    The boundaries are those between regimes and between words of whirl. None if the
    campaign was not refined.
    """
    found, whirl = (read_refined(results.path, by) for by in ("", "whirl"))
    if found is None or whirl is None:
        return None
    return {
        "over": found.over,
        "scale": found.scale,
        "corner": found.cells.corner.tolist(),
        "speckle": (found.cells.state == STATES.index("speckle")).tolist(),
        "panelOf": found.panel_of.tolist(),
        "boundaries": {
            by: {
                "at": {name: values.tolist() for name, values in own.at.items()},
                "points": own.panel.tolist(),
                "lines": own.lines.tolist(),
            }
            for by, own in (("regime", found), ("whirl", whirl))
        },
    }


def _shown(told: list[dict[str, Any]]) -> dict[str, tuple[str, float]]:
    """Return the units in which the page shows numbers that it stores in SI.

    Returns {SI unit: (unit shown, factor from SI to it)}

    told : descriptions of columns of results and of swept inputs
    """
    known = {t.get("unit", "") for t in told} | {"N", "N m"}  # of forces, of loads
    units = {unit: shown_in(unit) for unit in sorted(known)}
    return {unit: shown for unit, shown in units.items() if shown != (unit, 1.0)}


def _factors(told: list[dict[str, Any]]) -> dict[str, dict[str, str]]:
    """Return the units that may follow a number in the page's filter.

    Returns {SI unit: {unit: factor to SI, as digits}}

    told : descriptions of columns of results and of swept inputs
    """
    units = {t.get("unit", "1") for t in told}
    return {unit: written_factors(unit) for unit in sorted(units)}


def _fixed(results: Results) -> list[str]:
    """Return which of speed, lobes, gap, friction have one value in all cases.

    The page's title shows them.
    """
    return [n for n in FIXED if len(set(results[n].tolist())) == 1]


def _inputs(results: Results) -> list[dict[str, Any]]:
    """Return the inputs that all cases share: dicts of name, value and meaning."""
    base, swept = results.plan.base, results.plan.swept
    return [
        {"name": name, "value": base[name], "meaning": meaning}
        for name, meaning in input_names().items()
        if name in base and name not in swept
    ]


def _given(results: Results, name: str) -> list[Any]:
    """Return the value of a swept input in each case; name : its dotted name."""
    plan = results.plan
    return [settings.get(name, plan.base.get(name)) for settings in plan.settings]


def _levels(values: list[Any]) -> dict[str, Any]:
    """Return the distinct values of an input by their JSON texts, numbers ascending.

    values : value of the input in each case
    """
    levels = {json.dumps(value): value for value in values}
    if all(isinstance(v, int | float) for v in levels.values()):
        return dict(sorted(levels.items(), key=lambda item: float(item[1])))
    return levels


def _swept(results: Results, name: str) -> dict[str, Any]:
    """Return what the page tells of a swept input.

    It is a dict of names, unit, distinct values, and these values as --set options.

    name : dotted name of the input
    """
    levels = list(_levels(_given(results, name)).values())
    return {
        "name": name,
        "variable": variable_name(name),
        "unit": INPUTS[name].unit,
        "levels": levels,
        "set": [setting(name, value) for value in levels],
    }


def _thresholds(results: Results) -> list[dict[str, Any]]:
    """Return the thresholds of the rules for words: a dict for each.

    It has the name, the value used in the results, the default and the meaning.
    """
    return [
        {
            "name": field.name,
            "value": results.attrs.get(f"threshold_{field.name}", field.default),
            "default": field.default,
            "meaning": field.metadata["meaning"],
        }
        for field in fields(Thresholds)
    ]


def _columns(
    results: Results, slots: NDArray[np.int32]
) -> tuple[list[dict[str, Any]], bytes]:
    """Return all columns of results for the page: their descriptions, and their bytes.

    Numbers have 4 bytes each where that changes none of them, else 8.

    slots : (cases,), number of each case's record of traces, -1 for none
    """
    columns: list[tuple[dict[str, Any], NDArray[Any]]] = []
    shares = {n: quantity for n, quantity in SHARE.items() if n in results}
    more = {n: quantity for n, quantity in MORE.items() if n in results}
    for name, variable in (ROW | STATUS | PERFORMANCE | more | shares).items():
        if name in LEFT_OUT:
            continue
        told: dict[str, Any] = {"name": name}
        told |= {"unit": variable.unit, "meaning": variable.meaning}
        column = known_counts(results[name])
        if column.dtype.kind == "U":
            words, codes = np.unique(column, return_inverse=True)
            told["words"] = words.tolist()
            columns.append((told, codes.astype("<i4")))
        else:
            columns.append((told, _shortest(column)))
    for name in results.plan.swept:
        values = _given(results, name)
        place = {key: i for i, key in enumerate(_levels(values))}
        codes = np.array([place[json.dumps(value)] for value in values], "<i4")
        columns.append(({"name": f"level of {name}"}, codes))
    columns.append(({"name": "record"}, slots))
    return _packed(columns)


def _shortest(column: NDArray[Any]) -> NDArray[Any]:
    """Return numbers as 4 bytes each if all of them stay the same, else as 8."""
    whole = column.astype("<f8")
    with np.errstate(over="ignore"):
        short = whole.astype("<f4")
    return short if np.array_equal(short, whole, equal_nan=True) else whole


def _packed(
    columns: list[tuple[dict[str, Any], NDArray[Any]]],
) -> tuple[list[dict[str, Any]], bytes]:
    """Return columns as one sequence of bytes, and the description of each.

    A description has the column's type and where it begins in the bytes. A column that
    is constant is stored as one value.

    columns : (description, values) of each
    """
    table, parts, at = [], [], 0
    for told, column in sorted(columns, key=lambda c: -c[1].dtype.itemsize):
        same = len(column) > 0 and bool((column == column[0]).all())
        shown = column[:1] if same else column
        kind = shown.dtype.str[1:]
        table.append(told | {"kind": kind, "at": at, "same": same})
        parts.append(shown.tobytes())
        at += shown.nbytes
    return table, b"".join(parts)


def _records(results: Results) -> tuple[Sizes, list[bytes], NDArray[np.int32]]:
    """Return the traces of all cases for the page, reduced to records of one size.

    Returns numbers of points of a record; the records; and (cases,), number of each
    case's record, -1 for none. If more than `MOST_RECORDS` cases have traces, only
    every n-th of them has a record
    """
    slots = np.full(len(results), -1, "<i4")
    whole = np.flatnonzero(results["status"] == "ok")
    whole = whole if set(NEEDED) <= set(results.kept) else whole[:0]
    chosen = at_most(whole, MOST_RECORDS)
    sizes = sizes_for(len(chosen))
    records: list[bytes] = []
    for case, traces in results.each_traces(chosen.tolist(), NEEDED):
        if not np.isfinite(traces["centre"]).any():  # this case kept no traces
            continue
        numbers = (results[n][case] for n in ("speed", "window", "line_frequency"))
        speed, window, line = (float(n) for n in numbers)
        slots[case] = len(records)
        records.append(record_of(traces, speed, window, line, sizes))
    return sizes, records, slots


LIBRARIES = ("vendor/d3.min.js", "vendor/plot.min.js")
SCRIPTS = ("expression", "condition", "data", "words", "axes", "story", "refined",
           "map", "charts", "run_ups", "loads", "case", "motion", "table", "address",
           "main")  # fmt: skip
DIGEST = re.compile(rb'<meta name="hpcwhirl-results" content="([0-9a-f]{64})">')
HEAD_BYTES = 4096  # beginning of the page that contains the line with the digest


def write_page(
    directory: Directory, out: Path | None = None, animate: Sequence[int] = ()
) -> Path:
    """Write the page of a finished campaign and return its path.

    Parameters
    ----------
    directory, out : the campaign; the file to write, None: `report.html` in it
    animate : numbers of the cases whose wheel is shown in motion, see `motions_of`
    """
    results = Results(directory.results)
    if not len(results):
        raise InputError(f"{results.path} has no cases: nothing to show")
    path = out or directory.page
    sweep_idle(path.parent, path.name)  # files left by a killed process
    write_whole(path, page_of(page_data(results, animate)).encode(), held=True)
    return path


def is_stale(directory: Directory) -> bool:
    """Return whether a campaign's page exists but shows older results."""
    try:
        with open_regular(directory.page) as file:
            found = DIGEST.search(file.read(HEAD_BYTES))
    except OSError:
        return False
    with Results(directory.results) as results:
        return not found or found[1].decode() != results.digest()


def live_page(results: Results, version: int, text: str) -> str:
    """Return a campaign's page that asks the server it comes from for its state.

    version, text : number of the page; how far the campaign is
    """
    return page_of(page_data(results), (version, text))


def waiting_page(version: int, text: str) -> str:
    """Return a page for a campaign of which no case has ended, as `live_page`."""
    script = _asset("assets/live.js")
    style = palette.page_style() + _asset("assets/page.css")
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8"><meta http-equiv="'
        f'Content-Security-Policy" content="{_policy([script], live=True)}">'
        f"<title>hpcwhirl campaign</title><style>{style}</style></head><body>"
        f"{_live_line(version, text)}<script>{script}</script></body></html>"
    )


def _live_line(version: int, text: str) -> str:
    told = html.escape(text)
    return f'<p id="live" role="status" data-version="{version}">{told}</p>'


def page_of(content: PageData, live: tuple[int, str] | None = None) -> str:
    """Return a campaign's page as HTML text, with styles, scripts and data.

    live : number of a page that follows its campaign, and how far this is
    """
    scripts = [_asset(name) for name in LIBRARIES]
    own = "\n".join(_asset(f"assets/{name}.js") for name in SCRIPTS)
    scripts.append(f'"use strict";\n(() => {{\n{own}\n}})();\n')
    if live:
        scripts.append(_asset("assets/live.js"))
    parts = {
        "policy": _policy(scripts, live=live is not None),
        "live": _live_line(*live) if live else "",
        "digest": content.facts["digest"],
        "title": html.escape(f"{content.facts['engine']}: hpcwhirl campaign"),
        "style": palette.page_style() + _asset("assets/page.css"),
        "facts": _json(content.facts),
        "columns": base64.b64encode(content.columns).decode(),
        "motions": _json(content.motions),
        "traces": "".join(base64.b64encode(r).decode() for r in content.records),
        "scripts": "".join(f"<script>{text}</script>\n" for text in scripts),
    }
    frame = _asset("assets/page.html")
    return re.sub(r"\{\{(\w+)\}\}", lambda found: parts[found[1]], frame)


def _asset(name: str) -> str:
    place = resources.files("hpcwhirl.report.page").joinpath(name)
    return place.read_text("utf-8")


def _json(facts: Mapping[Any, Any]) -> str:
    """Return facts as JSON text without <, so that it cannot end its HTML element."""
    return json.dumps(facts, allow_nan=False).replace("<", "\\u003c")


def _policy(scripts: list[str], *, live: bool = False) -> str:
    """Return the page's content security policy.

    It allows these scripts, by their digests, and inline styles, but no network, or
    that of the server the page comes from.

    scripts, live : texts of the scripts; whether the page follows its campaign
    """
    hashes = (hashlib.sha256(text.encode()).digest() for text in scripts)
    allowed = " ".join(f"'sha256-{base64.b64encode(h).decode()}'" for h in hashes)
    network = "connect-src 'self'; " if live else ""
    return (
        f"default-src 'none'; script-src {allowed}; style-src 'unsafe-inline'; "
        f"{network}img-src data:; base-uri 'none'; form-action 'none'"
    )
