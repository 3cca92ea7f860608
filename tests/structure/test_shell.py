"""The casing as a simply supported shell: published frequencies, the ring."""

import numpy as np
import pytest
from rotor_files import exported
from scipy.linalg import eigh

from hpcwhirl.case.resolve import resolve
from hpcwhirl.dynamics.bodies.motion import turned
from hpcwhirl.dynamics.march import March
from hpcwhirl.errors import InputError
from hpcwhirl.scene import Casing, apply_settings, named_scene
from hpcwhirl.structure import harmonic_matrices, shell_matrices
from hpcwhirl.structure.fourier import Sines, fluegge

RADIUS = 0.5
# Lam and Loy, J. Sound Vib. 188 (1995) 363, simply supported, L/R = 20, t/R = 0.01,
# nu = 0.3: omega R sqrt(rho (1 - nu^2) / E) of one axial half wave and n = 1 to 5
PUBLISHED = {1: 0.016101, 2: 0.009382, 3: 0.022105, 4: 0.042095, 5: 0.068008}


def casing(**settings):
    plain = {"support_frequency": 0.0, "thickness": 0.005, "poisson": 0.3}
    return Casing(**(plain | {"discretization": "shell"} | settings))


def lowest(shell, h, p=1):
    mass, stiffness = shell_matrices(shell, RADIUS, h, p)
    return np.sqrt(eigh(stiffness, eigvals_only=True)[0] / mass)


@pytest.mark.parametrize(("n", "value"), PUBLISHED.items())
def test_its_frequencies_are_the_published_ones(n, value):
    shell = casing(width=20 * RADIUS)
    unit = RADIUS * np.sqrt(shell.density * (1 - shell.poisson**2) / shell.young)
    assert lowest(shell, n) * unit == pytest.approx(value, abs=6e-7)


@pytest.mark.parametrize("n", [2, 3, 5, 8])
def test_a_long_shell_bends_as_rayleigh_says(n):
    shell = casing(width=1e4 * RADIUS)
    squared = shell.young * shell.thickness**2 * n**2 * (n**2 - 1) ** 2
    squared /= 12 * shell.density * (1 - shell.poisson**2) * RADIUS**4 * (n**2 + 1)
    assert lowest(shell, n) == pytest.approx(np.sqrt(squared), rel=1e-3)


@pytest.mark.parametrize("n", [2, 3, 5])
def test_a_long_shell_without_contraction_is_the_ring(n):
    own = {"poisson": 0.0, "thickness": 0.002, "support_frequency": 15.0}
    shell = casing(width=1e5 * RADIUS, **own)
    inertia, ring = harmonic_matrices(shell, RADIUS, n)
    of_ring = np.sqrt(eigh(ring, eigvals_only=True) / inertia)
    mass, stiffness = shell_matrices(shell, RADIUS, n, 1)
    of_shell = np.sqrt(eigh(stiffness, eigvals_only=True) / mass)
    assert of_shell[0] == pytest.approx(of_ring[0], rel=1e-4)
    assert of_shell[2] == pytest.approx(of_ring[1], rel=1e-4)


def test_a_rigid_translation_strains_no_long_shell():
    moved = np.array([1.0, -1.0, 0.0])
    assert moved @ fluegge(1, 1e-6, 1e-5, 0.3) @ moved == pytest.approx(0.0, abs=1e-11)


def test_its_axial_functions_vanish_at_the_ends_and_are_orthogonal():
    places = np.linspace(-0.5, 0.5, 2001)
    values = Sines(4, 1.0).at(places)
    assert np.abs(values[[0, -1]]).max() < 1e-14
    product = values[:-1].T @ values[:-1] / 2000
    assert product == pytest.approx(0.5 * np.eye(4), abs=1e-12)


SMALL = {
    "blades": 6, "rotor.elements": 3, "modes": 18, "discretization": "shell",
    "casing.harmonics": 8, "axial_modes": 3, "casing.width": 0.3,
    "casing.thickness": 0.01,
}  # fmt: skip
FAST = {"duration": 4e-3, "interval": 1e-5, "traces": "full", "time_step": 2e-6}


def scene(**settings):
    loud = {"force": 2e5, "friction": 0.3, "support_damping": -1.0}
    base = named_scene("table2")
    return apply_settings(base, FAST | SMALL | loud | settings)


def march(**settings):
    found = March(resolve(scene(**settings)))
    return found.run()


@pytest.mark.turns
@pytest.mark.parametrize("families", ["all", "bending"])
def test_blades_of_one_point_see_it_by_every_scheme(families):
    one, *others = (
        march(scheme=s, families=families) for s in ("modal", "general", "exact")
    )
    assert one.contacts > 0
    for other, allowed in zip(others, (1e-8, 0.05), strict=True):
        size = np.abs(one.tips).max()
        assert np.abs(one.tips - other.tips).max() < allowed * size
    assert abs(one.ledger["residual"]) < 1e-9 * one.ledger["pulse"]


def test_exported_and_read_back_it_moves_the_same(tmp_path):
    file = exported(tmp_path / "engine.h5", SMALL | {"support_damping": -1.0})
    one, other = march(), march(discretization="file", file=str(file))
    assert one.contacts == other.contacts > 0
    assert np.abs(one.tips - other.tips).max() < 1e-9 * np.abs(one.tips).max()


def test_paper_is_told_that_it_needs_coordinates():
    with pytest.raises(InputError, match="nor 'shell' with one contact point") as told:
        march(scheme="paper")
    assert len(str(told.value).splitlines()) == 1


def test_a_motion_of_all_families_is_continued():
    """Displacements beside the plane of contact determine the axial families."""
    case = resolve(scene())
    first = March(case)
    first.reach(1000)
    begun = turned(case.model, first.motion())
    again = March(case, begun).motion()
    size = np.abs(begun.casing_velocity).max()
    assert size > 0.0
    assert np.abs(again.casing_velocity - begun.casing_velocity).max() < 1e-9 * size


def test_a_folded_shell_moves_as_the_whole():
    one, other = (march(nodal_diameter=2, plan=p) for p in ("lean", "everything"))
    assert one.folds == 2
    assert one.contacts == other.contacts > 0
    assert np.abs(one.tips - other.tips).max() < 1e-8 * np.abs(one.tips).max()


def test_all_of_the_ring_breathes_and_half_of_it_moves_in_a_wave():
    """The mean over the angle of 1 is 1, of cos^2 a half; of sin^2 along it a half."""
    shell = Casing(thickness=0.01, width=0.3, density=7800.0)
    whole = 7800.0 * 0.01 * 2 * np.pi * RADIUS * 0.3
    masses = [shell_matrices(shell, RADIUS, h, 1)[0] for h in (0, 1, 5)]
    assert masses == pytest.approx([whole / 2, whole / 4, whole / 4], rel=1e-12)
