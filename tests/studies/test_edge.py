"""The edge between the words of two pulses, from Python and as a command."""

import json

import h5py
import numpy as np
import pytest
from synthetic import synthetic

from hpcwhirl.analysis.regimes import evidence
from hpcwhirl.case.resolve import resolve
from hpcwhirl.cli import main
from hpcwhirl.dynamics.kernels import contact
from hpcwhirl.dynamics.march import March
from hpcwhirl.errors import InputError
from hpcwhirl.scene import apply_settings, named_scene
from hpcwhirl.scene.words import ENUMS
from hpcwhirl.studies.edge import (
    Continued,
    Tracking,
    _orbit,
    edge,
    moment_of,
    since,
)
from hpcwhirl.studies.edge_tracking import LostEdgeError

QUICK = Tracking(span=0.01, look=0.3, near=0.03, far=0.1)


def four(**settings):
    return apply_settings(named_scene("four_motions"), {"speed": 420.0} | settings)


@pytest.fixture(scope="module")
def found():
    return edge(four(), 3e4, 1.2e5, QUICK)


@pytest.mark.slow
def test_an_edge_lies_between_the_motions_of_both_pulses(found):
    assert (found.low.word, found.high.word) == ("damped", "divergent")
    assert found.numbers["bisections"] >= 3
    steps = np.diff(found.time)
    assert steps == pytest.approx(np.full(len(steps), steps[0]), rel=1e-9)
    assert len(found.time) == len(found.centre) == len(found.energy) > 10
    # both sides go on from the last states of the edge
    for side in (found.low, found.high):
        assert side.time[0] - found.time[-1] < 2.5 * steps[0]
    radius = np.hypot(*found.centre[-1])
    assert found.low.radius[0] == pytest.approx(radius, rel=0.3)


