"""[sample]: draws obey their laws, stay what they were, and give shares of regimes."""

import json
import math
from statistics import NormalDist
from typing import get_args

import h5py
import numpy as np
import pytest
from launch import BARE, held, kill, launch, records, root_variables, start, wait_for

import hpcwhirl
from hpcwhirl.campaign.begin import as_begun
from hpcwhirl.campaign.plan.design import design_of
from hpcwhirl.campaign.plan.sampling import Sample
from hpcwhirl.cli import main
from hpcwhirl.errors import InputError
from hpcwhirl.report.map.data import Wish
from hpcwhirl.report.map.maps import drawing_of
from hpcwhirl.report.map.probabilities import figure_of_shares
from hpcwhirl.scene.campaign_tables import SampleTable
from hpcwhirl.scene.laws import drawn, law_of
from hpcwhirl.scene.words import ENUMS, REGIMES
from hpcwhirl.store.directory.manifest import PlanFile
from hpcwhirl.store.reading.shares import interval
from hpcwhirl.studies.shares import shares

GAP = {"distribution": "uniform", "low": 1e-4, "high": 3e-4}
FORCE = {"distribution": "lognormal", "median": 75e3, "deviation": 0.2}
FAST = {
    "scene": {"duration": 2e-3},
    "solver": {"time_step": 2e-6},
    "output": {"interval": 5e-5, "traces": "summary"},
}
TOML = (
    BARE
    + """
scene = {duration = 2e-3}
solver = {time_step = 2e-6}
output = {interval = 5e-5, traces = "summary"}
"""
)
METHODS = get_args(SampleTable.model_fields["method"].annotation)
NORMAL = NormalDist(3.0, 0.5)
SIGMA = NormalDist().cdf(1.0)


def design(count=8, **table):
    given = {"count": count, "gap": GAP, **table}
    return design_of({**FAST, "sample": given})


def column(made, name="gap"):
    return np.array([row[name] for row in made.settings])


@pytest.mark.parametrize(
    ("law", "known"),
    [
        ({"distribution": "uniform", "low": -1, "high": 3}, {0.0: -1, 0.25: 0.0}),
        ({"distribution": "loguniform", "low": 1e-4, "high": 1.0}, {0.5: 1e-2}),
        ({"distribution": "normal", "mean": 3.0, "deviation": 0.5},
         {0.5: 3.0, SIGMA: 3.5, 0.01: NORMAL.inv_cdf(0.01)}),
        ({"distribution": "lognormal", "median": 2.0, "deviation": 0.1},
         {0.5: 2.0, SIGMA: 2.0 * math.exp(0.1)}),
        ({"distribution": "truncated_normal", "mean": 3.0, "deviation": 0.5,
          "low": 2.5, "high": 3.5}, {0.0: 2.5, 0.5: 3.0}),
        ({"distribution": "truncated_normal", "mean": 3.0, "deviation": 0.5,
          "low": 3.0, "high": 1e9}, {0.5: NORMAL.inv_cdf(0.75)}),
    ],
)  # fmt: skip
def test_a_law_has_its_quantiles(law, known):
    found = drawn(law_of("gap", law), np.array(list(known)))
    np.testing.assert_allclose(found, list(known.values()), rtol=1e-9, atol=1e-12)


def test_no_law_is_infinite_at_the_corner_of_the_cube():
    normal = law_of("gap", {"distribution": "normal", "mean": 0, "deviation": 1})
    assert -10 < drawn(normal, np.zeros(1))[0] < -8


@pytest.mark.parametrize("method", METHODS)
def test_the_draws_of_any_method_obey_the_law(method):
    made = design(1024, method=method, seed=5, force=FORCE)
    both = column(made, "gap"), column(made, "force")
    assert len(both[0]) == 1024 * (4 if method == "saltelli" else 1)
    quarters = np.quantile(both[0], [0.25, 0.5, 0.75])
    np.testing.assert_allclose(quarters, [1.5e-4, 2e-4, 2.5e-4], rtol=0.06)
    np.testing.assert_allclose(np.log(both[1] / 75e3).std(), 0.2, rtol=0.1)
    assert abs(np.corrcoef(both)[0, 1]) < 0.1  # independent


@pytest.mark.parametrize("method", METHODS)
def test_a_seed_tells_the_draws_and_a_larger_count_keeps_them(method):
    few, again, other = (
        column(design(8, method=method, seed=seed, force=FORCE)) for seed in (1, 1, 2)
    )
    assert (few == again).all()
    assert not (few == other).any()
    more = column(design(16, method=method, seed=1, force=FORCE))
    assert len(more) == 2 * len(few)
    assert (more[: len(few)] == few).all() == (method != "latin_hypercube")


