"""Many cases of one engine, four to a kernel: each has the bits it has alone."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Iterator
from typing import Any

from hpcwhirl.case.resolve import Case
from hpcwhirl.dynamics.history import History
from hpcwhirl.dynamics.kernels.vectors import FOUR
from hpcwhirl.dynamics.lanes import Lanes, can_ride, group_key
from hpcwhirl.dynamics.march import FIRST_SLICE, March, next_slice
from hpcwhirl.errors import InputError

MOST_LANES = 1024


class Batch:
    """A queue of cases and the lanes that they ride in.

    Cases share the engine, gap, modes, scheme and time step; speed, friction, loading,
    duration and output may differ. Lanes are marched four at a time; fewer than four
    leave lanes idle.

    Parameters
    ----------
    cases : read as lanes become free
    lanes : cases on their way at once
    begin : called with the place and the march of every case before it rides; may let
        it go on from a snapshot
    limit : computing seconds after which a case is taken out, whether it has ended or
        not

    Raises
    ------
    InputError
        where a case cannot ride with the others, when its turn comes
    """

    def __init__(
        self,
        cases: Iterable[Case],
        lanes: int = FOUR,
        begin: Callable[[int, March], None] | None = None,
        limit: float = math.inf,
    ) -> None:
        if not 1 <= lanes <= MOST_LANES:
            msg = f"lanes must be in 1 .. {MOST_LANES}, got {lanes}"
            raise InputError(msg)
        self.waiting = enumerate(cases)
        self.lanes, self.begin, self.limit = lanes, begin, limit
        self.key: tuple[Any, ...] | None = None  # that all cases share
        self.groups: list[Lanes] = []
        self.seats: dict[tuple[int, int], int] = {}  # group and lane -> place

    def run(
        self, between_slices: Callable[[], None] | None = None
    ) -> Iterator[tuple[int, History]]:
        """Yield (place in the queue, history) of every case as it ends.

        between_slices : called every 10 ms or so; may raise to end the batch
        """
        for place, march in self.marches(between_slices):
            yield place, march.history()

    def marches(
        self, between_slices: Callable[[], None] | None = None
    ) -> Iterator[tuple[int, March]]:
        """Yield (place in the queue, march) of every case as it ends; see `run`."""
        for place in range(self.lanes):
            self._refill(place // FOUR, place % FOUR)
        size = FIRST_SLICE
        while self.seats:
            for number, group in enumerate(self.groups):
                before = time.perf_counter()
                made = group.advance(size)
                if made > 0:
                    size = next_slice(size, made, time.perf_counter() - before)
                yield from self._ended(number)
                if between_slices:
                    between_slices()

    def aboard(
        self, wanted: Callable[[int, March], bool] | None = None
    ) -> Iterator[tuple[int, March]]:
        """Yield (place, march) of every case on its way, as it would be alone now.

        A march is to be read, not advanced: it is still in its lane.

        wanted : of place and march, whose `seconds` alone are of now; None: all
        """
        for (number, lane), place in list(self.seats.items()):
            group = self.groups[number]
            riding = group.marches[lane]
            if riding is not None and (wanted is None or wanted(place, riding)):
                march = group.unload(lane)
                group.load(lane, march)
                yield place, march

    def _ended(self, number: int) -> Iterator[tuple[int, March]]:
        """Take out what has ended in a group, fill its lanes again, yield it."""
        group = self.groups[number]
        late = [
            lane for lane, march in enumerate(group.marches)
            if march is not None and march.seconds > self.limit
        ]  # fmt: skip
        for lane in sorted({*group.ended(), *late}):
            march = group.unload(lane)
            place = self.seats.pop((number, lane))
            self._refill(number, lane)
            yield place, march

    def _refill(self, number: int, lane: int) -> None:
        """Put the next waiting case, if there is one, in a lane."""
        place, case = next(self.waiting, (-1, None))
        if case is None:
            return
        march = self._march(case)
        if self.begin:
            self.begin(place, march)
        if number == len(self.groups):
            self.groups.append(Lanes(march))
        self.groups[number].load(lane, march)
        self.seats[number, lane] = place

    def _march(self, case: Case) -> March:
        """Return the march of a case that may ride with the others."""
        if not can_ride(case):
            msg = "a lane takes scheme modal, a cyclic rotor and a fourier ring only"
            raise InputError(msg)
        key = group_key(case)
        if key != (self.key or key):
            msg = "cases of a batch must share engine, gap, modes and time_step"
            raise InputError(msg)
        self.key = key
        return March(case)
