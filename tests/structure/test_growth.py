"""Bands of speed in which a rotor's free motion grows, against all its eigenvalues."""

from dataclasses import replace

import numpy as np
import pytest

from hpcwhirl.analysis.critical import critical_of_waves
from hpcwhirl.reduction.bodies import rotor_model
from hpcwhirl.reduction.growth import _peaks, growth_at, stability
from hpcwhirl.reduction.waves import (
    largest_growth,
    quadratic_roots,
    turning_matrices,
    unbalance_speeds,
)
from hpcwhirl.scene import Rotor
from hpcwhirl.scene.bearing_tables import HEAD

pytestmark = pytest.mark.turns

BLADES = 5
USUAL = {"blades": BLADES, "elements": 3}
TABLE = ";".join([
    HEAD, "60,2e6,3e5,-3e5,2e6,900,0,0,900", "400,9e6,1e6,-1e6,9e6,1500,0,0,1500",
    "700,2e7,2e5,-2e5,2e7,4000,0,0,4000",
])  # fmt: skip
ROTORS = {
    "table": {"bearing": TABLE, "suspension_damping": -1.0},
    "unequal on a table": {
        "bearing": TABLE,
        "suspension_damping": -1.0,
        "mistuning": [0.02, 0.0, -0.01, 0.0, 0.0],
    },
    "soft": {"centre_stiffness": 1e6, "damping": 0.02, "suspension_damping": 0.1},
    "no static damper": {"suspension_damping": -1.0},
    "cross coupling": {"cross_coupling": 3e6},
    "stable": {"suspension_damping": 0.3, "damping": 1e-3},
    "clamped": {"centre": "clamped"},
    "unequal": {"suspension_damping": -1.0, "mistuning": [0.02, 0.0, -0.01, 0.0, 0.0]},
}


def rotor(name):
    return rotor_model(Rotor(**{**USUAL, **ROTORS[name]}), 4 * BLADES, "full")


def growth_of_all(model, speed):
    """Return the largest growth rate, 1/s, from the matrices of the whole rotor."""
    gyro, damping, stiffness, push = turning_matrices(model, speed, BLADES)
    both = np.hstack([damping + gyro, stiffness + push])
    rate, held = np.hsplit(np.linalg.solve(model.mass, both), 2)
    return float(quadratic_roots(rate, held).real.max())


def grows(found, speed):
    return any(band.start <= speed <= band.end for band in found.bands)


@pytest.mark.parametrize("name", ROTORS)
def test_bands_are_where_an_eigenvalue_of_the_whole_rotor_grows(name):
    model = rotor(name)
    found = stability(model, BLADES, 900.0)
    assert found.span.high >= 900.0 or found.span.ends in {"stiffness", "table"}
    edges = [edge for band in found.bands for edge in (band.start, band.end)]
    for speed in np.linspace(found.span.low, found.span.high, 41)[:-1]:
        near = [edge for edge in edges if abs(edge - speed) < 1e-3 * found.span.high]
        if not near:
            assert grows(found, speed) == (growth_of_all(model, speed) > 1e-4)
            assert (growth_at(model, BLADES, speed) > 1e-4) == grows(found, speed)


@pytest.mark.parametrize("name", ["soft", "unequal"])
def test_growth_is_zero_at_the_ends_of_a_band_and_largest_inside(name):
    model = rotor(name)
    for band in stability(model, BLADES, 900.0).bands:
        ends = [band.start, band.end] if band.ends else [band.start]
        for end in ends:
            assert abs(growth_of_all(model, end)) < 5e-3 * band.growth
        inside = np.linspace(band.start, band.end, 9)
        most = max(growth_of_all(model, speed) for speed in inside)
        assert band.growth >= most * (1 - 1e-3)
        assert band.growth == pytest.approx(growth_of_all(model, band.speed), rel=1e-3)


def test_two_bands_are_told_apart_though_a_search_to_four_frequencies_misses_both():
    model = rotor_model(Rotor(**ROTORS["soft"]), 110, "full")
    first, second = stability(model, 22, 900.0).bands
    assert [first.start, first.end] == pytest.approx([400.8, 501.8], abs=0.2)  # oracle
    assert first.ends
    assert first.end < second.start
    assert first.start > 4 * 91.0  # rad/s, the lowest frequency at rest
    assert (first.family, first.nodal_diameter) == ("suspension", 1)
    assert 0.0 < first.frequency < first.speed


def test_nothing_is_told_beyond_a_bearings_table():
    model = rotor("table")
    found = stability(model, BLADES, 2000.0)
    assert found.span == (60.0, 700.0, "table")
    assert all(60.0 <= band.start <= band.end <= 700.0 for band in found.bands)
    assert all(60.0 <= speed <= 700.0 for speed in unbalance_speeds(model, 2000.0))
    rows = critical_of_waves(model, {1: 250.0, 2: 900.0}, 12)
    assert all(60.0 <= r["speed"] <= 700.0 for r in rows if r["nodal_diameter"] == 1)
    assert {row["nodal_diameter"] for row in rows} == {1, 2}


def test_a_rotor_taken_as_a_whole_has_the_bands_of_its_diameters():
    model = rotor("soft")
    whole = replace(model, spin=replace(model.spin, waves=()))
    one, other = (stability(m, BLADES, 900.0).bands for m in (model, whole))
    assert len(one) == len(other)
    for band, same in zip(one, other, strict=True):
        assert (band.start, band.end, band.growth) == pytest.approx(
            (same.start, same.end, same.growth), rel=1e-5
        )
        assert (band.family, band.nodal_diameter) == (same.family, same.nodal_diameter)


@pytest.mark.parametrize("share", [0.3, 0.1, 0.02])
def test_a_summit_between_two_samples_is_looked_for(share):
    """A parabola that rises above 0 over a share of the distance of two samples."""
    at = np.arange(7.0)
    rates = (share / 2) ** 2 - (at - 3.5) ** 2
    assert (rates < 0.0).all()
    assert set(_peaks(rates[:, None])) & {3, 4}


@pytest.mark.parametrize("speed", [0.0, 300.0, 700.0])
@pytest.mark.parametrize("name", ROTORS)
def test_growth_is_that_of_all_waves_or_zero(name, speed):
    model = rotor(name)
    rate = largest_growth(model, BLADES, speed)
    assert rate == pytest.approx(growth_of_all(model, speed), rel=1e-6, abs=1e-6)
    assert growth_at(model, BLADES, speed) == pytest.approx(max(rate, 0.0), abs=1e-6)
