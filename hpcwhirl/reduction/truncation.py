"""What a reduced model leaves out of a contact: an estimate, and a choice by it.

A unit force between a blade's tip and the ring below it opens the gap; its mean over
the time t since it set in is, undamped,

C(t) = sum_m g_m (1 - sin(w_m t) / (w_m t)) / w_m^2,

g_m the radial shape squared of each mode of both bodies. Slow modes have not moved yet,
fast ones have settled to their static share. Likewise a tip gives way to friction, g_m
the tangential shape squared. What a truncated body makes of C up to the duration of the
pulse, at most `LONGEST`, is compared with what all of its modes make of it: of the
rotor `FINEST_FAMILIES` fixed-interface modes a blade, of the ring `FINEST` harmonics.
The estimate of the error is `SAFETY` times the sum of what both bodies miss; tests hold
it against the motion of random engines in their first contacts.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.reduction.bodies import casing_model, rotor_model, tip_rows
from hpcwhirl.scene import Casing, Rotor, Scene, apply_settings
from hpcwhirl.scene.files import Value
from hpcwhirl.structure import FourierOperator, bladed_disk

Floats = NDArray[np.float64]
FINEST = 160  # harmonics that stand for all
FINEST_FAMILIES = 8
LONGEST = 1e-3  # s: a contact lasts no longer than some such time, whatever the pulse
TIMES = 64  # at which responses are compared
SAFETY = 5.0  # error of motions in first contact over what is missed, in 19 of 20 cases
HARMONICS = (4, 6, 8, 12, 20, 40, 80, FINEST)


def opening(omega: Floats, weights: Floats, times: Floats) -> Floats:
    """Return C (n,), m/N, of modes w, g (m,), rad/s and 1/kg, at times (n,), s."""
    omega = np.maximum(omega, 1e-3 / times[-1])  # free: the limit w to 0
    settled = 1.0 - np.sinc(np.outer(times, omega) / np.pi)
    return np.asarray(settled / omega**2 @ weights)


@lru_cache(maxsize=64)
def _most_modes(rotor: Rotor) -> int:
    """Return the fixed-interface modes there are, at most `FINEST_FAMILIES` a blade."""
    inner = len(bladed_disk(rotor).mass) - 2 * rotor.blades
    inner -= 2 if rotor.centre == "free" else 0
    return min(FINEST_FAMILIES * rotor.blades, inner)


@lru_cache(maxsize=256)
def _rotor_weights(rotor: Rotor, modes: int) -> tuple[Floats, Floats, Floats]:
    """Return frequencies and weights of a tip, radial and tangential, each (m,)."""
    body = rotor_model(rotor, modes)
    radial, tangential = tip_rows(body, rotor.blades)
    return body.omega, (radial**2).mean(axis=0), (tangential**2).mean(axis=0)


@lru_cache(maxsize=1024)
def _ring_weights(casing: Casing, radius: float) -> tuple[Floats, Floats]:
    """Return frequencies and weights of the ring, each (m,); none of a rigid casing."""
    if casing.kind == "rigid":
        return np.zeros(0), np.zeros(0)
    body, operator = casing_model(casing, radius)
    if not isinstance(operator, FourierOperator):
        raise TypeError(casing.discretization)
    waves = body.shapes[operator.radial]
    return body.omega, waves[0] ** 2 + 0.5 * (waves[1:] ** 2).sum(axis=0)


def _times(pulse: float) -> Floats:
    return min(pulse, LONGEST) * np.arange(1, TIMES + 1) / TIMES


def truncation_error(scene: Scene) -> float:
    """Return the estimate of the relative error of motions by the modes left out.

    Parameters
    ----------
    scene : where `Scene.has_families`
    """
    return SAFETY * sum(left_out(scene))


def left_out(scene: Scene) -> tuple[float, float]:
    """Return the largest share of C at the pulse's end that each body misses.

    Parameters
    ----------
    scene : where `Scene.has_families`

    Returns
    -------
    shares : of the rotor's fixed-interface modes (of the opening or of what friction
        moves, whichever is more), and of the ring's modes
    """
    engine, solver = scene.engine, scene.solver
    case = engine.rotor, engine.casing, scene.gap, scene.pulse
    return _missed(*case, solver.modes)


@lru_cache(maxsize=4096)
def _missed(
    rotor: Rotor, casing: Casing, gap: float, pulse: float, modes: int
) -> tuple[float, float]:
    finest = max(FINEST, casing.harmonics)
    finer = casing.model_copy(update={"harmonics": finest, "families": "all"})
    radius, times = rotor.radius + gap, _times(pulse)
    opened, dragged = [], []
    for count in (modes, _most_modes(rotor)):
        omega, radial, tangential = _rotor_weights(rotor, count)
        opened.append(opening(omega, radial, times))
        dragged.append(opening(omega, tangential, times))
    rings = [opening(*_ring_weights(c, radius), times) for c in (casing, finer)]
    total = opened[1][-1] + rings[1][-1]
    of_rotor = max(
        np.abs(opened[0] - opened[1]).max() / total,
        np.abs(dragged[0] - dragged[1]).max() / dragged[1][-1],
    )
    return float(of_rotor), float(np.abs(rings[0] - rings[1]).max() / total)


def with_truncation(scene: Scene) -> Scene:
    """Return the scene with the modes that its truncation asks for, if it asks.

    The fewest families a blade, and the fewest harmonics, without those modes that
    stretch the ring if that is enough, whose parts of the estimate are at most half of
    it each; where none is enough, the finest.
    """
    share, engine = 0.5 * scene.solver.truncation / SAFETY, scene.engine
    if share == 0.0 or not scene.has_families:
        return scene
    rest, lobes = (scene.gap, scene.pulse), scene.nodal_diameter
    modes, casing = _chosen(engine.rotor, engine.casing, *rest, lobes, share)
    chosen: dict[str, Value] = {
        "solver.modes": modes,
        "casing.harmonics": casing.harmonics,
        "casing.families": casing.families,
    }
    return apply_settings(scene, chosen)


@lru_cache(maxsize=4096)
def _chosen(
    rotor: Rotor, casing: Casing, gap: float, pulse: float, lobes: int, share: float
) -> tuple[int, Casing]:
    body, most = (rotor, casing, gap, pulse), _most_modes(rotor)
    counts = range(0, most, rotor.blades)
    modes = next((n for n in counts if _missed(*body, n)[0] <= share), most)
    if casing.kind == "rigid":
        return modes, casing
    rings = [
        casing.model_copy(update={"harmonics": harmonics, "families": families})
        for harmonics in [h for h in HARMONICS if h >= lobes] or [lobes]
        for families in ("bending", "all")
    ]  # the load must be carried
    fine = (r for r in rings if _missed(rotor, r, gap, pulse, most)[1] <= share)
    return modes, next(fine, rings[-1])
