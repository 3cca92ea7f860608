"""What rotation adds to a rotor: elements, waves, critical speeds, stability."""

import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eigh

from hpcwhirl.analysis.critical import critical_of_waves
from hpcwhirl.cli import main
from hpcwhirl.reduction.bodies import rotor_model
from hpcwhirl.reduction.cyclic_coordinates import block
from hpcwhirl.reduction.growth import stability
from hpcwhirl.reduction.modes import _blocks, reference_speed
from hpcwhirl.reduction.waves import (
    largest_growth,
    stiff_up_to,
    tip_growth,
    unbalance_speeds,
    wave_lines,
    wave_roots,
)
from hpcwhirl.scene import Rotor
from hpcwhirl.structure import bladed_disk, rotation_of
from hpcwhirl.structure.rotation import loads_of, members, stiffening_of, tensions

STIFF = Rotor(young=2.1e17, damping=0.0, suspension_damping=0.0, elements=3, blades=7)
WRIGHT = {0.0: 3.5160, 1.0: 3.6816, 2.0: 4.1373, 5.0: 6.4495}  # Wright et al. 1982


@pytest.fixture(scope="module")
def default():
    return rotor_model(Rotor(), 110, "full")


def family(model, k, name, speed, blades=22):
    lines = wave_lines(model, blades, speed)
    return [x for x in lines if (x.nodal_diameter, x.family) == (k, name)]


def moved(rotor, angle):
    """Return the displacement of a rotor along an angle, all as one rigid body."""
    nodes, blades = rotor.elements + 1, rotor.blades
    at = angle - 2 * np.pi * np.arange(blades) / blades
    own = np.column_stack([np.cos(at), np.sin(at), np.zeros(blades)])
    return np.r_[np.repeat(own, nodes, axis=0).ravel(), np.cos(angle), np.sin(angle)]


@pytest.mark.parametrize("eta", WRIGHT)
def test_a_turning_cantilever_stiffens_as_wright_found(eta):
    rotor = Rotor(taper=1.0, root_thickness=1e-3, disk_radius=1e-7, blades=1)
    disk, added = bladed_disk(rotor), rotation_of(rotor)
    bent = np.s_[3 : disk.sector_size]  # the root is clamped
    section = rotor.blade_width * rotor.root_thickness
    second = rotor.blade_width * rotor.root_thickness**3 / 12
    length = rotor.radius - rotor.disk_radius
    unit = np.sqrt(rotor.young * second / (rotor.density * section * length**4))
    speed = eta * unit
    stiffness = disk.stiffness + speed**2 * added.stiffening
    mass = disk.mass[bent, bent]
    first = eigh(stiffness[bent, bent], mass, eigvals_only=True)[0]
    assert np.sqrt(first) / unit == pytest.approx(WRIGHT[eta], abs=2e-4)
    softer = stiffness - speed**2 * disk.mass
    own = eigh(softer[bent, bent], mass, eigvals_only=True)[0]
    assert own / unit**2 == pytest.approx(WRIGHT[eta] ** 2 - eta**2, abs=2e-3)


def test_of_a_rigid_translation_inertia_alone_is_left():
    """It is s = -i Omega, twice: a point that moves on straight in the static frame."""
    rotor, speed = Rotor(blades=5, elements=4), 300.0
    disk, added = bladed_disk(rotor), rotation_of(rotor)
    free = disk.stiffness.copy()
    free[-2:, -2:] -= rotor.centre_stiffness * np.eye(2)
    x, y = moved(rotor, 0.0), moved(rotor, np.pi / 2)
    assert added.coriolis == pytest.approx(-added.coriolis.T, abs=1e-15)
    assert added.coriolis @ x == pytest.approx(disk.mass @ y, abs=1e-12)
    assert added.load @ x == pytest.approx(0.0, abs=1e-12)
    s, wave = -1j * speed, x + 1j * y  # z = x + i y ~ e^{-i Omega t}
    matrix = s**2 * disk.mass + 2 * speed * s * added.coriolis + free
    matrix = matrix + speed**2 * (added.stiffening - disk.mass)
    scale = speed**2 * np.abs(disk.mass @ wave).max()
    assert np.abs(matrix @ wave.conj()).max() < 1e-6 * scale


