"""Rotors from file whose nodal diameters share frequencies keep their families."""

import numpy as np
import pytest
import rotor_files

from hpcwhirl.analysis.critical import critical_speeds
from hpcwhirl.case.resolve import resolve
from hpcwhirl.reduction.cyclic_coordinates import aligned, diameter_shares, unmixed
from hpcwhirl.reduction.families import first_family, modal_table
from hpcwhirl.scene import apply_settings, named_scene

BLADES = {6: 20, 7: 20, 22: 110}  # N -> modes
SHARED = 2 * np.pi * 41.91


def scene(blades, **settings):
    given = {"blades": blades, "modes": BLADES[blades]}
    return apply_settings(named_scene("mostly_damped"), given | settings)


def exported(blades, centre, path):
    """Return the arrays of an exported engine, and its own model."""
    given = {"blades": blades, "modes": BLADES[blades], "centre": centre}
    rotor = rotor_files.arrays_in(rotor_files.exported(path, given))
    return rotor, resolve(scene(blades, centre=centre)).model.rotor


def with_shared(rotor, own, spread=0.0, seed=1):
    """Give modes `own` (m,) one frequency, but for `spread`, and rotate them at random.

    Both as modes and, for matrices, of these modes.
    """
    random = np.random.default_rng(seed)
    count = np.count_nonzero(own)
    omega, turn = rotor["omega"].copy(), np.eye(len(own))
    omega[own] = SHARED * (1 + spread * np.sort(random.uniform(-1, 1, count)))
    turn[np.ix_(own, own)] = np.linalg.qr(random.normal(size=(count, count)))[0]
    order = np.argsort(omega, kind="stable")
    turned, omega = (rotor["shapes"] @ turn)[:, order], omega[order]
    lift = rotor["mass"] @ turned
    stiffness = (lift * omega**2) @ lift.T
    places = {n: rotor[n] for n in ("mass", "tip_radial", "tip_tangential", "centre")}
    matrices = places | {"stiffness": (stiffness + stiffness.T) / 2}
    tips = "modal_tip_radial", "modal_tip_tangential", "modal_centre"
    return matrices, {"omega": omega} | {n: (rotor[n] @ turn)[:, order] for n in tips}


def read(arrays, blades, path):
    rotor_files.written(path, arrays)
    return resolve(scene(blades, file=str(path))).model


@pytest.mark.turns
@pytest.mark.parametrize("kind", ["matrices", "modes"])
@pytest.mark.parametrize(
    ("blades", "centre", "spread"),
    [(22, "free", 1e-5), (7, "clamped", 0.0), (6, "free", 1e-5)],
)
def test_a_family_of_one_frequency_has_every_nodal_diameter_once(
    kind, blades, centre, spread, tmp_path
):
    rotor, own = exported(blades, centre, tmp_path / "own.h5")
    chosen = (own.rank == 0) & (own.diameter != 1)
    arrays = with_shared(rotor, chosen, spread)[kind == "modes"]
    found = read(arrays, blades, tmp_path / "rotor.h5")
    got = found.rotor
    for k in np.unique(own.diameter):
        want = np.sort(np.where(chosen, SHARED, own.omega)[own.diameter == k])
        assert np.sort(got.omega[got.diameter == k]) == pytest.approx(want, rel=2e-5)
    one, other = (
        sorted(zip(b.diameter, b.rank, b.phase, strict=True)) for b in (got, own)
    )
    assert one == other


@pytest.mark.parametrize("kind", ["matrices", "modes"])
def test_critical_speeds_do_not_depend_on_the_basis_of_a_degenerate_space(
    kind, tmp_path
):
    rotor, own = exported(22, "free", tmp_path / "own.h5")
    arrays = with_shared(rotor, (own.rank == 0) & (own.diameter != 1))[kind == "modes"]
    table = modal_table(read(arrays, 22, tmp_path / "rotor.h5"))
    first, casing = first_family(table, "rotor"), first_family(table, "casing")
    speeds = {c["nodal_diameter"]: c["speed"] for c in critical_speeds(first, casing)}
    for k in range(2, 12):
        assert first[k] == pytest.approx(SHARED, rel=1e-9)
        assert speeds[k] == pytest.approx((SHARED + casing[k]) / k, rel=1e-9)
    assert first[1] == pytest.approx(own.omega[own.diameter == 1].min(), rel=1e-9)
    assert speeds[8] == pytest.approx(1278.5, abs=0.1)


def test_damping_by_nodal_diameter_is_modal_in_a_degenerate_space(tmp_path):
    rotor, own = exported(6, "free", tmp_path / "own.h5")
    chosen = (own.rank == 0) & (own.diameter != 1)
    matrices, _ = with_shared(rotor, chosen)
    ratios = 0.001 * (1 + own.diameter)
    omega = np.where(chosen, SHARED, own.omega)
    lift = rotor["mass"] @ rotor["shapes"]
    damping = (lift * (2 * ratios * omega)) @ lift.T
    got = read(matrices | {"damping": damping}, 6, tmp_path / "rotor.h5").rotor
    assert got.ratios == pytest.approx(0.001 * (1 + got.diameter), rel=1e-6)


def test_aligned_shapes_are_modes_of_one_nodal_diameter_each(tmp_path):
    rotor, own = exported(7, "free", tmp_path / "own.h5")
    matrices, _ = with_shared(rotor, (own.rank == 0) & (own.diameter != 1))
    got = read(matrices, 7, tmp_path / "rotor.h5").rotor
    assert diameter_shares(got.shapes, 7).max(axis=0).min() > 1 - 1e-9
    unit = got.shapes.T @ got.mass @ got.shapes
    assert np.abs(unit - np.eye(len(unit))).max() < 1e-10
    strain = got.shapes.T @ got.stiffness @ got.shapes - np.diag(got.omega**2)
    assert np.abs(strain).max() < 1e-10 * got.omega.max() ** 2


def test_modes_that_are_not_mixed_are_left_as_they_are():
    own = resolve(scene(7)).model.rotor
    assert np.array_equal(aligned(own.shapes, own.omega, 7), own.shapes)


def test_modes_that_leave_the_tips_still_come_last():
    random = np.random.default_rng(3)
    angle = 2 * np.pi * np.arange(6) / 6
    waves = [np.cos(angle), np.sin(2 * angle), 0 * angle]
    shapes = np.column_stack([np.column_stack([w, w]).ravel() for w in waves])
    turn = np.linalg.qr(random.normal(size=(3, 3)))[0]
    columns, moving = unmixed(shapes @ turn, 6)
    assert moving == 2
    assert np.abs(columns.T @ columns - np.eye(3)).max() < 1e-14
    pure = shapes @ turn @ columns
    assert np.argmax(diameter_shares(pure, 6)[:, :2], axis=0).tolist() == [1, 2]
    assert np.abs(pure[:, 2]).max() < 1e-14
