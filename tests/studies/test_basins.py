"""Basins: fractions and entropies of known maps, attractors of made-up motions."""

import json
import math

import h5py
import numpy as np
import pytest
import xarray
from scipy.stats import binom
from synthetic import synthetic

import hpcwhirl
from hpcwhirl.campaign.plan.design import design_of
from hpcwhirl.cli import main
from hpcwhirl.errors import InputError
from hpcwhirl.store.reading.shares import interval
from hpcwhirl.store.results.sampled import sample_attribute
from hpcwhirl.studies.attractors import (
    FEATURES,
    FEWEST,
    attractors,
    clusters,
    silhouette,
)
from hpcwhirl.studies.basins import basin_entropy, basins, entropy, starts_of

FAST = {
    "scene": {"duration": 2e-3},
    "solver": {"time_step": 2e-6},
    "output": {"interval": 5e-5, "traces": "summary"},
}
WORD = {1: "damped", 2: "sustained", 3: "divergent", 0: "undecided", 4: "overloaded",
        5: "unstable"}  # fmt: skip


def results(function, **tables):
    """Return results as a campaign would give them, of a function: start -> number."""
    made = design_of({**FAST, **tables})
    names = [*made.swept]
    columns = {n: np.array([row[n] for row in made.settings]) for n in names}
    number = np.asarray(function(**columns))
    data = {n: ("case", values) for n, values in columns.items()}
    word = np.array([WORD[int(i)] for i in number], dtype=object)
    without = np.isin(number, [4, 5])
    data["regime"] = ("case", np.where(without, "none", word))
    data["outcome"] = ("case", np.where(without, word, "completed"))
    found = xarray.Dataset(data, coords={"case": np.arange(len(number))})
    plan = made.manifest()
    return found.assign_attrs(swept=" ".join(names), **sample_attribute(plan))


def uniform(low, high):
    return {"distribution": "uniform", "low": low, "high": high}


def cubic(force, **_):
    """Return where x -> x (3 - x^2)/2 leads from x = force/1e3 - 0.6.

    Its fixed points are -1 and 1, with the slope 0, and 0 with 1.5: what begins in
    (0, sqrt 3) ends at 1, so that 0.7 of the starts of (-0.6, 1.4) do.
    """
    x = force / 1e3 - 0.6
    for _ in range(60):
        x = 0.5 * x * (3.0 - x**2)
    return np.where(x > 0.0, 2, 1)


def wells(force, pulse, **_):
    """Return the well of a damped Duffing oscillator in which a start ends, 1 or 2.

    x'' + x' / 4 - x + x^3 = 0 is the same for -x: from starts over a square about 0
    each well is reached by half of them, with a boundary that winds around both.
    """
    x, v, h = force / 1e3 - 2.0, 1e3 * pulse - 2.0, 0.05
    for _ in range(1200):
        middle = v + 0.5 * h * (x - x**3 - 0.25 * v)
        x, v = x + h * middle, middle
        v = (v + 0.5 * h * (x - x**3)) / (1 + 0.125 * h)
    return np.where(x > 0.0, 2, 1)


def test_an_interval_covers_a_known_basin_as_often_as_it_says():
    """Of all numbers of 64 starts that may lie in a basin of 0.7, by their chance."""
    count = 64

    def as_many_as_the_point_says(friction, **_):
        place = np.arange(len(friction)) % count  # of a point, one after the other
        return np.where(place < np.rint(1e3 * friction), 2, 1)

    data = results(
        as_many_as_the_point_says,
        sweep={"friction": [1e-3 * k for k in range(count + 1)]},
        sample={"count": count, "force": uniform(0.0, 2e3)},
    )
    found = basins(data).sel(regime="sustained")
    number = np.rint(1e3 * found["friction"].to_numpy())
    assert found["share"].to_numpy() == pytest.approx(number / count)
    inside = (found["share_low"] <= 0.7) & (found["share_high"] >= 0.7)
    covered = binom.pmf(number, count, 0.7)[inside.to_numpy()].sum()
    assert 371 / 400 <= covered <= 389 / 400, covered


