"""The page of measurements: every claim has a figure, a living command, a commit."""

import re
import shlex
import subprocess
from pathlib import Path

import pytest
from test_readme import parser_of

from hpcwhirl.cli import COMMANDS

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "scripts/measurements.md").read_text("utf-8")
HEAD = ["claim", "figure", "command", "commit"]
AGAIN = ("as before", "at commit")
CODE = re.compile(r"`([^`]+)`")


def claims():
    """Return (claim, figure, command, commit) of each row of the tables of claims."""
    found, inside = [], False
    for line in TEXT.splitlines():
        cells = [c.strip() for c in line.strip("|").split(" | ")]
        cells = [c.strip(" |") for c in cells]
        if line.startswith("|") and cells == HEAD:
            inside = True
        elif not line.startswith("|"):
            inside = False
        elif inside and "---" not in line:
            found.append(cells)
    return found


CLAIMS = claims()
COMMITS = sorted({c for row in CLAIMS for c in CODE.findall(row[-1])})


def git(*words):
    call = ["git", "-C", str(ROOT), *words]
    return subprocess.run(call, capture_output=True, check=False).returncode == 0


def test_every_claim_has_a_figure_a_command_and_a_commit():
    assert len(CLAIMS) > 80
    before = ""
    for row in CLAIMS:
        assert len(row) == 4, row
        claim, _, command, commit = row
        assert claim
        assert CODE.search(commit), row
        assert CODE.search(command) or command.startswith(AGAIN), row
        assert before or not command.startswith("as before"), row
        before = command


def commands():
    told = {CODE.search(row[2])[1] for row in CLAIMS if not row[2].startswith(AGAIN)}
    return sorted(told)


@pytest.mark.parametrize("command", commands())
def test_a_command_is_still_there_with_its_options(command):
    words = shlex.split(command)
    if words[:2] == ["mpirun", "-n"]:
        words = words[3:]
    if words[0] == "hpcwhirl":
        assert words[1] in COMMANDS
        given = {w for w in words[2:] if w.startswith("--")}
        assert given <= set(parser_of(words[1])._option_string_actions)
        return
    program, *rest = (
        words[1:] if words[0] in {"python", "bash", "pytest"} else words[2:]
    )
    if ":" in program:
        assert not git("rev-parse") or git("cat-file", "-e", program)
        return
    assert (ROOT / program).exists()
    if words[0] == "python":
        source = (ROOT / program).read_text("utf-8")
        common = (ROOT / "scripts/common.py").read_text("utf-8")
        for option in (w for w in rest if w.startswith("--")):
            assert f'"{option}"' in source + common, option


def test_the_commits_are_in_the_history():
    if not git("rev-parse"):
        pytest.skip("no clone of git")
    asked = "".join(f"{commit}^{{commit}}\n" for commit in COMMITS)
    call = ["git", "-C", str(ROOT), "cat-file", "--batch-check"]
    told = subprocess.run(call, input=asked, capture_output=True, text=True, check=True)
    kinds = [line.split()[1] for line in told.stdout.splitlines()]
    assert kinds == ["commit"] * len(COMMITS)
