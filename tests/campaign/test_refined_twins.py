"""Twins of a refined campaign: of which cases follows from words, and nothing else."""

import random
from collections import Counter

import h5py
import numpy as np
import pytest
from deaths import until_it_lives
from launch import all_variables, records, root_variables
from made_up import refined_campaign

import hpcwhirl
from hpcwhirl.campaign.begin import Policy, prepare
from hpcwhirl.campaign.plan.design import design_of
from hpcwhirl.campaign.progress import progress_of
from hpcwhirl.campaign.run import run_campaign
from hpcwhirl.cli import main
from hpcwhirl.report.map.data import Wish
from hpcwhirl.report.map.maps import drawing_of
from hpcwhirl.report.page.build import write_page
from hpcwhirl.store.directory.campaign_directory import Directory

pytestmark = pytest.mark.turns

COUNT = 3
DOCUMENT = {
    "output": {"traces": "summary"},
    "sweep": {"speed": {"start": 100, "stop": 500, "num": 3}, "gap": [1e-4, 4e-4]},
    "refine": {"over": ["speed", "gap"], "levels": 4, "scale": {"gap": "log"}},
    "twins": {"count": COUNT, "of": "speckle"},
}


def coin(settings):
    """Damped, but sustained or divergent by chance at high speeds; of twins too."""
    if settings["speed"] < 290:
        return "damped"
    return random.Random(repr(sorted(settings.items()))).choice(
        ["sustained", "divergent"]
    )


@pytest.fixture(scope="module")
def speckled(tmp_path_factory):
    return refined_campaign(tmp_path_factory.mktemp("s") / "out", DOCUMENT, coin)


def test_cases_in_speckle_have_shares_and_no_others(speckled):
    data = hpcwhirl.open_results(speckled)
    cells = data["cell_corner"].to_numpy()[hpcwhirl.words(data.cell_state) == "speckle"]
    has = data.twin_count.values == COUNT
    assert set(np.flatnonzero(has)) == set(cells.ravel()) - {-1}
    assert 0 < has.sum() < len(has)
    assert np.isnan(data.word_share.values[~has]).all()
    assert (data.speed.values[has] >= 250).all()
    with h5py.File(speckled / "results.h5") as file:
        theirs = file["twins/regime"][:]
    own = hpcwhirl.words(data.regime)
    parts = [data[f"share_{word}"].values[has] for word in ("sustained", "divergent")]
    assert np.allclose(sum(parts), 1.0)
    assert (theirs[~has] == 0).all()
    for word, share in zip(("sustained", "divergent"), parts, strict=True):
        mine = own[has] == word
        assert np.array_equal(data.word_share.values[has][mine], share[mine])


def test_the_order_of_arrival_changes_no_bit(speckled, tmp_path):
    again = refined_campaign(tmp_path / "again", DOCUMENT, coin, seed=7)
    assert all_variables(again) == all_variables(speckled)


def two_words(settings):
    """Sustained beyond a line; a twin well below it is so by chance."""
    if settings["speed"] < 310:
        other = settings["speed"] < 260 and settings.get("twin") == 2
        return "divergent" if other else "damped"
    return "sustained"


EVEN = DOCUMENT | {
    "sweep": {
        "speed": {"start": 100, "stop": 500, "num": 9},
        "gap": [1e-4, 2e-4, 4e-4],
    },
    "refine": DOCUMENT["refine"] | {"levels": 2},
    "twins": {"count": COUNT, "of": "even", "sample": 20},
}


@pytest.fixture(scope="module")
def even(tmp_path_factory):
    return refined_campaign(tmp_path_factory.mktemp("e") / "out", EVEN, two_words)


def test_a_sample_of_cases_between_alike_ones_has_twins(even, tmp_path):
    data = hpcwhirl.open_results(even)
    has = np.flatnonzero(data.twin_count.values == COUNT)
    state, corner = hpcwhirl.words(data.cell_state), data["cell_corner"].to_numpy()
    assert len(has) == 20
    assert set(has) <= set(corner[state == "even"].ravel())
    assert not set(has) & set(corner[state != "even"].ravel())
    low = data.speed.values[has] < 260
    assert 0 < low.sum() < 20
    found = hpcwhirl.credibility(data)
    assert (found.of, found.cases, found.kept) == ("even", 20, 20 - low.sum())
    again = refined_campaign(tmp_path / "again", EVEN, two_words, seed=9)
    assert all_variables(again) == all_variables(even)
    twins = EVEN["twins"] | {"seed": 5}
    other = refined_campaign(tmp_path / "other", EVEN | {"twins": twins}, two_words)
    theirs = hpcwhirl.open_results(other).twin_count.values == COUNT
    assert set(np.flatnonzero(theirs)) != set(has)


def test_credibility_is_told_by_status_map_and_page(even, tmp_path, capsys):
    line = str(hpcwhirl.credibility(hpcwhirl.open_results(even)))
    assert main(["status", str(even)]) == 0
    assert f"credibility: {line}" in capsys.readouterr().out.splitlines()
    title = drawing_of(even / "results.h5", Wish()).figure.get_suptitle()
    assert line in " ".join(title.split())
    page = write_page(Directory(even), tmp_path / "page.html").read_text()
    assert line.replace("<", "\\u003c") in page


def outvoted(settings):
    """Damped below a line, where most twins are sustained."""
    if settings["speed"] < 310:
        return "sustained" if settings.get("twin", 3) < 3 else "damped"
    return "divergent"