@pytest.mark.slow
def test_a_scheme_that_jumps_has_the_edge_of_one_that_does_not(found):
    jumped = edge(four(scheme="exact"), 3e4, 1.2e5, QUICK)
    assert (jumped.low.word, jumped.high.word) == ("damped", "divergent")
    late = slice(len(found.time) // 2, None)
    radii = [np.hypot(*each.centre[late].T).mean() for each in (found, jumped)]
    assert radii[1] == pytest.approx(radii[0], rel=0.1)


@pytest.mark.parametrize("change", [{"acceleration": 1.0}, {"gap_closure": 1e-5}])
def test_no_edge_is_followed_where_speed_or_gap_change(change):
    with pytest.raises(InputError, match=r"^an edge is followed at constant speed"):
        edge(four(**change), 3e4, 1.2e5, QUICK)


def test_no_edge_is_followed_with_a_layer_that_wears():
    with pytest.raises(InputError, match=r"contact_law must be rigid, got archard$"):
        edge(four(contact_law="archard"), 3e4, 1.2e5, QUICK)


def test_pulses_of_one_word_have_no_edge():
    with pytest.raises(InputError, match="no edge: pulses of 20000 and 25000 N lead to "
                       "the same word, damped"):  # fmt: skip
        edge(four(), 2e4, 2.5e4, QUICK)


def test_a_later_part_is_judged_as_if_it_had_begun_there():
    march = March(resolve(four(force=3e4, duration=0.2, traces="summary")))
    march.reach(march.total)
    whole = march.history()
    later = since(whole, 0.05)
    assert later.end == pytest.approx(whole.end - 0.05)
    assert 0.0 < later.judged.time[0] < 1e-3
    assert len(later.judged.time) < len(whole.judged.time)
    np.testing.assert_array_equal(later.judged.centre, whole.judged.centre[-len(
        later.judged.time):])  # fmt: skip
    told = evidence(march.scene, later)
    assert told["window"] == pytest.approx(0.4 * 0.15)


def test_the_state_in_the_middle_is_as_far_from_both():
    states = []
    for force in (0.0, 3e4, 1.2e5):
        settings = {"force": force, "duration": 0.1, "plan": "everything"}
        march = March(resolve(four(**settings)))
        march.reach(2000)
        states.append(moment_of(march))
    motions = Continued(march, 1e-3)
    rest, low, high = states
    assert motions.distance(low, rest) == pytest.approx(1.0, rel=1e-9)  # of its size
    middle = motions.between(low, high, 0.5)
    whole = motions.distance(low, high)
    assert motions.distance(low, middle) == pytest.approx(0.5 * whole, rel=1e-9)
    ahead = motions.ahead(middle)
    assert len(ahead.rows) == 2
    assert int(ahead.state.counter[contact.STEP]) == 2000 + motions.stride


@pytest.mark.slow
def test_the_command_prints_and_draws_the_edge(found, tmp_path, capsys):
    picture = tmp_path / "edge.svg"
    words = ["edge", "four_motions", "--set", "speed=420", "--low", "30kN",
             "--high", "120 kN", "--span", "0.01", "--look", "0.3", "--near", "0.03",
             "--far", "0.1", "--json", "--quiet", "--plot", str(picture)]  # fmt: skip
    assert main(words) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["word_high"] == "divergent"
    assert {name: told[name] for name in found.numbers} == found.numbers  # same bits
    text = picture.read_text()
    assert all(f'id="{name}"' in text for name in ("edge", "low", "high"))


PULSES = ["four_motions", "--low", "1", "--high", "2"]


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["four_motions"], "two pulses that lead to different words"),
        (["four_motions", "--low", "x"], "--low force must be a number"),
        ([*PULSES, "--look", "0"], "look must be > 0"),
        ([*PULSES, "--near", "1"], "near must be < far, and far < 1, got 1 and 0.001"),
        (["four_motions", "--at", "speed=1"], "--at selects cases of a campaign"),
        ([".", "--at", "speed=1"], "results.h5"),
    ],
)
def test_wrong_words_are_one_line(words, told, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["edge", *words]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert told in line


def words_over_force(folder, lines):
    """Write results of pulses 50, 100 ... kN; a line of words for each speed."""
    cases = [(speed, 5e4 * (i + 1), word) for speed, words in lines.items()
             for i, word in enumerate(words)]  # fmt: skip
    synthetic(folder, [{"speed": s, "force": f} for s, f, _ in cases])
    with h5py.File(folder / "results.h5", "r+") as file:
        file["outcome"][:] = ENUMS["outcome"].index("completed")
        file["regime"][:] = [ENUMS["regime"].index(word) for _, _, word in cases]
    return folder


@pytest.mark.turns
def test_a_campaign_over_force_has_an_edge_on_each_line_with_a_change(
    tmp_path, capsys, monkeypatch
):
    calm, whirls = ["damped"] * 3, ["damped", "damped", "divergent"]
    place = words_over_force(
        tmp_path / "c", {300.0: calm, 410.0: whirls, 420.0: whirls}
    )
    asked = []

    def followed(scene, low, high, how, tell):
        del how, tell
        asked.append((scene.speed, low, high))
        msg = "the boundary was lost: for a test"
        raise LostEdgeError(msg)

    monkeypatch.setattr("hpcwhirl.studies.edge.edge", followed)
    assert main(["edge", str(place), "--quiet"]) == 0
    out = capsys.readouterr().out
    assert asked == [(410.0, 1e5, 1.5e5), (420.0, 1e5, 1.5e5)]
    assert out.count("the boundary was lost: for a test") == 2
    assert main(["edge", str(place), "--at", "speed=420", "--quiet"]) == 2  # one line
    assert asked[2:] == [(420.0, 1e5, 1.5e5)]
    assert main(["edge", str(place), "--at", "speed=300"]) == 2
    assert "no pulse changes the word from damped on 1 lines" in capsys.readouterr().err
    assert main(["edge", str(place), "--plot", str(tmp_path / "edge.png")]) == 2
    assert "--plot draws one edge, got 2 lines" in capsys.readouterr().err


def test_numbers_of_a_mirrored_orbit_are_those_in_the_sense_of_rotation():
    time = np.linspace(0.0, 1.0, 4000)
    z = 1e-4 * np.exp(40j * time) + 2e-5 * np.exp(-90j * time)
    centre = np.column_stack([z.real, z.imag])
    one, other = _orbit(time, centre, 300.0), _orbit(time, centre * [1, -1], -300.0)
    assert one["turning_rate"] == pytest.approx(40.0, rel=0.05)
    assert other == pytest.approx(one, rel=1e-6)
