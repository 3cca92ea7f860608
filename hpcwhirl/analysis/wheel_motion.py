"""The wheel in its casing, frame by frame, from the traces of one case.

A frame has everything that is needed to draw the contact at one time: displacements of
the tips and of the centre, the wall of the casing, and the mean normal force on each
blade since the frame before. The wall is the casing's shape at rest plus its elastic
displacement; the gap of blade j at the angle theta_j = theta + 2 pi j / N, static
frame, is gap + wall(theta_j) - u_j, with u_j the radial displacement of its tip.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.arrays import Floats
from hpcwhirl.case.profile import Shape, is_round, offset_of, shape_of
from hpcwhirl.case.speed import angle_at, closure_at
from hpcwhirl.errors import InputError
from hpcwhirl.scene import Scene

NEEDED = ("centre", "tips", "casing", "blade_impulse")
LONGEST = 5e-4  # s, largest time between two frames where samples are that close
AT_REST = ("damped",)  # words of motions that are shown from their beginning
# drawn lengths, over the wheel's radius:
GAP_SHARE = 0.07  # of the gap, or less
LONGEST_SHARE = 0.22  # most of the largest displacement in three quarters of the frames
FARTHEST = 0.45  # most of the largest displacement in any frame


class Frames(NamedTuple):
    """The wheel and its casing at n times; N blades, harmonics 0 to H of the wall.

    Attributes
    ----------
    time : (n,), s
    angle : (n,), rad, angle of the rotor, static frame
    gap : (n,), m, clearance of undeflected tips and round casing
    centre : (n, 2), m, STATIC frame
    tips : (n, N, 2), m, rotating frame: radial, tangential
    wall : (n, H + 1, 2), m, STATIC frame: cosine and sine part of the casing's radial
        departure from its circle, outward > 0
    force : (n, N), N, mean normal force on each blade since the frame before
    lost : number of the blade that is missing, -1 for none
    """

    time: Floats
    angle: Floats
    gap: Floats
    centre: Floats
    tips: Floats
    wall: Floats
    force: Floats
    lost: int = -1

    def enlarged(self) -> float:
        """Return the drawn length of a metre of displacement, in radii of the wheel.

        Gap and displacements are enlarged by one factor, which the last frames of a
        divergent motion do not set alone: they would hide all the others.
        """
        parts = (self.centre, self.tips, self.wall)
        largest = np.maximum.reduce(
            [abs(part).reshape(len(part), -1).max(axis=1) for part in parts]
        )
        usual = max(float(np.quantile(largest, 0.75)), 1e-12)
        most = max(float(largest.max()), 1e-12)
        gap = max(float(self.gap[0]), 1e-9)
        return min(GAP_SHARE / gap, LONGEST_SHARE / usual, FARTHEST / most)

    def openings(self) -> Floats:
        """Return the gap of each blade in each frame, (n, N), m, > 0 where open.

        It is infinite for a blade that is missing.
        """
        blades = self.tips.shape[1]
        theta = self.angle[:, None] + 2.0 * np.pi * np.arange(blades) / blades
        waves = theta[:, :, None] * np.arange(self.wall.shape[1])
        parts = self.wall[:, None, :, 0] * np.cos(waves)
        parts += self.wall[:, None, :, 1] * np.sin(waves)
        gaps = self.gap[:, None] + parts.sum(axis=2) - self.tips[:, :, 0]
        return np.where(np.arange(blades) == self.lost, np.inf, gaps)


def frames_of(
    scene: Scene, row: Mapping[str, Any], traces: Mapping[str, Floats], most: int
) -> Frames:
    """Return the frames of a case: at most so many, from the part that shows its word.

    A damped motion is shown from its first contact on, or from the beginning of the
    run; others at their end.

    Parameters
    ----------
    scene, row : inputs of the case, its numbers and words
    traces : `time` and `NEEDED`, of one case with `traces = "full"`
    most : largest number of frames

    Raises
    ------
    InputError
        if traces are missing, or blades have gaps that the inputs do not give
    """
    lacking = [name for name in NEEDED if traces.get(name) is None]
    if lacking:
        raise InputError(f"needs traces = full; {', '.join(lacking)} was not kept")
    _check(scene)
    traces = _finite(traces)
    time = traces["time"]
    chosen = _chosen(time, str(row["regime"]), traces["blade_impulse"], most)
    at = time[chosen]
    growth = float(row["tip_growth"]) if scene.gap_at == "rest" else 0.0
    return Frames(
        at, angle_at(scene, at), scene.gap - growth - closure_at(scene, at),
        traces["centre"][chosen], traces["tips"][chosen],
        _wall(scene, at, traces["casing"][chosen]),
        _forces(time, traces["blade_impulse"], chosen), scene.engine.rotor.lost_blade,
    )  # fmt: skip


def _finite(traces: Mapping[str, Floats]) -> dict[str, Floats]:
    """Return the traces up to the first sample that is not finite, as one diverges.

    Harmonics that a case has less than others of its campaign become 0.
    """
    known = {name: traces[name] for name in ("time", *NEEDED)}
    lacking = np.asarray(np.isnan(known["casing"]).all(axis=(0, 2)))
    known["casing"] = np.where(lacking[:, None], 0.0, known["casing"])
    parts = (np.isfinite(v).reshape(len(v), -1).all(axis=1) for v in known.values())
    whole = np.logical_and.reduce([*parts])
    end = len(whole) if whole.all() else int(np.argmin(whole))
    return {name: values[:end] for name, values in known.items()}


def _check(scene: Scene) -> None:
    """Raise InputError where the gap at a time is not known here."""
    if scene.engine.rotor.mistuning and scene.gap_at == "rest":
        raise InputError("unequal blades with gap_at = rest have no common gap")


def _chosen(time: Floats, regime: str, impulse: Floats, most: int) -> NDArray[np.intp]:
    """Return the numbers of the samples that become frames, ascending, at most `most`.

    Parameters
    ----------
    time : (n,), s
    regime : word of the case
    impulse : (n, N), N s, cumulative
    """
    if len(time) < 2:
        raise InputError("the case has fewer than two samples")
    stride = max(int(LONGEST / (time[1] - time[0])), 1)
    count = min(most, -(-len(time) // stride))
    first = len(time) - 1 - stride * (count - 1)
    if regime in AT_REST:
        touched = np.flatnonzero(impulse.sum(axis=1) > 0.0)
        begin = max(int(touched[0]) - 4 * stride, 0) if len(touched) else 0
        first = min(begin, first)
    return max(first, 0) + stride * np.arange(count)


def _wall(scene: Scene, time: Floats, casing: Floats) -> Floats:
    """Return the harmonics of the wall at n times, shape at rest and motion together.

    Parameters
    ----------
    time : (n,), s
    casing : (n, H + 1, 2), m, elastic displacement of the casing; H may be 0
    """
    held, let_go = shape_of(scene), offset_of(scene)
    if is_round(scene) or scene.engine.casing.kind == "rigid":
        return casing  # the trace of a rigid casing has its shape
    highest = int(max([0, *held.orders, *let_go.orders]))
    wall = np.zeros((len(time), max(casing.shape[1], highest + 1), 2))
    wall[:, : casing.shape[1]] += casing
    rise, release = (
        scene.engine.casing.profile_rise,
        scene.engine.casing.profile_release,
    )
    grown = np.ones(len(time))
    if rise > 0.0:  # as `dynamics.kernels.shape.faded`
        grown = 0.5 * (1.0 - np.cos(np.pi * np.minimum(time / rise, 1.0)))
    free = time > release if release > 0.0 else np.zeros(len(time), bool)
    parts = _parts(held, wall, grown), _parts(let_go, wall, grown)
    return np.asarray(wall + np.where(free[:, None, None], parts[1], parts[0]))


def _parts(shape: Shape, wall: Floats, grown: Floats) -> Floats:
    """Return the harmonics of a shape at n times, as an array like `wall`.

    grown : (n,), share of its full size that the shape has reached
    """
    out = np.zeros_like(wall)
    both = np.stack([shape.cosine, shape.sine], axis=1)
    out[:, shape.orders] = grown[:, None, None] * both
    return out


def _forces(time: Floats, impulse: Floats, chosen: NDArray[np.intp]) -> Floats:
    """Return the mean force on each blade before each frame, (n, N), N.

    Parameters
    ----------
    time, impulse : (m,), s; (m, N), N s, cumulative, of all samples
    chosen : (n,), numbers of the samples that are frames
    """
    stride = int(chosen[1] - chosen[0]) if len(chosen) > 1 else 1
    before = np.maximum(chosen - stride, 0)
    lasts = np.maximum(time[chosen] - time[before], time[0])
    return np.asarray((impulse[chosen] - impulse[before]) / lasts[:, None])
