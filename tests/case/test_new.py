"""A fan from a few numbers: what is written runs, and is as large as it says."""

import dataclasses
import errno
import functools
import json
import math
import os
import re
import tempfile
from pathlib import Path

import numpy as np
import pytest

import hpcwhirl
from hpcwhirl.analysis.response import steady_at
from hpcwhirl.campaign.plan.design import load_design
from hpcwhirl.case.fan import FANS, Fan, scene_of_fan
from hpcwhirl.case.resolve import resolve
from hpcwhirl.cli import main
from hpcwhirl.cli.new_study import studies
from hpcwhirl.cli.options import scene_of, tell_remarks
from hpcwhirl.errors import InputError
from hpcwhirl.reduction.families import modal_table
from hpcwhirl.reduction.growth import stability
from hpcwhirl.scene import apply_settings, flatten, load_document
from hpcwhirl.scene.kept_tables import kept_rows

pytestmark = pytest.mark.turns

RPM = 30 / math.pi  # rpm per rad/s
ASKED = ["--blades", "18", "--radius", "0.9", "--material", "titanium",
         "--gap", "0.8mm"]  # fmt: skip


def made(tmp_path, *words):
    path = tmp_path / "fan.toml"
    assert main(["new", str(path), *words]) == 0
    return path


def first_family(scene):
    table = modal_table(resolve(scene).model)
    own = [line for line in table if (line.body, line.family) == ("rotor", "1F")]
    return max(own, key=lambda line: line.nodal_diameter).frequency_hz


@pytest.mark.parametrize(
    "fan",
    [
        Fan(blades=18, radius=0.9, gap=0.8e-3),
        Fan(blades=36, radius=0.3, material="steel", lobes=2),
        Fan(blades=22, radius=1.4, material="composite", casing_material="aluminium"),
        Fan(blades=24, radius=0.7, material="nickel", full_speed=500.0, frequency=60.0),
    ],
)
def test_the_model_finds_the_first_family_that_was_asked_for(fan):
    scene, checked = scene_of_fan(fan)
    full = fan.full_speed or 400.0 / fan.radius
    wanted = fan.frequency or full / (4 * math.pi)
    assert first_family(scene) == pytest.approx(wanted, rel=0.003)
    assert checked.family == pytest.approx(wanted, rel=0.003)
    assert FANS[0] <= checked.share <= FANS[1]
    assert checked.family < checked.suspension < 5 * checked.family
    case = resolve(scene)
    case.check()
    assert scene.engine.rotation == "full"
    found = stability(case.model.rotor, fan.blades, full)
    assert not found.bands or found.unstable_from > full


def test_similar_fans_have_similar_modes():
    (one, small), (other, large) = (
        scene_of_fan(Fan(radius=radius)) for radius in (0.4, 1.2)
    )
    assert small.full_speed == pytest.approx(3 * large.full_speed)
    assert small.suspension / small.family == pytest.approx(
        large.suspension / large.family, rel=0.01
    )
    assert other.gap / one.gap == pytest.approx(3.0)
    assert small.reach == pytest.approx(large.reach, rel=0.01)


@pytest.mark.parametrize(("lobes", "last"), [(1, 0.15), (2, 8e-3)])
def test_the_ring_alone_goes_as_far_as_is_told(lobes, last):
    scene, checked = scene_of_fan(Fan(radius=0.9, gap=0.8e-3, lobes=lobes))
    far = checked.reach * scene.gap
    radius = scene.engine.rotor.radius
    heavier = (radius + 1.3 * far) / (radius + scene.gap)  # with room, the ring is
    alone = hpcwhirl.Scene(
        engine=scene.engine, nodal_diameter=lobes, force=scene.force, pulse=scene.pulse,
        gap=1.3 * far, friction=0.0, speed=1.0, duration=last,
        output={"traces": "full", "interval": last / 200},
        solver={"time_step": 5e-6, "plan": "everything"},
    )  # fmt: skip
    moved = hpcwhirl.simulate(alone).traces["casing"][:, lobes, 0]
    assert abs(moved).max() == pytest.approx(far / heavier, rel=0.05)
    assert checked.closing == pytest.approx(scene.gap / checked.kick)
    assert 20 * scene.gap * checked.family == pytest.approx(checked.kick, rel=0.01)


