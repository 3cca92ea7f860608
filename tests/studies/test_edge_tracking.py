"""Edge tracking of systems whose boundary between two basins is known."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm

from hpcwhirl.studies.edge_tracking import (
    HIGH,
    LOW,
    OPEN,
    LostEdgeError,
    bisect,
    rate_of,
    track,
)

pytestmark = pytest.mark.turns

UNSTABLE, TURNING = 1.07, -1.6


class Flow:
    """An ODE y' = f(y), marched by Runge's and Kutta's fourth-order step."""

    step, stride = 0.05, 4

    def __init__(self, rate, ends, longest=1200):
        self.rate, self.ends, self.longest = rate, ends, longest
        self.asked = 0

    def marched(self, y, steps):
        for _ in range(steps):
            a = self.rate(y)
            b = self.rate(y + 0.5 * self.step * a)
            c = self.rate(y + 0.5 * self.step * b)
            d = self.rate(y + self.step * c)
            y = y + self.step / 6 * (a + 2 * b + 2 * c + d)
            if self.ends(y):
                break
        return y

    def between(self, low, high, share):
        return low + share * (high - low)

    def distance(self, low, high):
        return float(np.linalg.norm(high - low) / np.linalg.norm(low))

    def ahead(self, y):
        return self.marched(y, self.stride)

    def side(self, y):
        self.asked += 1
        return self.ends(self.marched(y, self.longest))


def cycle(y):
    """Return the rates of an unstable cycle r = UNSTABLE beside a decaying direction.

    Below it spirals to rest, above it grows: the dry whip in small.
    """
    x, v, w = y
    r = np.hypot(x, v)
    grow = 0.3 * (r / UNSTABLE - 1.0)
    return np.array([grow * x - TURNING * v, TURNING * x + grow * v, x - w])


def told(y):
    r = np.hypot(y[0], y[1])
    return LOW if r < 0.5 else HIGH if r > 2.0 else OPEN


def wells(y):
    """Duffing's oscillator with two wells: the saddle between them is at rest."""
    x, v = y
    return np.array([v, x - x**3 - 0.5 * v])


def well(y):
    x, v = y
    calm = 0.5 * v**2 - 0.5 * x**2 + 0.25 * x**4 < -0.05
    return OPEN if not calm else (LOW if x < 0 else HIGH)


def test_a_bisection_ends_on_either_side_of_the_boundary():
    flow = Flow(wells, well)
    low, high = np.array([-1.5, 0.3]), np.array([0.9, 0.8])
    assert (flow.side(low), flow.side(high)) == (LOW, HIGH)
    pair, made = bisect(flow, low, high, 1e-8)
    assert pair.distance <= 1e-8
    assert 20 < made < 40
    assert (flow.side(pair.low), flow.side(pair.high)) == (LOW, HIGH)


def test_the_unstable_cycle_is_found_from_states_far_from_it():
    flow = Flow(cycle, told)
    ends = np.array([0.6, 0.0, 1.0]), np.array([1.6, 0.4, -1.0])
    found = track(flow, ends, 150, 1e-6, 1e-4)
    late = np.array([y for piece in found.pieces for y in piece][75:])
    radius = np.hypot(late[:, 0], late[:, 1])
    assert radius == pytest.approx(np.full(len(late), UNSTABLE), rel=2e-4)
    turns = [np.diff(np.unwrap(np.arctan2(*np.array(piece)[:, 1::-1].T)))
             for piece in found.pieces[-3:]]  # fmt: skip
    span = flow.step * flow.stride
    assert np.concatenate(turns) == pytest.approx(TURNING * span, rel=1e-3)
    # r' = 0.3 r (r / r* - 1): the sides part as e^{0.3 t}
    assert found.rate.rate == pytest.approx(0.3 * span, rel=0.02)
    assert found.widened == 0


def test_the_edge_between_two_wells_is_the_saddle():
    flow = Flow(wells, well)
    found = track(flow, (np.array([-1.5, 0.3]), np.array([0.9, 0.8])), 100, 1e-6, 1e-3)
    assert np.abs(found.pieces[-1][-1]).max() < 1e-3


def test_pieces_join_within_the_distance_at_which_they_are_bisected_again():
    flow = Flow(cycle, told)
    far = 1e-4
    ends = np.array([0.6, 0.0, 1.0]), np.array([1.6, 0.4, -1.0])
    found = track(flow, ends, 160, 1e-5, far)
    assert len(found.pieces) > 2
    for piece, after in pairwise(found.pieces):
        assert flow.distance(piece[-1], after[0]) <= 1.5 * far
    assert sum(len(piece) - 1 for piece in found.pieces) == 160


