"""How many formulations of one mechanics there are, counted in the source.

Each number has an upper limit: today's. Who removes a formulation lowers it.
"""

import ast
from functools import cache
from importlib import import_module
from pathlib import Path

import pytest

import hpcwhirl.dynamics
from hpcwhirl.dynamics.kernels.compiled import Verb
from hpcwhirl.dynamics.kernels.kernel_types import Body

HOME = Path(hpcwhirl.dynamics.__file__).parent
FILES = {
    ".".join(path.relative_to(HOME).with_suffix("").parts).removesuffix(".__init__"): (
        path
    )
    for path in HOME.rglob("*.py")
}
ROOM = "hpcwhirl.dynamics."
KERNELS = [name for name in FILES if name.startswith("kernels.")]
LAYERS = {"kernels.compiled", "kernels.compiler", "kernels.plain"}  # how, not what


@cache
def tree(name):
    return ast.parse(FILES[name].read_text())


def nodes(name, kind):
    return [node for node in ast.walk(tree(name)) if isinstance(node, kind)]


@cache
def imports(name):
    """Return the modules of the room that a module imports as it is imported."""
    found = set()
    for node in tree(name).body:
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            found |= {node.module, *(f"{node.module}.{a.name}" for a in node.names)}
    return {n.removeprefix(ROOM) for n in found if n.startswith(ROOM)} & FILES.keys()


@cache
def floor(name):
    """Return the number of modules in the longest chain of imports below a module."""
    return 1 + max((floor(other) for other in imports(name)), default=0)


def loops():
    """Time loops: functions of the kernels that march, as they are written."""
    return {
        f"{name}.{node.name}"
        for name in KERNELS
        for node in nodes(name, ast.FunctionDef)
        if node.name == "march" or node.name.startswith("march_")
    }


def kinds():
    """Kinds for which loops are compiled: types by which verbs choose functions.

    The loop `bodies` has no verbs: `Body` is its only kind.
    """
    modules = [import_module(ROOM + name) for name in KERNELS if name not in LAYERS]
    verbs = [v for m in modules for v in vars(m).values() if isinstance(v, Verb)]
    return {kind.__name__ for verb in verbs for kind in [*verb.kinds, Body]}


def conversions():
    """Conversions of state: classes that read displacements and write a motion."""
    return {
        f"{name}.{node.name}"
        for name in FILES
        for node in nodes(name, ast.ClassDef)
        if {"read", "write"} & {m.name for m in node.body if hasattr(m, "name")}
    }


def accounts():
    """Accounts of the work of contact: functions that enter work of the rotation."""
    return {
        f"{name}.{function.name}"
        for name in KERNELS
        for function in tree(name).body
        if isinstance(function, ast.FunctionDef)
        for node in ast.walk(function)
        if isinstance(node, ast.AugAssign)
        and ast.unparse(node.target) == "ledger[ROTATION]"
    }


def closed_forms():
    """Closed forms of free motion: classes beside the one that chooses among them."""
    return {
        node.name
        for name in FILES
        for node in nodes(name, ast.ClassDef)
        if node.name.startswith("Free")
    }


def set_ups():
    """Set-ups: modules that make the bodies, rows and rotors of the loops."""
    made = kinds()
    return {
        name
        for name in FILES
        if name not in KERNELS
        for call in nodes(name, ast.Call)
        if ast.unparse(call.func) in made
    }


def floors():
    """Floors of the room: modules of the longest chain of imports, one each."""
    name, chain = max(FILES, key=floor), []
    while name:
        chain.append(name)
        name = max(imports(name), key=floor, default="")
    return chain


MOST = {
    loops: 2, kinds: 5, conversions: 2, accounts: 2, closed_forms: 1, set_ups: 1,
    floors: 12,
}  # fmt: skip


@pytest.mark.parametrize("counted", MOST, ids=lambda counted: counted.__name__)
def test_no_formulation_comes_back(counted):
    found = counted()
    assert 0 < len(found) <= MOST[counted], found
