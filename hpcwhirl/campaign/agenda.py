"""What is still to be handed out, the longest first, and whom rank 0 answers when."""

from __future__ import annotations

import math
from array import array
from collections.abc import Collection, Sequence
from typing import Any, overload

import numpy as np
from numpy.typing import NDArray

from hpcwhirl.campaign.plan.cost import Costs

SORTED_ANEW = 20_000  # units at most: some 30 ms, in which rank 0 answers nobody
EVERY = 8  # sorted anew when 1/EVERY of what is left has been learned
SHORTEST = 0.05  # s that a worker should be busy with one answer, at least
A_RANK = 1e-3  # s of the same for each rank: 20 times what rank 0 spends on an answer
MOST = 128  # units of an answer: a message that needs no consent of its receiver
LEAST_A_RANK = 1e-4  # s of an answer, whatever is fair: twice what an answer takes
FASTEST = 1e-4  # s, of a unit whatever is predicted
FAIR = 4  # an answer is at most this part of an even share of the units left
GOLDEN = 0.6180339887498949
Unit = tuple[int, ...]  # cases that are handed out together
Answers = list[tuple[int, list[int]]]  # to a rank: its next units


class Singles(Sequence[Unit]):
    """Units of one case each.

    Parameters
    ----------
    cases : of each unit, (n,)
    """

    def __init__(self, cases: NDArray[np.int64]) -> None:
        self.cases = cases

    def __len__(self) -> int:
        """Return the number of units."""
        return len(self.cases)

    @overload
    def __getitem__(self, unit: int) -> Unit: ...
    @overload
    def __getitem__(self, unit: slice) -> Singles: ...
    def __getitem__(self, unit: int | slice) -> Unit | Singles:
        """Return the cases of a unit."""
        if isinstance(unit, slice):
            return Singles(self.cases[unit])
        return (int(self.cases[unit]),)


def cases_of(units: Sequence[Unit]) -> NDArray[np.int64]:
    """Return the cases of units, one after the other."""
    if isinstance(units, Singles):
        return units.cases
    return np.array([case for unit in units for case in unit], dtype=np.int64)


def scattered(count: int) -> NDArray[np.int64]:
    """Return the numbers below `count` in an order of which each part is spread evenly.

    By steps of the golden section of all, which meet each number once.
    """
    step = max(round(GOLDEN * count), 1)
    while math.gcd(step, count) > 1:
        step += 1
    return np.asarray(np.arange(count) * step % max(count, 1))


