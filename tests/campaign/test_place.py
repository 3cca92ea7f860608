"""Where a campaign's results go, and what a dry run says of what lies there."""

import pytest

import hpcwhirl
from hpcwhirl.cli import main

SHORT = """
scene = {duration = 2e-3}
solver = {time_step = 2e-6}
output = {interval = 5e-5}
sweep = {speed = [300, 310]}
"""
BARE = ["--map", "no", "--report", "no"]


@pytest.fixture
def file(tmp_path, monkeypatch):
    """Return the name of a campaign's file in the working directory."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "whirl.toml").write_text(SHORT)
    return "whirl.toml"


@pytest.mark.turns
@pytest.mark.parametrize(
    ("table", "words", "place"),
    [
        ("", [], "whirl"),
        ('campaign = {out = "own"}', [], "own"),
        ('campaign = {out = "own"}', ["--out", "other"], "other"),
    ],
)
def test_results_go_where_the_file_the_table_or_the_option_says(
    file, tmp_path, capsys, table, words, place
):
    (tmp_path / file).write_text(SHORT + table)
    assert main(["campaign", file, *words, *BARE]) == 0
    assert (tmp_path / place / "results.h5").exists()
    assert {path.name for path in tmp_path.iterdir()} == {file, place}
    capsys.readouterr()
    assert main(["job", "slurm", file, *words]) == 0
    assert f"\nout={place}\n" in capsys.readouterr().out


@pytest.mark.turns
def test_results_of_python_go_where_those_of_the_command_go(file, tmp_path):
    assert main(["campaign", file, *BARE]) == 0
    assert hpcwhirl.campaign(file).sizes["case"] == 2
    assert {path.name for path in tmp_path.iterdir()} == {file, "whirl"}


@pytest.mark.turns
def test_a_dry_run_beside_another_campaign_warns_and_goes_on(file, tmp_path, capsys):
    assert main(["campaign", file, *BARE]) == 0
    (tmp_path / file).write_text(SHORT.replace("2e-3", "4e-3"))
    before = {p: p.stat().st_mtime_ns for p in (tmp_path / "whirl").rglob("*")}
    capsys.readouterr()
    assert main(["campaign", file, "--dry-run"]) == 0
    told = capsys.readouterr()
    assert "whirl was begun with duration = 0.002, got 0.004" in told.err
    assert "the forecast is that of a new directory" in told.err
    assert "2 cases over speed" in told.out
    assert "4000 steps" in told.out
    assert before == {p: p.stat().st_mtime_ns for p in (tmp_path / "whirl").rglob("*")}
    assert main(["campaign", file, *BARE]) == 2  # the campaign itself is refused
