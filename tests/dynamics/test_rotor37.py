"""One blade with 16 contact points in a rigid casing with lobes, beside full matrices.

scripts/evidence/rotor37.md tells of longer runs; the oracle uses nothing of hpcwhirl.
"""

import json

import blade37
import numpy as np
import pytest
from dense_blade import multipliers

from hpcwhirl.cli import main

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def body():
    """Return the solids."""
    pytest.importorskip("skfem", reason="pip install scikit-fem")
    return blade37.solid()


@pytest.fixture(scope="module")
def files(body, tmp_path_factory):
    """Return {model: engine file}."""
    return blade37.reduced(tmp_path_factory.mktemp("rotor37"), body)


def test_its_first_frequencies_are_the_published(body):
    assert blade37.frequencies(body) == pytest.approx(blade37.PUBLISHED, rel=1e-4)


@pytest.mark.parametrize(
    "model", [pytest.param("all", marks=pytest.mark.evidence), "modes"]
)
def test_a_blade_rubs_as_full_matrices_and_pivoting_say(files, model):
    step = blade37.STEPS[model]
    run, points = blade37.marched(files[model], step, 1.0)
    true = blade37.oracle(files[model], step, 1.0, blade37.by_harmonics())
    assert true.lowest > -1e-15
    assert blade37.apart(points, true.points)[-1] < 1e-9
    assert run.counter[1] == true.touchdowns > 100
    whole = true.impulse.sum()
    assert np.abs(run.state.impulse - true.impulse).max() < 1e-8 * whole
    assert (true.impulse > 5e-3 * whole).all()  # every point takes its part
    exact = blade37.oracle(files[model], step, 1.0, blade37.clearance)
    assert blade37.apart(points, exact.points)[-1] < 1e-6


def test_friction_and_the_casing_s_formula_matter_to_the_oracle(files):
    step, gap = blade37.STEPS["modes"], blade37.by_harmonics()
    true = blade37.oracle(files["modes"], step, 0.5, gap)
    other = blade37.oracle(files["modes"], step, 0.5, lambda a: gap(a) - 1e-9)
    assert blade37.apart(other.points, true.points)[-1] > 1e-8


@pytest.mark.parametrize("seed", range(5))
def test_the_oracle_s_forces_push_where_there_is_no_gap(seed):
    random = np.random.default_rng(seed)
    part, skew = random.normal(size=(2, 16, 16))
    gives = part @ part.T + np.eye(16) + skew - skew.T  # positive principal minors
    gaps = random.normal(size=16)
    lam = multipliers(gaps, gives)
    left = gaps + gives @ lam
    assert lam.min() >= 0.0
    assert left.min() > -1e-12
    assert np.abs(lam * left).max() < 1e-12
    assert lam.max() > 0.0


def test_the_commands_take_sixteen_points(files, tmp_path, capsys):
    given = blade37.settings(files["modes"], 1, 0.5)
    words = [w for n, v in given.items() for w in ("--set", f"{n}={v}")]
    assert main(["model", *words, "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert facts["plan"]["fixed_interface_modes"] == 0
    at_all = [*words, "--set", f"engine.file={files['all']}", "--json"]
    assert main(["model", *at_all]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert facts["plan"]["fixed_interface_modes"] == blade37.MODES
    out, plots = tmp_path / "run.h5", tmp_path / "plots"
    assert main(["run", *words, "--out", str(out), "--plot", str(plots)]) == 0
    assert out.stat().st_size > 0
    assert len(list(plots.glob("*.png"))) == 2
