"""Choice of the modes of rotor and ring, by an estimated error without the others.

For the estimate, a blade's tip and the ring near it are struck by unit impulses. The
tip's radial motion then is

r(t) = sum_m g_m e^{-xi_m w_m t} sin(w_d t) / w_d,

with g_m the squared radial shape of each mode; its tangential motion s(t) has the same
form, driven by friction with a force mu times as large; the ring's motion is c(t). The
error (dr, ds, dc) of a truncated body over a window of first contacts is its difference
from the motion with all modes: `FINEST_FAMILIES` fixed-interface modes per blade of the
rotor, `FINEST` harmonics of the ring. The window is `WINDOW` periods in which blades
bend, 2 ms of the default engine, so that an engine in other units, or larger, with all
times longer by the same factor, gets the same modes. With |.| the norm over the window,
three parts count:

Rotor, |(dr, f ds)| / |(r, f s)|, f = c mu: relative to the tip's motion itself. Without
friction blades only stretch, and the error is that of their whole motion. With friction
they also bend, slowly, so that strikes add up in bending but not in stretching, in
which a blade vibrates many times between two strikes: c = `ADDED_UP`. A casing without
lobes touches all blades at once and few times: c = 1.

Ring, |dc| / |r + c|: the relative error of the contact force, and so of the end of the
contact and of each later contact. The bounces of a tip that only stretches depend on
nothing else: the factor is `STRETCHED` if |r| is all of the motion, `BENT` if |r| is a
small part of it, or if the shaft's centre (k = 1) or the whole ring (k = 0) moves
slowly with the tip.

Load, |dp| / |p|: p(t) is the motion of the ring's k lobes due to the pulse alone,
before any contact. A short pulse on one lobe stretches the ring in addition to moving
it, and a ring that cannot stretch is late at its first contact: the factor is `LOADED`.
This error is independent of those after a strike, so that the squares are added.

With equal blades and a load on k lobes, motions are unchanged by a rotation of 2 pi /
g, g = gcd(k, N): only nodal diameters and harmonics that are multiples of g are struck.
The factors are not below the 95 % quantiles of the ratio of the errors of motions to
these differences, over 230 random engines; scripts/evidence/estimates.py checks them on
others.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.arrays import Floats
from hpcwhirl.reduction.bodies import casing_model, file_model, rotor_model, tip_rows
from hpcwhirl.reduction.model import has_families
from hpcwhirl.reduction.modes import ModalModel
from hpcwhirl.reduction.numbers import one_thread
from hpcwhirl.reduction.round_casing import casing_table
from hpcwhirl.scene import Casing, Rotor, Scene, apply_settings, content_digest
from hpcwhirl.scene.input_names import Value
from hpcwhirl.structure import FourierOperator, bladed_disk

FINEST = 160  # harmonics of the reference ring
FINEST_FAMILIES = 8  # fixed-interface modes per blade of the reference rotor
WINDOW = 0.087  # time after a strike in which motions are compared / `_period`
FREE = 1e-6  # ratio of a mode's omega to the largest below which it counts as free
TIMES = 200  # number of samples in the window
ADDED_UP = 2.0  # weight of bending against stretching, since strikes add up in it
OF_ROTOR = 2.2  # factor on the rotor's part, to give the error of motions
BENT, STRETCHED = 10.0, 45.0  # factors on the ring's part, see the docstring
LOADED = 5.0  # factor on the load's part
OVERDAMPED = 0.999  # largest damping ratio used; larger ones count as this one
TO_ROTOR = 2 / 3  # share of the allowed error that the rotor may take
HARMONICS = (4, 6, 8, 12, 20, 40, 80, FINEST)


class Missed(NamedTuple):
    """Estimated relative errors of a motion due to modes that are left out.

    Attributes
    ----------
    rotor, ring : error after a strike, due to modes left out of each body
    load : error under the pulse, due to modes left out of the ring
    """

    rotor: float
    ring: float
    load: float

    @property
    def error(self) -> float:
        """Estimated relative error of the whole motion."""
        return math.hypot(self.rotor + self.ring, self.load)


def struck(
    body: ModalModel, weights: Floats, chosen: NDArray[np.bool_], window: float
) -> Floats:
    """Return n motions, (n, TIMES), m, of a body struck by a unit impulse, 1 N s.

    They are sampled at `TIMES` times, to `window` after the impulse.

    Parameters
    ----------
    body : the body, with m modes
    weights : (n, m), 1/kg, for each motion the product of the modal shapes where the
        impulse acts and where the motion is observed
    chosen : (m,), whether a mode takes part in the motions
    window : s
    """
    times = window * np.arange(1, TIMES + 1) / TIMES
    omega = np.maximum(body.omega[chosen], 1e-3 / window)  # free modes: w near 0
    ratio = np.minimum(body.ratios[chosen], OVERDAMPED)
    swing = omega * np.sqrt(1.0 - ratio**2)
    shapes = np.exp(-np.outer(ratio * omega, times)) * np.sin(np.outer(swing, times))
    return np.asarray((weights[:, chosen] / swing) @ shapes)


class Wheel(NamedTuple):
    """A rotor given by inputs, or by an engine file.

    Attributes
    ----------
    rotor : inputs of the rotor
    file, content : path of the engine file, and SHA-256 of its content; "": no file
    """

    rotor: Rotor
    file: str
    content: str

    def casing(self, casing: Casing) -> tuple[str, str]:
        """Return (path, SHA-256) of the engine file if the casing is read from it, too.

        For any other casing, return ("", "").
        """
        return (
            (self.file, self.content) if casing.discretization == "file" else ("", "")
        )

    @property
    def blades(self) -> int:
        """Number of blades, N."""
        return self.rotor.blades

    def model(self, modes: int) -> ModalModel:
        """Return the reduced rotor with `modes` fixed-interface modes.

        A rotor from file that has no matrices is returned as it is.
        """
        if self.file:
            return file_model(self.file, self.content, self.rotor, modes)
        return rotor_model(self.rotor, modes)


class Place(NamedTuple):
    """Where and for how long a ring moves.

    Attributes
    ----------
    radius : of the ring, m
    source : (path, SHA-256) of the file that gives the ring, or ("", "")
    window : time in which motions are compared, s
    """

    radius: float
    source: tuple[str, str]
    window: float


def _place(wheel: Wheel, casing: Casing) -> Place:
    """Return the place of a casing around a rotor.

    The ring's radius is larger by the gap, which does not matter here.
    """
    return Place(wheel.rotor.radius, wheel.casing(casing), _window(wheel))


def _wheel(scene: Scene) -> Wheel:
    file = scene.engine.file
    return Wheel(scene.engine.rotor, file, content_digest(file))


@lru_cache(maxsize=64)
def _most_modes(wheel: Wheel) -> int:
    """Return the number of fixed-interface modes of the rotor taken as the reference.

    These are all modes, but at most `FINEST_FAMILIES` for each of the N blades.
    """
    rotor, most = wheel.rotor, FINEST_FAMILIES * wheel.blades
    if wheel.file:
        return min(most, file_model(wheel.file, wheel.content, rotor).kept)
    inner = len(bladed_disk(rotor).mass) - 2 * rotor.blades
    inner -= 2 if rotor.centre == "free" else 0
    return min(most, inner)


@lru_cache(maxsize=64)
def _window(wheel: Wheel) -> float:
    """Return the time after a strike, s, in which motions are compared."""
    return WINDOW * _period(wheel.model(_most_modes(wheel)), wheel.blades)


def _period(body: ModalModel, blades: int) -> float:
    """Return the period, s, in which the tips of a rotor bend.

    It is the mean over its modes, each counted by its share of the tangential
    compliance of the tips; modes without stiffness (`FREE`) do not count.

    body, blades : modes of the rotor; N, the number of its blades
    """
    along = np.linalg.norm(tip_rows(body, blades)[1], axis=0)
    bends = (body.omega > FREE * body.omega.max()) & (along > 0.0)
    if not bends.any():  # tips move in proportion to time: any window is as good
        return 1.0
    omega, reach = body.omega[bends], along[bends] / body.omega[bends]
    shares = (reach / reach.max()) ** 2  # no overflow
    return float(2.0 * math.pi * (shares / omega).sum() / shares.sum())


@lru_cache(maxsize=512)
def _tip(wheel: Wheel, modes: int, folds: int) -> Floats:
    """Return the motion of a tip after a unit impulse, (2, TIMES), m.

    Row 0 is radial, by a radial impulse, row 1 tangential, by a tangential one.

    wheel, modes : the rotor, and the number of its fixed-interface modes
    folds : g; only nodal diameters that it divides are struck
    """
    body = wheel.model(modes)
    weights = [folds * (rows**2).mean(axis=0) for rows in tip_rows(body, wheel.blades)]
    chosen = body.diameter % folds == 0
    return struck(body, np.array(weights), chosen, _window(wheel))


@lru_cache(maxsize=1024)
def _ring(casing: Casing, place: Place, folds: int) -> Floats:
    """Return the radial motion of a ring where a unit impulse strikes it, (TIMES,), m.

    It is 0 for a rigid casing.

    place : radius and file of the ring, and the window
    folds : g; only harmonics that it divides are struck
    """
    if casing.kind == "rigid":
        return np.zeros(TIMES)
    body, operator = casing_model(casing, place.radius, place.source)
    if not isinstance(operator, FourierOperator):
        raise TypeError(casing.discretization)
    waves = body.shapes[operator.radial]
    weights = folds * (waves[0] ** 2 + 0.5 * (waves[1:] ** 2).sum(axis=0))
    chosen = body.diameter % folds == 0
    return np.asarray(struck(body, weights[None], chosen, place.window)[0])


def truncation_error(scene: Scene) -> float:
    """Return the estimated relative error of motions due to the modes left out.

    Parameters
    ----------
    scene : a scene of equal sectors, whose casing is no ring of elements
    """
    return left_out(scene).error


def left_out(scene: Scene) -> Missed:
    """Return the estimated errors due to modes left out of the rotor and of the ring.

    Parameters
    ----------
    scene : a scene of equal sectors, whose casing is no ring of elements
    """
    casing, modes = scene.engine.casing, scene.solver.modes
    return _missed(_wheel(scene), casing, modes, Load.of(scene))


class Load(NamedTuple):
    """The loads on which the estimate depends: pulse and friction.

    Attributes
    ----------
    lobes, pulse : number of lobes of the pulse, and its duration, s
    friction : coefficient of friction
    """

    lobes: int
    pulse: float
    friction: float

    @classmethod
    def of(cls, scene: Scene) -> Load:
        """Return the loads of a scene; a pulse without force lasts for ever."""
        pulse = scene.pulse if scene.force else math.inf
        return cls(scene.nodal_diameter, pulse, scene.coefficient)


@lru_cache(maxsize=1024)
def _pushed(casing: Casing, place: Place, lobes: int, pulse: float) -> Floats:
    """Return the motion of a ring's crest under a pulse of 1 N s, (TIMES,), m.

    A crest is where a lobe of the pulse is strongest; there is no contact.

    place : radius and file of the ring, and the window
    lobes, pulse : number of lobes of the pulse, and its duration, s
    """
    body, operator = casing_model(casing, place.radius, place.source)
    if not isinstance(operator, FourierOperator):
        raise TypeError(casing.discretization)
    modes = (body.diameter == lobes) & (body.phase == 0)
    crest = body.shapes[operator.radial[max(2 * lobes - 1, 0)]]
    times = place.window * np.arange(1, TIMES + 1) / TIMES
    # impulse until each sample, 1 in all: a pulse may end before the first sample
    impulse = np.sin(0.5 * math.pi * np.minimum(times, pulse) / pulse) ** 2
    force = np.diff(impulse, prepend=0.0)
    swung = struck(body, crest[None] ** 2, modes, place.window)[0]
    return np.asarray(np.convolve(force, swung)[:TIMES])


def _share(part: Floats, whole: Floats, weight: float = 1.0) -> float:
    """Return weight |part| / |whole| of two motions, |.| the norm over time.

    It is 0 if both motions are 0, for a body too stiff or too heavy to move. Nothing
    overflows.

    part, whole : motions over time, m
    """
    if not (part.any() or whole.any()):
        return 0.0
    power = -np.frexp(np.abs(whole).max())[1]  # exact, and squares are in range then
    sizes = [np.linalg.norm(np.ldexp(motion, power)) for motion in (part, whole)]
    return float(weight * sizes[0] / sizes[1]) if sizes[1] else math.inf


def _of_load(casing: Casing, whole: Casing, wheel: Wheel, load: Load) -> float:
    """Return the relative error of a casing's motion under the pulse, without contact.

    It is due to the harmonics left out of the casing.

    casing, whole : the casing with and without harmonics left out
    wheel, load : the rotor, of which radius and window are used; the pulse
    """
    absent = casing.kind == "rigid" or math.isinf(load.pulse)
    if absent or load.lobes > casing.harmonics:  # too many lobes are refused later
        return 0.0
    under = _place(wheel, casing), load.lobes, load.pulse
    every = _pushed(whole, *under)
    return LOADED * _share(_pushed(casing, *under) - every, every)


@lru_cache(maxsize=4096)
def _missed(wheel: Wheel, casing: Casing, modes: int, load: Load) -> Missed:
    lobes, place = load.lobes, _place(wheel, casing)
    folds = math.gcd(lobes, wheel.blades)
    pull = load.friction * (ADDED_UP if lobes else 1.0)
    every = {"harmonics": max(FINEST, casing.harmonics), "families": "all"}
    tip = _tip(wheel, _most_modes(wheel), folds)
    whole = casing.model_copy(update=every)
    ring = _ring(whole, place, folds)
    less = _tip(wheel, modes, folds) - tip
    lost = _ring(casing, place, folds)
    both = np.array([[1.0], [pull]])
    share = _share(tip[0], both * tip) if lobes > 1 else 0.0
    return Missed(
        _share(both * less, both * tip, OF_ROTOR),
        _share(lost - ring, ring + tip[0], BENT + (STRETCHED - BENT) * share),
        _of_load(casing, whole, wheel, load),
    )


@one_thread()
def with_truncation(scene: Scene) -> Scene:
    """Return the scene with the modes that its input `truncation` > 0 requires.

    The rotor gets the fewest families of fixed-interface modes with which its part of
    the estimate is at most `TO_ROTOR` of the allowed error. The ring gets the fewest
    harmonics with which the whole estimate is at most the allowed error, if possible
    without its stretching modes; if no number suffices, it gets the largest. A casing
    from file keeps all its harmonics.
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
    ]  # a ring must have the harmonic of the load
    fine = (ring for ring in rings if missed(ring, modes).error <= asked)
    return modes, next(fine, rings[-1])
