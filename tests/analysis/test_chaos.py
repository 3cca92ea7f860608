"""Exponents, periods and K of maps and flows that are known."""

import math

import numpy as np
import pytest

from hpcwhirl.analysis.chaos import (
    BLOCKS,
    RETURNS,
    exponent,
    growths,
    returns,
    zero_one,
)

DELTA = 1e-9


class Pair:
    """Twins of a map of the plane or the line, each interval some steps of it."""

    def __init__(self, step, start, steps=1, delta=DELTA):
        self.step, self.steps = step, steps
        self.one = np.array(start, float)
        self.other = self.one + delta / math.sqrt(len(self.one))

    def advance(self):
        for _ in range(self.steps):
            self.one, self.other = self.step(self.one), self.step(self.other)
        return float(np.linalg.norm(self.other - self.one))

    def draw(self, factor):
        self.other = self.one + factor * (self.other - self.one)


def logistic(r):
    return lambda x: r * x * (1 - x)


def henon(z):
    return np.array([1 - 1.4 * z[0] ** 2 + z[1], 0.3 * z[0]])


def lorenz(z, h=0.01):
    def rate(z):
        x, y, w = z
        return np.array([10 * (y - x), x * (28 - w) - y, x * y - 8 / 3 * w])

    a = rate(z)
    b = rate(z + h / 2 * a)
    c = rate(z + h / 2 * b)
    return z + h / 6 * (a + 2 * b + 2 * c + rate(z + h * c))


def series(step, start, count, skip=500):
    values, x = np.zeros(count), start
    for i in range(skip + count):
        x = step(x)
        if i >= skip:
            values[i - skip] = x
    return values


IRRATIONAL = math.sqrt(2) / 7  # of a turn


def circle(count, turn=IRRATIONAL):
    return np.cos(2 * np.pi * turn * np.arange(count))


KNOWN = {  # name: (map, start, steps of an interval, time of one, intervals, exponent)
    "logistic": (logistic(4.0), [0.3], 1, 1.0, 20000, math.log(2)),
    "henon": (henon, [0.1, 0.1], 2, 2.0, 10000, 0.41922),
    "lorenz": (lorenz, [1.0, 2.0, 20.0], 25, 0.25, 8000, 0.9056),
}


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["logistic", "henon", pytest.param("lorenz", marks=pytest.mark.evidence)]
)
def test_known_exponents_are_found_within_two_percent(name):
    step, start, steps, interval, count, truth = KNOWN[name]
    pair = Pair(step, start, steps)
    found = exponent(growths(pair, DELTA, count, settle=100), interval)
    assert found.rate == pytest.approx(truth, rel=0.02)
    assert abs(found.rate - truth) < 2 * found.error
    assert found.error < 0.02 * truth


@pytest.mark.turns
def test_an_interval_covers_the_exponent_in_about_the_told_share():
    """Of a map whose growths are independent, and of one whose are not."""
    truth, covered = math.log(2), 0
    for trial in range(100):
        pair = Pair(logistic(4.0), [0.05 + 0.009 * trial])
        rate, error = exponent(growths(pair, DELTA, 400, settle=20), 1.0)
        covered += abs(rate - truth) < error
    assert 85 <= covered <= 100


def test_a_motion_that_decays_has_a_negative_exponent():
    turn = 0.9 * np.array([[0.8, -0.6], [0.6, 0.8]])
    rate, error = exponent(growths(Pair(lambda z: turn @ z, [1, 0]), DELTA, 100), 0.5)
    assert rate == pytest.approx(2 * math.log(0.9), rel=1e-6)
    assert error < 1e-6
    rate, error = exponent(growths(Pair(logistic(3.2), [0.3]), DELTA, 200, 50), 1.0)
    truth = 0.5 * math.log(abs((3.2 * (1 - 2 * 0.513045)) * (3.2 * (1 - 2 * 0.799455))))
    assert rate == pytest.approx(truth, abs=1e-3)
    assert rate + error < 0


def test_equal_twins_and_turning_ones_have_none_above_zero():
    same = Pair(logistic(4.0), [0.3], delta=0.0)
    rate, error = exponent(growths(same, DELTA, 40), 1.0)
    assert rate + error < 0
    turn = np.array([[0.8, -0.6], [0.6, 0.8]])
    rate, error = exponent(growths(Pair(lambda z: turn @ z, [1, 0]), DELTA, 40), 1.0)
    assert rate - error <= 0 <= rate + error + 1e-6


def test_too_few_growths_have_no_exponent():
    assert all(map(math.isnan, exponent(np.zeros(2 * BLOCKS - 1), 1.0)))
    assert all(map(math.isnan, exponent(np.full(100, math.inf), 1.0)))


@pytest.mark.parametrize(("r", "period"), [(2.9, 1), (3.2, 2), (3.5, 4), (3.83, 3)])
def test_periods_of_the_logistic_map(r, period):
    number, distance = returns(series(logistic(r), 0.3, 60)[:, None])
    assert number == period
    assert distance < 1e-3


def test_curves_and_chaos_do_not_return():
    nearly = circle(100, turn=1 / 7 + 1e-3)  # each 7th point is near the one before
    assert returns(nearly[:, None])[1] > 0.1
    assert returns(circle(100, turn=1 / 7)[:, None]) == (7, pytest.approx(0, abs=1e-9))
    assert returns(series(logistic(4.0), 0.3, 100)[:, None])[1] > 0.1


def test_a_section_needs_so_many_points_to_tell_that_they_return():
    assert returns(np.zeros((RETURNS - 1, 1))) == (0, math.inf)
    assert returns(np.zeros((RETURNS, 1))) == (1, 0.0)


@pytest.mark.turns
def test_zero_one_tells_chaos_from_order():
    assert zero_one(series(logistic(4.0), 0.3, 400)) > 0.9
    assert zero_one(series(logistic(3.97), 0.3, 400)) > 0.9
    assert abs(zero_one(series(logistic(3.5), 0.3, 400))) < 0.1
    assert abs(zero_one(circle(400))) < 0.1
    assert zero_one(np.ones(400)) == pytest.approx(0.0, abs=0.1)
    assert math.isnan(zero_one(np.ones(20)))


@pytest.mark.turns
def test_close_samples_of_a_smooth_chaotic_motion_look_regular():
    z, found = np.array([1.0, 2.0, 20.0]), []
    for _ in range(4000):
        z = lorenz(z)
        found.append(z[0])
    assert zero_one(np.array(found)[:1000]) < 0.5
    assert zero_one(np.array(found)[::20]) > 0.7
