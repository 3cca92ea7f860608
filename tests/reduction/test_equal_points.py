"""Frequencies of rotors with several contact points a tip, by nodal diameter."""

import numpy as np
import pytest
import scipy.linalg
from rotor_files import written
from stage import N, rotor, turning

from hpcwhirl.analysis.rotation import bands_over, critical_of, waves_over
from hpcwhirl.case.resolve import resolve
from hpcwhirl.reduction.families import first_family, modal_table, rotor_by_diameter
from hpcwhirl.reduction.waves import wave_lines
from hpcwhirl.scene import apply_settings, named_scene


def case(folder, arrays, **settings):
    file = written(folder / "stage.h5", arrays)
    base = {"blades": N, "file": str(file), "suspension_damping": -1.0}
    return resolve(apply_settings(named_scene("table2"), base | settings))


def by_matrices(arrays, speed):
    """Return |omega|, rad/s, of the whole rotor's free motions, by all its matrices."""
    size, zero = len(arrays["mass"]), np.zeros_like(arrays["mass"])
    softened = arrays["stress_stiffness"] - arrays["softening"]
    stiffness = arrays["stiffness"] + speed**2 * softened
    damping = arrays["damping"] + 2 * speed * arrays["coriolis"]
    hub, held = arrays["centre"], arrays["centre_damping"][0]
    damping[hub, hub] += held
    x, y = hub
    stiffness[x, y] -= speed * held  # of a damper at rest, seen from the rotor
    stiffness[y, x] += speed * held
    right = np.block([[zero, np.eye(size)], [-stiffness, -damping]])
    left = scipy.linalg.block_diag(np.eye(size), arrays["mass"])
    roots = scipy.linalg.eigvals(right, left)
    return np.sort(roots.imag[roots.imag > 0.0])


@pytest.mark.parametrize("speed", [0.0, 150.0, 400.0])
def test_waves_by_diameter_are_those_of_all_matrices(tmp_path, speed):
    arrays = turning(rotor())
    own = rotor_by_diameter(case(tmp_path, arrays, rotation="full").model)
    lines = wave_lines(own, N, speed)
    assert {line.nodal_diameter for line in lines} == {0, 1, 2}
    found = np.sort([abs(line.rotating) for line in lines])
    assert found == pytest.approx(by_matrices(arrays, speed), rel=1e-9)


def test_families_at_rest_are_those_of_the_modal_table(tmp_path):
    one = case(tmp_path, turning(rotor()), rotation="full")
    own, names = rotor_by_diameter(one.model), ("1F", "2F", "suspension")
    lines = [line for line in wave_lines(own, N, 0.0) if line.family in names]
    table = {
        (line.nodal_diameter, line.family): 2 * np.pi * line.frequency_hz
        for line in modal_table(one.model) if line.body == "rotor"
    }  # fmt: skip
    found = {(line.nodal_diameter, line.family): abs(line.rotating) for line in lines}
    assert len(found) == 7
    assert found == pytest.approx({name: table[name] for name in found}, rel=1e-3)


def test_eq_13_holds_at_the_critical_speeds(tmp_path):
    """A wave against the rotation meets the casing's of the same diameter there."""
    arrays = turning(rotor())
    one = case(tmp_path, arrays, rotation="full")
    rows = [row for row in critical_of(one, 1) if row["nodal_diameter"] == 2]
    assert [row["family"] for row in rows] == ["1F"]
    speed, casing = rows[0]["speed"], first_family(modal_table(one.model), "casing")[2]
    own = by_matrices(arrays, speed)
    assert np.abs(own - (2 * speed - casing)).min() < 1e-6 * casing


def test_bands_hold_the_waves_of_their_diameters(tmp_path):
    one, speeds = case(tmp_path, turning(rotor()), rotation="full"), np.array([50, 250])
    low, high = bands_over(one, speeds)["1F"]
    for k in (0, 2):
        plus, _ = waves_over(one, k, speeds)["1F"]
        own = np.abs(plus - k * speeds)
        assert (low <= own * (1 + 1e-12)).all()
        assert (own <= high * (1 + 1e-12)).all()


def test_without_rotation_each_wave_is_told_once(tmp_path):
    one = case(tmp_path, rotor())
    lines = wave_lines(rotor_by_diameter(one.model), N, 100.0)
    found = [(line.nodal_diameter, line.family) for line in lines]
    assert found.count((0, "1F")) == 1
    assert found.count((2, "1F")) == 2  # with the rotation, and against it
    assert not one.model.rotor.cyclic  # the march knows no equal sectors


def test_a_heavier_blade_has_no_waves_of_one_diameter(tmp_path):
    arrays = turning(rotor())
    arrays["mass"][0, 0] *= 1.02
    del arrays["damping"]
    model = case(tmp_path, arrays, rotation="full").model
    assert rotor_by_diameter(model) is model.rotor
