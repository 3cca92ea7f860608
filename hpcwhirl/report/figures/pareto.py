"""Cost against accuracy of solver settings: table, Pareto front and figure.

They show what `hpcwhirl tradeoff` has measured on several cases: each setting, such as
a scheme or a time step, is compared with a reference of high accuracy. The facts of a
measurement are the data that it writes to its JSON file.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.ticker import LogLocator

from hpcwhirl.errors import number_told
from hpcwhirl.report import palette
from hpcwhirl.report.canvas import BOX, in_defaults, new_figure, save

Facts = Mapping[str, Any]
COLUMNS = {
    "orbit_radius": "orbit radius",
    "contact_impulse": "contact impulse",
    "centre_peak": "centre's peak",
    "blade_peak": "tips' peak",
    "orbit_area": "area swept",
    "line_frequency": "line",
    "growth_rate": "ln amplitude",
}
SMALLEST = 1e-7  # smallest error that the figure shows


def floor_row(facts: Facts) -> dict[str, list[float]]:
    """Return how much the reference's twins differ where that is little enough.

    Returns {number: of each case}

    facts : data of a measurement, from `benchmark.tradeoff.Tradeoff.facts`
    """
    cases = facts["cases"].values()
    return {n: [c["scatter"][n] for c in cases
                if n in c["scatter"] and n not in c["sensitive"]]
            for n in COLUMNS}  # fmt: skip


def percent(value: float | None) -> str:
    """Return a ratio as text in per cent with two digits, such as "1.2 %".

    From 100 % on it has no decimals and no exponent. Numbers that are not finite are
    None in JSON.
    """
    if value is None or not math.isfinite(value):
        return "—"
    digits = ".2g" if value < 0.995 else ".0f"
    return "0" if value == 0.0 else f"{100 * value:{digits}} %"


def _cell(error: Facts | None) -> str:
    """Return an error's cell: median, nine in ten and what twins differ by."""
    if error is None:
        return "—"
    nine = percent(error["nine"]["value"])
    return f"{percent(error['median']['value'])}, {nine} ({percent(error['twins'])})"


def _interval(error: Facts) -> str:
    """Return the 95 % interval of the error that nine cases in ten are below."""
    low, high = error["nine"]["low"], error["nine"]["high"]
    return f"{percent(low)} to {percent(high).replace('—', '?')}"


def markdown(facts: Facts) -> str:
    """Return the table of settings as Markdown, those on the Pareto front in bold.

    facts : data of a measurement
    """
    names = " | ".join(COLUMNS.values())
    lines = [
        f"| setting | times the cost | words | {names} |",
        "|" + "---|" * (3 + len(COLUMNS)),
    ]
    axis = ""
    for row in facts["rows"]:
        if row["axis"] != axis:
            axis = row["axis"]
            lines.append(f"| *{axis}* |" + " |" * (2 + len(COLUMNS)))
        lines.append(_line(row))
    cells = [f"{percent(float(np.median(v)))}, {percent(max(v))}" if v else "—"
             for v in floor_row(facts).values()]  # fmt: skip
    lines.append(f"| {' | '.join(['*twins of the reference*', '', '', *cells])} |")
    return "\n".join([*lines, "", *_notes(facts), ""])


def _line(row: Facts) -> str:
    if not row["runs"]:
        why = next(iter(row["refused"].values()))
        return f"| {row['label']} | refused: {why} |" + " |" * (1 + len(COLUMNS))
    label = f"**{row['label']}**" if row["front"] else row["label"]
    low, high = min(row["costs"]), max(row["costs"])
    cost = f"{row['cost']:.3g} ({low:.3g} to {high:.3g})"
    words = f"{row['same']} same, {row['changed']} changed, {row['open']} open"
    if row["refused"]:
        why = next(iter(row["refused"].values()))
        words += f" ({len(row['refused'])} refused: {why})"
    cells = [_cell(row["errors"].get(name)) for name in COLUMNS]
    return "| " + " | ".join([label, cost, words, *cells]) + " |"


