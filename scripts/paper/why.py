"""Why it diverges: what the ledger says, and what linear theory is worth."""

from __future__ import annotations

import numpy as np
from common import table
from paper.found import Found, Row
from scipy.stats import spearmanr

from hpcwhirl.analysis.stability import growth_of_diameter
from hpcwhirl.case.resolve import resolve

COLUMNS = (
    "late_friction", "late_rotation", "late_lost", "growth_rate", "closed", "slow",
)  # fmt: skip


def why(found: Found) -> list[str]:
    """Return the section on what feeds divergence, measured and by linear theory."""
    cases, line = found.cases["table2"], found.line("table2", centre="free")
    rows = []
    for case in line:
        scene, row = cases.scene(case), cases.rows[case]
        linear = growth_of_diameter(
            resolve(scene).model, 1, scene.speed, scene.friction
        )
        rows.append(row | linear)
    growing = [r for r in rows if r["regime"] == "divergent"]
    head = (
        "Ω, rad/s", "fed by friction, J", "by transport over the ring, J", "lost, J",
        "measured growth, 1/s", "all closed, 1/s", "all closed, below 150 Hz, 1/s",
        "at rad/s, static frame", "measured line",
    )  # fmt: skip
    body = [
        (
            f"{r['speed']:g}",
            *(f"{r[name]:.3g}" for name in COLUMNS),
            f"{r['speed'] - r['slow_line']:.0f}",
            f"{r['line_frequency']:.0f}",
        )
        for r in growing
    ]
    return ["## Why it diverges", "", *table(head, body), "", *_verdict(rows, growing)]


def _verdict(rows: list[Row], growing: list[Row]) -> list[str]:
    """Say what feeds divergence, and what the linear check is worth, in numbers."""
    if not growing:
        return ["No case of Table 2 diverged."]
    shares = [r["late_friction"] / r["late_fed"] for r in growing]
    rest = [r for r in rows if r["regime"] in {"damped", "sustained"}]
    false = sum(r["slow"] > 0 for r in rest)
    missed = sum(r["slow"] <= 0 for r in growing)
    closed = [r["closed"] for r in rows]
    out = [
        (
            f"Of what contact feeds into {len(growing)} divergent cases in their last "
            f"40 %, friction is {100 * min(shares):.0f} to {100 * max(shares):.0f} %; "
            "the rest is the transport of contacts over the deformed ring."
        ),
        "",
        (
            "Linear check: all tips held on the ring, sliding, nodal diameter 1. It "
            f"predicts growth for {len(growing) - missed} of {len(growing)} divergent "
            f"cases and for {false} of {len(rest)} that are damped or sustained; its "
            f"fastest root grows at {min(closed):.0f} to {max(closed):.0f} 1/s."
        ),
    ]
    out += _followed(growing)
    useful = false == 0 and missed == 0
    told = "tells" if useful else "does not tell"
    return [*out, f"It {told} divergent from other cases."]


def _followed(growing: list[Row]) -> list[str]:
    """Say how the rates of the linear check go with the measured ones."""
    if len(growing) < 3:
        return []
    slow = np.array([r["slow"] for r in growing])
    measured = np.array([r["growth_rate"] for r in growing])
    rank = spearmanr(slow, measured).statistic
    away = [abs(r["speed"] - r["slow_line"] - r["line_frequency"]) for r in growing]
    ratio = np.median(slow / measured)
    told = f"Among the divergent, its rates below 150 Hz are {ratio:.2g} times the "
    told += f"measured (median), with rank correlation {rank:.2f}; its line lies "
    return [told + f"{np.median(away):.0f} rad/s (median) from the measured one."]
