"""The wheel in motion on the page: frames of some cases, as a few bytes each.

Displacements and forces have 16 bits, integer multiples of a fraction of the largest in
the case; gap and angle of the rotor are of single precision.
"""

from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from hpcwhirl.analysis.wheel_motion import NEEDED, Frames, frames_of
from hpcwhirl.arrays import Floats
from hpcwhirl.errors import InputError
from hpcwhirl.scene import Scene, apply_settings
from hpcwhirl.store.reading.results_file import Results
from hpcwhirl.store.reading.select import counting

MOST_FRAMES = 360
MOST_BYTES = 74_000  # of a case; as text in the page 4 / 3 of it, less than 100 kB
MOST_CASES = 4  # cases with motion if the user has named none
SCALE = 32767  # steps of a displacement or force
ORDER = (
    "divergent",
    "sustained",
    "undecided",
    "damped",
)  # words that get a case, in turn


def motions_of(results: Results, asked: Sequence[int] = ()) -> dict[int, Any]:
    """Return {case: its motion, as data for the page}.

    Parameters
    ----------
    results : results of a campaign
    asked : numbers of the cases to show, integrated again where full traces were not
        kept; none: a case of each word, of those with full traces

    Raises
    ------
    InputError
        if a case that was asked for cannot be shown
    """
    _check(results, asked)
    if not asked:
        return {case: _coded(frames, of) for case, frames, of in _kept(results)}
    return {case: _coded(*_of_case(results, case)) for case in dict.fromkeys(asked)}


def _check(results: Results, asked: Sequence[int]) -> None:
    """Raise InputError if a case that was asked for has no result."""
    finished = set(results.finished())
    for case in asked:
        if case not in finished:
            msg = f"--animate must be a finished case, 0 to {len(results) - 1}"
            raise InputError(f"{msg}, got {case}")


def _kept(results: Results) -> Iterable[tuple[int, Frames, Scene]]:
    """Yield case, frames and scene of one case of each word that kept full traces."""
    if not set(NEEDED) <= set(results.kept):
        return
    finished = np.zeros(len(results), bool)
    finished[results.finished()] = True
    for word in ORDER[:MOST_CASES]:
        cases = np.flatnonzero(finished & counting(results)
                               & (results["regime"] == word))  # fmt: skip
        for case in cases[len(cases) // 2 : len(cases) // 2 + 1].tolist():
            try:
                yield case, *_of_case(results, case, again=False)
            except InputError:
                continue  # the page has no motion of this word


def _of_case(
    results: Results, case: int, *, again: bool = True
) -> tuple[Frames, Scene]:
    """Return the frames of a case, and its scene.

    again : whether to integrate it again where full traces were not kept
    """
    scene = results.scene(case)
    if scene.output.traces == "full" and set(NEEDED) <= set(results.kept):
        row = {n: results[n][case] for n in ("regime", "tip_growth")}
        found = frames_of(scene, row, results.traces(case), _frames_for(scene))
        return found, scene
    if not again:
        raise InputError("full traces were not kept")
    from hpcwhirl.campaign.simulate import simulate

    scene = apply_settings(scene, {"output.traces": "full"})
    done = simulate(scene)
    return frames_of(scene, done.row, done.traces, _frames_for(scene)), scene


def _frames_for(scene: Scene) -> int:
    """Return the largest number of frames of a case."""
    casing = scene.engine.casing
    values = 2 + 3 * scene.engine.rotor.blades + 2 * (max(casing.harmonics, 64) + 1)
    return min(MOST_FRAMES, MOST_BYTES // (8 + 2 * values))


def _coded(frames: Frames, scene: Scene) -> dict[str, Any]:
    """Return the frames of a case as data for the page."""
    count, blades = frames.force.shape
    parts = frames.centre, frames.tips, frames.wall, frames.force
    scales, codes = zip(*map(_steps, parts), strict=True)
    heads = [
        a.astype("<f4").tobytes() for a in (frames.gap, frames.angle % (2 * np.pi))
    ]
    data = b"".join([*heads, *(c.tobytes() for c in codes)])
    rotor = scene.engine.rotor
    return {
        "frames": count, "blades": blades, "orders": frames.wall.shape[1],
        "lost": frames.lost, "start": float(frames.time[0]),
        "step": float(frames.time[1] - frames.time[0]) if count > 1 else 0.0,
        "radius": rotor.radius, "hub": rotor.disk_radius, "gap": scene.gap,
        "scale": frames.enlarged(), "scales": scales,
        "data": base64.b64encode(data).decode(),
    }  # fmt: skip


def _steps(values: Floats) -> tuple[float, Any]:
    """Return the largest number of an array, and its values in 1 / `SCALE` of that."""
    most = float(np.abs(values).max(initial=0.0))
    codes = np.rint(values * (SCALE / most)) if most > 0.0 else np.zeros_like(values)
    return most, codes.astype("<i2")
