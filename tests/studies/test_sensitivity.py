"""Sobol' indices: of a known function, of a real scene, and of what is not there."""

import csv
import io
from functools import cache

import h5py
import numpy as np
import pytest
import xarray
from scipy.stats import norm, sobol_indices

import hpcwhirl
from hpcwhirl.campaign.plan.design import design_of
from hpcwhirl.cli import main
from hpcwhirl.cli.sensitivity import tell
from hpcwhirl.errors import InputError
from hpcwhirl.report.figures import indices as indices_drawn
from hpcwhirl.report.figures.indices import draw_sensitivity
from hpcwhirl.store.results.sampled import sample_attribute
from hpcwhirl.studies.sensitivity import (
    indices,
    intervals,
    pairs_needed,
    sensitivity,
    widest,
)

pytestmark = pytest.mark.turns

FAST = {
    "scene": {"duration": 2e-3},
    "solver": {"time_step": 2e-6},
    "output": {"interval": 5e-5, "traces": "summary"},
}
ANGLE = {"distribution": "uniform", "low": -np.pi, "high": np.pi}
THREE = ("speed", "engine.casing.amplitude", "engine.casing.growth")
# Ishigami and Homma (1990) with a = 7, b = 0.1: variance and its parts, by integration
A, B = 7.0, 0.1
V = A**2 / 8 + B * np.pi**4 / 5 + B**2 * np.pi**8 / 18 + 0.5
V1, V2, V13 = 0.5 * (1 + B * np.pi**4 / 5) ** 2, A**2 / 8, 8 * B**2 * np.pi**8 / 225


def ishigami(x, y, z):
    return np.sin(x) + A * np.sin(y) ** 2 + B * z**4 * np.sin(x)


def results(count, function, method="saltelli", **more):
    """Return results as a campaign would give them, of a function of three inputs."""
    table = {"count": count, "method": method, "seed": 4}
    table |= dict.fromkeys(THREE, ANGLE)
    made = design_of({**FAST, "sample": table, **more})
    columns = [np.array([row[name] for row in made.settings]) for name in THREE]
    names = [*made.swept]
    cases = len(made.settings)
    short = {n: n.replace("engine.", "").replace(".", "_") for n in names}
    data = xarray.Dataset(
        {
            "y": ("case", function(*columns)),
            "regime": ("case", np.full(cases, "damped", dtype=object)),
            "outcome": ("case", np.full(cases, "completed", dtype=object)),
            **{short[n]: ("case", np.array([r[n] for r in made.settings]))
               for n in names},
        },
        coords={"case": np.arange(cases)},
    )  # fmt: skip
    plan = made.manifest()
    return data.assign_attrs(swept=" ".join(short.values()), **sample_attribute(plan))


@cache
def of_many():
    return sensitivity(results(4096, ishigami), ["y"])


def test_ishigamis_indices_are_found():
    found = of_many().isel(point=0, quantity=0)
    first, total = np.array([V1, V2, 0.0]) / V, np.array([V1 + V13, V2, V13]) / V
    np.testing.assert_allclose(found["first"], first, atol=0.02)
    np.testing.assert_allclose(found["total"], total, atol=0.02)
    assert (found["first_low"] <= first).all()
    assert (first <= found["first_high"]).all()
    assert (found["total_low"] <= total).all()
    assert (total <= found["total_high"]).all()
    assert float(found["deviation"]) == pytest.approx(V**0.5, rel=0.01)
    assert found["draws"] == 4096


def test_they_are_scipys_where_scipy_takes_the_draws():
    rng = np.random.default_rng(1)
    a, b, mixed = rng.normal(size=64), rng.normal(size=64), rng.normal(size=(3, 64))
    known = sobol_indices(
        func={"f_A": a[None], "f_B": b[None], "f_AB": mixed[:, None]}, n=64
    )
    own = indices(a, b, mixed)
    np.testing.assert_allclose(own[0], known.first_order.ravel(), rtol=1e-12)
    np.testing.assert_allclose(own[1], known.total_order.ravel(), rtol=1e-12)


