"""`solver.estimate`: what a coarser run changes, while the case stays as it is."""

import math

import pytest

import hpcwhirl
from hpcwhirl.campaign.simulate import simulate
from hpcwhirl.case.coarser import coarser
from hpcwhirl.case.resolve import resolve
from hpcwhirl.scene import apply_settings, named_scene
from hpcwhirl.scene.quantities import ESTIMATED


def scene(**settings):
    small = {"rotor.blades": 6, "duration": 0.01, "modes": 12, "casing.harmonics": 4}
    return apply_settings(named_scene("table2"), small | settings)


@pytest.mark.parametrize("estimate", ["step", "all"])
@pytest.mark.parametrize("accuracy", [0.0, 0.03])
def test_an_estimate_changes_no_bit_of_the_case(accuracy, estimate):
    plain = simulate(scene(accuracy=accuracy))
    asked = simulate(scene(accuracy=accuracy, estimate=estimate))
    assert {n: v for n, v in asked.row.items() if n not in ESTIMATED} == plain.row
    assert set(asked.row) - set(plain.row) == set(ESTIMATED)
    assert any(note.startswith("computed coarser: ") for note in asked.notes)


LESS = {"modes": 6, "casing.harmonics": 3}


@pytest.mark.parametrize(("estimate", "less"), [("step", {}), ("all", LESS)])
def test_it_is_the_difference_to_the_run_with_twice_the_step(estimate, less):
    asked = simulate(scene(time_step=5e-7, estimate=estimate)).row
    coarse = simulate(scene(time_step=1e-6, **less)).row
    assert asked["coarse_regime"] == coarse["regime"]
    size = max(asked["orbit_radius"], 0.01 * 1.28e-4)
    difference = abs(asked["orbit_radius"] - coarse["orbit_radius"]) / size
    assert asked["radius_error"] == difference
    assert asked["peak_error"] > 0.0


def test_no_coarser_is_tried_than_is_stable():
    limit = resolve(scene()).model.limits(410.0)
    near = scene(time_step=0.9 * min(limit.values()), estimate="step")
    assert coarser(resolve(near)) is None
    row = simulate(near).row
    assert row["coarse_regime"] == "none"
    assert math.isnan(row["radius_error"])
    assert math.isnan(row["peak_error"])


def test_fewer_waves_tell_an_error_where_no_longer_step_is_stable():
    limit = resolve(scene()).model.limits(410.0)
    near = scene(time_step=0.94 * min(limit.values()), estimate="all", modes=5)
    other = coarser(resolve(near)).scene
    assert other.solver.time_step >= near.solver.time_step
    assert (other.solver.modes, other.engine.casing.harmonics) == (5, 3)
    assert simulate(near).row["peak_error"] > 0.0


@pytest.mark.parametrize(
    ("settings", "harmonics"),
    [
        ({"nodal_diameter": 4}, 4),
        ({"profile": "harmonic,amplitude,phase;4,1e-5,0"}, 4),
        ({"discretization": "elements"}, 4),
        ({"kind": "rigid"}, 4),
        ({"casing.harmonics": 12}, 8),
    ],
)
def test_a_ring_keeps_the_waves_of_its_load_and_shape(settings, harmonics):
    other = coarser(resolve(scene(estimate="all", time_step=1e-7, **settings)))
    assert other.scene.engine.casing.harmonics == harmonics


@pytest.mark.turns
def test_a_campaign_stores_the_estimates(tmp_path):
    tables = {
        "scene": {"duration": 4e-3},
        "engine": {"rotor": {"blades": 5}},
        "solver": {"estimate": "step", "preset": "draft"},
        "sweep": {"speed": [200.0, 300.0]},
    }
    with hpcwhirl.campaign(tables, tmp_path / "out") as data:
        assert (data["radius_error"] >= 0.0).all()
        assert set(hpcwhirl.words(data["coarse_regime"])) <= {"undecided", "divergent"}