def test_the_file_has_the_scene_that_was_checked(tmp_path):
    path = made(tmp_path, *ASKED)
    scene, _ = scene_of_fan(Fan(blades=18, radius=0.9, gap=0.8e-3))
    design = load_design(path, {})
    gaps = sorted({each["gap"] for each in design.settings})
    assert gaps == pytest.approx([0.4e-3, 0.8e-3, 1.6e-3, 3.2e-3])
    own, told = flatten(design.scene(0)), flatten(scene)
    for name, value in told.items():
        if name.startswith("engine.") and name != "engine.name":
            assert own[name] == value, name
    for name in ("force", "pulse", "duration", "nodal_diameter"):
        assert own[name] == pytest.approx(told[name], rel=1e-3), name
    lines = [n for n in path.read_text().splitlines() if not n.startswith("#")]
    notes = {line.index(" # ") for line in lines if " # " in line}
    assert min(notes) > 25
    assert len(notes) <= 2  # below each other, but where a value is too long
    speeds = {each["speed"] for each in design.settings}
    assert 12 <= len(speeds) <= 30
    assert 0.9 < max(speeds) / (400 / 0.9) <= 1.0


def test_one_case_of_the_file_is_the_fan_at_full_speed_with_its_gap(tmp_path, capsys):
    path = made(tmp_path, *ASKED)
    capsys.readouterr()
    assert main(["model", str(path), "--json", "--orders", "1"]) == 0
    told = json.loads(capsys.readouterr().out)["rotation"]
    assert told["clearance"] == pytest.approx(0.8e-3)
    assert scene_of(str(path), []).speed == pytest.approx(400 / 0.9, rel=1e-3)


def test_it_says_how_large_the_pulse_is_in_gaps(tmp_path, capsys):
    path = made(tmp_path, *ASKED)
    told = capsys.readouterr().out
    assert "1F 35.4 Hz, 0.50 of the full speed's 70.7 Hz (4244 rpm)" in told
    assert "closes the gap of 0.8 mm in 1.41 ms" in told
    assert "gaps far" in told
    assert "gaps far" in path.read_text()


