"""What `hpcwhirl model` prints on waves that move the shaft, as rows and lines of text.

They are damping of each wave, critical speeds of an unbalance with and without damping,
and the cross coupling at the limit of stability.
"""

from __future__ import annotations

from typing import Any

from hpcwhirl.scene.quantities import INPUTS
from hpcwhirl.scene.units import ANGULAR, in_shown, shown_in

CRITICAL = 0.2  # damping ratio 1 / (2 * 2.5), beyond which a wave is critically damped
NOTHING = "-"


def wave_heads() -> tuple[str, ...]:
    """Return the heads of the columns of `wave_rows`."""
    unit = shown_in(ANGULAR)[0]
    frames = f"static frame, {unit}", f"rotating frame, {unit}"
    return "wave, k = 1", "whirl", *frames, "damping ratio", "log decrement"


def wave_rows(lines: list[dict[str, Any]], fastest: float) -> list[tuple[str, ...]]:
    """Return the waves of nodal diameter 1 at a speed, a row of texts for each.

    lines : waves, see `analysis.rotation.lines_of`
    fastest : rad/s, highest frequency in the static frame that is returned
    """
    factor = shown_in(ANGULAR)[1]
    return [
        (
            line["family"],
            _sense(line["static"] > 0.0),
            f"{factor * abs(line['static']):.2f}",
            f"{factor * line['rotating']:.2f}",
            *_damping(line),
        )
        for line in lines
        if line["nodal_diameter"] == 1 and abs(line["static"]) <= fastest
    ]


def _sense(forward: bool) -> str:  # noqa: FBT001 - a sign as a word
    return "forward" if forward else "backward"


def _damping(row: dict[str, Any]) -> tuple[str, str]:
    """Return damping ratio and logarithmic decrement of a wave as texts."""
    decrement = row["log_decrement"]
    told = NOTHING if decrement is None else f"{decrement:.4g}"
    return f"{row['damping_ratio']:.4g}", told


def critical_heads() -> tuple[str, ...]:
    """Return the heads of the columns of `critical_rows`."""
    speed = f"critical speed of an unbalance, {shown_in(ANGULAR)[0]}"
    return speed, "model", "wave", "whirl", "damping ratio", "log decrement"


def critical_rows(rotation: dict[str, Any]) -> list[tuple[str, ...]]:
    """Return the critical speeds of an unbalance with and without damping, as texts.

    rotation : result of `analysis.rotation.rotation_of_case`
    """
    factor = shown_in(ANGULAR)[1]
    rows: list[tuple[float, tuple[str, ...]]] = [
        (speed, ("undamped", *4 * (NOTHING,))) for speed in rotation["unbalance_speeds"]
    ]
    rows += [
        (
            one["speed"],
            (_mark(one), one["family"], _sense(one["forward"]), *_damping(one)),
        )
        for one in rotation["damped_critical_speeds"]
    ]
    return [(f"{factor * speed:.2f}", *row) for speed, row in sorted(rows)]


def _mark(row: dict[str, Any]) -> str:
    """Return how a critical speed with damping is marked."""
    if row["damping_ratio"] < 0.0:
        return "damped; the wave grows"
    critically = row["damping_ratio"] >= CRITICAL
    return "critically damped" if critically else "damped"


def limit_told(rotation: dict[str, Any], speed: float) -> list[str]:
    """Return a line of text on the cross coupling at the limit of stability, or none.

    rotation, speed : result of `analysis.rotation.rotation_of_case`; rad/s
    """
    limit = rotation["stability_limit"]
    if limit is None:
        return []
    coupling = in_shown(
        limit["coupling"], INPUTS["engine.rotor.cross_coupling"].unit, 4
    )
    way = "forward" if limit["frequency"] > 0.0 else "backward"
    more = "" if limit["coupling"] >= 0.0 else "; the rotor whirls by itself without it"
    line = (
        f"cross coupling Q0 for zero log decrement at {in_shown(speed, ANGULAR, 4)}: "
        f"{coupling} more at the centre, {way} whirl with "
        f"{in_shown(abs(limit['frequency']), ANGULAR, 4)}{more}"
    )
    return [line]
