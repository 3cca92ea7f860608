"""What `model --explain` says of the integration is what integrates the case."""

import pytest

from hpcwhirl.case.resolve import resolve
from hpcwhirl.cli import main
from hpcwhirl.dynamics.integration import MATRICES, MODES, WAYS, integration_of
from hpcwhirl.dynamics.kernels.loop.wave_types import FlowRows, PointRows, SlotRows
from hpcwhirl.scene import apply_settings, named_scene

SMALL = {"blades": 5, "modes": 10, "casing.harmonics": 3, "time_step": 2e-6}
UNEQUAL = {"mistuning": [0.01, -0.02, 0.03, 0.0, 0.01]}
ELEMENTS = {"discretization": "elements", "casing.elements": 10}


def found_of(given):
    return integration_of(resolve(apply_settings(named_scene("table2"), SMALL | given)))


@pytest.mark.parametrize(
    ("given", "by", "why"),
    [
        ({}, WAYS[SlotRows], ""),
        ({"scheme": "exact"}, WAYS[FlowRows], ""),
        (UNEQUAL, WAYS[PointRows], ""),
        ({"blades": 2, "modes": 4}, WAYS[PointRows], ""),
        ({"scheme": "general"}, MODES, ""),
        ({"scheme": "paper"}, MATRICES, ""),
        (ELEMENTS, MODES, "a ring of elements"),
        ({"casing.damping": 1.5}, MODES, "do not oscillate are no waves: casing"),
    ],
)
def test_what_integrates_a_case_is_told(given, by, why):
    found = found_of(given)
    assert found["by"] == by
    assert why in found["why"]
    assert bool(found["why"]) == bool(why)


def test_modes_beyond_critical_damping_are_named():
    found = found_of({"casing.damping": 1.5})["no_waves"]
    assert found
    for mode in found:
        assert mode["body"] == "casing"
        assert mode["damping_ratio"] >= 1.0
    assert found_of({"casing.damping": 0.9})["no_waves"] == []


def test_the_command_says_it(capsys):
    sets = [f"--set={n}={v}" for n, v in SMALL.items()]
    assert main(["model", "table2", *sets, "--explain"]) == 0
    assert "integrated by scheme modal: waves by nodal diameter" in (
        capsys.readouterr().out
    )
    assert main(["model", "table2", *sets, "--explain", "--set=casing.damping=2"]) == 0
    out = capsys.readouterr().out
    assert "modes of both bodies, slowly (modes that do not oscillate" in out
    assert "damping 2" in out
