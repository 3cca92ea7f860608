"""What is compiled, and when: no waiting for compilers, and nothing stale."""

import ast
import gc
import io
import operator
import os
import re
import shutil
import subprocess
import sys

import numpy as np
import pytest
from cost.sizes import fma_peak
from launch import ROOT, python
from llvmlite.binding import ModuleRef
from numba import njit
from numba.core.errors import TypingError
from rich.console import Console

from hpcwhirl.case.resolve import resolve
from hpcwhirl.cli import bench
from hpcwhirl.dynamics import kernel_cache
from hpcwhirl.dynamics.kernels import compiler
from hpcwhirl.dynamics.kernels.compiled import inlined, kernel, part, rare
from hpcwhirl.dynamics.kernels.loop import cyclic, passes, points
from hpcwhirl.dynamics.march import March
from hpcwhirl.scene import apply_settings, named_scene
from hpcwhirl.scene.schemes import NAMES

MARCHES = {"modal": points.march_points, "exact": points.march_points}
PRETEND = """
import os, pathlib, sys
cache = pathlib.Path(os.environ["NUMBA_CACHE_DIR"])
for word in ["all", *sys.argv[2:]]:
    (cache / f"{word}.nbc").touch()
"""


@pytest.mark.turns
@pytest.mark.parametrize("rotation", ["none", "full"])
@pytest.mark.parametrize("scheme", MARCHES)
def test_a_new_size_compiles_nothing(scheme, rotation):
    compiled = set()
    for settings in (
        {},
        {"blades": 8, "modes": 40, "harmonics": 5},
        {"blades": 13, "modes": 52, "kind": "rigid"},
        {"traces": "full", "nodal_diameter": 3},
    ):
        short = {"scheme": scheme, "plan": "everything", "duration": 1e-3}
        short |= {"rotation": rotation}
        scene = apply_settings(named_scene("table2"), short | settings)
        March(resolve(scene)).advance(20)
        compiled.add(len(MARCHES[scheme].signatures))
    assert len(compiled) == 1


def test_a_part_is_no_function_of_python():
    # it has no entry for Python: called, it would jump to nowhere
    with pytest.raises(TypeError, match="flush is for compiled code alone"):
        cyclic.flush(passes.sum_of)


@pytest.mark.parametrize("made", [part, inlined, rare])
def test_a_part_is_compiled_once_for_all_values_of_a_literal(made):
    @made
    def times(x, n):
        return x * n if n > 2 else x

    @kernel
    def both(x):
        return times(x, 2) + times(x, 5)

    assert both(0.1) == 0.1 + 0.1 * 5
    assert len(times.signatures) == 1


def test_a_kernel_is_the_same_function_for_python_and_for_compiled_code():
    @kernel
    def mean(values):
        total = 0.0
        for i in range(len(values)):
            total += values[i] / 3.0
        return total / len(values)

    @kernel
    def twice(values):
        return mean(values), mean(values[1:])

    values = np.random.default_rng(17).normal(size=101)
    assert twice(values) == (mean(values), mean(values[1:]))
    assert (len(mean.signatures), len(mean.twin.signatures)) == (1, 1)


def test_the_type_of_an_operation_is_worked_out_once(monkeypatch):
    asked, own = [], compiler.type_of_call

    def counted(operation, context, args, kws):
        asked.append((operation.typing_key, args))
        return own(operation, context, args, kws)

    monkeypatch.setattr(compiler, "TYPED", {})
    monkeypatch.setattr(compiler, "type_of_call", counted)

    @kernel
    def polynomial(x):
        return x * x * x + x * x + x

    assert polynomial(0.5) == 0.875
    times = [args for key, args in asked if key is operator.mul]
    assert len(times) == len(set(times)) == 1