def test_a_rigid_turn_meets_no_force():
    """What tension adds is what softening takes: the virial of the static answer."""
    rotor = Rotor(blades=9, elements=6)
    parts = members(rotor)
    forces = tensions(parts, 3 * (rotor.elements + 1))
    turned = spun = 0.0
    for part, mean in zip(parts, forces, strict=True):
        along, across = part.start
        slope, arms = np.array([0, 0, 1, 0, 0, 1.0]), (along, along + part.length)
        turn = slope + np.array([-across, arms[0], 0, -across, arms[1], 0])
        stiff = stiffening_of(part.length, part.section, along, mean)
        turned += turn @ stiff @ turn
        place = np.array([arms[0], across, 0, arms[1], across, 0])
        spun += place @ loads_of(part.length, part.section, part.start)[0]
    assert turned == pytest.approx(spun, rel=1e-12)


def test_the_tension_of_a_blade_is_what_lies_outside_of_it():
    rotor = Rotor(blades=6, elements=5)
    parts = members(rotor)
    outer = parts[-1]
    mean = tensions(parts, 3 * (rotor.elements + 1))[-1]
    area = rotor.density * outer.section.at(0.5)[0]
    # of a short last element: half of its mass, at its place
    assert mean == pytest.approx(area * outer.length * 0.47 / 2, rel=0.03)


@pytest.mark.parametrize("speed", [-400.0, 0.0, 250.0, 900.0])
def test_rigid_blades_on_springs_keep_their_static_lines(speed):
    model = rotor_model(STIFF, 7, "full")
    own = np.sqrt(STIFF.centre_stiffness / unit_mass(STIFF))
    lines = sorted(x.static for x in family(model, 1, "suspension", speed, 7))
    assert lines == pytest.approx([-own, own], rel=2e-5)
    none = rotor_model(STIFF, 7)
    lines = sorted(x.static for x in family(none, 1, "suspension", speed, 7))
    turned = abs(speed)
    assert lines == pytest.approx([turned - own, turned + own], rel=2e-5, abs=0.02)


def unit_mass(rotor):
    shape = moved(rotor, 0.0)
    return float(shape @ bladed_disk(rotor).mass @ shape)


LINES = {
    270.0: (-581.5, -36.5, 423.0, 911.5),
    410.0: (-571.0, 61.3, 451.8, 1152.5),
}  # of two independent codes


@pytest.mark.parametrize("speed", LINES)
def test_static_lines_of_the_default_engine_are_those_of_other_codes(default, speed):
    lines = family(default, 1, "1F", speed) + family(default, 1, "suspension", speed)
    found = sorted(line.static for line in lines)
    assert found == pytest.approx(LINES[speed], rel=0.01)


@pytest.mark.parametrize(("speed", "own"), [(270, 305.6), (410, 347.6), (520, 384.2)])
def test_first_bending_stiffens_as_other_codes_have_it(default, speed, own):
    lines = [line.rotating for line in family(default, 3, "1F", float(speed))]
    assert np.abs(lines) == pytest.approx(own, rel=0.01)


@pytest.mark.turns
def test_one_basis_serves_all_speeds(default):
    """Of many more modes come the same frequencies, whatever the speed."""
    finer = rotor_model(Rotor(), 330, "full")
    for speed in (0.0, 270.0, 520.0, 800.0):
        for k, name in ((0, "1F"), (1, "suspension"), (3, "2F"), (11, "1F")):
            pair = (family(m, k, name, speed) for m in (default, finer))
            lines = [[line.rotating for line in own] for own in pair]
            assert lines[0] == pytest.approx(lines[1], rel=1.5e-3)


