"""Supports as a term of the time loop `points`, for waves of both bodies.

They are the supports that differ by direction or have a squeeze film, whose forces no
constant matrix gives, see `kernels.standing`. In a step their forces act on the waves
that move the shaft: with equal sectors those of nodal diameter 1 alone.
"""

from __future__ import annotations

import numpy as np

from hpcwhirl.arrays import Complexes, Floats
from hpcwhirl.dynamics.bodies.turning import ALIKE, standing, turning
from hpcwhirl.dynamics.kernels.loop.wave_types import PointsSupport, SlotSupport
from hpcwhirl.dynamics.kernels.vectors import FOUR, all_aligned
from hpcwhirl.dynamics.waves.point_waves import PointWaves, real_rows
from hpcwhirl.dynamics.waves.slot_waves import SlotPlaces
from hpcwhirl.dynamics.waves.turning_waves import Circle, Diameter, Differences
from hpcwhirl.reduction.model import Model
from hpcwhirl.reduction.modes import unlike_waves
from hpcwhirl.reduction.supports import Bearing, Support
from hpcwhirl.scene import Scene

LEAST = 1e-13  # share of the largest coefficient below which others are round-off
NONE = np.zeros(0)
NOTHING = PointsSupport(np.zeros(0, np.int64), *(NONE,) * 5, ALIKE)
NO_SLOT = SlotSupport(*(NONE,) * 6, -1, 1, ALIKE)
STEPS = 64  # in the table of the supports' directions


