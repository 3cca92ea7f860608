"""What the commands of one scene print and write, and `classify`."""

import argparse
import json
import re
import shutil
import tomllib

import h5py
import made_up
import numpy as np
import pytest
from scipy.linalg import eigh

from hpcwhirl import open_results
from hpcwhirl.analysis.regimes import Thresholds
from hpcwhirl.benchmark import bench
from hpcwhirl.benchmark.bench import OPERATION, OWN, Timing, over_none
from hpcwhirl.cli import bench as bench_command
from hpcwhirl.cli import main, options, tables
from hpcwhirl.cli import run as run_command
from hpcwhirl.cli.model import folded, spans_of
from hpcwhirl.cli.options import print_json
from hpcwhirl.cli.run import FED, SPENT
from hpcwhirl.dynamics.history import LEDGER_TERMS
from hpcwhirl.dynamics.march import March
from hpcwhirl.scene import Scene, apply_settings, named_scene
from hpcwhirl.scene.documents import scene_of_document
from hpcwhirl.scene.quantities import ROW
from hpcwhirl.scene.schemes import NAMES
from hpcwhirl.store.reading.reader import words

SHORT = ("--set", "duration=2e-3", "--set", "time_step=2e-6", "--set", "interval=5e-5")
INPUTS = {"duration": 2e-3, "time_step": 2e-6, "interval": 5e-5}
RUN_NAMES = {
    "outcome", "regime", "whirl", "speed", "nodal_diameter", "gap", "friction",
    "duration", "time_step", "scheme", "steps", "seconds", "microseconds_per_step",
    "contacts", "contact_impulse", "orbit_radius", "centre_peak", "growth_rate",
    "last_contact", "ledger",
}  # fmt: skip
MODEL_NAMES = {
    "modes", "blade_stiffness", "critical_speeds", "time_step_limits", "plan",
}  # fmt: skip
MODE_NAMES = {"body", "family", "nodal_diameter", "frequency_hz", "centre_share",
              "clearance_consumption"}  # fmt: skip


KEPT = {"centre", "impulse", "tips", "casing", "blade_impulse"}
OF_A_CALL = {"command", "created", "git"}


def frequencies(found, body, chosen):
    return sorted(
        mode["frequency_hz"]
        for mode in found["modes"]
        if mode["body"] == body and chosen(mode["nodal_diameter"])
    )


def test_json_has_null_where_a_number_is_not_finite(capsys):
    print_json({"a": float("nan"), "b": [np.float64("inf"), np.int64(3)], "c": (1.5,)})
    assert json.loads(capsys.readouterr().out) == {
        "a": None,
        "b": [None, 3],
        "c": [1.5],
    }


def test_model_prints_the_names_that_scripts_rely_on(facts):
    found = facts("model", "--json", "--orders", "3")
    assert found.keys() >= MODEL_NAMES
    assert all(mode.keys() >= MODE_NAMES for mode in found["modes"])
    assert {mode["body"] for mode in found["modes"]} == {"rotor", "casing"}
    assert {"1F", "2F", "suspension"} <= {mode["family"] for mode in found["modes"]}
    assert {row["order"] for row in found["critical_speeds"]} == {1, 2, 3}
    assert all(
        {"nodal_diameter", "speed"} <= r.keys() for r in found["critical_speeds"]
    )
    assert found["time_step_limits"].keys() == {"rotor", "casing"}


def test_model_without_json_is_a_table(capsys):
    assert main(["model", "table1"]) == 0
    out = capsys.readouterr().out
    assert all(word in out for word in ("suspension", "blade stiffness", "limit"))
    assert re.search(r"^coordinates: \d+ of the rotor, \d+ of the casing$", out, re.M)


@pytest.mark.turns
def test_clamping_the_centre_moves_the_one_lobed_rotor_modes_alone(facts):
    free = facts("model", "--json")
    clamped = facts("model", "--json", "--set", "centre=clamped")
    for body, chosen in (("rotor", lambda k: k != 1), ("casing", lambda _: True)):
        still = frequencies(free, body, chosen)
        assert frequencies(clamped, body, chosen) == pytest.approx(still, rel=1e-9)
    moved = frequencies(clamped, "rotor", lambda k: k == 1)
    before = frequencies(free, "rotor", lambda k: k == 1)
    assert len(moved) == len(before) - 1  # the suspension is gone
    # a constraint takes one degree of freedom of each phase: frequencies interlace
    assert all(a <= b <= c for a, b, c in zip(before, moved, before[1:], strict=False))
    assert moved[0] > 1.001 * before[0]
    assert all(
        m["centre_share"] < 1e-9 for m in clamped["modes"] if m["body"] == "rotor"
    )