def test_a_case_is_coloured_by_most_of_its_twins_and_keeps_its_word(tmp_path, capsys):
    document = EVEN | {"twins": {"count": COUNT, "of": "all"}}
    folder = refined_campaign(tmp_path / "out", document, outvoted)
    data = hpcwhirl.open_results(folder)
    own, most = (hpcwhirl.words(data[n]) for n in ("regime", "word_majority"))
    assert set(own[data.speed < 310]) == {"damped"}
    assert (most[data.speed < 310] == "damped").all()  # two against two: its own
    document = EVEN | {"twins": {"count": COUNT + 1, "of": "all"}}

    def more(settings):
        return outvoted(settings | {"twin": 1} if "twin" in settings else settings)

    folder = refined_campaign(tmp_path / "more", document, more)
    data = hpcwhirl.open_results(folder)
    own, most = (hpcwhirl.words(data[n]) for n in ("regime", "word_majority"))
    below = data.speed.values < 310
    assert set(own[below]) == {"damped"}
    assert set(most[below]) == {"sustained"}
    drawing = drawing_of(folder / "results.h5", Wish())
    picture = drawing.picture
    assert (picture.word == own[picture.case]).all()
    assert (picture.colours.kind == most[picture.case]).all()
    drawing.figure.draw_without_rendering()
    (legend,) = drawing.figure.legends
    box, whole = legend.get_window_extent(), drawing.figure.bbox
    assert 0.0 <= box.x0 < box.x1 <= whole.width  # nothing is cut off
    texts = [t.get_text() for legend in drawing.figure.legends
             for t in legend.get_texts()]  # fmt: skip
    assert f"sustained by most twins, itself damped: {below.sum()}" in texts
    assert main(["cases", str(folder), "--limit", "3", "--csv"]) == 0
    head, first = capsys.readouterr().out.splitlines()[:2]
    row = dict(zip(head.split(","), first.split(","), strict=True))
    assert (row["word"], row["word_majority"]) == ("damped", "sustained")
    assert (row["word_share"], row["twin_count"]) == ("0.0", "4")


def test_the_map_hatches_the_unsure_by_the_cells_of_the_campaign(speckled):
    drawing = drawing_of(speckled / "results.h5", Wish())
    (axes,) = [axes for axes in drawing.figure.axes if axes.patches or axes.artists][:1]
    names = Counter(artist.get_gid() for artist in axes.get_children())
    assert names["hatch chosen"] == 1
    (hatch,) = [a for a in axes.get_children() if a.get_gid() == "hatch chosen"]
    corners = hatch.get_path().vertices
    assert corners[:, 0].min() > 200  # only where it is speckle


def test_status_waits_for_twins_and_failed_ones_are_told(tmp_path):
    def failing(settings):
        return None if settings.get("twin") == 2 else coin(settings)

    folder = refined_campaign(tmp_path / "out", DOCUMENT, failing)
    found = progress_of(Directory(folder))
    assert (found.left, found.failed) == (0, 0)
    design = design_of(DOCUMENT)
    ending = run_campaign(design, Directory(folder))
    data = hpcwhirl.open_results(folder)
    twinned = int((data.twin_count.values == COUNT - 1).sum())
    assert ending.complete
    assert ending.failed == twinned > 0


def test_twins_are_asked_for_later_and_taken_back(speckled, tmp_path):
    plain = {name: table for name, table in DOCUMENT.items() if name != "twins"}
    folder = refined_campaign(tmp_path / "out", plain, coin)
    before = root_variables(folder)
    prepare(design_of(DOCUMENT), Directory(folder))
    assert progress_of(Directory(folder)).left > 0
    refined_campaign(folder, DOCUMENT, coin)
    assert all_variables(folder) == all_variables(speckled)
    refined_campaign(folder, plain, coin)
    assert root_variables(folder) == before


SHORT = {
    "scene": {"duration": 0.03},
    "solver": {"time_step": 8e-6},
    "output": {"traces": "summary"},
    "sweep": {"speed": [200.0, 330.0, 460.0], "gap": [1e-4, 4e-4]},
    "refine": {"over": ["speed", "gap"], "levels": 2, "words": "both"},
    "twins": {"count": 2, "of": "boundary", "spread": {"force": 0.1}},
}


def test_a_kill_among_cases_and_twins_changes_no_bit(tmp_path, monkeypatch):
    design = design_of(SHORT)
    for name in ("whole", "killed"):
        prepare(design, Directory(tmp_path / name))
    assert run_campaign(design, Directory(tmp_path / "whole")).complete
    total = len(records(tmp_path / "whole"))
    twins = sum("twin" in record for record in records(tmp_path / "whole"))
    assert 2 * 2 <= twins < total
    often = Policy(save_every=1e-9)
    _, deaths = until_it_lives(
        monkeypatch,
        40,
        lambda: run_campaign(design, Directory(tmp_path / "killed"), policy=often),
    )
    assert deaths > 3
    assert all_variables(tmp_path / "killed") == all_variables(tmp_path / "whole")
    assert len(records(tmp_path / "killed")) == total  # none is computed twice


def test_a_dry_run_does_not_count_twins(tmp_path, capsys):
    import tomli_w

    file = tmp_path / "c.toml"
    file.write_text(tomli_w.dumps(SHORT))
    assert main(["campaign", str(file), "--out", str(tmp_path / "o"), "--dry-run"]) == 0
    assert "and 2 twins of each case at a boundary" in capsys.readouterr().out
