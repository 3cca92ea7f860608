"""Four marches of one model in the lanes of one kernel: loaded, advanced, unloaded."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.case.resolve import Case
from hpcwhirl.dynamics.kernels import (
    contact,
    lane_passes,
    lane_state,
    lanes,
    named,
    passes,
)
from hpcwhirl.dynamics.kernels.cyclic import widths
from hpcwhirl.dynamics.kernels.vectors import FOUR
from hpcwhirl.dynamics.march import March, empty_tracks
from hpcwhirl.dynamics.operators import friction_with_sign
from hpcwhirl.scene.schemes import SCHEMES

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


def can_ride(case: Case) -> bool:
    """Return whether a case may be a lane: scheme modal, cyclic rotor, flexible ring.

    What `scheme_of` gives to the general kernel, the exact flow and rigid casings march
    alone, and so does what is looked at on its way: one sector of many, and a case
    that may be certified.
    """
    given, model = case.given, case.model
    cyclic = model.rotor.cyclic and model.blades > 2
    ring = given.engine.casing.discretization == "fourier" and model.casing is not None
    if not (SCHEMES[given.solver.scheme].rides and cyclic and ring):
        return False
    return not case.plan.settles and case.plan.folds == 1


def group_key(case: Case) -> tuple[Any, ...]:
    """Return what cases must share to be lanes of one group: modes and step, too."""
    scene = case.scene
    solver = scene.solver.model_copy(update={"amplitude_limit": 1.0})
    return scene.engine, scene.gap, solver


@dataclass(frozen=True)
class Layout:
    """How one body lies in lanes.

    Attributes
    ----------
    slots : (slots in use, 2), modes of each and whether they are double
    order : (modes,), their places among the items of `slots.cyclic_arrays`
    places : (2, items of the state), first lane of each, -1 where there is no mode;
        in the second row d's two places are exchanged
    size : doubles of the state of all lanes
    """

    slots: Integers
    order: Integers
    places: Integers
    size: int


def _layout(modes: NDArray[np.bool_], twin: int, *, ring: bool) -> Layout:
    """Return the layout of modes (rows, phases, slots); twin : items to the other.

    A mode of the ring has its two parts in two halves of the state, one of the rotor
    in columns `twin` apart.
    """
    rows, _, k = modes.shape
    count = modes[:, 0].sum(axis=0)
    double = np.logical_or(modes[:, -1].any(axis=0), ring)
    used = 1 + int(np.flatnonzero(count).max())
    whole = rows * k * 2
    places, order, at = np.full((3, whole), -1), [], 0
    for slot in range(used):
        parts = 2 if double[slot] else 1
        for row in range(int(count[slot])):
            mode = row * k + slot if ring else row * 2 * k + slot
            order.append(mode)
            for place in range(3):
                for part in range(parts):
                    places[place, mode + part * twin] = at
                    at += FOUR
    both = np.array([places.ravel(), places[[0, 2, 1]].ravel()])
    slots = np.column_stack([count, double])[:used]
    return Layout(slots.astype(np.int64), np.array(order), both, at)


def layouts(
    rotor: Floats, ring: Floats, blades: int
) -> tuple[Layout, Layout, int, int]:
    """Return both bodies' layouts and rows, from their items, see `cyclic_arrays`."""
    k, _ = widths(blades)
    of_rotor = rotor.reshape(passes.ITEMS, -1, 2, k)[passes.GIVE] != 0.0
    of_ring = ring.reshape(passes.ITEMS, -1, 1, k)[passes.GIVE] != 0.0
    rows, ring_rows = len(of_rotor), len(of_ring)
    b = _layout(of_rotor, k, ring=False)
    return b, _layout(of_ring, ring_rows * k, ring=True), rows, ring_rows


def _of_lane(state: Any) -> named.LaneState:
    """Return what of a march's state lies lane by lane."""
    fields = named.LaneState._fields
    return named.LaneState._make(getattr(state, name) for name in fields)


