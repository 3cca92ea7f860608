"""The regime map of real campaigns: one cell a case, words, axes, refusals."""

import re
from xml.etree import ElementTree as ET

import pytest

from hpcwhirl import open_results
from hpcwhirl.cli import main
from hpcwhirl.report import maps

GRID = "sweep = {speed = [300, 350, 410], gap = [1e-4, 2e-4]}"
MIXED = "sweep = {speed = [300, 410], time_step = [2e-6, 2e-5]}"  # above the limit


@pytest.fixture(scope="module")
def grid(campaign):
    code, folder = campaign(GRID)
    assert code == 0
    return folder


@pytest.fixture
def figure(monkeypatch):
    """Return a function: words of `map` -> the axes of the figure it saved."""
    saved = []
    save = maps._save

    def keep(drawn, out, stem):
        saved.append(drawn)
        return save(drawn, out, stem)

    monkeypatch.setattr(maps, "_save", keep)

    def draw(*words):
        assert main(["map", *map(str, words)]) == 0
        return saved[-1].axes[0]

    return draw


def cells(axes):
    """Return {(centre, level): letter} of the cells of a map."""
    boxes = list(axes.patches)
    letters = [t for t in axes.texts if len(t.get_text()) == 1]
    assert len(boxes) == len(letters)
    found = {}
    for box, letter in zip(boxes, letters, strict=True):
        x, y = letter.get_position()
        assert box.get_x() < x < box.get_x() + box.get_width()
        level = round(y)
        assert box.get_y() == level - 0.5
        found[x, level] = letter.get_text()
    assert len(found) == len(boxes)
    return found


def ticks(axes):
    return [label.get_text() for label in axes.get_yticklabels()]


def comments(svg):
    """Return the words of an SVG; Matplotlib keeps each beside its glyphs."""
    return re.findall(r"<!-- (.*?) -->", svg.read_text(encoding="utf-8"))


def test_a_campaign_draws_its_map_by_itself(grid):
    assert {"map.png", "map.svg"} <= {path.name for path in grid.iterdir()}


def test_both_files_are_written_and_told(grid, tmp_path, capsys):
    assert main(["map", str(grid), "--out", str(tmp_path / "new")]) == 0
    png, svg = tmp_path / "new/map.png", tmp_path / "new/map.svg"
    assert capsys.readouterr().out.split() == [str(png), str(svg)]
    assert png.read_bytes().startswith(b"\x89PNG")
    assert ET.parse(svg).getroot().tag.endswith("svg")


def test_the_map_names_its_axes_and_every_word(grid, tmp_path):
    assert main(["map", str(grid), "--out", str(tmp_path)]) == 0
    told = comments(tmp_path / "map.svg")
    assert {"rotational speed Ω, rad/s", "gap, m"} <= set(told)
    legend = {word.split()[-1] for word in told if word.strip()}
    assert legend >= set(maps.REGIMES)
    assert legend >= {"forward", "backward", "mixed"}


def test_every_case_has_one_cell_with_the_letter_of_its_regime(grid, figure, tmp_path):
    axes = figure(grid, "--out", tmp_path)
    data = open_results(grid)
    gaps = sorted(set(data["gap"].to_numpy()))
    letters = [maps.REGIMES[word][1] for word in maps.labels(data)]
    pairs = zip(data["speed"].to_numpy(), data["gap"].to_numpy(), strict=True)
    want = {(x, gaps.index(y)): a for (x, y), a in zip(pairs, letters, strict=True)}
    assert cells(axes) == want
    assert len(want) == 6
    assert ticks(axes) == ["0.0001", "0.0002"]


def test_cells_tile_the_map_without_gaps_or_overlaps(grid, figure, tmp_path):
    axes = figure(grid, "--out", tmp_path)
    boxes = axes.patches
    area = sum(box.get_width() * box.get_height() for box in boxes)
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    assert area == pytest.approx((right - left) * (high - low), rel=1e-12)


@pytest.mark.parametrize(
    ("swept", "count", "axis"),
    [
        ("sweep = {gap = [1e-4, 2e-4]}", 2, ("gap, m", ["0.0001", "0.0002"])),
        ("sweep = {speed = [300, 410]}", 2, ("", [])),
        ("", 1, ("", [])),
        ("sweep = {direction = ['squeeze', 'stretch']}", 1, ("", [])),
    ],
    ids=["one speed", "speed alone", "one case", "words alone"],
)
def test_a_campaign_of_any_shape_has_a_map(campaign, figure, swept, count, axis):
    code, folder = campaign(swept)
    assert code == 0
    axes = figure(folder)
    assert len(cells(axes)) == count
    assert (axes.get_ylabel(), ticks(axes)) == axis


def test_failed_cases_are_marked_and_the_others_drawn(campaign, figure, capsys):
    code, folder = campaign(MIXED)
    assert code == 1
    assert "2 of 4 cases failed" in capsys.readouterr().err
    found = cells(figure(folder))
    assert [found[x, 1] for x in (300.0, 410.0)] == ["!", "!"]
    assert "!" not in {found[x, 0] for x in (300.0, 410.0)}


def test_the_second_axis_may_be_chosen_and_the_rest_is_told(campaign, figure, tmp_path):
    code, folder = campaign(
        "sweep = {speed = [300, 410], gap = [1e-4, 2e-4], direction = ['squeeze', "
        "'stretch']}"
    )
    assert code == 0
    for chosen, label, levels in (
        ("gap", "gap, m", ["0.0001", "0.0002"]),
        ("direction", "direction", ["squeeze", "stretch"]),
    ):
        axes = figure(folder, "--out", tmp_path, "--y", chosen)
        assert axes.get_ylabel() == label
        assert ticks(axes) == levels
        assert len(cells(axes)) == 4
        assert "4 cases of other inputs not shown" in {t.get_text() for t in axes.texts}


@pytest.mark.parametrize(
    ("name", "hint"), [("gpa", "'gap'"), ("friction", "gap, speed"), ("regime", "gap")]
)
def test_an_axis_that_was_not_swept_is_refused_in_one_line(grid, capsys, name, hint):
    assert main(["map", str(grid), "--y", name]) == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1
    assert f"'{name}'" in err
    assert hint in err
