"""The map of contact along the chord, and the traces of a tip's contact points."""

import numpy as np
import pytest
from stage import N, rotor, written

from hpcwhirl import open_results
from hpcwhirl.cli import main

TOML = """
[scene]
duration = 1e-2
gap = 1e-4
friction = 0.3
force = 6e4
pulse = 6e-4
nodal_diameter = 2
[engine]
file = "{file}"
[engine.rotor]
blades = {blades}
[engine.casing]
discretization = "shell"
width = 0.1
thickness = 0.004
axial_modes = 2
harmonics = 4
support_damping = -1
[solver]
time_step = 5e-6
[output]
traces = "full"
interval = 1e-4
[sweep]
speed = [300]
"""


@pytest.fixture(scope="module")
def stage(tmp_path_factory):
    folder = tmp_path_factory.mktemp("stage")
    file = written(folder / "stage.h5", rotor())
    text = TOML.format(file=file, blades=N)
    (folder / "stage.toml").write_text(text)
    words = ["campaign", str(folder / "stage.toml"), "--out", str(folder / "out")]
    assert main(words) == 0
    return folder / "out"


def test_impulses_of_points_are_those_of_their_blades(stage):
    data = open_results(stage)
    points, blades = data.point_impulse.to_numpy(), data.blade_impulse.to_numpy()
    assert points.shape == (*blades.shape, 3)
    assert blades[0, -1].max() > 0.0
    assert points.sum(axis=-1) == pytest.approx(blades, rel=1e-12)
    assert np.array_equal(data.point_tips.to_numpy()[..., 1, :], data.tips.to_numpy())


def test_the_map_is_drawn(stage, tmp_path, capsys):
    words = ["figures", str(stage), "--kind", "chord", "--out", str(tmp_path)]
    assert main([*words, "--transient"]) == 0, capsys.readouterr()
    assert (tmp_path / "chord-0000.png").stat().st_size > 10000


def test_it_needs_several_points(finished, tmp_path, capsys):
    assert main(["figures", str(finished), "--kind", "chord", "--out", str(tmp_path)])
    assert "chord: needs " in "".join(capsys.readouterr())
