"""Choice for `rotation = "auto"`: whether a case needs the terms of rotation.

It depends on how much they change the free waves of the rotor. All terms are used or
none, since softening alone makes blades unstable.

A free centre needs these terms at any speed: its orbit is fixed in the static frame,
but without Coriolis forces would turn with the rotor, once per revolution. Even if
equal blades and the load's lobes leave the centre at rest, round-off may move it in a
long contact. With a clamped centre, each free wave is e^{i k theta + s t}, and the
choice depends on the largest

|s_full - s_none| / |s_none|

at the case's speed, with s_full the root with the terms and s_none without, over the
waves that matter to the tips: those whose mode has at least `SEEN` of the largest
compliance of the tips. The paper's critical speeds (Eq. 13) shift with their waves, and
`gap` is the clearance at speed with either choice. A part of the difference comes from
the bases of the two models, which differ, too.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.reduction import waves
from hpcwhirl.reduction.bodies import tip_rows
from hpcwhirl.reduction.model import Model, model_of
from hpcwhirl.reduction.modes import ModalModel, has_centre
from hpcwhirl.scene import Scene, apply_settings
from hpcwhirl.scene.rules import STANDING, WHOLE

LEFT_OUT = 0.01  # largest relative change of a wave at which the terms are left out
FREE = "a free centre"
SEEN = 1e-2  # least modal compliance of a wave that counts, relative to the largest
MOST_KEPT = 256  # number of cached estimates
Pair = tuple[str, complex, complex]  # name of a wave, its s or conj(s) in both models


class Change(NamedTuple):
    """The free wave of a rotor that the terms of rotation change most, and by how much.

    Attributes
    ----------
    share : |s_full - s_none| / |s_none|, s the root of the wave with and without terms
    wave : name of the wave, such as "1F of k = 1"
    none, full : its frequency without and with the terms, rad/s, rotating frame; > 0:
        turns with the rotation
    """

    share: float
    wave: str
    none: float
    full: float


class Choice(NamedTuple):
    """What rotation "auto" means for a case, "none" or "full", and why.

    Attributes
    ----------
    rotation : "none" or "full"
    needed : what requires full: an input or a free centre (`FREE`); "" if the change of
        waves decides
    change : that change; None if it does not decide
    limit : largest relative change at which the terms of rotation are left out
    """

    rotation: str
    needed: str
    change: Change | None
    limit: float

    @property
    def told(self) -> str:
        """The choice and its reason, as a sentence."""
        if self.change is None:
            return f"rotation auto: {self.rotation}, which {self.needed} needs"
        change, beyond = self.change, "beyond" if self.rotation == "full" else "within"
        return (
            f"rotation auto: {self.rotation}; its terms change {change.wave} most, "
            f"by {100 * change.share:.2g} %, {beyond} {100 * self.limit:.2g} %: from "
            f"{change.none:.1f} to {change.full:.1f} rad/s in the rotating frame"
        )


def needing(scene: Scene) -> str:
    """Return what makes a scene need `rotation = "full"`; "": nothing.

    It is the name of an input, or `FREE`, a free centre.
    """
    rotor = scene.engine.rotor
    usual = {**dict.fromkeys(STANDING, 0.0), **dict(WHOLE)}
    own = [name for name, value in usual.items() if getattr(rotor, name) != value]
    own += [name for name in ("unbalance", "gravity") if getattr(scene, name) != 0.0]
    if scene.gap_at != "speed":
        own.append("gap_at")
    if own:
        return own[0]
    model = model_of(_turned(scene, "full"))
    return FREE if has_centre(model.rotor, model.blades) else ""


def choice_of(scene: Scene) -> Choice:
    """Return what rotation "auto" means for a scene, "none" or "full", and why.

    The terms of rotation are left out ("none") if they change frequency and decay of
    no wave that moves the tips by more than the result's `limit`: `LEFT_OUT`, or
    `solver.accuracy` if that is smaller.

    Raises
    ------
    InputError
        if full is needed, and a rotor from file has no terms of rotation
    """
    limit = min(scene.solver.accuracy or LEFT_OUT, LEFT_OUT)
    needed = needing(scene)
    if needed:
        return Choice("full", needed, None, limit)
    change = change_of(scene)
    return Choice("full" if change.share > limit else "none", "", change, limit)


def change_of(scene: Scene) -> Change:
    """Return the wave that the terms of rotation change most in a scene.

    Unlike `choice_of`, it ignores whether inputs or a free centre require these terms.
    """
    rest, turning = (model_of(_turned(scene, name)) for name in ("none", "full"))
    return _change(rest, turning, scene.speed)


def _turned(scene: Scene, rotation: str) -> Scene:
    return apply_settings(scene, {"engine.rotation": rotation})


def with_rotation(scene: Scene) -> Scene:
    """Return the scene with rotation "auto" replaced by "none" or "full"."""
    if scene.engine.rotation != "auto":
        return scene
    return apply_settings(scene, {"engine.rotation": choice_of(scene).rotation})


@lru_cache(maxsize=MOST_KEPT)
def _change(rest: Model, turning: Model, speed: float) -> Change:
    """Return the wave that differs most between two models of a scene.

    Parameters
    ----------
    rest, turning : models without and with the terms of rotation
    speed : Omega, rad/s
    """
    own, blades = turning.rotor, turning.blades
    if own.spin and own.spin.waves and rest.rotor.cyclic:
        pairs = _by_diameter(rest.rotor, own, blades, speed)
    else:
        pairs = _of_whole(rest.rotor, own, blades, speed)
    changes = (
        Change(abs(full - none) / abs(none), name, none.imag, full.imag)
        for name, none, full in pairs
    )
    return max(changes, key=lambda change: change.share)


def _seen(body: ModalModel, blades: int) -> NDArray[np.bool_]:
    """Return, for each of a rotor's m modes, whether it moves the tips enough, (m,).

    Its modal compliance must be at least `SEEN` of the largest one.

    body, blades : modes of the rotor; N, the number of its blades
    """
    free = np.maximum(body.omega, np.finfo(float).tiny)
    moved = sum((rows**2).sum(axis=0) for rows in tip_rows(body, blades))
    gives = np.asarray(moved) / free**2
    return np.asarray(gives >= SEEN * gives.max())


def _by_diameter(
    rest: ModalModel, turning: ModalModel, blades: int, speed: float
) -> Iterator[Pair]:
    """Yield (name, root without, root with terms of rotation) of each wave.

    The root of a wave is the s, 1/s, of its free motion e^{s t}.

    The rotor has equal sectors; only waves that matter to the tips are compared. The
    sorted frequencies of a nodal diameter keep their order at all speeds, so that the
    r-th from the middle outwards is the same wave in both models, even if one has more
    modes.

    rest, turning : modes of the rotor without and with these terms; speed : Omega
    """
    seen = _seen(rest, blades)
    bodies = rest, turning
    before, after = (_grouped(waves.wave_lines(body, blades, speed)) for body in bodies)
    for k in range(blades // 2 + 1):
        ranks = rest.rank[seen & (rest.diameter == k)]
        for rank in range(int(ranks.max(initial=-1)) + 1):
            for line, other in zip(
                _middle(before[k], rank, k), _middle(after[k], rank, k), strict=True
            ):
                yield f"{line.family} of k = {k}", _turning(line), _turning(other)


def _grouped(lines: list[waves.WaveLine]) -> dict[int, list[waves.WaveLine]]:
    out: dict[int, list[waves.WaveLine]] = {}
    for line in lines:
        out.setdefault(line.nodal_diameter, []).append(line)
    return out


def _middle(lines: list[waves.WaveLine], rank: int, k: int) -> list[waves.WaveLine]:
    """Return the waves of one rank: for k > 0 a backward and a forward one, else one.

    lines : waves of nodal diameter k, sorted by frequency, the backward ones first
    rank : number of the pair, outward from the middle; for k = 0 number of the wave
    """
    half = len(lines) // 2
    return [lines[rank]] if k == 0 else [lines[half - 1 - rank], lines[half + rank]]


def _turning(line: waves.WaveLine) -> complex:
    return complex(line.growth, line.rotating)


def _of_whole(
    rest: ModalModel, turning: ModalModel, blades: int, speed: float
) -> Iterator[Pair]:
    """Yield (name, root without, root with terms of rotation) of each mode.

    The root of a mode is the s, 1/s, of its free motion e^{s t}. The function is for
    unequal sectors, whose modes have no nodal diameter and are paired by frequency.

    rest, turning : modes of the rotor without and with these terms; speed : Omega
    """
    count = int(np.flatnonzero(_seen(rest, blades)).max()) + 1
    gyro, damping, stiffness, push = waves.turning_matrices(turning, speed, blades)
    shapes = turning.shapes
    rates, whole = (
        shapes.T @ matrix @ shapes for matrix in (gyro + damping, stiffness + push)
    )
    roots = waves.quadratic_roots(rates, whole)
    roots = np.sort_complex(-1j * roots[roots.imag > 0.0])
    ratios, omega = rest.ratios[:count], rest.omega[:count]
    swing = np.sqrt(np.maximum(1.0 - ratios**2, 0.0))
    for place, (none, full) in enumerate(
        zip(omega * (swing + 1j * ratios), roots, strict=False)
    ):
        yield f"mode {place + 1}", 1j * none, 1j * full
