"""Laws of shaft lines: closed forms of beams and of rotors, a published rotor."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from rotor_table import nelson_mcvaugh
from rotors import line_of_data

from hpcwhirl.reduction.shaft_whirl import (
    Held,
    at_node,
    critical_speeds,
    held_by,
    undamped_critical_speeds,
    whirl_frequencies,
    whirls,
)
from hpcwhirl.reduction.supports import Support
from hpcwhirl.structure.shaft import ShaftDisk, ShaftLine, Tube, line_matrices

YOUNG, DENSITY, POISSON = 2.11e11, 7810.0, 0.3
SHEAR = YOUNG / 2 / (1 + POISSON)
RIGID = 1e14  # N/m, of a support that holds a node


def rod(length: float, diameter: float, elements: int, **changes: float) -> ShaftLine:
    """Return a solid shaft of equal elements."""
    usual = Tube(
        length / elements, (diameter,) * 2, (0.0, 0.0), YOUNG, DENSITY, SHEAR, POISSON
    )
    return ShaftLine((replace(usual, **changes),) * elements)


def springs(stiffness: float, *nodes: int, damping: float = 0.0) -> tuple[Held, ...]:
    """Return equal springs and dampers on the ground at nodes."""
    own = Support(stiffness=stiffness + 0j, damping=damping + 0j)
    return tuple(at_node(node, own) for node in nodes)


def simply_supported(length: float, d: float, m: int, speed: float) -> list[float]:
    """Return the two lowest frequencies with m half waves of a Timoshenko shaft, rad/s.

    With Z ~ sin k s, Phi ~ cos k s, k = m pi / L and a = kappa G A, they are roots of

    (rho A w^2 - a k^2) (rho I w (w - 2 Omega) - E I k^2 - a) = a^2 k^2.
    """
    area, second, k = math.pi * d**2 / 4, math.pi * d**4 / 64, m * math.pi / length
    sheared = 6 * (1 + POISSON) / (7 + 6 * POISSON) * SHEAR * area
    swing = DENSITY * second * np.array([1.0, -2 * speed, 0.0])
    swing[2] = -YOUNG * second * k**2 - sheared
    moved = np.poly1d([DENSITY * area, 0.0, -sheared * k**2])
    roots = (moved * np.poly1d(swing) - (sheared * k) ** 2).roots.real
    return sorted(sorted(roots, key=abs)[:2])


@pytest.mark.turns
@pytest.mark.parametrize("speed", [0.0, 900.0])
def test_a_simply_supported_shaft_whirls_as_in_timoshenkos_closed_form(speed):
    line = rod(1.0, 0.1, 40)
    found = [
        w.frequency * (1 if w.is_anticlockwise else -1)
        for w in whirls(line, springs(RIGID, 0, 40), speed)[:4]
    ]
    expected = [w for m in (1, 2) for w in simply_supported(1.0, 0.1, m, speed)]
    if speed == 0.0:  # a pair of equal frequency has no sense
        found, expected = np.abs(found), np.abs(expected)
    assert sorted(found) == pytest.approx(sorted(expected), rel=1e-4)


def test_a_slender_free_shaft_has_the_frequencies_of_bernoullis_beam():
    line = rod(1.0, 0.01, 16, shear=math.inf, rotary=False)
    scale = math.sqrt(YOUNG / DENSITY) * 0.01 / 4
    found = whirl_frequencies(line, (), 0.0) / scale
    expected = np.array([4.73004, 7.85320, 10.99561]) ** 2
    assert found[found > 1.0][:6:2] == pytest.approx(expected, rel=2e-4)


def test_tapers_and_steps_have_the_mass_and_the_inertia_of_their_solids():
    cone = Tube(0.4, (0.1, 0.2), (0.04, 0.06), YOUNG, DENSITY, SHEAR, POISSON)
    line = ShaftLine((cone, replace(cone, outer=(0.2, 0.2), inner=(0.06, 0.06))))
    own = line_matrices(line)
    moved = np.tile([1.0, 0.0], 3)
    turned = np.ravel(np.column_stack([line.places, np.ones(3)]))

    def frustum(a: float, b: float) -> float:
        return math.pi * 0.4 / 12 * (a * a + a * b + b * b)

    mass = DENSITY * (frustum(0.1, 0.2) - frustum(0.04, 0.06))
    mass += DENSITY * (frustum(0.2, 0.2) - frustum(0.06, 0.06))
    assert moved @ own.mass @ moved == pytest.approx(mass, rel=1e-12)
    assert line.mass == pytest.approx(mass, rel=1e-12)
    polar = (
        DENSITY
        * math.pi
        / 160
        * 0.4
        * sum(
            sign * sum(a ** (4 - i) * b**i for i in range(5))
            for sign, a, b in ((1, 0.1, 0.2), (-1, 0.04, 0.06))
        )
    )
    polar += DENSITY * math.pi / 32 * 0.4 * (0.2**4 - 0.06**4)
    assert turned @ own.gyro @ turned == pytest.approx(polar, rel=1e-12)
    assert own.stiffness @ moved == pytest.approx(np.zeros(6), abs=1e-3)
    assert own.stiffness @ turned == pytest.approx(np.zeros(6), abs=1e-3)


def test_an_overhung_disk_on_a_massless_shaft_whirls_as_two_coordinates_do():
    line = rod(1.0, 0.05, 10, density=0.05, shear=math.inf)
    line = replace(line, disks=(ShaftDisk(10, 60.0, 3.0, 1.5),))
    found = whirls(line, springs(1e11, 0, 6), 300.0)[:4]
    signed = [w.frequency * (1 if w.is_anticlockwise else -1) for w in found]
    expected = [-501.768, -78.499, 185.714, 994.554]
    assert sorted(signed) == pytest.approx(expected, rel=1e-4)


def test_internal_damping_makes_a_jeffcott_rotor_unstable_at_the_known_speed():
    line = rod(1.0, 0.03, 8, density=10.0, shear=math.inf)
    bending = YOUNG * math.pi * 0.03**4 / 64
    mass, viscous, outside = 20.0, 2e-4, 150.0
    stiffness = 48 * bending
    omega = math.sqrt(stiffness / mass)
    line = replace(line, disks=(ShaftDisk(4, mass),), viscous=viscous)
    held = (*springs(1e11, 0, 8), at_node(4, Support(damping=outside + 0j)))
    onset = omega * (1 + outside / (viscous * stiffness))
    for share, grows in ((0.998, False), (1.002, True)):
        near = [w for w in whirls(line, held, share * onset) if w.frequency < 2 * omega]
        assert (max(w.growth for w in near) > 0.0) == grows


def test_a_loss_factor_damps_each_mode_of_a_free_shaft_by_half_of_it():
    line = replace(rod(1.0, 0.05, 6), loss=0.02)
    found = [w for w in whirls(line, (), 0.0) if w.frequency > 10.0]
    assert len(found) == 2 * (line.size - 2)
    for whirl in found:
        assert -whirl.growth / abs(whirl.root) == pytest.approx(0.01, rel=1e-6)


def test_the_rotor_of_nelson_and_mcvaugh_has_its_published_critical_speeds():
    """Theirs are of a model condensed to fewer stations, up to 1.4 % higher."""
    line = line_of_data(nelson_mcvaugh(kxx=4.378e7))
    forward, backward = undamped_critical_speeds(line, held_by(line))
    rpm = np.concatenate([forward[:3], backward[:3]]) * 30 / math.pi
    published = np.array([17159, 49983, 96457, 15470, 46612, 64752])
    assert rpm == pytest.approx(published, rel=0.015)


@pytest.mark.turns
def test_damped_critical_speeds_without_damping_are_the_undamped_ones():
    line, held = rod(0.6, 0.03, 3), springs(4e6, 0, 3)
    line = replace(line, disks=(ShaftDisk(1, 8.0, 0.06, 0.03),))
    forward, backward = undamped_critical_speeds(line, held)
    found = critical_speeds(line, held, 1500.0)
    expected = [*forward[forward < 1500.0], *backward[backward < 1500.0]]
    assert [speed for speed, _ in found] == pytest.approx(sorted(expected), rel=1e-8)
    assert sum(whirl.is_anticlockwise for _, whirl in found) == (forward < 1500).sum()


def test_pedestals_and_unequal_supports_give_two_frequencies_for_each_direction():
    """A rigid rotor: m x" + k x = 0 on springs k_x, k_y of each bearing, in series."""
    line = rod(0.2, 0.1, 2, young=1e16, shear=math.inf)
    stiff, foot, heavy = 3e5, 5e5, 4.0
    line = replace(line, pedestals=(heavy, heavy))
    own = Support(stiffness=stiff + 0j, stiffness_apart=1e5 + 0j)
    base = Support(stiffness=foot + 0j)
    held = tuple(
        part
        for node, pedestal in ((0, 6), (2, 7))
        for part in (at_node(node, own, pedestal), Held(pedestal, -1, base))
    )
    found = whirl_frequencies(line, held, 0.0)
    for k in (4e5, 2e5):
        half = line.mass / 2
        matrix = np.array([[k / half, -k / half], [-k / heavy, (k + foot) / heavy]])
        for omega in np.sqrt(np.linalg.eigvals(matrix)):
            assert np.abs(found / omega - 1).min() < 1e-5
