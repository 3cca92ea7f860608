"""The README and the manual: short, and what they quote works."""

import argparse
import importlib
import re
import shlex
import shutil
import tomllib
from pathlib import Path

import made_up
import pytest

from hpcwhirl.analysis.expression import parse
from hpcwhirl.campaign.plan.design import load_design
from hpcwhirl.cli import COMMANDS, main
from hpcwhirl.cli.classify import thresholds_of
from hpcwhirl.cli.options import parsed
from hpcwhirl.report.figures.kinds import KINDS
from hpcwhirl.scene import Scene, apply_settings

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted(ROOT.glob("hpcwhirl/manual/*.md"))]
TEXTS = {path.name: path.read_text(encoding="utf-8") for path in PAGES}
LINKING = [*PAGES, *(ROOT / "scripts" / f"{name}.md"
                     for name in ("measurements", "paper", "pictures"))]  # fmt: skip
LONGEST = 160  # lines of the README
SHORT, LONG = 40, 130  # lines of a page
WIDEST = 100  # characters of what a page is for


def blocks(kind):
    """Return (page, text) of each fenced block of a kind."""
    fenced = r"^```(\w*)\n(.*?)^```$"
    return [
        pytest.param(text, id=f"{page}-{number}")
        for page, whole in TEXTS.items()
        for number, (name, text) in enumerate(
            re.findall(fenced, whole, re.MULTILINE | re.DOTALL)
        )
        if name == kind
    ]


def plain(kind):
    return [block.values[0] for block in blocks(kind)]


def quoted_commands():
    """Return each command line that is quoted, in a block or between backticks."""
    shell = "\n".join(plain("")).replace("\\\n", " ").splitlines()
    whole = "\n".join(TEXTS.values())
    prose = re.sub(r"^```.*?^```", "", whole, flags=re.MULTILINE | re.DOTALL)
    told = re.findall(r"`([^`]+)`", prose)
    lines = [re.split(r" #| > |; ", " ".join(line.split()))[0] for line in shell + told]
    found = (re.search(r"\bhpcwhirl [a-z].*", line) for line in lines)
    return sorted({match[0] for match in found if match})


def parser_of(command):
    parser = argparse.ArgumentParser(prog=command, exit_on_error=False)
    module = importlib.import_module(f"hpcwhirl.cli.{command.replace('-', '_')}")
    module.arguments(parser)
    return parser


PATTERN = "[…"  # signs of a line that is no command as it stands
PLACEHOLDERS = {"speed=OMEGA": "speed=1"}


def check_settings(command, given):
    """Raise an error if a command line names no input, threshold, figure or number."""
    settings = [PLACEHOLDERS.get(text, text) for text in getattr(given, "settings", ())]
    if command == "classify":
        thresholds_of(settings)
    else:
        apply_settings(Scene(), parsed(settings))
    parse(getattr(given, "where", None) or "1")
    for name in getattr(given, "kind", None) or ():
        assert name in KINDS
    if command == "inputs" and given.name:
        assert main(["inputs", given.name]) == 0


def test_the_front_page_is_read_in_five_minutes():
    assert len(TEXTS["README.md"].splitlines()) <= LONGEST


@pytest.mark.parametrize("name", [path.name for path in PAGES[1:]])
def test_a_page_is_read_at_one_sitting_and_says_what_it_is_for(name):
    lines = TEXTS[name].splitlines()
    assert SHORT <= len(lines) <= LONG
    assert lines[0].startswith("# ")
    assert 0 < len(lines[2]) <= WIDEST
    assert lines[1] == lines[3] == ""


def test_every_page_is_reached_from_the_front_page():
    links = set(re.findall(r"hpcwhirl/manual/(\w+\.md)", TEXTS["README.md"]))
    assert links == {path.name for path in PAGES[1:]}


def test_the_command_shows_what_the_page_says(capsys):
    for name in sorted(TEXTS.keys() - {"README.md"}):
        assert main(["manual", name.removesuffix(".md")]) == 0
        assert capsys.readouterr().out == TEXTS[name]


def test_a_list_of_the_pages_tells_what_each_is_for(capsys):
    assert main(["manual"]) == 0
    told = capsys.readouterr().out
    for name in TEXTS.keys() - {"README.md"}:
        purpose = TEXTS[name].splitlines()[2]
        assert re.search(rf"^ +{name[:-3]} +{re.escape(purpose)}$", told, re.MULTILINE)


def test_a_misspelt_page_is_answered_by_the_nearest(capsys):
    assert main(["manual", "regime"]) == 2
    assert "did you mean 'regimes'?" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("word", "told"),
    [
        ("bearing", "see shaft or supports"),
        ("Squeeze", "see supports"),
        ("gap", "see operation"),
    ],
)
def test_a_word_of_a_page_leads_to_it(word, told, capsys):
    assert main(["manual", word]) == 2
    assert f"unknown page of the manual '{word}'; {told}" in capsys.readouterr().err


