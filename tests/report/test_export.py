"""One case for other programs: what is written is what the results hold."""

import csv
import sys
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from scipy.io import loadmat

from hpcwhirl.analysis.wheel_motion import frames_of
from hpcwhirl.cli import main
from hpcwhirl.report.export import ALONG, FRAMES, columns_of
from hpcwhirl.scene.quantities import TRACES
from hpcwhirl.store.reading.results_file import Results, results_of

CAMPAIGN = """
[scene]
duration = 0.02
[output]
traces = "{}"
[engine.rotor]
blades = 6
[engine.casing]
harmonics = 4
[solver]
time_step = 4e-6
modes = 18
[sweep]
speed = [300, 410]
"""


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    return made(tmp_path_factory.mktemp("export"), "full")


def made(folder, traces):
    (folder / "small.toml").write_text(CAMPAIGN.format(traces))
    words = ["campaign", str(folder / "small.toml"), "--out", str(folder / "out")]
    assert main([*words, "--map=no", "--report=no"]) == 0
    return folder / "out"


@pytest.fixture(scope="module")
def results(place):
    with Results(results_of(place)) as found:
        yield found


def export(place, path, case=1):
    assert main(["export", str(place), str(case), str(path)]) == 0
    return path


@pytest.mark.turns
def test_a_table_has_every_number_of_every_trace(place, results, tmp_path):
    with export(place, tmp_path / "new" / "case.csv").open(newline="") as file:
        heads, *rows = csv.reader(file)
    traces = results.traces(1)
    assert len(heads) == len({*heads}) == sum(v[0].size for v in traces.values())
    table = dict(zip(heads, np.array(rows, dtype=float).T, strict=True))
    assert (table["time, s"] == traces["time"]).all()
    assert (table["centre y, m"] == traces["centre"][:, 1]).all()
    assert (table["tips 3 tangential, m"] == traces["tips"][:, 3, 1]).all()
    assert (table["casing 2 cos, m"] == traces["casing"][:, 2, 0]).all()


def test_each_trace_that_may_be_kept_has_columns():
    for name, known in TRACES.items():
        sizes = [
            2 if axis in {"xy", "component", "phase"} else 3 for axis in known.axes
        ]
        traces = {"time": np.arange(4.0), name: np.zeros((4, *sizes))}
        assert len(columns_of(traces)) == 1 + int(np.prod(sizes))


def test_a_file_for_matlab_has_traces_results_and_inputs(place, results, tmp_path):
    found = loadmat(export(place, tmp_path / "case.mat"), simplify_cells=True)
    for name, values in results.traces(1).items():
        assert np.array_equal(found["traces"][name], values)
    assert found["inputs"]["speed"] == 410.0
    assert found["inputs"]["engine_rotor_blades"] == 6
    assert found["results"]["regime"] == results["regime"][1]
    assert found["results"]["orbit_radius"] == results["orbit_radius"][1]
    assert found["units"]["orbit_radius"] == found["units"]["centre"] == "m"


@pytest.mark.turns
def test_tips_and_centre_of_the_wheel_move_as_their_traces(place, results, tmp_path):
    meshio = pytest.importorskip("meshio", reason="needs the extra vtk")
    path = export(place, tmp_path / "wheel.pvd")
    listed = ET.parse(path).getroot().findall("Collection/DataSet")
    row = {name: results[name][1] for name in ("regime", "tip_growth")}
    frames = frames_of(results.scene(1), row, results.traces(1), FRAMES)
    times = [float(one.get("timestep")) for one in listed]
    assert times == pytest.approx(frames.time, rel=1e-8)
    radius = results.scene(1).engine.rotor.radius
    for n in (0, len(listed) - 1):
        mesh = meshio.read(tmp_path / listed[n].get("file"))
        assert len(mesh.cells_dict["line"]) == 6 * (ALONG - 1) + 180
        plane = [1.0, 1j, 0.0]
        moved = (mesh.point_data["displacement"] @ plane)[: 6 * ALONG].reshape(6, -1)
        at = (mesh.points @ plane)[: 6 * ALONG].reshape(6, -1)
        turned = np.exp(1j * (frames.angle[n] + 2 * np.pi * np.arange(6) / 6))
        assert at[:, -1] == pytest.approx(radius * turned)
        tips = moved[:, -1] / turned
        assert tips.real == pytest.approx(frames.tips[n, :, 0], abs=1e-15)
        assert tips.imag == pytest.approx(frames.tips[n, :, 1], abs=1e-15)
        centre = frames.centre[n] @ [1.0, 1j]
        assert moved[:, 0] == pytest.approx(np.full(6, centre), abs=1e-15)
        force = mesh.point_data["force"][ALONG - 1 : 6 * ALONG : ALONG]
        assert force == pytest.approx(frames.force[n])


@pytest.mark.parametrize(
    ("words", "told"),
    [(["1", "case.txt"], "FILE must end in .csv, .mat, .pvd, got 'case.txt'"),
     (["2", "case.csv"], "CASE must be >= 0 and <= 1, got 2")],
)  # fmt: skip
def test_what_cannot_be_exported_is_one_line(place, words, told, capsys):
    assert main(["export", str(place), *words]) == 2
    assert capsys.readouterr().err == f"hpcwhirl: error: {told}\n"


@pytest.mark.turns
def test_a_wheel_needs_full_traces_and_meshio(place, tmp_path, monkeypatch, capsys):
    pytest.importorskip("meshio", reason="needs the extra vtk")
    orbit = made(tmp_path, "orbit")
    assert main(["export", str(orbit), "0", str(tmp_path / "a.pvd")]) == 2
    assert "needs traces = full" in capsys.readouterr().err
    monkeypatch.setitem(sys.modules, "meshio", None)
    assert main(["export", str(place), "0", str(tmp_path / "b.pvd")]) == 2
    assert "pip install 'hpcwhirl[vtk]'" in capsys.readouterr().err
