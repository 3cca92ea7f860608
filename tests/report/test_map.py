"""The map of campaigns of every shape: no case hidden, to scale; words, refusals."""

import csv
import tracemalloc
from collections import Counter
from dataclasses import replace
from itertools import pairwise, product
from types import SimpleNamespace
from xml.etree import ElementTree as ET

import h5py
import made_up
import numpy as np
import pytest
from synthetic import grid_of, synthetic

from hpcwhirl import open_results, words
from hpcwhirl.campaign.finalize import Ending
from hpcwhirl.campaign.progress import progress_of
from hpcwhirl.cli import campaign, main
from hpcwhirl.report import canvas, palette, render_process
from hpcwhirl.report.map import critical, drawing, layout, maps
from hpcwhirl.report.map.axes import Axis, cell_edges, distinct, straight
from hpcwhirl.report.map.colours import Colours
from hpcwhirl.report.map.data import Wish, picture_of
from hpcwhirl.report.map.drawing import NO_CELL
from hpcwhirl.scene.campaign_tables import Campaign
from hpcwhirl.scene.words import SHOWN, word_of
from hpcwhirl.store.directory.campaign_directory import Directory
from hpcwhirl.store.reading.reader import open_coded

pytestmark = pytest.mark.turns

MIXED = "sweep = {speed = [300, 410], time_step = [2e-6, 2e-5]}"  # above the limit
RANDOM = np.random.default_rng(3)
LISTS = [[0.0] * 22, [0.01] * 22, [0.02] + [0.0] * 21]
SPEEDS = np.linspace(200, 600, 7).tolist()


def random_design(**spans):
    """Settings of 200 cases spread evenly at random over {input: (low, high)}."""
    columns = {n: RANDOM.uniform(*ends, 200) for n, ends in spans.items()}
    return [
        {n: float(v) for n, v in zip(columns, row, strict=True)}
        for row in zip(*columns.values(), strict=True)
    ]


SHAPES = {
    "three inputs": grid_of(
        speed=SPEEDS, gap=[1e-4, 1.28e-4, 2e-4, 4e-4], friction=[0.05, 0.1, 0.2]
    ),
    "many": grid_of(
        speed=np.linspace(200, 600, 91).tolist(),
        gap=np.geomspace(5e-5, 1e-3, 55).tolist(),
    ),
    "random": random_design(speed=(250, 550), gap=(5e-5, 1e-3)),
    "random in three": random_design(
        speed=(250, 550), gap=(5e-5, 1e-3), friction=(0.02, 0.3)
    ),
    "one speed": grid_of(gap=[1e-4, 2e-4, 8e-4], friction=[0.0, 0.1, 0.4]),
    "words and lists": grid_of(centre=["free", "clamped"], mistuning=LISTS),
    "zip": [{"speed": s, "gap": s * 1e-6} for s in SPEEDS],
    "uneven": grid_of(speed=[300.0, 310.0, 315.0, 400.0], gap=[1e-4, 1.1e-4, 9e-4]),
    "one case": [{}],
}


def statuses(count):
    """Mostly ok; a failure, a time-out and a case that was not computed among many."""
    bad = {2: "failed", 5: "timeout", 11: "missing"} if count > 11 else {}
    return [bad.get(i % 40, "ok") for i in range(count)]


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """Return a function: name of a shape -> its campaign's directory."""
    known = {}

    def make(name):
        if name not in known:
            rows = SHAPES[name]
            place = tmp_path_factory.mktemp("shape") / "out"
            known[name] = synthetic(place, rows, status=statuses(len(rows)))
        return known[name]

    return make


def drawn(folder, **wish):
    return maps.drawing_of(folder / "results.h5", Wish(**wish))


def in_file(folder):
    """Return {word: cases} of a file."""
    data = open_results(folder)
    columns = (words(data[n]) for n in ("status", "outcome", "regime"))
    return Counter(map(word_of, *columns))


def in_artists(figure):
    """Return {word: cases} of what the figure draws."""
    found = Counter()
    for axes in figure.axes:
        for artist in axes.collections:
            kind, *names = (artist.get_gid() or "none").split()
            if kind == "words":
                codes = np.ma.compressed(artist.get_array()).astype(int)
                found.update(names[i] for i in codes if i != NO_CELL)
            elif kind == "cells":
                found[names[0]] += len(artist.get_paths())
            elif kind == "points":
                found[names[0]] += len(artist.get_offsets())
    return found


