"""Remarks on units: of what no shipped engine is, once, as of each case by itself."""

from pathlib import Path

import numpy as np
import pytest

from hpcwhirl.campaign.plan.design import Design, load_design
from hpcwhirl.campaign.simulate import simulate
from hpcwhirl.cli import main
from hpcwhirl.scene import NAMED, Scene, apply_settings, named_scene
from hpcwhirl.scene.remarks import remarks

JOBS = sorted((Path(__file__).parents[2] / "jobs").glob("*.toml"))
WRONG = {
    "percent": ({"friction": 10.0}, "coefficient"),
    "rpm": ({"speed": -4000}, "-4000 rpm would be -418.9"),
    "ms": ({"pulse": 0.63, "duration": 0.5}, "load lasts as long"),
    "turns": ({"pulse": 0.02, "revolutions": 1.0}, "the run 0.0153248 s"),
    "long film": (
        {
            "rotation": "full",
            "film_viscosity": 0.01,
            "film_length": 0.2,
            "film_radius": 0.1,
            "film_clearance": 1e-4,
        },
        "film_length is 0.2 m, more than 0.5 of the film's diameter",
    ),
    "mm of the gap": ({"gap": 0.8}, "gap is 0.8 m, the tip radius 0.5 m: lengths are"),
    "GPa": ({"rotor.young": 210.0}, "rotor.young is 210 Pa: in SI, or as a text, yo"),
    "g/cm^3": ({"casing.density": 7.8}, 'density = "7.8 g/cm^3"'),
    "mm of the radius": ({"rotor.radius": 600.0, "speed": 1.0}, "radius is 600 m"),
    "constant": ({"speed_to": 500.0}, "but acceleration is 0: the speed does not go"),
    "mm": ({"casing.thickness": 41.3}, "lengths are in m"),
}


@pytest.mark.parametrize("job", JOBS, ids=lambda job: job.name)
def test_no_shipped_job_is_remarked_on(job):
    assert remarks(load_design(job, {}).columns) == []


@pytest.mark.parametrize("name", NAMED)
def test_no_named_scene_is_remarked_on(name):
    assert remarks(named_scene(name)) == []


@pytest.mark.parametrize("wrong", WRONG)
def test_each_wrong_unit_is_one_line(wrong):
    settings, told = WRONG[wrong]
    (line,) = remarks(apply_settings(Scene(), settings))
    assert told in line
    assert "case" not in line.removeprefix("casing")


@pytest.mark.parametrize(
    "settings",
    [
        {"friction": 1.0},
        {"gap": 0.025},
        {"speed": 2000.0},  # 1000 m/s at the tips
        {"speed": 4000.0, "rotor.radius": 0.24},
        {"pulse": 0.63, "duration": 0.63001},
        {"pulse": 0.63, "duration": 0.5, "force": 0.0},
        {"pulse": 0.63, "duration": 0.5, "casing.kind": "rigid"},
        {"casing.thickness": 0.5},
        {"casing.thickness": 41.3, "casing.kind": "rigid"},
    ],
)
def test_what_is_at_the_limit_or_counts_for_nothing_is_not_told(settings):
    assert remarks(apply_settings(Scene(), settings)) == []


@pytest.mark.parametrize("lobes", [0, 1, 2])
def test_a_load_is_told_by_how_far_it_moves_the_casing(lobes):
    """Where it is told, the pulse moves the casing by more than two gaps."""
    given = {"nodal_diameter": lobes, "duration": Scene().pulse, "interval": 1e-5}
    free = {"gap": 2e-3, "traces": "full", "plan": "everything"}
    found = simulate(apply_settings(Scene(), given | free))
    assert found.row["contacts"] == 0
    moved = np.hypot(*found.traces["casing"][:, lobes].T).max()
    for gaps, told in ((1.0, False), (6.0, True)):
        scene = apply_settings(Scene(), given | {"gap": moved / gaps})
        found = remarks(scene, load=True)
        assert (
            any("this pulse alone moves the casing" in line for line in found) == told
        )


@pytest.mark.parametrize("seed", range(6))
def test_of_a_campaign_is_told_what_is_of_any_case_by_itself(seed, monkeypatch):
    """Drawn grids, zips and lists, in which few cases are wrong, or all, or none."""
    draw = np.random.default_rng(seed)
    pools = {
        "friction": [0.1, 0.9, 1.5, 20.0],
        "speed": [-9000, 0.0, 300, 1900.0, 2500.0],
        "pulse": [1e-4, 6e-4, 0.5],
        "duration": [5e-4, 0.4, 2.0],
        "casing.thickness": [0.04, 0.4, 0.6, 30.0],
        "rotor.radius": [0.4, 0.5, 2.0],
        "force": [0.0, 75e3],
    }
    names = draw.permutation(list(pools))[: draw.integers(1, 6)].tolist()
    one = {n: draw.permutation(pools[n])[:2].tolist() for n in names}
    how = ("sweep", "zip", "cases")[seed % 3]
    if how == "cases":
        one = [{n: one[n][place] for n in names[place:]} for place in range(2)]
        one = [row for row in one if row]
    design = Design.of({how: one})
    alone = [remarks(scene) for scene in design.scenes]
    monkeypatch.setattr(
        "hpcwhirl.scene.batch_validation.apply_settings", None
    )  # no scene is made
    found = remarks(design.columns)
    kinds = {line.partition(" is ")[0] for lines in alone for line in lines}
    assert sorted(line.partition(" is ")[0] for line in found) == sorted(kinds)
    for line in found:
        words, _, case = line.removesuffix(")").partition(" (as in case ")
        first = next(number for number, lines in enumerate(alone) if words in lines)
        assert first == int(case or 0)


def test_the_largest_numbers_are_told_without_a_warning():
    scene = Scene(speed=1.7e308)
    assert "rpm" in remarks(apply_settings(scene, {"rotor.radius": 1e3}))[0]


@pytest.mark.turns
def test_run_model_and_campaign_tell_on_stderr_and_go_on(tmp_path, capsys):
    wrong = ["--set", "friction=10", "--set", "duration=2e-4"]
    assert main(["run", *wrong, "--set", "time_step=2e-6", "--quiet", "--json"]) == 0
    said = capsys.readouterr()
    assert said.out.startswith("{")
    assert said.err.count("hpcwhirl: friction is 10: ") == 1
    assert said.err.count("hpcwhirl: pulse is 0.00063 s, the run 0.0002 s") == 1
    assert main(["model", "--set", "friction=10", "--json"]) == 0
    assert capsys.readouterr().err.count("hpcwhirl: friction is 10: ") == 1
    path = tmp_path / "c.toml"
    path.write_text("sweep = {friction = [0.1, 2.0, 10.0]}\n")
    assert main(["campaign", str(path), "--out", str(tmp_path / "o"), "--dry-run"]) == 0
    assert capsys.readouterr().err.count("friction is 2: ") == 1


@pytest.mark.parametrize(("command", "mistake"), [
    ("run", 'engine = {file = "no.h5"}'), ("model", 'engine = {file = "no.h5"}'),
    ("campaign", "solver = {time_step = 1e-3}"),
])  # fmt: skip
def test_what_is_refused_is_one_line_without_a_remark(
    tmp_path, capsys, command, mistake
):
    (tmp_path / "no.h5").write_text("text")
    path = tmp_path / "c.toml"
    path.write_text(f"{mistake}\nscene = {{friction = 10.0}}\n")
    out = [] if command == "model" else ["--out", str(tmp_path / "out")]
    assert main([command, str(path), *out]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 1