def test_every_start_has_a_share_the_strongest_too():
    """Above 600 N the load carries the tips to the limit, 1000 N gives no result.

    Of 10 starts 3 are damped, 3 sustained, 3 overloaded; one has no result.
    """

    def loaded(force, **_):
        return np.select([force < 350, force < 650, force < 950], [1, 2, 4], default=5)

    forces = {"start": 100.0, "stop": 1000.0, "step": 100.0}
    data = results(loaded, sweep={"force": forces})
    numbers = dict.fromkeys((f.name for f in FEATURES["sustained"]), 1.0)
    numbers |= {"growth_rate": 1.0, "speed": 1.0, "gap_scale": 1.0}
    numbers.pop("period")
    data = data.assign({n: ("case", np.full(10, v)) for n, v in numbers.items()})
    for by in ("regime", "attractor"):
        found = basins(data, by).isel(point=0)
        assert (found["cases"], found["lost"]) == (9, 1)
        for kind in ("damped", "overloaded"):
            own = found.sel({by: kind})
            ends = (own["share"], own["share_low"], own["share_high"])
            assert tuple(map(float, ends)) == interval(3, 9)


@pytest.mark.turns
def test_the_basins_of_a_duffing_oscillator_are_halves():
    sample = {"count": 4096, "force": uniform(0.0, 4e3), "pulse": uniform(1e-9, 4e-3)}
    found = basins(results(wells, sample=sample)).isel(point=0)
    assert found["share"].sel(regime="sustained") == pytest.approx(0.5, abs=0.01)
    assert float(found["entropy"]) == pytest.approx(math.log(2.0), abs=1e-3)
    assert "basin_entropy" not in found  # no grid


def test_a_grid_of_starts_has_the_entropy_of_its_boxes():
    force = {"start": 0.0, "stop": 1900.0, "step": 100.0}  # 20: four boxes of five
    pulse = {"start": 1e-3, "stop": 2e-3, "step": 1e-4}  # 11: two boxes, one left over
    split = lambda force, **_: np.where(force < 650.0, 1, 2)  # noqa: E731
    found = basins(results(split, sweep={"force": force, "pulse": pulse}))
    one = found.isel(point=0)
    # in 2 of 8 boxes 2 of 5 columns are damped
    mixed = -(0.4 * math.log(0.4) + 0.6 * math.log(0.6))
    assert one["boxes"] == 8
    assert float(one["boundary_entropy"]) == pytest.approx(mixed, rel=1e-12)
    assert float(one["basin_entropy"]) == pytest.approx(2 / 8 * mixed, rel=1e-12)
    assert one["share"].sel(regime="damped") == 7 / 20
    assert found.attrs["starts"] == "force pulse"


def test_mixed_basins_have_the_entropy_of_chance_and_one_basin_has_none():
    rng = np.random.default_rng(3)
    mixed = np.array(["a", "b", "c"])[rng.integers(3, size=(200, 200))]
    s_b, s_bb, boxes = basin_entropy(mixed, [20, 20])
    # of 400 starts too small by about (3 - 1) / 800
    assert s_b == s_bb == pytest.approx(math.log(3.0) - 2 / 800, abs=1e-3)
    assert boxes == 100
    assert basin_entropy(np.full((9, 9), "a"), [5, 5]) == (0.0, 0.0, 1)
    assert np.isnan(basin_entropy(np.full((4, 9), "a"), [5, 5])[0])
    assert np.isnan(basin_entropy(np.full((5, 5), ""), [5, 5])[0])
    assert entropy(np.array([[2, 2], [4, 0], [0, 0]]))[:2] == pytest.approx(
        [math.log(2.0), 0.0]
    )


def test_lobes_and_directions_have_no_neighbours_in_a_box():
    force = {"start": 0.0, "stop": 900.0, "step": 100.0}
    by_lobes = lambda nodal_diameter, **_: 1 + nodal_diameter % 2  # noqa: E731
    tables = {"sweep": {"force": force, "nodal_diameter": [1, 2, 3]}}
    found = basins(results(by_lobes, **tables)).isel(point=0)
    assert found["boxes"] == 2 * 3
    assert found["basin_entropy"] == 0.0  # each box is of one number of lobes
    assert float(found["entropy"]) > 0.6


