"""Safe ranges: as many neighbouring cases as are damped, and what lies beyond them."""

import json
import math
from itertools import pairwise, product

import h5py
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from synthetic import synthetic

import hpcwhirl
from hpcwhirl.cli import main
from hpcwhirl.errors import InputError
from hpcwhirl.report import canvas
from hpcwhirl.scene.words import ENUMS

LETTERS = {"d": "damped", "S": "sustained", "X": "divergent", "?": "undecided"}
NAN = float("nan")
RAMPS = [(300.0, 10.0), (400.0, -10.0)]


def worded(folder, cases, letters):
    """Write results of cases, with a letter for the word of each; return folder."""
    synthetic(folder, cases)
    with h5py.File(folder / "results.h5", "r+") as file:
        file["outcome"][:] = ENUMS["outcome"].index("completed")
        file["regime"][:] = [ENUMS["regime"].index(LETTERS[one]) for one in letters]
    return folder


def campaign(folder, lines):
    """Write results whose words are given; return the directory.

    lines : {gap: a letter for each speed}, speeds 100, 110, 120 ...
    """
    points = [(gap, 100.0 + 10 * i) for gap, line in lines.items()
              for i in range(len(line))]  # fmt: skip
    cases = [{"gap": gap, "speed": speed} for gap, speed in points]
    return worded(folder, cases, "".join(lines.values()))


def ranges(folder, **options):
    with hpcwhirl.open_results(folder) as data:
        return hpcwhirl.safe_ranges(data, **options)


def ends(found):
    return [(r.low, r.high, r.below, r.above, r.word_below, r.word_above, r.cases)
            for r in found]  # fmt: skip


@pytest.mark.turns
def test_ranges_and_what_lies_beyond_them(tmp_path):
    found = ranges(campaign(tmp_path / "c", {1e-4: "ddSdd?", 2e-4: "dddddd"}))
    first = [
        (100.0, 110.0, NAN, 120.0, "", "sustained", 2),
        (130.0, 140.0, 120.0, 150.0, "sustained", "undecided", 2),
    ]
    second = [(100.0, 150.0, NAN, NAN, "", "", 6)]
    np.testing.assert_equal(ends(found), first + second)
    assert [r.fixed for r in found] == [{"gap": 1e-4}] * 2 + [{"gap": 2e-4}]


@pytest.mark.turns
def test_a_line_without_a_damped_case_is_told(tmp_path):
    (found,) = ranges(campaign(tmp_path / "c", {1e-4: "SX?"}))
    assert found.cases == 0
    assert math.isnan(found.low)
    assert math.isnan(found.distance(110.0))


@pytest.fixture(scope="module")
def twelve(tmp_path_factory):
    """Return the results of twelve damped cases, in memory."""
    place = campaign(tmp_path_factory.mktemp("any") / "c", {1e-4: 12 * "d"})
    with hpcwhirl.open_results(place) as data:
        return data.load()


@pytest.mark.turns
@given(line=st.text("dSX?", min_size=2, max_size=12))
def test_every_damped_case_lies_in_one_range_and_no_other_case_does(twelve, line):
    words = np.array([LETTERS[letter] for letter in line])
    data = twelve.isel(case=slice(len(line))).assign(regime=("case", words))
    found = hpcwhirl.safe_ranges(data)
    for i, letter in enumerate(line):
        speed = 100.0 + 10 * i
        inside = [r for r in found if r.cases and r.low <= speed <= r.high]
        assert len(inside) == (letter == "d")
        assert all(r.distance(speed) >= 0.0 for r in inside)
    for r in found:
        assert not r.cases or round((r.high - r.low) / 10) == r.cases - 1


@pytest.mark.turns
def test_the_distance_is_to_the_nearest_end_with_another_word_beyond(tmp_path):
    found = ranges(campaign(tmp_path / "c", {1e-4: "dddS"}))[0]
    assert found.distance(105.0) == 15.0  # below 100 nothing was computed
    assert found.distance(125.0) == -5.0  # in the bracket: nobody knows
    assert found.distance(90.0) == -10.0
    free = ranges(campaign(tmp_path / "free", {1e-4: "ddd"}))[0]
    assert free.distance(110.0) == math.inf