def test_a_terminal_is_shown_headings_without_their_marks(capsys, monkeypatch):
    monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    assert main(["manual", "trust"]) == 0
    told = capsys.readouterr().out
    assert "How far to trust it" in told
    assert "# " not in told


@pytest.mark.parametrize("line", quoted_commands())
def test_a_command_quoted_exists_with_its_options(line):
    words = shlex.split(line.replace("[", "").replace("]", ""))
    assert words[1] in COMMANDS
    if words[1] == "manual" and words[2:]:
        assert f"{words[2].lower()}.md" in {*TEXTS, "page.md"}
    given = {word for word in words[2:] if re.fullmatch(r"--[a-z][a-z-]*", word)}
    parser = parser_of(words[1])
    assert given <= set(parser._option_string_actions)
    if words[2:] and "--help" not in words and not set(PATTERN) & set(line):
        check_settings(words[1], parser.parse_args(words[2:]))


READING = ("cases", "classify", "export", "figures", "map", "report", "status")
OF_OTHERS = (  # of results with inputs that the first campaign lacks
    "hpcwhirl map DIR --x friction --y gap",
    "hpcwhirl cases DIR --where 'radius_error >= 0.09'",
)


def commands_on_results(known=True):
    """Return quoted commands that read the results of the first campaign.

    known : whether that campaign has what they ask for
    """
    found = [shlex.split(line) for line in quoted_commands() if "[" not in line]
    return [
        [word.replace("DIR", "first") for word in words[1:]]
        for words in found
        if words[1] in READING and words[2:3] in (["first"], ["DIR"])
        and "--live" not in words  # tests/report/test_live.py
        and (shlex.join(words) not in OF_OTHERS) == known
    ]  # fmt: skip


@pytest.fixture(scope="module")
def first(tmp_path_factory):
    """Return where the campaign of the front page lies, with made-up results."""
    place = tmp_path_factory.mktemp("read")
    text = next(text for text in plain("toml") if "# whirl.toml" in text)
    made_up.campaign(place / "first", tomllib.loads(text), samples=400)
    return place


@pytest.mark.slow
@pytest.mark.parametrize("words", commands_on_results(), ids=" ".join)
def test_a_command_quoted_on_results_does_it(words, first, tmp_path, monkeypatch):
    shutil.copytree(first / "first", tmp_path / "first")
    monkeypatch.chdir(tmp_path)
    words = [word for word in words if word != "--watch"]
    assert main(words) == 0


@pytest.mark.parametrize("words", commands_on_results(known=False), ids=" ".join)
def test_what_the_results_lack_is_told_in_a_line(words, first, monkeypatch, capsys):
    monkeypatch.chdir(first)
    assert main(words) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("hpcwhirl: error: ")
    assert {"gap", "radius_error"} & set(re.findall(r"\w+", line))


def test_what_the_first_campaign_lacks_is_quoted():
    assert len(commands_on_results(known=False)) == len(OF_OTHERS)


def test_every_command_is_told():
    whole = "\n".join(TEXTS.values())
    told = re.findall(r"\bhpcwhirl ([a-z-]+)|`([a-z-]+)`", whole)
    told = {word for pair in told for word in pair}
    assert COMMANDS.keys() <= told


def write_rotor():
    """Write rotor.h5 here, as the page of wheels does."""
    script = next(text for text in plain("python") if "rotor.h5" in text)
    assert sum(bool(line.strip()) for line in script.splitlines()) <= 12
    exec(compile(script, "wheels.md", "exec"), {})


def write_shaft():
    """Write rotor.toml here, a shaft of four sections, as one of ROSS is read."""
    section = "{ length = 0.25, outer = 0.1 }"
    bearing = "{{ station = {}, kxx = 1e7 }}"
    Path("rotor.toml").write_text(
        f"sections = [{', '.join([section] * 4)}]\n"
        f"bearings = [{', '.join(map(bearing.format, (0, 4)))}]\n"
    )


@pytest.mark.parametrize("text", blocks("toml"))
def test_a_campaign_quoted_is_one(text, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    if "rotor.h5" in text:
        write_rotor()
    if "rotor.toml" in text:
        write_shaft()
    path = tmp_path / "quoted.toml"
    path.write_text(text, encoding="utf-8")
    assert len(load_design(path, {}).scenes) > 1


def test_the_engine_that_is_shown_is_read(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    write_rotor()
    assert main(["model", "--set", "file=rotor.h5"]) == 0
    assert "1F" in capsys.readouterr().out


@pytest.mark.parametrize("page", LINKING, ids=lambda page: page.name)
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