def test_a_part_is_linked_once_into_a_kernel_and_whole_into_other_code(monkeypatch):
    @part
    def third(x):
        return int(3.0 * x) / 9.0

    @part
    def sixth(x):
        return third(x) / 2.0 + third(2.0 * x)

    def both(x):
        return sixth(x) + third(x)

    linked, link = [], ModuleRef.link_in

    def noted(module, other, preserve=False):
        if preserve:
            linked.append(other.name.rpartition(".")[2])
        link(module, other, preserve)

    monkeypatch.setattr(ModuleRef, "link_in", noted)
    assert kernel(both)(0.7) == 2 / 18 + 4 / 9 + 2 / 9
    assert (linked.count("third"), linked.count("sixth")) == (1, 1)
    assert njit(both)(0.7) == 2 / 18 + 4 / 9 + 2 / 9


def test_a_compilation_that_fails_leaves_the_collector_on():
    @kernel
    def wrong(x):
        return x.nothing_like_it

    with pytest.raises(TypingError):
        wrong(1.0)
    assert gc.isenabled()


def test_starts_are_told_with_what_they_compiled(monkeypatch):
    # a program in the place of a step: one function, and one for each new size
    monkeypatch.setattr(bench, "START", PRETEND)
    found = bench.start_of("modal")
    new = len(bench.STARTS["new_size"])
    counts = [found[f"{name}_compiled"] for name in bench.STARTS]
    assert (found["scheme"], counts) == ("modal", [1, new, 0])
    for name in bench.STARTS:
        assert found[f"{name}_seconds"] > 0
        assert found[f"{name}_processor_seconds"] >= 0
    out = io.StringIO()
    Console(file=out, width=120).print(bench._table_of_starts([found]))
    assert f"1, {new}, 0" in out.getvalue()
    assert len(re.findall(r"\d\.\d \(\d\.\d\)", out.getvalue())) == len(bench.STARTS)


def test_the_peak_is_that_of_work_that_was_done():
    assert 0.01 < fma_peak(1) < 1e4  # GFLOP/s; no work would do 1e5 and more


@pytest.mark.evidence  # all schemes at once: the next test
@pytest.mark.parametrize("scheme", NAMES)
def test_a_start_with_a_full_cache_compiles_nothing(scheme):
    found = bench.start_of(scheme)
    assert found["cold_compiled"] > 0
    assert found["new_size_compiled"] == 0
    assert found["warm_compiled"] == 0


RUN = """
import sys, tempfile
from pathlib import Path
from rotor_files import written
from stage import ANGLES, GAPS, STATIONS, N, by_modes, rotor
from hpcwhirl.case.resolve import resolve
from hpcwhirl.dynamics.march import March
from hpcwhirl.scene import apply_settings, named_scene
NAMES = sys.argv[2:]
shell = {"discretization": "shell", "axial_modes": 2, "harmonics": 4, "modes": 20}
full = {"rotation": "full"}

def marches(blades, points, own):
    unequal = {"mistuning": tuple(0.01 * (blade % 5 - 2) for blade in range(blades))}
    kinds = {}, full, unequal, full | unequal
    kinds = [(scheme, kind) for scheme in NAMES for kind in kinds
             if scheme != "exact" or unequal.items().isdisjoint(kind.items())]
    kinds += [("modal", full | {"acceleration": 100.0})]
    kinds += [("modal", {"contact_law": "archard"})]
    arrays = by_modes(rotor(STATIONS[:points], ANGLES[:points], GAPS[:points]))
    folder = tempfile.TemporaryDirectory()
    for name in "equal", "unequal":
        file = written(Path(folder.name, f"{name}.h5"), arrays)
        kinds += [("modal", shell | {"blades": N, "file": str(file)})]
        arrays["modal_tip_radial"][0] *= 1.0001
    own |= {"traces": "full", "duration": 2e-3}
    for scheme, kind in kinds:
        settings = own | kind | {"scheme": scheme}
        yield March(resolve(apply_settings(named_scene("table2"), settings)))

for march in marches(22, 3, {}):
    march.warm() if sys.argv[1] == "warm" else march.run()
if sys.argv[1] == "run":
    for march in marches(8, 2, {"blades": 8, "modes": 40, "harmonics": 5}):
        march.run()
"""