def test_every_point_of_a_sweep_gets_the_same_draws():
    tables = {
        **FAST,
        "sweep": {"speed": [300.0, 400.0]},
        "sample": {"count": 4, "gap": GAP},
    }
    made = design_of(tables)
    assert made.swept == ("speed", "gap")
    assert column(made, "speed").tolist() == [300.0] * 4 + [400.0] * 4
    assert (column(made)[:4] == column(made)[4:]).all()
    assert made.scenes[5].gap == column(made)[5]


def test_mistuning_is_a_draw_for_each_blade():
    small = {"engine": {"rotor": {"blades": 5}}}
    law = {"distribution": "normal", "mean": 0.0, "deviation": 0.02}
    given = {"count": 512, "mistuning": law, "gap": GAP}
    made = design_of({**FAST, **small, "sample": given})
    patterns = column(made, "engine.rotor.mistuning")
    assert patterns.shape == (512, 5)
    np.testing.assert_allclose(patterns.std(axis=0), 0.02, rtol=0.05)
    apart = np.corrcoef(np.c_[patterns, column(made)].T) - np.eye(6)
    assert abs(apart).max() < 0.1
    assert made.scenes[3].engine.rotor.mistuning == tuple(patterns[3])


def test_saltelli_draws_differ_in_one_input_alone():
    law = {"distribution": "uniform", "low": -0.1, "high": 0.1}
    small = {"engine": {"rotor": {"blades": 3}}}
    given = {"count": 4, "method": "saltelli", "mistuning": law, "gap": GAP}
    made = design_of({**FAST, **small, "sample": given})
    for first in range(0, 16, 4):
        a, b, tuned, gapped = made.settings[first : first + 4]
        name = "engine.rotor.mistuning"
        assert not set(a[name]) & set(b[name])
        assert tuned == {name: b[name], "gap": a["gap"]}
        assert gapped == {name: a[name], "gap": b["gap"]}


@pytest.mark.parametrize(
    ("table", "told"),
    [
        (3, "[sample] must be a table, got 3"),
        ({"gap": GAP}, "count must be a whole number from 1 to 10000000, got None"),
        ({"count": 12, "gap": GAP}, "a power of 2 with method sobol, such as 8 or 16"),
        ({"count": 0, "gap": GAP}, "got 0"),
        ({"count": 4, "seed": -1, "gap": GAP}, "seed must be a whole number"),
        ({"count": 4, "method": "sobl", "gap": GAP}, "did you mean 'sobol'?"),
        ({"count": 4}, "must have an input and its distribution"),
        ({"count": 4, "gab": GAP}, "did you mean 'gap'?"),
        ({"count": 4, "gap": 1e-4}, "[sample] gap must be a table such as"),
        ({"count": 4, "gap": {**GAP, "distribution": "unifor"}}, "mean 'uniform'?"),
        ({"count": 4, "gap": {**GAP, "hihg": 1}}, "did you mean 'high'?"),
        ({"count": 4, "gap": {**GAP, "high": 1e-5}}, "high must be > low"),
        ({"count": 4, "gap": {**GAP, "high": math.nan}}, "must be a finite number"),
        ({"count": 4, "force": {**FORCE, "deviation": 0}}, "a number > 0, got 0"),
        ({"count": 4, "nodal_diameter": GAP}, "must be an input of real numbers"),
        ({"count": 4, "speed": GAP}, "speed is in [sweep] or [zip] and in [sample]"),
        ({"count": 4, "gap": GAP, "scene": {"gap": GAP}}, "unknown scene input"),
        ({"count": 4, "method": "saltelli", "gap": GAP}, "two drawn inputs, got gap"),
        ({"count": 64, "gap": {"distribution": "normal", "mean": 1e-4,
                               "deviation": 1e-4}}, "truncated_normal keep draws"),
    ],
)  # fmt: skip
def test_a_wrong_table_is_one_line(table, told):
    with pytest.raises(InputError) as failed:
        design_of({**FAST, "sweep": {"speed": [300, 400]}, "sample": table})
    assert told in str(failed.value)
    assert "\n" not in str(failed.value)


def test_it_goes_with_no_list_of_cases_and_no_swept_blades():
    sample = {"count": 4, "gap": GAP}
    with pytest.raises(InputError, match=r"not with \[cases\]"):
        design_of({"cases": [{"speed": 3.0}], "sample": sample})
    law = {"distribution": "normal", "mean": 0.0, "deviation": 0.02}
    swept = {"engine.rotor.blades": [3, 4]}
    with pytest.raises(InputError, match="blades cannot be swept"):
        design_of({"sweep": swept, "sample": {"count": 4, "mistuning": law}})


