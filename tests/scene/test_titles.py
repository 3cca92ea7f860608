"""What an engine is called, which values are one, and what several ranks do once."""

import numpy as np
import pytest
from launch import launch

from hpcwhirl.campaign.plan.design import design_of
from hpcwhirl.cli import command
from hpcwhirl.errors import InputError
from hpcwhirl.report.map.axes import Levels
from hpcwhirl.report.map.data import _check_panels
from hpcwhirl.scene import Scene, apply_settings, digest, title_of


@pytest.mark.parametrize(
    ("name", "file", "title"),
    [
        ("four_motions", "", "four_motions"),
        ("four_motions", "/home/a/rotor.v2.h5", "rotor.v2"),
        ("my fan", "/home/a/rotor.h5", "my fan"),
    ],
)
def test_a_rotor_from_file_is_called_by_its_name_or_its_file(name, file, title):
    assert title_of(name, file) == title


def test_a_zero_has_no_sign():
    plus, minus = (apply_settings(Scene(), {"friction": z}) for z in (0.0, -0.0))
    assert digest(plus) == digest(minus)
    for table in ("sweep", "cases"):
        given = {"friction": [0.0, -0.0]}
        if table == "cases":
            given = [{"friction": value} for value in (0.0, -0.0)]
        with pytest.raises(InputError, match=r"same inputs: friction = 0\.0"):
            design_of({table: given})
    signed, plain = (
        design_of({"sweep": {"rotor.mistuning": [[0.01, zero] * 11]}})
        for zero in (-0.0, 0.0)
    )
    assert signed.digests[0] == plain.digests[0]


def test_a_map_that_hides_cases_says_of_which_inputs():
    hidden = {"friction": Levels.of(np.zeros(2))}
    with pytest.raises(InputError, match="1 case has the same inputs as other cases"):
        _check_panels(hidden, [], ["", ""], asked=False)


def test_ranks_of_a_launcher_do_once_what_is_not_shared(monkeypatch, capsys):
    monkeypatch.setenv("PMI_SIZE", "2")
    monkeypatch.setenv("PMI_RANK", "1")
    assert command.run_command(["inputs", "gap"]) == 0
    assert capsys.readouterr().out == ""
    monkeypatch.setenv("PMI_RANK", "0")
    monkeypatch.setattr(command, "without_mpi", lambda: None)
    assert command.run_command(["inputs", "gap"]) == 0
    assert "clearance" in capsys.readouterr().out


@pytest.mark.mpi
def test_two_ranks_print_once():
    ended = launch("inputs", "gap", ranks=2)
    assert ended.returncode == 0, ended.err
    assert ended.out.count("clearance") == 1