def test_taut_blades_yield_as_unreduced_ones_at_the_speed_of_the_basis(monkeypatch):
    monkeypatch.setattr("hpcwhirl.reduction.craig_bampton.NEW", 1e-9)
    rotor = Rotor(blades=5, elements=4)
    disk, terms = bladed_disk(rotor), rotation_of(rotor)
    squared = reference_speed(disk) ** 2
    for piece in _blocks(disk, 10, terms):
        taut = block(disk.stiffness + squared * terms.stiffening, disk, piece.k)
        kept = [*disk.boundary, *range(disk.sector_size, len(taut))]
        want = np.linalg.solve(taut, np.eye(len(taut))[:, kept])[kept]
        own = piece.stiffness + squared * (piece.stiffening + piece.mass)
        found = np.linalg.solve(own, np.eye(len(own), len(kept)))[: len(kept)]
        assert np.abs(found - want).max() < 1e-9 * np.abs(want).max()


@pytest.mark.parametrize("rotation", ["none", "full"])
@pytest.mark.parametrize("whole", [False, True])
def test_waves_with_and_against_the_rotation_are_those_of_the_mirrored_speed(
    rotation, whole
):
    model = rotor_model(Rotor(blades=5, elements=4), 15, rotation)
    if whole and model.spin is not None:
        model = replace(model, spin=replace(model.spin, waves=()))
    there, back = (wave_lines(model, 5, speed) for speed in (350.0, -350.0))
    for one, other in zip(there, back, strict=True):
        assert (one.nodal_diameter, one.family) == (other.nodal_diameter, other.family)
        for name in ("rotating", "static", "growth"):
            want = pytest.approx(getattr(one, name), rel=1e-7, abs=1e-6)
            assert getattr(other, name) == want


def test_a_rotor_taken_as_a_whole_has_the_lines_of_its_diameters():
    model = rotor_model(Rotor(blades=5, elements=4), 20, "full")
    whole = replace(model, spin=replace(model.spin, waves=()))
    for k, name in ((0, "1F"), (1, "1F"), (1, "suspension"), (2, "2F")):
        own, other = (family(m, k, name, 300.0, 5) for m in (model, whole))
        for field in ("static", "growth"):
            lines = [[getattr(line, field) for line in side] for side in (own, other)]
            assert lines[0] == pytest.approx(lines[1], rel=1e-6)


@pytest.mark.parametrize("ratio", [2.0, 3.0])
def test_damping_that_turns_feeds_beyond_what_stands(ratio):
    """T3: m Z'' + (c_s + c_r) Z' + (k - i Omega c_r) Z = 0."""
    rotor = STIFF.model_copy(
        update={"damping": 0.01, "suspension_damping": 0.01 * ratio}
    )
    model = rotor_model(rotor, 7, "full")
    own = np.sqrt(rotor.centre_stiffness / unit_mass(rotor))
    assert stability(model, 7).unstable_from == pytest.approx(own * ratio, rel=1e-3)


@pytest.mark.parametrize("speed", [0.0, 400.0])
def test_cross_coupling_feeds_beyond_c_omega(speed):
    rotor = STIFF.model_copy(update={"suspension_damping": 0.02})
    onset = 2 * 0.02 * rotor.centre_stiffness  # c omega, c = 2 xi sqrt(k m)
    for share, unstable in ((0.998, False), (1.002, True)):
        own = rotor.model_copy(update={"cross_coupling": share * onset})
        lines = family(rotor_model(own, 7, "full"), 1, "suspension", speed, 7)
        forward = max(lines, key=lambda line: line.static)
        assert (forward.growth > 0.0) == unstable
        assert min(lines, key=lambda line: line.static).growth < 0.0


def test_an_unbalance_meets_the_wave_that_stands(default):
    (speed,) = unbalance_speeds(default)
    assert speed == pytest.approx(458.0, rel=0.01)  # of an independent code
    least = min(np.abs(line.rotating) for line in family(default, 1, "1F", speed))
    assert least < 1e-3 * speed  # damped, it is off by xi^2
    turning = rotor_model(Rotor(suspension_damping=-1.0), 110, "full")
    assert stability(turning, 22).unstable_from == pytest.approx(speed, rel=1e-3)


