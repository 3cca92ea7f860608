"""What docstrings and manual pages name in back-quotes is there."""

import ast
import builtins
import importlib
import importlib.util
import re
from pathlib import Path

import pytest

import hpcwhirl
from hpcwhirl.scene.catalogue import catalogue

PACKAGE = Path(hpcwhirl.__file__).parent
DOTTED = re.compile(r"`([A-Za-z_]+(?:\.[A-Za-z_]+)+)`")
FILES = {"json", "h5", "toml", "html", "md", "png", "svg", "cff", "npz", "log", "csv"}
PLACEHOLDER = re.compile(r"\.[A-Z]+$")  # `state.NAME`: any of them
MODULES = sorted(PACKAGE.rglob("*.py"))


def attribute(module, names):
    """Return whether a module has what the names lead to."""
    held = importlib.import_module(module)
    for name in names:
        fields = {**getattr(held, "__annotations__", {})}
        for base in getattr(held, "__mro__", ()):
            fields |= getattr(base, "__annotations__", {})
        if name in fields and not hasattr(held, name):
            return True  # of an instance
        if not hasattr(held, name):
            return False
        held = getattr(held, name)
    return True


def leads_somewhere(dotted):
    """Return whether a dotted name is that of a module or of something in one."""
    parts = dotted.split(".")
    for n in range(len(parts), 0, -1):
        module = ".".join(parts[:n])
        try:
            found = importlib.util.find_spec(module)
        except ModuleNotFoundError:
            continue
        if found:
            return attribute(module, parts[n:])
    return False


def is_known(dotted, module):
    """Return whether a name is known, as seen from a module of `hpcwhirl`."""
    first, *rest = dotted.split(".")
    if rest[-1] in FILES or PLACEHOLDER.search(dotted) or dotted in catalogue():
        return True
    if hasattr(builtins, first):
        return attribute("builtins", [first, *rest])
    if attribute(module, [first, *rest]):
        return True
    parents = module.split(".")
    places = [".".join(parents[:n]) + "." for n in range(len(parents), 0, -1)] + [""]
    return any(leads_somewhere(place + dotted) for place in places)


def docstrings(path):
    """Yield the docstrings of a module and of all in it."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, (ast.Module, ast.FunctionDef, ast.ClassDef)):
            yield ast.get_docstring(node) or ""


@pytest.mark.parametrize("path", MODULES, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_dotted_names_in_docstrings_lead_somewhere(path):
    parts = path.relative_to(PACKAGE.parent).with_suffix("").parts
    module = ".".join(parts).removesuffix(".__init__")
    named = {name for text in docstrings(path) for name in DOTTED.findall(text)}
    assert not [name for name in sorted(named) if not is_known(name, module)]


def test_a_name_that_leads_nowhere_is_seen():
    assert is_known("store.results.gather", "hpcwhirl.campaign")
    assert not is_known("store.results.no_such_module", "hpcwhirl.campaign")
    assert not is_known("numpy.no_such_function", "hpcwhirl")
