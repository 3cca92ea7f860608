"""Pairs of features: each has a row, with its cost or the reason of its refusal."""

import combinations
import pytest

pytestmark = pytest.mark.evidence


def test_a_pair_is_marched_or_refused_with_its_reason(capsys):
    assert combinations.main(["mistuned", "oval", "exact"]) == 0
    rows = [line for line in capsys.readouterr().out.splitlines() if line[0] == "|"]
    held, refused, exact = ([part.strip() for part in row.split("|")] for row in rows)
    assert held[1] == "mistuned + oval"
    assert float(held[3]) > 0.0
    assert float(held[4]) < 1e-8
    assert refused[1:3] == ["mistuned + exact", "refused"]
    assert "equal blades" in refused[4]
    assert exact[1] == "oval + exact"


def test_a_feature_differs_from_the_base():
    for name, given in combinations.FEATURES.items():
        assert not given.items() <= combinations.BASE.items(), name
