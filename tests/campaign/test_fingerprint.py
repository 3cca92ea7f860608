"""The fingerprint of a user's function: whatever changes its numbers changes it."""

import functools
import importlib.util
import linecache
import os
import sys
import textwrap
import threading
from pathlib import Path

import pytest
from launch import ENVIRONMENT, python

from hpcwhirl.campaign.fingerprint import difference, fingerprint
from hpcwhirl.errors import InputError

# A module each, in which NUMBER is another one. VALUE: read when the module is.
VALUES = {  # the number is a value in reach: seen where the source is the same, too
    "constant": "K = NUMBER\ndef f(c): return {'x': K}",
    "dataclass": """
        from dataclasses import dataclass
        @dataclass
        class A: k: float
        K = A(NUMBER)
        def f(c): return {'x': K.k}""",
    "namespace": """
        from types import SimpleNamespace
        K = SimpleNamespace(k=NUMBER)
        def f(c): return {'x': K.k}""",
    "class constant": """
        class A: k = NUMBER
        def f(c): return {'x': A.k}""",
    "enum": """
        from enum import Enum
        class A(Enum): K = NUMBER
        def f(c): return {'x': A.K.value}""",
    "enum member": """
        from enum import Enum
        class A(Enum): K = NUMBER
        B = A.K
        def f(c): return {'x': B.value}""",
    "path": """
        from pathlib import Path
        K = Path(str(NUMBER))
        def f(c): return {'x': float(K.name)}""",
    "slice": "K = slice(NUMBER)\ndef f(c): return {'x': c.centre[K].max()}",
    "range": "K = range(NUMBER)\ndef f(c): return {'x': len(K)}",
    "pattern": """
        import re
        K = re.compile(str(NUMBER))
        def f(c): return {'x': len(K.pattern)}""",
    "bytearray": "K = bytearray([NUMBER])\ndef f(c): return {'x': K[0]}",
    "deque": """
        from collections import deque
        K = deque([NUMBER])
        def f(c): return {'x': K[0]}""",
    "fraction": """
        from fractions import Fraction
        K = Fraction(NUMBER, 7)
        def f(c): return {'x': float(K)}""",
    "xarray": """
        import xarray
        K = xarray.Dataset({'k': ('a', [NUMBER])})
        def f(c): return {'x': K.k[0]}""",
    "object array": """
        import numpy as np
        K = np.array([NUMBER, None], object)
        def f(c): return {'x': K[0]}""",
    "function attribute": "def f(c): return {'x': f.k}\nf.k = NUMBER",
    "function in a dict": """
        def g(k): return lambda: k
        K = {'g': g(NUMBER)}
        def f(c): return {'x': K['g']()}""",
    "function in a list": """
        def g(k): return lambda: k
        K = [g(NUMBER)]
        def f(c): return {'x': K[0]()}""",
    "a closure's list": """
        def g(k): return lambda: k
        def h(of): return lambda c: {'x': of[0]()}
        f = h([g(NUMBER)])""",
    "function given to partial": """
        from functools import partial
        def g(k): return lambda: k
        def h(of, c): return {'x': of()}
        f = partial(h, g(NUMBER))""",
    "global partial": """
        from functools import partial
        def g(k): return k
        K = partial(g, NUMBER)
        def f(c): return {'x': K()}""",
    "lru_cache": """
        from functools import lru_cache
        K = NUMBER
        @lru_cache
        def g(): return K
        def f(c): return {'x': g()}""",
    "vectorize": """
        import numpy as np
        K = NUMBER
        g = np.vectorize(lambda k: K * k)
        def f(c): return {'x': g(1.0)}""",
    "njit": """
        from numba import njit
        K = NUMBER
        @njit
        def g(): return K
        def f(c): return {'x': g()}""",
    "static method": """
        class A:
            @staticmethod
            def g(k=NUMBER): return k
        def f(c): return {'x': A.g()}""",
    "method called by __call__": """
        class A:
            def g(self, k=NUMBER): return k
            def __call__(self, c): return {'x': self.g()}
        f = A()""",
    "method called by a bound method": """
        class A:
            def g(self, k=NUMBER): return k
            def h(self, c): return {'x': self.g()}
        f = A().h""",
    "method of a subclass": """
        class A:
            def h(self, c): return {'x': self.g()}
        class B(A):
            def g(self, k=NUMBER): return k
        f = B().h""",
    "attribute of the class": """
        class A:
            k = NUMBER
            def __call__(self, c): return {'x': self.k}
        f = A()""",
    "slots": """
        class A:
            __slots__ = ('k',)
            def __init__(self): self.k = NUMBER
            def __call__(self, c): return {'x': self.k}
        f = A()""",
    "attribute of an attribute": """
        class B: pass
        class A:
            def __init__(self):
                self.b = B()
                self.b.k = NUMBER
            def __call__(self, c): return {'x': self.b.k}
        f = A()""",
    "default slice": "def f(c, k=slice(NUMBER)): return {'x': c.centre[k].max()}",
    "cached measure": """
        from functools import lru_cache
        K = NUMBER
        @lru_cache
        def f(c): return {'x': K}""",
    "compiled measure": """
        from numba import njit
        K = NUMBER
        @njit
        def f(c): return {'x': K}""",
    "class method": """
        class A:
            k = NUMBER
            @classmethod
            def g(cls, c): return {'x': cls.k}
        f = A.g""",
    "list": "K = [1, NUMBER]\ndef f(c): return {'x': K[1]}",
    "dict": "K = {'k': NUMBER}\ndef f(c): return {'x': K['k']}",
    "set": "K = {NUMBER}\ndef f(c): return {'x': max(K)}",
    "tuple": "K = (1, (2, NUMBER))\ndef f(c): return {'x': K[1][1]}",
    "array": """
        import numpy as np
        K = np.array([1.0, NUMBER])
        def f(c): return {'x': K[1]}""",
    "named tuple": """
        from collections import namedtuple
        K = namedtuple('K', 'k')(NUMBER)
        def f(c): return {'x': K.k}""",
    "default": "def f(c, k=NUMBER): return {'x': k}",
    "keyword default": "def f(c, *, k=NUMBER): return {'x': k}",
    "closure": """
        def g(k): return lambda c: {'x': k}
        f = g(NUMBER)""",
    "partial number": """
        from functools import partial
        def g(k, c): return {'x': k}
        f = partial(g, NUMBER)""",
    "partial keyword": """
        from functools import partial
        def g(c, k): return {'x': k}
        f = partial(g, k=NUMBER)""",
    "instance attribute": """
        class A:
            def __init__(self, k): self.k = k
            def __call__(self, c): return {'x': self.k}
        f = A(NUMBER)""",
    "bound method's object": """
        class A:
            def __init__(self, k): self.k = k
            def g(self, c): return {'x': self.k}
        f = A(NUMBER).g""",
    "nested function": """
        K = NUMBER
        def f(c):
            def g(): return K
            return {'x': g()}""",
    "comprehension": "K = NUMBER\ndef f(c): return {'x': sum([K for _ in (1,)])}",
    "generator": "K = NUMBER\ndef f(c): return {'x': sum(K for _ in (1,))}",
    "decimal": """
        from decimal import Decimal
        K = Decimal(NUMBER)
        def f(c): return {'x': float(K)}""",
    "ordered dict": """
        from collections import OrderedDict
        K = OrderedDict(k=NUMBER)
        def f(c): return {'x': K['k']}""",
}
SOURCES = {  # the number is in the code, or found by its name as the function runs
    "body": "def f(c): return {'x': NUMBER}",
    "helper": "def g(): return NUMBER\ndef f(c): return {'x': g()}",
    "helper's helper": """
        def h(): return NUMBER
        def g(): return h()
        def f(c): return {'x': g()}""",
    "lambda": "f = lambda c: {'x': NUMBER}",
    "by globals()": "K = NUMBER\ndef f(c): return {'x': globals()['K']}",
    "class body": """
        K = NUMBER
        def f(c):
            class A: k = K
            return {'x': A.k}""",
    "wraps": """
        from functools import wraps
        def d(g):
            @wraps(g)
            def h(c): return g(c)
            return h
        @d
        def f(c): return {'x': NUMBER}""",
    "plain decorator": """
        def d(g): return lambda c: g(c)
        @d
        def f(c): return {'x': NUMBER}""",
    "decorator of another module": """
        import contextlib
        @contextlib.ContextDecorator.__call__.__get__(contextlib.nullcontext())
        def f(c): return {'x': NUMBER}""",
    "cached body": """
        from functools import lru_cache
        @lru_cache
        def f(c): return {'x': NUMBER}""",
    "compiled body": """
        from numba import njit
        @njit
        def f(c): return {'x': NUMBER}""",
    "static body": """
        class A:
            @staticmethod
            def f(c): return {'x': NUMBER}
        f = A.f""",
    "imported in the body": """
        def f(c):
            from math import pi
            return {'x': NUMBER * pi}""",
    "property": """
        class A:
            @property
            def k(self): return NUMBER
            def __call__(self, c): return {'x': self.k}
        f = A()""",
}
EVERY = VALUES | SOURCES


