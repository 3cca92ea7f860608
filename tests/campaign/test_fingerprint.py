"""The fingerprint of a user's function: the file that defines it, or a version."""

import functools
import importlib.util
import linecache
import os
import subprocess
import sys

import pytest

from hpcwhirl.campaign.fingerprint import difference, fingerprint
from hpcwhirl.errors import InputError

KINDS = {  # NUMBER: what is changed in the file
    "body": "def f(c): return {'x': NUMBER}\n",
    "constant": "K = NUMBER\ndef f(c): return {'x': K}\n",
    "helper": "def g(): return NUMBER\ndef f(c): return {'x': g()}\n",
    "comment": "def f(c): return {'x': 1}  # NUMBER\n",
    "lambda": "f = lambda c: {'x': NUMBER}\n",
    "cached": "import functools\n@functools.cache\ndef f(c): return {'x': NUMBER}\n",
    "class method": """
class A:
    k = NUMBER
    @classmethod
    def g(cls, c): return {'x': cls.k}
f = A.g
""",
    "decorated": """
def d(g):
    return lambda c: g(c)
@d
def f(c): return {'x': NUMBER}
""",
    "compiled": "from numba import njit\n@njit\ndef f(c): return NUMBER\n",
}


def module_of(path, text):
    """Return a module of this text, as `import` makes it, at this place."""
    path.write_text(text)
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def of(tmp_path, monkeypatch):
    """Return the fingerprint of `f` in a module of a text."""
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    return lambda text: fingerprint(module_of(tmp_path / "own_measure.py", text).f)


@pytest.mark.parametrize("kind", KINDS)
def test_another_source_file_is_another_measure(of, kind):
    one, other = (of(KINDS[kind].replace("NUMBER", n)) for n in ("3", "52"))
    assert difference(one, other) == "its source file"
    assert one == of(KINDS[kind].replace("NUMBER", "3"))


def test_lines_may_end_in_either_way(of):
    text = KINDS["constant"].replace("NUMBER", "3")
    assert of(text) == of(text.replace("\n", "\r\n"))


def test_one_of_two_functions_in_a_file_is_not_the_other(tmp_path):
    both = "def f(c): return {'x': 1}\ndef g(c): return {'x': 2}\n"
    own = module_of(tmp_path / "own_measure.py", both)
    one, other = fingerprint(own.f), fingerprint(own.g)
    assert difference(one, other) == "its place in the source file"


def test_it_is_the_same_in_every_process_and_folder(tmp_path):
    code = (
        "from hpcwhirl.campaign.fingerprint import fingerprint as of\n"
        "import own_measure\nprint(of(own_measure.f))"
    )
    told = set()
    for number in "12":
        place = tmp_path / number
        place.mkdir()
        (place / "own_measure.py").write_text(KINDS["constant"].replace("NUMBER", "3"))
        call = [sys.executable, "-c", code]
        env = {**os.environ, "PYTHONPATH": str(place), "PYTHONHASHSEED": number}
        told.add(subprocess.run(call, env=env, check=True, capture_output=True).stdout)
    assert len(told) == 1


def test_a_cell_of_a_notebook_is_its_source():
    def cell(text, name):
        linecache.cache[name] = (len(text), None, text.splitlines(keepends=True), name)
        space = {"__name__": "__main__"}
        exec(compile(text, name, "exec"), space)
        return fingerprint(space["f"])

    one = cell("def f(c): return {'x': 1}\n", "<ipython-input-1-aa>")
    assert one == cell("def f(c): return {'x': 1}\n", "/tmp/ipykernel_7/8.py")
    assert one != cell("def f(c): return {'x': 2}\n", "<ipython-input-3-aa>")


class Scaled:
    def __init__(self, factor):
        self.factor = factor

    def __call__(self, case):
        return {"x": self.factor * case.speed}


def scaled(factor):
    return lambda case: {"x": factor * case.speed}


@pytest.mark.parametrize(
    ("function", "why"),
    [
        (len, "len is not written in Python"),
        (functools.partial(scaled, 2.0), "arguments of a functools.partial"),
        (eval("lambda c: 1"), "source of <lambda> cannot be read"),
        (Scaled(2.0), "an object of type Scaled stands in no source file"),
        (Scaled(2.0).__call__, "the object of the method Scaled.__call__"),
        (scaled(2.0), "uses factor, a variable of a function around it"),
    ],
)
def test_values_that_stand_in_no_file_need_a_version(function, why):
    with pytest.raises(InputError) as told:
        fingerprint(function)
    assert why in str(told.value)
    assert 'give version="1"' in str(told.value)
    assert fingerprint(function, "1") == fingerprint(function, 1) == "version 1"
    assert difference(fingerprint(function, 1), fingerprint(function, 2))


@pytest.mark.parametrize("version", ["", True, 1.0, "a\x1b[2J", "x" * 999])
def test_a_version_is_a_number_or_a_short_text(version):
    with pytest.raises(InputError, match="version must"):
        fingerprint(len, version)
