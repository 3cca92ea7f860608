"""Scripts: each is where it is quoted, and starts."""

import re
import subprocess
import sys
from pathlib import Path

import pytest
from evidence import planted
from pictures import rooms

ROOT = Path(__file__).parents[2]
KINDS = {".py", ".sh", ".md", ".toml"}
SOURCES = [
    path
    for place in ("README.md", "pyproject.toml", "hpcwhirl", "jobs", "scripts", "tests")
    for path in [ROOT / place, *(ROOT / place).rglob("*")]
    if path.suffix in KINDS
]
QUOTED = r"(?<![0-9a-f]:)\bscripts/[\w/]+\.(?:py|sh|md|toml)\b"
SCRIPTS = sorted((ROOT / "scripts").rglob("*.py"))
ELSEWHERE = {"rotors_of_ross.py"}  # runs in an environment with ROSS
STARTED = [
    path
    for path in SCRIPTS
    if "__main__" in path.read_text() and path.name not in ELSEWHERE
]


def test_every_script_that_is_quoted_is_there():
    found = {
        (source.relative_to(ROOT), quoted)
        for source in SOURCES
        for quoted in re.findall(QUOTED, source.read_text(encoding="utf-8"))
    }
    assert len(found) > 50
    assert not [pair for pair in found if not (ROOT / pair[1]).is_file()]


@pytest.mark.evidence
@pytest.mark.slow
@pytest.mark.parametrize("script", STARTED, ids=lambda p: f"{p.parent.name}/{p.name}")
def test_a_script_says_how_it_is_called(script, tmp_path):
    call = [sys.executable, script, "--help"]
    done = subprocess.run(
        call, cwd=tmp_path, capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.startswith(f"usage: {script.name}")


def test_the_place_of_every_bug_is_in_the_source():
    found = planted.bugs()
    assert len(found) > 50
    assert not [(bug.name, bug.file) for bug in found if not bug.standing]


def test_the_picture_of_the_rooms_is_that_of_their_imports():
    page = rooms.PAGE.read_text("utf-8")
    assert rooms.with_picture(page) == page  # rooms.py --write


def test_a_circle_of_imports_has_no_floors():
    assert rooms.floors_of({"a": {"b"}, "b": set(), "c": {"b"}}) == [["b"], ["a", "c"]]
    with pytest.raises(ValueError, match="a circle of imports in a, b"):
        rooms.floors_of({"a": {"b"}, "b": {"a"}, "c": set()})