class Lanes:
    """Up to four marches with the same model and step.

    Parameters
    ----------
    first : a march of the model, not loaded yet
    """

    def __init__(self, first: March) -> None:
        _, rotor, casing, touch = first.scheme.arrays
        blades, scene = first.lean.model.blades, first.lean.scene
        rotor_items, casing_items = rotor.items, casing.items
        self.rotor, self.ring, rows, ring_rows = layouts(
            rotor_items, casing_items, blades
        )
        self.kernel = lanes.lanes_kernel(blades, rows, ring_rows)
        self.step, self.gap = scene.solver.time_step, scene.gap
        self.marches: list[March | None] = [None] * FOUR
        self.turn = np.zeros(1, dtype=np.int64)
        shared = [
            items.reshape(passes.ITEMS, -1)[:, body.order][list(lane_passes.SHARED)]
            for items, body in ((rotor_items, self.rotor), (casing_items, self.ring))
        ]
        flat = [np.ascontiguousarray(item.T).ravel() for item in shared]
        waves = touch.turns, touch.wave
        of_rotor, of_ring = flat
        self.shared = named.LaneShared(
            of_rotor, self.rotor.slots, of_ring, self.ring.slots, *waves
        )
        self.fixed = named.LaneFixed(
            self.rotor.places, self.ring.places, rotor.hub, *waves
        )
        self._allocate(first, len(rotor_items), len(casing_items))

    def _allocate(self, first: March, rotor: int, ring: int) -> None:
        """Make the arrays of four idle lanes."""
        state = first.state
        self.items = named.LaneItems(np.zeros((FOUR, rotor)), np.zeros((FOUR, ring)))
        self.own = named.LaneItems(
            np.zeros((len(self.rotor.order), 2, FOUR)),
            np.zeros((len(self.ring.order), 4, FOUR)),
        )
        self.numbers = np.zeros((FOUR, lanes.SCALARS))
        self.wholes = np.zeros((FOUR, lanes.WHOLES), dtype=np.int64)
        self.column = np.zeros((FOUR, first.lean.model.blades))
        self.lobes = np.zeros((FOUR, ring // passes.ITEMS))
        self.bodies = named.LaneBodies(
            np.zeros(self.rotor.size),
            np.zeros(self.ring.size),
            np.zeros(FOUR * len(state.sums_b)),
            np.zeros(FOUR * len(state.sums_c)),
        )
        self.state = named.LaneState._make(
            np.zeros((FOUR, len(a)), dtype=a.dtype) for a in _of_lane(state)
        )
        self._work_space(first)

    def _work_space(self, first: March) -> None:
        """Make what the kernel works in, and the tracks of an idle lane."""
        blades = first.lean.model.blades
        k, wide = widths(blades)
        n, padded = 2 * wide, -(-blades // FOUR) * FOUR
        spectra = np.zeros((4, 2 * k * FOUR))
        self.work = named.LaneWork._make([*spectra, np.zeros(n)])
        self.touching = np.zeros(FOUR, dtype=np.int64)
        lanes_padded = FOUR * padded
        self.kept = named.LaneKept(
            np.zeros(FOUR, dtype=np.int64),
            np.zeros(lanes_padded),
            np.zeros(lanes_padded * padded),
            np.zeros(lanes_padded * n),
            np.zeros(lanes_padded * n),
            np.zeros(lanes_padded, dtype=np.int64),
            np.zeros(FOUR * blades * n),
            self.shared.turns,
        )
        self.nothing = empty_tracks(0, 0, 0, blades, 0)

    def load(self, lane: int, march: March) -> None:
        """Put a march, begun or not, in a lane."""
        self.marches[lane] = march
        scene, (load, rotor, casing, touch) = march.lean.scene, march.scheme.arrays
        self._coefficients(lane, rotor.items, casing.items)
        self.column[lane], self.lobes[lane] = touch.column, load.modal
        limit = scene.solver.amplitude_limit * scene.engine.rotor.radius
        self.numbers[lane] = (
            scene.speed,
            scene.nodal_diameter,
            load.force,
            load.pulse,
            casing.sign,
            friction_with_sign(scene),
            limit,
        )
        self.wholes[lane] = march.stride, 1, march.beat
        self._exchange(lane, march, lane_state.put_lane)
        self._rows(lane, march, into_lane=True)

    def _coefficients(self, lane: int, rotor: Floats, ring: Floats) -> None:
        """Set a lane's items, all and those that the passes read."""
        self.items.rotor[lane], self.items.ring[lane] = rotor, ring
        wanted = [passes.NORMAL, passes.ALONG, passes.TURN_RE, passes.TURN_IM]
        for own, items, body in zip(
            self.own, (rotor, ring), (self.rotor, self.ring), strict=True
        ):
            chosen = items.reshape(passes.ITEMS, -1)[:, body.order]
            own[:, :, lane] = chosen[wanted[: own.shape[1]]].T

    def _exchange(self, lane: int, march: March, move: Callable[..., None]) -> None:
        """Copy bodies and sums between a march and its lane."""
        other = (int(self.turn[0]) - march.steps) & 1
        state = march.state
        bodies = (state.rotor, state.ring, state.sums_b, state.sums_c)
        places = (
            self.rotor.places[other],
            self.ring.places[other],
            FOUR * np.arange(len(state.sums_b)),
            FOUR * np.arange(len(state.sums_c)),
        )
        for mine, place, its in zip(self.bodies, places, bodies, strict=True):
            move(mine, place, lane, its)

    def _rows(self, lane: int, march: March, *, into_lane: bool) -> None:
        """Copy the other arrays of the state; the rows of gaps turn with the step."""
        its = _of_lane(march.state)
        shift = (int(self.turn[0]) - march.steps) % 3
        gaps, own = self.state.gaps[lane].reshape(3, -1), its.gaps.reshape(3, -1)
        for name in its._fields[1:]:
            mine, other = getattr(self.state, name), getattr(its, name)
            if into_lane:
                mine[lane] = other
            else:
                other[:] = mine[lane]
        if into_lane:
            gaps[:] = np.roll(own, shift, axis=0)
        else:
            own[:] = np.roll(gaps, -shift, axis=0)

    def unload(self, lane: int) -> March:
        """Take the march out of a lane, its state as it marches alone."""
        march = self.marches[lane]
        if march is None:
            msg = f"lane {lane} is idle"
            raise ValueError(msg)
        march.counter[:] = self.state.counter[lane]  # its steps tell where things lie
        self._exchange(lane, march, lane_state.take_lane)
        self._rows(lane, march, into_lane=False)
        self._clear(lane)
        return march

    def _clear(self, lane: int) -> None:
        """Leave a lane idle: at rest, and nothing moves it."""
        self.marches[lane] = None
        self.wholes[lane] = 1, 0, 1
        for body in self.bodies:
            body[lane::FOUR] = 0.0
        for own in self.own:
            own[:, :, lane] = 0.0
        for array in self.state:
            array[lane] = 0
        self.state.counter[lane, contact.LAST] = -1

    def steps_left(self) -> int:
        """Return the steps until the first of the marches has made all of its."""
        left = [
            march.total - int(self.state.counter[lane, contact.STEP])
            for lane, march in enumerate(self.marches)
            if march is not None
        ]
        return min(left, default=0)

    def ended(self) -> list[int]:
        """Return the lanes whose march is at its end or has stopped."""
        counter = self.state.counter
        return [
            lane
            for lane, march in enumerate(self.marches)
            if march is not None
            and (
                counter[lane, contact.STEP] >= march.total
                or counter[lane, contact.STOP] != contact.RUNNING
            )
        ]

    def advance(self, steps: int) -> int:
        """March at most `steps` steps, fewer if a lane ends; return how many."""
        steps = min(steps, self.steps_left())
        tracks = tuple(m.tracks if m else self.nothing for m in self.marches)
        riding = [lane for lane, m in enumerate(self.marches) if m is not None]
        before = self.state.counter[:, contact.STEP].copy()
        own = named.LaneItems._make(part.reshape(-1) for part in self.own)
        start = time.perf_counter()
        self.kernel(
            steps, self.step, self.gap, self.shared, self.fixed, self.items, own,
            self.numbers, self.wholes, self.column, self.lobes, self.bodies, self.state,
            self.turn, tracks, self.work, self.touching, self.kept,
        )  # fmt: skip
        spent = (time.perf_counter() - start) / max(len(riding), 1)
        for lane in riding:
            march = self.marches[lane]
            if march is not None:
                march.seconds += spent
        return int((self.state.counter[:, contact.STEP] - before).max())