def texts(figure):
    """Every text of a figure."""
    from matplotlib.text import Text

    return [t.get_text() for t in figure.findobj(Text) if t.get_text()]


@pytest.mark.parametrize("shape", SHAPES)
def test_every_case_is_drawn_once(made, shape):
    folder = made(shape)
    map_ = drawn(folder)
    assert in_artists(map_.figure) == in_file(folder) == map_.picture.counts()
    assert sorted(map_.picture.case) == list(range(len(SHAPES[shape])))
    told = " ".join(texts(map_.figure) + legends(map_.figure))
    for word, count in in_file(folder).items():
        assert f"{SHOWN[word].told}: {count}" in told


def legends(figure):
    found = [t.get_text() for legend in figure.legends for t in legend.get_texts()]
    for axes in figure.axes:
        if axes.get_legend():
            found += [t.get_text() for t in axes.get_legend().get_texts()]
    return found


def test_a_legend_has_only_words_that_occur(made):
    told = " ".join(legends(drawn(made("zip")).figure))
    assert "damped" in told
    assert "divergent" not in told
    assert "failed" not in told


def test_all_failed_is_a_map_too(tmp_path):
    rows = grid_of(speed=[300.0, 400.0], gap=[1e-4, 2e-4])
    folder = synthetic(tmp_path / "out", rows, status=["failed"] * 4)
    map_ = drawn(folder)
    assert in_artists(map_.figure) == {"failed": 4}
    assert maps.save_map(map_, tmp_path)[0].stat().st_size > 2000


def test_a_third_input_becomes_panels(made):
    map_ = drawn(made("three inputs"))
    picture = map_.picture
    assert [p["friction"] for p in picture.panels] == [0.05, 0.1, 0.2]
    titles = [axes.title for axes in map_.figure.axes if axes.get_title()]
    assert not any(title.get_parse_math() for title in titles)
    assert len(titles) == 3
    for number in range(3):
        own = picture.panel == number
        cells = set(zip(picture.x.place[own], picture.y.place[own], strict=True))
        assert len(cells) == own.sum() == 28


def test_words_of_the_picture_are_those_of_status(campaign):
    code, folder = campaign("sweep = {speed = [300, 350, 410], gap = [1e-4, 2e-4]}")
    assert code == 0
    assert in_artists(drawn(folder).figure) == progress_of(Directory(folder)).words


def test_both_files_are_written_and_told(made, tmp_path, capsys):
    folder = made("one speed")
    assert main(["map", str(folder), "--out", str(tmp_path / "new")]) == 0
    png, svg = tmp_path / "new/map.png", tmp_path / "new/map.svg"
    assert capsys.readouterr().out.split() == [str(png), str(svg)]
    assert png.read_bytes().startswith(b"\x89PNG")
    assert ET.parse(svg).getroot().tag.endswith("svg")


def test_a_campaign_draws_its_map_by_itself(finished):
    assert {"map.png", "map.svg"} <= {path.name for path in finished.iterdir()}


@pytest.mark.parametrize(
    ("shape", "side", "scale"),
    [("many", "y", "log"), ("many", "x", "linear"), ("uneven", "x", "linear"),
     ("random", "x", "linear"), ("zip", "x", "linear")],
)  # fmt: skip
def test_axes_are_scaled_as_their_values_are_spread(made, shape, side, scale):
    map_ = drawn(made(shape))
    assert getattr(map_.picture, side).scale == scale
    assert getattr(map_.figure.axes[0], f"get_{side}scale")() == scale


def test_cells_reach_halfway_to_their_neighbours():
    levels = np.array([1.0, 2.0, 6.0])
    assert cell_edges(levels) == pytest.approx([0.5, 1.5, 4.0, 8.0])
    logs = cell_edges(np.array([1.0, 10.0, 1000.0]), "log")
    assert logs[1:3] == pytest.approx([10**0.5, 100.0])