def test_bearings_hold_what_damping_in_the_shaft_would_feed(default):
    assert largest_growth(default, 22, 520.0) < 0.0
    turning = rotor_model(Rotor(suspension_damping=-1.0), 110, "full")
    assert largest_growth(turning, 22, 520.0) > 0.0


def test_blades_and_shaft_resonate_on_the_ground():
    """Coleman: without any damping some speeds beyond the critical one are unstable."""
    rotor = Rotor(damping=0.0, suspension_damping=0.0)
    model = rotor_model(rotor, 110, "full")
    assert largest_growth(model, 22, 650.0) < 1e-3
    assert largest_growth(model, 22, 1000.0) > 50.0


def test_the_coincidence_of_equation_13_is_where_the_lines_meet(default):
    rows = critical_of_waves(default, {1: 15.0, 2: 100.0}, 3)
    assert {row["order"] for row in rows} == {1, 2, 3}
    for row in rows:
        k = row["nodal_diameter"]
        piece = default.spin.waves[k]
        root = wave_roots(default, piece, row["speed"])[len(piece.omega)]
        level = row["order"] * {1: 15.0, 2: 100.0}[k]
        assert k * row["speed"] - root.imag == pytest.approx(level, rel=1e-9)
        assert root.imag > 0.0  # against the rotation
    first = [row["speed"] for row in rows if row["order"] == 1]
    assert first[0] == pytest.approx(343.5, rel=0.01)


def test_a_rod_grows_as_it_should():
    """rho Omega^2 R^3 / 3 E, of a blade from the centre on."""
    rotor = Rotor(taper=1.0, disk_radius=1e-6, blades=3, elements=12)
    grown = tip_growth(rotor_model(rotor, 30, "full"), 3, 10.0)
    own = rotor.density * 10.0**2 * rotor.radius**3 / (3 * rotor.young)
    assert grown == pytest.approx(own, rel=1e-3)


def test_softer_blades_grow_more():
    change = (-0.2, 0.0, 0.0, 0.0, 0.0)
    rotor = Rotor(blades=5, elements=4, mistuning=change)
    grown = tip_growth(rotor_model(rotor, 20, "full"), 5, 300.0)
    assert grown[0] == pytest.approx(1.25 * grown[1], rel=0.1)
    assert grown[1:] == pytest.approx(grown[2], rel=5e-3)


def test_blades_lose_their_stiffness_at_an_overspeed():
    """A soft root: the rim bends no blade back, and softening wins."""
    model = rotor_model(Rotor(blades=5, elements=4), 20, "full")
    most = stiff_up_to(model, 5)
    if np.isinf(most):
        pytest.fail("no speed at which blades buckle")
    held = model.spin.waves[2]
    stiffness = np.diag(held.omega**2) + most**2 * held.stiffening
    squared = np.linalg.eigvalsh(stiffness)
    assert squared[0] > -1e-6 * squared[-1]


@pytest.mark.turns
def test_model_tells_lines_of_the_rotation_asked_for(capsys):
    small = ["--set", "blades=5", "--set", "modes=20", "--set", "harmonics=4"]
    found = {}
    for kind in ("none", "full"):
        given = [*small, "--set", f"rotation={kind}", "--set", "speed=300"]
        assert main(["model", "--json", *given]) == 0
        found[kind] = json.loads(capsys.readouterr().out)
    for kind, facts in found.items():
        assert facts["rotation"]["kind"] == kind
        for line in facts["lines"]:
            shift = line["static"] - line["rotating"]
            assert shift == pytest.approx(300.0 * line["nodal_diameter"])
    assert found["none"]["rotation"]["tip_growth"] is None
    assert found["full"]["rotation"]["tip_growth"] > 0.0
    assert main(["model", "--explain", *small]) == 0
    told = capsys.readouterr().out
    assert all(word in told for word in ("none", "full", "static"))