@pytest.mark.slow
def test_one_rank_that_warms_leaves_the_others_nothing_to_compile(tmp_path):
    """It fills the cache of a whole run of tests where that is empty (test.sh)."""
    cache = os.environ.get("NUMBA_CACHE_DIR", "")
    if not cache or bench._compiled(cache):
        cache = str(tmp_path)
    env = os.environ | {"NUMBA_CACHE_DIR": cache, "PYTHONPATH": ":".join(sys.path)}
    counts = []
    for what in ("warm", "run"):  # the latter of two sizes
        subprocess.run(
            [sys.executable, "-c", RUN, what, *NAMES], check=True, env=env
        )  # fmt: skip
        counts.append(bench._compiled(cache))
    assert counts[0] == counts[1] > 0


BITS = """
import hashlib
from hpcwhirl.case.resolve import resolve
from hpcwhirl.dynamics.kernel_cache import PLAIN
from hpcwhirl.dynamics.march import March
from hpcwhirl.scene import apply_settings, named_scene
for scheme in ("paper",):  # the quickest to compile so, in 40 s
    settings = {"scheme": scheme, "duration": 0.06, "blades": 12, "modes": 60}
    history = March(resolve(apply_settings(named_scene("table2"), settings))).run()
    assert history.last_contact > 0
    judged = history.judged
    rows = judged.centre, judged.energy, judged.fed
    text = b"".join(row.tobytes() for row in rows)
    print(PLAIN, scheme, hashlib.sha256(text).hexdigest())
"""


PAGE = '''"""A page about "hashes", as \'#\' is called."""
import os  # of the system


def scaled(x):  # a comment
    """Return twice x.

    x : m
    """
    mark = "# no comment" + '"#"'
    return 2.0 * x if x > 0.0 else mark
'''
SAME = {
    "a docstring of another length": ["    x : m\n", "    x : m, or\n\n    mm\n"],
    "no comment": ["  # a comment", ""],
    "a comment more": ["    mark", "    # it says\n    mark"],
    "blank lines": ["\n\n\n", "\n"],
    "a hash in a docstring": ["Return twice x.", "Return # x, 'twice."],
}
OTHERS = {
    "a constant": ["2.0 * x", "3.0 * x"],
    "an operator": ["x > 0.0", "x >= 0.0"],
    "a name": ["import os", "import re"],
    "a text": ["# no comment", "# a comment"],
    "an indentation": ["    return", "        return"],
    "code that was a comment": ["# of the system", "\nimport sys"],
}


@pytest.mark.parametrize("what", SAME | OTHERS)
def test_the_digest_is_that_of_the_code_without_what_explains_it(tmp_path, what):
    assert PAGE.count((SAME | OTHERS)[what][0]) == 1
    one, other = tmp_path / "page.py", tmp_path / "edited" / "page.py"
    other.parent.mkdir()
    one.write_text(PAGE)
    other.write_text(PAGE.replace(*(SAME | OTHERS)[what]))
    same = kernel_cache.digest_of([one]) == kernel_cache.digest_of([other])
    assert same == (what in SAME)


def tree_of(text):
    """The syntax tree of a module without what its docstrings say."""
    tree = ast.parse(text)
    for node in ast.walk(tree):
        kinds = ast.Module | ast.FunctionDef | ast.ClassDef
        if isinstance(node, kinds) and ast.get_docstring(node) is not None:
            node.body[0].value.value = ""
    return ast.dump(tree)


@pytest.mark.turns
@pytest.mark.parametrize("file", kernel_cache.FILES, ids=lambda file: file.stem)
def test_of_each_kernel_only_what_explains_it_is_left_out_of_the_digest(file):
    text = file.read_text()
    code = kernel_cache.code_of(text)
    assert tree_of(code) == tree_of(text)
    assert not re.search(r"(?m)^\s*$|^\s*#", code)
    assert all(not text for text in code.split('"' * 3)[1::2])


