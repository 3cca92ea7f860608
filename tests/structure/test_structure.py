"""Truth 1: frequencies, mass, rigid-body energy, patch test of the curved element."""

import numpy as np
import pytest
from scipy.linalg import eigh

from hpcwhirl.scene import Casing, Rotor
from hpcwhirl.structure import (
    FourierOperator,
    blade_stiffness,
    bladed_disk,
    harmonic_matrices,
    ring,
)
from hpcwhirl.structure.bladed_disk import blade
from hpcwhirl.structure.elements import Section, beam, curved, hermite

STEEL = {"young": 210e9, "density": 7800.0}


def hertz(stiffness, mass):
    values = eigh(stiffness, mass, eigvals_only=True)
    return np.sqrt(np.maximum(values, 0)) / (2 * np.pi)


def test_uniform_beam_matches_the_textbook_matrices():
    length, h, b = 0.3, 0.01, 0.1
    _, stiffness = beam(length, Section(b, (h, h), **STEEL))
    flex = 210e9 * b * h**3 / 12
    assert stiffness[0, 0] == pytest.approx(210e9 * b * h / length, rel=1e-13)
    assert stiffness[1, 1] == pytest.approx(12 * flex / length**3, rel=1e-12)
    assert stiffness[1, 2] == pytest.approx(6 * flex / length**2, rel=1e-12)
    assert stiffness[2, 5] == pytest.approx(2 * flex / length, rel=1e-12)


def test_cantilever_frequencies():
    # (beta L)^2 sqrt(EI / rho A L^4), beta L = 1.8751, 4.6941, 7.8548
    rotor = Rotor(taper=1.0, elements=20)
    mass, stiffness = blade(rotor)
    free = slice(3, None)
    found = hertz(stiffness[free, free], mass[free, free])
    length = rotor.radius - rotor.disk_radius
    h = rotor.root_thickness
    scale = np.sqrt(rotor.young * h**2 / (12 * rotor.density)) / length**2
    bending = np.array([1.8751040687, 4.6940911330, 7.8547574382]) ** 2
    bending *= scale / (2 * np.pi)
    assert found[:3] == pytest.approx(bending, rel=2e-5)


@pytest.mark.parametrize("taper", [1.0, 0.6])
def test_blade_mass_and_rigid_turn(taper):
    rotor = Rotor(taper=taper)
    mass, stiffness = blade(rotor)
    length = rotor.radius - rotor.disk_radius
    area = rotor.blade_width * rotor.root_thickness
    total = rotor.density * area * length * (1 + taper) / 2
    radial = np.tile([1.0, 0.0, 0.0], rotor.elements + 1)
    assert radial @ mass @ radial == pytest.approx(total, rel=1e-12)
    place = np.linspace(rotor.disk_radius, rotor.radius, rotor.elements + 1)
    turn = np.column_stack([0 * place, place, 1 + 0 * place]).ravel()
    x, w = np.polynomial.legendre.leggauss(8)
    x, w = (x + 1) / 2, w / 2
    r = rotor.disk_radius + length * x
    line = rotor.density * area * (1 + (taper - 1) * x)
    assert turn @ mass @ turn == pytest.approx(length * w @ (line * r**2), rel=1e-12)
    scale = np.abs(stiffness).max()
    assert np.abs(stiffness @ turn).max() < 1e-12 * scale
    assert np.abs(stiffness @ radial).max() < 1e-12 * scale


@pytest.mark.parametrize("blades", [1, 2, 3, 22])
def test_a_rigid_shift_strains_only_the_shaft_springs(blades):
    rotor = Rotor(blades=blades)
    disk = bladed_disk(rotor)
    angle = 2 * np.pi * np.arange(blades) / blades
    shift = np.zeros((blades, rotor.elements + 1, 3))
    shift[..., 0] = np.cos(angle)[:, None]
    shift[..., 1] = -np.sin(angle)[:, None]
    x = np.r_[shift.ravel(), 1.0, 0.0]
    energy = x @ disk.stiffness @ x
    assert energy == pytest.approx(rotor.centre_stiffness, rel=1e-6)


def test_clamped_centre_drops_its_two_dof():
    free, clamped = bladed_disk(Rotor()), bladed_disk(Rotor(centre="clamped"))
    assert len(free.mass) == len(clamped.mass) + 2
    assert np.array_equal(free.stiffness[:-2, :-2], clamped.stiffness)


def test_free_ring_against_inextensional_theory():
    casing = Casing(thickness=0.005, width=0.16, support_frequency=0.0)
    structure, _ = ring(casing, 0.5)
    found = hertz(structure.stiffness, structure.mass)
    k = np.arange(2, 5)
    flex = casing.young * casing.thickness**2 / 12
    theory = flex * k**2 * (k**2 - 1) ** 2 / (casing.density * 0.5**4 * (k**2 + 1))
    theory = np.sqrt(theory) / (2 * np.pi)
    assert found[3:9:2] == pytest.approx(theory, rel=1.5e-3)
    assert found[3:9:2] == pytest.approx([12.796, 36.197, 69.421], rel=1e-4)
    assert found[:3].max() < 0.03  # rigid motions; 0.026 Hz is the element's own


def test_ring_on_its_support_moves_as_one_at_the_support_frequency():
    casing = Casing()
    structure, _ = ring(casing, 0.5)
    found = 2 * np.pi * hertz(structure.stiffness, structure.mass)
    assert found[:3] == pytest.approx(casing.support_frequency, rel=1e-3)


