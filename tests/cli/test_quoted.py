"""The commands of README and manual, extracted and run in a prepared folder.

Cheap ones run in the usual tests, where a campaign only plans (`--dry-run`); those that
integrate are `evidence`. test_readme runs those that read results.
"""

import re
import shlex
import shutil
import tomllib
from pathlib import Path

import made_up
import pytest
from test_readme import PATTERN, READING, ROOT, plain, quoted_commands, write_rotor

from hpcwhirl.cli import main

CHEAP = {
    "campaign",
    "compare",
    "import-model",
    "inputs",
    "job",
    "manual",
    "margin",
    "new",
}
LONG = {"doctor", "edge", "export-model", "model", "response", "run", "tradeoff"}
PREPARED = {"DIR": "first", "results": "first", "A": "coarse", "B": "fine",
            "FILE": "whirl.toml", "/scratch/me": "."}  # fmt: skip
REFUSED = "sensitivity", "basins"  # of `first`: its inputs were not drawn
MADE_ELSEWHERE = (  # what pages or earlier commands make in minutes or hours
    "starts", "strength", "hysteresis", "safe_pulse", "stage/", "wheel.toml", "ENGINE",
    "--check", "--compile", "--extend", "--pilot",
)  # fmt: skip
QUOTED = 160  # commands at least


def words_of(line):
    """Return the words of a quoted command with what is prepared put in."""
    words = shlex.split(line.replace("~/venv", "venv"))[1:]
    if words[0] == "manual":
        return words
    return [words[0], *(PREPARED.get(word, word) for word in words[1:])]


def commands(kinds):
    """Return the words of the quoted commands of some kinds that can be run here."""
    whole = [
        line
        for line in quoted_commands()
        if not set(PATTERN) & set(line.replace('"[branch]"', ""))
        and not any(re.search(rf"(^|\W){re.escape(n)}", line) for n in MADE_ELSEWHERE)
    ]
    found = [words_of(line) for line in whole]
    alone = {"inputs", "manual", "doctor", "model", "run"}
    return [
        words
        for words in found
        if words[0] in kinds and (words[1:] or words[0] in alone)
    ]


@pytest.fixture(scope="module")
def prepared(tmp_path_factory):
    """Return a folder with what the pages have a reader make before."""
    place = tmp_path_factory.mktemp("quoted")
    text = next(text for text in plain("toml") if "# whirl.toml" in text)
    for name in ("whirl.toml", "my.toml"):
        (place / name).write_text(text)
    for name in ("first", "coarse", "fine"):
        made_up.campaign(place / name, tomllib.loads(text), samples=400)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(place)
        for words in commands({"new"}):
            assert main(words) == 0
        write_rotor()
    (place / "jobs").symlink_to(ROOT / "jobs")
    return place


@pytest.fixture
def here(prepared, tmp_path, monkeypatch):
    shutil.copytree(prepared, tmp_path / "here", symlinks=True)
    monkeypatch.chdir(tmp_path / "here")
    return Path()


def test_the_commands_are_found():
    assert len(quoted_commands()) >= QUOTED
    run = commands({*CHEAP, *LONG, *REFUSED})
    assert len(run) >= 75


@pytest.mark.slow
@pytest.mark.parametrize("words", commands(CHEAP), ids=" ".join)
def test_a_quoted_command_does_what_it_says(words, here, capsys):
    if words[0] == "new":
        (here / words[1]).unlink()
    if words[0] == "campaign":
        out = words.index("--out") + 1 if "--out" in words else 0
        if out:
            words = [*words[:out], f"{words[out]}-new", *words[out + 1 :]]
        words = [*dict.fromkeys([*words, "--dry-run"])]
    assert main(words) == 0
    assert capsys.readouterr().out


@pytest.mark.slow
@pytest.mark.parametrize("words", commands(REFUSED), ids=" ".join)
def test_what_the_first_campaign_cannot_answer_is_told_in_a_line(words, here, capsys):
    assert here.exists()
    assert main(words) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("hpcwhirl: error: ")


@pytest.mark.evidence
@pytest.mark.parametrize("words", commands(LONG), ids=" ".join)
def test_a_quoted_command_that_integrates_does_it(words, here, capsys):
    assert here.exists()
    assert main(words) == 0
    assert capsys.readouterr().out


def test_no_kind_of_command_is_left_out():
    kinds = {shlex.split(line)[1] for line in quoted_commands() if "…" not in line}
    made = {"bench", "branches", "gather", "classify"}
    assert kinds <= {*CHEAP, *LONG, *REFUSED, *READING, *made}
