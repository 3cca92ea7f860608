"""Bands of speed in which free motion grows are those of the eigenvalues of all modes.

Rotors of equal blades on bearings that a table gives over the speed, round or different
by direction, with cross coupling, without a table, with a tilting disk. The growth rate
at 200 speeds follows from the matrices of the whole rotor, in physical coordinates; on
bearings that differ by direction from Floquet's multipliers over half a revolution, at
40 speeds. It must be above 0 inside of each band and nowhere else. Not judged: speeds
within a hundredth of a band's end, and growth below a thousandth of the largest rate.
"""

from __future__ import annotations

import random
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from scipy.linalg import expm

from hpcwhirl.case.growth import stability_of
from hpcwhirl.case.resolve import resolve
from hpcwhirl.reduction.model import Model
from hpcwhirl.reduction.supports import planar
from hpcwhirl.reduction.waves import turning_matrices
from hpcwhirl.scene import apply_settings, named_scene

COUNT = 30
LEAST = 1.0
SPEEDS, FEWER = 200, 40
HIGHEST = 800.0  # rad/s, speed of interest
NEAR = 0.01  # distance from a band's end, relative to the range, that is not judged
SMALL = 1e-3  # growth rate, relative to the largest, that is not judged
PARTS = 64  # intervals of half a revolution in which a periodic matrix is constant
HEAD = "frequency, kxx, kxy, kyx, kyy, cxx, cxy, cyx, cyy"
KINDS = "table", "table", "coupled", "unlike", "inputs", "tilt"


def drawn(seed: int, index: int) -> dict[str, Any]:
    """Return a rotor: its inputs, and the lines of its bearing's table, if any."""
    draw = random.Random(f"stability {seed} {index}")
    kind = KINDS[index % len(KINDS)]
    blades = 3 if kind == "unlike" else draw.choice([3, 4, 5, 7])
    given: dict[str, Any] = {
        "rotation": "full",
        "blades": blades,
        "modes": 2 * blades,
        "rotor.elements": 3,
        "rotor.damping": 10 ** draw.uniform(-3.0, -1.3),
        "centre_stiffness": 10 ** draw.uniform(6.0, 7.7),
        "suspension_damping": draw.choice([-1.0, 0.06, 0.2]),
        "speed": 300.0,
    }
    if kind == "inputs":
        given["cross_coupling"] = 10 ** draw.uniform(4.0, 7.0)
    if kind == "tilt":
        given |= {"shaft": "cantilever", "shaft_length": 0.4}
        given |= {"polar_inertia": 3.0, "tilt_inertia": 2.0}
    lines = _table(draw, kind) if kind in {"table", "coupled", "unlike"} else []
    if lines:
        given["suspension_damping"] = -1.0
    return {"kind": kind, "given": given, "table": lines}


def _table(draw: random.Random, kind: str) -> list[str]:
    """Return the lines of a bearing's table over the speed."""
    lines = [HEAD]
    stiffness, damping = 10 ** draw.uniform(6.0, 7.7), 10 ** draw.uniform(2.5, 4.5)
    across = 10 ** draw.uniform(5.0, 6.7) if kind != "table" else 0.0
    apart = draw.uniform(0.05, 0.4) if kind == "unlike" else 0.0
    for speed in np.linspace(50.0, draw.uniform(500.0, 900.0), draw.choice([2, 4, 6])):
        factor = draw.uniform(0.6, 1.6)
        k, c = stiffness * factor, damping / factor
        q = across * speed / 500.0
        row = [speed, k * (1 + apart), q, -q, k * (1 - apart), c, 0.0, 0.0, c]
        lines.append(", ".join(f"{number:.9g}" for number in row))
    return lines


def judged(row: dict[str, Any]) -> dict[str, Any]:
    """Return whether bands and eigenvalues agree at all speeds judged."""
    model = _model(row)
    found = stability_of(model, HIGHEST)
    if found is None:
        return {"held": False, "why": "no search"}
    unlike = row["kind"] == "unlike"
    count = FEWER if unlike else SPEEDS
    speeds = np.linspace(found.span.low, found.span.high, count + 2)[1:-1]
    growth = _growth_periodic if unlike else _growth
    rates = np.array([growth(model, float(speed)) for speed in speeds])
    inside, clear = np.zeros(count, bool), np.abs(rates) > SMALL * np.abs(rates).max()
    near = NEAR * (found.span.high - found.span.low)
    for band in found.bands:
        inside |= (band.start <= speeds) & (speeds <= band.end)
        clear &= (np.abs(speeds - band.start) > near) | (band.start == found.span.low)
        clear &= (np.abs(speeds - band.end) > near) | (not band.ends)
    wrong = clear & (inside != (rates > 0.0))
    why = "; ".join(
        f"{speed:.1f} rad/s: growth {rate:.3g}"
        for speed, rate in zip(speeds[wrong], rates[wrong], strict=True)
    )
    bands = [[band.start, band.end, band.growth] for band in found.bands]
    counts = {"judged": int(clear.sum()), "grows": int((rates > 0.0).sum())}
    return {"held": not wrong.any(), "why": why, "bands": bands} | counts


def _model(row: dict[str, Any]) -> Model:
    """Return the model of a drawn rotor; its table is written to a file meanwhile."""
    with tempfile.TemporaryDirectory() as folder:
        settings = dict(row["given"])
        if row["table"]:
            file = Path(folder) / "bearing.csv"
            file.write_text("\n".join([*row["table"], ""]))
            settings["bearing"] = str(file)
        return resolve(apply_settings(named_scene("four_motions"), settings)).model


def _matrix(rate: Any, held: Any) -> Any:
    n = len(held)
    top = np.hstack([np.zeros((n, n)), np.eye(n)])
    return np.vstack([top, np.hstack([-held, -rate])])


def _growth(model: Model, speed: float) -> float:
    """Return the largest growth rate, 1/s, by the whole rotor's matrices."""
    rotor = model.rotor
    gyro, damping, stiffness, push = turning_matrices(rotor, speed, model.blades)
    both = np.hstack([damping + gyro, stiffness + push])
    rate, held = np.hsplit(np.linalg.solve(rotor.mass, both), 2)
    return float(np.linalg.eigvals(_matrix(rate, held)).real.max())


def _growth_periodic(model: Model, speed: float) -> float:
    """Return the largest growth rate, 1/s, by Floquet's multipliers.

    In the rotating frame, supports that differ by direction turn by -2 Omega t.
    """
    rotor, hub = model.rotor, np.s_[2 * model.blades : 2 * model.blades + 2]
    gyro, damping, stiffness, push = turning_matrices(rotor, speed, model.blades)
    own = rotor.terms.support.at(speed)
    mirror = np.diag([1.0, -1.0])  # conj(z)
    period = np.pi / speed
    whole = np.eye(2 * len(rotor.mass))
    for part in range(PARTS):
        turned = np.exp(-2j * speed * period * (part + 0.5) / PARTS)
        held, rate = stiffness + push, damping + gyro
        of_place = (own.stiffness_apart - 1j * speed * own.damping_apart) * turned
        held[hub, hub] += planar(of_place) @ mirror
        rate[hub, hub] += planar(own.damping_apart * turned) @ mirror
        both = np.linalg.solve(rotor.mass, np.hstack([rate, held]))
        rate, held = np.hsplit(both, 2)
        whole = expm(_matrix(rate, held) * period / PARTS) @ whole
    return float(np.log(np.abs(np.linalg.eigvals(whole)).max()) / period)
