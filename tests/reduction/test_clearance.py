"""Clearance consumption of modes: closed forms."""

import numpy as np
import pytest
from rotor_files import written
from stage import N

from hpcwhirl.case.resolve import resolve
from hpcwhirl.reduction.families import clearance_consumption, modal_table
from hpcwhirl.scene import apply_settings, named_scene

LEAN = 0.3  # rad, of the soft direction of a tip against the casing


def leaning(points=1):
    """Return a rotor of tips on two springs, along and across a leaning direction.

    Springs alike in all directions join the tips of neighbours, so that frequencies
    depend on the nodal diameter and shapes do not. Points of a tip move as one.
    """
    soft = np.array([np.sin(LEAN), np.cos(LEAN)])  # radial, tangential
    own = 1e6 * np.eye(2) - 9e5 * np.outer(soft, soft)
    shift = np.roll(np.eye(N), 1, axis=0)
    ring = 2 * np.eye(N) - shift - shift.T
    stiffness = np.kron(np.eye(N), own) + np.kron(ring, 2e3 * np.eye(2))
    spread = np.kron(np.eye(N), np.kron(np.ones((points, 1)), np.eye(2)) / points)
    size = 2 * N * points
    apart = np.eye(size) - spread @ np.linalg.pinv(spread)
    rows = np.arange(size).reshape(N, points, 2)
    return {
        "mass": 0.2 * np.eye(size),
        "stiffness": spread @ stiffness @ spread.T * points + 1e9 * apart,
        "tip_radial": rows[:, :, 0],
        "tip_tangential": rows[:, :, 1],
        "tip_station": 0.01 * np.arange(points),
        "centre": np.zeros(0, dtype=np.int64),
    }


@pytest.mark.parametrize("points", [1, 2])
def test_a_tip_that_moves_straight_consumes_the_cosine_of_its_direction(
    tmp_path, points
):
    arrays = leaning(points)
    if points == 1:
        arrays |= {n: arrays[n].ravel() for n in ("tip_radial", "tip_tangential")}
        del arrays["tip_station"]
    file = written(tmp_path / "leaning.h5", arrays)
    words = {"blades": N, "file": str(file), "suspension_damping": -1.0}
    model = resolve(apply_settings(named_scene("table2"), words)).model
    lines = [line for line in modal_table(model) if line.body == "rotor"]
    found = [line.clearance_consumption for line in lines if line.frequency_hz < 5e2]
    both = len(found) // 2
    assert both >= 3  # a line of each nodal diameter, or of each mode
    assert found[:both] == pytest.approx([np.sin(LEAN)] * both, rel=1e-6)
    assert found[both:] == pytest.approx([np.cos(LEAN)] * both, rel=1e-6)


@pytest.mark.parametrize(
    ("radial", "tangential", "found"),
    [
        ([[3.0]], [[4.0]], 0.6),  # straight, (3, 4)
        ([[1.0, 0.0]], [[0.0, 2.0]], 0.5),  # an ellipse of half axes 1 and 2
        ([[2.0, 0.0]], [[0.0, 1.0]], 1.0),
        ([[0.0], [1.0]], [[2.0], [0.0]], 0.5),  # one point up, another along
        ([[0.0]], [[1.0]], 0.0),
        ([[0.0]], [[0.0]], 0.0),
    ],
)
def test_it_is_the_radial_amplitude_over_the_largest(radial, tangential, found):
    used = clearance_consumption(np.array(radial), np.array(tangential))
    assert used == pytest.approx(found)


def test_a_rigid_disk_that_translates_consumes_all_of_it():
    angle = 2 * np.pi * np.arange(N) / N
    c, s = np.cos(angle), np.sin(angle)
    both = np.column_stack([c, s]), np.column_stack([-s, c])
    assert clearance_consumption(*both) == pytest.approx(1.0)