def test_the_sweep_of_another_input_is_a_line_of_it(tmp_path):
    place = campaign(tmp_path / "c", {1e-4: "dS", 2e-4: "dd", 3e-4: "SS"})
    found = ranges(place, over="gap")
    assert [(r.fixed["speed"], r.low, r.high) for r in found] == [
        (100.0, 1e-4, 2e-4), (110.0, 2e-4, 2e-4)]  # fmt: skip


@pytest.mark.turns
def test_what_is_no_sweep_is_refused(tmp_path):
    place = campaign(tmp_path / "c", {1e-4: "dS"})
    with pytest.raises(InputError, match="unknown swept input 'gapp'"):
        ranges(place, over="gapp")
    drawn = tmp_path / "drawn"
    synthetic(drawn, [{"gap": g, "speed": s} for g, s in [(1e-4, 1.0), (2e-4, 2.0)]])
    with hpcwhirl.open_results(drawn) as data:
        assert len(hpcwhirl.safe_ranges(data)) == 1  # as in [zip]: gap follows speed
    synthetic(
        tmp_path / "more",
        [{"gap": g, "speed": s, "friction": f}
         for g, s, f in [(1e-4, 1.0, 0.1), (2e-4, 2.0, 0.2), (3e-4, 1.0, 0.3)]],
    )  # fmt: skip
    with pytest.raises(InputError, match="no two cases differ in speed alone"):
        ranges(tmp_path / "more")


# The command


@pytest.fixture
def place(tmp_path):
    return campaign(tmp_path / "c", {1e-4: "ddSd", 2e-4: "dddS"})


def test_csv_has_a_row_for_each_range(place, capsys):
    assert main(["margin", str(place), "--csv"]) == 0
    head, *rows = capsys.readouterr().out.splitlines()
    assert head.startswith("gap [m],low [rad/s],high [rad/s],below [rad/s]")
    assert rows[0] == "0.0001,100.0,110.0,nan,120.0,,sustained,2,10.0"
    assert len(rows) == 3
    assert main(["margin", str(place), "--csv", "--no-units"]) == 0
    assert capsys.readouterr().out.startswith("gap,low,high,below,above,word_below")


@pytest.mark.turns
def test_a_point_is_told_its_distance(place, facts, capsys):
    found = facts("margin", str(place), "--json", "--at", "speed=105")
    assert [r["distance"] for r in found["ranges"]] == [5.0, -25.0, 15.0]
    assert main(["margin", str(place), "--at", "speed=105", "--at", "gap=0.2 mm"]) == 0
    told = capsys.readouterr().out
    assert "on 1 of 1 lines; no computed case nearer than 15 rad/s is not da" in told
    assert "in steps of up to 10 rad/s" in told
    assert "at least" not in told
    assert main(["margin", str(place), "--at", "speed=125"]) == 0
    assert "in no range of damped cases on any of 2 lines" in capsys.readouterr().out


def test_margins_are_told_in_the_unit_asked_for(place, capsys):
    words = ["--at", "speed=105", "--at", "gap=0.2 mm", "--units", "rpm"]
    assert main(["margin", str(place), *words]) == 0
    out = capsys.readouterr().out
    assert "speed = 1002.68 rpm: in a range of damped cases on 1 of 1 lines" in out
    assert "no computed case nearer than 143.239 rpm is not damped" in out
    assert "954.93" in out
    assert main(["margin", str(place), "--at", "speed=105", "--units", "um"]) == 0
    told = capsys.readouterr().out
    assert "nearer than 5 rad/s is not damped at gap = 100 um" in told


@pytest.mark.turns
def test_wrong_words_are_one_line(place, capsys):
    for words in (["--sure", "2"], ["--check", "0"],
                  ["--at", "speed=x"], ["--over", "nothing"],
                  ["--at", "speed=nan"], ["--over", "each", "--at", "speed=inf"],
                  ["--at", "speed=1", "--at", "speed=2"]):  # fmt: skip
        assert main(["margin", str(place), *words]) == 2
        assert len(capsys.readouterr().err.splitlines()) == 1