@pytest.mark.parametrize("traces", ["summary", "orbit"])
def test_run_prints_the_names_that_scripts_rely_on(facts, traces):
    found = facts("run", "--json", "--quiet", *SHORT, "--set", f"traces={traces}")
    assert found.keys() >= RUN_NAMES
    assert (found["steps"], found["duration"], found["time_step"]) == (1000, 2e-3, 2e-6)
    assert found["contacts"] > 0
    ledger = found["ledger"]
    work = ledger["pulse"] + ledger["friction"] + ledger["rotation"]
    spent = ledger["energy"] + ledger["damping"] + ledger["impact"]
    assert work - spent == pytest.approx(-ledger["residual"], abs=1e-12 * spent)
    assert abs(ledger["residual"]) < 1e-9 * spent


def test_a_constant_speed_is_told_once_where_only_the_gap_changes():
    told = "0..0.02 s 200..200 rad/s undecided mixed; 0.02..0.4 s 200..205 rad/s damped"
    lines = run_command.over_speed_told({"words_over_speed": f"{told} none"})
    assert lines[0] == "0 to 0.02 s, 200 rad/s: undecided, whirl mixed"
    assert lines[1] == "0.02 to 0.4 s, 200 to 205 rad/s: damped, whirl none"


def test_the_ledger_balances_as_it_is_printed(capsys):
    """What is fed in and what is taken out is said, and adds up in these words."""
    assert main(["run", "--quiet", *SHORT, "--set", "friction=0.4"]) == 0
    cells = [row.split("│") for row in capsys.readouterr().out.splitlines()]
    told = {c[1].strip(): float(c[2]) for c in cells if "energy" in "".join(c[1:2])}
    fed = [value for name, value in told.items() if name.startswith("energy in: ")]
    spent = [value for name, value in told.items() if name.startswith("energy out: ")]
    assert (len(fed), len(spent)) == (3, 2)
    assert min(*fed, *spent) > 0.0
    kept = told["energy at the end, J"]
    assert sum(fed) == pytest.approx(sum(spent) + kept, rel=1e-5)
    assert abs(told["energy at the end + out - in, J"]) < 1e-9 * kept
    assert {*FED, *SPENT, "energy", "residual"} == {*LEDGER_TERMS}


def test_what_takes_energy_out_though_it_is_of_what_feeds_is_named(facts, capsys):
    found = facts("run", "--json", "--quiet", *SHORT)
    run_command._show(found)
    assert "took energy out" not in capsys.readouterr().out
    found["ledger"]["friction"] = -1e-3
    run_command._show(found)
    assert "friction took energy out: negative entries" in capsys.readouterr().out


@pytest.mark.parametrize("growth", [0.0, 1e-5])
def test_the_growth_of_the_tips_is_shown_where_they_grow(facts, capsys, growth):
    found = facts("run", "--json", "--quiet", *SHORT)
    run_command._show(found | {"tip_growth": growth})
    shown = capsys.readouterr().out
    assert (ROW["tip_growth"].labelled("tip_growth") in shown) == (growth > 0.0)


def test_run_of_an_unstable_case_prints_its_row_and_exits_1(capsys, monkeypatch):
    named = ("unstable", "none", "none")
    monkeypatch.setattr("hpcwhirl.campaign.simulate.name_regime", lambda *_: named)
    assert main(["run", "--json", *SHORT]) == 1
    assert json.loads(capsys.readouterr().out)["outcome"] == "unstable"