def test_a_text_with_other_triple_quotes_is_digested_as_it_is():
    text = PAGE.replace('"# no comment"', '"' * 3 + "# one" + '"' * 3)
    assert kernel_cache.code_of(text) == text


STEPS = """
from hpcwhirl.dynamics import kernel_cache
from hpcwhirl.dynamics.kernels.loop.flight import open_until
assert open_until(1.0, -2.0, 0.0) in (0.5, 1.0)
hits = sum(open_until.stats.cache_hits.values())
print(kernel_cache.DIGEST, open_until(1.0, -2.0, 0.0), hits)
"""


@pytest.mark.slow
def test_a_new_docstring_compiles_nothing_and_a_new_constant_does(tmp_path):
    shutil.copytree(ROOT / "hpcwhirl", tmp_path / "hpcwhirl")
    file = tmp_path / "hpcwhirl/dynamics/kernels/loop/flight.py"
    text = file.read_text()
    env = os.environ | {
        "PYTHONPATH": str(tmp_path), "NUMBA_CACHE_DIR": str(tmp_path / "cache"),
    }  # fmt: skip

    def started():
        return python(STEPS, env=env, cwd=tmp_path, check=True).stdout.split()

    first = started()
    assert first[1:] == ["0.5", "0"]
    begins = '):\n    """'  # the docstring of a function
    assert text.count(begins) > text.count("else -gap / rate") == 1
    text = "# a line more\n" + text.replace(begins, f"{begins}As said.\n\n    ")
    file.write_text(text)
    assert started() == [first[0], "0.5", "1"]
    file.write_text(text.replace("else -gap / rate", "else -2.0 * gap / rate"))
    again = started()
    assert again[0] != first[0]
    assert again[1:] == ["1.0", "0"]


PIECES = """
import hashlib
import numpy as np
from hpcwhirl.dynamics.kernel_cache import PLAIN
from hpcwhirl.dynamics.kernels import contact
from hpcwhirl.dynamics.kernels.compiled import inlined, kernel, part, rare

def times(x, n):
    return x * n + 0.1 * x if n > 2 else x / 3.0

made = [layer(times) for layer in (part, inlined, rare)]
one, two, three = made

@kernel
def all_of(values):
    total = 0.0
    for x in values:
        total += one(x, 2) * two(x, 5) - three(x, 7)
    return total

@kernel
def halves(values):
    return all_of(values), all_of(values[1:]) * contact.pulse_of(0.3, values[0], 1.0)

values = np.random.default_rng(5).normal(size=1001)
rows = np.array([all_of(values), *halves(values), contact.pulse_of(0.2, 7.0, 0.9)])
print(PLAIN, "pieces", hashlib.sha256(rows.tobytes()).hexdigest())
"""


@pytest.mark.slow
@pytest.mark.parametrize(
    "script", [PIECES, pytest.param(BITS, marks=pytest.mark.evidence)],
    ids=["pieces", "paper"],
)  # fmt: skip
def test_plain_numba_gives_the_same_bits(tmp_path, script):
    (tmp_path / "script.py").write_text(script)  # numba caches functions of files

    def bits(plain):
        own = {**os.environ, "HPCWHIRL_PLAIN_NUMBA": plain, "PYTHONPATH": str(ROOT)}
        made = subprocess.run(
            [sys.executable, tmp_path / "script.py"],
            env=own,
            capture_output=True,
            text=True,
            check=True,
        )
        return [line.split() for line in made.stdout.splitlines()]

    ours, plain = bits("0"), bits("1")
    assert [line[0] for line in ours + plain] == ["False", "True"]
    assert [line[1:] for line in ours] == [line[1:] for line in plain]