@pytest.mark.parametrize("scale", ["linear", "log"])
def test_between_scattered_cases_the_nearest_with_a_result_is_shown(made, scale):
    picture = drawn(made("random")).picture
    assert picture.scattered
    x = replace(picture.x, scale=scale)
    picture = replace(picture, x=x)
    part = layout.sheet_of(picture).part(0)
    mesh = drawing.raster_of(part)
    bad = np.isin(part.kind, ["missing", "failed", "unstable", "overloaded"])
    assert bad.any()
    assert set(np.unique(mesh.case)) <= set(np.flatnonzero(~bad))
    ends = [np.array([axis_[0], axis_[-1]]) for axis_ in (mesh.x, mesh.y)]
    for row, column in RANDOM.integers(0, mesh.case.shape, (50, 2)):
        away = 0.0
        for axis, edges, i, end in zip(
            (x, picture.y), (mesh.x, mesh.y), (column, row), ends, strict=True
        ):
            middle = straight(edges[i : i + 2], axis.scale).mean()
            whole = np.ptp(straight(end, axis.scale))
            away = away + ((straight(axis.place, axis.scale) - middle) / whole) ** 2
        away[bad] = np.inf
        assert away[mesh.case[row, column]] == pytest.approx(away.min())
    assert part.x.place.min() > mesh.x[0]
    assert part.x.place.max() < mesh.x[-1]


def test_points_stand_over_the_plane_of_the_nearest(made):
    for colour in ("regime", "whirl"):
        (axes,) = drawn(made("random"), colour=colour).figure.axes
        gids = {str(c.get_gid()).split()[0] for c in axes.collections}
        assert gids == {"nearest", "points"}


def test_points_are_drawn_where_the_plane_does_not_tell_all(made):
    map_ = drawn(made("random in three"))
    assert map_.picture.free
    assert any("friction differs from case to case" in t for t in texts(map_.figure))
    gids = {str(c.get_gid()).split()[0] for c in map_.figure.axes[0].collections}
    assert gids == {"points"}


def test_an_input_that_goes_with_another_is_told(made):
    map_ = drawn(made("zip"))
    assert map_.picture.y.name == ""
    assert any("gap varies with speed: 0.2 to 0.6 mm" in t for t in texts(map_.figure))


def test_axes_panels_and_cases_may_be_chosen_as_the_toml_names_them(tmp_path):
    rows = grid_of(
        **{"engine.casing.thickness": [0.02, 0.03], "speed": [300.0, 400.0],
           "rotor.damping": [0.01, 0.02]}
    )  # fmt: skip
    folder = synthetic(tmp_path / "out", rows)
    picture = drawn(folder, x="thickness", panels=("damping",)).picture
    assert (picture.x.name, picture.y.name) == ("casing_thickness", "speed")
    assert [p["rotor_damping"] for p in picture.panels] == [0.01, 0.02]
    some = drawn(folder, at=("casing.thickness=0.03", "speed=300")).picture
    assert some.case.tolist() == [
        i for i, r in enumerate(rows)
        if (r["engine.casing.thickness"], r["speed"]) == (0.03, 300.0)
    ]  # fmt: skip


def test_texts_and_lists_lie_on_an_axis_and_may_be_chosen(made):
    folder = made("words and lists")
    picture = drawn(folder).picture
    assert picture.x.names[1].startswith("#2 [0.01, 0.01")
    assert picture.y.names == ("free", "clamped")
    assert drawn(folder, at=("mistuning=#2", "centre=clamped")).picture.case == [4]


@pytest.mark.parametrize(
    ("wish", "said"),
    [
        ({"y": "gpa"}, "'gpa'; did you mean 'gap'"),
        ({"y": "pulse"}, "input 'pulse' was not swept; swept: "),
        ({"x": "gap", "y": "gap"}, "by only one of --x, --y and --panel"),
        ({"at": ("gap=3e-4",)}, "no case has this value, known: 0.0001, 0.000128"),
        ({"at": ("speed",)}, "--at must be NAME=VALUE"),
        ({"at": ("gap=wide",)}, "must be a number, got 'wide'"),
        ({"colour": "growthrate"}, "did you mean 'growth_rate'"),
        ({"colour": "message"}, "is text"),
        ({"x": "gap", "y": "friction", "critical": True}, "speed must be on an axis"),
    ],
)
def test_what_cannot_be_drawn_is_one_line(made, tmp_path, capsys, wish, said):
    words_ = [str(made("three inputs")), "--out", str(tmp_path)]
    for name, value in wish.items():
        if value is True:
            words_ += [f"--{name}"]
        for one in (
            value if isinstance(value, tuple) else (value,) * (value is not True)
        ):
            words_ += [f"--{name}", one]
    assert main(["map", *words_]) == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1
    assert said in err
    assert not any(tmp_path.iterdir())


