"""Figures of tips with several contact points, and the traces of these points."""

import numpy as np
import pytest
from rotor_files import written
from stage import N, rotor, turning

from hpcwhirl import open_results
from hpcwhirl.analysis.rotation import bands_over
from hpcwhirl.case.resolve import resolve
from hpcwhirl.cli import main
from hpcwhirl.errors import InputError
from hpcwhirl.report.figures import sweeps, tips
from hpcwhirl.store.reading.results_file import Results

pytestmark = pytest.mark.turns

TOML = """
[scene]
duration = 1e-2
gap = 1e-4
friction = 0.3
force = 6e4
pulse = 6e-4
nodal_diameter = 2
[engine]
rotation = "{rotation}"
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
speed = {speeds}
"""


def campaign(folder, arrays, **words):
    file = written(folder / "stage.h5", arrays)
    text = TOML.format(file=file, blades=N, **words)
    (folder / "stage.toml").write_text(text)
    words = ["campaign", str(folder / "stage.toml"), "--out", str(folder / "out")]
    assert main([*words, "--map=no", "--report=no"]) == 0
    return folder / "out"


@pytest.fixture(scope="module")
def stage(tmp_path_factory):
    folder = tmp_path_factory.mktemp("stage")
    return campaign(folder, rotor(), rotation="none", speeds=[300])


@pytest.fixture(scope="module")
def turned(tmp_path_factory):
    folder = tmp_path_factory.mktemp("turned")
    arrays = turning(rotor())
    rows = np.random.default_rng(5).normal(size=(N, 2, 6, len(arrays["mass"])))
    arrays |= {"stress": 1e12 * rows, "stress_name": ["root", "fillet"]}
    return campaign(folder, arrays, rotation="full", speeds=[200, 300])


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


def meshes(figure):
    """Return the numbers that the panels of a figure show, in units of the picture."""
    return [axes.collections[0].get_array() for axes in figure.axes[:4]]


def test_the_maps_of_tips_show_their_traces(stage, monkeypatch):
    """Blades by their middle point; the blade that moves most by all its points."""
    cases = Results(stage)
    traces = cases.traces(0)
    size = 1.0 + 9.0 * (np.arange(N) == N - 1)  # the last blade moves most
    traces |= {"point_tips": size[:, None, None] * traces["point_tips"]}
    monkeypatch.setattr(cases, "traces", lambda _: traces)
    points = 1e3 * traces["point_tips"]
    figure = tips.draw_tips(cases, 0, transient=True)
    radial, tangential, *chord = meshes(figure)
    assert np.array_equal(radial, points[:, :, 1, 0].T)
    assert np.array_equal(tangential, points[:, :, 1, 1].T)
    for part, shown in enumerate(chord):
        assert np.array_equal(shown, points[:, N - 1, :, part].T)
    assert f"blade {N - 1}:" in figure.axes[2].get_ylabel()
    assert figure.axes[3].get_xlabel() == "time, s"


def test_a_cell_of_many_samples_keeps_the_largest(monkeypatch):
    values = np.array([[1.0], [-3.0], [2.0], [0.5], [-0.25]])
    monkeypatch.setattr(tips, "MOST_COLUMNS", 3)
    assert tips.extremes(values).ravel().tolist() == [-3.0, 2.0, -0.25]
    edges = tips.edges_of(0.1 * np.arange(1, 6), 0.1)
    assert edges == pytest.approx([0.0, 0.2, 0.4, 0.5])


def test_tips_at_rest_are_told(stage, monkeypatch):
    cases = Results(stage)
    still = {n: 0 * a if n != "time" else a for n, a in cases.traces(0).items()}
    monkeypatch.setattr(cases, "traces", lambda _: still)
    with pytest.raises(InputError, match="no displacement of a tip in the window; --"):
        tips.draw_tips(cases, 0)


def test_own_frequencies_are_drawn_with_rotation(turned):
    cases = Results(turned)
    axes = sweeps.draw_frequency(cases, cases.like(0)).axes[0]
    lines = [line for line in axes.get_lines() if line.get_linestyle() == "--"]
    case, both = resolve(cases.scene(0)), []
    for name in ("1F", "2F"):
        both += [*bands_over(case, lines[0].get_xdata())[name]]
    found = np.array([2 * np.pi * line.get_ydata() for line in lines])
    assert found == pytest.approx(np.array(both))


def test_waves_over_the_speed_are_drawn_with_rotation(turned, tmp_path, capsys):
    kinds = "campbell", "interaction", "stability"
    words = [word for kind in kinds for word in ("--kind", kind)]
    assert main(["figures", str(turned), "--out", str(tmp_path), *words]) == 0
    told = capsys.readouterr().out
    assert {p.stem for p in tmp_path.iterdir()} == {*kinds}, told


def test_the_stress_is_drawn_of_the_blade_that_has_most(turned):
    cases = Results(turned)
    stress = 1e-6 * cases.traces(1)["stress"]
    over, around = tips.draw_stress(cases, 1, transient=True).axes
    most = stress.max(axis=0)
    for line, other in zip(over.get_lines(), around.get_lines(), strict=True):
        name, told = line.get_label().split(": ")
        point = ["root", "fillet"].index(name)
        blade = int(most[:, point].argmax())
        assert told == f"{most[blade, point]:.4g} MPa, blade {blade}"
        assert np.array_equal(line.get_ydata(), stress[:, blade, point])
        assert np.array_equal(other.get_ydata(), most[:, point])
    assert "von Mises stress, MPa" in over.get_ylabel()


def test_results_have_the_stress_of_every_sample(turned, stage):
    data = open_results(turned)
    assert data.stress.dims == ("case", "time", "blade", "place")
    assert data.stress.attrs["units"] == "Pa"
    assert data.stress.shape[1] == data.tips.shape[1]
    assert "stress" not in open_results(stage)


def test_the_figure_of_stress_needs_a_stress_matrix(stage, tmp_path, capsys):
    words = ["--kind", "stress", "--out", str(tmp_path)]
    assert main(["figures", str(stage), *words])
    told = "".join(capsys.readouterr())
    assert "stress: needs an engine.file with rotor/stress\n" in told