def test_points_are_combinations_of_what_is_no_start():
    sweep = {"speed": [300.0, 200.0], "friction": [0.1, 0.2],
             "nodal_diameter": [1, 2]}  # fmt: skip
    data = results(
        lambda speed, **_: np.where(speed > 250, 2, 1),
        sweep=sweep, sample={"count": 8, "force": uniform(0.0, 2e3)},
    )  # fmt: skip
    found = basins(data)  # of drawn starts, lobes that are swept are points
    assert found.sizes["point"] == 8
    assert starts_of(data).swept == ("speed", "friction", "nodal_diameter")
    fast = found["speed"].to_numpy() == 300.0
    share = found["share"].sel(regime="sustained").to_numpy()
    np.testing.assert_array_equal(share, fast)
    assert (found["cases"] == 8).all()


def test_cases_without_a_regime_are_lost():
    data = results(cubic, sample={"count": 8, "force": uniform(0.0, 2e3)})
    word = data["regime"].to_numpy().copy()
    word[3] = "none"
    found = basins(data.assign(regime=("case", word))).isel(point=0)
    assert (found["lost"], found["cases"]) == (1, 7)


@pytest.mark.parametrize(
    ("tables", "why"),
    [
        ({"sweep": {"speed": [1.0, 2.0]}}, "no start was drawn or swept"),
        ({"sample": {"count": 2, "gap": uniform(1e-4, 2e-4)}}, "gap was drawn"),
    ],
)
def test_what_has_no_starts_is_refused(tables, why):
    with pytest.raises(InputError, match=why):
        basins(results(lambda **c: 1 + 0 * next(iter(c.values())), **tables))


def test_branches_and_wrong_options_are_refused():
    data = results(cubic, sample={"count": 8, "force": uniform(0.0, 2e3)})
    followed = data.assign(branch=data["force"]).assign_attrs(swept="force branch")
    with pytest.raises(InputError, match="begin where other cases ended"):
        basins(followed)
    with pytest.raises(InputError, match="did you mean 'attractor'"):
        basins(data, "atractor")
    with pytest.raises(InputError, match="box must be >= 2"):
        basins(data, box=1)


CENTRES = np.array([[0.0, 0, 0], [6, 0, 0], [0, 8, 0], [6, 8, 5]])


@pytest.mark.parametrize(
    ("shares", "count"),
    [([0.5, 0.5], 300), ([0.85, 0.15], 64), ([0.6, 0.25, 0.15], 3000)],
)
def test_clusters_that_lie_apart_are_found(shares, count):
    rng = np.random.default_rng(count)
    own = rng.choice(len(shares), p=shares, size=count)
    # the second feature scatters, the third is the same for all
    points = CENTRES[own] + rng.normal(size=(count, 3)) * [0.3, 0.5, 0.01]
    label = clusters(points)
    assert len(set(zip(own, label, strict=True))) == len(shares)
    assert len(set(label)) == len(shares)
    assert (np.diff(np.bincount(label)) <= 0).all()  # the largest first


ALONE = {
    "one point": lambda _, n: np.zeros((n, 2)),
    "normal": lambda rng, n: rng.normal(size=(n, 3)),
    "wide": lambda rng, n: 30 * rng.random((n, 2)),
    "outliers": lambda rng, n: rng.standard_t(3, size=(n, 2)),
    "ring": lambda rng, n: 9 * np.exp(1j * rng.random((n, 1)) * 7).view(float),
    "apart by less than the tolerance": lambda rng, n: (
        0.9 * rng.integers(2, size=(n, 1))
    ),
}


@pytest.mark.parametrize("law", ALONE)
@pytest.mark.parametrize("count", [1, 64])
def test_one_cluster_is_not_split(law, count):
    rng = np.random.default_rng(5)
    split = [len(set(clusters(ALONE[law](rng, count)).tolist())) > 1 for _ in range(20)]
    assert sum(split) <= 1


