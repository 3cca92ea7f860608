"""What a reduced model leaves out of a contact: an estimate, and a choice by it.

A blade's tip and the ring below it are struck by unit impulses. The tip's radial motion
then is

r(t) = sum_m g_m e^{-xi_m w_m t} sin(w_d t) / w_d,

g_m the radial shape squared of each mode; its tangential motion s(t) alike, pulled by
friction mu times as hard; and the ring's c(t). What of them a truncated body misses,
over the `WINDOW` of first contacts, is compared with what all modes make: of the rotor
`FINEST_FAMILIES` fixed-interface modes a blade, of the ring `FINEST` harmonics. With
|.| the norm over the window and d what is missed,

of the rotor |(dr, f ds)| / |(r, f s)|: of that motion itself, f = c mu. Without
friction blades do no more than stretch, and what is left out of that is left out of all
there is; with it they bend, slowly, and so strikes add up in bending while they do not
in stretching, in which a blade swings many times between two: c = `ADDED_UP`. A casing
without lobes touches all blades at once and few times: c = 1.

of the ring |dc| / |r + c|: the contact's force is wrong by as much, and with it when
it ends, and so each following contact. A tip that only stretches is thrown from contact
to contact by nothing else: this counts `STRETCHED` times where |r| is all of the
motion, `BENT` times where it is little of it, or where the shaft's centre (k = 1) or
all of the ring at once (k = 0) moves slowly with it.

of the load |dp| / |p|: p(t) is what the pulse alone makes of the ring's k lobes before
anything touches. A short pulse on one lobe stretches the ring beside moving it, and a
ring that cannot stretch comes late to its first contact: this counts `LOADED` times. It
is no part of the motion after a strike: both are added as squares.

Equal blades and a load on k lobes move alike after a turn by 1/g, g = gcd(k, N): only
nodal diameters and harmonics that are multiples of g are struck. The factors are at or
above the 95 % quantiles of motions' errors over what is missed, over 230 drawn engines;
others, drawn since, are counted by scripts/evidence/estimates.py.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.reduction.bodies import (
    casing_model,
    file_model,
    rotor_model,
    tip_rows,
)
from hpcwhirl.reduction.model import has_families
from hpcwhirl.reduction.modes import ModalModel
from hpcwhirl.reduction.round_casing import casing_table
from hpcwhirl.scene import Casing, Rotor, Scene, apply_settings, content_digest
from hpcwhirl.scene.files import Value
from hpcwhirl.structure import FourierOperator, bladed_disk

Floats = NDArray[np.float64]
FINEST = 160  # harmonics that stand for all
FINEST_FAMILIES = 8
WINDOW = 2e-3  # s
TIMES = 200  # at which motions are compared
ADDED_UP = 2.0  # how much more strikes add up in bending than in stretching
OF_ROTOR = 2.2  # error of motions over what the rotor misses, in 19 of 20 cases
BENT, STRETCHED = 10.0, 45.0  # and over what the ring does: see above
LOADED = 5.0  # and over what the pulse makes of it
OVERDAMPED = 0.999  # ratio of modes that do not swing: they are taken as this
TO_ROTOR = 2 / 3  # of what is asked
HARMONICS = (4, 6, 8, 12, 20, 40, 80, FINEST)


class Missed(NamedTuple):
    """Errors of motions by what modes leave out, shares of the motion.

    Attributes
    ----------
    rotor, ring : by each body, of what a strike makes
    load : by the ring, of what the pulse makes
    """

    rotor: float
    ring: float
    load: float

    @property
    def error(self) -> float:
        """Of the motion as a whole."""
        return math.hypot(self.rotor + self.ring, self.load)


def struck(body: ModalModel, weights: Floats, chosen: NDArray[np.bool_]) -> Floats:
    """Return motions (n, TIMES), m, after a unit impulse, by modes.

    Parameters
    ----------
    body : m modes
    weights : (n, m), 1/kg, of each motion
    chosen : (m,), modes that move
    """
    times = WINDOW * np.arange(1, TIMES + 1) / TIMES
    omega = np.maximum(body.omega[chosen], 1e-3 / WINDOW)  # free: the limit w to 0
    ratio = np.minimum(body.ratios[chosen], OVERDAMPED)
    swing = omega * np.sqrt(1.0 - ratio**2)
    shapes = np.exp(-np.outer(ratio * omega, times)) * np.sin(np.outer(swing, times))
    return np.asarray((weights[:, chosen] / swing) @ shapes)


class Wheel(NamedTuple):
    """A rotor: of sections or, where there is a file, of its content."""

    rotor: Rotor
    file: str
    content: str

    def casing(self, casing: Casing) -> tuple[str, str]:
        """Return file and content of a casing that is from there."""
        return (
            (self.file, self.content) if casing.discretization == "file" else ("", "")
        )

    @property
    def blades(self) -> int:
        """N."""
        return self.rotor.blades

    def model(self, modes: int) -> ModalModel:
        """Return it with so many fixed-interface modes; modes alone are as they are."""
        if self.file:
            return file_model(self.file, self.content, self.rotor, modes)
        return rotor_model(self.rotor, modes)


def _wheel(scene: Scene) -> Wheel:
    file = scene.engine.file
    return Wheel(scene.engine.rotor, file, content_digest(file))


@lru_cache(maxsize=64)
def _most_modes(wheel: Wheel) -> int:
    """Return the fixed-interface modes there are, at most `FINEST_FAMILIES` a blade."""
    rotor, most = wheel.rotor, FINEST_FAMILIES * wheel.blades
    if wheel.file:
        return min(most, file_model(wheel.file, wheel.content, rotor).kept)
    inner = len(bladed_disk(rotor).mass) - 2 * rotor.blades
    inner -= 2 if rotor.centre == "free" else 0
    return min(most, inner)


@lru_cache(maxsize=512)
def _tip(wheel: Wheel, modes: int, folds: int) -> Floats:
    """Return a struck tip's motion (2, TIMES), radial and tangential."""
    body = wheel.model(modes)
    weights = [folds * (rows**2).mean(axis=0) for rows in tip_rows(body, wheel.blades)]
    return struck(body, np.array(weights), body.diameter % folds == 0)


