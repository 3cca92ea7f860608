"""Waves of equal sectors by slot: coefficients of the loop `points`, packed.

At N equal sectors, a wave of rotor or casing belongs to a slot, a nodal diameter 0 .. N
// 2, and moves blade j like blade 0, times e^{i kappa theta_j}. Its amplitude a is
complex, in the frame of the blades. A mode of a body that rotation does not couple, of
frequency omega, has two waves, Y = a + b, which a step multiplies by z and conj(z), z
the root of central differences (`mode_waves`). In the frame of the blades, a harmonic h
of the casing turns by E = e^{i h Omega dt}: its waves are multiplied by z E and conj(z)
E. The waves of a rotor with terms of rotation are those of `turning_waves`.

The increments of the bodies' material are d_n = rise a_n, with rise = 1 - 1/z of the
static frame; a force on the mode adds give f to Y and to its increment.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hpcwhirl.arrays import Complexes, Floats, Integers
from hpcwhirl.dynamics.kernels.loop.wave_types import FlowRows, SlotFlight, SlotRows
from hpcwhirl.dynamics.kernels.vectors import FOUR, all_aligned
from hpcwhirl.dynamics.waves import slots
from hpcwhirl.dynamics.waves.flights import die_out

PART = 2 * FOUR  # doubles of four amplitudes, re, then im
FREE, FIXED = 3, 6  # items of a row, and of a group, see `kernels.loop.slots`
NAMES = "radial", "push"
PUSHED, FLOWN = (4, 6), (6, 8)  # of a row in contact: of rotor and casing


@dataclass(frozen=True)
class SlotWaves:
    """Waves of a body by slot; each array is (rows, k), row f the f-th wave of a slot.

    Attributes
    ----------
    there : whether a slot has so many waves; the rest is padding
    ahead : z - 1, z the factor by which a step multiplies an amplitude
    radial, along : change of the gap, real, and motion of the casing relative to the
        tip along the rotation, for unit amplitude
    push : change of the amplitude by a unit spectrum of the multipliers
    slide, open : motion of the material from step n - 1 to n + 1 along the rotation,
        and that of the gap, for unit amplitude at n + 1 without forces
    passing : rate at which the casing's radius changes at the blades, 1/s, as they move
        past its shape of two steps before
    opens : (k,), change of the gap by a unit spectrum of the multipliers
    near, slides : (k,), motions of the material by it: of the gap, along the rotation
    form : {(f, g): (k,)}, J, f <= g: energy of the products conj(a_f) a_g
    """

    there: Any
    ahead: Complexes
    radial: Floats
    along: Complexes
    push: Complexes
    slide: Complexes
    open: Complexes
    passing: Complexes
    opens: Complexes
    near: Complexes
    slides: Complexes
    form: dict[tuple[int, int], Complexes]

    @property
    def rows(self) -> int:
        """Number of rows: the largest number of waves of a slot."""
        return len(self.there)


@dataclass(frozen=True)
class Steps:
    """How pairs of waves of modes move in a step, (rows, k) each, for first waves.

    Attributes
    ----------
    there : whether there is a mode
    ahead : z - 1
    moves : motion of the mode from step n - 1 to n + 1, for unit amplitude at n + 1; in
        the exact flow 2 dt times the velocity before the impulse of the step
    gives : change of the amplitude by a unit modal force
    give, moved : change of the mode, and of its motion, by a unit modal force
    rates : velocity of the mode for unit amplitude
    own, cross : J, energy for unit |a|^2, and of conj(a) b
    """

    there: Any
    ahead: Complexes
    moves: Complexes
    gives: Complexes
    give: Floats
    moved: Floats
    rates: Complexes
    own: Floats
    cross: Complexes


def differences(items: Floats, step: float) -> Steps:
    """Return the steps of modes by central differences.

    items, step : (ITEMS, rows, k), coefficients of the modes, `slots`; dt, s
    """
    there = items[slots.KEEP] != 0.0
    omega, give = items[slots.OMEGA], items[slots.GIVE]
    rate = items[slots.DAMPING] * omega
    stiff = 1 - (omega * step / 2) ** 2
    swing = np.sqrt(np.where(there, omega**2 * stiff - rate**2, 1.0).astype(complex))
    half = (1j * swing - rate) / stiff * (step / 2)
    ahead = np.where(there, 2 * half / (1 - half), 0.0)
    rise = ahead / (1 + ahead)
    apart = np.where(there, 2j * rise.imag, 1.0)
    own = np.abs(rise) ** 2 / step**2 + omega**2 * (1 - rise).real
    cross = rise.conj() ** 2 / step**2 + omega**2 * (1 - rise.conj())
    return Steps(
        there, ahead, rise * (1 + 1 / (1 + ahead)), (1 - rise.conj()) / apart * give,
        give, give, rise * (2 + ahead) / (2 * step), there * own / 2, there * cross,
    )  # fmt: skip


def exact_steps(items: Floats, step: float) -> Steps:
    """Return the steps of modes by the exact flow.

    items, step : as for `differences`
    """
    there = items[slots.KEEP] != 0.0
    omega, xi = items[slots.OMEGA], items[slots.DAMPING]
    swing = np.where(there, omega * np.sqrt(1 - xi**2), 1.0)
    roots = np.where(there, 1j * swing - xi * omega, 0.0)
    ahead = np.expm1(roots * step)
    impulse = step * there / (2j * swing)
    energy = (np.abs(roots) ** 2 + omega**2) / 2
    return Steps(
        there, ahead, 2 * step * roots / (1 + ahead), (1 + ahead) * impulse,
        2 * ((1 + ahead) * impulse).real, step**2 * there, roots, energy,
        roots.conj() ** 2 + omega**2,
    )  # fmt: skip


def pairs_of_modes(items: Floats, mu: float, steps: Steps) -> SlotWaves:
    """Return the waves of uncoupled modes, two for each, at rest in their frame.

    items : (ITEMS, rows, k), coefficients of the modes, see `slots`
    mu, steps : friction with the sign of the speed; how the modes move
    """
    radial, moves = items[slots.RADIAL], steps.moves
    along = items[slots.SR] + 1j * items[slots.SI]
    force = radial + mu * along.conj()
    form = dict[tuple[int, int], Complexes]()
    for f in range(len(radial)):
        one, two = 2 * f, 2 * f + 1
        form[one, one] = form[two, two] = steps.own[f]
        form[one, two] = steps.cross[f]
    given, moved = steps.give * force, steps.moved * force
    return SlotWaves(
        np.repeat(steps.there, 2, axis=0), _twice(steps.ahead),
        np.repeat(radial, 2, axis=0), np.repeat(along, 2, axis=0),
        two_rows(steps.gives * force, steps.gives.conj() * force),
        two_rows(along * moves, along * moves.conj()), _twice(radial * moves),
        1j * _twice(radial / (1 + steps.ahead) ** 2), (radial * given).sum(axis=0),
        (radial * moved).sum(axis=0), (along * moved).sum(axis=0), form,
    )  # fmt: skip


def two_rows(first: Complexes, second: Complexes) -> Complexes:
    """Return rows of first waves and second waves of pairs, in turn."""
    return np.stack([first, second], axis=1).reshape(-1, first.shape[-1])


def _twice(first: Complexes) -> Complexes:
    return two_rows(first, first.conj())


def turned(waves: SlotWaves, spin: Floats, step: float) -> SlotWaves:
    """Return the waves of pairs in a frame in which they turn.

    spin, step : (modes rows, k), rad/s, rate of each mode; dt, s
    """
    spin = np.repeat(spin, 2, axis=0)
    factor = np.expm1(1j * spin * step)
    back = np.exp(-1j * spin * step)
    return replace(
        waves,
        ahead=(1 + waves.ahead) * factor + waves.ahead,
        passing=spin * back * waves.passing,
    )


def packed(pairs: Sequence[tuple[Complexes, Complexes]], places: SlotPlaces) -> Floats:
    """Return complex coefficients of all rows as the kernel has them, flat.

    pairs : of each, the arrays (rows, k) of rotor and casing; re, then im, are items
    """
    (one, two), *_ = pairs
    mask = np.hstack([_mask(len(one), places.rotor), _mask(len(two), places.ring)])
    parts = [part for pair in pairs for part in _parts(*pair)]
    return np.ravel(_laid(parts)[mask])


@dataclass(frozen=True)
class SlotPlaces:
    """Where the waves of both bodies lie in the array of amplitudes of the kernel.

    Attributes
    ----------
    first : (G,), first of the rows of each group of four slots
    rotor, ring : (G,), numbers of rows of rotor and casing in each group
    """

    first: Integers
    rotor: Integers
    ring: Integers

    @property
    def rows(self) -> int:
        """Number of rows of all groups."""
        return int((self.rotor + self.ring).sum())

    def rotor_at(self, row: Any, slot: Any) -> Any:
        """Return the index of re of waves of the rotor; im follows four further."""
        group = slot // FOUR
        return (self.first[group] + row) * PART + slot % FOUR

    def ring_at(self, row: Any, slot: Any) -> Any:
        """Return the index of re of waves of the casing; im follows four further."""
        group = slot // FOUR
        return self.rotor_at(row, slot) + self.rotor[group] * PART

    def free_at(self, row: Any, slot: Any) -> Any:
        """Return the index in `SlotRows.free` of re of z - 1 of the casing's waves."""
        return self.ring_at(row, slot) // PART * FREE * FOUR + slot % FOUR

    def passing_at(self, row: Any, slot: Any) -> Any:
        """Return the index in `FlowRows.pushed` of the casing's waves' `PASS_RE`."""
        group, (few, many) = slot // FOUR, FLOWN
        items = self.rotor * few + self.ring * many
        first = np.cumsum(items) - self.ring * many
        return (first[group] + row * many + few) * FOUR + slot % FOUR


