"""Campaign directories of made-up rows, laid out as real ones; nothing is integrated.

Words and numbers follow smooth rules of the inputs, so that maps of them have regions.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from journals import plan_of

from hpcwhirl.scene import Scene, flatten, to_toml
from hpcwhirl.scene.input_names import full_name
from hpcwhirl.scene.quantities import PERFORMANCE, ROW, STATUS, variable_name
from hpcwhirl.scene.words import ENUMS
from hpcwhirl.store.directory.manifest import Manifest, PlanFile
from hpcwhirl.store.hdf5 import dtype, missing
from hpcwhirl.store.results.contents import Contents
from hpcwhirl.store.results.layout import LIBVER, define, stored, swept_extra

INTERVAL = 5e-3  # s between samples of made-up orbits
KEPT = ("centre", "energy", "impulse", "fed", "rubbed", "lost")
Columns = dict[str, Any]


def synthetic(
    folder: Path,
    settings: Sequence[Mapping[str, Any]],
    *,
    samples: int = 0,
    status: Sequence[str] | None = None,
    facts: Mapping[str, str] | None = None,
) -> Path:
    """Write campaign.json and results.h5 of made-up rows; return the directory.

    Parameters
    ----------
    folder : directory to make
    settings : {input: value} of each case
    samples : of the traces that are kept, 0 for none; they are holes in the file
    status : of each case, all ok if None
    facts : further root attributes
    """
    folder.mkdir(parents=True, exist_ok=True)
    full = [{full_name(n): v for n, v in row.items()} for row in settings]
    swept = list(dict.fromkeys(n for row in full for n in row))
    base = Scene()
    plan = plan_of(flatten(base), swept, full, base.engine.name)
    PlanFile(folder).write(plan)
    contents = Contents(folder, plan)
    if samples:
        contents.samples[:], contents.interval[:] = samples, INTERVAL
        contents.kept, contents.sizes = KEPT, {"xy": 2}
    told = {"scene": to_toml(base), **(facts or {})}
    rows = _rows(plan, status or ["ok"] * len(full))
    with h5py.File(folder / "results.h5", "w", libver=LIBVER) as file:
        define(file, contents, told)
        for name, values in rows.items():
            file[name][:] = values
        for name in contents.kept:
            file[name][0] = 0.0  # allocates the whole; the rest stays a hole
    return folder


def _rows(plan: Manifest, status: Sequence[str]) -> Columns:
    count = len(plan.digests)
    given = {name: _column(plan, name) for name in plan.base}
    plain = {variable_name(dotted): dotted for dotted in plan.base}
    bad = np.array([word != "ok" for word in status])
    out: Columns = {}
    for name, variable in (ROW | STATUS | PERFORMANCE).items():
        place = f"performance/{name}" if name in PERFORMANCE else name
        values = np.full(count, missing(variable), dtype=dtype(variable))
        if name in plain and name in ROW:
            values = np.array([stored(v) for v in given[plain[name]]], values.dtype)
        out[place] = values
    for name, dotted in swept_extra(plan).items():
        out[name] = np.array([stored(v) for v in given[dotted]])
    numbers = evidence(out)
    for name, values in numbers.items():
        out[name] = np.where(bad, missing(ROW[name]), values).astype(out[name].dtype)
    out["status"] = np.array([ENUMS["status"].index(word) for word in status])
    out["message"] = np.where(bad, b"made up: it gave no result", b"").astype("S240")
    return out


def _column(plan: Manifest, dotted: str) -> list[Any]:
    if dotted not in plan.swept:
        return [plan.base[dotted]] * len(plan.digests)
    return [row.get(dotted, plan.base[dotted]) for row in plan.settings]


def evidence(inputs: Columns) -> Columns:
    """Return made-up numbers and words of inputs, {name: (cases,)}."""
    speed, gap = inputs["speed"].astype(float), inputs["gap"].astype(float)
    drive = 6.0 * inputs["friction"] + 8e-3 * (abs(speed) - 350.0)
    growth = 12.0 * (drive - 1.5 * np.log10(np.maximum(gap, 1e-6) / 1e-4) - 0.8)
    regime = np.select(
        [growth < -2.0, growth < 6.0, growth < 9.0], [1, 2, 4], default=3
    )
    unstable = (growth > 24.0) & (np.sin(speed) > 0.9)
    ratio = np.tanh(3.0 * np.sin(speed / 60.0))
    whirl = np.select([ratio > 1 / 3, ratio < -1 / 3], [1, 2], default=3)
    lost = 1e-3 * np.exp(np.clip(growth, -40, 20) / 5)
    return {
        "outcome": np.where(unstable, 3, 1),
        "regime": np.where(unstable, 0, regime),
        "whirl": np.where(unstable, 0, whirl),
        "stop": np.ones(len(speed)),
        "growth_rate": growth,
        "growth_error": np.full(len(speed), 0.1),
        "whirl_ratio": ratio,
        "orbit_radius": gap * np.exp(np.clip(growth, -60.0, 5.0) / 4.0),
        "contact_impulse": lost * 40.0,
        "late_lost": lost,
        "late_friction": lost * (1 + growth / 30.0),
        "end_time": np.full(len(speed), 2.5),
        "window": np.ones(len(speed)),
        "sample_interval": np.full(len(speed), INTERVAL),
        "contacts": np.maximum(growth, 0).astype(int) * 7,
    }


def grid_of(**values: Sequence[Any]) -> list[dict[str, Any]]:
    """Return the settings of every combination, the last input changing fastest."""
    rows: list[dict[str, Any]] = [{}]
    for name, known in values.items():
        rows = [row | {name: value} for row in rows for value in known]
    return rows