def test_too_many_panels_are_refused_with_the_setting_wanted(tmp_path, capsys):
    rows = grid_of(speed=[300.0, 400.0], gap=[1e-4, 2e-4], friction=[0.1, 0.2, 0.3],
                   force=[1e4, 2e4, 3e4, 4e4, 5e4])  # fmt: skip
    folder = synthetic(tmp_path / "out", rows)
    assert main(["map", str(folder), "--y", "gap", "--out", str(tmp_path / "new")]) == 2
    err = capsys.readouterr().err
    assert "15 panels" in err
    assert "--at friction=0.1|0.2|0.3" in err
    assert not (tmp_path / "new").exists()
    assert main(["map", str(folder), "--y", "gap", "--at", "friction=0.1"]) == 0


def test_a_campaign_ends_well_where_its_map_must_be_chosen(
    campaign, capsys, monkeypatch
):
    monkeypatch.setattr("hpcwhirl.report.map.data.AUTOMATIC", 1)
    code, folder = campaign(
        "sweep = {gap = [1e-4, 2e-4], friction = [0.1, 0.2], force = [1e4, 2e4]}"
    )
    assert code == 0
    assert "no map: 2 panels of force" in capsys.readouterr().err
    assert (folder / "results.h5").exists()
    assert not (folder / "map.png").exists()


def test_cases_that_would_lie_behind_others_are_refused(tmp_path):
    rows = [{"speed": float(s), "gap": 1e-4, "friction": 0.001 * i}
            for i, s in enumerate([300, 300, *range(301, 320)])]  # fmt: skip
    folder = synthetic(tmp_path / "out", rows)
    with pytest.raises(ValueError, match=r"would be hidden|too many"):
        drawn(folder, y="gap")


def test_panels_tell_the_unit_of_what_they_share(tmp_path):
    at = product((300.0, 310.0), (1e-4, 2e-4), (0.1, 0.2))
    rows = [{"speed": s, "gap": gap, "friction": mu} for s, gap, mu in at]
    map_ = drawn(synthetic(tmp_path / "out", rows), x="speed", y="friction")
    titles = {axes.get_title() for axes in map_.figure.axes}
    assert titles == {"gap = 0.1 mm", "gap = 0.2 mm"}


def test_speeds_may_be_told_in_rpm(made):
    picture = drawn(made("uneven"), rpm=True).picture
    assert picture.x.levels[0] == pytest.approx(300.0 * (30.0 / np.pi))
    assert picture.x.label.endswith("rpm")


def test_a_number_over_decades_has_a_logarithmic_bar_with_its_unit(made):
    from matplotlib.colors import LogNorm

    map_ = drawn(made("many"), colour="contact_impulse")
    mesh = next(c for c in map_.figure.axes[0].collections if c.get_gid() == "numbers")
    assert isinstance(mesh.norm, LogNorm)
    assert map_.figure.axes[-1].get_ylabel() == "contact impulse, N s"
    shown = np.ma.compressed(mesh.get_array())
    good = ~np.isin(map_.picture.word, ["unstable", "failed", "missing"])
    stored = open_results(made("many")).contact_impulse.to_numpy()
    assert np.sort(shown) == pytest.approx(np.sort(stored[good]))


def test_a_number_with_signs_has_zero_in_the_middle(made):
    colours = drawn(made("many"), colour="growth_rate").picture.colours
    assert colours.norm()(0.0) == pytest.approx(0.5)
    assert colours.map() == palette.DIVERGING