def no_waves(slots: int) -> SlotWaves:
    """Return the waves of a rigid casing: none, with k slots."""
    none, zero = np.zeros((0, slots)), np.zeros(slots, dtype=complex)
    rows = none.astype(complex)
    return SlotWaves(
        none > 0.0, rows, none, *(rows,) * 5, zero, zero, zero, {}
    )  # fmt: skip


def places_of(rotor: SlotWaves, ring: SlotWaves) -> SlotPlaces:
    """Return where the waves of both bodies lie in the kernel's array of amplitudes."""
    counts = [_filled(body) for body in (rotor, ring)]
    whole = counts[0] + counts[1]
    return SlotPlaces(np.concatenate([[0], np.cumsum(whole)[:-1]]), *counts)


def _filled(body: SlotWaves) -> Integers:
    """Return the number of rows that each group of four slots uses, (G,)."""
    used = body.there.reshape(body.rows, body.there.shape[1] // FOUR, FOUR).any(axis=2)
    rows = np.arange(1, body.rows + 1)[:, None]
    return np.asarray((used * rows).max(axis=0, initial=0), dtype=np.int64)


def slot_rows(
    rotor: SlotWaves,
    ring: SlotWaves,
    places: SlotPlaces,
    tables: tuple[Floats, Floats],
    flight: SlotFlight | None,
) -> SlotRows | FlowRows:
    """Return the packed coefficients of the kernel for waves of both bodies.

    tables : of cos and sin between blades and slots, see `slots.transforms`
    flight : coefficients of jumps; None for central differences
    """
    turns, wave = tables
    own, beside = _mask(rotor.rows, places.rotor), _mask(ring.rows, places.ring)
    mask = np.hstack([own, beside])
    free = _laid([*_parts(rotor.ahead, ring.ahead), (rotor.radial, ring.radial)])
    pushed = _laid([
        *_parts(rotor.slide, ring.slide), *_parts(rotor.push, ring.push),
        *_parts(rotor.open, ring.open), *_parts(rotor.passing, ring.passing),
    ])  # fmt: skip
    few, many = PUSHED if flight is None else FLOWN
    items = np.repeat(mask[:, :, None], FLOWN[1], axis=2)
    items[:, : rotor.rows, few:], items[:, :, many:] = False, False
    near = rotor.near * 0.0 if flight is None else rotor.near
    fixed = [rotor.opens, near + ring.near, rotor.slides + ring.slides]
    parts = np.stack([part for z in fixed for part in (z.real, z.imag)])
    groups = parts.reshape(FIXED, -1, FOUR).swapaxes(0, 1)
    along = np.stack([rotor.along.real, rotor.along.imag])
    along = along.reshape(2, rotor.rows, -1, FOUR).transpose(2, 1, 0, 3)[own]
    energy = _energies(rotor, ring, places)
    laid = np.repeat(items[:, :, :, None], FOUR, axis=3)
    flat = free[mask], pushed[laid], groups, along, energy[0]
    arrays = all_aligned([np.ravel(array) for array in flat])
    numbers = places.rotor, places.ring, np.ravel(energy[1])
    both = [*arrays, *numbers, energy[2], turns, wave]
    return SlotRows._make(both) if flight is None else FlowRows._make([*both, flight])


def _mask(rows: int, filled: Integers) -> Any:
    """Return whether each group of slots uses each row, (G, rows)."""
    return np.arange(rows) < filled[:, None]


def _parts(one: Complexes, two: Complexes) -> list[tuple[Floats, Floats]]:
    return [(one.real, two.real), (one.imag, two.imag)]


def _laid(items: Sequence[tuple[Floats, Floats]]) -> Floats:
    """Return coefficients of rotor and casing by group, (G, rows, items, 4).

    items : for each coefficient the arrays (rows, k) of rotor and casing
    """
    whole = np.stack([np.vstack(pair) for pair in items])
    count, rows, _ = whole.shape
    return whole.reshape(count, rows, -1, FOUR).transpose(2, 1, 0, 3)


def _energies(
    rotor: SlotWaves, ring: SlotWaves, places: SlotPlaces
) -> tuple[Floats, Integers, int]:
    """Return the energies of both bodies as products of pairs of waves.

    Returns
    -------
    coefficients, J, (e, 2, 4), re and im, for four slots each; indices (e, 2) of the
    two waves' amplitudes; the number of entries of the rotor, which come first
    """
    values, pairs = [np.zeros((0, 2, FOUR))], [np.zeros((0, 2), dtype=np.int64)]
    count = list[int]()
    for body, at, filled in (
        (rotor, places.rotor_at, places.rotor), (ring, places.ring_at, places.ring),
    ):  # fmt: skip
        for (f, g), form in body.form.items():
            four = form.reshape(-1, FOUR)
            groups = np.flatnonzero((filled > g) & four.any(axis=1))
            four = four[groups]
            values.append(np.stack([four.real, four.imag], axis=1))
            slot = groups * FOUR
            pairs.append(np.column_stack([at(f, slot), at(g, slot)]))
        count.append(sum(map(len, pairs)))
    return np.concatenate(values), np.concatenate(pairs), count[0]


def flight_of(
    rotor: SlotWaves, ring: SlotWaves, places: SlotPlaces, step: float, counts: Integers
) -> tuple[Floats, Floats, bool]:
    """Return coefficients of jumps over free steps, and of bounds of the motion.

    counts, step : (P,), numbers of steps of the jumps, of which the last but one is the
        longest; dt, s

    Returns
    -------
    jumps, bounds : see `kernels.loop.wave_types.SlotFlight`
    dies : whether all motion that contact can cause decays
    """
    mask = np.hstack([_mask(rotor.rows, places.rotor), _mask(ring.rows, places.ring)])
    ahead = np.vstack([rotor.ahead, ring.ahead])
    radial, push = (np.vstack([getattr(b, n) for b in (rotor, ring)]) for n in NAMES)
    logs = np.log1p(ahead)
    roots, none = logs / step, np.zeros((0, ahead.shape[1]))

    def laid(parts: Sequence[Floats]) -> Floats:
        out: Floats = _laid([(part, none) for part in parts])[mask].ravel()
        return out

    turns = [np.exp(int(count) * logs) for count in counts]
    grown = np.exp(np.maximum(roots.real, 0.0) * float(counts[-2] * step))
    rate, weight = radial * roots, np.abs(radial)
    bounds = rate.real, rate.imag, weight * np.abs(roots) ** 2 * grown, weight
    jumps = np.concatenate([laid([z.real, z.imag]) for z in turns])
    return jumps, laid(bounds), die_out(ahead.ravel(), push.reshape(1, -1))