@lru_cache(maxsize=1024)
def _ring(casing: Casing, radius: float, folds: int, source: tuple[str, str]) -> Floats:
    """Return a struck ring's motion (TIMES,); none of a rigid casing."""
    if casing.kind == "rigid":
        return np.zeros(TIMES)
    body, operator = casing_model(casing, radius, source)
    if not isinstance(operator, FourierOperator):
        raise TypeError(casing.discretization)
    waves = body.shapes[operator.radial]
    weights = folds * (waves[0] ** 2 + 0.5 * (waves[1:] ** 2).sum(axis=0))
    return np.asarray(struck(body, weights[None], body.diameter % folds == 0)[0])


def truncation_error(scene: Scene) -> float:
    """Return the estimate of the relative error of motions by the modes left out.

    Parameters
    ----------
    scene : where `has_families`
    """
    return left_out(scene).error


def left_out(scene: Scene) -> Missed:
    """Return the estimate's parts, by what each body misses.

    Parameters
    ----------
    scene : where `has_families`
    """
    casing, modes = scene.engine.casing, scene.solver.modes
    return _missed(_wheel(scene), casing, modes, Load.of(scene))


class Load(NamedTuple):
    """What strikes: the lobes of the load, how long it lasts (s), and friction."""

    lobes: int
    pulse: float
    friction: float

    @classmethod
    def of(cls, scene: Scene) -> Load:
        """Return the load of a scene; of none, that which lasts for ever."""
        pulse = scene.pulse if scene.force else math.inf
        return cls(scene.nodal_diameter, pulse, scene.friction)


@lru_cache(maxsize=1024)
def _pushed(
    casing: Casing, radius: float, source: tuple[str, str], lobes: int, pulse: float
) -> Floats:
    """Return the motion (TIMES,) of a crest of the ring under a pulse of unit force."""
    body, operator = casing_model(casing, radius, source)
    if not isinstance(operator, FourierOperator):
        raise TypeError(casing.discretization)
    own = (body.diameter == lobes) & (body.phase == 0)
    crest = body.shapes[operator.radial[max(2 * lobes - 1, 0)]]
    times = WINDOW * np.arange(1, TIMES + 1) / TIMES
    # what the pulse has given so far, of 1: it may be shorter than the time between
    given = np.sin(0.5 * math.pi * np.minimum(times, pulse) / pulse) ** 2
    force = np.diff(given, prepend=0.0)
    swung = struck(body, crest[None] ** 2, own)[0]
    return np.asarray(np.convolve(force, swung)[:TIMES])


