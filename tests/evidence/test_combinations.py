"""Pairs of features: each has a row, with its cost or the reason of its refusal."""

import combinations
import pytest

pytestmark = pytest.mark.evidence


def test_a_pair_is_marched_or_refused_with_its_reason(capsys):
    assert combinations.main(["mistuned", "oval", "exact"]) == 0
    rows = [line for line in capsys.readouterr().out.splitlines() if line[0] == "|"]
    held, handed, exact = ([part.strip() for part in row.split("|")] for row in rows)
    assert held[1] == "mistuned + oval"
    assert float(held[3]) > 0.0
    assert float(held[4]) < 1e-8
    assert handed[1:3] == ["mistuned + exact", "BothAsWaves"]
    assert exact[1:3] == ["oval + exact", "EqualWaves"]
    assert combinations.main(["run-up", "chaos"]) == 0
    refused = [part.strip() for part in capsys.readouterr().out.split("|")]
    assert refused[1:3] == ["run-up + chaos", "refused"]
    assert "output.chaos must be 0" in refused[4]


def test_a_feature_differs_from_the_base():
    for name, given in combinations.FEATURES.items():
        assert not given.items() <= combinations.BASE.items(), name