def module_of(path, text):
    """Return a module of this text, as `import` makes it, at this place."""
    path.write_text(textwrap.dedent(text).lstrip())
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[path.stem] = module  # as dataclasses want it
    spec.loader.exec_module(module)
    return module


@pytest.fixture
def of(tmp_path, monkeypatch):
    """Return the fingerprint of `f` in a module of a text."""
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    path = tmp_path / "own_measure.py"
    monkeypatch.delitem(sys.modules, path.stem, raising=False)

    def found(text, **numbers):
        for name, number in numbers.items():
            text = text.replace(name, number)
        return fingerprint(module_of(path, text).f)

    yield found
    sys.modules.pop(path.stem, None)


@pytest.mark.parametrize("kind", EVERY)
def test_another_number_in_the_source_is_another_measure(of, kind):
    assert len(EVERY) == 67
    one, other = (of(EVERY[kind], NUMBER=number) for number in "35")
    assert difference(one, other) == "its source file"
    assert not difference(one, of(EVERY[kind], NUMBER="3"))


@pytest.mark.parametrize("kind", VALUES)
def test_another_value_in_reach_is_another_measure(of, monkeypatch, kind):
    """As on two ranks, which read a variable or draw a number of their own."""

    def read(number):
        monkeypatch.setenv("NUMBER_HERE", number)
        text = textwrap.dedent(VALUES[kind])
        return of("import os\n" + text, NUMBER="int(os.environ['NUMBER_HERE'])")

    one, other = read("3"), read("5")
    assert difference(one, other) == "its code, or a value that it uses,"
    assert not difference(one, read("3"))