@pytest.mark.parametrize("rows", ["uneven", "many"])
def test_labels_of_a_bar_of_both_signs_do_not_overlap(made, rows, monkeypatch):
    shown = np.array([-20.0, -2.2, -0.067, 0.067, 0.25, 23.6])
    monkeypatch.setattr(Colours, "_known", lambda _: np.repeat(shown, 5))
    figure = drawn(made(rows), colour="growth_rate").figure
    figure.canvas.draw()
    bar = figure.axes[-1]
    assert bar.get_ylabel() == "growth rate, 1/s"
    boxes = sorted((t.get_window_extent() for t in bar.get_yticklabels()
                    if t.get_text()), key=lambda box: box.y0)  # fmt: skip
    assert len(boxes) >= 5
    for below, above in pairwise(boxes):
        assert below.y1 <= above.y0 + 1.0  # pixel


def test_one_number_may_be_over_another(made):
    colours = drawn(made("uneven"), colour="orbit_radius/gap").picture.colours
    data = open_results(made("uneven"))
    want = (data.orbit_radius / data.gap).to_numpy()
    assert colours.number == pytest.approx(want, nan_ok=True)
    assert colours.label == "orbit radius / gap"


def test_undecided_unstable_failed_and_not_computed_look_different(tmp_path):
    rows = grid_of(speed=SPEEDS, gap=[1e-4, 2e-4])
    folder = synthetic(tmp_path / "out", rows, status=statuses(14))
    axes = drawn(folder).figure.axes[0]
    mesh = next(c for c in axes.collections if str(c.get_gid()).startswith("words"))
    names = mesh.get_gid().split()[1:]
    looks = {n: tuple(mesh.cmap(i)) for i, n in enumerate(names)}
    assert len(set(looks.values())) == len(names)
    assert {"failed", "missing", "undecided"} <= set(names)
    assert [p.get_gid() for p in axes.findobj() if "hatch" in str(p.get_gid())] == [
        "hatch missing"
    ]


def test_critical_speeds_are_those_of_the_model(made, facts):
    figure = drawn(made("three inputs"), critical=True).figure
    told = facts("model", "table2", "--json")["critical_speeds"]
    ones = [r for r in told if (r["nodal_diameter"], r["family"]) == (1, "1F")]
    own = {r["order"]: r["speed"] for r in ones}
    lines = {ln.get_gid(): ln.get_xdata()[0] for ln in figure.axes[0].lines
             if str(ln.get_gid()).startswith("n")}  # fmt: skip
    assert lines["n1"] == pytest.approx(own[1], rel=1e-3)  # the gap moves the ring
    assert lines["n12"] == pytest.approx(own[12], rel=1e-3)


def test_critical_speeds_are_named_within_the_panels_of_scattered_cases(made):
    figure = drawn(made("random"), critical=True).figure
    for axes in figure.axes:
        named = [note for note in axes.texts if note.get_text().startswith("Eq. 13")]
        assert named
        low, high = axes.get_ylim()
        assert all(low < note.xy[1] <= high for note in named)


def test_the_csv_has_what_is_drawn(made, tmp_path):
    folder = made("three inputs")
    words_ = ["--at", "friction=0.1", "--csv", "--colour", "growth_rate"]
    assert main(["map", str(folder), "--out", str(tmp_path), *words_]) == 0
    (path,) = tmp_path.glob("*.csv")
    assert path.name == "map-growth_rate-friction=0.1.csv"
    with path.open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    data = open_results(folder)
    assert len(rows) == 28
    for row in rows:
        case = int(row["case"])
        assert float(row["speed"]) == data.speed[case]
        assert float(row["growth rate, 1/s"]) == pytest.approx(
            float(data.growth_rate[case]), nan_ok=True
        )
    counts = Counter(row["word"] for row in rows)
    assert counts == drawn(folder, at=("friction=0.1",)).picture.counts()


def test_a_map_that_is_asked_for_has_a_name_of_its_own():
    names = {
        Wish(): "map",
        Wish(colour="growth_rate"): "map-growth_rate",
        Wish(colour="orbit_radius/gap", rpm=True): "map-orbit_radius-gap-rpm",
        Wish(x="gap", at=("friction=0.1",)): "map-x-gap-friction=0.1",
        Wish(units=("um", "practical")): "map-um-practical",
    }
    assert {wish: maps.stem_of(wish) for wish in names} == names
    long = [maps.stem_of(Wish(at=("gap=1e-4",) * n)) for n in (90, 91)]
    assert long[0] != long[1]
    assert max(map(len, long)) < 100