class Agenda:
    """The units of a campaign, handed out by predicted seconds, the longest first.

    Units of equal prediction go out scattered, so that early ones tell about all.

    Parameters
    ----------
    units : cases of each unit
    costs : of the cases; learns with every finished unit
    ranks : that share the work
    last : units that go out after all others
    """

    def __init__(
        self,
        units: Sequence[Unit],
        costs: Costs,
        ranks: int = 1,
        last: Collection[int] = (),
    ) -> None:
        self.turn = np.ones(len(units), dtype=np.int8)  # the highest goes out first
        self.turn[list(last)] = 0
        self.units, self.costs, self.ranks = units, costs, ranks
        self.hold = max(SHORTEST, A_RANK * ranks)
        self.least = LEAST_A_RANK * ranks
        self.predicted = self._predict(np.arange(len(units)))
        self.unfinished = np.ones(len(units), dtype=bool)
        self.left = len(units)
        self.told = self.took = 0.0  # s, of finished units
        self.stale = True  # predictions are from before anything finished
        self.learned = 0
        self.queue = array("q", self._ordered(np.arange(len(units))))  # from its end

    def __len__(self) -> int:
        """Return the number of units not handed out."""
        return len(self.queue)

    def take(self) -> int:
        """Return the next unit, for the rank that holds the agenda."""
        return self.queue.pop()

    def bundle(self, most_units: int = MOST) -> list[int]:
        """Return the next units for one answer to a worker; empty at the end.

        One unit, or as many short ones as keep the worker busy for a while: a little
        with few ranks, with many as long as rank 0 needs to answer them all.

        Parameters
        ----------
        most_units : of the answer
        """
        most = min(MOST, max(len(self.queue) // (FAIR * self.ranks), 1))
        out: list[int] = []
        seconds = 0.0
        while (
            self.queue
            and len(out) < most_units
            and (seconds < self.least or (len(out) < most and seconds < self.hold))
        ):
            seconds += max(float(self.predicted[self.queue[-1]]), FASTEST)
            out.append(self.queue.pop())
        return out

    def first(self) -> list[list[int]]:
        """Return what each rank begins with, rank 0 with nothing: it takes its own.

        No more than an even share, however short: nobody has asked, rank 0 is free.
        """
        even = min(MOST, max(len(self.queue) // self.ranks, 1))
        return [[], *(self.bundle(even) for _ in range(self.ranks - 1))]

    @property
    def may_grow(self) -> bool:
        """Whether units that are at work may lead to others."""
        return False

    def hear(self, unit: int, ends: Sequence[Any]) -> None:
        """Be told how the cases of a finished unit ended."""

    def drop(self) -> None:
        """Hand out nothing more."""
        del self.queue[:]

    def finished(self, unit: int, seconds: float) -> None:
        """Learn that a unit has taken some seconds; sort anew where that pays."""
        self.unfinished[unit] = False
        self.told += float(self.predicted[unit])
        self.took += seconds
        self.costs.learn(self.units[unit], seconds)
        self.learned += 1
        self.left -= 1
        if self.queue and self.learned * EVERY >= self.left <= SORTED_ANEW:
            self._sort_anew()

    def _sort_anew(self) -> None:
        begun = np.flatnonzero(self.unfinished)
        self.predicted[begun] = self._predict(begun)
        self.queue = array("q", self._ordered(np.array(self.queue)))
        self.stale, self.learned = False, 0

    def seconds_left(self) -> float:
        """Return the seconds of one core that unfinished units are expected to take."""
        missed = self.took / self.told if self.told > 0.0 and self.stale else 1.0
        return float(self.predicted[self.unfinished].sum()) * missed

    def _predict(self, chosen: np.ndarray) -> np.ndarray:
        """Return the predicted seconds of units."""
        if not len(chosen):
            return np.zeros(0)
        if isinstance(self.units, Singles):
            return self.costs.predict(self.units.cases[chosen])
        cases = [self.units[unit] for unit in chosen]
        sizes = np.array([len(unit) for unit in cases])
        flat = np.fromiter((c for unit in cases for c in unit), np.intp, sizes.sum())
        starts = np.concatenate([[0], np.cumsum(sizes)[:-1]])
        return np.asarray(np.add.reduceat(self.costs.predict(flat), starts))

    def _ordered(self, chosen: np.ndarray) -> bytes:
        """Return units by predicted seconds, the longest last, as 8 bytes each."""
        order = scattered(len(chosen))
        for key in (self.predicted[chosen], self.turn[chosen]):
            if len(key) and (key != key[0]).any():
                order = order[np.argsort(key[order], kind="stable")]
        return np.asarray(chosen[order], dtype=np.int64).tobytes()


class Questions:
    """Open questions of the workers; no messages, no clock.

    A worker asks ahead and is answered at once, but for the last units, one a rank:
    those wait for whoever has nothing left to do, else a rank would keep one behind
    the long case that it is at, while others idle.

    Parameters
    ----------
    agenda : units to hand out
    ranks : that share the work, rank 0 included
    """

    def __init__(self, agenda: Agenda, ranks: int) -> None:
        self.agenda, self.ranks = agenda, ranks
        self.open: dict[int, None] = {}  # ranks in the order of their questions
        self.idle: dict[int, None] = {}  # those of them that have nothing left to do

    def ask(self, rank: int) -> Answers:
        """Return the answers due now that a rank has asked ahead."""
        self.open[rank] = None
        return self._answer(rank) if len(self.agenda) > self.ranks else self.rest()

    def hungry(self, rank: int) -> Answers:
        """Return the answers due now that a rank has nothing left to do.

        It may have been answered meanwhile: then nothing is due to it.
        """
        if rank in self.open:
            self.idle[rank] = None
        return self.rest()

    def rest(self) -> Answers:
        """Return the answers due to idle ranks, or to all once nothing is left."""
        due: Answers = []
        while self.agenda and self.idle:
            due += self._answer(next(iter(self.idle)))
        if self.agenda or self.agenda.may_grow:
            return due
        waiting, self.open, self.idle = list(self.open), {}, {}
        return due + [(rank, []) for rank in waiting]

    def _answer(self, rank: int) -> Answers:
        del self.open[rank]
        self.idle.pop(rank, None)
        return [(rank, self.agenda.bundle())]