def test_one_of_two_functions_in_a_file_is_not_the_other(of):
    both = "if CHOICE:\n def f(c): return {'x': 1}\nelse:\n def f(c): return {'x': 2}"
    both = "import os\n" + both.replace("CHOICE", "os.environ.get('CHOICE_HERE')")
    one = of(both)
    os.environ["CHOICE_HERE"] = "yes"
    try:
        assert difference(one, of(both)).startswith("its code")
    finally:
        del os.environ["CHOICE_HERE"]


def test_a_module_of_ones_own_counts_by_its_file(of, tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    text = "import own_helper\ndef f(c): return {'x': own_helper.K}"
    module_of(tmp_path / "own_helper.py", "K = 3")
    one = of(text)
    module_of(tmp_path / "own_helper.py", "K = 5")
    assert difference(one, of(text)) == "its source file"
    del sys.modules["own_helper"]


SCRIPT = """
import sys
sys.path[:0] = {folders!r}
from pathlib import Path
from test_fingerprint import EVERY, module_of
from hpcwhirl.campaign.fingerprint import fingerprint
for kind, text in EVERY.items():
    own = module_of(Path({place!r}) / "own_measure.py", text.replace("NUMBER", "3"))
    print(kind, fingerprint(own.f))
"""


def test_it_is_the_same_in_every_process(tmp_path):
    """Whatever the order of sets, the place in memory, and what has been called."""
    here, place = Path(__file__).parent, str(tmp_path)
    folders = [str(here), str(here.parent / "support")]
    code = SCRIPT.format(folders=folders, place=place)
    told = []
    for seed in "12":
        own = {"PYTHONHASHSEED": seed, "PYTHONDONTWRITEBYTECODE": "1"}
        done = python(code, env=ENVIRONMENT | own, check=True)
        told.append(done.stdout.splitlines())
    assert len(told[0]) == len(EVERY)
    assert told[0] == told[1]


@pytest.mark.parametrize("kind", ["lru_cache", "vectorize", "cached measure"])
def test_calling_it_changes_nothing(tmp_path, kind):
    own = module_of(tmp_path / "own_measure.py", VALUES[kind].replace("NUMBER", "3"))
    before = fingerprint(own.f)
    own.f(1)
    assert fingerprint(own.f) == before


def test_a_cell_of_a_notebook_is_its_source():
    def cell(text, name):
        linecache.cache[name] = (len(text), None, text.splitlines(keepends=True), name)
        space = {"__name__": "__main__"}
        exec(compile(text, name, "exec"), space)
        return fingerprint(space["f"])

    one = cell("def f(c): return {'x': 1}\n", "<ipython-input-1-aa>")
    assert one == cell("def f(c): return {'x': 1}\n", "/tmp/ipykernel_7/8.py")
    assert one != cell("def f(c): return {'x': 2}\n", "<ipython-input-3-aa>")


def locked(_case, lock=threading.Lock()):  # noqa: B008
    return {"x": lock}


@pytest.mark.parametrize(
    ("function", "why"),
    [
        (len, "len is not written in Python"),
        (functools.partial(len), "not written in Python"),
        (eval("lambda c: 1"), "source of <lambda> cannot be read"),
        (locked, "uses a lock, which has no value that could be compared"),
    ],
)
def test_what_cannot_be_known_needs_a_version(function, why):
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


def test_bytecode_of_two_interpreters_is_not_compared():
    one, other = "cpython-311:a:s", "cpython-312:b:s"
    assert difference(one, other) == ""
    assert difference(one, "cpython-312:b:t") == "its source file"
    assert difference(one, "cpython-311:b:s").startswith("its code")