def test_a_title_tells_engine_inputs_duration_and_preset(tmp_path):
    rows = [{"speed": 300.0}, {"speed": 400.0}]
    folder = synthetic(
        tmp_path / "out", rows,
        facts={"scene": '[engine]\nname = "a $x$ <b>_{2"', "preset": "standard"},
    )  # fmt: skip
    map_ = drawn(folder)
    title = map_.figure.get_suptitle()
    assert title.startswith("a $x$ <b>_{2: k = 1")
    for part in ("gap = 0.128 mm", "μ = 0.1", "2.5 s", "preset standard"):
        assert part in title
    assert not any("paper" in t for t in texts(map_.figure))
    assert maps.save_map(map_, tmp_path)  # no mathematics is read into the name


def test_few_cells_have_letters_and_many_their_whirl_when_asked(made):
    few, many = drawn(made("three inputs")), drawn(made("many"))
    letters = [t for t in texts(few.figure) if t in {"d", "S", "X", "?", "U", "!", "·"}]
    assert len(letters) == 84
    assert len(many.figure.axes) == 1
    whirl = drawn(made("many"), colour="whirl")
    mesh = whirl.figure.axes[0].collections[0]
    whirls = mesh.get_gid().split()[1:]
    good = ~np.isin(many.picture.word, ["unstable", "failed", "missing"])
    found = Counter(whirls[int(i)] for i in np.ma.compressed(mesh.get_array()))
    for word, count in Counter(many.picture.whirl[good].tolist()).items():
        assert found[word] == count


@pytest.mark.parametrize(
    ("colour", "across", "told"), [("regime", 0, "regimes"), ("whirl", 1, "whirl")]
)
def test_a_refined_map_has_the_boundary_of_what_it_shows(
    tmp_path, colour, across, told
):
    """Regimes change at 250 rad/s, the whirl at 0.25 mm."""

    def field(given):
        regime = "damped" if given["speed"] < 250 else "sustained"
        return f"{regime} {'forward' if given['gap'] < 2.5e-4 else 'backward'}"

    document = {
        "sweep": {"speed": [200, 240, 300, 400], "gap": [1e-4, 2e-4, 4e-4]},
        "refine": {"over": ["speed", "gap"], "levels": 1},
    }
    folder = made_up.refined_campaign(tmp_path / "out", document, field)
    figure = drawn(folder, colour=colour).figure
    (lines,) = (c for c in figure.axes[0].collections if c.get_gid() == "boundary")
    ends = np.array(lines.get_segments())
    low, high = ((240, 300), (0.2, 0.4))[across]
    assert len(ends) > 1
    assert ((low < ends[..., across]) & (ends[..., across] < high)).all()
    assert f"boundary of {told}, half way between cases" in texts(figure)


@pytest.mark.parametrize("shape", ["three inputs", "random"])
def test_a_case_under_the_mouse_is_told_with_its_numbers(made, shape):
    folder = made(shape)
    data = open_results(folder)
    figure = data.hpcwhirl.hover(units=("si",))
    told = {}
    for trace in (t for t in figure.data if t.mode == "markers"):
        texts_ = zip(trace.customdata, trace.x, trace.y, trace.text, strict=True)
        told |= {case: found for case, *found in texts_}
    assert sorted(told) == list(range(data.sizes["case"]))
    for case, (x, y, text) in told.items():
        row = data.isel(case=case)
        assert (x, y) == (row.speed, row.gap)
        assert f"Ω = {float(row.speed):.6g}" in text
        if row.status == "ok" and row.outcome == "completed":
            assert f"case {case}: {row.regime.item()}, {row.whirl.item()}" in text
    own = {t.name for t in figure.data if t.mode == "lines" and t.showlegend}
    assert {SHOWN[w].told for w in drawn(folder).picture.word} == own


def test_cells_fill_a_map_to_hover_over(made):
    figure = open_results(made("many")).hpcwhirl.hover(units=("si",))
    area = 0.0
    for trace in (t for t in figure.data if t.mode == "lines"):
        x, y = (np.reshape(v, (-1, 6))[:, :5] for v in (trace.x, trace.y))
        area += (np.ptp(x, axis=1) * np.ptp(y, axis=1)).sum()
    picture = drawn(made("many"), units=("si",)).picture
    whole = np.ptp(picture.x.edges()) * np.ptp(picture.y.edges())
    assert area == pytest.approx(whole)