def test_a_few_points_apart_make_no_cluster():
    points = np.zeros((40, 1))
    points[: FEWEST - 1] = 50.0
    assert not clusters(points).any()
    points[:FEWEST] = 50.0
    assert clusters(points)[:FEWEST].tolist() == [1] * FEWEST


def test_a_few_points_apart_hide_no_other_clusters():
    """Two starts on a third motion, nearer to the first than the second is."""
    rng = np.random.default_rng(4)
    centres = np.array([[0.0, 0.0], [100.0, 0.0], [0.0, 60.0]])
    own = np.repeat([0, 1, 2], [12, 9, FEWEST - 1])
    label = clusters(centres[own] + 0.3 * rng.normal(size=(len(own), 2)))
    assert label.tolist() == [0] * 12 + [1] * 9 + [0] * (FEWEST - 1)


def test_a_silhouette_is_that_of_its_definition():
    points = np.array([0.0, 1.0, 10.0])
    away = np.abs(points[:, None] - points)
    # of two: a = 1 and b = 10 or 9; of the one alone 0
    assert silhouette(away, np.array([0, 0, 1])) == pytest.approx((0.9 + 8 / 9) / 3)


def motions(speed, radius, line, regime="sustained", **more):
    """Return results of one case for each of some motions."""
    count = len(speed)
    fill = {"gap_scale": 1e-4, "whirl_ratio": np.sign(line), "late_energy": 1.0,
            "late_lost": 2.0, "growth_rate": 3.0} | more  # fmt: skip
    columns = {"speed": speed, "orbit_radius": radius, "line_frequency": line, **fill}
    data = {n: ("case", np.broadcast_to(np.asarray(v, float), count).copy())
            for n, v in columns.items()}  # fmt: skip
    regime = np.broadcast_to(np.array(regime, object), count).copy()
    ended = np.full(count, "completed")
    return xarray.Dataset(
        data | {"regime": ("case", regime), "outcome": ("case", ended)}
    )


def test_attractors_keep_their_number_along_a_sweep():
    speed = np.repeat([300.0, 310.0, 320.0], 10)
    kind = np.tile([0, 0, 0, 1, 1, 1, 1, 1, 2, 2], 3)
    kind[20:23] = 1  # the first one ends before 320 rad/s
    rng = np.random.default_rng(0)
    scatter = 1 + 0.01 * rng.normal(size=30)
    radius = np.array([1e-4, 3e-4, 5e-5])[kind] * scatter * speed / 300
    line = np.array([-150.0, 90.0, 0.0])[kind] * speed / 300
    regime = np.array(["sustained", "sustained", "damped"], object)[kind]
    data = motions(speed, radius, line, regime)
    name = attractors(data, np.repeat([0, 1, 2], 10))
    assert set(name[kind == 2]) == {"damped"}
    assert set(name[kind == 1]) == {"A1 sustained"}  # of 5, the larger one
    assert set(name[kind == 0]) == {"A2 sustained"}


def test_a_centre_at_rest_has_no_radius_and_no_line():
    rng = np.random.default_rng(1)
    radius, line = 10.0 ** rng.uniform(-19, -15, 40), rng.normal(0, 300, 40)
    data = motions(np.full(40, 300.0), radius, line)
    assert set(attractors(data, np.zeros(40, int))) == {"A1 sustained"}


def test_divergent_motions_are_told_apart_by_whirl_alone_and_growth():
    line = np.repeat([-80.0, 120.0], 8)
    data = motions(np.full(16, 300.0), 1e-3, line, "divergent",
                   late_energy=10.0 ** np.arange(16))  # fmt: skip
    name = attractors(data, np.zeros(16, int))
    assert [*dict.fromkeys(name.tolist())] == ["A1 divergent", "A2 divergent"]


def test_periods_part_motions_that_are_alike_otherwise():
    period, motion = np.repeat([1, 2, 5], 4), np.repeat(["periodic", "chaotic"], [8, 4])
    data = motions(np.full(12, 300.0), 1e-4, 90.0)
    data = data.assign(period=("case", period), motion=("case", motion.astype(object)))
    name = attractors(data, np.zeros(12, int))
    assert [len(set(name[at])) for at in np.split(np.arange(12), 3)] == [1, 1, 1]
    assert len(set(name)) == 3
    data["motion"][:] = "chaotic"  # whose best return means nothing
    assert len(set(attractors(data, np.zeros(12, int)))) == 1


