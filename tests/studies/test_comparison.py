"""Two campaigns side by side: only cases that meet count, and only once."""

import json

import h5py
import numpy as np
import pytest
from synthetic import synthetic

import hpcwhirl
from hpcwhirl.cli import main
from hpcwhirl.errors import InputError
from hpcwhirl.scene.words import ENUMS

pytestmark = pytest.mark.turns

SPEEDS = 100.0, 110.0, 120.0
LETTERS = {"d": "damped", "S": "sustained", "X": "divergent", "?": "undecided"}


def campaign(folder, letters, **numbers):
    """Write results: a letter for the word of each speed and gap; return the directory.

    letters : {gap: letters over `SPEEDS`}
    numbers : {variable: value of all cases}
    """
    cases = [{"gap": gap, "speed": speed} for gap, line in letters.items()
             for speed, _ in zip(SPEEDS, line, strict=False)]  # fmt: skip
    synthetic(folder, cases)
    with h5py.File(folder / "results.h5", "r+") as file:
        file["outcome"][:] = ENUMS["outcome"].index("completed")
        words = [LETTERS[one] for one in "".join(letters.values())]
        file["regime"][:] = [ENUMS["regime"].index(word) for word in words]
        for name, value in numbers.items():
            file[name][:] = value
    return folder


@pytest.fixture
def pair(tmp_path):
    a = campaign(tmp_path / "a", {1e-4: "ddS", 2e-4: "dXd"}, orbit_radius=1e-3)
    b = campaign(tmp_path / "b", {1e-4: "dS", 2e-4: "dd", 3e-4: "?"}, orbit_radius=2e-3)
    return a, b


def compared(a, b):
    with hpcwhirl.open_results(a) as one, hpcwhirl.open_results(b) as other:
        return hpcwhirl.compare(one, other)


def test_cases_meet_where_all_varied_inputs_are_equal(pair):
    found = compared(*pair)
    assert (len(found.words), found.alone) == (4, (2, 1))
    assert found.changed.sum() == 2
    assert list(found.transitions()) == [
        ("damped", "sustained"), ("divergent", "damped"), ("damped", "damped"),
    ]  # fmt: skip
    for name, values in found.at.items():
        for i, folder in enumerate(pair):
            with hpcwhirl.open_results(folder) as data:
                np.testing.assert_equal(
                    data[name].to_numpy()[found.cases[:, i]], values
                )


def test_a_campaign_compared_with_itself_has_no_difference(pair):
    found = compared(pair[0], pair[0])
    assert not found.changed.any()
    assert not any(one.differ or one.largest for one in found.moved)
    assert (found.alone, found.inputs) == ((0, 0), {})


def test_a_number_moves_by_its_relative_difference_in_either_order(pair):
    for order in (pair, pair[::-1]):
        (radius,) = [m for m in compared(*order).moved if m.name == "orbit_radius"]
        assert (radius.cases, radius.differ) == (4, 4)
        assert (radius.median, radius.largest) == (0.5, 0.5)


def test_superseded_cases_of_a_map_do_not_count(tmp_path):
    a = campaign(tmp_path / "a", {1e-4: "dd"})
    b = campaign(tmp_path / "b", {1e-4: "Sd"})
    with hpcwhirl.open_results(a) as one, hpcwhirl.open_results(b) as other:
        final = ("case", np.array([0, 1]))
        found = hpcwhirl.compare(one, other.assign(final=final))
    assert (len(found.words), found.changed.sum(), found.alone) == (1, 0, (1, 0))


def test_campaigns_that_do_not_meet_are_refused(tmp_path):
    a = campaign(tmp_path / "a", {1e-4: "dd"})
    b = campaign(tmp_path / "b", {2e-4: "dd"})
    with pytest.raises(InputError, match="no case of one campaign has the"):
        compared(a, b)


def test_the_command_prints_words_and_draws_them(pair, capsys, tmp_path):
    words = ["compare", *map(str, pair)]
    picture = tmp_path / "words.png"
    assert main([*words, "--plot", str(picture), "--units", "mm,rpm"]) == 0
    printed = capsys.readouterr().out
    assert "words: 2 of 4 changed" in printed
    assert picture.read_bytes().startswith(b"\x89PNG")
    with h5py.File(pair[0] / "results.h5", "r+") as file:
        file.attrs["units"] = "rpm"  # of its file, without --units
    assert main(words) == 0
    assert " rpm" in capsys.readouterr().out
    assert main([*words, "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert (facts["changed"], facts["alone"], len(facts["cases"])) == (2, [2, 1], 4)
    assert facts["cases"][0]["speed"] == 100.0
    assert main(["compare", str(pair[0]), str(tmp_path / "none")]) == 2
    assert main([*words, "--plot", str(picture), "--x", "friction"]) == 2