def test_two_inputs_that_are_drawn_alone_are_the_axes(tmp_path):
    law = {"distribution": "uniform", "low": 1e-4, "high": 2e-4}
    speed = law | {"low": 300.0, "high": 400.0}
    sample = {"method": "random", "count": 8, "gap": law}
    two = made_up.campaign(tmp_path / "two", {"sample": sample | {"speed": speed}})
    picture = drawn(two).picture
    assert (picture.x.name, picture.y.name, len(picture)) == ("speed", "gap", 8)
    assert picture.scattered
    one = made_up.campaign(tmp_path / "one", {"sample": sample})
    assert drawn(one).picture is None  # shares


def test_failed_cases_are_marked_and_the_others_drawn(campaign, capsys):
    code, folder = campaign(MIXED)
    assert code == 1
    assert "2 of 4 cases failed" in capsys.readouterr().err
    picture = drawn(folder).picture
    failed = picture.y.place == 2e-5
    assert set(picture.word[failed]) == {"failed"}
    assert "failed" not in set(picture.word[~failed])


def test_drawing_leaves_traces_in_the_file(tmp_path):
    """50 MB of orbits may not pass through memory; columns are some 100 kB."""
    rows = grid_of(speed=np.linspace(200, 600, 10).tolist(), gap=[1e-4, 2e-4])
    folder = synthetic(tmp_path / "out", rows, samples=45_000)
    assert (folder / "results.h5").stat().st_size > 50e6
    drawn(folder)  # modules are loaded now
    tracemalloc.start()
    drawn(folder)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 20e6


def test_a_map_of_many_cases_takes_few_bytes_a_case(made):
    """Words are codes of one byte, inputs are levels: texts alone take 40 each."""
    place, side = made("many") / "results.h5", 300
    known = open_coded(place).load()
    speed, gap = np.meshgrid(
        np.linspace(200, 600, side), np.geomspace(5e-5, 1e-3, side)
    )
    cases = known.isel(case=np.arange(side * side) % known.sizes["case"]).assign(
        speed=("case", speed.ravel(), known.speed.attrs),
        gap=("case", gap.ravel(), known.gap.attrs),
    )
    tracemalloc.start()
    picture = picture_of(cases, Wish())
    read = tracemalloc.get_traced_memory()[1]
    layout.figure_of(cases, picture, Wish(), place)
    drawn_too = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert len(picture) == side * side
    assert read < 120 * len(picture)
    assert drawn_too < 200 * len(picture)


@pytest.mark.parametrize("gathered", [True, False])
@pytest.mark.parametrize("wish", ["yes", "no"])
def test_a_map_is_drawn_where_it_is_wanted_and_told(
    made, tmp_path, monkeypatch, capsys, wish, gathered
):
    asked = []
    monkeypatch.setattr(
        render_process, "draw_in_process", lambda *a: asked.append(a) or []
    )
    ending = Ending(complete=True, cases=9, results=made("one case") / "results.h5",
                    gathered=gathered)  # fmt: skip
    campaign._maps(ending, Directory(tmp_path), Campaign(map=wish))
    assert len(asked) == (wish == "yes")
    told = "drawing map.png and map.svg, which are missing" in capsys.readouterr().err
    assert told == (wish == "yes" and not gathered)


def test_classify_draws_the_map_again_as_it_was_asked_for(campaign, facts, capsys):
    code, folder = campaign("sweep = {speed = [300, 410], gap = [1e-4, 2e-4]}")
    assert code == 0
    assert main(["map", str(folder), "--x", "gap", "--colour", "whirl"]) == 0
    paths = [folder / f"{name}.{end}" for name in ("map-whirl-x-gap", "map")
             for end in ("png", "svg")]  # fmt: skip
    before = [path.stat().st_mtime_ns for path in paths]
    (folder / "report.html").write_text("older words")
    capsys.readouterr()
    told = facts("classify", str(folder), "--write", "--json", "--set", "rise=0.2")
    assert told["drawn again"] == [str(path) for path in paths]
    for path, earlier in zip(paths, before, strict=True):
        assert path.stat().st_mtime_ns > earlier
    asked = maps.wish_of(folder / "map-whirl-x-gap.png")
    assert (asked.x, asked.colour) == ("gap", "whirl")
    assert maps.wish_of(folder / "map.png") == Wish()
    assert main(["classify", str(folder)]) == 0
    assert "report.html is stale: hpcwhirl report" in capsys.readouterr().err