@pytest.mark.turns
@pytest.mark.parametrize("traces", ["orbit", "full"])
def test_run_writes_its_scene_traces_with_units_and_figures(facts, tmp_path, traces):
    out, plots = tmp_path / "new/run.h5", tmp_path / "plots"
    wanted = ("--out", str(out), "--plot", str(plots), "--set", f"traces={traces}")
    found = facts("run", "mostly_damped", "--json", *SHORT, *wanted)
    with open_results(out) as data:
        arrays = {name: data[name].squeeze("case").values for name in KEPT & {*data}}
        assert all(data[name].attrs["units"] for name in KEPT & {*data})
        assert data.centre_peak.item() == found["centre_peak"]
        scene = scene_of_document(tomllib.loads(data.attrs["scene"]))
        arrays["time"] = data.time.values
    own = INPUTS | {"traces": traces}
    assert scene == apply_settings(named_scene("mostly_damped"), own)
    assert arrays["time"] == pytest.approx(5e-5 * np.arange(1, 41), rel=1e-12)
    peak = np.hypot(*arrays["centre"].T).max()  # of the evidence, at its own rate
    assert peak == pytest.approx(found["centre_peak"], rel=0.03)
    assert arrays["impulse"][-1] == found["contact_impulse"]
    if traces == "full":
        assert arrays["tips"].shape == (40, 22, 2)
        assert arrays["casing"].shape == (40, 21, 2)
        total = arrays["blade_impulse"].sum(axis=1)
        assert total == pytest.approx(arrays["impulse"], rel=1e-12)
    for name in ("orbit.png", "traces.png"):
        assert (plots / name).read_bytes().startswith(b"\x89PNG")
    assert sorted(p.name for p in tmp_path.iterdir()) == ["new", "plots"]
    assert [p.name for p in out.parent.iterdir()] == ["run.h5"]


@pytest.mark.turns
def test_a_case_at_rest_and_a_case_of_one_step_can_be_drawn(tmp_path):
    for changes in ("force=0", "duration=2e-6"):
        words = ["run", *SHORT, "--set", changes, "--plot", str(tmp_path)]
        assert main(words) == 0


def test_progress_without_a_terminal_is_plain_lines(capsys, monkeypatch):
    monkeypatch.setattr(options, "EVERY", 0.0)
    assert main(["run", *SHORT]) == 0
    err = capsys.readouterr().err
    shares = [int(li.split()[1]) for li in err.splitlines()]
    assert all(li.startswith("integrating: ") for li in err.splitlines())
    assert shares == sorted(shares)
    assert shares[-1] == 100
    assert not {"\r", "\x1b"} & set(err)


