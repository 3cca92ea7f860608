"""Bounds by which parts are left out: known before a run, checked after it, named."""

import math

import pytest

from hpcwhirl import simulate
from hpcwhirl.campaign.simulate import notes_on
from hpcwhirl.case.bounds import Bound, bounds_of, lean_checked, told_beyond
from hpcwhirl.case.resolve import resolve
from hpcwhirl.scene import apply_settings, named_scene
from hpcwhirl.scene.shaft_tables import text_of

SMALL = {
    "blades": 6, "modes": 12, "casing.harmonics": 6, "time_step": 4e-6,
    "duration": 0.05, "traces": "summary",
}  # fmt: skip
ROW = {"folds": 1, "certificate": -1.0, "line_frequency": 0.0, "whirl": "none"}
SETTLED = {"nodal_diameter": 2, "gap": 2e-3, "casing.damping": 0.2, "duration": 0.3}


def scene(**given):
    return apply_settings(named_scene("table2"), SMALL | given)


@pytest.fixture(scope="module")
def settled():
    given = scene(**SETTLED)
    return given, simulate(given).row


def parts(case, row=None):
    return {bound.part: bound for bound in bounds_of(case, row)}


def test_what_a_run_tells_is_open_before_it_and_within_its_bound_after(settled):
    given, row = settled
    before, after = parts(resolve(given)), parts(resolve(given), row)
    assert before.keys() == after.keys() == {"sectors", "certificate", "samples"}
    assert {bound.reached for bound in before.values()} == {None}
    assert row["certificate"] > 0.0
    assert after["certificate"].reached == row["certificate_reach"] > 0.0
    shares = [bound.share for bound in after.values()]
    assert row["lean_checked"] == max(shares)
    assert 0.0 < row["lean_checked"] <= 1.0
    assert not any("beyond the bound" in note for note in notes_on(given, row))


def test_nothing_is_checked_where_nothing_is_left_out():
    given = scene(plan="everything", duration=4e-4)
    row = simulate(given).row
    assert (bounds_of(resolve(given), row), row["lean_checked"]) == ([], 0.0)


@pytest.mark.parametrize(
    ("part", "found"),
    [
        ("sectors", {"contacts": 80}),
        ("certificate", {"certificate_reach": 3e-3}),
        ("samples", {"line_frequency": -1e5, "whirl": "backward"}),
    ],
)
def test_a_bound_that_is_exceeded_is_a_note_with_its_name(settled, part, found):
    given, row = settled
    beyond = row | found
    beyond["lean_checked"] = lean_checked(resolve(given), beyond)
    assert beyond["lean_checked"] > 1.0
    (told,) = told_beyond(resolve(given), beyond)
    assert f"{part}: " in told
    assert told in notes_on(given, beyond)


def test_modes_and_waves_are_left_out_by_what_truncation_allows():
    draft = resolve(scene(truncation=0.3, modes=0))
    found = parts(draft)
    assert found["modes"].allowed == pytest.approx(0.2)
    assert found["waves"].allowed == 0.3
    assert 0.0 < found["modes"].share <= 1.0
    assert 0.0 < found["waves"].share <= 1.0


def test_terms_of_rotation_are_left_out_by_the_change_of_a_wave():
    slow = scene(rotation="auto", centre="clamped", speed=1.0)
    fast = scene(rotation="auto", centre="clamped", speed=400.0)
    assert 0.0 < parts(resolve(slow))["rotation"].share <= 1.0
    assert "rotation" not in parts(resolve(fast))


def test_a_film_is_checked_at_the_eccentricity_that_was_reached():
    turns = {"rotation": "full", "film_viscosity": 0.05, "film_clearance": 1e-4}
    case = resolve(scene(**turns))
    near, far = (
        parts(case, ROW | {"centre_peak": share * 1e-4})["film"].share
        for share in (0.1, 0.99)
    )
    assert 0.0 < near < 0.1 * far


LINE = {
    "sections": [{"length": 0.4, "outer": 0.1}, {"length": 0.4, "outer": 0.1}],
    "bearings": [
        {"station": 0, "kxx": 1e8, "cxx": 1e4},
        {"station": 2, "kxx": 1e8, "film_viscosity": 0.5, "film_length": 0.06,
         "film_radius": 0.1, "film_clearance": 4e-4},
    ],
}  # fmt: skip


@pytest.mark.parametrize(("accuracy", "kept"), [(0.0, False), (1e-3, True)])
def test_a_film_at_a_station_has_a_bound_which_accuracy_keeps(accuracy, kept):
    line = {"shaft": text_of(LINE, "the shaft"), "shaft_station": 1}
    case = resolve(scene(rotation="full", accuracy=accuracy, **line))
    found = parts(case)["films"]
    assert found.allowed == (accuracy or 0.01)
    assert (0.0 < found.share <= 1.0) == kept
    told = told_beyond(case, {**ROW, "centre_peak": 0.0})
    assert any("films: " in text for text in told) != kept


def test_a_share_is_finite_where_an_estimate_is_not():
    assert Bound("modes", "error", 0.3, math.inf).share == 1e6
    assert Bound("certificate", "m", 0.0, 1e-9).share == 1e6