def test_an_interval_covers_as_often_as_it_says():
    inside, tries, rng = 0, 40, np.random.default_rng(2)
    for _ in range(tries):  # y = 2 x1 + x2: S1 = 0.8
        a, b = norm.ppf(rng.random((2, 2, 128)))
        f = lambda x: 2 * x[0] + x[1]  # noqa: E731
        mixed = np.array([f([b[0], a[1]]), f([a[0], b[1]])])
        low, high = intervals(f(a), f(b), mixed)[:, 1, 0]
        inside += low <= 0.8 <= high
    assert 0.85 * tries <= inside < tries


def test_an_interval_of_a_regime_covers_an_input_that_changes_few_words():
    """Where no pair of draws shows a change, all resamples have the index 0."""

    def regime(x):  # x: (3, n), uniform
        return (x[0] + 0.5 * x[1] + 0.2 * x[2] > 1.0).astype(float)

    def ends(pairs, rng, found=intervals):
        a, b = rng.random((2, 3, pairs))
        swapped = [np.where(np.arange(3)[:, None] == i, b, a) for i in range(3)]
        return found(regime(a), regime(b), np.array([regime(x) for x in swapped]))

    rng = np.random.default_rng(3)
    true, tries = ends(10**6, rng, indices), 60
    low, high = np.array([ends(16, rng) for _ in range(tries)]).swapaxes(0, 1)
    covered = ((low <= true) & (true <= high)).mean(axis=0)
    assert covered.min() >= 0.88