def test_a_campaign_of_one_case_has_no_ranges(tmp_path, capsys):
    assert main(["margin", str(synthetic(tmp_path / "one", [{}]))]) == 2
    told = capsys.readouterr().err
    assert told == "hpcwhirl: error: unknown swept input 'speed': no input was swept\n"


def test_results_without_a_damped_case_are_told_strictly(tmp_path, facts, capsys):
    place = campaign(tmp_path / "x", {1e-4: "SX"})
    found = facts("margin", str(place), "--json")
    assert json.dumps(found["ranges"][0]["low"]) == "null"
    assert main(["margin", str(place)]) == 0
    told = "no case is damped on any of 1 line over speed"
    assert told in capsys.readouterr().out


# How strong the pulse may be


def pulses(folder, lines):
    """Write results of pulses 50, 100, 150 kN ..., a line of words for each speed."""
    cases = [{"speed": speed, "force": 5e4 * (i + 1)} for speed, line in lines.items()
             for i in range(len(line))]  # fmt: skip
    return worded(folder, cases, "".join(lines.values()))


@pytest.mark.turns
@given(line=st.text("dSX?", min_size=2, max_size=12))
def test_a_pulse_is_safe_while_every_weaker_one_is_damped(twelve, line):
    words = np.array([LETTERS[letter] for letter in line])
    data = twelve.isel(case=slice(len(line))).assign(regime=("case", words))
    (found,) = hpcwhirl.first_changes(data, "speed")
    run = len(line) - len(line.lstrip("d"))
    ends = [100.0 + 10 * (run - 1) if run else NAN,
            100.0 + 10 * run if run < len(line) else NAN]  # fmt: skip
    np.testing.assert_equal([found.safe, found.unsafe], ends)
    assert found.word == (LETTERS[line[run]] if run < len(line) else "")
    safe = [letter == "d" for letter in line]
    assert found.changes == sum(a != b for a, b in pairwise(safe))


LINES = {300.0: "dddd", 410.0: "ddXd", 500.0: "Sddd"}


@pytest.mark.turns
def test_the_safe_pulse_is_told_in_multiples_of_the_present_one(
    tmp_path, facts, capsys
):
    place = pulses(tmp_path / "c", LINES)
    words = ["margin", str(place), "--over", "force", "--first", "--at", "force=75 kN"]
    assert main(words) == 0
    out = capsys.readouterr().out
    limits = {
        "300": "damped up to 2.667 times force = 75 kN in steps of 0.6667, the l",
        "410": "damped up to 1.333 times force = 75 kN in steps of 0.6667, then",
        "500": "sustained at 0.6667 times force = 75 kN, the least value tried; 1",
    }
    assert all(f"speed = {n} rad/s: {text}" in out for n, text in limits.items())
    assert "then divergent at 2; 1 more change" in out
    rows = facts(*words, "--json")["first"]
    assert [r["times_safe"] for r in rows] == [2e5 / 75e3, 1e5 / 75e3, None]
    assert main([*words, "--csv"]) == 0
    head, *lines = capsys.readouterr().out.splitlines()
    assert (
        head == "speed [rad/s],safe [N],unsafe [N],word,changes,step [N],"
        "times_safe,times_unsafe"
    )
    assert lines[1] == (
        "410.0,100000.0,150000.0,divergent,2,50000.0,1.3333333333333333,2.0"
    )


@pytest.mark.parametrize(
    ("value", "told"),
    [
        ("0", "must be > 0 with --first"),
        ("-75 kN", "must be > 0 with --first"),
        ("nan", "must be a finite number, got 'nan'"),
        ("1e400", "must be a finite number, got '1e400'"),
    ],
)
def test_a_pulse_that_has_no_multiples_is_refused(tmp_path, capsys, value, told):
    place = pulses(tmp_path / "c", LINES)
    words = ["--over", "force", "--first", "--at", f"force={value}"]
    assert main(["margin", str(place), *words]) == 2
    assert told in capsys.readouterr().err


