"""Cost against accuracy of solver settings: table, Pareto front and figure.

They show what `hpcwhirl tradeoff` has measured on several scenes: each setting, such as
a scheme or a time step, is compared with a reference of high accuracy. The facts of a
measurement are the data that it writes to its JSON file.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from hpcwhirl.errors import number_told
from hpcwhirl.report.canvas import BOX, in_defaults, new_figure, save

Facts = Mapping[str, Any]
COLUMNS = {
    "orbit_radius": "orbit radius",
    "contact_impulse": "contact impulse",
    "centre_peak": "centre's peak",
    "tip_peak": "tips' peak",
    "line_frequency": "line",
    "growth_rate": "ln amplitude",
}
SMALLEST = 1e-7  # smallest error that the figure shows


@dataclass(frozen=True)
class Row:
    """Cost and accuracy of one setting of the solver, over all scenes of a measurement.

    Attributes
    ----------
    axis, label : what is varied, such as the scheme; name of the setting
    cost : computing time of all scenes / that with the settings in their files
    spread : range of the computing times of repeats, divided by their median
    agree, runs : number of runs with the words of the reference, and of all runs
    errors : {variable: (median over the scenes, largest)}, relative errors
    score : median over the scenes of the largest relative error of each scene
    ledger : largest |ledger_error| of any run
    refused : messages of scenes that do not allow the setting
    unstable : whether a run was unstable
    front : whether the setting is on the Pareto front: no other setting is at least as
        good in cost, words and score
    """

    axis: str
    label: str
    cost: float
    spread: float
    agree: int
    runs: int
    errors: dict[str, tuple[float, float]]
    score: float
    ledger: float
    refused: tuple[str, ...]
    unstable: bool = False
    front: bool = False


def table_of(facts: Facts) -> list[Row]:
    """Return cost and accuracy of each setting, in the order in which they were tried.

    Parameters
    ----------
    facts : data of a measurement, from `benchmark.tradeoff.Tradeoff.facts`; the first
        setting is "as given", that in the scenes' files
    """
    found: dict[tuple[str, str], list[Facts]] = {}
    for row in facts["compared"]:
        found.setdefault((row["axis"], row["label"]), []).append(row)
    base = {row["scene"]: float(np.median(row["seconds"]))
            for row in next(iter(found.values()))}  # fmt: skip
    rows = [_row(axis, label, group, base) for (axis, label), group in found.items()]
    marked = {id(row) for row in front_of(rows)}
    return [replace(row, front=id(row) in marked) for row in rows]


def _row(
    axis: str, label: str, group: Sequence[Facts], base: Mapping[str, float]
) -> Row:
    done = [row for row in group if not row["refused"]]
    refused = tuple(sorted({row["refused"] for row in group if row["refused"]}))
    if not done:
        return Row(axis, label, math.inf, 0.0, 0, 0, {}, math.inf, 0.0, refused)
    times = np.array([row["seconds"] for row in done])  # (scenes, repeats)
    usual = sum(base[row["scene"]] for row in done)
    per_run = times.sum(axis=0)
    return Row(
        axis,
        label,
        float(np.median(per_run)) / usual,
        float(np.ptp(per_run) / np.median(per_run)),
        sum(row["agree"] for row in done),
        sum(len(row["words"]) for row in done),
        _spread_of([row["errors"] for row in done]),
        float(np.median([row["score"] for row in done])),
        max(row["ledger"] for row in done),
        refused,
        any(word.startswith("unstable") for row in done for word in row["words"]),
    )


def front_of(rows: Sequence[Row]) -> list[Row]:
    """Return the settings on the Pareto front, sorted by cost.

    Minimised are cost, number of runs whose word differs from the reference, and score
    (see `Row`); refused and unstable settings, and those of the duration, are left out.
    """
    whole = [
        row
        for row in rows
        if not (row.refused or row.unstable) and row.axis != "duration"
    ]
    keys = np.array([(row.cost, row.runs - row.agree, row.score) for row in whole])
    front = [
        row
        for row, own in zip(whole, keys, strict=True)
        if not ((keys <= own).all(axis=1) & (keys < own).any(axis=1)).any()
    ]
    return sorted(front, key=lambda row: row.cost)


def floor_row(facts: Facts) -> dict[str, tuple[float, float]]:
    """Return how much results differ by chance alone: between twins of one setting.

    Returns {variable: (median over the scenes, largest)}, relative differences

    facts : data of a measurement
    """
    return _spread_of(list(facts["floors"].values()))


def _spread_of(found: Sequence[Mapping[str, float]]) -> dict[str, tuple[float, float]]:
    """Return median and largest number over scenes, {variable: (median, largest)}.

    found : {variable: number} of each scene; a scene may lack a variable
    """
    values = {n: [own[n] for own in found if n in own] for n in COLUMNS}
    return {n: (float(np.median(v)), max(v)) for n, v in values.items() if v}


def percent(value: float) -> str:
    """Return a ratio as text in per cent with two digits, such as "1.2 %".

    From 100 % on it has no decimals and no exponent.
    """
    if not math.isfinite(value):
        return "—"
    digits = ".2g" if value < 0.995 else ".0f"
    return "0" if value == 0.0 else f"{100 * value:{digits}} %"


def _cells(errors: Mapping[str, tuple[float, float]]) -> list[str]:
    return [
        f"{percent(errors[n][0])} ({percent(errors[n][1])})" if n in errors else "—"
        for n in COLUMNS
    ]


def markdown(facts: Facts) -> str:
    """Return the table of settings as Markdown, those on the Pareto front in bold.

    facts : data of a measurement
    """
    rows, kinds = table_of(facts), len(facts["words"])
    names = " | ".join(COLUMNS.values())
    lines = [
        f"| setting | times the cost | words | {names} |",
        "|" + "---|" * (3 + len(COLUMNS)),
    ]
    axis = ""
    for row in rows:
        if row.axis != axis:
            axis = row.axis
            lines.append(f"| *{axis}* |" + " |" * (2 + len(COLUMNS)))
        if not row.runs:
            lines.append(f"| {row.label} | refused: {row.refused[0]} |"
                         + " |" * (1 + len(COLUMNS)))  # fmt: skip
            continue
        label = f"**{row.label}**" if row.front else row.label
        cost = f"{row.cost:.3g} (± {50 * row.spread:.0f} %)"
        words = f"{row.agree} of {row.runs}"
        words += f" (elsewhere refused: {row.refused[0]})" if row.refused else ""
        lines.append(
            "| " + " | ".join([label, cost, words, *_cells(row.errors)]) + " |"
        )
    floor = " | ".join(["*twins of the reference*", "", "", *_cells(floor_row(facts))])
    lines.append(f"| {floor} |")
    note = (
        f"Errors: median over {number_told(kinds, 'scene')} (largest). Bold: on the "
        "Pareto front. ± is half the spread over the repeats."
    )
    return "\n".join([*lines, "", note, ""])


@in_defaults
def draw_tradeoff(facts: Facts, path: Path) -> Path:
    """Draw error over cost of all settings, with the Pareto front; return the path.

    A dotted line shows how much twins differ, which chance alone causes.

    facts, path : data of a measurement; file to write
    """
    rows = [row for row in table_of(facts) if row.runs and row.axis != "duration"]
    figure, axes = new_figure((9, 6))
    for name in dict.fromkeys(row.axis for row in rows):
        own = [row for row in rows if row.axis == name]
        costs, scores = [r.cost for r in own], [max(r.score, SMALLEST) for r in own]
        shape, size = ("*", 12) if name == "as given" else ("o", 5)
        axes.plot(costs, scores, shape, ms=size, label=name)
    front = sorted((row for row in rows if row.front), key=lambda row: row.cost)
    axes.step([r.cost for r in front], [max(r.score, SMALLEST) for r in front],
              where="post", c="black", lw=0.8, label="front")  # fmt: skip
    for row in front:
        axes.annotate(row.label, (row.cost, max(row.score, SMALLEST)), fontsize=7,
                      xytext=(4, 4), textcoords="offset points",
                      bbox=BOX, zorder=4)  # fmt: skip
    floor = max((value[0] for value in floor_row(facts).values()), default=0.0)
    if floor > 0.0:
        axes.axhline(floor, c="grey", ls=":", lw=1.0, label="twins differ by (median)")
    axes.margins(x=0.2)
    axes.set(xscale="log", yscale="log",
             xlabel="computing time / that of the scenes as given",
             ylabel="largest relative error, median over the scenes",
             title=f"Speed against accuracy, {facts.get('machine', '')}")  # fmt: skip
    for part in ("major", "minor"):  # costs span few decades: 0.6, 1, 2
        getattr(axes.xaxis, f"set_{part}_formatter")("{x:g}")
    axes.legend(fontsize=8)
    return save(figure, path)