def test_quiet_says_nothing_but_the_summary(capsys, monkeypatch):
    monkeypatch.setattr(options, "EVERY", 0.0)
    assert main(["run", "--quiet", *SHORT]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    assert all(word in out for word in ("regime", "1000 steps", "orbit_radius"))
    assert not {"\r", "\x1b"} & set(out)


def exported(place, *words):
    """Return {body: {name: array}} of `export-model`; every array tells its unit."""
    assert main(["export-model", str(place / "model.h5"), *words]) == 0
    with h5py.File(place / "model.h5") as file:
        assert "rotating" in file.attrs["layout"]
        for data in (*file["rotor"].values(), *file["casing"].values()):
            assert data.attrs["units"]
            assert data.attrs["long_name"]
        return {body: {n: d[:] for n, d in file[body].items()} for body in file}


def test_exported_matrices_have_the_frequencies_of_the_modal_table(
    facts, capsys, tmp_path
):
    bodies = exported(tmp_path, "table1", "--set", "modes=66")
    assert capsys.readouterr().out == f"{tmp_path / 'model.h5'}\n"
    found = facts("model", "table1", "--json", "--set", "modes=66")
    for body, arrays in bodies.items():
        squares = eigh(arrays["stiffness"], arrays["mass"], eigvals_only=True)
        for line in frequencies(found, body, lambda _: True):
            square = (2 * np.pi * line) ** 2
            # 1e-9 of a frequency, and what the entries of K round off to
            allowed = 2e-9 * square + np.finfo(float).eps * squares[-1]
            assert np.abs(squares - square).min() < allowed


def test_exported_shapes_and_damping_are_modal(tmp_path):
    engine = Scene().engine
    own = {
        "rotor": (engine.rotor.damping, engine.rotor.suspension_damping),
        "casing": (engine.casing.damping, engine.casing.support_damping),
    }
    for body, arrays in exported(tmp_path, "--set", "modes=22").items():
        shapes, mass = arrays["shapes"], arrays["mass"]
        assert np.abs(shapes.T @ mass @ shapes - np.eye(len(mass))).max() < 1e-9
        modal = shapes.T @ arrays["damping"] @ shapes
        ratio = np.diag(modal) / (2 * arrays["omega"])
        away = np.min([abs(ratio - xi) for xi in own[body]], axis=0)
        assert away.max() < 1e-6
        stiffness = arrays["stiffness"]
        assert np.abs(stiffness - stiffness.T).max() < 1e-12 * np.abs(stiffness).max()


def test_exported_maps_find_the_tips_and_the_centre(tmp_path):
    rotor = exported(tmp_path, "--set", "modes=22")["rotor"]
    for rows, at in (("tip_radial",) * 2, ("tip_tangential",) * 2, ("centre",) * 2):
        assert (rotor["shapes"][rotor[at]] == rotor[f"modal_{rows}"]).all()
    assert len(rotor["tip_radial"]) == 22
    assert len(rotor["centre"]) == 2
    clamped = exported(tmp_path, "--set", "modes=22", "--set", "centre=clamped")
    assert clamped["rotor"]["centre"].size == 0


@pytest.fixture
def copy(finished, tmp_path):
    """Return a copy of a finished campaign's results that may be written."""
    shutil.copy(finished / "results.h5", tmp_path)
    return tmp_path


@pytest.mark.turns
def test_classify_with_default_thresholds_changes_nothing(facts, copy):
    before = open_results(copy)
    assert facts("classify", str(copy), "--json")["changed"] == {}
    assert open_results(copy).identical(before)


@pytest.mark.turns
def test_classify_renames_without_integrating_and_keeps_its_thresholds(
    facts, copy, monkeypatch
):
    before = open_results(copy)
    monkeypatch.setattr(March, "__init__", lambda *_: 1 / 0)
    strict = ("--set", "ledger=0", "--set", "drift=0.25")
    found = facts("classify", str(copy), "--json", "--write", *strict)
    after = open_results(copy)
    assert (found["words"], found["whirls"]) == ({"unstable": 2}, {"none": 2})
    rows = facts("cases", str(copy), "--json")["cases"]
    assert [row["word"] for row in rows] == ["unstable"] * 2
    assert sum(n for told, n in found["changed"].items() if "unstable" in told) == 2
    assert list(words(after["outcome"])) == ["unstable", "unstable"]
    assert (after.attrs["threshold_ledger"], after.attrs["threshold_drift"]) == (
        0,
        0.25,
    )
    assert after.attrs["threshold_rise"] == Thresholds().rise
    names = ["outcome", "regime", "whirl"]
    assert after.drop_vars(names).equals(before.drop_vars(names))
    facts("classify", str(copy), "--json")  # the evidence is whole: all comes back
    assert open_results(copy).identical(before)
    assert [p.name for p in copy.iterdir()] == ["results.h5"]


def test_classify_without_json_says_what_there_is(copy, capsys):
    assert main(["classify", str(copy)]) == 0
    out = capsys.readouterr().out
    assert all(f"{name}: " in out for name in ("cases", "words", "thresholds"))
    assert "changed: none\n" in out
    assert "ledger 1e-06, " in out


@pytest.fixture
def shorter(monkeypatch):
    """Let a benchmark take a fifth of its steps, settled for half as long."""
    monkeypatch.setattr(bench, "STEPS", 1000)
    monkeypatch.setattr(bench, "SETTLE", 0.01)


@pytest.mark.turns
@pytest.mark.usefixtures("shorter")
def test_bench_times_every_scheme_in_flight_and_in_contact(facts):
    found = facts("bench", "--json", "--repeats", "1")
    rows = [(r["scheme"], r["engine"], r["contact"] > 0) for r in found["rows"]]
    engines = [(scheme, "as given") for scheme in NAMES]
    others = ("mistuned", "file, cyclic", "file, mistuned")
    others += ("rotation full", "rotation full, mistuned")
    engines += [("modal", e) for e in others]
    engines.insert(-1, ("exact", "rotation full"))
    engines += [("modal", name) for name in OPERATION]
    assert rows == [(*pair, touches) for pair in engines for touches in (False, True)]
    for row in found["rows"]:
        assert row.keys() >= {"microseconds_per_step", "spread"}
        assert row["microseconds_per_step"] > 0
    over = found["over_none"]
    assert list(over) == ["rotation full", "rotation full, mistuned", *OPERATION]
    for ratios in over.values():  # coupled modes took 150 times as long
        assert max(ratios["in_flight"], ratios["in_contact"]) < 20.0
        assert all(0.0 < share <= 1.0 for share in ratios["shares"])
    assert found["modal_bytes"] > 0


def test_bench_tells_of_each_scheme_that_it_compiles_anew(capsys, monkeypatch):
    monkeypatch.setattr(bench_command, "facts_of", lambda *_: {})
    monkeypatch.setattr(bench_command, "start_of", lambda name: {"scheme": name})
    assert main(["bench", "--compile", "--json"]) == 0
    told, said = capsys.readouterr()
    assert [one["scheme"] for one in json.loads(told)["starts"]] == list(NAMES)
    lines = said.splitlines()
    assert len(lines) == len(NAMES)
    for line, name in zip(lines, NAMES, strict=True):
        assert f"starts of scheme {name}, which is compiled anew" in line


def test_bench_compares_no_features_where_no_blade_touches():
    rows = [Timing("modal", name, 0.0, 0.0, 0.1, 0.0) for name in (OWN, *OPERATION)]
    assert over_none(rows) == {}
    rows += [Timing("modal", OWN, 0.5, 3.0, 0.3, 0.0)]
    assert over_none(rows) == {}  # without, but not with


@pytest.mark.turns
@pytest.mark.parametrize("traces", ["orbit", "summary"])
def test_a_case_s_file_is_the_results_of_a_campaign_of_it(tmp_path, capsys, traces):
    one, folder, empty = tmp_path / "one.h5", tmp_path / "out", tmp_path / "none.toml"
    empty.write_text("[scene]\n")
    asked = ["--preset", "draft", "--set", "duration=2e-3", "--set", f"traces={traces}"]
    assert main(["run", *asked, "--quiet", "--out", str(one)]) == 0
    asked += ["--report", "no", "--map", "no", "--out", str(folder)]
    assert main(["campaign", str(empty), *asked]) == 0
    with h5py.File(one) as mine, h5py.File(folder / "results.h5") as whole:
        assert set(mine) == set(whole)
        for name in set(mine) - {"performance"}:
            assert mine[name][()].tobytes() == whole[name][()].tobytes(), name
            assert dict(mine[name].attrs).keys() == dict(whole[name].attrs).keys()
        assert set(mine["performance"]) <= set(whole["performance"])
        found, wanted = ({n: a for n, a in f.attrs.items() if n not in OF_A_CALL}
                         for f in (mine, whole))  # fmt: skip
        assert found == wanted
        assert found["preset"] == b"draft"
    assert list(tmp_path.glob(".*")) == []
    capsys.readouterr()
    assert main(["cases", str(one), "--json", "--columns", "regime,speed"]) == 0
    (row,) = json.loads(capsys.readouterr().out)["cases"]
    assert row["speed"] == named_scene("table2").speed
    assert main(["map", str(one), "--out", str(tmp_path / "map")]) == 0
    assert (tmp_path / "map/map.png").read_bytes().startswith(b"\x89PNG")
    capsys.readouterr()
    assert main(["report", str(one)]) == 2
    assert "one.h5 must be the directory" in capsys.readouterr().err


@pytest.mark.parametrize("width", [40, 60, 200])
def test_a_narrow_terminal_shortens_no_number_and_no_word(width, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", str(width))
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    text = "Newton's method did not converge in the contact problem of this step"
    columns = {
        "case": np.arange(2),
        "speed": np.array([300.0, 410.125]),
        "word": np.array(["sustained", "damped"], dtype=object),
        "growth_rate": np.array([-0.0115851, 0.109118]),
        "message": np.array(["", text], dtype=object),
    }
    tables.print_table(columns, dict.fromkeys(columns, ""), 2)
    out = re.sub(r"\x1b\[\d*m", "", capsys.readouterr().out)  # without bold
    assert "…" not in out
    wanted = ["300", "410.125", "sustained", "-0.0115851", "0.109118", "growth_rate"]
    assert not set(wanted) - set(out.split())
    assert set(text.split()) <= set(out.split())
    assert (width > 2 * len(text)) == (text in out)


def test_lines_of_a_table_in_a_pipe_are_whole_and_end_with_their_last_character(capsys):
    text = 40 * "a message that no terminal shows in one line "
    columns = {"case": np.arange(2), "message": np.array(["", text.strip()], object)}
    tables.print_table(columns, dict.fromkeys(columns, ""), 2)
    lines = capsys.readouterr().out.splitlines()
    assert [line.rstrip() for line in lines] == lines
    assert [line.split(maxsplit=1) for line in lines] == [
        ["case", "message"], ["0"], ["1", text.strip()]
    ]  # fmt: skip


@pytest.mark.parametrize("rows", [0, 1, 3, 4, 7])
def test_rows_printed_in_parts_are_the_json_of_all(rows, capsys, monkeypatch):
    monkeypatch.setattr(tables, "AT_ONCE", 3)
    gaps = np.where(np.arange(rows) == 1, np.nan, 1e-4)
    texts = np.array(['a "}\n]'] * rows, dtype=object)
    args = argparse.Namespace(csv=False, json=True)
    columns = {"case": np.arange(rows), "gap": gaps, "message": texts}
    assert tables.print_data(args, columns, {"gap": "m"}, "cases", over={"speed": 1})
    each = [
        {"case": i, "gap": None if i == 1 else 1e-4, "message": 'a "}\n]'}
        for i in range(rows)
    ]
    whole = {"over": {"speed": 1}, "units": {"gap": "m"}, "cases": each}
    assert capsys.readouterr().out == json.dumps(whole, indent=2) + "\n"


@pytest.mark.parametrize("command", ["run", "model", "export-model"])
def test_one_case_takes_a_campaign_s_file_and_says_what_it_ignores(
    tmp_path, capsys, command
):
    path, out = tmp_path / "whirl.toml", tmp_path / "model.h5"
    tables = "[sweep]\nspeed = [300.0, 400.0]\n[zip]\n[campaign]\nmax_fails = 3\n"
    scene = "[scene]\nduration = 1e-4\npulse = 5e-5\nfriction = 0.2\n"
    path.write_text(f"{scene}{tables}[[cases]]\n")
    words = {"run": ["--quiet", "--json"], "model": ["--json"]}.get(command, [])
    first = ["--out", str(out)] if command == "export-model" else []
    assert main([command, *first, str(path), *words]) == 0
    told, said = capsys.readouterr()
    assert said.count("\n") == 1
    assert "[sweep], [zip], [[cases]], [campaign] ignored" in said
    if command == "run":
        assert json.loads(told)["friction"] == 0.2
        assert json.loads(told)["speed"] == named_scene("table2").speed
    path.write_text(f"{tables}[swep]\n")
    assert main([command, *first, str(path), *words]) == 2
    assert "unknown table 'swep'; did you mean 'sweep'" in capsys.readouterr().err


def test_every_mode_stands_in_one_row_of_the_folded_table():
    shares = [0.1, 0.0, 0.0, 0.0, 0.8, 0.0, None]
    names = ["1F", "1F", "1F", "1F", "suspension", "2F", "2F"]
    modes = [
        {"body": "rotor", "family": name, "nodal_diameter": k, "frequency_hz": 10.0 + i,
         "centre_share": share, "clearance_consumption": 0.01 * i}
        for i, (name, k, share) in enumerate(zip(names, [1, 4, 2, 0, 1, 3, 2], shares,
                                                 strict=True))
    ]  # fmt: skip
    casing = modes[5] | {"body": "casing", "family": "1F", "centre_share": 0.0,
                         "clearance_consumption": None}  # fmt: skip
    rows = folded([*modes, casing, casing | {"nodal_diameter": 4}])
    assert rows == [
        ("rotor", "1F", "1", "10.000", "0.100", "0.000"),
        ("rotor", "1F", "0, 2, 4", "11.000 to 13.000", "0.000", "0.010 to 0.030"),
        ("rotor", "suspension", "1", "14.000", "0.800", "0.040"),
        ("rotor", "2F", "3", "15.000", "0.000", "0.050"),
        ("rotor", "2F", "2", "16.000", "unknown", "0.060"),
        ("casing", "1F", "3", "15.000", "0.000", ""),
        ("casing", "1F", "4", "15.000", "0.000", ""),
    ]
    assert spans_of([0, 2, 3, 4, 9]) == "0, 2 to 4, 9"


@pytest.mark.turns
def test_classify_counts_cases_by_the_words_that_cases_shows(facts, tmp_path):
    folder = tmp_path / "out"
    speeds = [float(speed) for speed in range(300, 340)]
    made_up.campaign(folder, {"sweep": {"speed": speeds}})
    with h5py.File(folder / "results.h5", "r+") as file:
        file["status"][:3] = [1, 2, 3]  # failed, missing, timeout
    found = facts("classify", str(folder), "--json")
    rows = facts("cases", str(folder), "--json")["cases"]
    told = [row["word"] for row in rows]
    assert found["words"] == {word: told.count(word) for word in set(told)}
    assert (found["cases"], told.count("failed"), told.count("missing")) == (40, 2, 1)
    assert {"overloaded", "unstable", "damped"} <= set(told)
