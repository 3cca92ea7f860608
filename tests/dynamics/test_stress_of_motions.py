"""Stress that a march keeps: read from its motion, which it never changes."""

import numpy as np
import pytest
from rotor_files import arrays_in, exported, written
from stage import N as FEW
from stage import rotor, turning

from hpcwhirl.campaign.simulate import simulate
from hpcwhirl.case.resolve import resolve
from hpcwhirl.dynamics.march import March
from hpcwhirl.dynamics.snapshot import restore, snapshot
from hpcwhirl.scene import apply_settings, named_scene
from hpcwhirl.scene.quantities import BLADES

pytestmark = pytest.mark.turns

N = 6
SMALL = {"blades": N, "engine.rotor.elements": 3, "modes": 18}
ASIDE = {"sample_interval", *BLADES}  # tell what is kept


def with_tips(path, radial, tangential, size):
    """Add rows to a file that read the tips as if they were a stress, in Pa."""
    rows = np.zeros((len(radial), 2, 1, size))
    for j, pair in enumerate(zip(radial, tangential, strict=True)):
        for place, row in enumerate(pair):
            rows[j, place, 0, row] = 1.0
    rows_of = {"stress": rows, "stress_name": ["radial", "along"]}
    return written(path, rows_of)


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    """Return {rotation: file} of a small built-in rotor with such rows."""
    found = {}
    for rotation in ("none", "full"):
        path = tmp_path_factory.mktemp(rotation) / "rotor.h5"
        words = SMALL | {"engine.rotation": rotation}
        own = arrays_in(exported(path, words, "mostly_damped"))
        tips = own["tip_radial"], own["tip_tangential"]
        found[rotation] = with_tips(path, *tips, len(own["mass"]))
    return found


def scene(file, **settings):
    own = {"file": str(file), "blades": N, "duration": 6e-3, "time_step": 2e-6}
    kept = {"interval": 3e-5, "traces": "full", "rotation": "none"}
    return apply_settings(named_scene("mostly_damped"), own | kept | settings)


def same_tips(traces, tolerance=1e-11):
    """Whether the rows read what the kernel has written of the tips, to round-off."""
    stress, tips = traces["stress"], traces["tips"]
    assert stress.shape == tips.shape
    size = np.abs(tips).max()
    return size > 0.0 and np.abs(stress - tips).max() <= tolerance * size


CERTIFIED = {"gap": 6e-4, "duration": 0.025, "nodal_diameter": 2}
CASES = {
    "modal, folded": {"nodal_diameter": 2},
    "modal": {"nodal_diameter": 1},
    "modal, rotation": {"rotation": "full", "suspension_damping": -1.0},
    "general": {"scheme": "general"},
    "paper": {"scheme": "paper"},
    "exact": {"scheme": "exact"},
    "run-up": {"acceleration": 2e4},
    "unbalance": {"rotation": "full", "unbalance": 1e-3, "suspension_damping": -1.0},
}


@pytest.mark.parametrize("name", CASES)
def test_it_is_read_at_the_samples_by_every_scheme(built, name):
    words = CASES[name]
    found = simulate(scene(built[words.get("rotation", "none")], **words))
    assert found.row["contacts"] > 0
    assert same_tips(found.traces)


def test_it_goes_on_beyond_a_certificate(built):
    found = simulate(scene(built["none"], **CERTIFIED))
    assert found.row["contacts"] > 0
    assert 0.0 < found.row["certificate"] < 0.02
    assert same_tips(found.traces)


@pytest.mark.parametrize(
    "words",
    [{}, CERTIFIED, {"amplitude_limit": 2e-4, "duration": 0.02}],
    ids=["touching", "certified", "stopped"],
)
def test_no_variable_depends_on_whether_it_is_kept(built, words):
    rows = [
        simulate(scene(built["none"], **words, traces=traces)).row
        for traces in ("full", "summary")
    ]
    names = (rows[0].keys() | rows[1].keys()) - ASIDE
    assert {n for n in names if rows[0].get(n) != rows[1].get(n)} == set()


def test_traces_of_the_orbit_keep_none(built):
    assert "stress" not in simulate(scene(built["none"], traces="orbit")).traces


def of_stage(tmp_path, **settings):
    """Return the case of a small stage of three points a tip."""
    arrays = turning(rotor())
    file = written(tmp_path / "stage.h5", arrays)
    own = [arrays[f"tip_{way}"][:, 1] for way in ("radial", "tangential")]
    with_tips(file, *own, len(arrays["mass"]))
    words = {
        "blades": FEW, "rotation": "full", "nodal_diameter": 2, "gap": 1e-4,
        "force": 6e4, "pulse": 6e-4, "suspension_damping": -1.0, "time_step": 5e-6,
        "duration": 8e-3, "interval": 1e-4,
    }  # fmt: skip
    return resolve(scene(file, **words | settings))


@pytest.mark.parametrize("scheme", ["modal", "general"])
def test_several_points_have_it(tmp_path, scheme):
    case = of_stage(tmp_path, scheme=scheme)
    history = March(case).run()
    assert history.contacts > 0
    assert same_tips({"stress": history.stress, "tips": history.tips})


@pytest.mark.parametrize("steps", [777, 1000])  # beside a sample, and at one
def test_a_march_that_goes_on_elsewhere_has_the_same_stress(tmp_path, steps):
    case = of_stage(tmp_path)
    whole, first, second = (March(case) for _ in range(3))
    truth = whole.run()
    first.advance(steps)
    saved = {name: array.copy() for name, array in snapshot(first).items()}
    assert restore(second, saved)
    found = second.run()
    assert np.array_equal(found.stress, truth.stress)
    assert np.array_equal(found.tips, truth.tips)
