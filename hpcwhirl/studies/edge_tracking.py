"""Edge tracking in any dynamic system: the motion on the boundary between two basins.

The basin of a motion is the set of states from which the system ends on it. A stride is
the time by which the system is integrated at once.

Two states on different sides of the boundary are bisected along the straight line
between them until they are near each other. Both are then integrated; while they stay
close, the boundary lies between them. When they have separated, they are bisected
again. The motion followed in this way approaches the edge state, which attracts motions
on the boundary but is itself a saddle of the flow
(J. D. Skufca, J. A. Yorke, B. Eckhardt 2006, Phys. Rev. Lett. 96, 174101; T. M.
Schneider, B. Eckhardt, J. A. Yorke 2007, Phys. Rev. Lett. 99, 034502).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, NamedTuple, Protocol, TypeVar

import numpy as np
from scipy.special import stdtrit

from hpcwhirl.arrays import Floats
from hpcwhirl.errors import WhirlError

State = TypeVar("State")
LOW, OPEN, HIGH = -1, 0, 1  # sides of the boundary; OPEN: not known
WIDENED = 10  # largest number of times that a pair is widened to find the boundary
HALVED = 60  # largest number of bisections of a pair, down to round-off
BLOCKS = 8  # blocks of a motion from which the interval of its rate follows
CONFIDENCE = 0.95  # of that interval
WIDEST = 50.0  # largest distance of the lower end from a rate, of their logarithms


class LostEdgeError(WhirlError):
    """The boundary of a basin was lost: both states are on the same side of it."""


class Motions(Protocol[State]):
    """A dynamic system whose states can be interpolated, compared and integrated."""

    def between(self, low: State, high: State, share: float) -> State:
        """Return the state low + share (high - low) on the line through two states.

        low, high, share : two states at the same time; number, also below 0 or above 1
        """

    def distance(self, low: State, high: State) -> float:
        """Return the distance of two simultaneous states, relative to their size."""

    def ahead(self, state: State) -> State | None:
        """Integrate the system from a state by one stride; return the state reached.

        None if the motion ends before, such as at the amplitude limit.
        """

    def side(self, state: State) -> int:
        """Return on which side of the boundary a state is: `LOW`, `HIGH`, or `OPEN`.

        The motion from the state is integrated until it shows on which of two motions
        it ends, such as damped or sustained; `OPEN`: that is not known.
        """


@dataclass(frozen=True)
class Pair(Generic[State]):
    """Two simultaneous states on different sides of the boundary of a basin.

    Attributes
    ----------
    low, high : state on the side LOW, and on the side HIGH
    distance : their distance, relative to their size
    """

    low: State
    high: State
    distance: float


class Rate(NamedTuple):
    """A rate > 0, and the ends of its confidence interval of level `CONFIDENCE`.

    Attributes
    ----------
    rate : per stride
    low, high : ends of its interval, 0 < low < rate < high; NaN if it is not known
    """

    rate: float
    low: float
    high: float


@dataclass(frozen=True)
class Tracked(Generic[State]):
    """A motion tracked along the boundary between two basins.

    Attributes
    ----------
    pieces : states on the side LOW, a stride apart, from one bisection of the pair to
        the next; a piece begins near the end of the one before it, not exactly there
    last : pair of states at the end
    rate : mean exponential rate, per stride, at which the states of a pair separate,
        with its interval
    halvings : number of times that the distance of a pair was halved
    widened : number of times that the pair had to be widened to contain the boundary
        again
    """

    pieces: list[list[State]]
    last: Pair[State]
    rate: Rate
    halvings: int
    widened: int


@dataclass
class _Count:
    halvings: int = 0
    widened: int = 0


def bisect(
    motions: Motions[State], low: State, high: State, near: float
) -> tuple[Pair[State], int]:
    """Return a pair of states, brought nearer to each other, and how often bisected.

    The state halfway between both replaces the one on its side of the boundary. The
    states stay farther apart than `near` if the side of a middle state is unknown, or
    after `HALVED` bisections.

    Parameters
    ----------
    motions : the system
    low, high : states on the sides LOW and HIGH, without check
    near : distance, relative to the states' size, at which bisection ends
    """
    apart, made = motions.distance(low, high), 0
    while apart > near and made < HALVED:
        middle = motions.between(low, high, 0.5)
        made += 1
        side = motions.side(middle)
        if side == OPEN:
            break
        low, high = (middle, high) if side == LOW else (low, middle)
        apart = motions.distance(low, high)
    return Pair(low, high, apart), made


def track(
    motions: Motions[State],
    ends: tuple[State, State],
    strides: int,
    near: float = 1e-6,
    far: float = 1e-3,
    tell: Callable[[int], None] | None = None,
) -> Tracked[State]:
    """Follow the motion on the boundary between two basins, and return it.

    Parameters
    ----------
    motions : the system
    ends : a state on the side LOW and one on HIGH, at the same time
    strides : number of strides for which the motion is followed
    near, far : distance of two states, relative to their size, at which bisection ends,
        and beyond which they are bisected again
    tell : called with the number of strides so far, to show progress

    Raises
    ------
    LostEdgeError
        if both states have come to one side, or separate within a stride
    """
    count = _Count()
    pair, count.halvings = bisect(motions, *ends, near)
    pieces: list[list[State]] = []
    distances: list[list[float]] = []
    made = 0
    while made < strides:
        path, apart, pair = _shadow(motions, pair, far, strides - made)
        if len(path) < 2:
            raise LostEdgeError(
                "the states parted, or their motion ended, within a stride from a "
                f"distance of {pair.distance:.3g}: bisect further (smaller `near`)"
            )
        pieces.append(path)
        distances.append(apart)
        made += len(path) - 1
        if tell:
            tell(made)
        if made < strides:
            held = _held(motions, pair, count, math.inf)
            pair, halved = bisect(motions, held.low, held.high, near)
            count.halvings += halved
    pair = _held(motions, pair, count, 2.0 * max(far, pair.distance))
    rate = rate_of(distances, math.sqrt(near * far))
    return Tracked(pieces, pair, rate, count.halvings, count.widened)


def rate_of(distances: list[list[float]], middle: float) -> Rate:
    """Return the rate at which a pair of states separates, with its interval.

    The first pair also differs along the boundary, where differences decay: its rate
    counts from where its distance first exceeds `middle`. Later pairs lie on the line
    through the one before, along which it has separated, and count from their
    beginning, since a piece ends where the pair happens to separate fast: its later
    part alone is faster than the mean. (The sum of rises up to a stopping time over the
    sum of times is unbiased, by Wald's identity.)

    The interval is Student's; its half width is the larger of those from the pieces, as
    of a ratio of sums, and from `BLOCKS` blocks of strides, which differ if the rate
    drifts. States that leave an edge separate, so their rate is above 0: the lower end
    is that of the rate's logarithm. A rate that varies for longer than a piece shows
    only between pieces: a single one has no interval.

    distances : of the pair, a stride apart, in each piece
    """
    first = np.log(distances[0])
    over = np.flatnonzero(np.asarray(distances[0][:-1]) > middle)
    begun = int(over[0]) if len(over) else (len(first) - 1) // 2
    later = [np.diff(np.log(part)) for part in distances[1:]]
    pieces = [np.diff(first[begun:]), *later]
    rises = np.concatenate(pieces)
    rate = float(rises.mean())
    if len(pieces) < 2:
        return Rate(rate, math.nan, math.nan)
    blocks = np.array_split(rises, min(BLOCKS, len(rises)))
    error = max(_error_of(parts, rate) for parts in (pieces, blocks))
    least = math.exp(-min(error / rate, WIDEST))
    return Rate(rate, rate * least, rate + error)


def _error_of(parts: list[Floats], rate: float) -> float:
    """Return Student's half width of the interval of a rate, from parts of a motion.

    parts : rises of the log distance by stride, in n >= 2 parts
    rate : sum of all rises over the number of strides
    """
    count = len(parts)
    width = float(stdtrit(count - 1, 0.5 + CONFIDENCE / 2))
    missed = np.array([part.sum() - rate * len(part) for part in parts])
    strides = sum(map(len, parts))
    spread = math.sqrt(count / (count - 1) * float(missed @ missed))
    return width * spread / strides


def _shadow(
    motions: Motions[State], pair: Pair[State], far: float, strides: int
) -> tuple[list[State], list[float], Pair[State]]:
    """Integrate a pair of states until they have separated by more than `far`.

    strides : largest number of strides

    Returns
    -------
    states on the side LOW, a stride apart; distances of the pair at these times; and
    the pair at the end
    """
    path, apart = [pair.low], [pair.distance]
    while len(path) == 1 or (len(path) <= strides and pair.distance <= far):
        low, high = motions.ahead(pair.low), motions.ahead(pair.high)
        if low is None or high is None:
            break
        pair = Pair(low, high, motions.distance(low, high))
        path.append(low)
        apart.append(pair.distance)
    return path, apart, pair


def _held(
    motions: Motions[State], pair: Pair[State], count: _Count, most: float
) -> Pair[State]:
    """Return a pair of states with the boundary between them.

    If both have come to one side, the pair is widened along the line through both until
    the boundary is between them again.

    count : counter of widenings, which is increased
    most : largest distance of the pair, relative to the states' size; LostEdgeError is
        raised beyond it, or after `WIDENED` widenings
    """
    for _ in range(WIDENED):
        sides = motions.side(pair.low), motions.side(pair.high)
        if sides == (LOW, HIGH):
            return pair
        count.widened += 1
        wide = pair.low, pair.high
        low = wide[0] if sides[0] == LOW else motions.between(*wide, -1.0)
        high = wide[1] if sides[1] == HIGH else motions.between(*wide, 2.0)
        pair = Pair(low, high, motions.distance(low, high))
        if pair.distance > most:
            break
    msg = f"the boundary was lost: states {pair.distance:.3g} apart end on one side: "
    raise LostEdgeError(msg + "use a longer `look`, after which sides are determined")