@pytest.fixture(scope="module")
def sampled(tmp_path_factory):
    """Return the directory of two speeds with four draws each; do not write there."""
    out = tmp_path_factory.mktemp("sampled") / "out"
    tables = {
        **FAST,
        "sweep": {"speed": [300.0, 410.0]},
        "sample": {"count": 4, "gap": GAP},
    }
    with hpcwhirl.campaign(tables, out):
        return out


@pytest.mark.turns
def test_a_directory_keeps_its_draws_whatever_scipy_draws(sampled, monkeypatch):
    tables = {
        **FAST,
        "sweep": {"speed": [300.0, 410.0]},
        "sample": {"count": 4, "gap": GAP},
    }
    begun, plain = PlanFile(sampled).read(), Sample._unit
    monkeypatch.setattr(Sample, "_unit", lambda *_: 1.0 - plain(*_))
    assert list(design_of(tables).digests) != begun.digests
    assert list(as_begun(design_of(tables), PlanFile(sampled)).digests) == begun.digests
    more = design_of({**tables, "sample": {"count": 8, "gap": GAP}})
    with pytest.raises(InputError, match="other draws than this version of SciPy"):
        as_begun(more, PlanFile(sampled))


@pytest.mark.turns
def test_more_draws_continue_and_other_ones_are_refused(tmp_path):
    out = tmp_path / "out"
    few = {**FAST, "sample": {"count": 2, "gap": GAP}}
    with hpcwhirl.campaign(few, out):
        pass
    with hpcwhirl.campaign({**FAST, "sample": {"count": 4, "gap": GAP}}, out) as data:
        assert data.sizes["case"] == 4
    assert len(records(out)) == 4
    before = (out / "campaign.json").read_bytes()
    other = {**FAST, "sample": {"count": 4, "gap": GAP, "seed": 7}}
    for tables in (other, {**FAST, "sweep": {"gap": [1e-4, 2e-4]}}):
        with pytest.raises(InputError, match="was begun with sample = "):
            hpcwhirl.campaign(tables, out)
    assert (out / "campaign.json").read_bytes() == before


@pytest.mark.parametrize(("count", "total"), [(0, 8), (3, 8), (8, 8), (50, 1000)])
def test_wilsons_interval_solves_its_equation(count, total):
    z, p = NormalDist().inv_cdf(0.975), count / total
    share, *ends = interval(count, total)
    assert share == p
    for end in ends:  # Wilson (1927): |p - end| = z sqrt(end (1 - end) / n)
        assert abs(p - end) == pytest.approx(
            z * math.sqrt(max(end * (1 - end), 0.0) / total), abs=1e-7
        )
    assert np.isnan(interval(0, 0)).all()


def renamed(folder, tmp_path, regimes, failed=()):
    """Return results of a campaign whose cases have other regimes."""
    place = tmp_path / "results.h5"
    place.write_bytes((folder / "results.h5").read_bytes())
    with h5py.File(place, "r+") as file:
        known = ["none", *REGIMES]
        over = np.array(regimes) == "overloaded"
        own = np.where(over, "none", regimes).tolist()
        file["regime"][:] = [known.index(word) for word in own]
        outcome = ENUMS["outcome"]
        file["outcome"][over] = outcome.index("overloaded")
        for case in failed:
            file["regime"][case], file["status"][case] = 0, 1
    return place


def test_shares_are_counted_at_each_point(sampled, tmp_path):
    words = ["damped", "damped", "overloaded", "divergent"] + ["sustained"] * 4
    place = renamed(sampled, tmp_path, words, failed=[5, 6])
    with hpcwhirl.open_results(place) as data:
        found = shares(data)
        late = shares(data.isel(case=slice(4, 8)))  # of a part alike
    assert found.speed.to_numpy().tolist() == [300.0, 410.0]
    share = found["share"].to_numpy().tolist()
    assert share == [[0.5, 0, 0.25, 0, 0.25], [0, 1, 0, 0, 0]]
    assert found.cases.to_numpy().tolist() == [4, 2]
    assert found.lost.to_numpy().tolist() == [0, 2]
    own = found.sel(regime="divergent").isel(point=0)
    assert (own.share_low, own.share_high) == interval(1, 4)[1:]
    assert late.equals(found.isel(point=[1]))


def test_where_nothing_was_drawn_there_are_no_shares(finished):
    with (
        hpcwhirl.open_results(finished) as data,
        pytest.raises(InputError, match=r"has no \[sample\]"),
    ):
        hpcwhirl.shares(data)


@pytest.mark.turns
def test_dependent_draws_of_saltelli_count_for_no_share(tmp_path):
    given = {"count": 2, "method": "saltelli", "gap": GAP, "force": FORCE}
    with hpcwhirl.campaign({**FAST, "sample": given}, tmp_path / "out") as data:
        assert data.sizes["case"] == 8
        assert shares(data).cases.to_numpy().tolist() == [4]


