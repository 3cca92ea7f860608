"""Pairs of features: each has a row, with its cost or the reason of its refusal."""

import combinations
import pytest

pytestmark = pytest.mark.evidence


def test_a_pair_is_marched_or_refused_with_its_reason(capsys):
    assert combinations.main(["mistuned", "oval", "exact"]) == 0
    rows = [line for line in capsys.readouterr().out.splitlines() if line[0] == "|"]
    held, handed, exact = ([part.strip() for part in row.split("|")] for row in rows)
    assert held[1] == "mistuned + oval"
    share, cost, like, far = map(float, held[3:7])
    assert 0.0 < share < 1.0
    assert cost > 0.0 < like
    assert far < 1e-8
    assert handed[1:3] == ["mistuned + exact", "BothAsWaves"]
    assert exact[1:3] == ["oval + exact", "EqualWaves"]
    assert combinations.main(["run-up", "chaos"]) == 0
    refused = [part.strip() for part in capsys.readouterr().out.split("|")]
    assert refused[1:3] == ["run-up + chaos", "refused"]
    assert "output.chaos must be 0" in refused[6]


def test_pairs_are_judged_by_the_base_with_their_share_in_contact():
    base = combinations.Base(1.0, [0.0, 0.5], [1.0, 3.0])
    assert [base.like(share) for share in (0.0, 0.25, 0.9)] == [1.0, 2.0, 3.0]
    dear = combinations.Row(("film", "elements"), "Spinning", 0.2, 9.0, 8.0)
    cheap = combinations.Row(("film", "lost blade"), "BothAsWaves", 0.9, 9.0, 3.0)
    (line,) = combinations.causes([dear, cheap])
    assert line.startswith("- elements (1, 8.0 to 8.0 times): ")


def test_a_feature_differs_from_the_base():
    for name, given in combinations.FEATURES.items():
        assert not given.items() <= combinations.BASE.items(), name
