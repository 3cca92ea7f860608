"""Pages of the site made from the program name everything, and only what exists."""

import re
import shlex

import pytest
from docs import reference

import hpcwhirl
from hpcwhirl.cli import COMMANDS
from hpcwhirl.scene.catalogue import catalogue

HERE = reference.TOP / "reference"


@pytest.fixture(scope="module")
def pages():
    return dict([*reference.inputs(), reference.commands(), reference.python(),
                 reference.gallery()])  # fmt: skip


def test_each_input_command_name_and_job_has_its_place(pages):
    for name, fact in catalogue().items():
        assert f"(inputs/{name}.md)" in pages["inputs"]
        assert fact.name in pages[f"inputs/{name}"]
    assert set(re.findall(r"^## (\S+)$", pages["commands"], re.M)) == set(COMMANDS)
    names = re.findall(r"^::: \S+\.(\w+)$", pages["python"], re.M)
    assert set(names) == {n for n in hpcwhirl.__all__ if not n.startswith("_")}
    jobs = {path.stem for path in (reference.TOP / "jobs").glob("*.toml")}
    assert set(re.findall(r"^## (\S+)$", pages["gallery"], re.M)) == jobs


def test_links_between_made_pages_and_the_manual_lead_somewhere(pages):
    for name, text in pages.items():
        for target in re.findall(r"\]\(([^)#]+)\)", text):
            place = ((HERE / name).parent / target).resolve()
            if place.is_relative_to(HERE):
                made = str(place.relative_to(HERE).with_suffix(""))
                assert made in pages, (name, target)
            else:
                assert place.exists(), (name, target)


def test_every_page_of_the_manual_is_in_the_menu_once():
    menu = (reference.TOP / "scripts/docs/mkdocs.yml").read_text("utf-8")
    listed = re.findall(r"hpcwhirl/manual/(\w+)\.md$", menu, re.M)
    assert sorted(listed) == sorted(path.stem for path in reference.MANUAL.glob("*.md"))


def test_what_follows_a_name_in_a_docstring_is_its_meaning():
    pytest.importorskip("griffe", reason="needs the extra docs")
    from docs.docstrings import with_meanings

    text = "Do it.\n\na : first\nb, c : both\n    of them\n\nReturns\n-------\nit"
    head = "Parameters\n----------\n"
    want = f"Do it.\n\n{head}a\n    first\nb, c\n    both\n    of them"
    assert with_meanings(text) == f"{want}\n\nReturns\n-------\nit"
    headed = "Do it.\n\nAttributes\n----------\na : first"
    assert with_meanings(headed).count("----------") == 1


def test_every_picture_has_the_commands_that_draw_it():
    from test_readme import LINKING, parser_of

    top = reference.TOP
    page = (top / "scripts/pictures.md").read_text("utf-8")
    rows = [line for line in page.splitlines() if line.startswith("| [")]
    told = {name for row in rows for name in re.findall(r"\]\(\.\./(\S+)\)", row)}
    held = {f".pictures/{path.name}" for path in (top / ".pictures").glob("*.*")}
    assert told == held
    shown = {name for path in LINKING
             for name in re.findall(r"\]\([./]*(\.pictures/[\w.-]+)\)",
                                    path.read_text("utf-8"))}  # fmt: skip
    assert shown == held
    for row in rows:
        commands = re.findall(r"`([^`]+)`", row)
        assert commands, row
        for words in map(shlex.split, commands):
            if words[0] == "python":
                assert (top / words[1]).is_file()
                continue
            at = words.index("hpcwhirl")
            given = {word for word in words[at + 2 :] if word.startswith("--")}
            assert given <= set(parser_of(words[at + 1])._option_string_actions)
            for name in (w for w in words if w.startswith("jobs/")):
                assert (top / name).is_file()
