"""The README: short, and what it quotes works."""

import argparse
import importlib
import re
import shlex
from pathlib import Path

import pytest

from hpcwhirl.campaign.plan.design import load_design
from hpcwhirl.cli import COMMANDS, main

ROOT = Path(__file__).parent.parent
TEXT = (ROOT / "README.md").read_text(encoding="utf-8")
PAGES = [
    ROOT / "README.md",
    ROOT / "scripts/measurements.md",
    ROOT / "scripts/paper.md",
]
LONGEST = 320  # lines


def blocks(kind):
    found = re.findall(r"^```(\w*)\n(.*?)^```$", TEXT, re.MULTILINE | re.DOTALL)
    return [text for name, text in found if name == kind]


def quoted_commands():
    """Return each command line that is quoted, in a block or between backticks."""
    shell = "\n".join(blocks("")).replace("\\\n", " ").splitlines()
    prose = re.sub(r"^```.*?^```", "", TEXT, flags=re.MULTILINE | re.DOTALL)
    told = re.findall(r"`([^`]+)`", prose)
    lines = [re.split(r" #| > |; ", " ".join(line.split()))[0] for line in shell + told]
    found = (re.search(r"\bhpcwhirl [a-z].*", line) for line in lines)
    return sorted({match[0] for match in found if match})


def options_of(command):
    parser = argparse.ArgumentParser()
    module = importlib.import_module(f"hpcwhirl.cli.{command.replace('-', '_')}")
    module.arguments(parser)
    return set(parser._option_string_actions)


def test_it_is_read_in_ten_minutes():
    assert len(TEXT.splitlines()) <= LONGEST


@pytest.mark.parametrize("line", quoted_commands())
def test_a_command_quoted_exists_with_its_options(line):
    words = shlex.split(line.replace("[", "").replace("]", ""))
    assert words[1] in COMMANDS
    given = {word for word in words[2:] if re.fullmatch(r"--[a-z][a-z-]*", word)}
    assert given <= options_of(words[1])


def test_every_command_is_told():
    told = re.findall(r"\bhpcwhirl ([a-z-]+)", TEXT) + re.findall(r"`([a-z-]+)`", TEXT)
    assert COMMANDS.keys() <= set(told)


@pytest.mark.parametrize("text", blocks("toml"))
def test_a_campaign_quoted_is_one(text, tmp_path):
    path = tmp_path / "quoted.toml"
    path.write_text(text, encoding="utf-8")
    assert len(load_design(path, {}).scenes) > 1


def test_the_engine_that_is_shown_is_read(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    script = next(text for text in blocks("python") if "rotor.h5" in text)
    assert sum(bool(line.strip()) for line in script.splitlines()) <= 12
    exec(compile(script, "README.md", "exec"), {})
    assert main(["model", "--set", "file=rotor.h5"]) == 0
    assert "1F" in capsys.readouterr().out


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_what_a_page_links_to_is_there(page):
    links = re.findall(r"\]\(([^)\s]+)\)", page.read_text(encoding="utf-8"))
    for link in links:
        file, _, part = link.partition("#")
        place = page.parent / file
        assert place.is_file(), link
        if part:
            heads = re.findall(r"^#+ (.*)$", place.read_text(), re.MULTILINE)
            assert part in {re.sub(r"[^\w -]", "", h.lower()).replace(" ", "-")
                            for h in heads}  # fmt: skip