def test_a_picture_needs_no_figure(made):
    picture = picture_of(open_results(made("one case")), Wish())
    assert len(picture) == 1
    assert (picture.x.name, picture.y.name) == ("", "")


def test_levels_have_ticks_where_their_texts_have_room():
    def ticks(count, points, name="speed"):
        axis = Axis(name, name, np.zeros(1, np.int32), 100.0 * np.arange(count))
        return [
            found.tolist() for found in map(np.array, axis.ticks(points, upright=True))
        ]

    assert ticks(3, 500.0) == [[0.0, 100.0, 200.0], ["0", "100", "200"]]
    assert ticks(14, 500.0)[0] == [100.0 * n for n in range(14)]
    for nothing in (ticks(3, 500.0, ""), ticks(15, 500.0), ticks(14, 50.0)):
        assert nothing == [[], []]


@pytest.mark.parametrize("first", [0.0, 1.0, 314.159265, 12_345.6, 1e6])
@pytest.mark.parametrize("step", [1e-3, 0.3, 7.0, 333.3])
def test_texts_at_ticks_tell_each_level_from_its_neighbours(first, step):
    levels = first + step * np.arange(5)
    told = np.array([float(text) for text in distinct(levels)])
    assert abs(told - levels).max() <= 0.01 * step
    assert (abs(told - levels) <= 1e-5 * levels).all()


def test_an_axis_without_a_tick_for_each_level_has_no_offset_at_its_end():
    from matplotlib.figure import Figure

    speeds = 10_000.0 + 0.1 * np.arange(40)
    figure = Figure()
    axes = figure.subplots()
    axes.set_xlim(speeds[0], speeds[-1])
    layout._ticks(axes.xaxis, Axis("speed", "Ω", np.zeros(1, np.int32), speeds), 400.0)
    figure.draw_without_rendering()
    assert axes.xaxis.get_offset_text().get_text() == ""
    told = [float(label.get_text()) for label in axes.get_xticklabels()]
    assert told == pytest.approx(axes.get_xticks().tolist(), rel=1e-9)


def test_texts_at_ticks_are_shown_as_they_are_written():
    from matplotlib.figure import Figure

    own = Figure().subplots().xaxis
    files = SimpleNamespace(
        name="file", ticks=lambda *_, **__: ([0.0, 1.0], ["a$x$.h5", "b_2.h5"])
    )
    layout._ticks(own, files, 500.0)
    labels = own.get_ticklabels()
    assert [label.get_text() for label in labels] == ["a$x$.h5", "b_2.h5"]
    assert not any(label.get_parse_math() for label in labels)


def test_critical_speeds_of_a_mirrored_map_are_mirrored(facts):
    rows = [
        row for row in facts("model", "table2", "--json")["critical_speeds"]
        if row["nodal_diameter"] == 1
    ]  # fmt: skip
    found = []
    for ends in ((200.0, 400.0), (-200.0, -400.0)):
        axes = canvas.new_figure((6, 4))[1]
        axes.set(xlim=sorted(ends), ylim=(0.0, 1.0))
        critical._draw(axes, [(critical._Level(0.0, 1.0, 0), rows)], 1.0, upright=True)
        marks = sorted(abs(line.get_xdata()[0]) for line in axes.lines)
        found.append((marks, {t.get_text() for t in axes.texts}))
    assert found[0] == found[1]
    assert len(found[0][1]) > 1


def test_cells_in_which_a_free_motion_grows_are_hatched_and_counted(tmp_path):
    rows = SHAPES["three inputs"]
    path = synthetic(tmp_path / "out", rows) / "results.h5"
    count = len(rows) // 3
    with h5py.File(path, "r+") as file:
        file["free_growth"][:count] = 0.5
    figure = maps.drawing_of(path, Wish()).figure
    hatched = [
        artist
        for axes in figure.axes
        for artist in axes.findobj(lambda one: one.get_gid() == "hatch growing")
    ]
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert f"free motion grows without contact: {count}" in labels
    assert hatched