def _share(part: Floats, whole: Floats, weight: float = 1.0) -> float:
    """Return weight |part| / |whole|, however small or large both are.

    Of what does not move at all, too stiff or too heavy, nothing is left out.
    """
    if not (part.any() or whole.any()):
        return 0.0
    power = -np.frexp(np.abs(whole).max())[1]  # exact, and squares are in range then
    sizes = [np.linalg.norm(np.ldexp(motion, power)) for motion in (part, whole)]
    return float(weight * sizes[0] / sizes[1]) if sizes[1] else math.inf


def _of_load(casing: Casing, whole: Casing, wheel: Wheel, load: Load) -> float:
    """Return what a casing leaves out of the ring's motion under the load."""
    absent = casing.kind == "rigid" or math.isinf(load.pulse)
    if absent or load.lobes > casing.harmonics:  # which no run is begun with
        return 0.0
    place = wheel.rotor.radius, wheel.casing(casing), load.lobes, load.pulse
    every = _pushed(whole, *place)
    return LOADED * _share(_pushed(casing, *place) - every, every)


@lru_cache(maxsize=4096)
def _missed(wheel: Wheel, casing: Casing, modes: int, load: Load) -> Missed:
    lobes, radius = load.lobes, wheel.rotor.radius
    folds, source = math.gcd(lobes, wheel.blades), wheel.casing(casing)
    pull = load.friction * (ADDED_UP if lobes else 1.0)
    every = {"harmonics": max(FINEST, casing.harmonics), "families": "all"}
    tip = _tip(wheel, _most_modes(wheel), folds)
    # the ring's radius is a gap larger: of no account here
    whole = casing.model_copy(update=every)
    ring = _ring(whole, radius, folds, source)
    less = _tip(wheel, modes, folds) - tip
    lost = _ring(casing, radius, folds, source)
    both = np.array([[1.0], [pull]])
    share = _share(tip[0], both * tip) if lobes > 1 else 0.0
    return Missed(
        _share(both * less, both * tip, OF_ROTOR),
        _share(lost - ring, ring + tip[0], BENT + (STRETCHED - BENT) * share),
        _of_load(casing, whole, wheel, load),
    )


def with_truncation(scene: Scene) -> Scene:
    """Return the scene with the modes that its truncation asks for, if it asks.

    The fewest families a blade whose part of the estimate is at most `TO_ROTOR` of it,
    and the fewest harmonics, without those modes that stretch the ring if that is
    enough, that what remains allows; where none is enough, the finest. Of a casing from
    file none are left out.
    """
    asked = scene.solver.truncation
    if asked == 0.0 or not has_families(scene):
        return scene
    load = Load.of(scene)
    modes, casing = _chosen(_wheel(scene), scene.engine.casing, load, asked)
    chosen: dict[str, Value] = {
        "solver.modes": modes,
        "casing.harmonics": casing.harmonics,
        "casing.families": casing.families,
    }
    return apply_settings(scene, chosen)


@lru_cache(maxsize=4096)
def _chosen(
    wheel: Wheel, casing: Casing, load: Load, asked: float
) -> tuple[int, Casing]:
    most = _most_modes(wheel)
    counts = range(0, most, wheel.blades)

    def missed(ring: Casing, modes: int) -> Missed:
        return _missed(wheel, ring, modes, load)

    few = (n for n in counts if missed(casing, n).rotor <= TO_ROTOR * asked)
    modes = next(few, most)
    if casing.kind == "rigid":
        return modes, casing
    if casing.discretization == "file":
        most = int(casing_table(wheel.file, wheel.content)["harmonic"].max())
        return modes, casing.model_copy(update={"harmonics": max(most, 1)})
    rings = [
        casing.model_copy(update={"harmonics": harmonics, "families": families})
        for harmonics in [h for h in HARMONICS if h >= load.lobes] or [load.lobes]
        for families in ("bending", "all")
    ]  # the load must be carried
    fine = (ring for ring in rings if missed(ring, modes).error <= asked)
    return modes, next(fine, rings[-1])