def support_arrays(
    model: Model, scene: Scene, waves: PointWaves, hub: Floats, bounds: Floats
) -> PointsSupport:
    """Return the kernel's arrays of the supports' forces.

    They are empty for supports without such forces.

    Parameters
    ----------
    waves : waves of both bodies
    hub : (2 s, m), x, y of s supports for unit modes of the rotor
    bounds : (2, 2 s), m/N, for unit forces in x and y: bounds of the motion of any
        point in the step in which they act, and of what they add to that in a later
        step
    """
    if not len(hub):
        return NOTHING
    body = waves.rotor
    stand = standing(model, scene, body.give, model.rotor.shapes)
    place, moving = hub @ (body.shapes - body.rises), hub @ body.moves
    own, _, _ = waves.apart
    gives = (body.gives @ hub.T).T.conj()
    rates = moving / (2 * scene.solver.time_step)
    if stops := 2 * len(stand.stops):
        rates[-stops:] = (hub @ body.shapes)[-stops:]
    rows = place, rates, gives
    both = np.concatenate([own, waves.half + own])
    parts = [real_rows(row).reshape(-1, 2, len(both)) for row in rows]
    sizes = [np.abs(part).max(axis=(0, 1)) for part in parts]
    felt = [size > LEAST * size.max(initial=0.0) for size in sizes]
    used = np.flatnonzero(np.any(felt, axis=0))
    blocks = np.unique(both[used] % waves.half // FOUR)
    laid = np.zeros((len(hub) // 2, 6, 2 * waves.half))
    laid[:, :, both[used]] = np.concatenate(parts, axis=1)[:, :, used]
    fours = laid.reshape(len(laid), 6, 2, -1, FOUR)[:, :, :, blocks]
    fours = np.moveaxis(fours, 3, 1)
    arrays = all_aligned([
        FOUR * blocks.astype(np.int64), fours[:, :, :4].ravel(),
        fours[:, :, 4:].ravel(), _directions(scene),
        *np.hypot(bounds[:, ::2], bounds[:, 1::2]),
    ])  # fmt: skip
    return PointsSupport._make([*arrays, stand])


def _directions(scene: Scene) -> Floats:
    """Return the table (2 `STEPS`,) of e^{-i Omega t} at the first steps."""
    angles = scene.speed * scene.solver.time_step * np.arange(STEPS)
    turns: Complexes = np.exp(-1j * angles)
    return turns.view(np.float64)


def slot_support(
    model: Model,
    scene: Scene,
    diameters: list[Diameter],
    steady: tuple[Circle, ...],
    at: SlotPlaces,
) -> SlotSupport:
    """Return the kernel's arrays of the supports' forces, equal sectors.

    They are empty for supports without such forces. The waves of nodal diameter 1 move
    a support by x + i y = conj(hub a), a their amplitudes, so that a force f on it acts
    on their modes as conj(f) conj(hub).

    diameters, steady : the rotor's waves of each nodal diameter; orbits of an unbalance
    at : where waves lie among the kernel's amplitudes
    """
    spin = model.rotor.spin
    if spin is None or spin.is_plain or model.folds > 1:
        return NO_SLOT
    own = diameters[1]
    if not isinstance(own, Differences):
        raise TypeError(own)
    give = turning(model, scene, model.rotor.shapes).inverse
    stand = standing(model, scene, give, model.rotor.shapes)
    each = unlike_waves(spin, spin.waves[own.k])
    parts = zip(*(_of_support(own, *one) for one in each), strict=True)
    arrays = all_aligned([
        *(np.concatenate(part) for part in parts), _directions(scene)
    ])  # fmt: skip
    return SlotSupport._make([
        *arrays, *_swinging(diameters, steady, at), own.k, stand
    ])  # fmt: skip


def _of_support(
    own: Differences, hub: Complexes, support: Support | Bearing
) -> tuple[Floats, ...]:
    """Return `reads`, `gives`, `gaps`, `slides` of `SlotSupport` of a support, flat.

    own, hub : waves of nodal diameter 1; (m,), motion of the support in their modes
    support : one of `reduction.modes.unlike_waves`
    """
    more = own.give @ hub.conj()
    push, moves = own.inverse @ np.concatenate([more, more]), own.passing()
    place, moving = hub @ (own.shapes - own.rises), hub @ moves / (2 * own.step)
    if isinstance(support, Support) and support.stop > 0.0:
        moving = hub @ own.shapes
    reads = _by_parts([place.conj(), moving.conj()])
    beyond = np.array([own.along @ more - own.along @ moves @ push])
    extra = len(push) % 2  # rows by two
    gives = _in_group(_by_parts([push]), own.k)
    return (
        np.pad(reads, ((0, 2 * extra), (0, 0))).ravel(),
        np.pad(gives, ((0, 2 * extra), (0, 0), (0, 0))).ravel(),
        _in_group(_by_parts([np.array([own.radial @ more])]), own.k).ravel(),
        beyond.view(float),
    )


def _in_group(parts: Floats, slot: int) -> Floats:
    """Return factors (n, r) of a slot among those of its group of four, (n, r, 4)."""
    out = np.zeros((*parts.shape, FOUR))
    out[:, :, slot % FOUR] = parts
    return out


def _by_parts(values: list[Complexes]) -> Floats:
    """Return real factors (2 waves, 2 r), of x and y, of re and im of each amplitude.

    values : r rows, (waves,): numbers z with x + i y = z conj(a), or, of forces, with
        the change z (x - i y) of a
    """
    upper = [part for z in values for part in (z.real, z.imag)]
    lower = [part for z in values for part in (z.imag, -z.real)]
    both = np.column_stack(upper), np.column_stack(lower)
    return np.stack(both, axis=1).reshape(-1, len(upper))


def _swinging(
    diameters: list[Diameter], steady: tuple[Circle, ...], at: SlotPlaces
) -> tuple[Floats, int]:
    """Return `swing` and `orbit` of `SlotSupport`: 0 and -1 without such an orbit."""
    found = [f for f, orbit in enumerate(steady) if orbit.ahead != 0.0]
    if not found:
        return np.zeros(2), -1
    (f,) = found  # an ellipse is two circles, of which one is constant
    opened = complex(diameters[1].radial @ steady[f].shape)
    moved = np.array([opened * (1 - 1 / (1 + steady[f].ahead) ** 2)])
    row = max(len(own.ahead) for own in diameters) + f
    return moved.view(float), int(at.rotor_at(row, 1))