def test_curved_element_patch():
    # uniform breathing: membrane strain w/R everywhere, bending none
    length, radius = 0.07, 0.5
    section = Section(0.16, (0.02, 0.02), **STEEL)
    _, stiffness = curved(length, radius, section, 0.0)
    breathe = np.array([0, 0, 1, 0, 0, 0, 1, 0.0])
    want = 210e9 * 0.16 * 0.02 / radius**2 * length
    assert breathe @ stiffness @ breathe == pytest.approx(want, rel=1e-12)
    mass, _ = curved(length, radius, section, 0.0)
    line = 7800 * 0.16 * 0.02 * length
    assert breathe @ mass @ breathe == pytest.approx(line, rel=1e-12)


def test_curved_element_tends_to_rigid_shift_without_energy():
    def miss(elements):
        thin = Casing(elements=elements, thickness=0.0266, support_frequency=0.0)
        structure, _ = ring(thin, 0.5)
        angle = 2 * np.pi * np.arange(elements) / elements
        c, s = np.cos(angle), np.sin(angle)
        x = np.column_stack([-s, -c / 0.5, c, -s / 0.5]).ravel()
        return x @ structure.stiffness @ x

    order = np.log2(miss(20) / miss(40))
    assert order > 5.5


def test_hermite_is_nodal_and_its_slope_is_a_derivative():
    length = 0.3
    ends = hermite(np.array([0.0, 1.0]), length)
    slopes = hermite(np.array([0.0, 1.0]), length, 1)
    assert ends[[0, 2]] == pytest.approx(np.eye(2))
    assert slopes[[1, 3]] == pytest.approx(np.eye(2))
    x, h = 0.37, 1e-5
    fine = (hermite(x + h, length) - hermite(x - h, length)) / (2 * h * length)
    assert hermite(x, length, 1) == pytest.approx(fine, rel=1e-6)


@pytest.mark.parametrize("k", [0, 1, 2, 3, 7])
def test_lobed_load_does_unit_work_on_its_shape_and_none_on_others(k):
    _, operator = ring(Casing(), 0.5)
    load = operator.lobes(k).reshape(-1, 4)
    angle = 2 * np.pi * np.arange(operator.elements) / operator.elements
    for n in range(9):
        w, slope = np.cos(n * angle), -n * np.sin(n * angle) / operator.radius
        work = load[:, 2] @ w + load[:, 3] @ slope
        miss = 2e-6 * (1 + max(n, k)) ** 4  # cubic interpolation of cos(n theta)
        assert work == pytest.approx(1.0 if n == k else 0.0, abs=miss)


def test_reading_the_ring_reproduces_a_cubic_in_each_element():
    _, operator = ring(Casing(), 0.5)
    rng = np.random.default_rng(1)
    x = rng.normal(size=160)
    e, xi = 7, 0.3
    angle = 2 * np.pi * (e + xi) / 40
    radial, tangential = operator.rows(np.array([angle, angle + 2 * np.pi]))
    dofs = [4 * e + 2, 4 * e + 3, 4 * e + 6, 4 * e + 7]
    assert radial[0] @ x == pytest.approx(hermite(xi, operator.length) @ x[dofs])
    assert radial[1] @ x == pytest.approx(radial[0] @ x, rel=1e-9)
    assert np.count_nonzero(tangential[0]) == 4


@pytest.mark.paper
def test_blade_stiffness_of_the_paper():
    assert blade_stiffness(Rotor()) == pytest.approx(6.8e4, rel=3e-3)


@pytest.mark.turns
def test_harmonics_have_the_frequencies_of_a_fine_ring_of_elements():
    casing = Casing(elements=240)
    structure, _ = ring(casing, 0.5)
    fine = np.sort(2 * np.pi * hertz(structure.stiffness, structure.mass))
    for h in range(9):
        inertia, stiff = harmonic_matrices(casing, 0.5, h)
        for omega in np.sqrt(np.linalg.eigvalsh(stiff) / inertia):
            near = fine[np.argmin(np.abs(fine - omega))]
            assert near == pytest.approx(omega, rel=1e-5)


def test_harmonics_against_inextensional_theory():
    casing = Casing(thickness=0.005, width=0.16, support_frequency=0.0)
    for k in (2, 3, 4):
        inertia, stiff = harmonic_matrices(casing, 0.5, k)
        flex = casing.young * casing.thickness**2 / (12 * casing.density * 0.5**4)
        theory = flex * k**2 * (k**2 - 1) ** 2 / (k**2 + 1)
        found = np.linalg.eigvalsh(stiff)[0] / inertia
        assert found == pytest.approx(theory, rel=3e-3)


def test_a_rigid_shift_of_the_harmonics_strains_only_the_support():
    casing = Casing()
    inertia, stiff = harmonic_matrices(casing, 0.5, 1)
    shift = np.array([1.0, -1.0])  # w = cos, u = -sin
    want = casing.support_frequency**2 * inertia
    assert shift @ stiff @ shift == pytest.approx(2 * want, rel=1e-9)


@pytest.mark.parametrize("k", [0, 1, 5])
def test_lobes_of_harmonics_do_unit_work_on_their_shape(k):
    operator = FourierOperator(8, 0.5)
    shape, _ = operator.rows(np.linspace(0, 2 * np.pi, 50))
    angle = np.linspace(0, 2 * np.pi, 50)
    assert shape @ operator.lobes(k) == pytest.approx(np.cos(k * angle), abs=1e-12)