@pytest.mark.turns
def test_the_legend_of_limits_has_only_marks_that_occur(tmp_path):
    place = pulses(tmp_path / "c", {300.0: "ddSS", 410.0: "dSSS"})
    words = ["--over", "force", "--first", "--at", "force=75 kN", "--plot"]
    assert main(["margin", str(place), *words, str(tmp_path / "limit.svg")]) == 0
    text = (tmp_path / "limit.svg").read_text()
    assert all(f'id="{mark}"' in text for mark in ("bracket", "safe"))
    assert not any(f'id="{mark}"' in text for mark in ("open", "none", "again"))


@pytest.mark.turns
def test_limits_are_drawn_over_one_and_two_inputs(tmp_path, capsys):
    place = pulses(tmp_path / "c", LINES)
    words = ["--over", "force", "--first", "--at", "force=75 kN", "--plot"]
    for kind in ("svg", "png"):
        picture = tmp_path / f"limit.{kind}"
        assert main(["margin", str(place), *words, str(picture)]) == 0
        assert picture.stat().st_size > 5000
    text = (tmp_path / "limit.svg").read_text()
    assert all(f'id="{mark}"' in text for mark in ("bracket", "open", "none", "again"))
    capsys.readouterr()
    assert main(["margin", str(place), "--first", "--plot", str(picture),
                 "--at", "force=200 kN"]) == 2  # fmt: skip
    assert (
        "one or two other swept inputs of numbers, got none" in capsys.readouterr().err
    )


@pytest.mark.turns
def test_a_map_of_limits_has_that_of_each_point(tmp_path, monkeypatch):
    """Two speeds, three gaps; the pulses 10, 20 and 30 kN."""
    points = product((300.0, 410.0), (1e-4, 2e-4, 3e-4), (1e4, 2e4, 3e4))
    cases = [{"speed": s, "gap": g, "force": f} for s, g, f in points]
    worded(tmp_path, cases, "dSS ddS ddd SSS dSd ddX".replace(" ", ""))
    figures, save = [], canvas.save
    monkeypatch.setattr(
        canvas, "save", lambda *given: figures.append(given[0]) or save(*given)
    )
    picture = tmp_path / "map.png"
    words = ["--over", "force", "--first", "--plot", str(picture)]
    assert main(["margin", str(tmp_path), *words]) == 0
    assert picture.stat().st_size > 5000
    axes = figures[0].axes[0]
    assert axes.get_xlabel().startswith("speed")
    (image,) = axes.images
    want = [[10.0, 0.0], [20.0, 10.0], [30.0, 20.0]]  # kN
    np.testing.assert_allclose(image.get_array().data, want, rtol=1e-12)
    at = {line.get_gid(): [*zip(*line.get_data(), strict=True)] for line in axes.lines}
    assert at == {
        "no change met": [(0, 2)],
        "first case not damped": [(1, 0)],
    }


@pytest.mark.turns
def test_a_point_has_a_margin_in_every_input(tmp_path, facts, capsys):
    place = pulses(tmp_path / "c", {300.0: "dddd", 410.0: "ddXd", 500.0: "dddd"})
    words = ["margin", str(place), "--over", "each", "--at", "speed=400",
             "--at", "force=120 kN"]  # fmt: skip
    speed, force = facts(*words, "--json")["inputs"]
    assert (speed["low"], speed["high"], speed["word_above"]) == (300.0, 500.0, "")
    assert speed["line"] == "force = 100 kN"  # the nearest one that was computed
    assert (force["high"], force["above"], force["word_above"]) == (
        1e5,
        1.5e5,
        "divergent",
    )
    assert force["distance"] == -2e4  # in the bracket
    assert main(words) == 0
    assert "120 kN" in capsys.readouterr().out
    assert main(["margin", str(place), "--over", "each"]) == 2
    assert "needs a value of a swept input" in capsys.readouterr().err


# Points drawn inside


def island(scene):
    """Return a word: not damped in two narrow ranges of speed at the lower gap."""
    speed, low = scene.speed, scene.gap < 1.5e-4
    return "sustained" if low and (112 < speed < 118 or speed > 175) else "damped"


