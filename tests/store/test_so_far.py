"""Results of a campaign that has not ended are read from its journals."""

import shutil

import pytest
from test_freshness import again, finished  # noqa: F401 - fixtures

from hpcwhirl.cli import main
from hpcwhirl.store.reading.reader import open_results


@pytest.fixture
def cut(finished, tmp_path):  # noqa: F811
    """Return a campaign without its last record and without results; that record."""
    place = tmp_path / "out"
    shutil.copytree(finished, place)
    for name in ("results.h5", "map.png", "map.svg", "report.html"):
        (place / name).unlink(missing_ok=True)
    (journal,) = (p for p in (place / "journal").iterdir() if p.stat().st_size)
    lines = journal.read_bytes().splitlines(keepends=True)
    journal.write_bytes(b"".join(lines[:-1]))
    return place, journal, lines[-1]


@pytest.mark.turns
@pytest.mark.parametrize("command", ["map", "report", "cases"])
def test_a_command_shows_the_cases_that_have_ended_so_far(command, cut, capsys):
    place, journal, last = cut
    assert main([command, str(place)]) == 0
    assert "3 of 4 cases have ended so far" in capsys.readouterr().err
    with open_results(place) as data:
        assert (data.status == "missing").sum() == 1
    with journal.open("ab") as file:
        file.write(last)
    assert main([command, str(place)]) == 0  # and later those that ended meanwhile
    assert "so far" not in capsys.readouterr().err
    with open_results(place) as data:
        assert (data.status == "ok").all()


@pytest.mark.turns
def test_complete_results_and_other_thresholds_are_left_alone(finished, cut, tmp_path):  # noqa: F811
    whole, (part, journal, last) = tmp_path / "whole", cut
    shutil.copytree(finished, whole)
    assert main(["cases", str(part)]) == 0
    assert main(["classify", str(part), "--set", "drift=0.2", "--write"]) == 0
    with journal.open("ab") as file:
        file.write(last)
    for place in (whole, part):
        before = (place / "results.h5").read_bytes()
        assert main(["cases", str(place)]) == 0
        assert (place / "results.h5").read_bytes() == before


@pytest.mark.turns
def test_other_thresholds_are_shown_before_they_are_written(finished, tmp_path, capsys):  # noqa: F811
    place = tmp_path / "out"
    shutil.copytree(finished, place)
    before = (place / "results.h5").read_bytes()
    words = ["classify", str(place), "--set", "ledger=0"]
    assert main(words) == 0
    told = capsys.readouterr()
    assert "nothing is written: --write does" in told.err
    assert "unstable 4" in told.out
    assert (place / "results.h5").read_bytes() == before
    assert main([*words, "--write"]) == 0
    changed = capsys.readouterr().out
    assert changed.splitlines()[:4] == told.out.splitlines()[:4]
    with open_results(place) as data:
        assert (data.outcome == "unstable").all()