@pytest.mark.slow
def test_the_file_goes_through_model_and_campaign(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    path = made(tmp_path, *ASKED)
    assert main(["model", str(path)]) == 0
    assert "suspension" in capsys.readouterr().out
    document = load_document(path)
    document["sweep"] = {"speed": ["1000 rpm", "3000 rpm", "3400 rpm"]}
    document["scene"]["gap"] = "0.8 mm"
    data = hpcwhirl.campaign(document, tmp_path / "out")
    assert (hpcwhirl.words(data.status) == "ok").all()
    assert (data.contacts > 0).all()
    assert (hpcwhirl.words(data.outcome) != "unstable").all()


@pytest.mark.parametrize(
    ("added", "told"),
    [
        ("acceleration = -60\nspeed_to = 100", True),
        ("gap_closure = 1e-4\ngap_time = 0.1", True),
        ('speed_table = "time,speed;0,444.430640727836;2,300"', True),
        ('gap_table = "time,gap;0,0.8e-3;2,0.5e-3"', True),
        ("unbalance = 1e-3", False),
    ],
)
def test_a_study_can_be_added_to_the_file(tmp_path, capsys, added, told):
    path = made(tmp_path, *ASKED)
    text = path.read_text().partition("\n[sweep]")[0]
    path.write_text(text.replace("\n[engine]", f"\n{added}\n[engine]", 1))
    capsys.readouterr()
    scene = scene_of(str(path), [])
    assert scene.end_times[0] == scene.duration
    assert (len(scene.end_times) == 1) == told
    tell_remarks(scene)
    assert capsys.readouterr().err.count("gives way") == told


def test_a_blade_may_be_lost_in_the_run_of_the_file(tmp_path, capsys):
    path = made(tmp_path, *ASKED)
    given = ["lost_blade=3", "lost_blade_time=0.1"]
    scene = scene_of(str(path), given)
    assert scene.solver.until == "decided"
    assert scene.end_times == (scene.duration,)
    assert len(scene_of(str(path), given[:1]).end_times) > 1
    capsys.readouterr()
    tell_remarks(scene)
    assert "or a blade is lost, in time" in capsys.readouterr().err


SMALL = ["--blades", "4", "--radius", "0.5"]


@functools.cache
def study_scene(study):
    """Return the scene in the file of a study of a small fan."""
    with tempfile.TemporaryDirectory() as name:
        return scene_of(str(made(Path(name), *SMALL, "--study", study)), [])


@pytest.mark.slow
@pytest.mark.parametrize("study", studies())
def test_the_file_of_a_study_is_complete_and_runs(tmp_path, monkeypatch, capsys, study):
    monkeypatch.chdir(tmp_path)
    path = made(tmp_path, *SMALL, "--study", study)
    assert capsys.readouterr().err == ""
    text = path.read_text()
    assert "$" not in text
    assert "\n\n\n" not in text
    assert max(map(len, text.splitlines())) <= 130
    assert main(["campaign", str(path), "--dry-run"]) == 0
    assert int(re.search(r"^(\d+) cases", capsys.readouterr().out)[1]) >= 4
    short = ["--set", "duration=0.02", "--quiet"]
    assert main(["run", str(path), *short]) == 0
    assert re.search("^outcome (completed|stopped)", capsys.readouterr().out, re.M)


def test_the_unbalance_of_a_study_touches_where_its_file_says():
    scene = study_scene("unbalance")
    assert steady_at(scene, scene.speed).used == pytest.approx(1.0, rel=0.02)
    assert steady_at(scene, 0.97 * scene.speed).used < 0.98


def test_a_run_up_reaches_its_speed_in_the_time_it_has(tmp_path):
    path = made(tmp_path, *SMALL, "--study", "run-up")
    for scene in load_design(path, {}).scenes:
        time = (scene.speed_to - scene.speed) / scene.acceleration
        assert time == pytest.approx(5 / 6 * scene.duration, rel=0.01)


def test_the_circle_after_the_loss_of_a_study_is_below_its_limit():
    scene = study_scene("blade-off")
    assert 0 < scene.lost_blade_time < scene.duration / 5
    after = apply_settings(scene, {"lost_blade_time": 0.0})
    reach = steady_at(after, scene.speed).reach / scene.engine.rotor.radius
    assert reach < scene.solver.amplitude_limit / 2


def test_the_bearing_of_a_study_is_read_from_the_lines_in_its_file():
    scene = study_scene("bearing")
    rows = kept_rows(scene.engine.rotor.bearing)
    speed, stiff = rows[2][0], rows[2][1]
    assert speed == pytest.approx(scene.speed, rel=1e-3)
    assert stiff == pytest.approx(scene.engine.rotor.centre_stiffness, rel=1e-3)


def test_units_asked_for_are_those_of_the_file_and_of_what_is_printed(tmp_path, capsys):
    words = [*SMALL, "--gap", "0.5 mm"]
    path = made(tmp_path, *words, "--units", "rad/s,inch,psi")
    told = capsys.readouterr().out
    assert "(800 rad/s)" in told
    assert "gap of 0.0197 inch" in told
    text = path.read_text()
    assert '{ start = "100 rad/s", stop = "800 rad/s", step = "50 rad/s" }' in text
    other = tmp_path / "other.toml"
    assert main(["new", str(other), *words]) == 0
    one, two = (flatten(load_design(p, {}).base) for p in (path, other))
    for name, value in one.items():
        if isinstance(value, float):
            assert value == pytest.approx(two[name], rel=1e-3), name


def test_an_unknown_study_is_refused_with_the_nearest(tmp_path, capsys):
    path = tmp_path / "fan.toml"
    assert main(["new", str(path), "--study", "runup"]) == 2
    assert "unknown study 'runup'; did you mean 'run-up'?" in capsys.readouterr().err
    assert not path.exists()


def test_a_sweep_over_run_ups_can_be_added_to_the_file(tmp_path, capsys):
    path = made(tmp_path, *ASKED)
    text = path.read_text().partition("\n[sweep]")[0]
    path.write_text(f"{text}\n[sweep]\nacceleration = [-10, 0, 10]\n")
    design = load_design(path, {})
    assert [len(scene.end_times) == 1 for scene in design.scenes] == [True, False, True]
    ends = np.concatenate(list(design.columns.last_ends()))
    assert ends.tolist() == [scene.end_times[-1] for scene in design.scenes]
    tell_remarks(design.columns)
    assert "gives way to" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--gap", "0.5"], "gap is 0.5 m, the tip radius 0.5 m: lengths are in m"),
        (["--radius", "600"], "the tip radius is 600 m: lengths are in m, or texts"),
        (["--speed", "6000"], "3000 m/s at the tips: 6000 rpm would be 628.3"),
        (ASKED, ""),
    ],
)
def test_sizes_that_no_engine_has_are_told(tmp_path, capsys, words, told):
    made(tmp_path, *words)
    err = capsys.readouterr().err
    assert told in err
    assert told or err == ""


