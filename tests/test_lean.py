"""What `scripts/evidence/lean.py` prints of lean plans is what it has measured."""

import pytest
from evidence import lean


def found(**own):
    same = {"regime": "damped", "whirl": "none", "stop": "end", "folds": 1}
    same |= {"certificate": -1.0, "contacts": 0, "blades": 10, "seconds": 1.0}
    numbers = dict.fromkeys(lean.FLOORS, 2.0)
    return same | numbers | own


def told(capsys, *pairs, certain=False):
    wrong = lean.tell([{"nodal_diameter": 2}] * len(pairs), pairs, certain=certain)
    return wrong, capsys.readouterr().out


@pytest.mark.parametrize("name", lean.FLOORS)
def test_the_largest_difference_of_any_number_is_told_with_its_touchdowns(name, capsys):
    usual = found(folds=2, contacts=20), found(contacts=20)
    off = found(folds=2, contacts=50), found(contacts=50, **{name: 2.0 * (1 + 1.9e-7)})
    _, text = told(capsys, usual, off)
    assert "numbers of the 2 cases of which something is left out" in text
    assert "1 < touchdowns a blade <= 3: 1 cases, relative differences 0.0e+00" in text
    lines = [line for line in text.splitlines() if f"1.9e-07 (largest: {name})" in line]
    assert [line.split(":")[0].strip() for line in lines] == [
        "3 < touchdowns a blade <= 6", "all",
    ]  # fmt: skip


def test_cases_of_which_nothing_is_left_out_dilute_no_difference(capsys):
    whole = found(), found()
    off = found(folds=2), found(contact_impulse=2.1)
    _, text = told(capsys, *[whole] * 50, off)
    assert "numbers of the 1 cases" in text
    assert "all: 1 cases, relative differences 4.8e-02 (median)" in text


def test_words_that_differ_are_counted_unless_the_whole_is_undecided(capsys):
    other = found(), found(regime="undecided")
    assert told(capsys, other)[0] == 1
    assert told(capsys, other, certain=True)[0] == 0
    assert told(capsys, (found(), found(regime="none")), certain=True)[0] == 1


def test_engines_are_drawn_unless_the_default_is_asked_for():
    cases = lean.drawn(64, 1)
    assert {case["blades"] for case in cases} == set(lean.BLADES)
    assert {case["nodal_diameter"] for case in cases} == set(range(5))
    assert not any("blades" in case for case in lean.drawn(64, 1, engines=False))