@pytest.fixture
def computed(monkeypatch):
    """Give every scene that is integrated its word by `island`; return the scenes."""
    scenes = []

    def word(scene):
        scenes.append(scene)
        return island(scene)

    monkeypatch.setattr("hpcwhirl.studies.margin_check.computed_word", word)
    return scenes


LONG = {1e-4: "ddddddddSS", 2e-4: "dddddddddd"}


def test_points_drawn_inside_a_range_tell_the_share_that_is_damped(
    tmp_path, facts, computed
):
    place = campaign(tmp_path / "c", LONG)
    found = facts("margin", str(place), "--check", "40", "--json")
    low, high = found["checks"]
    assert (low["low"], low["high"], low["drawn"]) == (100.0, 170.0, 40)
    bad = [one["value"] for one in low["not_damped"]]
    assert all(112 < value < 118 for value in bad)
    assert low["damped"] == 40 - len(bad) < 40
    assert low["share_low"] < 64 / 70 < low["share_high"]
    assert (high["damped"], high["share"]) == (40, 1.0)
    assert {scene.gap for scene in computed} == {1e-4, 2e-4}
    first, second = (one for one in found["ranges"] if one["gap"] == 1e-4)
    assert first["high"] <= 112 <= first["above"] <= min(bad)
    assert max(bad) <= second["below"] <= 118 <= second["low"]
    assert first["above"] - first["high"] < 10 / 2**2  # bisected
    assert first["drawn"] == second["drawn"] == 40


@pytest.mark.turns
def test_at_least_stands_behind_drawn_points_alone(tmp_path, capsys, computed):
    place = str(campaign(tmp_path / "c", {1e-4: "ddddddddSS", 2e-4: "ddddddddSS"}))
    words = ["margin", place, "--at", "speed=150", "--check", "20"]
    assert main([*words, "--at", "gap=2e-4"]) == 0
    told = capsys.readouterr().out
    assert "is at least 20 rad/s away, by 20 drawn points" in told
    assert main([*words, "--at", "gap=1e-4"]) == 0
    told = capsys.readouterr().out
    assert "points drawn inside are damped" in told
    assert "no computed case nearer than" in told
    assert "at least" not in told
    assert computed


@pytest.mark.turns
def test_a_limit_that_a_drawn_pulse_breaks_is_lowered(tmp_path, facts, monkeypatch):
    place = pulses(tmp_path / "c", {300.0: "dddd"})
    word = lambda scene: "damped" if scene.force < 1.1e5 else "sustained"  # noqa: E731
    monkeypatch.setattr("hpcwhirl.studies.margin_check.computed_word", word)
    words = ["margin", str(place), "--over", "force", "--first", "--json"]
    (before,) = facts(*words)["first"]
    (after,) = facts(*words, "--check", "10")["first"]
    assert before["safe"] == 2e5
    assert after["safe"] < 1.1e5 <= after["unsafe"]
    assert after["word"] == "sustained"
    each = ["margin", str(place), "--over", "each", "--at", "force=60 kN", "--json"]
    (along,) = facts(*each, "--check", "10")["inputs"]
    assert along["high"] < 1.1e5 <= along["above"]


def test_points_between_are_refused_where_other_inputs_follow(tmp_path, capsys):
    drawn = tmp_path / "zip"
    synthetic(drawn, [{"gap": g, "speed": s} for g, s in [(1e-4, 1.0), (2e-4, 2.0)]])
    assert main(["margin", str(drawn), "--check", "5"]) == 2
    assert "but gap has values only where cases" in capsys.readouterr().err


def test_without_a_swept_speed_the_ranges_are_over_the_first_number(tmp_path, capsys):
    cases = [{"casing.contact_law": "rigid", "gap": gap} for gap in (1e-4, 2e-4)]
    place = worded(tmp_path / "c", cases, "dS")
    assert main(["margin", str(place)]) == 0
    assert capsys.readouterr().out.startswith("over gap, all cases")


def test_a_speed_that_changes_is_told_to_be_that_at_the_start(tmp_path, capsys):
    place = tmp_path / "c"
    worded(place, [{"speed": s, "acceleration": a} for s, a in RAMPS], "dd")
    assert main(["margin", str(place)]) == 0
    assert "speed is that at which a run begins" in capsys.readouterr().err