def _notes(facts: Facts) -> list[str]:
    cases = facts["cases"]
    note = (
        f"Errors over {number_told(len(cases), 'case')}: median, nine in ten below "
        "(twins of the setting, nine in ten below). Words: cases with the reference's "
        "words, with others, and open ones, undecided or with twins that differ. Cost: "
        "median of the rounds (lowest to highest). Bold: on the Pareto front."
    )
    lines = [note]
    front = [row for row in facts["rows"] if row["front"] and row["errors"]]
    radius = [f"{row['label']} {_interval(row['errors']['orbit_radius'])}"
              for row in front if "orbit_radius" in row["errors"]]  # fmt: skip
    if radius:
        lines += ["", "95 % interval of the radius's error that nine cases in ten are "
                  "below: " + "; ".join(radius) + "."]  # fmt: skip
    return [*lines, *_sensitive(facts)]


def _sensitive(facts: Facts) -> list[str]:
    """Return in how many cases numbers are sensitive, and how settings change them."""
    cases = facts["cases"].values()
    count = {n: sum(n in case["sensitive"] for case in cases) for n in COLUMNS}
    if not any(count.values()):
        return []
    parts = [f"{COLUMNS[n]} in {c}" for n, c in count.items() if c]
    head = (
        f"Of {number_told(len(cases), 'case')}, the reference itself is not sure to "
        f"5 % of the {', '.join(parts)}: these have no error. "
    )
    tests = [(row["label"], min(row["shifts"].values(), key=lambda s: s["chance"]))
             for row in facts["rows"] if row["front"] and row["shifts"]]  # fmt: skip
    shifts = "; ".join(
        f"{label} {shift['distance']:.2g} (p {shift['chance']:.2g})"
        for label, shift in tests
    )
    if shifts:
        head += "Largest distance of their distributions (Kolmogorov and Smirnov): "
    return ["", head + shifts]


@in_defaults
def draw_tradeoff(facts: Facts, path: Path) -> Path:
    """Draw error over cost of all settings, with the Pareto front; return the path.

    A dotted line shows how much twins differ, below which no error is known.

    facts, path : data of a measurement; file to write
    """
    rows = [r for r in facts["rows"] if r["runs"] and r["axis"] != "duration"]
    figure, axes = new_figure((9, 6))
    for place, name in enumerate(dict.fromkeys(row["axis"] for row in rows)):
        look = palette.look_of(place) | {"ls": "", "ms": 5}
        if name == "as given":
            look |= {"marker": "*", "ms": 12}
        points = [_point(row) for row in rows if row["axis"] == name]
        axes.plot(*zip(*points, strict=True), **look, label=name)
    front = sorted((row for row in rows if row["front"]), key=lambda r: r["cost"])
    if front:
        axes.step(*zip(*map(_point, front), strict=True), where="post", c=palette.INK,
                  lw=0.8, label="front")  # fmt: skip
    for number, row in enumerate(front):
        axes.annotate(row["label"].split(" = ")[0], _point(row), fontsize=7,
                      xytext=(4, 4 if number % 2 else -10),
                      textcoords="offset points", bbox=BOX, zorder=4)  # fmt: skip
    floors = [float(np.median(v)) for v in floor_row(facts).values() if v]
    if max(floors, default=0.0) > 0.0:
        axes.axhline(max(floors), c=palette.GREY, ls=":", lw=1.0,
                     label="twins differ by (median)")  # fmt: skip
    axes.margins(x=0.2)
    axes.set(xscale="log", yscale="log",
             xlabel="computing time / that of the cases as given",
             ylabel="largest relative error, median over the cases",
             title=f"Speed against accuracy, {facts.get('machine', '')}")  # fmt: skip
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_locator(LogLocator(subs=(2, 5)))
    axes.xaxis.set_minor_formatter("{x:g}")
    axes.legend(fontsize=8)
    return save(figure, path)


def _point(row: Facts) -> tuple[float, float]:
    return float(row["cost"]), max(float(row["score"]), SMALLEST)