def test_a_pair_without_a_number_is_left_out_and_counted():
    data = results(512, ishigami)
    broken = data["y"].to_numpy().copy()
    broken[[3, 4, 5, 27]] = np.nan, np.inf, np.nan, np.nan  # of pairs 0, 0 or 1, 5
    data["y"] = ("case", broken)
    word = data["regime"].to_numpy().copy()
    word[50] = "none"  # unstable: its numbers are finite and mean nothing
    data["regime"] = ("case", word)
    found = sensitivity(data, ["y", "damped"])
    lost = len({i // 5 for i in (3, 4, 5, 27, 50)})
    assert found["dropped"].to_numpy().tolist() == [[lost, 1]]
    assert found["draws"].to_numpy().tolist() == [[512 - lost, 511]]
    one = found.isel(point=0, quantity=0)
    np.testing.assert_allclose(
        one["total"], np.array([V1 + V13, V2, V13]) / V, atol=0.1
    )


def test_an_overloaded_case_counts_for_words_and_has_no_number():
    data = results(16, ishigami)
    for name, word in (("regime", "none"), ("outcome", "overloaded")):
        words = data[name].to_numpy().copy()
        words[:25] = word
        data[name] = ("case", words)
    found = sensitivity(data, ["y", "damped", "overloaded"])
    assert found["dropped"].to_numpy().tolist() == [[5, 0, 0]]
    mean = found["mean"].isel(point=0).to_numpy()
    assert mean[1:] == pytest.approx([11 / 16, 5 / 16])


def test_what_does_not_vary_has_no_index():
    data = results(16, lambda x, *_: 0.0 * x)
    found = sensitivity(data, ["y", "damped", "divergent"])
    assert np.isnan(found["first"]).all()
    assert np.isnan(found["total_high"]).all()
    assert (found["deviation"] == 0).all()


def test_a_word_that_hardly_a_case_has_has_no_interval():
    data = results(32, ishigami)
    word = data["regime"].to_numpy().copy()
    word[5] = "divergent"  # one of 160: many resamples have none
    data["regime"] = ("case", word)
    found = sensitivity(data, ["divergent"])
    assert np.isfinite(found["total"]).all()
    assert np.isnan(found["total_low"]).all()


def test_too_few_draws_have_no_index():
    found = sensitivity(results(4, ishigami), ["y"])
    assert np.isnan(found["total"]).all()
    assert found["draws"] == 4


def test_each_point_of_a_sweep_has_its_own():
    def of_friction(x, y, z):
        return np.where(np.arange(len(x)) < len(x) // 2, x, y + 0 * z)

    data = results(256, of_friction, sweep={"friction": [0.1, 0.2]})
    found = sensitivity(data, ["y"]).isel(quantity=0)
    assert found["friction"].to_numpy().tolist() == [0.1, 0.2]
    np.testing.assert_allclose(found["total"], [[1, 0, 0], [0, 1, 0]], atol=0.1)
    assert (found["total"].isel(input=2) == 0.0).all()


@pytest.mark.parametrize("method", ["sobol", "random"])
def test_a_plain_sample_is_refused_in_a_line(method):
    with pytest.raises(InputError, match=r'need .sample. method = "saltelli", got "'):
        sensitivity(results(8, ishigami, method), ["y"])


def test_an_unknown_number_is_refused_with_the_nearest():
    data = results(8, ishigami).rename(y="orbit_radius")
    with pytest.raises(InputError, match="did you mean 'orbit_radius'"):
        sensitivity(data, ["orbit_radis"])


SPREAD = {
    "force": {"distribution": "uniform", "low": 5e4, "high": 10e4},
    "gap": {"distribution": "uniform", "low": 1e-4, "high": 4e-4},
    "engine.casing.growth": {"distribution": "normal", "mean": 0.0, "deviation": 1.0},
}


@pytest.fixture(scope="module")
def real(tmp_path_factory):
    """Return the directory of a small scene, its casing's growth of no effect."""
    out = tmp_path_factory.mktemp("real") / "out"
    sample = {"count": 32, "method": "saltelli", "seed": 1, **SPREAD}
    with hpcwhirl.campaign({**FAST, "sample": sample}, out):
        return out


def test_of_a_real_scene_they_are_those_of_brute_force(real):
    middles = (np.arange(6) + 0.5) / 6
    swept = {
        "force": (5e4 + 5e4 * middles).tolist(),
        "gap": (1e-4 + 3e-4 * middles).tolist(),
    }
    brute = design_of({**FAST, "sweep": swept})
    y = np.array([hpcwhirl.simulate(s).row["centre_peak"] for s in brute.scenes])
    table = y.reshape(6, 6)  # means over the other input: the definition of an index
    known = np.array([table.mean(axis=1).var(), table.mean(axis=0).var()]) / y.var()
    assert known.min() > 0.05
    with hpcwhirl.open_results(real) as data:
        found = sensitivity(data, ["centre_peak"]).isel(point=0, quantity=0)
    assert found["draws"] == 32
    for place, index in enumerate(known):
        assert (
            found["first_low"][place] - 0.05
            <= index
            <= found["first_high"][place] + 0.05
        )
    inert = found.sel(input="casing_growth")
    assert [float(inert[n]) for n in ("first", "total", "total_high")] == [0, 0, 0]


def test_the_command_prints_them(real, tmp_path, facts, capsys):
    words = ["sensitivity", str(real), "--out", str(tmp_path), "--of"]
    told = facts(*words, "centre_peak,divergent", "--json")
    assert {row["input"] for row in told["indices"]} == {
        "force", "gap", "casing_growth",
    }  # fmt: skip
    still = [row for row in told["indices"] if row["quantity"] == "divergent"]
    assert {row["total"] for row in still} == {None}
    assert told["figures"] == []  # of so few
    assert main([*words, "centre_peak", "--csv"]) == 0
    table = list(csv.DictReader(io.StringIO(capsys.readouterr().out)))
    numbers = [row for row in told["indices"] if row["quantity"] == "centre_peak"]
    assert [float(row["total"]) for row in table] == [row["total"] for row in numbers]
    assert main([*words, "divergent"]) == 0
    out, err = capsys.readouterr()
    assert "casing_growth" in out
    assert "divergent: does not vary at 1 of 1 points: no index there" in err


def test_left_out_pairs_are_told(real, tmp_path, capsys):
    place = tmp_path / "results.h5"
    place.write_bytes((real / "results.h5").read_bytes())
    with h5py.File(place, "r+") as file:
        file["orbit_radius"][7] = np.nan
    assert main(["sensitivity", str(place), "--of", "orbit_radius"]) == 0
    told = "orbit_radius: 1 of 32 pairs of draws have a case without this number"
    assert told in capsys.readouterr().err


@pytest.mark.parametrize(("count", "few"), [(8, True), (4096, False)])
def test_too_few_draws_are_told(count, few, capsys):
    tell(sensitivity(results(8, ishigami), ["y"]) if few else of_many())
    told = capsys.readouterr().err
    assert (f"too few draws ({count}) to rank inputs" in told) == few
    assert ("about count = " in told) == few


def test_the_number_of_pairs_told_is_near_the_one_that_does():
    """With as many as it told, it soon ends, and never asked for far more."""
    counts = [16]
    while needed := pairs_needed(
        found := sensitivity(results(counts[-1], ishigami), ["y"])
    ):
        assert counts[-1] < needed <= 64 * counts[-1]
        counts.append(needed)
    assert 2 <= len(counts) <= 4
    assert 0.1 < widest(found) <= 0.5


def test_what_too_few_draws_tell_is_not_drawn(tmp_path):
    few = results(16, ishigami)
    assert draw_sensitivity(few, sensitivity(few, ["y"]), tmp_path) == []
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("speeds", [2, 6, 7])
def test_bars_of_few_points_and_lines_of_many(speeds, tmp_path):
    sweep = {"friction": (0.01 * np.arange(1, speeds + 1)).tolist()}
    data = results(512, ishigami, sweep=sweep)
    data["friction"].attrs["units"] = "1"
    found = sensitivity(data, ["y"])
    figures = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(indices_drawn, "save", lambda figure, _: figures.append(figure))
        draw_sensitivity(data, found, tmp_path)
    panels = figures[0].axes
    if speeds == 7:
        assert len(panels) == 2  # first and total
        return
    values = (f"{0.01 * k:g}" for k in range(1, speeds + 1))
    assert [axes.get_ylabel() for axes in panels] == [f"μ = {one}" for one in values]
    for point, axes in enumerate(panels):
        widths = [bar.get_width() for bar in axes.patches]
        one = found.isel(point=point, quantity=0)
        want = [*one["first"].values, *one["total"].values]
        assert widths == pytest.approx(want)
        low, high = axes.get_xlim()  # an index lies from 0 to 1
        assert (-0.2 < low < 0.0, 1.0 < high < 1.2) == (True, True)


def test_a_panel_without_indices_says_why(tmp_path, monkeypatch):
    data = results(512, ishigami, sweep={"friction": [0.01, 0.02]})
    data["friction"].attrs["units"] = "1"
    data["y"] = data["y"].where(data["friction"] > 0.015, 3.0)
    figures = []
    monkeypatch.setattr("hpcwhirl.studies.sensitivity.RESAMPLES", 50)
    monkeypatch.setattr(indices_drawn, "save", lambda figure, _: figures.append(figure))
    draw_sensitivity(data, sensitivity(data, ["y"]), tmp_path)
    told = [[text.get_text() for text in axes.texts] for axes in figures[0].axes]
    assert told == [["does not vary"], []]


def test_indices_over_two_inputs_are_drawn_at_a_value_of_one(tmp_path, monkeypatch):
    monkeypatch.setattr("hpcwhirl.studies.sensitivity.RESAMPLES", 50)
    data = results(512, ishigami, sweep={"friction": [0.01, 0.02], "gap": [1e-4, 2e-4]})
    with pytest.raises(InputError, match=r"not friction and gap: add --at gap=VALUE$"):
        draw_sensitivity(data, sensitivity(data, ["y"]), tmp_path)


def test_a_campaign_without_a_sample_is_refused(finished, capsys):
    assert main(["sensitivity", str(finished)]) == 2
    assert "has no [sample]" in capsys.readouterr().err