@pytest.mark.turns
def test_the_map_shows_shares_and_its_table_has_them(sampled, tmp_path, capsys):
    words = ["damped", "damped", "damped", "divergent"] + ["sustained"] * 4
    place = renamed(sampled, tmp_path, words)
    assert main(["map", str(place), "--csv"]) == 0
    lines = (tmp_path / "map.csv").read_text().splitlines()
    assert lines[0].startswith("point,speed,cases,lost,regime,count,share,")
    assert lines[1].startswith("0,300.0,4,0,damped,3,0.75,")
    assert len(lines) == 1 + 2 * 5
    svg = (tmp_path / "map.svg").read_text()
    assert all(f'id="share {w}"' in svg for w in ("damped", "divergent", "sustained"))
    assert 'id="share undecided"' not in svg
    with hpcwhirl.open_results(place) as data:
        axes = figure_of_shares(data, shares(data), "").axes[0]
    low, high = axes.get_xlim()
    assert low < 299.0  # the intervals at both ends are seen beside the frame
    assert high > 411.0
    assert main(["map", str(place), "--x", "gap"]) == 0  # of cases, as ever
    assert main(["map", str(place), "--at", "speed=300"]) == 0  # bars
    capsys.readouterr()


@pytest.mark.turns
def test_a_map_over_two_inputs_has_a_panel_for_each_regime(tmp_path):
    out = tmp_path / "out"
    swept = {"speed": [300.0, 410.0], "friction": [0.1, 0.2]}
    tables = {**FAST, "sweep": swept, "sample": {"count": 2, "gap": GAP}}
    with hpcwhirl.campaign(tables, out):
        pass
    words = ["damped", "divergent"] * 2 + ["damped"] * 4
    place = renamed(out, tmp_path, words)
    figure = drawing_of(place, Wish()).figure
    shown = {
        axes.get_title(): mesh.get_array().tolist()
        for axes in figure.axes for mesh in axes.collections
        if mesh.get_gid() == "numbers"
    }  # fmt: skip
    assert shown == {
        "motion = damped": [[0.5, 1.0], [0.5, 1.0]],
        "motion = divergent": [[0.5, 0.0], [0.5, 0.0]],
    }
    told = figure.get_suptitle()
    assert "drawn: gap, 2 times a point" in told.replace("\n", " ")
    assert "gap = " not in told


SMALL = (
    TOML
    + """
sweep = {speed = [300, 410]}
[sample]
count = 4
method = "saltelli"
seed = 3
gap = {distribution = "uniform", low = 1e-4, high = 3e-4}
force = {distribution = "lognormal", median = 75e3, deviation = 0.2}
"""
)


@pytest.mark.slow
@pytest.mark.mpi
@pytest.mark.mpiio
def test_a_sampled_campaign_has_the_same_bits_for_any_ranks_and_kills(tmp_path):
    path = tmp_path / "small.toml"
    path.write_text(SMALL)
    assert launch("campaign", path, "--out", tmp_path / "alone").returncode == 0
    words = ["campaign", path, "--out", tmp_path / "killed"]
    process = start(words, 2, first=held(tmp_path / "killed", 1))
    wait_for(lambda: records(tmp_path / "killed"), process)
    kill(process)
    assert 0 < len(records(tmp_path / "killed")) <= 2
    assert launch(*words, ranks=2).returncode == 0
    both = [root_variables(tmp_path / name) for name in ("alone", "killed")]
    assert both[0] == both[1]
    with h5py.File(tmp_path / "killed" / "results.h5") as file:
        assert json.loads(file.attrs["sample"])["each"] == 16


@pytest.mark.mpi
@pytest.mark.evidence
def test_mistuned_engines_have_the_same_bits_on_any_number_of_ranks(tmp_path):
    tables = """
scene = {duration = 1e-3}
engine = {rotor = {blades = 12}, casing = {harmonics = 12}}
solver = {modes = 24, time_step = 1e-5}
output = {traces = "blades", interval = 1e-4}
sample = {count = 4, seed = 5, tuned = true, \
    mistuning = {distribution = "normal", mean = 0.0, deviation = 0.02}}
"""
    path, found = tmp_path / "population.toml", []
    path.write_text(tables)
    for ranks in (1, 2, 3):
        out = tmp_path / str(ranks)
        done = launch("campaign", path, "--out", out, ranks=ranks)
        assert done.returncode == 0, done.err
        found.append(root_variables(out))
    assert all(one == found[0] for one in found)


def test_a_law_of_another_type_is_refused():
    with pytest.raises(InputError, match="unknown distribution"):
        law_of("gap", {"distribution": ["uniform"], "low": 1e-4, "high": 2e-4})
