"""An error on what a file says names the file and the line."""

import pytest

from hpcwhirl.cli import main

FILE = """# gap = 3
[scene]
gap = 1e-4
friction = 0.1
[engine.rotor]
young = 114e9
[engine.casing]
young = 70e9
[sweep]
speed = [300, 310]
"""


@pytest.fixture
def told(tmp_path, monkeypatch, capsys):
    """Return a function: change of the file, words -> the error of a dry run."""
    monkeypatch.chdir(tmp_path)

    def tell(old, new, *words):
        (tmp_path / "w.toml").write_text(FILE.replace(old, new, 1))
        command = words or ("campaign", "w.toml", "--dry-run")
        assert main([*command]) == 2
        return capsys.readouterr().err

    return tell


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        ("\ngap = 1e-4", "\ngap = -1", 3),
        ("friction = 0.1", "frction = 0.1", 4),
        ("friction = 0.1", "friction = '3 mm'", 4),
        ("[sweep]", "[swep]", 9),
        ("young = 114e9", "elements = 0", 6),
        ("speed = [300, 310]", "sped = [300, 310]", 10),
        ("young = 114e9", "young = -1", 0),  # in two tables
    ],
)
def test_a_wrong_value_is_told_with_its_line(told, old, new, line):
    for words in ((), ("run", "w.toml", "--quiet")):
        if words and ("swe" in old or "sped" in new):
            continue  # `run` ignores these tables
        error = told(old, new, *words)
        assert error.count("\n") == 1
        assert ("(w.toml, line " in error) == bool(line)
        assert not line or f"(w.toml, line {line})" in error


def test_a_wrong_option_is_not_told_as_the_file_s(told):
    words = ("campaign", "w.toml", "--dry-run", "--set", "gap=-1")
    assert "w.toml" not in told("", "", *words)


def test_a_key_that_is_given_twice_is_named(told):
    error = told("friction = 0.1", "gap = 2")
    assert "a key is given twice (at line 4" in error
    assert error.endswith(": gap\n")