def test_a_side_that_was_told_wrongly_is_found_again():
    class Mistaken(Flow):
        def side(self, y):
            told = super().side(y)
            return HIGH if self.asked == 12 else told  # once, of a low state

    flow = Mistaken(cycle, told)
    ends = np.array([0.6, 0.0, 1.0]), np.array([1.6, 0.4, -1.0])
    found = track(flow, ends, 150, 1e-6, 1e-4)
    assert found.widened > 0
    last = found.pieces[-1][-1]
    assert np.hypot(last[0], last[1]) == pytest.approx(UNSTABLE, rel=1e-3)


def test_a_side_that_is_not_told_ends_the_bisection():
    flow = Flow(cycle, told, longest=300)
    pair, _ = bisect(flow, np.array([0.6, 0.0, 0.0]), np.array([1.6, 0.0, 0.0]), 1e-9)
    assert 1e-9 < pair.distance < 0.2
    # far from the boundary nothing is lost: both sides end apart
    flow = Flow(cycle, told)
    assert flow.side(pair.low) == LOW
    assert flow.side(pair.high) == HIGH


def test_states_of_one_basin_lose_the_edge():
    flow = Flow(cycle, told)
    with pytest.raises(LostEdgeError, match="boundary was lost"):
        track(flow, (np.array([0.2, 0.0, 0.0]), np.array([0.201, 0.0, 0.0])), 200)


class Saddle:
    """A saddle: one direction grows as e^t, others decay as e^{-t / 20} to e^{-t}.

    Its directions are not orthogonal. If rough, the rate at which the first one grows
    varies as a random process of variance rough / dt over 0.2, with the mean 1. A state
    is (number of strides, place).
    """

    step = 0.05

    def __init__(self, random, rough):
        pairs = int(random.integers(2, 5))
        own = np.zeros((2 * pairs + 1, 2 * pairs + 1))
        own[0, 0] = 1.0
        for at in range(1, 2 * pairs, 2):
            slow, turn = random.uniform(0.05, 1.0), random.uniform(0.0, 20.0)
            own[at : at + 2, at : at + 2] = [[-slow, turn], [-turn, -slow]]
        shapes = random.normal(size=own.shape)
        back = np.linalg.solve(shapes, np.eye(len(own)))
        self.forward, self.across = expm(shapes @ own @ back * self.step), back[0]
        self.growing = np.outer(shapes[:, 0], back[0])
        self.place = 3.0 * random.normal(size=len(own))
        kept = math.exp(-self.step / 0.2)
        self.more = [0.0]
        for kick in random.normal(size=1000) * rough * math.sqrt(1.0 - kept**2):
            self.more.append(kept * self.more[-1] + kick)
        ends = random.normal(size=(2, len(own)))
        ends *= np.sign(ends @ self.across)[:, None] * [[-1.0], [1.0]]
        self.ends = tuple((0, end) for end in ends)

    def between(self, low, high, share):
        return low[0], low[1] + share * (high[1] - low[1])

    def distance(self, low, high):
        size = np.linalg.norm(self.place + low[1])
        return float(np.linalg.norm(high[1] - low[1]) / size)

    def ahead(self, state):
        made, y = state
        y = self.forward @ y
        return made + 1, y + (math.exp(self.more[made]) - 1.0) * (self.growing @ y)

    def side(self, state):
        return LOW if self.across @ state[1] < 0.0 else HIGH


@pytest.mark.parametrize(
    ("rough", "span", "far"), [(0.0, 20.0, 0.025), (0.1, 20.0, 0.6)]
)
def test_the_interval_of_the_rate_holds_for_saddles_of_known_rate(rough, span, far):
    """Of 60, for 95 % of them within chance: 3 standard errors."""
    rates = []
    for seed in range(60):
        saddle = Saddle(np.random.default_rng(seed), rough)
        found = track(saddle, saddle.ends, round(span / saddle.step))
        rates.append(found.rate)
    rate, low, high = np.array(rates).T / Saddle.step
    covered = np.mean((low <= 1.0) & (high >= 1.0))
    assert covered >= 0.95 - 3.0 * (0.05 * 0.95 / 60) ** 0.5
    assert np.quantile(np.abs(rate - 1.0), 0.9) < far
    assert np.median(high - low) < 4.0 * far
    assert np.median(rate) == pytest.approx(1.0, abs=0.5 * far)


def test_a_rate_of_one_piece_has_no_interval():
    rate, *ends = rate_of([[1.0, 2.0, 4.0, 8.0, 16.0]], 3.0)
    assert rate == pytest.approx(math.log(2.0))
    assert all(map(math.isnan, ends))


@given(rises=st.lists(st.lists(st.floats(-1.0, 2.0), min_size=2), min_size=2))
def test_what_leaves_an_edge_separates_whatever_the_scatter(rises):
    """Each piece goes from near to far; between, distances may fall."""
    pieces = [np.exp(np.cumsum([0.0, *own, 5.0 - sum(own)])).tolist() for own in rises]
    found = rate_of(pieces, 1e-3)
    assert 0.0 < found.low <= found.rate <= found.high < math.inf
