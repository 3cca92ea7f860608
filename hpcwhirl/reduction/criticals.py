"""Critical speeds with damping, and the cross coupling at the limit of stability.

An unbalance turns with the rotor. It excites the waves of nodal diameter 1, which move
the centre, most where a free one turns as fast: |omega(Omega)| = Omega with omega = Im
s of the static frame. On supports that are equal in all directions only forward waves
count; on others a wave is an ellipse, and both senses do. With the damping of rotor and
supports these are the damped critical speeds, one for each wave that still oscillates;
`waves.unbalance_speeds` gives the undamped ones.

Q_0 is the cross-coupled stiffness at the centre, in addition to that of the supports,
at which the least stable wave neither grows nor decays, so that its logarithmic
decrement is 0 (API 617, 8th ed., part 1, 4.8.5). For a rigid rotor on a damper that
stands, Q_0 = c omega_n; one that turns takes Omega c_r from it.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from hpcwhirl.arrays import Floats
from hpcwhirl.reduction.growth import floor_of, roots_over, search_range
from hpcwhirl.reduction.modes import ModalModel, SpinBlock, unlike_waves
from hpcwhirl.reduction.numbers import zero_between
from hpcwhirl.reduction.waves import (
    WaveLine,
    coupled_by_supports,
    diameter_matrices,
    quadratic_roots,
    wave_lines,
)

POINTS = 201  # speeds between which critical speeds are searched
AT_REST = 1e-6  # lowest speed of a search / highest
LEAST, MOST = 1e-6, 1e3  # Q_0 searched, over the static stiffness at the centre
DIGITS = 1e-12  # relative error of Q_0


class Critical(NamedTuple):
    """A speed at which a free wave turns as fast as the rotor, damping included.

    Attributes
    ----------
    speed : rad/s
    nodal_diameter, family : labels of the mode at rest from which the wave comes
    forward : whether the wave turns with the rotor in the static frame
    growth : 1/s, growth rate of the wave at that speed
    """

    speed: float
    nodal_diameter: int
    family: str
    forward: bool
    growth: float


class Limit(NamedTuple):
    """The cross coupling at which a rotor is at the limit of stability.

    Attributes
    ----------
    coupling : Q_0, N/m; < 0: a free motion grows, and the supports must resist it
    frequency : rad/s, static frame, of the wave that neither grows nor decays; > 0:
        forward; on supports that differ by direction its magnitude
    """

    coupling: float
    frequency: float


def damped_criticals(
    model: ModalModel, blades: int, fastest: float = 0.0
) -> list[Critical]:
    """Return the damped critical speeds of an unbalance, ascending.

    They are searched where `growth.search_range` says. Empty for unequal sectors, and
    for a clamped centre, like `waves.unbalance_speeds`.

    model, blades, fastest : rotor; N; rad/s, highest speed of interest
    """
    spin = model.spin
    moving = [piece for piece in spin.waves if piece.hub.any()] if spin else []
    if not moving:
        return []
    span = search_range(model, blades, fastest)
    grid = np.linspace(max(span.low, AT_REST * span.high), span.high, POINTS)
    found = [
        _named(model, blades, speed)
        for piece in moving
        for speed in _crossed(model, piece, grid)
    ]
    return sorted(found)


def _crossed(model: ModalModel, piece: SpinBlock, grid: Floats) -> list[float]:
    """Return the speeds at which a wave of one nodal diameter turns as fast as a rotor.

    model, piece, grid : rotor; the nodal diameter; (n,), rad/s, ascending
    """

    def ahead(speed: float) -> Floats:
        return np.asarray(_ahead(model, piece, np.array([speed]))[0])

    values = _ahead(model, piece, grid)
    places = np.argwhere((values[:-1] > 0.0) != (values[1:] > 0.0))
    return [
        zero_between(_of_place(ahead, int(place)), grid[i], grid[i + 1])
        for i, place in places
    ]


def _ahead(model: ModalModel, piece: SpinBlock, speeds: Floats) -> Floats:
    """Return by how much waves are faster than the rotor, (n, r), rad/s, each sorted.

    A column is a continuous function of the speed, 0 at a critical one.

    speeds : (n,), rad/s
    """
    turned = np.sort(roots_over(model, piece, speeds).imag, axis=1)
    if model.terms.is_round:  # rotating frame: forward if < 0
        return np.asarray(-turned)
    upper = turned[:, turned.shape[1] // 2 :]  # static frame, one of each conjugates
    return np.asarray(upper - speeds[:, None])


def _of_place(
    values: Callable[[float], Floats], place: int
) -> Callable[[float], float]:
    return lambda speed: float(values(speed)[place])


def _named(model: ModalModel, blades: int, speed: float) -> Critical:
    """Return a critical speed with the wave that turns as fast as the rotor there."""

    def apart(line: WaveLine) -> float:
        return abs(abs(line.static) - speed)

    lines = [one for one in wave_lines(model, blades, speed) if one.nodal_diameter == 1]
    if model.terms.is_round:
        lines = [line for line in lines if line.static > 0.0]
    line = min(lines, key=apart)
    return Critical(
        speed, line.nodal_diameter, line.family, line.static > 0.0, line.growth
    )


def stability_limit(model: ModalModel, speed: float) -> Limit | None:
    """Return the cross coupling at which the rotor neither grows nor decays, Q_0.

    None for unequal sectors and a clamped centre, and if there is none between `LEAST`
    and `MOST` times the static stiffness at the centre.

    model, speed : rotor; Omega, rad/s
    """
    spin = model.spin
    moving = [piece for piece in spin.waves if piece.hub.any()] if spin else []
    for piece in moving:
        found = _limit_of(model, piece, speed)
        if found is not None:
            return found
    return None


def _limit_of(model: ModalModel, piece: SpinBlock, speed: float) -> Limit | None:
    """Return Q_0 of the waves of one nodal diameter; None if there is none."""

    def worst(coupling: float) -> complex:
        roots = _roots_with(model, piece, speed, coupling)
        return complex(roots[np.argmax(roots.real)])

    def growth(coupling: float) -> float:
        return worst(coupling).real

    if abs(growth(0.0)) <= floor_of(model):
        return _told(model, 0.0, worst(0.0))
    stiff = 1.0 / float((np.abs(piece.hub) ** 2 / piece.omega**2).sum())
    way = -math.copysign(stiff, growth(0.0))
    inside, size = 0.0, LEAST
    while (growth(way * size) > 0.0) == (way < 0.0):
        inside, size = size, 2.0 * size
        if size > MOST:
            return None
    share = zero_between(
        lambda part: growth(way * part), inside, size, rtol=DIGITS, xtol=DIGITS * size
    )
    return _told(model, way * share, worst(way * share))


def _told(model: ModalModel, coupling: float, root: complex) -> Limit:
    round_ones = model.terms.is_round
    return Limit(coupling, root.imag if round_ones else abs(root.imag))


def _roots_with(
    model: ModalModel, piece: SpinBlock, speed: float, coupling: float
) -> np.ndarray:
    """Return the roots s, 1/s, static frame, with a further cross coupling.

    Im s > 0: forward. On supports that differ by direction, where a motion is an
    ellipse, each is counted with its conjugate.

    piece, speed, coupling : nodal diameter 1; Omega, rad/s; N/m, at the centre
    """
    gyro, damping, stiffness, push = diameter_matrices(model, piece, speed)
    sense = math.copysign(1.0, speed)
    driven = 1j * sense * coupling * np.outer(piece.hub.conj(), piece.hub)
    pair, spin = (damping + gyro, stiffness + push + driven), model.terms
    if spin.is_round:
        roots = quadratic_roots(*pair)
        return np.asarray(roots.real + 1j * (abs(speed) - sense * roots.imag))
    return quadratic_roots(*coupled_by_supports(pair, unlike_waves(spin, piece), speed))
