"""What `model --explain` says of the integration is what integrates the case."""

import pytest

from hpcwhirl.case.resolve import resolve
from hpcwhirl.cli import main
from hpcwhirl.dynamics.integration import MATRICES, MODES, WAYS, integration_of
from hpcwhirl.dynamics.kernels.loop.wave_types import FlowRows, PointRows, SlotRows
from hpcwhirl.dynamics.march import March
from hpcwhirl.scene import apply_settings, named_scene
from hpcwhirl.scene.schemes import marched_by

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


CHANGING = {"acceleration": 100.0}
FULL = {"rotation": "full"}
LOOSE = {"slip": "set-valued"}
BY_SPEED = {"friction_law": "stribeck"}


@pytest.mark.parametrize("slip", [{}, LOOSE], ids=str)
@pytest.mark.parametrize("law", [{}, BY_SPEED], ids=str)
@pytest.mark.parametrize("rotation", [{}, FULL], ids=str)
@pytest.mark.parametrize("sectors", [{}, UNEQUAL], ids=str)
@pytest.mark.parametrize("scheme", ["modal", "general", "paper"])
def test_a_case_costs_what_the_scheme_that_integrates_it_does(
    slip, law, rotation, sectors, scheme
):
    given = CHANGING | slip | law | rotation | sectors | {"scheme": scheme}
    if scheme == "paper" and rotation:
        return  # refused
    scene = apply_settings(named_scene("table2"), SMALL | given)
    by = str(marched_by(scene.value, bool(sectors)))
    waves = found_of(given)["by"] in WAYS.values()
    assert waves == (by == "modal")
    assert (by == "paper") == (scheme == "paper")


LOST = {"rotation": "full", "lost_blade": 2, "amplitude_limit": 2.0}


@pytest.mark.turns
@pytest.mark.parametrize("scheme", ["modal", "general", "paper"])
def test_both_parts_of_a_run_in_which_a_blade_is_lost_are_told(scheme):
    later = LOST | {"lost_blade_time": 1e-3, "scheme": scheme}
    case = resolve(apply_settings(named_scene("table2"), SMALL | later))
    found, march = integration_of(case), March(case)
    before = found["before"]
    assert before["until"] == 1e-3
    assert before["before"] is None is found["until"]
    for own, told in zip(march.schemes, (before, found), strict=True):
        rows = getattr(own.arrays.rotor, "rows", None)
        assert told["by"] == WAYS.get(type(rows), told["by"])
    assert found_of(LOST | {"scheme": scheme})["before"] is None
    assert found_of(later | {"lost_blade_time": 1e3})["before"] is None


def test_modes_beyond_critical_damping_are_named():
    found = found_of({"casing.damping": 1.5})["no_waves"]
    assert found
    for mode in found:
        assert mode["body"] == "casing"
        assert mode["damping_ratio"] >= 1.0
    assert found_of({"casing.damping": 0.9})["no_waves"] == []


@pytest.mark.turns
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
    sets += ["--set=rotation=full", "--set=lost_blade=2", "--set=amplitude_limit=2"]
    assert (
        main(["model", "table2", *sets, "--explain", "--set=lost_blade_time=1e-3"]) == 0
    )
    out = " ".join(capsys.readouterr().out.split())
    assert "until 0.001 s the whole rotor is integrated by scheme modal" in out
    assert "from then on the rotor without the lost blade, by scheme modal: waves" in (
        out
    )
    assert "full, all blades" in out
    assert "full, one lost" in out