def test_a_regime_without_a_name_has_no_attractor():
    data = motions(np.full(3, 1.0), 1e-4, 1.0, ["none", "undecided", "damped"])
    assert attractors(data, np.zeros(3, int)).tolist() == ["", "undecided", "damped"]


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    """Return a campaign over speed, force and pulse whose strong pulses whirl."""
    folder = tmp_path_factory.mktemp("basin") / "out"
    rows = [
        {"speed": speed, "force": force, "pulse": pulse}
        for speed in (300.0, 400.0)
        for force in np.linspace(1e4, 1e5, 10)
        for pulse in np.linspace(1e-4, 1e-3, 10)
    ]
    synthetic(folder, rows)
    strong = np.array([row["force"] * row["pulse"] > 40.0 for row in rows])
    with h5py.File(folder / "results.h5", "r+") as file:
        file["regime"][:] = 1 + strong  # damped, sustained
        for name in ("orbit_radius", "line_frequency", "gap_scale"):
            file[name][:] = 90.0
    return folder


@pytest.mark.turns
def test_the_command_prints_a_row_for_each_point_and_motion(swept, tmp_path, capsys):
    words = ["basins", str(swept), "--out", str(tmp_path)]
    assert main([*words, "--json", "--by", "attractor", "--at", "speed=300"]) == 0
    told = json.loads(capsys.readouterr().out)
    rows = told["basins"]
    assert [row["attractor"] for row in rows] == ["damped", "A1 sustained"]
    assert rows[1]["share"] == rows[1]["count"] / 100
    assert rows[0]["basin_entropy"] > 0
    assert told["starts"] == ["force", "pulse"]
    assert main(words) == 0
    assert "points with several regimes: 2 of 2" in capsys.readouterr().out
    svg = (tmp_path / "basins.svg").read_text()
    assert all(f'id="share {word}"' in svg for word in ("damped", "sustained"))
    assert 'id="interval damped"' in svg


@pytest.mark.turns
def test_numbers_of_starts_have_no_unit(tmp_path, capsys):
    """Results have a trace `lost`, an energy; the table counts lost starts so."""
    rows = [{"force": 1e4 * n} for n in range(1, 9)]
    folder = synthetic(tmp_path / "out", rows, samples=20)
    with hpcwhirl.open_results(folder) as data:
        assert data["lost"].attrs["units"] == "J"
    assert main(["basins", str(folder), "--csv"]) == 0
    head = capsys.readouterr().out.splitlines()[0].split(",")
    assert {"count", "cases", "lost"} <= set(head)


@pytest.mark.turns
def test_a_figure_shows_which_start_leads_where(swept, tmp_path, capsys):
    words = ["figures", str(swept), "--kind", "basins", "--out", str(tmp_path)]
    assert main(words) == 0
    assert capsys.readouterr().out.strip() == str(tmp_path / "basins.png")


@pytest.mark.turns
def test_a_map_can_be_coloured_by_attractor(swept, tmp_path):
    words = ["map", str(swept), "--x", "force", "--y", "pulse", "--out", str(tmp_path)]
    assert main([*words, "--colour", "attractor"]) == 0
    found = (tmp_path / "map-attractor-x-force-y-pulse.svg").read_text()
    assert "A1 sustained: " in found
    with hpcwhirl.open_results(swept) as data:
        many = int((data["regime"] == "sustained").sum())
        assert f"A1 sustained: {many}" in found
        assert hpcwhirl.basins(data)["count"].sum() == 200


def test_a_campaign_without_starts_has_one_line(tmp_path, capsys):
    folder = synthetic(tmp_path / "out", [{"speed": 1.0}, {"speed": 2.0}])
    assert main(["basins", str(folder)]) == 2
    assert "no start was drawn or swept" in capsys.readouterr().err
    assert main(["figures", str(folder), "--kind", "basins"]) == 2
    with h5py.File(folder / "results.h5") as file:
        assert len(file["case"]) == 2
