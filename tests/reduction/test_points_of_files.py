"""Files of several contact points a tip, and of casings with stations."""

import numpy as np
import pytest
from rotor_files import arrays_in, exported, written
from stage import N, by_modes, rotor, turning

from hpcwhirl.case.resolve import resolve
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.bodies import contact_rows, tip_rows
from hpcwhirl.scene import apply_settings, named_scene


def model(file, **settings):
    base = {"blades": N, "file": str(file), "suspension_damping": -1.0}
    return resolve(apply_settings(named_scene("table2"), base | settings)).model


def test_matrices_and_modes_give_the_same_points(tmp_path):
    arrays = rotor()
    one, other = (
        model(written(tmp_path / f"{n}.h5", a))
        for n, a in enumerate((arrays, by_modes(arrays)))
    )
    assert one.rotor.omega == pytest.approx(other.rotor.omega, rel=1e-9)
    for a, b in zip(*(contact_rows(m.rotor, N) for m in (one, other)), strict=True):
        give = [r / m.rotor.omega**2 @ r.T for r, m in ((a, one), (b, other))]
        assert give[0] == pytest.approx(give[1], rel=1e-8, abs=1e-12)
    assert np.array_equal(one.angles, other.angles)
    assert one.clearances(1e-3).reshape(N, 3)[1] == pytest.approx(
        [1.02e-3, 1e-3, 1.01e-3]
    )


def test_the_middle_point_is_the_tip(tmp_path):
    found = model(written(tmp_path / "stage.h5", rotor())).rotor
    both = zip(tip_rows(found, N), contact_rows(found, N), strict=True)
    for tip, rows in both:
        assert np.array_equal(tip, rows.reshape(N, 3, -1)[:, 1])


def test_the_shaft_is_told_from_points_at_their_own_angles(tmp_path):
    found = model(written(tmp_path / "stage.h5", rotor(angles=[0.1, 0.2, 0.3]))).rotor
    assert not np.isnan(found.centre_share).any()


@pytest.mark.parametrize("rotation", ["none", "full"])
def test_a_stage_exported_is_read_back_the_same(tmp_path, rotation):
    source = written(tmp_path / "stage.h5", turning(rotor()))
    words = {"file": str(source), "blades": N, "rotation": rotation,
             "suspension_damping": -1.0}  # fmt: skip
    copy = exported(tmp_path / "copy.h5", words)
    one, other = (model(file, rotation=rotation) for file in (source, copy))
    for a, b in zip(*(contact_rows(m.rotor, N) for m in (one, other)), strict=True):
        assert np.array_equal(np.abs(a), np.abs(b))
    for name in ("station", "angle", "gap"):
        a, b = (getattr(m.rotor.points, name) for m in (one, other))
        assert np.array_equal(a, b)


WRONG = [
    ({"tip_station": [0.0, 0.02, 0.01]}, "tip_station must ascend from point to point"),
    ({"tip_station": None}, "3 contact points a tip, but no rotor/tip_station"),
    ({"tip_gap": [0.0, 0.0]}, "tip_gap must have one entry a contact point, 3, got 2"),
    ({"tip_angle": [0.0, 4.0, 0.0]}, r"tip_angle must be within \+-pi rad, got 4"),
    ({"tip_tangential": np.zeros((N, 2), int)}, "tip_tangential must be "),
    ({"tip_radial": np.zeros((N, 3), int)}, "names coordinate 0 twice"),
    ({"tip_radial": np.zeros((N, 3, 1), int)}, "tip_radial must have 1 or 2 dim"),
    ({"tip_radial": np.full((N, 3), 99)}, "tip_radial must be indices 0 to 31, got 99"),
    ({"tip_stations": [0.0]}, "did you mean 'tip_station'"),
]  # fmt: skip


@pytest.mark.parametrize(("spoil", "told"), WRONG)
def test_a_wrong_file_is_told_in_one_line(tmp_path, spoil, told):
    file = written(written(tmp_path / "stage.h5", rotor()), spoil)
    with pytest.raises(InputError, match=told) as caught:
        model(file)
    assert len(str(caught.value).splitlines()) == 1
    assert str(file) in str(caught.value)


def test_a_stiffening_that_is_not_symmetric_is_told(tmp_path):
    arrays = turning(rotor())
    arrays["stress_stiffness"][0, 5] += 1.0
    file = written(tmp_path / "stage.h5", arrays)
    with pytest.raises(InputError, match="rotor/stress_stiffness must be symmetric"):
        model(file, rotation="full")


def test_places_of_points_belong_to_several(tmp_path):
    arrays = rotor()
    flat = {n: arrays[n][:, 0] for n in ("tip_radial", "tip_tangential")}
    file = written(tmp_path / "stage.h5", arrays | flat)
    with pytest.raises(InputError, match="but one contact point a tip: it belongs"):
        model(file)


TABLE = {
    "modal_harmonic": [0, 1, 2], "modal_omega": [900.0, 50.0, 300.0],
    "modal_damping_ratio": [0.01] * 3, "modal_radial": np.full((3, 2), 0.1),
    "modal_tangential": [[0.0, 0.0], [-0.1, -0.1], [-0.05, -0.05]],
    "station": [-0.1, 0.1],
}  # fmt: skip
WRONG_TABLES = [
    ({"station": [0.1, -0.1]}, "casing/station must ascend"),
    ({"station": None}, "casing/modal_radial at several stations, but no casing/"),
    ({"station": [0.0, 0.1, 0.2]}, r"modal_radial must be \(modes, 3\), a column"),
    ({"station": [0.0, 0.1]}, "tip_station -0.03 m, beyond the casing, which reaches"),
    ({"modal_radial": np.full((3, 2), [0.0, 0.1]) * [[1], [1], [0]]},
     "moves radially in harmonic 2"),
]  # fmt: skip


@pytest.mark.parametrize(("spoil", "told"), WRONG_TABLES)
def test_a_wrong_casing_with_stations_is_told(tmp_path, spoil, told):
    file = written(tmp_path / "stage.h5", rotor())
    written(written(file, TABLE, "casing"), spoil, "casing")
    with pytest.raises(InputError, match=told) as caught:
        model(file, discretization="file")
    assert len(str(caught.value).splitlines()) == 1


def test_amplitudes_are_linear_between_stations(tmp_path):
    file = written(tmp_path / "stage.h5", rotor())
    slope = {"modal_radial": np.outer([1.0, 1.0, 1.0], [0.1, 0.3])}
    written(file, TABLE | slope, "casing")
    found = model(file, discretization="file")
    rows = found.ring.rows(found.angles, found.stations)[0] @ found.casing.shapes
    breathing = rows[:, found.casing.diameter == 0][:, 0].reshape(N, 3)
    assert breathing[0] == pytest.approx([0.17, 0.205, 0.24])
    assert arrays_in(file, "casing")["modal_radial"].shape == (3, 2)