def test_a_file_is_never_overwritten(tmp_path, capsys):
    path = tmp_path / "fan.toml"
    path.write_text("mine")
    assert main(["new", str(path)]) == 2
    assert "exists already" in capsys.readouterr().err
    assert path.read_text() == "mine"


def test_a_full_disk_leaves_no_file_behind(tmp_path, monkeypatch, capsys):
    path = tmp_path / "fan.toml"
    full = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    def refuse(_file):
        raise full

    monkeypatch.setattr(os, "fsync", refuse)
    assert main(["new", str(path)]) == 75
    told = f"hpcwhirl: error: cannot write {path}: No space left on device\n"
    assert capsys.readouterr().err == told
    monkeypatch.undo()
    assert main(["new", str(path)]) == 0  # nothing stands in the way


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--material", "titan"], "unknown material 'titan'; did you mean 'titanium'?"),
        (["--radius", "3 s"], "--radius must be in m"),
        (["--radius", "wide"], "--radius must be a number, with a unit or without"),
        (["--radius", "-1"], "radius must be a number > 0"),
        (["--radius", "0"], "radius must be a number > 0, got 0"),
        (["--gap=-0.1mm"], "gap must be a number > 0, got -0.0001"),
        (["--blades", "3"], "blades must be >= 4, got 3"),
        (["--lobes", "0"], "lobes must be >= 1, got 0"),
        (["--lobes", "90"], "nodal_diameter must be <= 20"),
    ],
)
def test_what_is_no_fan_is_one_clear_line(tmp_path, capsys, words, told):
    path = tmp_path / "fan.toml"
    assert main(["new", str(path), *words]) == 2
    assert told in capsys.readouterr().err
    assert not path.exists()


def test_an_unusual_first_family_is_said(tmp_path, capsys):
    made(tmp_path, "--frequency", "20")
    assert "1F of fans is 0.3 to 1 of full speed" in capsys.readouterr().err


def test_every_number_of_a_fan_may_be_infinite_and_is_refused():
    for name in ("radius", "gap", "full_speed", "frequency"):
        with pytest.raises(InputError):
            scene_of_fan(dataclasses.replace(Fan(), **{name: math.inf}))


@pytest.mark.parametrize(
    ("name", "value"),
    [("radius", 1e300), ("gap", 1e300), ("full_speed", 1e300), ("frequency", 1e300),
     ("radius", 1e-300), ("full_speed", 1e-300), ("frequency", 1e-300)],
)  # fmt: skip
def test_an_extreme_dimension_of_a_fan_is_refused_in_one_line(name, value):
    """Neither a traceback nor a warning of NumPy, which is an error in these tests."""
    with pytest.raises(InputError) as refused:
        scene_of_fan(dataclasses.replace(Fan(), **{name: value}))
    assert "\n" not in str(refused.value)


def test_a_fan_whose_free_motion_grows_below_full_speed_is_told(tmp_path, capsys):
    made(tmp_path, *ASKED, "--frequency", "12Hz")
    (told,) = [line for line in capsys.readouterr().err.splitlines() if "free" in line]
    scene = load_design(tmp_path / "fan.toml", {}).base
    full = scene.speed
    band = stability(resolve(scene).model.rotor, 18, full).bands[0]
    assert band.start < full
    low, high = (f"{speed * RPM:.4g} rpm" for speed in (band.start, full))
    assert f"at {low} to {high}" in told


def test_a_fan_whose_free_motion_decays_is_told_nothing(tmp_path, capsys):
    made(tmp_path, *ASKED)
    assert "free motion" not in capsys.readouterr().err
