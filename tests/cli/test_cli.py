"""The command line: exit codes, one line for wrong input, and help."""

import sys
import traceback

import h5py
import numpy as np
import pytest
from launch import ended

import hpcwhirl
from hpcwhirl.campaign.begin import check_steps
from hpcwhirl.campaign.plan.design import design_of
from hpcwhirl.case.resolve import resolve
from hpcwhirl.cli import COMMANDS, main, options
from hpcwhirl.dynamics.march import March
from hpcwhirl.store.hdf5 import FORMAT


@pytest.fixture
def place(tmp_path, monkeypatch, finished):
    """Work in a directory that holds wrong files of every kind."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").write_text("a regular file")
    (tmp_path / "key.toml").write_text("[scene]\nfrictoin = 0.1\n")
    (tmp_path / "gap.toml").write_text("[scene]\ngap = -1e-4\n")
    (tmp_path / "syntax.toml").write_text("[scene\n")
    (tmp_path / "steps.toml").write_text("[sweep]\ntime_step = [1e-5, 2e-5]\n")
    whole = (finished / "results.h5").read_bytes()
    for name in ("torn", "text", "alien", "hollow", "whole"):
        (tmp_path / name).mkdir()
    (tmp_path / "torn/results.h5").write_bytes(whole[: len(whole) // 2])
    (tmp_path / "text/results.h5").write_text("speed,regime\n")
    (tmp_path / "whole/results.h5").write_bytes(whole)
    with h5py.File("alien/results.h5", "w") as file:
        file["speed"] = np.arange(3.0)
    with h5py.File("hollow/results.h5", "w") as file:
        file.attrs["format"] = FORMAT
    return tmp_path


WRONG = [
    ("run key.toml", "[scene] 'frictoin' 'friction'"),
    ("model key.toml", "[scene] 'frictoin' 'friction'"),
    ("campaign key.toml", "[scene] 'frictoin' 'friction'"),
    ("run gap.toml", "gap >= 0 -0.0001"),
    ("run --set gap=-1e-4", "gap >= 0 -0.0001"),
    ("campaign --set friction=-1", "friction >= 0 -1"),
    ("model --set modes=many", "modes whole 'many'"),
    ("run --set modes=many", "modes whole 'many'"),
    ("run --set modes=2.5", "modes whole 2.5"),
    ("model --set modes=683", "modes <= 682 683"),
    ("run --set frictoin=1", "'frictoin' 'friction'"),
    ("run --set speed", "NAME=VALUE 'speed'"),
    ("run missing.toml", "missing.toml No such file"),
    ("campaign missing.toml", "missing.toml No such file"),
    ("run syntax.toml", "syntax.toml TOML line 1"),
    ("campaign syntax.toml", "syntax.toml TOML line 1"),
    ("run table3", "'table3' 'table2'"),
    ("model nonsense", "'nonsense' table1 table2"),
    ("rum", "'rum' 'run'"),
    ("run --sett gap=1", "--sett --help"),
    ("--sett", "COMMAND --help"),
    ("export-model", "FILE.h5 --help"),
    ("run --set twins.count=4", "'twins.count' [twins] file"),
    ("run --set seal=4", "'seal' not modelled"),
    ("model --orders few", "--orders 'few'"),
    ("model --orders 0", "--orders >= 1 0"),
    ("campaign --retry all", "--retry 'all' failed"),
    ("campaign --shard 3/2", "--shard '3/2' I/N"),
    ("campaign --shard 3", "--shard '3' I/N"),
    ("status whole --watch often", "--watch 'often'"),
    ("classify torn", "torn/results.h5 truncated"),
    ("map torn", "torn/results.h5 truncated"),
    ("classify text", "text/results.h5 HDF5"),
    ("map key.toml", "key.toml hpcwhirl campaign key.toml"),
    ("map text", "text/results.h5 HDF5"),
    ("classify alien", "alien/results.h5 format"),
    ("map alien", "alien/results.h5 format"),
    ("classify hollow", "hollow/results.h5 status"),
    ("map hollow", "hollow/results.h5"),
    ("classify whole --set drif=1", "'drif' 'drift'"),
    ("classify whole --set drift=fast", "drift number 'fast'"),
    ("classify whole --set drift=-1", "drift >= 0 '-1'"),
    ("classify missing", "missing/results.h5"),
    ("status missing", "missing campaign.json"),
    ("gather missing", "missing campaign.json"),
    ("map missing", "missing/results.h5: run"),
    ("margin missing", "missing/results.h5: run"),
    ("map whole --out file/maps", "file/maps"),
    ("map whole --y gap", "'gap' speed"),
    ("run --out file/x.h5", "file/x.h5"),
    ("run --out whole", "whole file"),
    ("run --plot file/plots", "file/plots"),
    ("run --plot file", "file directory"),
    ("run --set traces=summary --plot x", "summary --plot full"),
    ("campaign --out file/campaign", "file/campaign"),
    ("campaign --out file", "file directory"),
    ("export-model file/x.h5", "file/x.h5"),
    ("export-model whole", "whole"),
    # of two faults that of the output is told, which is looked for before any work
    ("report missing --out file/x.html", "file/x.html writable"),
    ("report missing --out whole", "whole file"),
    ("import-model missing --out file/x.h5", "file/x.h5 writable"),
    ("edge missing --plot file/x.png", "file/x.png writable"),
    ("margin whole --first --plot file/x.png", "file/x.png writable"),
]


@pytest.mark.turns
@pytest.mark.parametrize(("line", "told"), WRONG, ids=[line for line, _ in WRONG])
def test_wrong_input_is_one_line_and_exit_code_2(place, capsys, line, told):
    before = sorted(place.rglob("*"))
    assert main(line.split()) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith("hpcwhirl: error: ")
    assert err.count("\n") == 1
    assert all(word in err for word in told.split())
    assert sorted(place.rglob("*")) == before


@pytest.mark.slow
@pytest.mark.parametrize(
    "line",
    ["run --set time_step=1e-5", "campaign --set time_step=1e-5", "campaign steps.toml",
     "campaign --set time_step=1e-5 --dry-run"],
)  # fmt: skip
def test_a_step_above_the_limit_is_refused_with_the_limit(place, facts, capsys, line):
    limits = facts("model", "--json")["time_step_limits"]
    assert main(line.split()) == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1
    assert f"{min(limits.values()):.6g} s" in err
    assert "got 1e-05" in err
    assert not (place / "campaign").exists()


def test_one_case_below_the_limit_lets_a_campaign_begin():
    steps, speeds = [1e-5, 2e-5, 1e-6], [300, 410]
    check_steps(design_of({"sweep": {"time_step": steps, "speed": speeds}}))
    gaps = [1e-4, 2e-4, 3e-4]
    check_steps(design_of({"zip": {"time_step": steps, "gap": gaps}}))


def test_a_refused_campaign_builds_one_model_of_cases_that_share_it(monkeypatch):
    built = []
    once = "hpcwhirl.case.resolve.resolve"
    monkeypatch.setattr(once, lambda s: built.append(s) or resolve(s))
    with pytest.raises(ValueError, match="time_step must be <"):
        check_steps(
            design_of({"sweep": {"time_step": [1e-5, 2e-5], "speed": [*range(1, 90)]}})
        )
    assert len(built) == 1


def test_an_error_of_ours_is_exit_code_70_with_its_traceback(capsys, monkeypatch):
    monkeypatch.setattr(options, "scene_of", lambda *_: 1 / 0)
    assert main(["run"]) == 70
    assert "ZeroDivisionError" in capsys.readouterr().err


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_help(capsys, command):
    with pytest.raises(SystemExit) as left:
        main([command, "--help"])
    assert left.value.code == 0
    assert f"usage: hpcwhirl {command}" in capsys.readouterr().out


def test_help_names_every_command_and_version_is_the_package_s(capsys):
    for option in ("--help", "--version"):
        with pytest.raises(SystemExit) as left:
            main([option])
        assert left.value.code == 0
    out = capsys.readouterr().out
    assert out.splitlines()[-1] == hpcwhirl.__version__
    assert all(command in out for command in COMMANDS)


@pytest.mark.turns
@pytest.mark.parametrize("words", [[], ["run"], ["campaign"], ["map"]], ids=str)
def test_help_waits_for_no_heavy_package(words):
    told = sys.executable, "-X", "importtime", "-m", "hpcwhirl"
    done = ended(*told, *words, "--help", check=True)
    loaded = {
        li.rsplit("|")[-1].strip().split(".")[0] for li in done.stderr.split("\n")
    }
    assert "argparse" in loaded
    assert not loaded & {"numba", "scipy", "matplotlib", "h5py", "mpi4py", "xarray"}


def test_few_calls_lead_from_a_command_to_the_march(tmp_path, monkeypatch):
    """The chain that a reader follows from `main` to `March.reach`, both counted."""
    depths, reach = [], March.reach

    def counted(march, *given):
        names = [frame.f_code.co_name for frame, _ in traceback.walk_stack(None)]
        depths.append(names.index("main") + 1)
        reach(march, *given)

    monkeypatch.setattr(March, "reach", counted)
    file, short = tmp_path / "c.toml", ["--set", "time_step=2e-6", "--set"]
    file.write_text("sweep = {speed = [300]}")
    words = [str(file), "--out", str(tmp_path / "out"), "--report", "no", "--map", "no"]
    assert main(["campaign", *words, *short, "duration=2e-3"]) == 0
    assert max(depths) <= 14
    depths.clear()
    assert main(["run", "--quiet", *short, "duration=2e-3"]) == 0
    assert max(depths) <= 6
